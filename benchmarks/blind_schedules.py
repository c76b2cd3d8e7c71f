"""Commands and loads of the blind benchmark: as rich as the labelled units', drawn anew for every unit.

Ramps of 30 mm/s2 and 200 kN/s between levels; the levels alternate in sign, so that the stroke stays short and
every speed is met both ways. The load changes at rest (style "plateaus") or in the middle of a move ("mixed").
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
from blind_plant import Wave

ACCELERATION = 30e-3  # m/s2
LOAD_RATE = 2e5  # N/s
PARTS = ("fit_1", "fit_2", "validate_1", "validate_2")
_STYLES = {"fit_1": "plateaus", "fit_2": "mixed", "validate_1": "plateaus", "validate_2": "mixed"}


class Schedule(NamedTuple):
    command: Wave  # m/s
    load: Wave  # N
    rows: int  # samples of 1 ms


def ramped(rate: float, start: float, moves: list[tuple[float, float]]) -> Wave:
    """From `start`, at each (time, level) towards the level at `rate` per second."""
    times, values = [0.0], [start]
    for wanted, level in moves:
        time = round(wanted, 3)  # on a sample, so that the recorded samples are the signal
        times += [time, time + max(1e-9, abs(level - values[-1]) / rate)]
        values += [values[-1], level]
    return Wave(np.array(times), np.array(values))


def schedule(part: str, random: np.random.Generator) -> Schedule:
    """One recording's command and load, 17 to 20 s."""
    return _plateaus(random) if _STYLES[part] == "plateaus" else _mixed(random)


def _load(random: np.random.Generator, low: float, high: float) -> float:
    return 1e3 * round(random.uniform(low, high))


def _plateaus(random: np.random.Generator) -> Schedule:
    """Three loads, at each there and back at two speeds and a hold; then a reversal at creep."""
    end = random.uniform(18.0, 20.0)
    edges = 0.5 + np.array([0.0, 1.0, 2.0, 3.0]) * (end - 2.5) / 3.0
    loads = [_load(random, 0.0, 12.0), _load(random, 18.0, 40.0), _load(random, 45.0, 55.0)]
    random.shuffle(loads)
    if random.random() < 0.5:
        loads[int(random.integers(3))] = _load(random, -30.0, -10.0)
    moves, forces = [], []
    for number, (start, stop) in enumerate(itertools.pairwise(edges)):
        fast, slow = random.uniform(6.0, 9.0), random.uniform(1.5, 5.0)
        quarter = (stop - start - 0.6) / 4.0
        levels = [fast, slow, -fast, -slow] if random.random() < 0.5 else [slow, fast, -slow, -fast]
        moves += [(start + quarter * j, 1e-3 * level) for j, level in enumerate(levels)]
        moves.append((start + quarter * 4.0, 0.0))
        if number:
            forces.append((start - 0.45, loads[number]))
    creep = random.uniform(0.5, 1.5)
    moves += [(edges[-1] + 0.05, 1e-3 * creep), (edges[-1] + 1.0, -1e-3 * creep)]
    forces.append((edges[-1] + 0.5, _load(random, -10.0, 15.0)))
    return Schedule(ramped(ACCELERATION, 0.0, moves), ramped(LOAD_RATE, loads[0], forces), round(end * 1e3))


def _mixed(random: np.random.Generator) -> Schedule:
    """Speeds from creep to full, each both ways, loads of both signs that change while it moves."""
    speeds = [
        random.uniform(0.3, 0.7),
        random.uniform(0.7, 1.5),
        random.uniform(2.0, 3.5),
        random.uniform(4.5, 6.5),
        random.uniform(7.5, 9.0),
    ]
    lasting = np.array([1.5, 1.5, 2.6, 1.5, 0.9]) * random.uniform(0.9, 1.1)
    order = [0, 1, *random.permutation([2, 3, 4]).tolist()] if random.random() < 0.5 else [0, 2, 1, 4, 3]
    moves, time = [], random.uniform(0.3, 0.5)
    for number in order:
        way = 1.0 if random.random() < 0.7 else -1.0
        moves += [(time, way * 1e-3 * speeds[number]), (time + lasting[number], -way * 1e-3 * speeds[number])]
        time += 2.0 * lasting[number] + 0.15
    moves.append((time, 0.0))
    end = time + 1.0
    turns = np.sort(random.uniform(1.0, end - 1.5, 6))
    levels = [
        _load(random, low, high)
        for low, high in ((-30, -10), (40, 55), (-20, 0), (15, 35), (-5, 10), (25, 55))
    ]
    forces = list(zip(turns.tolist(), [levels[j] for j in random.permutation(6)], strict=True))
    return Schedule(
        ramped(ACCELERATION, 0.0, moves),
        ramped(LOAD_RATE, _load(random, -5.0, 20.0), _spaced(forces)),
        round(end * 1e3),
    )


def _spaced(forces: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Each change at least as late as the longest ramp (85 kN at 200 kN/s) after the one before."""
    spaced: list[tuple[float, float]] = []
    for time, level in forces:
        spaced.append((max(time, spaced[-1][0] + 0.43) if spaced else time, level))
    return spaced
