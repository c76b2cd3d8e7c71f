"""How much each parameter matters for the cost, from the vectors that a search has evaluated.

A quadratic model of log cost is fitted, and each parameter's values are shuffled in turn: what the model then loses
is the parameter's importance (Breiman, *Random Forests*, 2001, section 10, on a polynomial). It holds for the region
that the search has visited; of parameters that moved together, each takes a part.
"""

from dataclasses import dataclass

import numpy as np

from thsa_cosim.signals import FloatArray

EXPLAINED = 0.6
"""Share of the variance that the model must explain on vectors that its fit has not seen."""
_FOLDS, _SHUFFLES = 5, 10


@dataclass(frozen=True, eq=False)
class Importances:
    """``shares`` (p,) add up to 1; ``explained``: share of the variance on left-out vectors."""

    shares: FloatArray
    explained: float


def importances(vectors: FloatArray, costs: FloatArray) -> Importances | None:
    """Importances of the parameters of ``vectors`` (n, p) for ``costs`` (n,); None where the model does not hold."""
    if vectors.ndim != 2 or len(costs) < 3 * _terms(vectors.shape[1]) or np.min(costs) <= 0.0:
        return None
    scaled = np.column_stack([_scaled(column) for column in vectors.T])
    target = np.log(costs)
    explained = _cross_validated(scaled, target)
    if not explained >= EXPLAINED:
        return None
    weights = _fit(_features(scaled), target)
    model = _features(scaled) @ weights
    rng = np.random.default_rng(0)
    lost = np.zeros(scaled.shape[1])
    for k in range(len(lost)):
        for _ in range(_SHUFFLES):
            shuffled = scaled.copy()
            shuffled[:, k] = rng.permutation(scaled[:, k])
            lost[k] += float(np.mean((_features(shuffled) @ weights - model) ** 2))
    total = float(lost.sum())
    return Importances(lost / total, explained) if total > 0.0 else None


def _terms(parameters: int) -> int:
    return 1 + parameters + parameters * (parameters + 1) // 2


def _scaled(values: FloatArray) -> FloatArray:
    """Values (n,) of one parameter with mean 0 and spread 1, logarithmic where they span a factor of 30."""
    logarithmic = values.min() > 0.0 and values.max() > 30.0 * values.min()
    drawn = np.asarray(np.log(values) if logarithmic else values, dtype=np.float64)
    spread = float(np.std(drawn))
    return np.asarray((drawn - drawn.mean()) / spread if spread > 0.0 else 0.0 * drawn, dtype=np.float64)


def _features(scaled: FloatArray) -> FloatArray:
    pairs = [scaled[:, i] * scaled[:, j] for i in range(scaled.shape[1]) for j in range(i + 1)]
    return np.asarray(np.column_stack([np.ones(len(scaled)), scaled, *pairs]), dtype=np.float64)


def _fit(features: FloatArray, target: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.lstsq(features, target, rcond=1e-8)[0], dtype=np.float64)


def _cross_validated(scaled: FloatArray, target: FloatArray) -> float:
    folds = np.random.default_rng(0).permutation(len(target)) % _FOLDS
    missed = np.empty_like(target)
    for fold in range(_FOLDS):
        out = folds == fold
        weights = _fit(_features(scaled[~out]), target[~out])
        missed[out] = target[out] - _features(scaled[out]) @ weights
    return 1.0 - float(np.mean(missed**2)) / max(float(np.var(target)), 1e-300)
