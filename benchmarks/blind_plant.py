"""A second plant of the rig for the blind benchmark: written from its equations alone, stepped by Moreau and Jean.

Friction is a force in a set, not a function of speed: in every step the momentum balance of the shaft and of
the nut is solved with the speed at the end of the step as unknown, which is zero exactly while a force inside
the set can hold it (Moreau 1988, Jean 1999). All else is the implicit midpoint rule, which takes the contact
and the current loop at any stiffness. What the declared physics lacks comes as `Undeclared`, neutral by default.

SI units; angles in rad, temperatures in degC.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from blind_steps import OUTPUTS, advance
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

STEP = 2e-5  # s
RECORD_EVERY = 10  # steps: 0.2 ms, of which the sensors see every fifth


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


class Wave(NamedTuple):
    """A signal linear between `times` (n,) and constant outside."""

    times: FloatArray
    values: FloatArray

    def delayed(self, seconds: float) -> Wave:
        return Wave(self.times + seconds, self.values)


def declared(temperature: float) -> Rig:
    """The rig of the drawing at `temperature` in degC (tables II and III of the article)."""
    t = temperature
    return Rig(
        R_s=1.2 + 3e-2 * t + 7e-5 * t**2 - 5e-6 * t**3,
        psi_pm=0.1 + 6e-5 * t - 4e-6 * t**2,
        T_fm=1e-2 * math.exp(-4e-2 * t) + 3e-2 * math.exp(9e-3 * t),
        b_m=4e-5 + 2e-8 * t + 1e-8 * t**2 + 1e-10 * t**3,
        T_fg=11.0 - 0.25 * t + 2e-4 * t**2,
        b_g=-6e-7 + 1.8e-7 * t,
        F_fn=2.7e3 + 37.0 * t - 1.4 * t**2 - 0.07 * t**3,
        b_n=4e4 - 3e3 * t + 230.0 * t**2,
    )


def simulate(
    rig: Rig, command: Wave, load: Wave, rows: int, undeclared: Undeclared | None = None
) -> dict[str, FloatArray]:
    """What ideal sensors show at 1, 2, ... `rows` ms: v, x, w_m, i_q, u_q, each (rows,) in SI units."""
    extra = undeclared or Undeclared()
    driven = command.delayed(extra.command_delay)
    fine = advance(
        Rig(*map(float, rig)), Undeclared(*map(float, extra)), *driven, *load, rows, STEP, RECORD_EVERY
    )
    per_row = (fine.shape[0] - 1) // rows
    found = dict(zip(OUTPUTS, fine[per_row::per_row].T.copy(), strict=True))
    if extra.velocity_delay:
        seconds = np.arange(fine.shape[0]) * STEP * RECORD_EVERY
        found["v"] = np.interp(seconds[per_row::per_row] - extra.velocity_delay, seconds, fine[:, 0])
    found["v"] *= extra.velocity_gain
    if extra.scale_error:
        found["x"] += extra.scale_error * np.sin(2.0 * np.pi * found["x"] / extra.scale_pitch)
    return found
