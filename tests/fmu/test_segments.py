"""Where inputs bend and jump: never far from a sample, never a jump that is none."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from thsa_cosim.fmu.segments import MERGED, Segments, merging_tolerance, segments, vertices
from thsa_cosim.fmu.variable import Variable
from thsa_cosim.signals import FloatArray, Signals


def variable(name: str) -> Variable:
    return Variable(name, 1, "input", "continuous", "Real")


def cut(
    time: FloatArray,
    columns: dict[str, FloatArray],
    held: set[str],
    times: FloatArray,
    merged: float = MERGED,
) -> Segments:
    linear = np.array([name not in held for name in columns])
    signals = Signals(time, columns, {}, frozenset(held))
    return segments(signals, [variable(name) for name in columns], linear, times, merged)


def at(found: Segments, times: FloatArray) -> FloatArray:
    """The inputs at ``times`` (n,), after a jump there."""
    j = np.clip(np.searchsorted(found.starts, times, side="right") - 1, 0, None)
    return np.asarray(found.values[j] + found.slopes[j] * (times - found.starts[j])[:, None])


def test_a_rounded_ramp_is_one_stretch_and_a_corner_is_kept() -> None:
    """A command recorded to 1 nm/s over 18 mm/s: thousands of slopes, four corners."""
    time = np.arange(20_001) * 1e-3
    exact = np.interp(time, [0.0, 2.0, 2.5, 9.0, 9.01, 20.0], [0.0, 0.0, 9e-3, 9e-3, -9e-3, -9e-3])
    found = cut(time, {"v": np.round(exact, 9)}, set(), time)
    assert found.starts.tolist() == pytest.approx([0.0, 2.0, 2.5, 9.0, 9.01], abs=1e-12)
    assert not found.jumps.any()
    assert np.abs(at(found, time)[:, 0] - np.round(exact, 9)).max() <= MERGED * 18e-3
    assert len(cut(time, {"v": np.round(exact, 9)}, set(), time, merged=0.0)) > 100


def test_a_computed_course_keeps_its_bends() -> None:
    """No rounding to leave out: a smooth reference is followed to 1e-10 of its range."""
    time = np.linspace(0.0, 3.0, 3001)
    smooth = 0.1 * np.sin(2.0 * time) ** 3
    found = cut(time, {"q": smooth}, set(), time)
    assert np.abs(at(found, time)[:, 0] - smooth).max() <= 1.01e-10 * np.ptp(smooth)
    assert len(found) > 1000


@pytest.mark.parametrize("digits", [7, 8, 9])
def test_the_tolerance_is_the_rounding_of_the_samples(digits: int) -> None:
    ramps = np.interp(np.arange(5000.0), [0.0, 1003.0, 2511.3, 5000.0], [0.0, 0.0, 9.0, -4.0])
    assert 1.0 < merging_tolerance(np.round(ramps, digits)) / 10.0**-digits < 4.0
    assert merging_tolerance(ramps.astype(np.float32).astype(float)) < 4 * np.spacing(np.float32(9.0))


def test_noise_is_not_taken_for_rounding() -> None:
    noisy = np.linspace(0.0, 1.0, 500) + 1e-3 * np.random.default_rng(1).normal(size=500)
    assert merging_tolerance(noisy) == pytest.approx(MERGED * np.ptp(noisy))
    assert merging_tolerance(np.full(9, 3.0)) == 0.0
    assert merging_tolerance(noisy, merged=0.0) == 0.0


def test_nothing_is_left_out_of_a_course_that_bends_everywhere() -> None:
    time = np.linspace(0.0, 1.0, 501)
    noise = np.random.default_rng(0).normal(size=501)
    assert len(cut(time, {"v": noise}, set(), time)) == 500


def test_each_change_of_a_held_input_is_a_jump_and_equal_values_are_none() -> None:
    time = np.arange(8) * 0.1
    found = cut(time, {"w": np.array([0.0, 0.0, 1.0, 1.0, 1.0 + 1e-12, 0.0, 0.0, 0.0])}, {"w"}, time)
    np.testing.assert_array_equal(found.starts, time[[0, 2, 4, 5]])
    assert found.jumps.tolist() == [False, True, True, True]
    assert not found.slopes.any()


def test_a_held_input_that_jumps_at_the_very_end_has_a_stretch_of_no_length() -> None:
    time = np.array([0.0, 1.0, 2.0])
    found = cut(time, {"w": np.array([1.0, 1.0, 5.0]), "v": np.array([0.0, 1.0, 2.0])}, {"w"}, time)
    assert found.starts.tolist() == [0.0, 2.0]
    assert found.stop == 2.0
    assert found.values[-1].tolist() == [5.0, 2.0]


def test_samples_that_are_meant_to_be_output_times_are_so_bit_for_bit() -> None:
    time = np.arange(11) * 0.1
    off = time.copy()
    off[4] += 3e-8
    found = cut(off, {"w": np.where(time < 0.35, 0.0, 1.0)}, {"w"}, time)
    assert found.starts[1] == time[4]


def test_inputs_are_constant_outside_of_their_samples() -> None:
    times = np.linspace(0.0, 1.0, 101)
    found = cut(np.array([0.2, 0.6]), {"v": np.array([1.0, 3.0])}, set(), times)
    np.testing.assert_allclose(at(found, times)[:, 0], np.interp(times, [0.2, 0.6], [1.0, 3.0]), atol=1e-12)
    assert len(found) == 3


def test_no_inputs_and_one_time() -> None:
    assert len(segments(None, [], np.zeros(0, dtype=bool), np.array([0.0, 1.0]))) == 1
    found = cut(np.array([0.0, 1.0]), {"v": np.array([2.0, 3.0])}, set(), np.array([0.5]))
    assert found.values.tolist() == [[2.5]]
    assert found.starts.tolist() == [0.5] == [found.stop]


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(st.integers(1, 50), st.floats(-9.0, 9.0)), min_size=2, max_size=40),
    st.sampled_from([0.0, 1e-7, 1e-3, 0.3]),
    st.floats(0.0, 1e-3),
)
def test_the_line_is_never_further_than_the_tolerance_from_a_sample(
    corners: list[tuple[int, float]], tolerance: float, noise: float
) -> None:
    knots = np.cumsum([length for length, _ in corners]) * 1.0
    time = np.arange(knots[0], knots[-1] + 1.0)
    values = np.interp(time, knots, [v for _, v in corners])
    values += noise * np.random.default_rng(len(time)).normal(size=len(time))
    chosen = vertices(time, values, tolerance)
    assert chosen[0] == 0
    assert chosen[-1] == len(time) - 1
    assert (np.diff(chosen) > 0).all()
    assert np.abs(np.interp(time, time[chosen], values[chosen]) - values).max() <= tolerance
