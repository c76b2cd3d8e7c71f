"""Command and load profiles that a rig can run: within the speeds, loads, rates and travel that it was recorded at."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from thsa_cosim.signals import FloatArray, Signals

#: A profile may travel this much further than the recordings did (integral of the command), where no limit says else.
TRAVEL = 1.2
#: Waves are polygons with so many corners: 40 a period of the fastest, 0.3 % of its size off. A solver stops at each
#: corner, and a wave that is sampled at the grid's times has as many as samples.
CORNERS = 400


@dataclass(frozen=True)
class Range:
    """What an input did in the recordings: lowest and highest value, and the largest rate (per s)."""

    lowest: float
    highest: float
    rate: float

    @property
    def reach(self) -> float:
        """Largest value that it took in both directions, or took at all if it kept one sign."""
        both = min(-self.lowest, self.highest)
        return both if both > 0.0 else max(abs(self.lowest), abs(self.highest))


@dataclass(frozen=True, eq=False)
class Profile:
    """A command and a load (n,) over time; ``name`` says what they do."""

    name: str
    command: FloatArray
    load: FloatArray | None


def input_range(
    recordings: Sequence[Signals],
    name: str,
    limits: tuple[float, float] | None = None,
    rate: float | None = None,
) -> Range:
    """What an input did in ``recordings``, or may do by ``limits`` (lowest, highest) and a ``rate`` per s."""
    values = np.concatenate([r[name] for r in recordings])
    low, high = (float(values.min()), float(values.max())) if limits is None else limits
    did = max(float(np.max(np.abs(np.diff(r[name]) / np.diff(r.time)))) for r in recordings)
    return Range(low, high, did if rate is None else rate)


def travel(recordings: Sequence[Signals], name: str) -> float:
    """Largest range of an input's integral over a recording, in its unit times s."""
    return max(_travel(r.time, r[name]) for r in recordings)


def profiles(time: FloatArray, command: Range, load: Range | None, limit: float) -> tuple[Profile, ...]:
    """Every profile of the menu over ``time`` (n,) whose integrated command keeps within ``limit``."""
    menu = _menu(_Grid(time, command.rate), command.reach)
    found: list[Profile] = []
    for name, values in menu:
        if _travel(time, values) > limit:
            continue
        for words, course in _loads(time, load):
            found.append(Profile(name + words, values, course))
    return tuple(found)


@dataclass(frozen=True, eq=False)
class _Grid:
    """A time grid (n,) on which signals change at ``rate`` per s."""

    time: FloatArray
    rate: float

    @property
    def span(self) -> float:
        """Length in s."""
        return float(self.time[-1] - self.time[0])

    def ramped(self, moves: Sequence[tuple[float, float]], start: float = 0.0) -> FloatArray:
        """(n,) from ``start``, at each (share of the span, level) towards the level at the rate."""
        times, values = [0.0], [start]
        for number, (share, level) in enumerate(moves):
            begin = share * self.span
            end = moves[number + 1][0] * self.span if number + 1 < len(moves) else self.span
            lasting = max(abs(level - values[-1]) / self.rate, 1e-9)
            part = min(1.0, (end - begin) / lasting)
            times += [begin, begin + part * lasting]
            values += [values[-1], values[-1] + part * (level - values[-1])]
        return np.asarray(np.interp(self.time - self.time[0], times, values))

    def wave(self, shape: Callable[[FloatArray], FloatArray]) -> FloatArray:
        """(n,) ``shape`` of the share of the span that has passed, as a polygon."""
        return _polygon(self.time, shape)


def _menu(grid: _Grid, top: float) -> Iterator[tuple[str, FloatArray]]:
    """Names and commands (n,): zero at both ends, as far back as ahead."""
    shares = (0.1, 0.35, 0.7, 1.0)
    stairs = [(0.02 + 0.115 * k, (-1) ** k * shares[k // 2] * top) for k in range(8)]
    yield "speeds from creep to full, each both ways", grid.ramped([*stairs, (0.95, 0.0)])
    edges = np.linspace(0.02, 0.96, 25)
    full = [(float(e), (-1) ** k * top) for k, e in enumerate(edges[:-1])]
    yield "reversals at full speed", grid.ramped([*full, (float(edges[-1]), 0.0)])
    small = [(float(e), (-1) ** k * 0.1 * top) for k, e in enumerate(edges[:-1])]
    yield "small reversals at creep", grid.ramped([*small, (float(edges[-1]), 0.0)])
    halves = np.linspace(0.02, 0.96, 13)
    stops = [(float(e), (0.5 * top, 0.0, -0.5 * top, 0.0)[k % 4]) for k, e in enumerate(halves[:-1])]
    yield "moves with holds between them", grid.ramped([*stops, (float(halves[-1]), 0.0)])
    runs = [(0.02 + 0.23 * k, (-1) ** k * 0.5 * top) for k in range(4)]
    yield "long moves at half speed", grid.ramped([*runs, (0.95, 0.0)])
    yield "a slow triangle through standstill", grid.wave(lambda p: 0.2 * top * _triangle(4.0 * p))
    yield "a sine", grid.wave(lambda p: 0.7 * top * np.sin(2.0 * np.pi * 10.0 * p))


def _loads(time: FloatArray, load: Range | None) -> Iterator[tuple[str, FloatArray | None]]:
    """Words and courses (n,) of the load: one that is low, one that is high, and one that sweeps between them."""
    if load is None or load.highest == load.lowest:
        yield "", None if load is None else np.full(time.size, load.lowest)
        return
    yield " at the lowest load", np.full(time.size, load.lowest)
    yield " at the highest load", np.full(time.size, load.highest)
    swept = _polygon(time, lambda p: 0.5 - 0.5 * np.cos(2.0 * np.pi * 3.0 * p))
    yield " under a load that rises and falls", load.lowest + (load.highest - load.lowest) * swept


def _polygon(time: FloatArray, shape: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """(n,) ``shape`` of the share of the span of ``time`` (n,), straight between its corners."""
    corners = np.linspace(0.0, 1.0, CORNERS + 1)
    return np.asarray(np.interp((time - time[0]) / (time[-1] - time[0]), corners, shape(corners)))


def _triangle(periods: FloatArray) -> FloatArray:
    """(n,) from 0 up to 1, down to -1 and back, once a period."""
    return np.asarray(2.0 / np.pi * np.arcsin(np.sin(2.0 * np.pi * periods)))


def _travel(time: FloatArray, values: FloatArray) -> float:
    position = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(time))])
    return float(np.ptp(position))
