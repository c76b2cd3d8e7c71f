"""What a fit leaves of one recording, less what parameters and found slips explain: projections, once and for all.

The residuals are regressed on what each slip would leave, after everything that the parameters could make of it (the
columns of the Jacobian) has been taken out of both.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from thsa_cosim.inspection.trust import Residual
from thsa_cosim.recordings import noise_estimate
from thsa_cosim.signals import FloatArray

Column = Sequence[tuple[slice, FloatArray]]
"""What a slip leaves: values by the rows of one channel; 0 in all others."""


@dataclass(frozen=True, eq=False)
class Slip:
    """One explanation: ``column`` is what it leaves, ``size`` in its own unit (s, the signal's unit, a factor).

    ``gain``: how far it lowers the sum of squares; ``weight``: what of that counts beside others.
    """

    kind: str
    channel: str
    column: Column
    size: float
    gain: float
    at: float = 0.0
    weight: float = 1.0


class Remainder:
    """The residuals (N,) of one recording over all of its channels, less what parameters and found slips explain."""

    def __init__(
        self,
        own: Sequence[Residual],
        stacked: FloatArray,
        slopes: FloatArray,
        basis: FloatArray,
        first: int,
    ) -> None:
        self.own = own
        self._stacked, self._slopes = stacked, slopes
        self.rows = [slice(first + sum(r.values.size for r in own[:k]), 0) for k in range(len(own))]
        self.rows = [slice(s.start, s.start + r.values.size) for s, r in zip(self.rows, own, strict=True)]
        self._basis = basis
        self.values = self.without(stacked)
        self.floors = [white_part(r.values) for r in own]

    def without(self, column: FloatArray) -> FloatArray:
        """``column`` (N,) less its projection on what is explained already."""
        return np.asarray(column - self._basis @ (self._basis.T @ column))

    def gain(self, column: Column) -> tuple[float, float]:
        """Best coefficient of ``column`` and how far it lowers the sum of squares."""
        product, power, free = self._products(column)
        if free <= 1e-8 * power or free <= 0.0:
            return 0.0, 0.0  # the parameters do the same
        return product / free, product * product / free

    def drop(self, column: Column) -> float:
        """How far ``column`` as it is lowers the sum of squares."""
        product, _, free = self._products(column)
        return 2.0 * product - free

    def _products(self, column: Column) -> tuple[float, float, float]:
        """Of ``column``: product with the residuals, sum of squares, and that of what the parameters cannot make.

        The residuals are orthogonal to the orthonormal basis: only the rows of the column count.
        """
        product, power, made = 0.0, 0.0, np.zeros(self._basis.shape[1])
        for rows, values in column:
            product += float(values @ self.values[rows])
            power += float(values @ values)
            made += values @ self._basis[rows]
        return product, power, power - float(made @ made)

    def best(self, rows: slice, shapes: FloatArray) -> FloatArray:
        """Coefficients (m,) with which ``shapes`` (n, m), 0 outside ``rows``, lower the sum of squares most."""
        made = shapes.T @ self._basis[rows]
        gram = shapes.T @ shapes - made @ made.T
        size = np.sqrt(np.einsum("ij,ij->j", shapes, shapes))
        scaled = np.linalg.lstsq(
            gram / np.outer(size, size), shapes.T @ self.values[rows] / size, rcond=1e-10
        )
        return np.asarray(scaled[0] / size)

    def whole(self, column: Column) -> FloatArray:
        """``column`` (N,) over all recordings and channels."""
        found = np.zeros(self.values.size)
        for rows, values in column:
            found[rows] = values
        return found

    def beside_late(self, column: Column, which: Sequence[int], by: float) -> float:
        """Sum of squares after ``column`` where what parameters do to the channels ``which`` is late ``by`` s, too."""
        slopes = self._slopes.copy()
        for k in which:
            rows, time = self.rows[k], self.own[k].time
            for i in range(slopes.shape[1]):
                slopes[rows, i] = np.interp(time - by, time, slopes[rows, i])
        basis, left = orthonormal(slopes), self._stacked - self.whole(column)
        left = left - basis @ (basis.T @ left)
        return float(left @ left)

    def take(self, column: Column) -> None:
        """Take ``column`` into what is explained."""
        free = self.without(self.whole(column))
        free /= np.linalg.norm(free)
        self.values = self.values - free * float(free @ self.values)
        self._basis = np.column_stack((self._basis, free))

    @property
    def chance(self) -> float:
        """By how much the sum of squares of white noise may be larger than expected: three standard deviations."""
        counts = (f * f * r.values.size for f, r in zip(self.floors, self.own, strict=True))
        return 3.0 * float(np.sqrt(2.0 * sum(counts)))

    @property
    def excess(self) -> float:
        """What is left beyond white noise, as a sum of squares over this recording."""
        parts = (float(self.values[s] @ self.values[s]) for s in self.rows)
        counts = (f * r.values.size for f, r in zip(self.floors, self.own, strict=True))
        return max(sum(parts) - sum(counts), 0.0)


def orthonormal(slopes: FloatArray) -> FloatArray:
    """Orthonormal basis (N, k) of the columns of (N, p), those that do nothing left out."""
    norms = np.linalg.norm(slopes, axis=0)
    slopes = slopes[:, norms > 0.0] / norms[norms > 0.0]
    if slopes.shape[1] == 0:
        return np.zeros((slopes.shape[0], 0))
    left, singular, _ = np.linalg.svd(slopes, full_matrices=False)
    return np.asarray(left[:, singular > 1e-7 * singular[0]])


def white_part(values: FloatArray) -> float:
    """Variance of the white part of a residual; no more than all of it."""
    return min(noise_estimate(values, smooth=False) ** 2, float(np.mean(values**2)))
