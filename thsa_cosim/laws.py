"""Laws over temperature: their forms, a weighted fit, and the choice between them.

A law gives a parameter's value at a temperature t in degC. Polynomial coefficients run from α0 up; an
exponential is α1 exp(β1 t) and a double exponential α1 exp(β1 t) + α2 exp(β2 t) with β1 < β2, so that
coefficients are [α1, β1] and [α1, β1, α2, β2]. A spline is the natural cubic one through the points.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.errors import InputError, did_you_mean

FloatArray = NDArray[np.float64]

#: Coefficients per form; a spline has as many as points.
FORMS: Mapping[str, int] = MappingProxyType(
    {
        "constant": 1,
        "linear": 2,
        "quadratic": 3,
        "cubic": 4,
        "exponential": 2,
        "double-exponential": 4,
        "spline": 0,
    }
)
POLYNOMIALS = ("constant", "linear", "quadratic", "cubic")
#: The forms that selection weighs against each other: a spline always fits, so it takes no part.
CANDIDATES = tuple(form for form in FORMS if form != "spline")


@dataclass(frozen=True)
class Law:
    """A law and how it was found.

    ``coefficients`` as the module's docstring says; ``knots``: the temperatures in degC of a spline's
    coefficients, else empty. ``covariance``: (k, k) of the coefficients, None for a published law or a
    spline. ``chi2``: weighted sum of squares over ``points`` points; ``aicc``: corrected Akaike
    criterion, +inf when there are too few points to correct for.
    """

    form: str
    coefficients: tuple[float, ...]
    knots: tuple[float, ...] = ()
    covariance: FloatArray | None = None
    chi2: float = float("nan")
    aicc: float = float("inf")
    points: int = 0

    def __call__(self, temperature: FloatArray | float) -> FloatArray:
        """The law at ``temperature`` (any shape, degC), of the same shape."""
        t = np.asarray(temperature, dtype=np.float64)
        if self.form == "spline":
            return _spline(self.knots, self.coefficients, t)
        return _evaluate(self.form, np.array(self.coefficients), t)

    def stderr(self, temperature: FloatArray | float) -> FloatArray:
        """One standard error of the law at ``temperature``; NaN where no covariance is known."""
        t = np.asarray(temperature, dtype=np.float64)
        if self.covariance is None:
            return np.full(t.shape, np.nan)
        gradient = _gradient(self.form, np.array(self.coefficients), t.reshape(-1))
        variance = np.einsum("ni,ij,nj->n", gradient, self.covariance, gradient)
        return np.asarray(np.sqrt(np.maximum(variance, 0.0)).reshape(t.shape))

    def block_values(self, block: str) -> dict[str, float]:
        """Start values of a ``TemperatureLaw`` block of ``modelica/THSA``: all eight coefficients.

        Raises InputError for a spline, which that block cannot express.
        """
        if self.form == "spline":
            raise InputError(f"A spline cannot be written into {block!r}: choose one of the other forms.")
        names = ("a0", "a1", "a2", "a3", "alpha1", "beta1", "alpha2", "beta2")
        values = dict.fromkeys(names, 0.0)
        chosen = names[:4] if self.form in POLYNOMIALS else names[4:]
        values.update(zip(chosen, self.coefficients, strict=False))
        return {f"{block}.{name}": value for name, value in values.items()}


def published_law(form: str, coefficients: Sequence[float]) -> Law:
    """A law with given ``coefficients``; InputError for an unknown form or a wrong number of them."""
    _check_form(form)
    if form == "spline" or len(coefficients) != FORMS[form]:
        raise InputError(f"A {form} law takes {FORMS[form] or 'no'} coefficients, not {len(coefficients)}.")
    return Law(form, tuple(float(c) for c in coefficients))


def fit_law(form: str, temperature: FloatArray, values: FloatArray, stderr: FloatArray | None = None) -> Law:
    """Fit one form to ``values`` (n,) at ``temperature`` (n,) in degC, weighted by the inverse square of ``stderr``.

    Points whose ``stderr`` is missing or not positive count like the least sure of the others; without any
    ``stderr`` all count alike and the covariance is scaled by the scatter about the law. Raises InputError
    for too few points.
    """
    _check_form(form)
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
    else:
        coefficients = _fit_exponentials(FORMS[form] // 2, t, y, sigma)
    residual = (_evaluate(form, coefficients, t) - y) / sigma
    chi2 = float(residual @ residual)
    free = t.size - len(coefficients)
    gradient = _gradient(form, coefficients, t) / sigma[:, None]
    covariance: FloatArray = np.asarray(np.linalg.pinv(gradient.T @ gradient, rcond=1e-14, hermitian=True))
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


def largest_deviation(law: Law, reference: Law, temperature: FloatArray) -> float:
    """Largest distance of two laws over ``temperature`` (n,), relative to ``reference``'s largest value."""
    true = reference(temperature)
    return float(np.max(np.abs(law(temperature) - true)) / np.max(np.abs(true)))


def _check_form(form: str) -> None:
    if form not in FORMS:
        raise InputError(f"There is no law of the form {form!r}.{did_you_mean(form, FORMS)}")


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


def _spline(knots: Sequence[float], values: Sequence[float], t: FloatArray) -> FloatArray:
    from scipy.interpolate import CubicSpline  # a rare form, and slow to import

    return np.asarray(CubicSpline(knots, values, bc_type="natural")(t), dtype=np.float64)


def _evaluate(form: str, coefficients: FloatArray, t: FloatArray) -> FloatArray:
    if form in POLYNOMIALS:
        return np.asarray(np.polynomial.polynomial.polyval(t, coefficients), dtype=np.float64)
    total = np.zeros(t.shape)
    for alpha, beta in coefficients.reshape(-1, 2):
        total = total + alpha * np.exp(beta * t)
    return total


def _gradient(form: str, coefficients: FloatArray, t: FloatArray) -> FloatArray:
    """Derivative (n, k) of the law at ``t`` (n,) by its coefficients."""
    if form in POLYNOMIALS:
        return np.asarray(np.vander(t, len(coefficients), increasing=True))
    columns = []
    for alpha, beta in coefficients.reshape(-1, 2):
        columns += [np.exp(beta * t), alpha * t * np.exp(beta * t)]
    return np.stack(columns, axis=1)


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
