"""Damped Gauss-Newton over simulations: Jacobians as one batch, their columns kept while they serve.

Levenberg (1944), Marquardt (1963); what is known beforehand enters as one more residual per unknown.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from thsa_cosim.diagnosis.fitting.trials import Part
from thsa_cosim.diagnosis.fitting.unknowns import Unknowns
from thsa_cosim.search import DifferenceSettings, answer, difference_columns
from thsa_cosim.signals import FloatArray

#: A difference step moves the residuals by this much in all (their norm, in standard deviations), or by this share of
#: their own norm: far from the optimum small steps see the solver's events more than the slope.
RESPONSE, SHARE = 60.0, 0.1
SMALLEST, LARGEST = 1e-7, 0.3
#: A step that gains this many times what it promised is tried at multiples. Where parts stick and slip, differences
#: see events that move, and make the outputs more sensitive than they are over a longer way: steps stop short. Both
#: were set while looking at one simulated unit with stick-slip.
UNDERRATED, FURTHER = 1.25, (2.0, 4.0, 8.0)
#: No step that is damped more is tried where one gains this share of what it promised.
FORESEEN = 0.5
#: A Jacobian serves for a further step where one gained this share of what it promised. Set beforehand.
SERVED = 0.8
#: A fit is given up so many steps from what is reached elsewhere, each as large as the last. Set while looking at two
#: simulated units, with cogging that sticks and with a Stribeck friction of another form.
HOPELESS = 4.0
#: Information (of unknowns each scaled to 1) below which a combination of them is not determined at all.
DETERMINED = 1e-11


class Compared(Protocol):
    """What a fit asks for of a `Bench`, or of one whose recordings are compared otherwise."""

    def residuals(self, unknowns: Unknowns, vectors: FloatArray, part: Part) -> list[FloatArray | None]:
        """Per vector (m, n) the residuals (N,), None where a run failed."""

    def level(self, part: Part) -> float:
        """Root mean square that noise alone leaves in them."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted vector (n,), the residuals (N,) there and their Jacobian (N, n) per ``scale`` of each unknown.

    ``steps`` (n,) are the difference steps, in scales. ``cost``: sum of squares with the prior's. ``shared``: the
    Jacobian's first columns (N, m), which many fits hold together; ``own`` (N, n - m): the others.
    """

    unknowns: Unknowns
    vector: FloatArray
    residual: FloatArray
    own: FloatArray
    steps: FloatArray
    cost: float
    converged: bool
    shared: FloatArray | None = None

    @property
    def jacobian(self) -> FloatArray:
        """(N, n) the Jacobian; put together each time where its first columns are shared."""
        return self.own if self.shared is None else np.concatenate([self.shared, self.own], axis=1)

    def sharing(self, columns: FloatArray) -> "Fit":
        """The same with ``columns`` (N, m), which the first m of its Jacobian equal, in place of a copy of them."""
        return replace(self, shared=columns, own=self.jacobian[:, columns.shape[1] :].copy())

    def at(self, names: Sequence[str]) -> FloatArray:
        """(m,) fitted values of the named unknowns."""
        return np.asarray(self.vector[self.unknowns.index(names)])

    def jacobian_of(self, unknowns: Unknowns, factors: FloatArray | float = 1.0) -> FloatArray:
        """(N, m) the Jacobian per scale of other ``unknowns``, all of which it has, its rows times ``factors`` (N,)."""
        which = self.unknowns.index(unknowns.names)
        columns = self.jacobian[:, which] * (unknowns.scale / self.unknowns.scale[which])
        return np.asarray(columns * np.reshape(factors, (-1, 1)))

    def steps_of(self, unknowns: Unknowns) -> FloatArray:
        """(m,) the difference steps, in scales of other ``unknowns``, all of which it has."""
        which = self.unknowns.index(unknowns.names)
        return np.asarray(self.steps[which] * self.unknowns.scale[which] / unknowns.scale)

    def rows(self, part: slice) -> "Fit":
        """The same fit with a ``part`` of its residuals and of the Jacobian's rows only."""
        residual, own = self.residual[part], self.jacobian[part]
        cost = cost_of(self.unknowns, self.vector, residual)
        return replace(self, residual=residual, own=own, shared=None, cost=cost)

    @property
    def misfit(self) -> float:
        """Sum of squared residuals without the prior's."""
        return float(self.residual @ self.residual)

    @property
    def information(self) -> FloatArray:
        """(n, n) JᵀJ + prior, per scale."""
        prior = self.unknowns.precision * self.unknowns.scale
        jacobian = self.jacobian
        return np.asarray(jacobian.T @ jacobian + np.diag(prior**2))

    @property
    def folded(self) -> "Fit":
        """The same with R (n, n) in place of the Jacobian, RᵀR = JᵀJ: what covariances need, without a row a sample."""
        return replace(self, shared=None, own=np.asarray(np.linalg.qr(self.jacobian, mode="r")))

    @property
    def inflation(self) -> float:
        """Mean squared residual in variances of the noise, at least 1: how much less the recordings say for it."""
        return max(1.0, self.misfit / self.residual.size)

    @property
    def remaining_step(self) -> FloatArray:
        """(n,) how far the optimum still is by Gauss-Newton, in the unknowns' units; 0 for one that its bound holds."""
        unknowns, scale = self.unknowns, self.unknowns.scale
        pull = self.jacobian.T @ self.residual + unknowns.prior(self.vector) * unknowns.precision * scale
        inverse = self.covariance()
        step = -np.where(np.isfinite(inverse), inverse, 0.0) @ pull * scale
        return np.asarray(unknowns.clip(self.vector + step) - self.vector)

    def covariance(self, inflation: float = 1.0) -> FloatArray:
        """(n, n) covariance, per scale; infinite on the diagonal of what nothing determines.

        ``inflation`` widens what the recordings say; what the drawing says stays as it is.
        """
        prior = self.unknowns.precision * self.unknowns.scale
        jacobian = self.jacobian
        information = jacobian.T @ jacobian / inflation + np.diag(prior**2)
        size = np.sqrt(np.diag(information))
        size[size == 0.0] = 1.0
        values, vectors = np.linalg.eigh(information / np.outer(size, size))
        known = values > DETERMINED
        covariance = (vectors[:, known] / values[known]) @ vectors[:, known].T / np.outer(size, size)
        open_ = np.sum(vectors[:, ~known] ** 2, axis=1) > 1e-6
        covariance[open_, open_] = np.inf
        return np.asarray(covariance)

    def stderr(self, inflation: float = 1.0) -> FloatArray:
        """(n,) standard errors in the unknowns' units, by `covariance`; infinite where nothing determines one."""
        return np.asarray(np.sqrt(np.diag(self.covariance(inflation))) * self.unknowns.scale)


def cost_of(unknowns: Unknowns, vector: FloatArray, residual: FloatArray) -> float:
    """Sum of squares of residuals and prior."""
    prior = unknowns.prior(vector)
    return float(residual @ residual + prior @ prior)


def columns(
    bench: Compared,
    unknowns: Unknowns,
    vector: FloatArray,
    centre: FloatArray,
    which: list[int],
    steps: FloatArray,
    response: float | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Jacobian columns (N, len(which)) per scale by one-sided differences, and the steps that serve next time.

    A column whose response was far from ``response`` (default: RESPONSE as weighed, or SHARE of the residuals' norm) is
    taken again with a better step; one that cannot be simulated is zero.
    """
    aim = _response(bench, centre) if response is None else response
    settings = DifferenceSettings(aim, 0.0, smallest=SMALLEST, largest=LARGEST, repeats=2)
    asked = difference_columns(vector, centre, steps, unknowns.box, settings, which)
    return answer(asked, lambda vectors: bench.residuals(unknowns, vectors, "fit"))


def _response(bench: Compared, residual: FloatArray) -> float:
    """By how much a difference step is to move the residuals, as they are weighed."""
    return max(RESPONSE * bench.level("fit"), SHARE * float(np.linalg.norm(residual)))


def refine(
    bench: Compared,
    unknowns: Unknowns,
    vector: FloatArray,
    *,
    residual: FloatArray | None = None,
    jacobian: FloatArray | None = None,
    steps: FloatArray | None = None,
    fresh: list[int] | None = None,
    anew: bool = False,
    near: bool = False,
    iterations: int = 8,
    enough: float = 1.0,
    to_beat: float = np.inf,
) -> Fit | None:
    """Minimise the fit recordings' squared residuals from ``vector`` (n,).

    ``jacobian`` (N, n) is used as given at the start, unless its columns ``fresh`` are to be taken ``anew`` there, too;
    in later iterations they are. Without ``fresh`` all of them are, but not before a step gains less than SERVED of
    what it promised, or the fit would end: it ends by no Jacobian of another vector, which a given one is if it is
    ``near``. Stops when a step promises or brings less than ``enough`` mean squares of what is left (at least of the
    noise), or so little that the cost ``to_beat``, reached elsewhere, is HOPELESS steps away. None if the start cannot
    be simulated.
    """
    n = len(unknowns.members)
    vector = unknowns.clip(vector)
    if residual is None:
        residual = bench.residuals(unknowns, vector[None, :], "fit")[0]
        if residual is None:
            return None
    steps = np.full(n, 1e-2) if steps is None else steps
    renew = list(range(n)) if fresh is None else fresh
    jacobian = np.zeros((residual.size, n), order="F") if jacobian is None else jacobian.copy(order="F")
    cost, damping, converged, stale = (
        cost_of(unknowns, vector, residual),
        1e-6,
        False,
        anew or not jacobian.any(),
    )
    response: float | None = None
    left = iterations
    while left:
        left -= not near  # what keeps its Jacobian is a small part of an iteration
        if stale:
            new, steps = columns(bench, unknowns, vector, residual, renew, steps, response)
            jacobian[:, renew] = new
            near = False
        state = Fit(unknowns, vector, residual, jacobian, steps, cost, converged)
        better, promised, damping = _step(bench, state, damping)
        least = enough * state.inflation
        if better is None:
            if near:
                near, stale = False, True
                continue
            if promised < least:
                converged = True
                break
            if response is not None:
                break
            response, stale = 5.0 * _response(bench, residual), True
            continue
        gained = cost - better.cost
        vector, residual, cost = better.vector, better.residual, better.cost
        response = None
        if cost - HOPELESS * max(gained, promised) > to_beat:
            break
        if gained < least and not near:
            converged = True
            break
        stale = fresh is not None or gained < max(least, SERVED * promised)
        near = not stale
    return Fit(unknowns, vector, residual, jacobian, steps, cost, converged)


def _step(bench: Compared, state: Fit, damping: float) -> tuple[Fit | None, float, float]:
    """One damped step: the better fit or None, the decrease that was promised, the next damping."""
    unknowns, scale = state.unknowns, state.unknowns.scale
    information = state.information
    gradient = state.jacobian.T @ state.residual + unknowns.prior(state.vector) * unknowns.precision * scale
    diagonal = np.diag(information).copy()
    diagonal[diagonal <= 0.0] = 1.0
    for _ in range(3):
        dampings = [damping * 10.0**k for k in (0, 2, 4)]
        trials = [_bounded(state, information + np.diag((d + 1e-12) * diagonal), gradient) for d in dampings]
        step = (trials[0] - state.vector) / scale
        promised = float(-2.0 * gradient @ step - step @ information @ step)
        if promised < 1e-3:
            return None, promised, damping
        found, costs = _tried(bench, unknowns, trials[:1])
        if not state.cost - costs[0] > FORESEEN * promised:
            others = _tried(bench, unknowns, trials[1:])
            found, costs = [*found, *others[0]], [*costs, *others[1]]
        best = int(np.argmin(costs))
        residual = found[best]
        if costs[best] < state.cost and residual is not None:
            damping = max(1e-9, dampings[best] * (0.1 if best == 0 else 1.0))
            better = replace(state, vector=trials[best], residual=residual, cost=costs[best])
            if state.cost - better.cost > UNDERRATED * promised:
                better = _further(bench, state, better)
            return better, promised, damping
        damping = dampings[-1] * 100.0
    return None, promised, damping


def _tried(
    bench: Compared, unknowns: Unknowns, vectors: Sequence[FloatArray]
) -> tuple[list[FloatArray | None], list[float]]:
    """Residuals (N,) and cost of each vector (n,); None and infinite where a run fails."""
    found = bench.residuals(unknowns, np.array(vectors), "fit")
    costs = [np.inf if r is None else cost_of(unknowns, v, r) for v, r in zip(vectors, found, strict=True)]
    return list(found), costs


def _further(bench: Compared, state: Fit, better: Fit) -> Fit:
    """The best of ``better`` and the multiples of its step from ``state``, as far as they go on lowering the cost."""
    unknowns, step = state.unknowns, better.vector - state.vector
    for far in FURTHER:
        vector = unknowns.clip(state.vector + far * step)
        residual = bench.residuals(unknowns, vector[None, :], "fit")[0]
        if residual is None or (cost := cost_of(unknowns, vector, residual)) >= better.cost:
            break
        better = replace(state, vector=vector, residual=residual, cost=cost)
    return better


def _bounded(state: Fit, curvature: FloatArray, gradient: FloatArray) -> FloatArray:
    """(n,) where the quadratic model is least; unknowns that leave their bounds stay there, the others make up for it.

    Clipping alone would leave the others where they only make sense together with what was clipped.
    """
    unknowns = state.unknowns
    step = np.zeros(gradient.size)
    free = np.ones(gradient.size, dtype=bool)
    while free.any():
        pull = gradient[free] + curvature[np.ix_(free, ~free)] @ step[~free]
        step[free] = -cho_solve(cho_factor(curvature[np.ix_(free, free)]), pull)
        wanted = state.vector + step * unknowns.scale
        held = unknowns.clip(wanted)
        left = free & (held != wanted)
        if not left.any():
            break
        step[left] = ((held - state.vector) / unknowns.scale)[left]
        free &= ~left
    return unknowns.clip(state.vector + step * unknowns.scale)
