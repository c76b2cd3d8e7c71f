"""The cost of an identification, equation 6 of the article: J(θ) = Σ_k f(e(k)).

Each channel's error e is made dimensionless first, r = √w · (simulated - measured) / σ with the channel's
noise σ (1 standard deviation) and its weight w, so that channels add up. With f(r) = r² and w = 1 the sum
is minus twice the log-likelihood of white noise, and J/N is 1 when nothing but noise is left.

The robust f follow Huber, Robust Statistics (1981), chapter 3: his least-favourable loss with the usual
tuning constant 1.345 (95 % efficiency under normal noise), scaled to r² near 0.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

HUBER_WIDTH = 1.345
ABSOLUTE_WIDTH = 0.1


@dataclass(frozen=True)
class ErrorFunction:
    """One f of equation 6, with the smooth stand-in that the least-squares polish minimises.

    ``value``: r (n,) → f(r) (n,). ``smooth``: the stand-in (n,). ``psi`` and ``slope``: half its first and
    second derivative, for the search and the sandwich covariance.
    """

    name: str
    value: Callable[[FloatArray], FloatArray]
    psi: Callable[[FloatArray], FloatArray]
    slope: Callable[[FloatArray], FloatArray]
    smooth: Callable[[FloatArray], FloatArray]


def _huber(r: FloatArray) -> FloatArray:
    size = np.abs(r)
    return np.where(size <= HUBER_WIDTH, r * r, HUBER_WIDTH * (2.0 * size - HUBER_WIDTH))


ERRORS: Mapping[str, ErrorFunction] = MappingProxyType(
    {
        "squared": ErrorFunction("squared", np.square, lambda r: r, np.ones_like, np.square),
        "huber": ErrorFunction(
            "huber",
            _huber,
            lambda r: np.clip(r, -HUBER_WIDTH, HUBER_WIDTH),
            lambda r: (np.abs(r) <= HUBER_WIDTH).astype(np.float64),
            _huber,
        ),
        # |r| has no derivative at 0; the polish rounds it off within a tenth of the noise.
        "absolute": ErrorFunction(
            "absolute",
            np.abs,
            lambda r: r / np.sqrt(1.0 + (r / ABSOLUTE_WIDTH) ** 2),
            lambda r: (1.0 + (r / ABSOLUTE_WIDTH) ** 2) ** -1.5,
            lambda r: 2.0 * ABSOLUTE_WIDTH**2 * (np.sqrt(1.0 + (r / ABSOLUTE_WIDTH) ** 2) - 1.0),
        ),
    }
)


def error_terms(residuals: Mapping[str, FloatArray], error: str = "squared") -> dict[str, float]:
    """Σ_k f(r(k)) of every channel; ``residuals`` are weighted and dimensionless, each (n_channel,).

    A residual that is not finite makes its term +inf, so that a search discards the vector.
    """
    function = ERRORS[error]
    terms = {}
    for channel, residual in residuals.items():
        total = float(np.sum(function.value(residual)))
        terms[channel] = total if np.isfinite(total) else float("inf")
    return terms


def influence(residual: FloatArray, error: str = "squared") -> tuple[FloatArray, FloatArray]:
    """ψ(r) and ψ'(r), both (n,), of the smooth stand-in of f: the pieces of a sandwich covariance."""
    function = ERRORS[error]
    return function.psi(residual), function.slope(residual)


def window_mask(time: FloatArray, start: float | None = None, stop: float | None = None) -> BoolArray:
    """Which samples of ``time`` (n,) count: those within [start, stop] in s; (n,) of bool."""
    mask = np.ones(time.shape, dtype=np.bool_)
    if start is not None:
        mask &= time >= start
    if stop is not None:
        mask &= time <= stop
    return mask
