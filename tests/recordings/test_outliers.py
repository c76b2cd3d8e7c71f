"""Medians of rows: numpy's own, by another way."""

import numpy as np
import pytest

from thsa_cosim.recordings.outliers import row_medians, running_median


@pytest.mark.parametrize("width", [1, 2, 3, 7, 24, 51])
def test_row_medians_are_numpys_to_the_last_bit(width: int) -> None:
    rows = np.random.default_rng(width).normal(size=(200, width))
    rows[50:100] = np.round(rows[50:100], 1)  # a lattice has many equal values
    rows[100, 0], rows[101, -1], rows[102, 0] = np.nan, np.inf, -np.inf
    np.testing.assert_array_equal(row_medians(rows), np.median(rows, axis=1))


def test_a_running_median_takes_a_spike_out_and_leaves_a_step() -> None:
    values = np.repeat([1.0, 2.0], 20)
    spiky = values.copy()
    spiky[10] = 99.0
    np.testing.assert_array_equal(running_median(spiky, 5), values)
