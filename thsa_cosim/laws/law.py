"""The forms of laws over temperature, and a law of one of them.

A law gives a parameter's value at a temperature t in degC. Polynomial coefficients run from α0 up; an
exponential is α1 exp(β1 t) and a double exponential α1 exp(β1 t) + α2 exp(β2 t) with β1 < β2, so that
coefficients are [α1, β1] and [α1, β1, α2, β2]. A spline is the natural cubic one through the points.

Two forms are physical. "copper" is R20 (1 + 0.00393 (t − 20)) with the coefficient [R20]: annealed copper, IEC 60028.
"vogel" is A exp(B / (t − T0)) with [A, B, T0], T0 in degC below all temperatures: the viscosity of lubricants after
Vogel (Physikalische Zeitschrift 22, 1921), Fulcher and Tammann.
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
        "copper": 1,
        "vogel": 3,
        "spline": 0,
    }
)
POLYNOMIALS = ("constant", "linear", "quadratic", "cubic")
PHYSICAL = ("copper", "vogel")
#: The forms that selection weighs against each other: a spline always fits, so it takes no part. A physical form
#: does where the quantity is of its kind (:func:`thsa_cosim.laws.candidates_for`).
CANDIDATES = tuple(form for form in FORMS if form not in ("spline", *PHYSICAL))
#: Rise of copper's resistance per K, as a share of that at 20 degC (IEC 60028).
COPPER = 3.93e-3


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
            return spline(self.knots, self.coefficients, t)
        return evaluate(self.form, np.array(self.coefficients), t)

    def stderr(self, temperature: FloatArray | float) -> FloatArray:
        """One standard error of the law at ``temperature``; NaN where no covariance is known."""
        t = np.asarray(temperature, dtype=np.float64)
        if self.covariance is None:
            return np.full(t.shape, np.nan)
        slopes = gradient(self.form, np.array(self.coefficients), t.reshape(-1))
        variance = np.einsum("ni,ij,nj->n", slopes, self.covariance, slopes)
        return np.asarray(np.sqrt(np.maximum(variance, 0.0)).reshape(t.shape))

    @property
    def fits_block(self) -> bool:
        """Whether a ``TemperatureLaw`` block of ``modelica/THSA`` can express the form."""
        return self.form not in ("spline", "vogel")

    def block_values(self, block: str) -> dict[str, float]:
        """Start values of a ``TemperatureLaw`` block of ``modelica/THSA``: all eight coefficients.

        Raises InputError for a spline or a Vogel law, which that block cannot express.
        """
        if not self.fits_block:
            raise InputError(f"A {self.form} law cannot be written into {block!r}: choose another form.")
        names = ("a0", "a1", "a2", "a3", "alpha1", "beta1", "alpha2", "beta2")
        values = dict.fromkeys(names, 0.0)
        coefficients, straight = self.coefficients, (*POLYNOMIALS, "copper")
        if self.form == "copper":
            coefficients = (coefficients[0] * (1.0 - 20.0 * COPPER), coefficients[0] * COPPER)
        values.update(zip(names[:4] if self.form in straight else names[4:], coefficients, strict=False))
        return {f"{block}.{name}": value for name, value in values.items()}


def published_law(form: str, coefficients: Sequence[float]) -> Law:
    """A law with given ``coefficients``; InputError for an unknown form or a wrong number of them."""
    check_form(form)
    if form == "spline" or len(coefficients) != FORMS[form]:
        raise InputError(f"A {form} law takes {FORMS[form] or 'no'} coefficients, not {len(coefficients)}.")
    return Law(form, tuple(float(c) for c in coefficients))


def largest_deviation(law: Law, reference: Law, temperature: FloatArray) -> float:
    """Largest distance of two laws over ``temperature`` (n,), relative to ``reference``'s largest value."""
    true = reference(temperature)
    return float(np.max(np.abs(law(temperature) - true)) / np.max(np.abs(true)))


def check_form(form: str) -> None:
    """Raise InputError for an unknown form."""
    if form not in FORMS:
        raise InputError(f"There is no law of the form {form!r}.{did_you_mean(form, FORMS)}")


def spline(knots: Sequence[float], values: Sequence[float], t: FloatArray) -> FloatArray:
    """The natural cubic spline through ``values`` (k,) at ``knots`` (k,), at ``t`` (n,)."""
    from scipy.interpolate import CubicSpline  # a rare form, and slow to import

    return np.asarray(CubicSpline(knots, values, bc_type="natural")(t), dtype=np.float64)


def evaluate(form: str, coefficients: FloatArray, t: FloatArray) -> FloatArray:
    """Values (n,) of the form with ``coefficients`` (k,) at ``t`` (n,) in degC; of all forms but the spline."""
    if form == "copper":
        return np.asarray(coefficients[0] * (1.0 + COPPER * (t - 20.0)), dtype=np.float64)
    if form == "vogel":
        amplitude, activation, pole = coefficients
        return np.asarray(amplitude * np.exp(activation / (t - pole)), dtype=np.float64)
    if form in POLYNOMIALS:
        return np.asarray(np.polynomial.polynomial.polyval(t, coefficients), dtype=np.float64)
    total = np.zeros(t.shape)
    for alpha, beta in coefficients.reshape(-1, 2):
        total = total + alpha * np.exp(beta * t)
    return total


def gradient(form: str, coefficients: FloatArray, t: FloatArray) -> FloatArray:
    """Derivative (n, k) of the law at ``t`` (n,) by its coefficients (k,)."""
    if form == "copper":
        return (1.0 + COPPER * (t - 20.0))[:, None]
    if form == "vogel":
        amplitude, activation, pole = coefficients
        rise = np.exp(activation / (t - pole))
        by_pole = amplitude * rise * activation / (t - pole) ** 2
        return np.stack([rise, amplitude * rise / (t - pole), by_pole], axis=1)
    if form in POLYNOMIALS:
        return np.asarray(np.vander(t, len(coefficients), increasing=True))
    columns = []
    for alpha, beta in coefficients.reshape(-1, 2):
        columns += [np.exp(beta * t), alpha * t * np.exp(beta * t)]
    return np.stack(columns, axis=1)
