"""Gauss-Newton over rugged residuals: the slopes by regression over an ensemble of vectors, not by small differences.

Where parts stick and slip, a small difference sees events that jump to one side or the other: it makes the outputs a
hundred times more sensitive than they are over a longer way, and fits stop short. Regression over vectors as far apart
as the parameters are unsure averages over the events (Y. Chen, D. S. Oliver, Mathematical Geosciences 44 (2012) 1;
C. Cartis, L. Roberts, Mathematical Programming Computation 11 (2019) 631). The ensemble narrows as the cost falls.
"""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from thsa_cosim.signals import FloatArray

#: Vectors (m, n) → the residuals (N,) of each, None where a run failed.
Residuals = Callable[[FloatArray], Sequence[FloatArray | None]]

#: Members of an ensemble for each unknown.
MEMBERS = 2
#: The members' responses are to make up this share of the cost; what follows was set while looking at two simulated
#: units with a Stribeck friction that sticks and slips.
SHARE = 0.3
#: A round that gains less than this share narrows the ensemble by that factor, one that gains more widens it again.
SLOW, NARROWER, WIDER = 0.005, 0.3, 1.5
#: It ends after so many rounds in a row that gained less than that share, or so many in all.
PATIENCE, SETTLED, ROUNDS = 3, 0.005, 24
#: No step is longer than so many spreads in each unknown, as a root mean square.
REACH = 2.0
#: Steps are tried with these dampings, in shares of the cost per unknown, at half their length, ...
DAMPINGS = (1e-3, 0.03, 0.3, 3.0)
#: ... and with so many times the step of the round before: a narrow valley is gone along ever faster.
AGAIN = (1.0, 3.0)
#: Members of earlier rounds count up to this distance, in widths of the ensemble, and fade from 1 on.
NEAR = 2.5
#: The regression is held back by this share of its own weights, since few members tell little of many unknowns.
RIDGE = 1e-3


def descent(
    residuals: Residuals,
    vector: FloatArray,
    spreads: FloatArray,
    clip: Callable[[FloatArray], FloatArray],
    seed: int,
) -> Iterator[tuple[FloatArray, float]]:
    """The best vector (n,) so far and its sum of squares, after each round from ``vector``; nothing if that fails.

    ``spreads`` (n,): how far the first ensemble reaches, in the unknowns' units, 0 for what stays. ``clip``: a vector →
    the same within its bounds.
    """
    moving = np.flatnonzero(spreads > 0.0)
    if not moving.size:
        return
    generator = np.random.default_rng(seed)

    def at(z: FloatArray) -> FloatArray:
        moved = vector.copy()
        moved[moving] += spreads[moving] * z
        return clip(moved)

    def asked(zs: FloatArray) -> tuple[FloatArray, list[FloatArray]]:
        """What of the members (m, k) can be simulated, as clipped, and the residuals."""
        vectors = np.array([at(z) for z in zs])
        kept = [(v, r) for v, r in zip(vectors, residuals(vectors), strict=True) if r is not None]
        inside = [(v[moving] - vector[moving]) / spreads[moving] for v, _ in kept]
        return np.array(inside).reshape(-1, moving.size), [r for _, r in kept]

    known, found = asked(np.zeros((1, moving.size)))
    if not found:
        return
    z, residual = known[0], found[0]
    cost = float(residual @ residual)
    exact = np.finfo(float).eps * cost  # less is rounding
    if not cost:
        yield at(z), cost
        return
    curvature = np.zeros((moving.size, moving.size))
    share, idle, last = SHARE, 0, np.zeros(moving.size)
    for _ in range(ROUNDS):
        width = _width(curvature * (moving.size / (share * cost)))
        members, responses = asked(z + _directions(moving.size, generator) @ width.T)
        known, found = np.concatenate([known, members]), [*found, *responses]
        constant, slopes = _regression(z, known, found, width)
        curvature = slopes @ slopes.T
        steps = _steps(curvature, slopes @ (0.5 * (constant + residual)), cost)
        if last.any():
            steps = np.concatenate([steps, [steps[0] + times * last for times in AGAIN]])
        tried, left = asked(z + steps)
        known, found = np.concatenate([known, tried]), [*found, *left]
        costs = [float(r @ r) for r in found]
        best = int(np.argmin(costs))
        gained = 1.0 - costs[best] / cost
        if gained > 0.0:
            last = known[best] - z
            z, residual, cost = known[best], found[best], costs[best]
        recent = slice(max(0, len(found) - 4 * MEMBERS * moving.size), None)
        known, found = known[recent], found[recent]
        yield at(z), cost
        idle = idle + 1 if gained < SETTLED else 0
        share = share * NARROWER if gained < SLOW else min(SHARE, share * WIDER)
        if idle == PATIENCE or cost <= exact:
            return


def _directions(size: int, generator: np.random.Generator) -> FloatArray:
    """(m, n) random directions of length √n, each with its opposite."""
    drawn = generator.standard_normal((MEMBERS * size // 2, size))
    drawn *= np.sqrt(size) / np.linalg.norm(drawn, axis=1)[:, None]
    return np.concatenate([drawn, -drawn])


def _width(curvature: FloatArray) -> FloatArray:
    """(n, n) whose columns span an ensemble: one spread, less where ``curvature`` (n, n) says that less is enough."""
    values, vectors = np.linalg.eigh(curvature + np.eye(len(curvature)))
    return np.asarray(vectors / np.sqrt(np.maximum(values, 1.0)))


def _regression(
    z: FloatArray, known: FloatArray, found: Sequence[FloatArray], width: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Constant (N,) and slopes (n, N) of the residuals about ``z`` (n,), by what is ``known`` near it."""
    apart = np.linalg.solve(width, (known - z).T).T
    distance = np.linalg.norm(apart, axis=1) / np.sqrt(z.size)
    near = np.argsort(distance)[: 3 * MEMBERS * z.size]
    near = near[distance[near] <= max(NEAR, distance[near[0]])]  # one at least
    weights = np.exp(-0.5 * np.maximum(0.0, distance[near] - 1.0) ** 2)[:, None]
    terms = np.concatenate([np.ones((near.size, 1)), apart[near]], axis=1)
    normal = terms.T @ (weights * terms) + RIDGE * near.size * np.eye(z.size + 1)
    found_near = np.array([found[k] for k in near])
    coefficients = np.linalg.solve(normal, (weights * terms).T @ found_near)
    return coefficients[0], np.asarray(np.linalg.solve(width.T, coefficients[1:]))


def _steps(curvature: FloatArray, gradient: FloatArray, cost: float) -> FloatArray:
    """(s, n) steps to try, none beyond `REACH`."""
    size = gradient.size
    steps = []
    for damping in DAMPINGS:
        step = -np.linalg.solve(curvature + (damping * cost / size) * np.eye(size), gradient)
        steps.append(step * min(1.0, REACH * np.sqrt(size) / max(float(np.linalg.norm(step)), 1e-300)))
    return np.array([*steps, 0.5 * steps[0]])
