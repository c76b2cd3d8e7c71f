"""A law over temperature as what is searched: unknowns of one size in place of its coefficients, and the way back.

Coefficients of a cubic law in degC differ by nine orders of magnitude and are all but collinear. A polynomial is
therefore searched by its values at as many temperatures (nodes); an exponential by its value at the cold end and its
rate; two exponentials by the values of their sum at both ends, by the lower rate, and by how far the other is above it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from thsa_cosim.laws.law import FORMS, POLYNOMIALS, FloatArray, Law
from thsa_cosim.parameters import Parameter

#: An exponential changes by at most this factor, e^±6, over the temperatures: as in a fit to points.
STEEPEST = 6.0
#: Two rates differ at least by this share of the steepest: two terms of one rate are one term.
LEAST_APART = 0.05
#: Forms that can be searched.
SEARCHABLE = (*POLYNOMIALS, "copper", "exponential", "double-exponential")


@dataclass(frozen=True)
class SearchedLaw:
    """The law of ``parameter`` in the form ``form`` between ``cold`` and ``warm`` (degC, cold < warm).

    ``block``: the ``TemperatureLaw`` of the FMU that holds it.
    """

    parameter: Parameter
    form: str
    block: str
    cold: float
    warm: float

    @property
    def nodes(self) -> FloatArray:
        """(k,) degC of the values that are searched."""
        if self.form == "double-exponential":
            return np.array([self.cold, self.warm])
        if self.form == "exponential":
            return np.array([self.cold])
        return (
            np.linspace(self.cold, self.warm, FORMS[self.form])
            if FORMS[self.form] > 1
            else np.array([self.warm])
        )

    @property
    def unknowns(self) -> tuple[Parameter, ...]:
        """What is searched, in the order of the coefficients; values have bounds, scale and unit of the parameter."""
        if self.form in (*POLYNOMIALS, "copper"):
            return tuple(self._value(t, f"a{k}") for k, t in enumerate(self.nodes.tolist()))
        values = tuple(self._value(t, f"alpha{k + 1}") for k, t in enumerate(self.nodes.tolist()))
        steepest = STEEPEST / (self.warm - self.cold)
        rate = Parameter(f"{self.parameter.name}.beta1", f"{self.block}.beta1", "1/K", -steepest, steepest)
        if self.form == "exponential":
            return (*values, rate)
        label = f"{self.parameter.name}.beta2-beta1"
        apart = Parameter(label, f"{self.block}.beta2", "1/K", LEAST_APART * steepest, 2.0 * steepest)
        return (*values, rate, apart)

    @property
    def members(self) -> tuple[str, ...]:
        """Names of the unknowns."""
        return tuple(p.name for p in self.unknowns)

    def law(self, values: Sequence[float], covariance: FloatArray | None = None) -> Law:
        """The law for values (k,) of the unknowns, in their order; ``covariance`` (k, k) of these becomes its own."""
        y = np.asarray(values, dtype=np.float64)
        coefficients, slopes = self._coefficients(y)
        own = None if covariance is None else slopes @ covariance @ slopes.T
        return Law(self.form, tuple(coefficients.tolist()), covariance=own)

    def assignments(self, values: Mapping[str, float]) -> dict[str, float]:
        """FMU start values of the block for named ``values`` of the unknowns."""
        law = self.law([values[name] for name in self.members])
        factor = self.parameter.to_variable(1.0)
        return {n: v if ".beta" in n else v * factor for n, v in law.block_values(self.block).items()}

    def _value(self, temperature: float, coefficient: str) -> Parameter:
        p = self.parameter
        return Parameter(
            f"{p.name}({temperature:.4g} degC)",
            f"{self.block}.{coefficient}",
            p.unit,
            p.lower,
            p.upper,
            p.scale,
            p.start,
            f"{p.description} at {temperature:.4g} degC".strip(),
            p.variable_unit,
        )

    def _coefficients(self, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The coefficients (k,) and their derivative (k, k) by the unknowns ``y`` (k,)."""
        if self.form == "copper":
            scale = 1.0 / float(Law("copper", (1.0,))(self.nodes[0]))
            return y * scale, np.array([[scale]])
        if self.form in POLYNOMIALS:
            # in a variable of size one, then to degC: the powers' matrix is all but singular otherwise
            size = max(float(np.max(np.abs(self.nodes))), 1.0)
            scaled = np.linalg.inv(np.vander(self.nodes / size, y.size, increasing=True))
            slopes = scaled / (size ** np.arange(y.size))[:, None]
            return np.asarray(slopes @ y), np.asarray(slopes)
        return self._two_exponentials(y) if self.form == "double-exponential" else self._one_exponential(y)

    def _one_exponential(self, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        value, rate = y
        shrink = np.exp(-rate * self.cold)
        slopes = np.array([[shrink, -self.cold * value * shrink], [0.0, 1.0]])
        return np.array([value * shrink, rate]), slopes

    def _two_exponentials(self, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """α1, β1, α2, β2 from the sum at both ends, β1 and β2 − β1; A and C are the terms at their own ends."""
        span, rates = self.warm - self.cold, np.array([y[2], y[2] + y[3]])
        rise, fall = np.exp(rates[0] * span), np.exp(-rates[1] * span)
        solve = np.linalg.inv(np.array([[1.0, fall], [rise, 1.0]]))
        amplitudes = solve @ y[:2]
        by_first = -solve @ np.array([0.0, span * rise * amplitudes[0]])
        by_second = -solve @ np.array([-span * fall * amplitudes[1], 0.0])
        inner = np.column_stack([solve, by_first + by_second, by_second])  # of A and C by the unknowns
        by_rates = np.array([[0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 1.0, 1.0]])
        coefficients, slopes = np.empty(4), np.empty((4, 4))
        for k, at in enumerate(self.nodes.tolist()):
            shrink = np.exp(-rates[k] * at)
            coefficients[2 * k : 2 * k + 2] = amplitudes[k] * shrink, rates[k]
            slopes[2 * k] = shrink * (inner[k] - at * amplitudes[k] * by_rates[k])
            slopes[2 * k + 1] = by_rates[k]
        return coefficients, slopes
