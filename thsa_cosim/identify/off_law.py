"""Points that follow no common law over temperature: the label of a recording's temperature may be wrong.

What a recording is said to have been made at is seen in no signal of the model. Two labels that were exchanged show
in the laws alone: several parameters jump at the same temperatures, by far more than their errors.
"""

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np

from thsa_cosim.identify.results import LawResult, PointResult
from thsa_cosim.laws import fit_law
from thsa_cosim.signals import FloatArray

_FAR, _LARGE = 8.0, 0.05
"""Standard errors, and share of the parameter's largest value, that a point lies off its law."""
_BETTER = 0.1
"""Share of the squared distances that may be left if labels are exchanged back."""
_PARAMETERS = 2
"""Parameters that have to agree: one alone may have another law."""


def off_law(
    points: Sequence[PointResult], laws: Mapping[str, LawResult]
) -> tuple[str, tuple[float, ...]] | None:
    """Return a sentence on temperatures that seem to be exchanged or wrong, and these in degC; None without any.

    Only laws through four points or more that leave a degree of freedom count, and two parameters have to agree.
    """
    known = [p for p in points if p.temperature_degC is not None]
    t = np.array([p.temperature_degC for p in known], dtype=np.float64)
    fits = {n: found for n, law in laws.items() if (found := _members(known, n, law, t)) is not None}
    far = [name for name, fit in fits.items() if _is_far(fit, t)]
    if len(far) < _PARAMETERS:
        return None
    whole = _left(fits, t)
    pairs = [(_left(fits, _exchanged(t, a, b)), a, b) for a, b in combinations(range(t.size), 2)]
    left, a, b = min(pairs)
    names = " and ".join(sorted(far))
    if left < _BETTER * whole:
        text = (
            f"{names} follow their laws over temperature if what was recorded at {t[a]:g} degC and at {t[b]:g} degC"
            " changes places: are the temperatures of these recordings exchanged?"
        )
        return text, (float(t[a]), float(t[b]))
    alone = [(_left(fits, t, without=k), k) for k in range(t.size)]
    left, k = min(alone)
    if left < _BETTER * whole:
        text = f"{names} follow their laws over temperature but at {t[k]:g} degC: is the temperature there right?"
        return text, (float(t[k]),)
    return None


_Fit = tuple[str, FloatArray, FloatArray]
"""Form, values (m,) and standard errors (m,) of a parameter."""


def _members(points: Sequence[PointResult], name: str, law: LawResult, t: FloatArray) -> _Fit | None:
    estimates = [p.parameters.get(name) for p in points]
    if t.size < 4 or any(e is None or e.stderr is None or not e.stderr > 0.0 for e in estimates):
        return None
    if law.between is not None or len(law.law.coefficients) > t.size - 2:
        return None
    values = np.array([e.value for e in estimates if e is not None])
    errors = np.array([e.stderr for e in estimates if e is not None and e.stderr is not None])
    return law.law.form, values, errors


def _is_far(fit: _Fit, t: FloatArray) -> bool:
    """Whether a point lies off the law through all of them, by standard errors and by shares of the largest value."""
    form, values, errors = fit
    apart = np.abs(values - fit_law(form, t, values, errors)(t))
    return bool(np.max(apart / errors) > _FAR and np.max(apart) > _LARGE * np.max(np.abs(values)))


def _left(fits: Mapping[str, _Fit], t: FloatArray, without: int | None = None) -> float:
    """Squared distances of all points from their laws, in squared standard errors."""
    kept = np.arange(t.size) != without
    total = 0.0
    for form, values, errors in fits.values():
        law = fit_law(form, t[kept], values[kept], errors[kept])
        total += float(np.sum(((values[kept] - law(t[kept])) / errors[kept]) ** 2))
    return total


def _exchanged(t: FloatArray, a: int, b: int) -> FloatArray:
    swapped = t.copy()
    swapped[[a, b]] = t[[b, a]]
    return swapped
