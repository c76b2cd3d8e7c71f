"""The compiled loop of `blind_plant`: one step of the drive, then of shaft and nut with set-valued friction."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

OUTPUTS = ("v", "x", "w_m", "i_q", "u_q")
_SWEEPS = 3  # of shaft and nut in turn; the shaft is 3500 times as heavy, so each gains three digits or more
#: Divisions by what stays the same become products, sums may be reordered; infinite values keep their meaning.
_LOOSE = {"error_model": "numpy", "fastmath": {"contract", "reassoc", "arcp", "nsz", "nnan"}}


class Rig(NamedTuple):
    """The declared parameters at one temperature."""

    R_s: float
    psi_pm: float
    T_fm: float
    b_m: float
    T_fg: float
    b_g: float
    F_fn: float
    b_n: float
    L: float = 2e-3
    J: float = 2e-3
    k_b: float = 1.15
    k_s: float = 3e8
    d_s: float = 5e5
    M: float = 200.0
    tau_v: float = 0.010
    p: float = 4.0
    i: float = 30.0
    k: float = 10e-3 / (2.0 * math.pi)
    K_p: float = 0.12
    K_i: float = 0.45
    K_pc: float = 4.0
    K_ic: float = 1000.0
    U_max: float = 190.0
    I_max: float = 40.0


class Undeclared(NamedTuple):
    """What a unit does beyond its drawing; every default is "not at all"."""

    # friction that depends on more than the sign of the speed
    stribeck_nut: float = 0.0  # N above Coulomb at breakaway
    stribeck_nut_speed: float = 1e-3  # m/s
    stribeck_motor: float = 0.0  # N.m
    stribeck_motor_speed: float = 10.0  # rad/s
    stribeck_exponent: float = 1.0  # of exp(-(v/v_S)^n); 0: 1/(1 + (v/v_S)^2)
    asymmetry_nut: float = 0.0  # N more forwards, as much less backwards
    asymmetry_nut_viscous: float = 0.0  # N/(m/s)
    asymmetry_gear: float = 0.0  # N.m at the gearbox output
    load_nut: float = 0.0  # share of the screw force
    load_gear: float = 0.0  # share of the screw torque
    slope_nut: float = 0.0  # N/m along the stroke
    rise_nut: float = 0.0  # N, a local rise ...
    rise_at: float = 0.0  # m
    rise_width: float = 1e-3  # m
    run_in_nut: float = 0.0  # N, fades with distance travelled
    run_in_nut_distance: float = 1.0  # m
    run_in_gear: float = 0.0  # N.m
    run_in_gear_angle: float = 1.0  # rad at the gearbox output
    windage: float = 0.0  # N.m at 100 rad/s
    windage_exponent: float = 2.0
    dwell: float = 0.0  # N above Coulomb after a long rest
    dwell_time: float = 1.0  # s
    dwell_slip: float = 2e-5  # m of sliding that renew the contact
    bristle: float = 0.0  # N/m, stiffness of the nut's friction before it slides; 0: rigid
    # forces and geometry
    gap: float = 0.0  # m, whole play between screw and nut
    gap_closed: float = 0.0  # 1: rests on the loaded flank at the start; 0: in the middle of the play
    cogging: float = 0.0  # N.m
    cogging_order: float = 24.0  # periods a motor revolution
    cogging_phase: float = 0.0
    cogging_second: float = 0.0  # second harmonic over the first
    ripple_torque: float = 0.0  # N.m at the screw
    ripple_share: float = 0.0  # of the screw torque
    lead_error: float = 0.0  # m
    ripple_turns: float = 1.0  # periods a screw revolution
    ripple_phase: float = 0.0
    spring: float = 0.0  # N/m, pulls the nut to its starting place
    vibration: float = 0.0  # N on the nut, not in the load cell
    vibration_frequency: float = 10.0  # Hz
    # motor and drive
    heating: float = 0.0  # K/J, one over the heat capacity of the winding
    cooling: float = 0.0  # 1/s
    heat_resistance: float = 0.00393  # 1/K
    heat_flux: float = 0.0  # 1/K
    saturation: float = 0.0  # 1/A, loss of torque constant
    saturation_square: float = 0.0  # 1/A2
    saturation_emf: float = 0.0  # 1: the back-EMF loses likewise
    dead_voltage: float = 0.0  # V
    dead_current: float = 0.1  # A, below which the ripple current softens it
    dead_sixth: float = 0.0  # its sixth electrical harmonic
    leak: float = 0.0  # 1/s, of the velocity controller's integrator
    # sensors: the drive controls what it measures
    current_gain: float = 1.0
    current_offset: float = 0.0  # A
    resolver: float = 0.0  # relative error of the speed ...
    resolver_order: float = 1.0  # periods a motor revolution
    velocity_gain: float = 1.0
    velocity_delay: float = 0.0  # s
    scale_error: float = 0.0  # m, interpolation error of the position scale ...
    scale_pitch: float = 1e-3  # m
    command_delay: float = 0.0  # s
    supply_lost: float = 0.0  # V less than U_max


_NONE = Undeclared()


@njit(inline="always", **_LOOSE)
def _held(momentum, backward, forward, inertia):
    """Speed after the step: momentum/inertia less a friction in [-backward, forward], 0 while that can hold it."""
    if momentum > forward:
        return (momentum - forward) / inertia
    if momentum < -backward:
        return (momentum + backward) / inertia
    return 0.0


@njit(inline="always", **_LOOSE)
def _at(times, values, piece, t):
    """Value of a piecewise-linear signal, and the piece that t lies in, searched from the last one on."""
    while piece < times.size and times[piece] <= t:
        piece += 1
    if piece == 0:
        return values[0], piece
    if piece == times.size:
        return values[-1], piece
    share = (t - times[piece - 1]) / (times[piece] - times[piece - 1])
    return values[piece - 1] + share * (values[piece] - values[piece - 1]), piece


@njit(**_LOOSE)
def _power(base, exponent):
    """`base` to the `exponent`, of which 1 and 2 are common and cheap."""
    if exponent == 2.0:
        return base * base
    return base if exponent == 1.0 else base**exponent


@njit(**_LOOSE)
def _stribeck(height, speed, scale, exponent):
    if height == 0.0:
        return 0.0
    if exponent == 0.0:  # Hess and Soom 1990
        return height / (1.0 + (speed / scale) ** 2)
    return height * math.exp(-_power(speed / scale, exponent))


@njit(**_LOOSE)
def _nut_friction(speed, x, force, travelled, age, rig, extra):
    """Largest friction in N that opposes motion of the nut forwards, and backwards."""
    friction = rig.F_fn + extra.load_nut * abs(force) + extra.slope_nut * x
    friction += _stribeck(extra.stribeck_nut, abs(speed), extra.stribeck_nut_speed, extra.stribeck_exponent)
    if extra.rise_nut != 0.0:
        friction += extra.rise_nut * math.exp(-(((x - extra.rise_at) / extra.rise_width) ** 2))
    if extra.run_in_nut != 0.0:
        friction += extra.run_in_nut * math.exp(-travelled / extra.run_in_nut_distance)
    if extra.dwell != 0.0:
        friction += extra.dwell * (1.0 - math.exp(-age / extra.dwell_time))
    more = extra.asymmetry_nut + extra.asymmetry_nut_viscous * abs(speed)
    return max(0.0, friction + more), max(0.0, friction - more)


@njit(**_LOOSE)
def _shaft_friction(speed, torque, turned, rig, extra):
    """Largest friction in N.m at the motor, no-back device included, forwards and backwards; torque at the screw."""
    motor = rig.T_fm + _stribeck(
        extra.stribeck_motor, abs(speed), extra.stribeck_motor_speed, extra.stribeck_exponent
    )
    if extra.windage != 0.0:
        motor += extra.windage * _power(abs(speed) * 0.01, extra.windage_exponent)
    gear = rig.T_fg + extra.load_gear * abs(torque)
    if extra.run_in_gear != 0.0:
        gear += extra.run_in_gear * math.exp(-turned / extra.run_in_gear_angle)
    forward = gear + extra.asymmetry_gear + rig.k_b * max(0.0, -torque)
    backward = gear - extra.asymmetry_gear + rig.k_b * max(0.0, torque)
    return max(0.0, motor + forward / rig.i), max(0.0, motor + backward / rig.i)


@njit(**_LOOSE)
def _saturated(current, extra):
    if extra.saturation == 0.0 and extra.saturation_square == 0.0:
        return 1.0
    return 1.0 / (1.0 + extra.saturation * abs(current) + extra.saturation_square * current**2)


@njit(**_LOOSE)
def _lost_voltage(current, angle, rig, extra):
    """Voltage that dead time takes: the sign of the current, softened by its ripple, with a sixth harmonic."""
    if extra.dead_voltage == 0.0:
        return 0.0
    share = max(-1.0, min(1.0, current / extra.dead_current))
    return extra.dead_voltage * share * (1.0 + extra.dead_sixth * math.cos(6.0 * rig.p * angle))


@njit(**_LOOSE)
def _measured(speed, angle, extra):
    if extra.resolver == 0.0:
        return speed
    return speed * (1.0 + extra.resolver * math.cos(extra.resolver_order * angle))


@njit(**_LOOSE)
def _squeeze(stretch, rate, rig, extra):
    """Force of the screw on the nut, and whether a flank touches; flanks push, they cannot pull."""
    if extra.gap == 0.0:
        return rig.k_s * stretch + rig.d_s * rate, True
    if stretch > 0.5 * extra.gap:
        force = rig.k_s * (stretch - 0.5 * extra.gap) + rig.d_s * rate
        return max(0.0, force), force > 0.0
    if stretch < -0.5 * extra.gap:
        force = rig.k_s * (stretch + 0.5 * extra.gap) + rig.d_s * rate
        return min(0.0, force), force < 0.0
    return 0.0, False


@njit(forceinline=True, **_LOOSE)
def _advance(rig, extra, c_times, c_values, f_times, f_values, rows, h, every):
    steps = round(rows * 1e-3 / h)
    found = np.zeros((steps // every + 1, 5))
    flux = math.sqrt(1.5) * rig.p * rig.psi_pm
    start, _ = _at(f_times, f_values, 0, 0.0)
    x = -start / rig.k_s
    side = 0.0 if start == 0.0 else math.copysign(0.5, start)
    theta = extra.gap_closed * side * extra.gap / rig.k  # of the gearbox output
    z_w = z_c = i_q = w = dx = v = acceleration = 0.0
    heat = travelled = turned = age = bristle = 0.0
    c_piece = f_piece = 0
    u_max = rig.U_max - extra.supply_lost
    lead_start = math.sin(extra.ripple_phase)
    found[0, 1] = x
    for n in range(steps):
        middle = (n + 0.5) * h
        target, c_piece = _at(c_times, c_values, c_piece, middle)
        load, f_piece = _at(f_times, f_values, f_piece, middle)
        if extra.vibration != 0.0:
            load -= extra.vibration * math.sin(2.0 * math.pi * extra.vibration_frequency * middle)

        # drive and winding, midpoint rule with the speed extrapolated by half a step
        w_mid = w + 0.5 * h * acceleration
        angle = theta * rig.i + 0.5 * h * w
        error = target * rig.i / rig.k - _measured(w_mid, angle, extra)
        growth = rig.K_i * error - extra.leak * z_w
        wanted = rig.K_p * error + z_w + 0.5 * h * growth
        i_ref = max(-rig.I_max, min(rig.I_max, wanted))
        if wanted == i_ref:
            z_w += h * growth
        magnet = flux * (1.0 - extra.heat_flux * heat)
        resistance = rig.R_s * (1.0 + extra.heat_resistance * heat)
        strength = _saturated(i_q, extra)
        emf = magnet * w_mid * (strength if extra.saturation_emf != 0.0 else 1.0)
        gain = rig.K_pc + 0.5 * h * rig.K_ic
        known = 2.0 * rig.L / h * i_q - emf - _lost_voltage(i_q, angle, rig, extra)
        i_mid = (known + gain * (i_ref - extra.current_offset) + z_c) / (
            2.0 * rig.L / h + gain * extra.current_gain + resistance
        )
        lag = i_ref - extra.current_gain * i_mid - extra.current_offset
        if abs(gain * lag + z_c) > u_max:
            i_mid = (known + math.copysign(u_max, gain * lag + z_c)) / (2.0 * rig.L / h + resistance)
        else:
            z_c += h * rig.K_ic * lag
        i_q = 2.0 * i_mid - i_q
        heat += h * (extra.heating * resistance * i_mid**2 - extra.cooling * heat)

        # shaft and nut
        drive = magnet * _saturated(i_mid, extra) * i_mid
        if extra.cogging != 0.0:
            turn = extra.cogging_order * angle + extra.cogging_phase
            drive -= extra.cogging * (math.sin(turn) + extra.cogging_second * math.sin(2.0 * turn))
        lead, lead_slope, share, ripple = 0.0, 0.0, 1.0, 0.0
        if extra.lead_error != 0.0 or extra.ripple_torque != 0.0 or extra.ripple_share != 0.0:
            turn = extra.ripple_turns * (theta + 0.5 * h * w / rig.i) + extra.ripple_phase
            lead = extra.lead_error * (math.sin(turn) - lead_start)
            lead_slope = extra.lead_error * extra.ripple_turns * math.cos(turn)
            share = 1.0 + extra.ripple_share * math.sin(turn)
            ripple = extra.ripple_torque * math.sin(turn)
        w_end, dx_end, dx_mid = w + h * acceleration, dx, dx
        force, z = 0.0, bristle
        for _ in range(_SWEEPS):
            w_mid, x_mid = 0.5 * (w + w_end), x + 0.5 * h * dx_mid
            slide = (rig.k + lead_slope) * w_mid / rig.i
            stretch = rig.k * (theta + 0.5 * h * w_mid / rig.i) + lead - x_mid
            force, touching = _squeeze(stretch, slide - dx_mid, rig, extra)
            resist = 0.5 * h * rig.k_s + rig.d_s if touching else 0.0  # of the contact, in the nut's speed
            outer = load + extra.spring * x_mid
            forward, backward = _nut_friction(dx_mid, x_mid, force, travelled, age, rig, extra)
            if extra.bristle != 0.0:  # LuGre without its viscous part: a spring that slips
                limit = forward if dx_mid > 0.0 else backward
                z = (bristle + h * dx_mid) / (1.0 + h * abs(dx_mid) * extra.bristle / limit)
                outer += extra.bristle * 0.5 * (z + bristle)
                forward = backward = 0.0
            inertia = rig.M / h + 0.5 * (resist + rig.b_n)
            momentum = dx * (rig.M / h - 0.5 * (resist + rig.b_n)) + force + resist * dx_mid - outer
            dx_end = _held(momentum, backward, forward, inertia)
            dx_mid = 0.5 * (dx + dx_end)

            torque = (rig.k + lead_slope) * force * share + ripple
            forward, backward = _shaft_friction(w_mid, torque, turned, rig, extra)
            viscous = rig.b_m + rig.b_g / rig.i**2
            momentum = w * (rig.J / h - 0.5 * viscous) + drive - torque / rig.i
            w_end = _held(momentum, backward, forward, rig.J / h + 0.5 * viscous)
        acceleration = (w_end - w) / h
        theta += 0.5 * h * (w + w_end) / rig.i
        x += h * dx_mid
        v = (v * (2.0 * rig.tau_v - h) + 2.0 * h * dx_mid) / (2.0 * rig.tau_v + h)
        travelled += h * abs(dx_mid)
        turned += 0.5 * h * abs(w + w_end) / rig.i
        if extra.dwell != 0.0:
            age = (age + h) / (1.0 + h * abs(dx_mid) / extra.dwell_slip)
        w, dx, bristle = w_end, dx_end, z

        if (n + 1) % every == 0:
            target, _ = _at(c_times, c_values, c_piece, (n + 1) * h)
            seen = _measured(w, theta * rig.i, extra)
            i_ref = rig.K_p * (target * rig.i / rig.k - seen) + z_w
            i_ref = max(-rig.I_max, min(rig.I_max, i_ref))
            i_seen = extra.current_gain * i_q + extra.current_offset
            u_q = max(-u_max, min(u_max, rig.K_pc * (i_ref - i_seen) + z_c))
            row = (n + 1) // every
            found[row, 0], found[row, 1], found[row, 2] = v, x, seen
            found[row, 3], found[row, 4] = i_seen, u_q
    return found


@njit(cache=True, **_LOOSE)
def advance(rig, extra, c_times, c_values, f_times, f_values, rows, h, every):
    """Outputs at 0, `every` steps, ... up to `rows` ms, (n, 5) in the order of OUTPUTS; starts at rest."""
    return _advance(rig, extra, c_times, c_values, f_times, f_values, rows, h, every)


@njit(cache=True, **_LOOSE)
def advance_declared(rig, c_times, c_values, f_times, f_values, rows, h, every):
    """`advance` of a rig that does nothing undeclared: the effects, constant here, are compiled away."""
    return _advance(rig, _NONE, c_times, c_values, f_times, f_values, rows, h, every)
