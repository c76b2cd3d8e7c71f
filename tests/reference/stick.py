"""The rig with true stick: each friction sticks or slides, switched at located events; no regularised sign.

Between events the equations are smooth and not stiff (fastest eigenvalue below 1e4 1/s), so an explicit
method of order 8 serves.  Decides how narrow the regularisation must be, and plays the real rig in
benchmarks.
"""

from __future__ import annotations

import itertools

import numpy as np
from scipy.integrate import solve_ivp

from reference.radau import outputs, rest
from reference.rig import FloatArray, Rig, Widths, actuator_rates
from reference.waves import Wave, pieces

_NO_WIDTHS = Widths(motor=1.0, gearbox=1.0, nut=1.0)  # only the integrators' hold is used here
_SPEED = {"shaft": 3, "nut": 6}  # state that sticks
_MARGIN = 1e-6  # m/s2 or rad/s2: a part that came to rest at the limit of its friction stays
Modes = dict[str, int]  # -1 slides backwards, 0 sticks, 1 slides forwards


def rates(rig: Rig, modes: Modes, y: FloatArray, v_cmd: float, F_load: float) -> list[float]:
    shaft, nut = modes["shaft"], modes["nut"]
    dy = actuator_rates(rig, _NO_WIDTHS, y.tolist(), v_cmd, F_load, (shaft, shaft, nut))
    if shaft == 0:
        dy[3] = dy[4] = 0.0
    if nut == 0:
        dy[5] = dy[6] = 0.0
    return dy


def excess(rig: Rig, part: str, way: int, modes: Modes, y: FloatArray, v_cmd: float, F_load: float) -> float:
    """Acceleration of `part` if it slid in direction `way` (1 or -1): it breaks away where positive."""
    dy = actuator_rates(
        rig,
        _NO_WIDTHS,
        y.tolist(),
        v_cmd,
        F_load,
        (way, way, modes["nut"]) if part == "shaft" else (modes["shaft"], modes["shaft"], way),
    )
    return way * dy[_SPEED[part]]


def simulate_stick(
    rig: Rig, v_cmd: Wave, F_load: Wave, time: FloatArray, *, rtol: float = 1e-9
) -> dict[str, FloatArray]:
    """Outputs of the actuator with true stick at `time` (n,), as `radau.simulate`."""
    states = np.empty((len(time), 8))
    states[0] = y = rest(rig, F_load(float(time[0])))
    modes: Modes = {"shaft": 0, "nut": 0}
    scale = np.array([1.0, 10.0, 1.0, 10.0, 1.0, 1e-3, 1e-3, 1e-3])
    for start, stop in itertools.pairwise(pieces(time, v_cmd, F_load).tolist()):
        t = start
        while t < stop:
            _settle(rig, modes, y, v_cmd(t), F_load(t))
            events, meaning = _events(rig, dict(modes), v_cmd, F_load)
            found = solve_ivp(
                lambda t, y: rates(rig, modes, y, v_cmd(t), F_load(t)),
                (t, stop),
                y,
                method="DOP853",
                dense_output=True,
                events=events,
                rtol=rtol,
                atol=rtol * scale,
            )
            if found.status < 0:
                raise ArithmeticError(f"integration failed after {t} s: {found.message}")
            rows = (time > t) & (time <= found.t[-1])
            if rows.any():
                states[rows] = found.sol(time[rows]).T
            if found.status == 0:
                t, y = stop, found.y[:, -1]
                continue
            hit = next(j for j, times in enumerate(found.t_events) if len(times))
            t, y = float(found.t_events[hit][0]), found.y_events[hit][0].copy()
            part, mode = meaning[hit]
            modes[part] = mode
            if mode == 0:
                y[_SPEED[part]] = 0.0
    return outputs(rig, _NO_WIDTHS, states, v_cmd.at(time))


def _settle(rig: Rig, modes: Modes, y: FloatArray, v_cmd: float, F_load: float) -> None:
    """Modes at the start of a piece: stop what has passed zero unseen, break away what is pushed hard enough."""
    for part, mode in modes.items():
        if mode * y[_SPEED[part]] < 0.0:
            y[_SPEED[part]] = modes[part] = 0
    for part, mode in modes.items():
        for way in (1, -1) if mode == 0 else ():
            if excess(rig, part, way, modes, y, v_cmd, F_load) > _MARGIN:
                modes[part] = way


def _events(rig: Rig, modes: Modes, v_cmd: Wave, F_load: Wave) -> tuple[list, list[tuple[str, int]]]:
    """Terminal events of a mode, and what each one does: (part, its new mode)."""
    events, meaning = [], []
    for part, mode in modes.items():
        for way in (1, -1) if mode == 0 else (mode,):

            def stop(t: float, y: FloatArray, part: str = part, mode: int = mode, way: int = way) -> float:
                if mode == 0:
                    return excess(rig, part, way, modes, y, v_cmd(t), F_load(t)) - _MARGIN
                return way * float(y[_SPEED[part]])

            stop.terminal = True  # type: ignore[attr-defined]
            stop.direction = 1.0 if mode == 0 else -1.0  # type: ignore[attr-defined]
            events.append(stop)
            meaning.append((part, way if mode == 0 else 0))
    return events, meaning
