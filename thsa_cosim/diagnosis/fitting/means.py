"""A fit between all samples of the recordings and the means of neighbours that a search compares.

A mean of k samples has 1/sqrt(k) of their white noise: in standard deviations of it, a residual of the means is the sum
of those of the samples over sqrt(k), and the rows of a Jacobian likewise.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from thsa_cosim.diagnosis.fitting.fit import Fit, cost_of
from thsa_cosim.diagnosis.fitting.trials import Trial
from thsa_cosim.signals import FloatArray

#: Rows, how many are wanted, samples in a mean → the rows wanted.
_Rows = Callable[[FloatArray, int, int], FloatArray]


def by_search(fit: Fit, trials: Sequence[Trial], searched: Sequence[Trial]) -> Fit:
    """A ``fit`` of ``trials`` as one of the same recordings ``searched`` by means; itself if there are none."""
    return _mapped(fit, trials, searched, _summed)


def by_samples(fit: Fit, trials: Sequence[Trial], searched: Sequence[Trial]) -> Fit:
    """A ``fit`` of ``searched`` as one of ``trials``: samples of one mean have its row. The inverse of `by_search`."""
    return _mapped(fit, searched, trials, _spread)


def _mapped(fit: Fit, given: Sequence[Trial], wanted: Sequence[Trial], rows_of: _Rows) -> Fit:
    pieces = list(_pieces(given, wanted))
    if all(n == m for n, m, _ in pieces):
        return fit

    def mapped(rows: FloatArray) -> FloatArray:
        edges = np.cumsum([0, *(n for n, _, _ in pieces)])
        parts = [
            rows_of(rows[begin:end], m, of)
            for begin, end, (_, m, of) in zip(edges, edges[1:], pieces, strict=False)
        ]
        return np.asfortranarray(np.concatenate(parts))

    residual = mapped(fit.residual)
    cost = cost_of(fit.unknowns, fit.vector, residual)
    return replace(fit, residual=residual, own=mapped(fit.jacobian), shared=None, cost=cost)


def _pieces(given: Sequence[Trial], wanted: Sequence[Trial]) -> Iterator[tuple[int, int, int]]:
    """Of every channel of the fit recordings: rows given, rows wanted, samples of one in a mean of the other."""
    fits = ([t for t in trials if t.part == "fit"] for trials in (given, wanted))
    for one, other in zip(*fits, strict=True):
        for a, b in zip(one.case.channels, other.case.channels, strict=True):
            of = max(a.mean_of, b.mean_of) // min(a.mean_of, b.mean_of)
            yield a.measured.size, b.measured.size, of


def _summed(rows: FloatArray, count: int, of: int) -> FloatArray:
    return np.asarray(rows[: count * of].reshape(count, of, *rows.shape[1:]).sum(axis=1) / np.sqrt(of))


def _spread(rows: FloatArray, count: int, of: int) -> FloatArray:
    at = np.minimum(np.arange(count) // of, len(rows) - 1)
    return np.asarray(rows[at] / np.sqrt(of))
