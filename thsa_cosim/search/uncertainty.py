"""How sure a least-squares estimate is, when its residuals are correlated in time.

The covariance is the sandwich A⁻¹ B A⁻¹ of an M-estimator (Huber, 1967; White, 1980), with
A = Σ_k ψ'(r_k) J_kᵀ J_k and B the long-run covariance of the scores s_k = ψ(r_k) J_k, estimated with the
Bartlett kernel (Newey and West, Econometrica 55, 1987) and the automatic bandwidth of Andrews
(Econometrica 59, 1991, eq. 6.2 and 6.4, one AR(1) per score). Where that is smaller than the formula for
white noise, A⁻¹ Σ_c σ_c² J_cᵀ J_c A⁻¹, the latter is reported: kernel estimates err on the small side.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.costs.identification import influence

FloatArray = NDArray[np.float64]
Group = Sequence[slice]

PRIOR_SPREAD = 1.0 / np.sqrt(12.0)
AT_BOUND = 1e-6
SOLVER_NOISE = "this FMU's solver noise hides the slope of the signals by it"
CLEAR = 0.1
"""Singular value of a normalised Jacobian from which on columns are no near-combination of each other."""
TAKES_PART = 0.1


@dataclass(frozen=True)
class Uncertainty:
    """Covariance of the estimate in the unit cube, and what it cannot be trusted for.

    ``covariance``, ``correlation``: (n, n), NaN in rows and columns of parameters that the data do not
    determine at all. ``stderr``: (n,), NaN likewise. ``reasons``: one per parameter, empty if determined.
    ``bandwidths``: lags of the kernel, one per recording.
    """

    covariance: FloatArray
    stderr: FloatArray
    correlation: FloatArray
    reasons: tuple[str, ...]
    bandwidths: tuple[int, ...]


def andrews_bandwidth(scores: FloatArray) -> int:
    """Lags for the Bartlett kernel from scores (N, n): 1.1447 (α N)^(1/3) with AR(1) plug-ins, ≤ N/4."""
    n = len(scores)
    past, present = scores[:-1], scores[1:]
    power = np.sum(past * past, axis=0)
    used = power > 0.0
    if n < 8 or not used.any():
        return 0
    rho = np.clip(np.sum(past * present, axis=0)[used] / power[used], -0.97, 0.97)
    variance = np.mean((present[:, used] - rho * past[:, used]) ** 2, axis=0)
    # Scores of different size count alike: each is scaled to unit variance first.
    weight = (variance / np.mean(scores[:, used] ** 2, axis=0)) ** 2
    alpha = np.sum(weight * 4.0 * rho**2 / ((1.0 - rho) ** 6 * (1.0 + rho) ** 2))
    alpha /= np.sum(weight / (1.0 - rho) ** 4)
    return min(int(np.ceil(1.1447 * (alpha * n) ** (1.0 / 3.0))), n // 4)


def long_run_covariance(scores: FloatArray, lags: int) -> FloatArray:
    """Σ over k and l of weighted products of scores (N, n): (n, n), Bartlett weights up to ``lags``.

    As the products of the sums over every window of ``lags`` + 1 samples, which count a pair once per window that
    holds both: the same weights, at a cost that does not grow with the lags.
    """
    width = lags + 1
    running = np.zeros((len(scores) + 2 * lags + 1, scores.shape[1]))
    np.cumsum(scores, axis=0, out=running[width : width + len(scores)])
    running[width + len(scores) :] = running[width + len(scores) - 1]
    windows = running[width:] - running[:-width]
    return np.asarray(windows.T @ windows / width)


def estimate_uncertainty(
    best: FloatArray,
    residual: FloatArray,
    jacobian: FloatArray,
    jacobian_error: FloatArray,
    groups: Sequence[Group],
    names: Sequence[str],
    error: str = "squared",
) -> Uncertainty:
    """Standard errors, correlation and identifiability at ``best`` (n,) in the unit cube.

    ``residual`` (N,), ``jacobian`` and ``jacobian_error`` (N, n) are stacked; ``groups`` holds per
    recording the slices of its channels. Channels of one recording with equally many samples are sampled
    together: their scores are added before the kernel, which covers noise common to them.
    """
    n = best.size
    psi, slope = influence(residual, error)
    norms = np.linalg.norm(jacobian, axis=0)
    trust = np.linalg.norm(jacobian_error, axis=0)
    reasons = [""] * n
    for i in range(n):
        if norms[i] * PRIOR_SPREAD < 1e-6:
            reasons[i] = "no fitted signal responds to it"
        elif norms[i] <= trust[i]:
            reasons[i] = SOLVER_NOISE
    active = [i for i in range(n) if not reasons[i]]
    covariance = np.full((n, n), np.nan)
    bandwidths: list[int] = []
    if active:
        scaled = jacobian[:, active] / norms[active]
        doubt = float(np.linalg.norm(jacobian_error[:, active] / norms[active], ord=2))
        inverse, shares, hidden = _inverse_information(scaled, slope, doubt)
        tied = [i for position, i in enumerate(active) if shares[position] > TAKES_PART**2]
        for i in tied:
            partners = " and ".join(names[j] for j in tied if j != i)
            together = f" with {partners}" if partners else ""
            reasons[i] = f"the fitted signals determine only a combination of it{together}"
            if hidden[active.index(i)] > TAKES_PART**2:
                reasons[i] = SOLVER_NOISE
        middle, white = np.zeros_like(inverse), np.zeros_like(inverse)
        for group in groups:
            for score in _scores(psi, scaled, group):
                lags = andrews_bandwidth(score)
                bandwidths.append(lags)
                middle += long_run_covariance(score, lags)
            for part in group:
                white += np.mean(psi[part] ** 2) * scaled[part].T @ scaled[part]
        correction = residual.size / max(1, residual.size - n)
        robust = correction * inverse @ middle @ inverse
        plain = correction * inverse @ white @ inverse
        with np.errstate(divide="ignore", invalid="ignore"):
            grow = np.sqrt(np.maximum(1.0, np.diag(plain) / np.diag(robust)))
        grow = np.where(np.isfinite(grow), grow, 1.0)
        scale = grow / norms[active]
        covariance[np.ix_(active, active)] = robust * np.outer(scale, scale)
    for i in range(n):
        if "combination" in reasons[i] or reasons[i] == SOLVER_NOISE:
            covariance[i, :] = covariance[:, i] = np.nan
    stderr = np.sqrt(np.diag(covariance))
    for i in range(n):
        if not reasons[i] and stderr[i] >= PRIOR_SPREAD:
            reasons[i] = "its standard error is as wide as its bounds"
        if not reasons[i] and not AT_BOUND < best[i] < 1.0 - AT_BOUND:
            reasons[i] = f"it lies on its {'lower' if best[i] < 0.5 else 'upper'} bound"
    return Uncertainty(covariance, stderr, _correlation(covariance), tuple(reasons), tuple(bandwidths))


def _inverse_information(
    scaled: FloatArray, slope: FloatArray, doubt: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Pseudo-inverse of A (m, m), each parameter's share (m,) of the directions left out, and of those among them that
    only the Jacobian's uncertainty hides.

    A direction counts as undetermined when its singular value is below three times the Jacobian's own
    uncertainty (Weyl's inequality bounds the effect of the one on the other), or below 1e-7.
    """
    # A slope can vanish (Huber beyond its width); the weights keep A's symmetric root real.
    weighted = scaled * np.sqrt(np.maximum(slope, 0.0))[:, None]
    _, singular, directions = np.linalg.svd(weighted, full_matrices=False)
    kept = singular > max(3.0 * doubt, 1e-7)
    inverse = (directions[kept].T / singular[kept] ** 2) @ directions[kept]
    shares = np.sum(directions[~kept] ** 2, axis=0)
    hidden = np.sum(directions[~kept & (singular > CLEAR)] ** 2, axis=0)
    return inverse, shares, hidden


def _scores(psi: FloatArray, scaled: FloatArray, group: Group) -> list[FloatArray]:
    scores = [psi[part, None] * scaled[part] for part in group]
    if len({len(score) for score in scores}) == 1:
        return [np.sum(scores, axis=0)]
    return scores


def _correlation(covariance: FloatArray) -> FloatArray:
    with np.errstate(divide="ignore", invalid="ignore"):
        size = np.sqrt(np.diag(covariance))
        matrix = covariance / np.outer(size, size)
    return np.where(np.isfinite(matrix), np.clip(matrix, -1.0, 1.0), np.nan)


def with_given(
    uncertainty: Uncertainty, jacobian: FloatArray, given_jacobian: FloatArray, given_covariance: FloatArray
) -> Uncertainty:
    """Add what comes from values that were held, but are themselves uncertain.

    ``jacobian`` (N, n) by the estimated parameters, ``given_jacobian`` (N, m) by the held ones, whose
    covariance is ``given_covariance`` (m, m). A held value that is off by δ shifts a least-squares estimate by
    -(JᵀJ)⁻¹ Jᵀ J_g δ (implicit function theorem), which adds S C Sᵀ to its covariance.
    """
    known = [i for i, stderr in enumerate(uncertainty.stderr) if np.isfinite(stderr)]
    covariance = uncertainty.covariance.copy()
    if known and given_jacobian.shape[1]:
        shift = -np.linalg.lstsq(jacobian[:, known], given_jacobian, rcond=1e-10)[0]
        covariance[np.ix_(known, known)] += shift @ given_covariance @ shift.T
    stderr = np.sqrt(np.diag(covariance))
    return replace(uncertainty, covariance=covariance, stderr=stderr, correlation=_correlation(covariance))
