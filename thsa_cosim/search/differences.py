"""Difference Jacobians, many columns as one batch of vectors, so that a runner's workers share them.

A search that wants a Jacobian is written as a generator: it yields vectors (m, n) and is sent their residuals.
Several searches can then share one batch (:mod:`thsa_cosim.search.local`), and ``answer`` serves a single one.
"""

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Residual = FloatArray | None
Residuals = Callable[[FloatArray], Sequence[Residual]]
Result = TypeVar("Result")
#: Yields vectors (m, n), is sent the residuals (N,) of each (None: it failed), returns its result.
Asking = Generator[FloatArray, Sequence[Residual], Result]


@dataclass(frozen=True, eq=False)
class Box:
    """Bounds (n,) of the unknowns, and the ``scale`` (n,) of each: one step of 1 is a large one.

    Jacobians and difference steps are per ``scale``; the unit cube is its own scale.
    """

    lower: FloatArray
    upper: FloatArray
    scale: FloatArray

    @classmethod
    def unit(cls, dimension: int) -> "Box":
        """[0, 1]^n."""
        return cls(np.zeros(dimension), np.ones(dimension), np.ones(dimension))

    def clip(self, vectors: FloatArray) -> FloatArray:
        """(..., n) moved into the bounds."""
        return np.clip(vectors, self.lower, self.upper)


@dataclass(frozen=True)
class DifferenceSettings:
    """A step moves the residuals' norm by ``response``, or by ``share`` of their own norm if that is more.

    In units of noise, 10 is ten conditional standard errors: far above a solver's tolerance, and still small against
    the curvature of anything that the data determine. Far from the minimum small steps see a solver's events more
    than the slope. Steps are per scale, within ``smallest`` and ``largest``. ``repeats``: how often a column whose
    response was ten times off is taken again.
    """

    response: float = 10.0
    share: float = 0.1
    first: float = 1e-3
    smallest: float = 1e-6
    largest: float = 1e-2
    repeats: int = 0
    central: bool = False


def answer(search: "Asking[Result]", evaluate: Residuals) -> Result:
    """Run a generator to its end with ``evaluate``; returns its result."""
    vectors = next(search)
    while True:
        try:
            vectors = search.send(evaluate(vectors))
        except StopIteration as stop:
            found: Result = stop.value
            return found


def difference_columns(
    x: FloatArray,
    centre: FloatArray,
    steps: FloatArray,
    box: Box,
    settings: DifferenceSettings,
    which: Sequence[int] | None = None,
) -> Asking[tuple[FloatArray, FloatArray]]:
    """Jacobian columns (N, len(which)) per scale at ``x`` (n,), and the steps (n,) that serve next time.

    ``centre`` (N,) are the residuals at ``x``, ``steps`` (n,) the difference steps per scale. A one-sided step that
    would leave the box goes the other way; of a central one, a side that leaves the box or fails is replaced by the
    centre. A column of which nothing can be simulated is zero.
    """
    columns = list(range(x.size)) if which is None else list(which)
    found, steps = np.zeros((centre.size, len(columns)), order="F"), steps.copy()
    aim = max(settings.response, settings.share * float(np.linalg.norm(centre)))
    open_ = list(range(len(columns)))
    for _ in range(settings.repeats + 1):
        pairs = [_pair(x, columns[k], steps, box, settings.central) for k in open_]
        results = iter((yield np.array([side for pair in pairs for side in pair])))
        again = []
        for k, pair in zip(open_, pairs, strict=True):
            j = columns[k]
            column = _slope(x, centre, j, pair, [next(results) for _ in pair], box)
            norm = float(np.linalg.norm(column)) * steps[j]
            if norm == 0.0:
                # Failed, or no response at all: a smaller step may be possible, a larger one may show something.
                steps[j] = np.clip(
                    steps[j] * (0.1 if column is _FAILED else 10.0), settings.smallest, settings.largest
                )
                again.append(k)
                continue
            found[:, k] = column
            wanted = float(np.clip(steps[j] * aim / norm, settings.smallest, settings.largest))
            if not 0.1 * aim < norm < 10.0 * aim and not 0.5 < wanted / steps[j] < 2.0:
                again.append(k)
            steps[j] = wanted
        open_ = again
        if not open_:
            break
    return found, steps


_FAILED: FloatArray = np.zeros(1)


def _pair(x: FloatArray, j: int, steps: FloatArray, box: Box, central: bool) -> list[FloatArray]:
    """The vectors (one or two) whose difference is column ``j``."""
    step = steps[j] * box.scale[j]
    sides = []
    for move in (step, -step):
        side = x.copy()
        side[j] = np.clip(x[j] + move, box.lower[j], box.upper[j])
        sides.append(side)
    if central:
        return sides
    room = [abs(side[j] - x[j]) for side in sides]
    return [sides[0] if room[0] >= 0.5 * step or room[0] >= room[1] else sides[1]]


def _slope(
    x: FloatArray, centre: FloatArray, j: int, pair: list[FloatArray], results: list[Residual], box: Box
) -> FloatArray:
    """Column ``j`` (N,) per scale; ``_FAILED`` where no side can be used."""
    sides = [
        (vector[j], residual)
        for vector, residual in zip(pair, results, strict=True)
        if residual is not None and np.isfinite(residual).all()
    ]
    if len(sides) < 2:
        sides.append((x[j], centre))
    (a, above), (b, below) = sides[0], sides[-1]
    if a == b:
        return _FAILED
    return np.asarray((above - below) * (box.scale[j] / (a - b)))
