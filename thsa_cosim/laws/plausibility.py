"""Whether a material can have this law over temperature: sign, direction and rate.

A doubt is a warning, not a refusal: the law may follow its points perfectly. It says that something else than the named
material acts in the parameter, or that the points are wrong. Limits are wide: a doubt exceeds three standard errors of
the law (where they are known) and 2 % of its largest value.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.laws.fit import fit_law
from thsa_cosim.laws.law import COPPER, FloatArray, Law
from thsa_cosim.laws.quantity import COULOMB, FLUX, RESISTANCE, VISCOUS, Quantity

SHARE = 0.02
"""Of the largest value: smaller reversals are within what laws are rounded to."""
COPPER_SHARE = 0.1
"""Deviation from copper that leads, contacts and the sensor's place do not explain."""
MAGNET_RATE = 2.5e-3
"""1/K, faster than any magnet's flux changes reversibly (ferrite: 2.0e-3, IEC 60404-8-1)."""
VISCOSITY_RATE = 0.25
"""1/K of the logarithm, faster than any lubricant thickens above its pour point (about 0.1/K at −55 degC)."""
VOGEL_SHARE = 0.25
"""Distance from the nearest Vogel law, of the value, that a viscosity does not have."""
_POINTS = 161


@dataclass(frozen=True)
class Doubt:
    """What a law does that its material does not: ``kind`` is "sign", "direction" or "rate".

    ``where``: from and to, in degC. ``severity``: "warning", or "note" where ordinary causes are known.
    """

    kind: str
    where: tuple[float, float]
    text: str
    severity: str = "warning"


def doubts_about(
    law: Law, quantity: Quantity | None, name: str, unit: str, coldest: float, warmest: float
) -> tuple[Doubt, ...]:
    """The doubts about ``law`` of the parameter ``name`` [unit] between two temperatures in degC.

    Without a quantity there are none.
    """
    if quantity is None or not coldest < warmest:
        return ()
    t = np.linspace(coldest, warmest, _POINTS)
    course = _Course(name, unit, quantity, t, law(t), np.nan_to_num(law.stderr(t)))
    if not np.isfinite(course.y).all():
        return ()
    direction = _direction(course)
    # What goes the wrong way has no rate to compare, but copper's resistance is known at every temperature.
    rate = _rate(course) if direction is None or quantity is RESISTANCE else None
    return tuple(doubt for doubt in (_sign(course), direction, rate) if doubt is not None)


@dataclass(frozen=True, eq=False)
class _Course:
    """A law's values ``y`` (n,) ± ``error`` (n,) at ``t`` (n,) in degC, rising."""

    name: str
    unit: str
    quantity: Quantity
    t: FloatArray
    y: FloatArray
    error: FloatArray

    @property
    def largest(self) -> float:
        """Size of the largest value."""
        return float(np.max(np.abs(self.y)))

    def at(self, k: int) -> str:
        """Value and temperature as text."""
        return f"{_number(self.y[k])} {self.unit} at {_degrees(self.t[k])}"


def _number(value: float) -> str:
    return f"{value:.3g}".replace("-", "−", 1) if value < 0.0 else f"{value:.3g}"


def _degrees(t: float) -> str:
    return f"{t:.0f} °C".replace("-", "−")


def _sign(c: _Course) -> Doubt | None:
    below = c.y < -3.0 * c.error - SHARE * 0.05 * c.largest
    if not below.any():
        return None
    worst = int(np.argmin(c.y))
    why = {
        VISCOUS: "a damper with a negative coefficient feeds energy in",
        COULOMB: "friction that helps the motion feeds energy in",
    }
    reason = why.get(c.quantity, f"{c.quantity.text} is positive")
    return Doubt("sign", _where(c, below), f"{c.name} is negative, {c.at(worst)}: {reason}.")


def _direction(c: _Course) -> Doubt | None:
    """The largest step against the direction in which the material goes as it warms."""
    if c.quantity.rises is None:
        return None
    up = -c.y if c.quantity.rises else c.y
    least = np.minimum.accumulate(up)
    end = int(np.argmax(up - least))
    begin = int(np.argmin(up[: end + 1]))
    step = float(up[end] - up[begin])
    if step <= 3.0 * float(np.hypot(c.error[begin], c.error[end])) + SHARE * c.largest:
        return None
    does, ought = ("falls", "rises") if c.quantity.rises else ("rises", "falls")
    text = (
        f"{c.name} {does} as it warms, from {c.at(begin)} to {c.at(end)}; {c.quantity.text} {ought}"
        f" ({c.quantity.source})."
    )
    severity = "note" if c.quantity is COULOMB else "warning"
    return Doubt("direction", (float(c.t[begin]), float(c.t[end])), text, severity)


def _rate(c: _Course) -> Doubt | None:
    if not (c.y > 0.0).all():
        return None
    if c.quantity is RESISTANCE:
        return _unlike_copper(c)
    if c.quantity is FLUX:
        return _too_fast(c, -np.diff(c.y) / np.diff(c.t) / float(np.mean(c.y)), MAGNET_RATE)
    if c.quantity is VISCOUS:
        return _too_fast(c, -np.diff(np.log(c.y)) / np.diff(c.t), VISCOSITY_RATE) or _unlike_vogel(c)
    return None


def _unlike_copper(c: _Course) -> Doubt | None:
    expected = c.y[-1] * (1.0 + COPPER * (c.t - 20.0)) / (1.0 + COPPER * (c.t[-1] - 20.0))
    excess = np.abs(c.y - expected) - 3.0 * (c.error + c.error[-1] * expected / c.y[-1])
    apart = excess > COPPER_SHARE * expected
    if not apart.any():
        return None
    k = int(np.argmax(excess / expected))
    text = (
        f"{c.name} is {c.at(k)}; copper that has {c.at(-1)} has {expected[k]:.3g} {c.unit} there"
        f" ({c.quantity.source})."
    )
    return Doubt("rate", _where(c, apart), text)


def _too_fast(c: _Course, rate: FloatArray, limit: float) -> Doubt | None:
    """``rate`` (n - 1,) in 1/K, positive as the value falls with temperature, against the material's fastest."""
    # Over ten steps of the grid, so that the ends of a polynomial do not decide alone.
    smooth = np.convolve(rate, np.full(10, 0.1), mode="valid")
    fast = smooth > limit
    if not fast.any():
        return None
    k = int(np.argmax(smooth)) + 5
    text = (
        f"{c.name} falls by {100 * smooth[k - 5]:.2g} %/K at {_degrees(c.t[k])}, faster than {c.quantity.text}"
        f" ({100 * limit:g} %/K; {c.quantity.source})."
    )
    low, high = np.flatnonzero(fast)[[0, -1]]
    return Doubt("rate", (float(c.t[low]), float(c.t[min(high + 10, c.t.size - 1)])), text)


def _unlike_vogel(c: _Course) -> Doubt | None:
    nearest = fit_law("vogel", c.t, c.y, np.maximum(c.y, 0.01 * c.largest))(c.t)
    apart = np.abs(c.y - nearest) - 3.0 * c.error > VOGEL_SHARE * nearest
    if not apart.any():
        return None
    k = int(np.argmax(np.abs(c.y - nearest) / nearest))
    text = f"{c.name} is {c.at(k)}; the nearest Vogel law has {nearest[k]:.3g} {c.unit} there ({c.quantity.source})."
    return Doubt("rate", _where(c, apart), text)


def _where(c: _Course, mask: NDArray[np.bool_]) -> tuple[float, float]:
    low, high = np.flatnonzero(mask)[[0, -1]]
    return float(c.t[low]), float(c.t[high])
