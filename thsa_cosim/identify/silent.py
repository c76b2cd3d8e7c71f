"""Parameters that do nothing: named before a search spends its runs on them."""

from collections.abc import Callable

import numpy as np

from thsa_cosim.fmu.inputs import is_ours
from thsa_cosim.identify.problem import PointProblem
from thsa_cosim.signals import Signals
from thsa_cosim.study import Reply, Request, Want
from thsa_cosim.system import read_description

_CHANGE = 0.3
"""Of the way between the bounds."""


def silent_parameters(point: PointProblem, ask: Callable[[Request], Reply]) -> tuple[str, ...]:
    """Return the parameters of a foreign FMU that change no bit of any output in any recording.

    One run more than there are parameters, per recording. Ours are not tried: they take what they are given.
    """
    if all(is_ours(read_description(fmu)) for fmu in {case.fmu for case in point.cases}):
        return ()
    n = point.space.dimension
    start = point.space.start()
    vectors = np.tile(start, (n + 1, 1))
    for i in range(n):
        vectors[i + 1, i] += _CHANGE if start[i] <= 0.5 else -_CHANGE
    signals = ask(Request(Want.SIGNALS, vectors)).signals
    base = signals[0]
    if base is None:
        return ()
    return tuple(
        name
        for name, row in zip(point.space.names, signals[1:], strict=True)
        if row is not None and _same(base, row)
    )


def _same(one: tuple[Signals, ...], other: tuple[Signals, ...]) -> bool:
    return all(np.array_equal(a[name], b[name]) for a, b in zip(one, other, strict=True) for name in a.names)


def note_on(names: tuple[str, ...]) -> list[str]:
    """Say which parameters do nothing."""
    if not names:
        return []
    listed = ", ".join(names)
    verb = "changes" if len(names) == 1 else "change"
    return [
        f"{listed} {verb} no output of the FMU in any recording: the FMU ignores the start value, or evaluated it at "
        f"export, or these recordings do not excite it; remove it from [[parameters]]."
    ]
