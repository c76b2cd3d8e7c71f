"""One unit over time, or a unit among its like: trends, and an alarm with a known rate of false ones.

Each study is compared with what the earlier ones predict. The scatter that counts is that between the studies, not the
standard error within one: a model that is a little wrong is wrong by the same amount each week, or by another one. A
mean and a straight line are tested (Student's t for the prediction of the next value, and for the slope), each with
half of the false alarms that are allowed: `PER_YEAR` per unit at `RECORDINGS` a year, over all quantities together.
``benchmarks/alarms.py`` counts them.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from thsa_cosim.errors import InputError
from thsa_cosim.report.compare.difference import Comparison, Row
from thsa_cosim.signals import FloatArray

#: False alarms per unit and year, and the recordings a year at which that holds.
PER_YEAR, RECORDINGS = 1.0, 52
#: Studies before the first one that can be judged: a scatter of two degrees of freedom.
FEWEST = 4


@dataclass(frozen=True)
class Trend:
    """A quantity over studies 0 … n - 1: ``slope`` per study with its standard error, and the latest beside the mean.

    ``expected`` ± ``scatter``: what the earlier studies predict for the latest one. ``jump`` and ``drift`` are t
    values, ``limits`` theirs; None where the studies do not scatter at all.
    """

    name: str
    at: str
    unit: str
    slope: float
    slope_stderr: float
    latest: float
    expected: float
    scatter: float
    jump: float | None
    drift: float | None
    limits: tuple[float, float]

    @property
    def alarm(self) -> str:
        """ "jump", "drift" or ""."""
        if self.jump is not None and abs(self.jump) > self.limits[0]:
            return "jump"
        return "drift" if self.drift is not None and abs(self.drift) > self.limits[1] else ""


def watch(found: Comparison) -> tuple[Trend, ...]:
    """The trend of every parameter and effect, the studies being in the order of time.

    Raises
    ------
    InputError
        If there are fewer than `FEWEST` studies.
    """
    if len(found.studies) < FEWEST:
        raise InputError(
            f"A trend needs {FEWEST} studies or more, in the order of time: thsa-cosim compare A B C D --watch."
        )
    rows = [row for row in found.rows if _is_watched(row)]
    return tuple(trend(row, len(rows)) for row in rows)


def _is_watched(row: Row) -> bool:
    complete = row.same_unit and all(v is not None for v in row.values)
    return complete and row.group in ("parameter", "effect") and not row.part_of


def trend(row: Row, quantities: int) -> Trend:
    """The trend of a row that every study has, one of so many ``quantities`` that are watched together."""
    values = np.array([v.value for v in row.values if v is not None])
    jump, expected, scatter = jump_of(values)
    drift, slope, stderr = drift_of(values)
    return Trend(
        row.name,
        row.at,
        row.unit,
        slope,
        stderr,
        float(values[-1]),
        expected,
        scatter,
        jump,
        drift,
        limits(values.size, quantities),
    )


def limits(studies: int, quantities: int) -> tuple[float, float]:
    """Limits of |t| for the jump and the drift of one of ``quantities`` at the latest of so many ``studies``."""
    chance = 0.5 * PER_YEAR / (RECORDINGS * max(quantities, 1))
    return float(student.isf(0.5 * chance, studies - 2)), float(student.isf(0.5 * chance, studies - 2))


def jump_of(values: FloatArray) -> tuple[float | None, float, float]:
    """t of the latest of ``values`` (n,) against the mean of the others, that mean, and the scatter of a prediction."""
    before = values[:-1]
    mean = float(np.mean(before))
    scatter = float(np.std(before, ddof=1)) * math.sqrt(1.0 + 1.0 / before.size)
    return (float(values[-1]) - mean) / scatter if scatter > 0.0 else None, mean, scatter


def drift_of(values: FloatArray) -> tuple[float | None, float, float]:
    """t of the slope of ``values`` (n,) over 0 … n - 1, the slope, and its standard error."""
    x = np.arange(values.size) - 0.5 * (values.size - 1)
    slope = float(x @ values / (x @ x))
    left = values - np.mean(values) - slope * x
    stderr = math.sqrt(float(left @ left) / (values.size - 2) / float(x @ x))
    return slope / stderr if stderr > 0.0 else None, slope, stderr


def told(trends: Sequence[Trend]) -> str:
    """The alarms in a sentence."""
    raised = [t for t in trends if t.alarm]
    if not trends:
        return "No quantity is known in every study, so there is nothing to watch."
    if not raised:
        return "No alarm."
    return "Alarm: " + "; ".join(_sentence(t) for t in raised) + "."


def _sentence(t: Trend) -> str:
    place = f" at {t.at}" if t.at else ""
    unit = f" {t.unit}" if t.unit not in ("", "1") else ""
    if t.alarm == "jump":
        return (
            f"{t.name}{place} is {t.latest:.4g}{unit}, where {t.expected:.4g} ± {t.scatter:.2g} was expected"
        )
    return f"{t.name}{place} drifts by {t.slope:.3g} ± {t.slope_stderr:.2g}{unit} per study"
