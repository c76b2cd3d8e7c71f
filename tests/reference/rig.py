"""The rig's declared physics in plain Python: values, temperature laws, regularised equations, Radau integration.

Nothing here imports thsa_cosim: it is the yardstick that the exported FMUs are compared with.
Units are SI, temperature in degC.  A wave is a pair (times, values): linear between the times, constant outside.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import Radau

FloatArray = NDArray[np.float64]
Wave = tuple[FloatArray, FloatArray]

OUTPUTS = ("v", "x", "w_m", "i_q", "u_q")
MOTOR_OUTPUTS = ("w_m", "i_q", "u_q")
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
    """Half widths of the regularised sgn(v) = clip(v / width, -1, 1)."""

    motor: float  # rad/s, at the motor
    gearbox: float  # rad/s, at the gearbox output
    nut: float  # m/s


def rig_at(temperature: float, **changed: float) -> Rig:
    """The declared rig at a temperature in degC, with some values changed."""
    return Rig(**{**{name: law(temperature) for name, law in LAWS.items()}, **changed})


def drive(
    rig: Rig, w_ref: float, z_w: float, z_c: float, i_q: float, w_m: float
) -> tuple[float, float, float]:
    """Both PI controllers: (dz_w/dt, dz_c/dt, u_q); each integrator is held while its output saturates."""
    error = w_ref - w_m
    wanted = rig.K_p * error + z_w
    dz_w = rig.K_i * error if abs(wanted) <= rig.I_max else 0.0
    i_ref = max(-rig.I_max, min(rig.I_max, wanted))
    lag = i_ref - i_q
    wanted = rig.K_pc * lag + z_c
    dz_c = rig.K_ic * lag if abs(wanted) <= rig.U_max else 0.0
    return dz_w, dz_c, max(-rig.U_max, min(rig.U_max, wanted))


def actuator_rates(
    rig: Rig, y: FloatArray, v_cmd: float, F_load: float, s_m: float, s_g: float, s_n: float
) -> list[float]:
    """dy/dt of the actuator for given signs of motor, gearbox and nut speed, and u_q as a ninth entry.

    y = (z_w [A], z_c [V], i_q [A], w_m [rad/s], theta_g [rad], x [m], dx/dt [m/s], filtered v [m/s]).
    """
    z_w, z_c, i_q, w_m, theta_g, x, dx, v = y.tolist()
    w_g = w_m / rig.i
    dz_w, dz_c, u_q = drive(rig, v_cmd * rig.i / rig.k, z_w, z_c, i_q, w_m)
    F_s = rig.k_s * (rig.k * theta_g - x) + rig.d_s * (rig.k * w_g - dx)
    T_s = rig.k * F_s
    T_nb = rig.k_b * max(0.0, -T_s * s_g) * s_g
    T_g = T_s + T_nb + rig.T_fg * s_g + rig.b_g * w_g
    return [
        dz_w,
        dz_c,
        (u_q - rig.R_s * i_q - rig.K_t * w_m) / rig.L,
        (rig.K_t * i_q - rig.T_fm * s_m - rig.b_m * w_m - T_g / rig.i) / rig.J,
        w_g,
        dx,
        (F_s - rig.F_fn * s_n - rig.b_n * dx - F_load) / rig.M,
        (dx - v) / rig.tau_v,
        u_q,
    ]


def motor_rates(rig: Rig, y: FloatArray, w_cmd: float, s_m: float) -> list[float]:
    """dy/dt of the motor bench and u_q as a fifth entry; y = (z_w, z_c, i_q, w_m)."""
    z_w, z_c, i_q, w_m = y.tolist()
    dz_w, dz_c, u_q = drive(rig, w_cmd, z_w, z_c, i_q, w_m)
    di_q = (u_q - rig.R_s * i_q - rig.K_t * w_m) / rig.L
    return [dz_w, dz_c, di_q, (rig.K_t * i_q - rig.T_fm * s_m - rig.b_m * w_m) / rig.J, u_q]


def sign(speed: float, width: float) -> float:
    return max(-1.0, min(1.0, speed / width))


def _sign_slope(speed: float, width: float) -> float:
    return 1.0 / width if abs(speed) < width else 0.0


def _drive_jacobian(rig: Rig, jac: FloatArray, y: FloatArray, w_ref: float) -> None:
    """Rows 0..2 (z_w, z_c, i_q) of either bench."""
    wanted = rig.K_p * (w_ref - y[3]) + y[0]
    d_ref = np.zeros(len(y))
    if abs(wanted) <= rig.I_max:
        d_ref[0], d_ref[3] = 1.0, -rig.K_p
        jac[0, 3] = -rig.K_i
    i_ref = max(-rig.I_max, min(rig.I_max, wanted))
    d_lag = d_ref.copy()
    d_lag[2] -= 1.0
    if abs(rig.K_pc * (i_ref - y[2]) + y[1]) <= rig.U_max:
        jac[1] = rig.K_ic * d_lag
        jac[2] = rig.K_pc * d_lag / rig.L
        jac[2, 1] += 1.0 / rig.L
    jac[2, 2] -= rig.R_s / rig.L
    jac[2, 3] -= rig.K_t / rig.L


def actuator_jacobian(rig: Rig, y: FloatArray, v_cmd: float, widths: Widths) -> FloatArray:
    """d(dy/dt)/dy of the regularised actuator, (8, 8)."""
    jac = np.zeros((8, 8))
    _drive_jacobian(rig, jac, y, v_cmd * rig.i / rig.k)
    k, w_m, dx = rig.k, y[3], y[6]
    w_g = w_m / rig.i
    s_g = sign(w_g, widths.gearbox)
    d_F_s = np.array([0.0, 0.0, 0.0, rig.d_s * k / rig.i, rig.k_s * k, -rig.k_s, -rig.d_s, 0.0])
    T_s = k * (rig.k_s * (k * y[4] - y[5]) + rig.d_s * (k * w_g - dx))
    d_T_g = k * d_F_s
    slope = _sign_slope(w_g, widths.gearbox) / rig.i
    if T_s * s_g < 0.0:
        d_T_g = d_T_g * (1.0 - rig.k_b * s_g**2)
        d_T_g[3] -= 2.0 * rig.k_b * T_s * s_g * slope
    d_T_g[3] += rig.T_fg * slope + rig.b_g / rig.i
    jac[3] = -d_T_g / rig.i / rig.J
    jac[3, 2] += rig.K_t / rig.J
    jac[3, 3] -= (rig.T_fm * _sign_slope(w_m, widths.motor) + rig.b_m) / rig.J
    jac[4, 3] = 1.0 / rig.i
    jac[5, 6] = 1.0
    jac[6] = d_F_s / rig.M
    jac[6, 6] -= (rig.F_fn * _sign_slope(dx, widths.nut) + rig.b_n) / rig.M
    jac[7, 6], jac[7, 7] = 1.0 / rig.tau_v, -1.0 / rig.tau_v
    return jac


def motor_jacobian(rig: Rig, y: FloatArray, w_cmd: float, width: float) -> FloatArray:
    """d(dy/dt)/dy of the regularised motor bench, (4, 4)."""
    jac = np.zeros((4, 4))
    _drive_jacobian(rig, jac, y, w_cmd)
    jac[3, 2] = rig.K_t / rig.J
    jac[3, 3] = -(rig.T_fm * _sign_slope(y[3], width) + rig.b_m) / rig.J
    return jac


def kinks(*waves: Wave) -> FloatArray:
    """Times at which the slope of any wave changes."""
    found: list[FloatArray] = []
    for times, values in waves:
        slope = np.diff(values) / np.diff(times)
        turns = (
            np.flatnonzero(np.abs(np.diff(slope)) > 1e-9 * max(1e-300, float(np.abs(slope).max(initial=0.0))))
            + 1
        )
        found.append(np.concatenate([times[:1], times[turns], times[-1:]]))
    return np.unique(np.concatenate(found))


def integrate(
    rhs: Callable[[float, FloatArray], FloatArray],
    jac: Callable[[float, FloatArray], FloatArray],
    y0: FloatArray,
    time: FloatArray,
    restarts: FloatArray,
    rtol: float,
    atol: FloatArray,
) -> FloatArray:
    """States at `time` (n, len(y0)) by Radau, restarted at `restarts`, where the inputs have kinks."""
    states = np.empty((len(time), len(y0)))
    bounds = np.unique(
        np.concatenate([time[[0, -1]], restarts[(restarts > time[0]) & (restarts < time[-1])]])
    )
    y, step, done = y0, 1e-6, 0
    states[0] = y0
    for start, stop in zip(bounds[:-1], bounds[1:], strict=True):
        solver = Radau(rhs, start, y, stop, jac=jac, rtol=rtol, atol=atol, first_step=min(step, stop - start))
        while solver.status == "running":
            message = solver.step()
            if solver.status == "failed":
                raise ArithmeticError(f"Radau failed at {solver.t} s: {message}")
            last = int(np.searchsorted(time, solver.t, side="right")) - 1
            if last > done:
                states[done + 1 : last + 1] = solver.dense_output()(time[done + 1 : last + 1]).T
                done = last
            if solver.t < stop:
                step = max(1e-9, min(1e-4, solver.h_abs))
        y = solver.y
    return states


_ATOL = np.array(
    [1.0, 10.0, 1.0, 10.0, 1.0, 1e-3, 1e-3, 1e-3]
)  # times rtol: a tenth of each state's range or less


def rest(rig: Rig, F_load: float) -> FloatArray:
    """How the recordings start: screw angle 0, contact compressed by the load, all else 0."""
    return np.array([0.0, 0.0, 0.0, 0.0, 0.0, -F_load / rig.k_s, 0.0, 0.0])


def simulate(
    rig: Rig, v_cmd: Wave, F_load: Wave, time: FloatArray, widths: Widths, *, rtol: float = 1e-10
) -> dict[str, FloatArray]:
    """Outputs of the regularised actuator at `time` (n,), each (n,)."""

    def rhs(t: float, y: FloatArray) -> FloatArray:
        signs = sign(y[3], widths.motor), sign(y[3] / rig.i, widths.gearbox), sign(y[6], widths.nut)
        return np.array(
            actuator_rates(rig, y, float(np.interp(t, *v_cmd)), float(np.interp(t, *F_load)), *signs)[:8]
        )

    def jac(t: float, y: FloatArray) -> FloatArray:
        return actuator_jacobian(rig, y, float(np.interp(t, *v_cmd)), widths)

    y0 = rest(rig, float(np.interp(time[0], *F_load)))
    states = integrate(rhs, jac, y0, time, kinks(v_cmd, F_load), rtol, rtol * _ATOL)
    return outputs(rig, states, np.interp(time, *v_cmd))


def outputs(rig: Rig, states: FloatArray, v_cmd: FloatArray) -> dict[str, FloatArray]:
    """The five outputs from states (n, 8), and the true velocity as "dx"."""
    u_q = [
        drive(rig, v * rig.i / rig.k, *y[:4].tolist())[2] for v, y in zip(v_cmd.tolist(), states, strict=True)
    ]
    columns = {
        "v": states[:, 7],
        "x": states[:, 5],
        "w_m": states[:, 3],
        "i_q": states[:, 2],
        "dx": states[:, 6],
    }
    return {**columns, "u_q": np.array(u_q)}


def simulate_motor(
    rig: Rig, w_cmd: Wave, time: FloatArray, width: float, *, hold: bool = False, rtol: float = 1e-10
) -> dict[str, FloatArray]:
    """Outputs of the motor bench at `time` (n,); with `hold` each command lasts until the next one (as recorded)."""
    times, values = w_cmd

    def command(t: float) -> float:
        if hold:
            return float(values[max(0, int(np.searchsorted(times, t + 1e-9, side="right")) - 1)])
        return float(np.interp(t, times, values))

    states = np.empty((len(time), 4))
    states[0] = y = np.zeros(4)
    if not hold:
        states = _motor_piece(rig, command, y, time, kinks(w_cmd), width, rtol)
    else:
        jumps = times[1:][np.diff(values) != 0.0]
        edges = np.unique(np.concatenate([time[[0, -1]], jumps[(jumps > time[0]) & (jumps < time[-1])]]))
        for start, stop in zip(edges[:-1], edges[1:], strict=True):
            inside = (time > start) & (time <= stop)
            grid = np.unique(np.concatenate([[start], time[inside], [stop]]))
            piece = _motor_piece(rig, lambda _, c=command(start): c, y, grid, grid[:0], width, rtol)
            states[inside], y = piece[np.isin(grid, time[inside])], piece[-1]
    u_q = [drive(rig, command(t), *y.tolist())[2] for t, y in zip(time.tolist(), states, strict=True)]
    return {"w_m": states[:, 3], "i_q": states[:, 2], "u_q": np.array(u_q)}


def _motor_piece(
    rig: Rig,
    command: Callable[[float], float],
    y0: FloatArray,
    time: FloatArray,
    restarts: FloatArray,
    width: float,
    rtol: float,
) -> FloatArray:
    def rhs(t: float, y: FloatArray) -> FloatArray:
        return np.array(motor_rates(rig, y, command(t), sign(y[3], width))[:4])

    def jac(t: float, y: FloatArray) -> FloatArray:
        return motor_jacobian(rig, y, command(t), width)

    return integrate(rhs, jac, y0, time, restarts, rtol, rtol * _ATOL[:4])
