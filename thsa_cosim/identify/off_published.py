"""Values that a fit is sure of and that are not what the published law says: the last doubt where all else fits.

A gain of an input, a dead zone or a lag that a parameter takes up leaves no trace in the residual. Where a law was
published, the value shows it, and so does a machine that is not the law's: which of them it is, no fit can tell.
"""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from thsa_cosim.inspection import Expected, Finding, Residual, judge

KIND = "off-published"
_KNOWN = 0.01
"""How well a published law is known, relative."""
_SURE = 5.0
"""Standard errors beyond that. Of the shipped benches no value is farther than 2.1; seen while this was set."""
_LEAST = 0.02
"""Share of the published value that is worth a word."""


@dataclass(frozen=True, eq=False)
class Fitted:
    """One temperature: its ``label``, what the fit leaves there with slopes (n, p), p parameters."""

    label: str
    residuals: Sequence[Residual]
    parameters: Sequence[Expected]


def off_published(points: Iterable[Fitted], doubted: Collection[str]) -> list[Finding]:
    """Return one warning for each parameter that is surely not what its published law says, by its surest point.

    Points with ``doubted`` recordings, or where the fit leaves more than noise, do not count.
    """
    far: dict[str, list[tuple[float, int, Fitted]]] = {}
    for point in points:
        if (
            any(r.recording in doubted for r in point.residuals)
            or judge(point.residuals).verdict != "explained"
        ):
            continue
        for k, parameter in enumerate(point.parameters):
            if (errors := _errors(parameter)) > _SURE and point.residuals:
                far.setdefault(parameter.name, []).append((errors, k, point))
    return [_finding(found) for found in far.values()]


def _errors(parameter: Expected) -> float:
    """By how many standard errors a value is off what its law allows; 0 without a law, or where it is not sure."""
    if not parameter.published or not parameter.expected or not parameter.stderr:
        return 0.0
    apart, size = abs(parameter.value - parameter.expected), abs(parameter.expected)
    if not np.isfinite(parameter.stderr) or apart < _LEAST * size:
        return 0.0
    return (apart - _KNOWN * size) / parameter.stderr


def _finding(found: Sequence[tuple[float, int, Fitted]]) -> Finding:
    _, k, point = max(found, key=lambda one: one[0])
    p = point.parameters[k]
    # The signal that the value was mostly read from.
    residual = max(
        point.residuals, key=lambda r: float(np.linalg.norm(r.slopes[:, k])) if r.slopes.size else 0.0
    )
    moving = [name for name, values in residual.inputs.items() if values.size and np.ptp(values) > 0.0]
    signals = " or ".join([residual.channel, *moving])
    expected, stderr = p.expected or np.nan, p.stderr or np.nan
    others = f" (the surest of {len(found)} temperatures)" if len(found) > 1 else ""
    away = 100.0 * (p.value / expected - 1.0)
    off = f"{away:+.2g} %, " if abs(away) < 100.0 else ""
    text = (
        f"{p.name} at {point.label}{others} is {p.value:.4g} {p.unit} where its published law says {expected:.4g}"
        f" ({off}{abs(p.value - expected) / stderr:.2g} standard errors), though what the fit leaves is noise: another"
        f" machine than the law's, or an error of {signals} that {p.name} takes up, such as a gain, a dead zone or a"
        " lag; calibrate before you use the value"
    )
    return Finding(residual.recording, residual.channel, KIND, "warning", text)
