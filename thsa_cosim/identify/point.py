"""The search at one point: evolution, polish, uncertainty. Runs in a thread of its own and only asks."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from thsa_cosim.costs import TermsReducer
from thsa_cosim.identify.evaluate import Reply, Request, Want
from thsa_cosim.identify.problem import Given, PointProblem
from thsa_cosim.identify.results import Estimate, PointResult, ProfileCurve
from thsa_cosim.search import (
    CHI2_95,
    EvolutionSettings,
    Generation,
    PolishSettings,
    Uncertainty,
    estimate_uncertainty,
    evolve,
    polish,
    profile,
    with_given,
)
from thsa_cosim.signals import FloatArray, Signals

Ask = Callable[[Request], Reply]

#: Standard errors that a value must be off zero: with some ten values to a study, two happen by chance.
CLEAR_OF_ZERO = 3.0


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
            # Simulations that succeeded, against recordings or noise of an absurd size.
            endless = [
                c for c, t in zip(point.channel_names, reply.terms.T, strict=True) if np.isinf(t).all()
            ]
            last_reason = last_reason or f"the cost of {' and '.join(endless)} is not finite"
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
    profiles: dict[str, ProfileCurve] = {}
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
            if point.given is not None:
                shifts = _given_jacobian(point.given, best, found.residual, ask)
                uncertainty = with_given(uncertainty, found.jacobian, shifts, point.given.covariance)
            profiles = _profiles(point, best, found.jacobian, uncertainty, ask)
    final = ask(Request(Want.TERMS, best[None, :]))
    signals = ask(Request(Want.SIGNALS, best[None, :])).signals[0]
    if signals is None:
        return PointSearch(None, (), "the identified vector could not be simulated again")
    also = {name: _total(point, signals, name) for name in point.also}
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
        also=also,
        profiles=profiles,
        generations=evolution.history,
        evaluations=0,
        converged=evolution.converged,
        stopped=evolution.reason,
        polished=polished,
    )
    return PointSearch(result, signals, "")


def _profiles(
    point: PointProblem, best: FloatArray, jacobian: FloatArray, uncertainty: Uncertainty, ask: Ask
) -> dict[str, ProfileCurve]:
    """Profile likelihoods of the parameters that the scenario asks for, in the parameters' units."""
    curves = {}
    plain = np.diag(np.linalg.pinv(jacobian.T @ jacobian, hermitian=True))
    for i, parameter in enumerate(point.space.parameters):
        stderr = float(uncertainty.stderr[i])
        # A parameter per recording is asked for by the name it was given for all of them.
        wanted = parameter.name.partition("[")[0] in point.profile or parameter.name in point.profile
        if not wanted or not np.isfinite(stderr):
            continue
        # Residuals that are larger than stated, or correlated, make the same rise of the cost say less.
        threshold = CHI2_95 * max(1.0, stderr**2 / float(plain[i]))
        found = profile(
            lambda vectors: ask(Request(Want.RESIDUALS, vectors)).residuals,
            best,
            i,
            stderr,
            threshold,
            PolishSettings(error=point.error),
        )

        def physical(position: float, i: int = i) -> float | None:
            moved = best.copy()
            moved[i] = position
            return float(point.space.physical(moved)[i]) if np.isfinite(position) else None

        values = np.array([physical(p) for p in found.positions.tolist()], dtype=np.float64)
        curves[parameter.name] = ProfileCurve(
            values, found.costs, physical(found.lower), physical(found.upper)
        )
    return curves


def _total(point: PointProblem, signals: tuple[Signals, ...], error: str) -> float:
    """Equation 6 with another f, at the estimate."""
    pairs = zip(point.cases, signals, strict=True)
    return float(sum(np.sum(TermsReducer(case.channels, error)(simulated)) for case, simulated in pairs))


def _given_jacobian(given: Given, best: FloatArray, residual: FloatArray, ask: Ask) -> FloatArray:
    """Derivative (N, m) of the residuals by the given values, central differences of one standard error."""
    steps, names = given.stderr, list(given.values)
    overrides = []
    for name, step in zip(names, steps.tolist(), strict=True):
        overrides += [{name: given.values[name] + step}, {name: given.values[name] - step}]
    vectors = np.repeat(best[None, :], len(overrides), axis=0)
    found = ask(Request(Want.RESIDUALS, vectors, tuple(overrides))).residuals if overrides else ()
    jacobian = np.zeros((residual.size, len(names)))
    for i in range(len(names)):
        above, below = found[2 * i], found[2 * i + 1]
        if above is not None and below is not None and steps[i] > 0.0:
            jacobian[:, i] = (above - below) / (2.0 * steps[i])
    return jacobian


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
            if not reason and stderr is not None and CLEAR_OF_ZERO * stderr > abs(value):
                reason = f"it cannot be told from zero: one standard error is {stderr:.2g} {parameter.unit}"
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
