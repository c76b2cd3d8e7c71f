"""The search at one point: evolution, polish, uncertainty. Runs in a thread of its own and only asks."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from thsa_cosim.identify.evaluate import Reply, Request, Want
from thsa_cosim.identify.problem import PointProblem
from thsa_cosim.identify.results import Estimate, PointResult
from thsa_cosim.search import (
    EvolutionSettings,
    Generation,
    PolishSettings,
    Uncertainty,
    estimate_uncertainty,
    evolve,
    polish,
)
from thsa_cosim.signals import FloatArray, Signals

Ask = Callable[[Request], Reply]


@dataclass(frozen=True, eq=False)
class PointSearch:
    """A point's result with the signals of its recordings at the estimate; None when nothing ran."""

    result: PointResult | None
    signals: tuple[Signals, ...]
    reason: str


class _HopelessError(Exception):
    """Not one vector of the first generation can be simulated."""


def search_point(
    point: PointProblem,
    settings: EvolutionSettings,
    polishing: bool,
    ask: Ask,
    on_generation: Callable[[Generation], None] | None = None,
) -> PointSearch:
    """Identify one point's parameters; ``ask`` simulates, whatever it costs."""
    last_reason = ""
    first = True

    def costs(vectors: FloatArray) -> FloatArray:
        nonlocal first, last_reason
        reply = ask(Request(Want.TERMS, vectors))
        last_reason = next((reason for reason in reply.reasons if reason), last_reason)
        totals = np.asarray(np.sum(reply.terms, axis=1))
        if first and not np.isfinite(totals).any():
            raise _HopelessError
        first = False
        return totals

    space = point.space
    start = space.start() if any(p.start is not None for p in space.parameters) else None
    try:
        evolution = evolve(costs, space.dimension, settings, start=start, on_generation=on_generation)
    except _HopelessError:
        return PointSearch(
            None, (), f"all of the first {settings.population} simulations failed: {last_reason}"
        )
    best, polished = evolution.best, ""
    uncertainty: Uncertainty | None = None
    if polishing:
        found = polish(
            lambda vectors: ask(Request(Want.RESIDUALS, vectors)).residuals,
            best,
            PolishSettings(error=point.error),
        )
        polished = found.reason
        if found.residual is not None and found.jacobian is not None and found.jacobian_error is not None:
            best = found.best
            uncertainty = estimate_uncertainty(
                best,
                found.residual,
                found.jacobian,
                found.jacobian_error,
                point.groups,
                space.names,
                point.error,
            )
    final = ask(Request(Want.TERMS, best[None, :]))
    signals = ask(Request(Want.SIGNALS, best[None, :])).signals[0]
    if signals is None:
        return PointSearch(None, (), "the identified vector could not be simulated again")
    terms = dict(zip(point.channel_names, final.terms[0].tolist(), strict=True))
    cost = float(np.sum(final.terms[0]))
    result = PointResult(
        label=point.label,
        temperature_degC=point.temperature_degC,
        recordings=tuple(case.name for case in point.cases),
        parameters=_estimates(point, best, uncertainty),
        correlation=np.full((space.dimension,) * 2, np.nan)
        if uncertainty is None
        else uncertainty.correlation,
        cost=cost,
        cost_per_sample=cost / point.samples,
        terms=terms,
        generations=evolution.history,
        evaluations=0,
        converged=evolution.converged,
        stopped=evolution.reason,
        polished=polished,
    )
    return PointSearch(result, signals, "")


def _estimates(point: PointProblem, best: FloatArray, uncertainty: Uncertainty | None) -> dict[str, Estimate]:
    values = point.space.physical(best)
    slopes = point.space.slope(best)
    estimates = {}
    for i, parameter in enumerate(point.space.parameters):
        value = float(values[i])
        if uncertainty is None:
            stderr, reason = None, "its uncertainty was not estimated (polish = false)"
        else:
            size = float(uncertainty.stderr[i] * abs(slopes[i]))
            stderr = size if np.isfinite(size) else None
            reason = uncertainty.reasons[i]
            if not reason and stderr is not None and stderr >= abs(value):
                reason = f"its standard error {stderr:.2g} {parameter.unit} is as large as its value"
        estimates[parameter.name] = Estimate(
            value=value,
            unit=parameter.unit,
            stderr=stderr,
            identifiable=not reason,
            reason=reason,
            lower=parameter.lower,
            upper=parameter.upper,
        )
    return estimates
