"""A weighted fit of each form of law, and the choice between the forms."""

from collections.abc import Sequence

import numpy as np

from thsa_cosim.errors import InputError
from thsa_cosim.laws.law import (
    CANDIDATES,
    FORMS,
    POLYNOMIALS,
    FloatArray,
    Law,
    check_form,
    evaluate,
    gradient,
)
from thsa_cosim.laws.vogel import fit_vogel


def fit_law(form: str, temperature: FloatArray, values: FloatArray, stderr: FloatArray | None = None) -> Law:
    """Fit one form to ``values`` (n,) at ``temperature`` (n,) in degC, weighted by the inverse square of ``stderr``.

    Points whose ``stderr`` is missing or not positive count like the least sure of the others; without any
    ``stderr`` all count alike and the covariance is scaled by the scatter about the law. Raises InputError
    for too few points.
    """
    check_form(form)
    t, y = np.asarray(temperature, dtype=np.float64), np.asarray(values, dtype=np.float64)
    count = len(np.unique(t))
    needed = FORMS[form] or 2
    if count < needed:
        raise InputError(f"A {form} law needs {needed} temperatures, but there are {count}.")
    sigma, known = _sigma(stderr, y)
    if form == "spline":
        order = np.argsort(t)
        return Law(form, tuple(y[order].tolist()), knots=tuple(t[order].tolist()), chi2=0.0, points=t.size)
    if form in POLYNOMIALS:
        coefficients = _fit_polynomial(FORMS[form], t, y, sigma)
    elif form == "copper":
        shape = evaluate(form, np.ones(1), t) / sigma
        coefficients = np.array([shape @ (y / sigma) / (shape @ shape)])
    elif form == "vogel":
        coefficients = fit_vogel(t, y, sigma)
    else:
        coefficients = _fit_exponentials(FORMS[form] // 2, t, y, sigma)
    residual = (evaluate(form, coefficients, t) - y) / sigma
    chi2 = float(residual @ residual)
    free = t.size - len(coefficients)
    slopes = gradient(form, coefficients, t) / sigma[:, None]
    covariance: FloatArray = np.asarray(np.linalg.pinv(slopes.T @ slopes, rcond=1e-14, hermitian=True))
    if not known:
        covariance = covariance * (chi2 / free if free else np.nan)
    return Law(
        form,
        tuple(coefficients.tolist()),
        covariance=covariance,
        chi2=chi2,
        aicc=_aicc(chi2, t.size, len(coefficients), known),
        points=t.size,
    )


def select_law(
    temperature: FloatArray,
    values: FloatArray,
    stderr: FloatArray | None = None,
    candidates: Sequence[str] = CANDIDATES,
) -> tuple[Law, tuple[Law, ...]]:
    """The law of least corrected AIC, and all that were fitted, best first.

    Of forms that tie (or that the points are too few to correct for) the one with fewest coefficients wins.
    """
    count = len(np.unique(temperature))
    fitted = [fit_law(form, temperature, values, stderr) for form in candidates if FORMS[form] <= count]
    fitted.sort(key=lambda law: (law.aicc, len(law.coefficients)))
    return fitted[0], tuple(fitted)


def _sigma(stderr: FloatArray | None, y: FloatArray) -> tuple[FloatArray, bool]:
    if stderr is None:
        return np.ones(y.shape), False
    sigma = np.array(stderr, dtype=np.float64)
    usable = np.isfinite(sigma) & (sigma > 0.0)
    if not usable.any():
        return np.ones(y.shape), False
    return np.where(usable, sigma, np.max(sigma[usable])), True


def _aicc(chi2: float, n: int, k: int, known: bool) -> float:
    """Hurvich and Tsai (1989); with unknown scatter the likelihood is profiled over it (one more)."""
    k_all = k if known else k + 1
    if n - k_all - 1 <= 0:
        return float("inf")
    likelihood = chi2 if known else n * float(np.log(max(chi2, np.finfo(float).tiny) / n))
    return likelihood + 2.0 * k_all + 2.0 * k_all * (k_all + 1) / (n - k_all - 1)


def _fit_polynomial(count: int, t: FloatArray, y: FloatArray, sigma: FloatArray) -> FloatArray:
    span = max(float(np.max(np.abs(t))), 1.0)  # keeps the columns of one size
    matrix = np.vander(t / span, count, increasing=True) / sigma[:, None]
    scaled = np.linalg.lstsq(matrix, y / sigma, rcond=None)[0]
    return np.asarray(scaled / span ** np.arange(count))


def _fit_exponentials(terms: int, t: FloatArray, y: FloatArray, sigma: FloatArray) -> FloatArray:
    """Variable projection (Golub and Pereyra, 1973): search over the β alone, the α follow linearly.

    A fine grid of β that spans e^±6 over the temperatures starts the search, at all valleys of its profile.
    """
    from scipy.optimize import least_squares  # slow to import, and most laws are polynomials

    span = max(float(np.ptp(t)), 1.0)
    middle = 0.5 * (float(np.max(t)) + float(np.min(t)))
    s = (t - middle) / span

    def amplitudes(rates: FloatArray) -> tuple[FloatArray, FloatArray]:
        matrix = np.exp(s[:, None] * rates) / sigma[:, None]
        alpha = np.linalg.lstsq(matrix, y / sigma, rcond=1e-12)[0]
        return np.asarray(alpha), np.asarray(matrix @ alpha - y / sigma)

    def misfit(rates: FloatArray) -> FloatArray:
        return amplitudes(rates)[1]

    best, best_cost = np.zeros(terms), float("inf")
    for start in _starting_rates(terms, s, y / sigma, sigma):
        found = least_squares(misfit, start, bounds=(-20.0, 20.0), xtol=1e-12, ftol=1e-14, gtol=1e-14)
        if found.cost < best_cost:
            best, best_cost = np.sort(found.x), float(found.cost)
    alpha, _ = amplitudes(best)
    beta = best / span
    return np.asarray(np.stack([alpha * np.exp(-beta * middle), beta], axis=1).reshape(-1))


def _starting_rates(terms: int, s: FloatArray, y: FloatArray, sigma: FloatArray) -> list[FloatArray]:
    """Rates (terms,) worth starting from: per rate of a grid its best partner, where that profile has a valley."""
    grid = np.linspace(-6.0, 6.0, 241)
    columns = np.exp(grid[:, None] * s) / sigma
    columns /= np.linalg.norm(columns, axis=1, keepdims=True)
    along = columns @ y
    if terms == 1:
        explained, partner = along**2, np.arange(grid.size)
    else:
        overlap = columns @ columns.T
        apart = 1.0 - overlap**2
        both = along[:, None] ** 2 + along[None, :] ** 2 - 2.0 * overlap * along[:, None] * along[None, :]
        # Neighbours on the grid are so alike that their difference is rounding.
        pairs = np.where(apart > 1e-6, both / np.maximum(apart, 1e-6), -np.inf)
        partner = np.argmax(pairs, axis=1)
        explained = pairs[np.arange(grid.size), partner]
    padded = np.concatenate([[-np.inf], explained, [-np.inf]])
    valleys = np.flatnonzero((explained >= padded[:-2]) & (explained >= padded[2:]))
    deepest = valleys[np.argsort(-explained[valleys])][:8]
    chosen = dict.fromkeys([*deepest.tolist(), *np.argsort(-explained)[:2].tolist()])
    return [grid[[k]] if terms == 1 else grid[[k, partner[k]]] for k in chosen]
