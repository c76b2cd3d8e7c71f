"""The regularised rig integrated by SciPy's Radau with the exact Jacobian, restarted at the inputs' kinks."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
from scipy.integrate import Radau

from reference.rig import (
    FloatArray,
    Rig,
    Widths,
    actuator_jacobian,
    actuator_rates,
    actuator_signs,
    drive,
    motor_jacobian,
    motor_rates,
    sign,
)
from reference.waves import Wave, pieces

OUTPUTS = ("v", "x", "w_m", "i_q", "u_q")
MOTOR_OUTPUTS = ("w_m", "i_q", "u_q")
_SCALE = np.array([1.0, 10.0, 1.0, 10.0, 1.0, 1e-3, 1e-3, 1e-3])  # rtol * this = atol: a tenth of each range

Rates = Callable[[float, FloatArray], list[float]]
Jacobian = Callable[[float, FloatArray], FloatArray]


def integrate(
    rates: Rates, jacobian: Jacobian, y0: FloatArray, time: FloatArray, edges: FloatArray, rtol: float
) -> FloatArray:
    """States at `time`, (n, len(y0)); raises ArithmeticError where Radau gives up."""
    states = np.empty((len(time), len(y0)))
    states[0] = y = y0
    step, done = 1e-6, 0
    for start, stop in itertools.pairwise(edges.tolist()):
        # inputs are evaluated strictly inside the piece, where a held one has one value
        inside = np.nextafter(start, stop), np.nextafter(stop, start)
        solver = Radau(
            lambda t, y, inside=inside: np.array(rates(min(max(t, inside[0]), inside[1]), y)),
            start,
            y,
            stop,
            jac=lambda t, y, inside=inside: jacobian(min(max(t, inside[0]), inside[1]), y),
            rtol=rtol,
            atol=rtol * _SCALE[: len(y0)],
            first_step=min(step, stop - start),
        )
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


def rest(rig: Rig, F_load: float) -> FloatArray:
    """How the recordings start: screw angle 0, contact compressed by the load, all else 0."""
    return np.array([0.0, 0.0, 0.0, 0.0, 0.0, -F_load / rig.k_s, 0.0, 0.0])


def simulate_states(
    rig: Rig, v_cmd: Wave, F_load: Wave, time: FloatArray, widths: Widths, *, rtol: float = 1e-10
) -> FloatArray:
    """States of the regularised actuator at `time`, (n, 8)."""

    def rates(t: float, y: FloatArray) -> list[float]:
        state = y.tolist()
        return actuator_rates(rig, widths, state, v_cmd(t), F_load(t), actuator_signs(rig, widths, state))

    def jacobian(t: float, y: FloatArray) -> FloatArray:
        return actuator_jacobian(rig, widths, y.tolist(), v_cmd(t))

    start = rest(rig, F_load(float(time[0])))
    return integrate(rates, jacobian, start, time, pieces(time, v_cmd, F_load), rtol)


def simulate(
    rig: Rig, v_cmd: Wave, F_load: Wave, time: FloatArray, widths: Widths, *, rtol: float = 1e-10
) -> dict[str, FloatArray]:
    """Outputs of the regularised actuator at `time` (n,), each (n,); "dx" is the true velocity."""
    states = simulate_states(rig, v_cmd, F_load, time, widths, rtol=rtol)
    return outputs(rig, widths, states, v_cmd.at(time))


def outputs(rig: Rig, widths: Widths, states: FloatArray, v_cmd: FloatArray) -> dict[str, FloatArray]:
    """The five outputs and the true velocity "dx" from states (n, 8) and the command (n,)."""
    command = v_cmd * rig.i / rig.k
    u_q = [drive(rig, widths, w, y)[3] for w, y in zip(command.tolist(), states.tolist(), strict=True)]
    columns = {"v": 7, "x": 5, "w_m": 3, "i_q": 2, "dx": 6}
    return {**{name: states[:, j] for name, j in columns.items()}, "u_q": np.array(u_q)}


def simulate_motor(
    rig: Rig, w_cmd: Wave, time: FloatArray, widths: Widths, *, rtol: float = 1e-10
) -> dict[str, FloatArray]:
    """Outputs of the regularised motor bench at `time` (n,), from rest."""

    def rates(t: float, y: FloatArray) -> list[float]:
        return motor_rates(rig, widths, y.tolist(), w_cmd(t), sign(y[3], widths.motor))

    def jacobian(t: float, y: FloatArray) -> FloatArray:
        return motor_jacobian(rig, widths, y.tolist(), w_cmd(t))

    states = integrate(rates, jacobian, np.zeros(4), time, pieces(time, w_cmd), rtol)
    commands = w_cmd.at(time).tolist()
    u_q = [drive(rig, widths, w, y)[3] for w, y in zip(commands, states.tolist(), strict=True)]
    return {"w_m": states[:, 3], "i_q": states[:, 2], "u_q": np.array(u_q)}
