"""The search at one point: local searches, evolution, polish, uncertainty. In a thread of its own, it only asks."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from thsa_cosim.costs import TermsReducer
from thsa_cosim.identify.problem import Given, PointProblem
from thsa_cosim.identify.results import Estimate, PointResult, ProfileCurve
from thsa_cosim.search import (
    CHI2_95,
    Box,
    EvolutionSettings,
    Generation,
    LeastSquaresSettings,
    LocalSearch,
    LocalSettings,
    Minimum,
    PolishSettings,
    Residuals,
    Uncertainty,
    agreement,
    answer,
    confirm,
    estimate_uncertainty,
    evolve,
    least_squares,
    polish,
    profile,
    same_minimum,
    search_locally,
    with_given,
)
from thsa_cosim.search.strategies import SearchMethod
from thsa_cosim.signals import FloatArray, Signals
from thsa_cosim.study import Reply, Request, Want

Ask = Callable[[Request], Reply]

#: Standard errors that a value must be off zero: with some ten values to a study, two happen by chance.
CLEAR_OF_ZERO = 3.0


@dataclass(frozen=True, eq=False)
class PointSearch:
    """A point's result with the signals of its recordings at the estimate; None when nothing ran.

    ``jacobian``: of the stacked residuals (N, p) at the estimate, if there was a polish.
    """

    result: PointResult | None
    signals: tuple[Signals, ...]
    reason: str
    jacobian: FloatArray | None = None


class _HopelessError(Exception):
    """Not one vector of the first generation can be simulated."""


@dataclass(frozen=True, eq=False)
class _Found:
    """The best vector of a search and how it was found; ``minimum`` is None where no least squares ended there."""

    best: FloatArray
    minimum: Minimum | None
    local: tuple[LocalSearch, ...]
    generations: tuple[Generation, ...]
    converged: bool
    stopped: str


def search_point(
    point: PointProblem,
    method: SearchMethod,
    settings: EvolutionSettings,
    polishing: bool,
    ask: Ask,
    on_generation: Callable[[Generation], None] | None = None,
    on_evolution: Callable[[], None] | None = None,
) -> PointSearch:
    """Identify one point's parameters; ``ask`` simulates, whatever it costs.

    ``on_evolution`` is called when local searches did not agree, and an evolution begins that was not planned.
    """
    space = point.space
    try:
        if method == "local-first" and polishing:
            found = _locally_first(point, settings, ask, on_generation, on_evolution)
        else:
            found = _evolve(point, settings, ask, on_generation)
    except _HopelessError as error:
        return PointSearch(None, (), str(error))
    best, polished = found.best, ""
    profiles: dict[str, ProfileCurve] = {}
    uncertainty: Uncertainty | None = None
    jacobian: FloatArray | None = None
    if polishing:
        settled = PolishSettings(error=point.error)
        residuals = _residuals(ask)
        if found.minimum is None:
            sure = polish(residuals, best, settled)
        else:
            sure = answer(confirm(found.minimum, settled), residuals)
        polished = sure.reason
        if sure.residual is not None and sure.jacobian is not None and sure.jacobian_error is not None:
            best, jacobian = sure.best, sure.jacobian
            uncertainty = estimate_uncertainty(
                best,
                sure.residual,
                sure.jacobian,
                sure.jacobian_error,
                point.groups,
                space.names,
                point.error,
            )
            if point.given is not None:
                shifts = _given_jacobian(point.given, best, sure.residual, ask)
                uncertainty = with_given(uncertainty, sure.jacobian, shifts, point.given.covariance)
            profiles = _profiles(point, best, sure.jacobian, uncertainty, ask)
    return replace(_result(point, found, best, polished, uncertainty, profiles, ask), jacobian=jacobian)


def _residuals(ask: Ask) -> Residuals:
    return lambda vectors: ask(Request(Want.RESIDUALS, vectors)).residuals


def _start(point: PointProblem) -> FloatArray | None:
    given = any(p.start is not None for p in point.space.parameters)
    return point.space.start() if given else None


def _locally_first(
    point: PointProblem,
    settings: EvolutionSettings,
    ask: Ask,
    on_generation: Callable[[Generation], None] | None,
    on_evolution: Callable[[], None] | None,
) -> _Found:
    """Local searches; an evolution, polished, where they do not agree. The better of both is what was found."""
    least = LeastSquaresSettings(error=point.error)
    local = search_locally(
        _residuals(ask),
        point.space.dimension,
        LocalSettings(seed=settings.seed, least_squares=least),
        _start(point),
    )
    if local is not None and local.settled:
        return _Found(local.minimum.x, local.minimum, local.searches, (), True, agreement(local.searches))
    if on_evolution is not None:
        on_evolution()
    evolved = _evolve(point, settings, ask, on_generation)
    if local is None:
        return evolved
    box = Box.unit(point.space.dimension)
    minimum = answer(least_squares(evolved.best, box, least), _residuals(ask))
    if minimum is not None:
        local = local.with_minimum(minimum, point.error)
    reached = minimum is not None and same_minimum(minimum, local.minimum, point.error)
    stopped = (
        f"{agreement(local.searches)}; the evolution after them found {'that' if reached else 'a worse'} minimum"
        f" ({evolved.stopped})"
    )
    return _Found(local.minimum.x, local.minimum, local.searches, evolved.generations, reached, stopped)


def _evolve(
    point: PointProblem,
    settings: EvolutionSettings,
    ask: Ask,
    on_generation: Callable[[Generation], None] | None,
) -> _Found:
    """Differential evolution alone."""
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
            raise _HopelessError(f"all of the first {settings.population} simulations failed: {last_reason}")
        first = False
        return totals

    evolution = evolve(
        costs, point.space.dimension, settings, start=_start(point), on_generation=on_generation
    )
    return _Found(evolution.best, None, (), evolution.history, evolution.converged, evolution.reason)


def _result(
    point: PointProblem,
    found: _Found,
    best: FloatArray,
    polished: str,
    uncertainty: Uncertainty | None,
    profiles: Mapping[str, ProfileCurve],
    ask: Ask,
) -> PointSearch:
    """Simulate the best vector once more, for its cost terms and signals, and gather what was found."""
    space = point.space
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
        generations=found.generations,
        evaluations=0,
        converged=found.converged,
        stopped=found.stopped,
        polished=polished,
        local=found.local,
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
            _residuals(ask),
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
                reason = f"it cannot be distinguished from zero: one standard error is {stderr:.2g} {parameter.unit}"
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
