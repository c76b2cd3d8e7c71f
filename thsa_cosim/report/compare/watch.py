"""One unit over time: trends, and an alarm with a known rate of false ones.

Each study is compared with what the earlier ones predict. The scatter that counts is that between the studies, not the
standard error within one: a model that is a little wrong is wrong by the same amount each week, or by another one. Two
tests, each with half of the false alarms that are allowed (`PER_YEAR` per unit at `RECORDINGS` a year, over all
quantities together): a jump, when the two latest studies lie beyond a limit on the same side of the earlier ones, and a
drift, by the slope of a straight line (Student's t). Two in a row keep the rate where scatter has heavy tails: one week
may be an outlier, a changed machine stays changed. ``benchmarks/alarms.py`` counts them.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.optimize import brentq
from scipy.stats import chi2, norm
from scipy.stats import t as student

from thsa_cosim.errors import InputError
from thsa_cosim.report.compare.difference import Comparison, Row
from thsa_cosim.signals import FloatArray

#: False alarms per unit and year, and the recordings a year at which that holds.
PER_YEAR, RECORDINGS = 1.0, 52
#: Studies before the first one that can be judged: a scatter of one degree of freedom and two values to judge.
FEWEST = 4
#: Points of the integrals over the scatter and the mean that earlier studies estimate.
_SCATTERS, _MEANS = 2000, 31


@dataclass(frozen=True)
class Trend:
    """A quantity over studies 0 … n - 1: ``slope`` per study with its standard error, and the latest beside the mean.

    ``expected`` ± ``scatter``: what the earlier studies predict for the latest one, ``single`` its t value; of a jump,
    those before it. ``jump``: the lesser t value of the two latest, 0 if they lie on both sides; ``drift``: that of the
    slope; ``limits`` theirs. None where the studies do not scatter at all.
    """

    name: str
    at: str
    unit: str
    slope: float
    slope_stderr: float
    latest: float
    expected: float
    scatter: float
    single: float | None
    jump: float | None
    drift: float | None
    limits: tuple[float, float]
    alone: float
    """Limit of ``single``: beyond it the next study tells whether it is a jump."""

    @property
    def alarm(self) -> str:
        """ "jump", "drift" or ""."""
        if self.jump is not None and abs(self.jump) > self.limits[0]:
            return "jump"
        return "drift" if self.drift is not None and abs(self.drift) > self.limits[1] else ""

    @property
    def is_suspect(self) -> bool:
        """Whether the latest study alone is further off than chance has it once a year: a jump or an outlier."""
        return not self.alarm and self.single is not None and abs(self.single) > self.alone


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
    rows = [row for row in found.rows if is_watched(row)]
    return tuple(trend(row, len(rows)) for row in rows)


def is_watched(row: Row) -> bool:
    """Whether a row is a parameter or an effect that every study has."""
    complete = row.same_unit and all(v is not None for v in row.values)
    return complete and row.group in ("parameter", "effect") and not row.part_of


def trend(row: Row, quantities: int) -> Trend:
    """The trend of a row that every study has, one of so many ``quantities`` that are watched together."""
    values = np.array([v.value for v in row.values if v is not None])
    single, expected, scatter = single_of(values)
    jump, (jump_limit, drift_limit) = jump_of(values), limits(values.size, quantities)
    drift, slope, stderr = drift_of(values)
    if jump is not None and abs(jump) > jump_limit:
        expected, scatter = _prediction(values[:-2])
    return Trend(
        row.name,
        row.at,
        row.unit,
        slope,
        stderr,
        float(values[-1]),
        expected,
        scatter,
        single,
        jump,
        drift,
        (jump_limit, drift_limit),
        alone(values.size, quantities),
    )


def limits(studies: int, quantities: int) -> tuple[float, float]:
    """Limits of |t| for the jump and the drift of one of ``quantities`` at the latest of so many ``studies``."""
    chance = _chance(quantities)
    return _twice(studies - 2, chance), float(student.isf(0.5 * chance, studies - 2))


def alone(studies: int, quantities: int) -> float:
    """Limit of |t| for the latest of ``studies`` alone."""
    return float(student.isf(0.5 * _chance(quantities), studies - 2))


def _chance(quantities: int) -> float:
    return 0.5 * PER_YEAR / (RECORDINGS * max(quantities, 1))


@lru_cache(maxsize=4096)
def _twice(before: int, chance: float) -> float:
    """The limit that two values both pass on the same side by ``chance``, in the scatter of a prediction.

    Mean and standard deviation are those of ``before`` earlier values, all of them normal: integrated over both.
    """
    p = (np.arange(_SCATTERS) + 0.5) / _SCATTERS
    scatter = np.sqrt(chi2.ppf(p, before - 1) / (before - 1))
    nodes, weights = np.polynomial.hermite_e.hermegauss(_MEANS)
    mean, weights = nodes / math.sqrt(before), weights / weights.sum()

    def excess(logarithm: float) -> float:
        beyond = norm.sf(math.exp(logarithm) * scatter[None, :] + mean[:, None]) ** 2
        return 2.0 * float(weights @ beyond.mean(axis=1)) - chance

    limit = math.exp(float(brentq(excess, -5.0, 15.0, xtol=1e-6)))
    return limit / math.sqrt(1.0 + 1.0 / before)


def single_of(values: FloatArray) -> tuple[float | None, float, float]:
    """t of the latest of ``values`` (n,) against the mean of the others, that mean, and the scatter of a prediction."""
    mean, scatter = _prediction(values[:-1])
    return (float(values[-1]) - mean) / scatter if scatter > 0.0 else None, mean, scatter


def jump_of(values: FloatArray) -> float | None:
    """The lesser t of the two latest of ``values`` (n,) against the others; 0 if they lie on both sides of the mean."""
    mean, scatter = _prediction(values[:-2])
    if not scatter > 0.0:
        return None
    low, high = sorted((values[-2:] - mean) / scatter)
    return float(low) if low > 0.0 else float(high) if high < 0.0 else 0.0


def _prediction(values: FloatArray) -> tuple[float, float]:
    """Mean of ``values`` (n,), and the standard deviation of a further one from it."""
    return float(np.mean(values)), float(np.std(values, ddof=1)) * math.sqrt(1.0 + 1.0 / values.size)


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
    text = "Alarm: " + "; ".join(_sentence(t) for t in raised) + "." if raised else "No alarm."
    suspects = [t for t in trends if t.is_suspect]
    if suspects:
        text += f" {'; '.join(map(_off, suspects))}: the next recording tells an outlier from a jump."
    return text


def _sentence(t: Trend) -> str:
    if t.alarm == "jump":
        return _off(t)
    place, unit = _place(t), _unit(t)
    return f"{t.name}{place} drifts by {t.slope:.3g} ± {t.slope_stderr:.2g}{unit} per study"


def _off(t: Trend) -> str:
    return f"{t.name}{_place(t)} is {t.latest:.4g}{_unit(t)}, where {t.expected:.4g} ± {t.scatter:.2g} was expected"


def _place(t: Trend) -> str:
    return f" at {t.at}" if t.at else ""


def _unit(t: Trend) -> str:
    return f" {t.unit}" if t.unit not in ("", "1") else ""
