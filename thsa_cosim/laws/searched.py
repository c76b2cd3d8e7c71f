"""A law over temperature as what is searched: unknowns of one size in place of its coefficients, and the way back.

Coefficients of a cubic law in degC differ by nine orders of magnitude and are all but collinear. A polynomial is
therefore searched by its values at as many temperatures (nodes); an exponential α exp(β t) by its value at the cold
end and its rate β, a second term by its value at the warm end and by what its rate is above the first one's: as neither
term can take the place of the other, every law has one set of unknowns.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from thsa_cosim.laws.law import FORMS, POLYNOMIALS, FloatArray, Law
from thsa_cosim.parameters import Parameter

#: An exponential changes by at most this factor, e^±6, over the temperatures: as in a fit to points.
STEEPEST = 6.0
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
        """(k,) degC of the values that are searched; for exponentials the ends."""
        if self.form not in (*POLYNOMIALS, "copper"):
            return np.array([self.cold, self.warm])
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
        terms = [(self._value(self.cold, "alpha1", share=True), self._rate("beta1"))]
        if self.form == "double-exponential":
            terms.append((self._value(self.warm, "alpha2", share=True), self._rate("beta2", above="beta1")))
        return tuple(p for term in terms for p in term)

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

    def _value(self, temperature: float, coefficient: str, *, share: bool = False) -> Parameter:
        p = self.parameter
        name, lower, scale = p.name, p.lower, p.scale
        if share:  # of a sum of terms one may be next to nothing, where a log scale would have no end
            name, lower, scale = f"{p.name}.{coefficient}", min(0.0, p.lower), "linear"
        return Parameter(
            f"{name}({temperature:.4g} degC)",
            f"{self.block}.{coefficient}",
            p.unit,
            lower,
            p.upper,
            scale,
            None if share else p.start,
            f"{p.description} at {temperature:.4g} degC".strip(),
            p.variable_unit,
        )

    def _rate(self, coefficient: str, above: str = "") -> Parameter:
        steepest, name = STEEPEST / (self.warm - self.cold), f"{self.parameter.name}.{coefficient}"
        label, lower = (f"{name}-{above}", 0.0) if above else (name, -steepest)
        return Parameter(label, f"{self.block}.{coefficient}", "1/K", lower, steepest)

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
        coefficients, slopes = np.empty(y.size), np.zeros((y.size, y.size))
        for k, at in zip(range(0, y.size, 2), self.nodes.tolist(), strict=False):
            value, rate = y[k], float(np.sum(y[1 : k + 2 : 2]))
            shrink = np.exp(-rate * at)
            coefficients[k : k + 2] = value * shrink, rate
            slopes[k, k] = shrink
            slopes[k, 1 : k + 2 : 2] = -at * value * shrink
            slopes[k + 1, 1 : k + 2 : 2] = 1.0
        return coefficients, slopes
