"""A cold soak and a warm-up in one recording: motor and screw on their benches while the chamber goes from -55 degC up.

The rig's declared physics, integrated by a classical Runge-Kutta method with 50 us; no FMU is involved. The chamber
warms at 5.3 K/min; motor and screw follow it with lags of their own, and their own sensors measure them. Sensor noise
and steps are those of the other recordings.
"""

from __future__ import annotations

import numba
import numpy as np

from reference.rig import LAWS, FloatArray, Rig, Widths, rig_at

END, STEP = 1200.0, 0.02  # s
SOAK, RATE = 30.0, 5.3 / 60.0  # s, K/s
LAGS = {"motor": 150.0, "screw": 300.0}  # s, behind the chamber
INNER = 5e-5  # s, of the integration
SPEEDS = np.array([20.0, 60.0, 100.0, 140.0, 180.0])  # rad/s
VELOCITIES = np.array([0.5, 1.0, 2.0, 4.5, 6.0, 9.0]) * 1e-3  # m/s
DWELL = 2.0  # s at each speed
NOISE = {"w_m": 0.2, "i_q": 0.05, "u_q": 0.3, "v": 2e-5, "F": 60.0, "T": 0.2}
QUANTUM = {"w_m": 0.05, "i_q": 0.01, "u_q": 0.1, "v": 5e-6, "F": 10.0, "T": 0.1}


def times() -> FloatArray:
    """(n,) s of the samples."""
    return np.arange(round(END / STEP)) * STEP


def temperature(part: str, time: FloatArray) -> FloatArray:
    """(n,) degC of a part: a ramp behind a first-order lag."""
    lag, since = LAGS[part], np.maximum(time - SOAK, 0.0)
    return np.asarray(-55.0 + RATE * (since - lag * (1.0 - np.exp(-since / lag))))


def plateaus(levels: FloatArray, time: FloatArray, seed: int) -> FloatArray:
    """(n,) levels both ways in random order, each for DWELL s, held."""
    rng = np.random.default_rng(seed)
    both = np.concatenate([levels, -levels])
    turns = int(np.ceil(time[-1] / DWELL / len(both))) + 1
    order = np.concatenate([rng.permutation(both) for _ in range(turns)])
    return order[(time // DWELL).astype(int)]


@numba.njit(cache=True)
def _rates(y, w_ref, law, fixed):
    R_s, psi, T_fm, b_m = law
    K_p, K_i, K_pc, K_ic, U_max, I_max, p, L, J, width, hold_i, hold_u = fixed
    K_t = np.sqrt(1.5) * p * psi
    error = w_ref - y[3]
    wanted = K_p * error + y[0]
    i_ref = max(-I_max, min(I_max, wanted))
    dz_w = max(0.0, min(1.0, 1.0 - (abs(wanted) - I_max) / hold_i)) * K_i * error
    lag = i_ref - y[2]
    wanted = K_pc * lag + y[1]
    u_q = max(-U_max, min(U_max, wanted))
    dz_c = max(0.0, min(1.0, 1.0 - (abs(wanted) - U_max) / hold_u)) * K_ic * lag
    di_q = (u_q - R_s * y[2] - K_t * y[3]) / L
    sign = max(-1.0, min(1.0, y[3] / width))
    return np.array([dz_w, dz_c, di_q, (K_t * y[2] - T_fm * sign - b_m * y[3]) / J]), u_q


@numba.njit(cache=True)
def _integrate(commands, laws, fixed, step, inner):
    """States (n, 4) and voltages (n,) at the samples; command and laws are held over a sample."""
    n = len(commands)
    states, voltages = np.empty((n, 4)), np.empty(n)
    y, turns = np.zeros(4), round(step / inner)
    h = step / turns
    for k in range(n):
        states[k] = y
        voltages[k] = _rates(y, commands[k], laws[k], fixed)[1]
        for _ in range(turns):
            a = _rates(y, commands[k], laws[k], fixed)[0]
            b = _rates(y + 0.5 * h * a, commands[k], laws[k], fixed)[0]
            c = _rates(y + 0.5 * h * b, commands[k], laws[k], fixed)[0]
            d = _rates(y + h * c, commands[k], laws[k], fixed)[0]
            y = y + h / 6.0 * (a + 2.0 * b + 2.0 * c + d)
    return states, voltages


def motor(
    commands: FloatArray, temperatures: FloatArray, widths: Widths, step: float = STEP
) -> dict[str, FloatArray]:
    """Outputs of the motor bench, each (n,), for commands (n,) in rad/s and temperatures (n,) in degC."""
    rig: Rig = rig_at(25.0)
    laws = np.array([[LAWS[n](t) for n in ("R_s", "psi_pm", "T_fm", "b_m")] for t in temperatures.tolist()])
    fixed = (rig.K_p, rig.K_i, rig.K_pc, rig.K_ic, rig.U_max, rig.I_max, rig.p, rig.L, rig.J)
    widened = (*fixed, widths.motor, widths.hold_current, widths.hold_voltage)
    states, voltages = _integrate(commands, laws, widened, step, INNER)
    return {"w_m": states[:, 3], "i_q": states[:, 2], "u_q": voltages}


def screw(v: FloatArray, temperatures: FloatArray) -> FloatArray:
    """Force (n,) of the load cell for velocities (n,) and temperatures (n,)."""
    return np.array(
        [
            LAWS["F_fn"](t) * np.sign(speed) + LAWS["b_n"](t) * speed
            for speed, t in zip(v.tolist(), temperatures.tolist(), strict=True)
        ]
    )


def measured(name: str, true: FloatArray, rng: np.random.Generator) -> FloatArray:
    """What the sensor of ``name`` gives (n,)."""
    read = true + NOISE[name] * rng.standard_normal(true.shape)
    return np.asarray(np.round(read / QUANTUM[name]) * QUANTUM[name])


def recording(seed: int = 1) -> dict[str, FloatArray]:
    """The columns of the recording, each (n,), in the units of their names."""
    rng, time = np.random.default_rng(seed), times()
    T_motor, T_screw = temperature("motor", time), temperature("screw", time)
    command, v = plateaus(SPEEDS, time, seed), plateaus(VELOCITIES, time, seed + 1)
    found = motor(command, T_motor, Widths(motor=3e-3, gearbox=1e-4, nut=1e-7))
    return {
        "time_s": np.round(time, 3),
        "motor_temperature_degC": measured("T", T_motor, rng),
        "screw_temperature_degC": measured("T", T_screw, rng),
        "speed_command_rad_s": command,
        "motor_speed_rad_s": measured("w_m", found["w_m"], rng),
        "q_current_A": measured("i_q", found["i_q"], rng),
        "q_voltage_V": measured("u_q", found["u_q"], rng),
        "velocity_mm_s": np.round(measured("v", v, rng) * 1e3, 6),
        "force_kN": np.round(measured("F", screw(v, T_screw), rng) * 1e-3, 6),
    }
