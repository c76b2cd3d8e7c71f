"""The rig's declared physics in plain Python: values, temperature laws, equations with regularised signs.

Nothing here imports thsa_cosim: it is the yardstick that the exported FMUs are compared with.
Units are SI, temperature in degC.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
State = Sequence[float]

LAWS: dict[str, Callable[[float], float]] = {
    "R_s": lambda t: 1.2 + 3e-2 * t + 7e-5 * t**2 - 5e-6 * t**3,
    "psi_pm": lambda t: 0.1 + 6e-5 * t - 4e-6 * t**2,
    "T_fm": lambda t: 1e-2 * math.exp(-4e-2 * t) + 3e-2 * math.exp(9e-3 * t),
    "b_m": lambda t: 4e-5 + 2e-8 * t + 1e-8 * t**2 + 1e-10 * t**3,
    "T_fg": lambda t: 11.0 - 0.25 * t + 2e-4 * t**2,
    "b_g": lambda t: -6e-7 + 1.8e-7 * t,
    "F_fn": lambda t: 2.7e3 + 37.0 * t - 1.4 * t**2 - 0.07 * t**3,
    "b_n": lambda t: 4e4 - 3e3 * t + 230.0 * t**2,
}


@dataclass(frozen=True)
class Rig:
    """The rig at one temperature; the eight law values have no default, see `rig_at`."""

    R_s: float
    psi_pm: float
    T_fm: float
    b_m: float
    T_fg: float
    b_g: float
    F_fn: float
    b_n: float
    K_p: float = 0.12
    K_i: float = 0.45
    K_pc: float = 4.0
    K_ic: float = 1000.0
    U_max: float = 190.0
    I_max: float = 40.0
    p: float = 4.0
    L: float = 2e-3
    J: float = 2e-3
    i: float = 30.0
    P_h: float = 10e-3
    k_b: float = 1.15
    M: float = 200.0
    k_s: float = 3e8
    d_s: float = 5e5
    tau_v: float = 0.010

    @property
    def k(self) -> float:
        """Screw lead in m/rad."""
        return self.P_h / (2.0 * math.pi)

    @property
    def K_t(self) -> float:
        """Torque constant in N.m/A (published eq. 4)."""
        return math.sqrt(1.5) * self.p * self.psi_pm


@dataclass(frozen=True)
class Widths:
    """Regularisation: half widths of sgn(v) = clip(v / width, -1, 1), and of the integrators' hold.

    An integrator is held where its output is beyond the limit by `hold` or more, free below the limit, faded
    linearly in between.
    """

    motor: float  # rad/s, at the motor
    gearbox: float  # rad/s, at the gearbox output; the no-back device has the same
    nut: float  # m/s
    hold_current: float = 0.04  # A
    hold_voltage: float = 0.19  # V


#: Those of the package's actuator.
NARROW = Widths(motor=3e-4, gearbox=1e-5, nut=1e-8)


def rig_at(temperature: float, **changed: float) -> Rig:
    """The declared rig at a temperature in degC, with some values changed."""
    return Rig(**{**{name: law(temperature) for name, law in LAWS.items()}, **changed})


def sign(speed: float, width: float) -> float:
    return max(-1.0, min(1.0, speed / width))


def _slope(speed: float, width: float) -> float:
    return 1.0 / width if abs(speed) < width else 0.0


def _limit(wanted: float, limit: float, band: float) -> tuple[float, float]:
    """(limited output, share of the error that is integrated)."""
    return max(-limit, min(limit, wanted)), max(0.0, min(1.0, 1.0 - (abs(wanted) - limit) / band))


def drive(rig: Rig, widths: Widths, w_ref: float, y: State) -> tuple[float, float, float, float]:
    """Both PI controllers and the winding: dz_w/dt, dz_c/dt, di_q/dt, u_q; y = (z_w, z_c, i_q, w_m, ...)."""
    error = w_ref - y[3]
    i_ref, share_w = _limit(rig.K_p * error + y[0], rig.I_max, widths.hold_current)
    lag = i_ref - y[2]
    u_q, share_c = _limit(rig.K_pc * lag + y[1], rig.U_max, widths.hold_voltage)
    di_q = (u_q - rig.R_s * y[2] - rig.K_t * y[3]) / rig.L
    return share_w * rig.K_i * error, share_c * rig.K_ic * lag, di_q, u_q


def actuator_rates(
    rig: Rig,
    widths: Widths,
    y: State,
    v_cmd: float,
    F_load: float,
    signs: tuple[float, float, float],
) -> list[float]:
    """dy/dt of the actuator (8,) for the signs of motor, gearbox and nut speed.

    y = (z_w [A], z_c [V], i_q [A], w_m [rad/s], theta_g [rad], x [m], dx/dt [m/s], filtered v [m/s]).
    """
    i_q, w_m, theta_g, x, dx, v = y[2:]
    s_m, s_g, s_n = signs
    w_g = w_m / rig.i
    dz_w, dz_c, di_q, _ = drive(rig, widths, v_cmd * rig.i / rig.k, y)
    F_s = rig.k_s * (rig.k * theta_g - x) + rig.d_s * (rig.k * w_g - dx)
    T_s = rig.k * F_s
    T_nb = rig.k_b * max(0.0, -T_s * s_g) * s_g
    T_g = T_s + T_nb + rig.T_fg * s_g + rig.b_g * w_g
    dw_m = (rig.K_t * i_q - rig.T_fm * s_m - rig.b_m * w_m - T_g / rig.i) / rig.J
    ddx = (F_s - rig.F_fn * s_n - rig.b_n * dx - F_load) / rig.M
    return [dz_w, dz_c, di_q, dw_m, w_g, dx, ddx, (dx - v) / rig.tau_v]


def motor_rates(rig: Rig, widths: Widths, y: State, w_cmd: float, s_m: float) -> list[float]:
    """dy/dt of the motor bench (4,); y = (z_w, z_c, i_q, w_m)."""
    dz_w, dz_c, di_q, _ = drive(rig, widths, w_cmd, y)
    return [dz_w, dz_c, di_q, (rig.K_t * y[2] - rig.T_fm * s_m - rig.b_m * y[3]) / rig.J]


def actuator_signs(rig: Rig, widths: Widths, y: State) -> tuple[float, float, float]:
    return sign(y[3], widths.motor), sign(y[3] / rig.i, widths.gearbox), sign(y[6], widths.nut)


def _drive_jacobian(rig: Rig, widths: Widths, jac: FloatArray, y: State, w_ref: float) -> None:
    """Rows 0 to 2 (z_w, z_c, i_q) of either bench."""
    error = w_ref - y[3]
    wanted = rig.K_p * error + y[0]
    i_ref, share = _limit(wanted, rig.I_max, widths.hold_current)
    d_wanted = np.zeros(len(y))
    d_wanted[0], d_wanted[3] = 1.0, -rig.K_p
    jac[0, 3] = -share * rig.K_i
    if 0.0 < share < 1.0:
        jac[0] -= rig.K_i * error * math.copysign(1.0 / widths.hold_current, wanted) * d_wanted
    d_lag = d_wanted if abs(wanted) <= rig.I_max else np.zeros(len(y))
    d_lag[2] -= 1.0
    lag = i_ref - y[2]
    wanted = rig.K_pc * lag + y[1]
    _, share = _limit(wanted, rig.U_max, widths.hold_voltage)
    d_wanted = rig.K_pc * d_lag
    d_wanted[1] += 1.0
    jac[1] = share * rig.K_ic * d_lag
    if 0.0 < share < 1.0:
        jac[1] -= rig.K_ic * lag * math.copysign(1.0 / widths.hold_voltage, wanted) * d_wanted
    if abs(wanted) <= rig.U_max:
        jac[2] = d_wanted / rig.L
    jac[2, 2] -= rig.R_s / rig.L
    jac[2, 3] -= rig.K_t / rig.L


def actuator_jacobian(rig: Rig, widths: Widths, y: State, v_cmd: float) -> FloatArray:
    """d(dy/dt)/dy of the regularised actuator, (8, 8)."""
    jac = np.zeros((8, 8))
    _drive_jacobian(rig, widths, jac, y, v_cmd * rig.i / rig.k)
    k, w_m, dx = rig.k, y[3], y[6]
    w_g = w_m / rig.i
    s_g = sign(w_g, widths.gearbox)
    d_F_s = np.array([0.0, 0.0, 0.0, rig.d_s * k / rig.i, rig.k_s * k, -rig.k_s, -rig.d_s, 0.0])
    T_s = k * (rig.k_s * (k * y[4] - y[5]) + rig.d_s * (k * w_g - dx))
    d_T_g = k * d_F_s
    slope = _slope(w_g, widths.gearbox) / rig.i
    if T_s * s_g < 0.0:
        d_T_g = d_T_g * (1.0 - rig.k_b * s_g**2)
        d_T_g[3] -= 2.0 * rig.k_b * T_s * s_g * slope
    d_T_g[3] += rig.T_fg * slope + rig.b_g / rig.i
    jac[3] = -d_T_g / rig.i / rig.J
    jac[3, 2] += rig.K_t / rig.J
    jac[3, 3] -= (rig.T_fm * _slope(w_m, widths.motor) + rig.b_m) / rig.J
    jac[4, 3] = 1.0 / rig.i
    jac[5, 6] = 1.0
    jac[6] = d_F_s / rig.M
    jac[6, 6] -= (rig.F_fn * _slope(dx, widths.nut) + rig.b_n) / rig.M
    jac[7, 6], jac[7, 7] = 1.0 / rig.tau_v, -1.0 / rig.tau_v
    return jac


def motor_jacobian(rig: Rig, widths: Widths, y: State, w_cmd: float) -> FloatArray:
    """d(dy/dt)/dy of the regularised motor bench, (4, 4)."""
    jac = np.zeros((4, 4))
    _drive_jacobian(rig, widths, jac, y, w_cmd)
    jac[3, 2] = rig.K_t / rig.J
    jac[3, 3] = -(rig.T_fm * _slope(y[3], widths.motor) + rig.b_m) / rig.J
    return jac
