"""The picture that argues for a verdict: what is missing, over its cause, with what both models say of it."""

import math
from collections.abc import Mapping

import numpy as np

from thsa_cosim.report.diagnose.structure import clearest
from thsa_cosim.report.folder import Json, Part
from thsa_cosim.report.parts.chart import AFTER, BEFORE, INK, Chart
from thsa_cosim.report.parts.comparison import role_text
from thsa_cosim.report.parts.content import Figure
from thsa_cosim.report.parts.text import percent
from thsa_cosim.signals import FloatArray

#: Root mean square of the bins' distance from the declared model, in standard errors, from which a picture argues.
_ARGUES = 2.0
_QUANTITIES = {"A": "current", "V": "voltage", "N": "force", "N.m": "torque", "W": "power", "m/s": "speed"}
"""What a residual is, by its unit."""


def evidence(part: Part) -> Figure | None:
    """What the balance at fault misses, over its cause; else the clearest dependence of a residual; else None.

    A balance in which the declared model is as near to the recordings as their errors allow speaks for no effect: then
    the dependence is drawn, if there is one.
    """
    found: Json | None = (part.result or {}).get("evidence")
    if not found:
        return clearest(part)
    bins = {name: _column(values) for name, values in found["bins"].items()}
    added = [str(e["name"]) for e in (part.result or {}).get("effects", [])]
    if added and not _argues(bins) and (instead := clearest(part)) is not None:
        return instead
    quantity = _QUANTITIES.get(found["unit"], "quantity")
    drawn = Chart(f"{part.prefix}evidence", row_height=340)
    labels = {
        "before": "declared model",
        "after": f"model with {' and '.join(added)}" if added else "fitted model",
    }
    for name, colour, dash in (("before", BEFORE, "dash"), ("after", AFTER, "solid")):
        if np.isfinite(bins[name]).any():
            drawn.line(bins["at"], bins[name], labels[name], colour=colour, dash=dash, width=2.2)
    error = 1.96 * bins["stderr"]
    drawn.points(bins["at"], bins["measured"], "measured", colour=INK, size=6, error=error)
    drawn.level(0.0)
    drawn.axes(
        x=f"{found['cause']} [{found['cause_unit']}]",
        y=f"missing {quantity}, balance “{found['equation']}” [{found['unit']}]",
    )
    return drawn.build(
        f"What the balance “{found['equation']}” leaves open in {found['left']} over {found['cause']}, on"
        f" {role_text(found['part']).replace(' ', '-')} recordings: means in bins with 95 % intervals, and the"
        " same from either model."
        f" {percent(found['share'])} of it depends on {found['cause']}. Re-fitting the declared parameters explains"
        " none of it."
    )


def _argues(bins: Mapping[str, FloatArray]) -> bool:
    """Whether the declared model misses the bins by more than chance; one that says nothing of them does."""
    apart = (bins["measured"] - bins["before"]) / bins["stderr"]
    known = apart[np.isfinite(apart)]
    return not known.size or float(np.sqrt(np.mean(np.square(known)))) > _ARGUES


def _column(values: list[float | None]) -> FloatArray:
    return np.array([math.nan if v is None else v for v in values], dtype=np.float64)
