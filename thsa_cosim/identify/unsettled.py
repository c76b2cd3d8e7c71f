"""Points whose values the recordings do not settle, however small the misfit."""

from collections.abc import Sequence

from thsa_cosim.identify.results import PointResult


def unsettled(points: Sequence[PointResult], polished: bool) -> list[str]:
    """Return a sentence for each point without a determined parameter, then for each parameter on a bound.

    What is determined is not known without a polish: then nothing is said of it.
    """
    blind = [
        f"the recordings determine no parameter at {point.label}: they are too short, or nothing in them shows it"
        for point in points
        if polished and point.parameters and not any(e.identifiable for e in point.parameters.values())
    ]
    ends = [
        f"{name} lies on its {side} bound at {point.label}: the fit would have gone on"
        for point in points
        for name, estimate in point.parameters.items()
        if (side := estimate.on_bound)
    ]
    return [*blind, *ends]
