"""The continuous piecewise-linear function of least squares for given knots."""

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.signals import FloatArray


class LinearSpline:
    """Least-squares levels (k,) at ``knots`` (k,) for samples y (n,) at times t (n,), both increasing.

    The hat functions' normal matrix is tridiagonal, so that a fit costs O(n + k). ``residual`` (n,) is
    y minus the spline, ``squares`` its sum of squares, ``segment`` (n,) each sample's segment.
    """

    def __init__(self, t: FloatArray, y: FloatArray, knots: FloatArray) -> None:
        from scipy.linalg import cho_solve_banded, cholesky_banded  # slow to import; few inputs are splines

        self.t, self.y, self.knots = t, y, knots
        segments = knots.size - 1
        self.segment: NDArray[np.intp] = np.clip(np.searchsorted(knots, t, side="right") - 1, 0, segments - 1)
        right = (t - knots[self.segment]) / np.diff(knots)[self.segment]
        left = 1.0 - right
        ll, lr, rr, ly, ry = (
            self._sums(w) for w in (left * left, left * right, right * right, left * y, right * y)
        )
        band, moment = np.zeros((2, knots.size)), np.zeros(knots.size)
        band[0, :-1] += ll
        band[0, 1:] += rr
        band[1, :-1] = lr
        band[0] += 1e-9  # a knot between two samples may have next to none of its own
        moment[:-1] += ly
        moment[1:] += ry
        self.factor: FloatArray = cholesky_banded(band, lower=True)
        self.levels: FloatArray = cho_solve_banded((self.factor, True), moment)
        self.residual: FloatArray = (
            y - left * self.levels[self.segment] - right * self.levels[self.segment + 1]
        )
        self.squares = float(self.residual @ self.residual)

    def _sums(self, weights: FloatArray) -> FloatArray:
        """Return the sum of (n,) ``weights`` over each segment, (k-1,)."""
        return np.asarray(np.bincount(self.segment, weights=weights, minlength=self.knots.size - 1))

    def bounds(self) -> list[int]:
        """Return the first sample of each segment, and the number of samples at last, k entries."""
        inner = np.searchsorted(self.t, self.knots[1:-1])
        return [0, *inner.tolist(), self.t.size]

    def lines(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return each segment's number of samples, and its own line's level in its middle and slope.

        NaN where fewer than two samples leave it open.
        """
        u = self.t - 0.5 * (self.knots[:-1] + self.knots[1:])[self.segment]
        n, s1, s2, y0, y1 = (self._sums(w) for w in (np.ones_like(u), u, u * u, self.y, u * self.y))
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = (n * y1 - s1 * y0) / (n * s2 - s1 * s1)
            level = (y0 - slope * s1) / n
        return n, level, slope


def removal_costs(spline: LinearSpline) -> FloatArray:
    """Return by how much the sum of squares grows if an inner knot goes, (k-2,).

    Without the knot the change of slope d there is 0, which costs d^2 / var d. The variance needs the three
    inner diagonals of the inverse Z of the tridiagonal normal matrix L L', by recursion from its end.
    """
    size = spline.knots.size
    if size < 3:
        return np.empty(0)
    width = np.diff(spline.knots)
    diagonal, below = spline.factor[0].tolist(), spline.factor[1].tolist()
    z0, z1, z2 = np.zeros(size), np.zeros(size), np.zeros(size)  # Z[i, i], Z[i + 1, i], Z[i + 2, i]
    z0[-1] = 1.0 / diagonal[-1] ** 2
    for i in range(size - 2, -1, -1):
        ratio = below[i] / diagonal[i]
        z1[i] = -ratio * z0[i + 1]
        z2[i] = -ratio * z1[i + 1]
        z0[i] = 1.0 / diagonal[i] ** 2 - ratio * z1[i]
    a, c = 1.0 / width[:-1], 1.0 / width[1:]
    b = -a - c
    variance = (
        a * a * z0[:-2]
        + b * b * z0[1:-1]
        + c * c * z0[2:]
        + 2.0 * (a * b * z1[:-2] + b * c * z1[1:-1] + a * c * z2[:-2])
    )
    levels = spline.levels
    change = a * levels[:-2] + b * levels[1:-1] + c * levels[2:]
    return np.asarray(change * change / variance)
