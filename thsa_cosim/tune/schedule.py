"""Gains over one or two conditions: smoothed between nodes, interpolated linearly.

Each node's search ends somewhere in a flat valley, so neighbouring gains may jump for no reason. They are
drawn together by penalised least squares (Whittaker, 1923) on their search scale (log for a log parameter):
the sum of squared distances from the nodes' own optima plus λ times the sum of squared second divided
differences along every axis, each axis scaled to unit mean spacing.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from thsa_cosim.signals import FloatArray


@dataclass(frozen=True, eq=False)
class GainSchedule:
    """``gains[name]`` over ``axes``: one or two of ``names`` with rising ``nodes``; (m,) or (m, k) each.

    Axes and gains are in the scenario's units.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    nodes: tuple[FloatArray, ...]
    gains: Mapping[str, FloatArray]
    gain_units: Mapping[str, str]

    def at(self, point: Mapping[str, float]) -> dict[str, float]:
        """Gains at ``point``: linear between nodes (bilinear for two axes), held beyond the ends."""
        return {name: self._interpolate(values, point) for name, values in self.gains.items()}

    def _interpolate(self, values: FloatArray, point: Mapping[str, float]) -> float:
        # np.interp holds beyond the ends; the last axis first.
        for name, nodes in zip(reversed(self.names), reversed(self.nodes), strict=True):
            x = point[name]
            rows = values.reshape(-1, nodes.size)
            values = np.array([np.interp(x, nodes, row) for row in rows])
        return float(values[0])

    def points(self) -> list[dict[str, float]]:
        """Every node with its gains, the last axis running fastest."""
        rows = []
        for index in product(*(range(n.size) for n in self.nodes)):
            at = {name: float(n[k]) for name, n, k in zip(self.names, self.nodes, index, strict=True)}
            rows.append({**at, **{name: float(v[index]) for name, v in self.gains.items()}})
        return rows


def smooth(values: FloatArray, nodes: Sequence[FloatArray], strength: float) -> FloatArray:
    """Whittaker smoothing of ``values`` (m,) or (m, k) over ``nodes``, one array per axis."""
    shape = values.shape
    matrix: FloatArray = np.eye(values.size)
    for axis, x in enumerate(nodes):
        if x.size < 3:
            continue
        difference = _second_difference(x / np.mean(np.diff(x)))
        factors: list[FloatArray] = [np.eye(n) for n in shape]
        factors[axis] = difference
        full: FloatArray = factors[0]
        for other in factors[1:]:
            full = np.asarray(np.kron(full, other), dtype=np.float64)
        matrix = matrix + strength * np.asarray(full.T @ full, dtype=np.float64)
    return np.asarray(np.linalg.solve(matrix, values.ravel()).reshape(shape))


def _second_difference(x: FloatArray) -> FloatArray:
    """Rows (m - 2, m) of second divided differences, exact for any spacing."""
    rows = np.zeros((x.size - 2, x.size))
    for k in range(x.size - 2):
        a, b = x[k + 1] - x[k], x[k + 2] - x[k + 1]
        rows[k, k : k + 3] = (2.0 / (a * (a + b)), -2.0 / (a * b), 2.0 / (b * (a + b)))
    return rows
