"""Piecewise-linear reconstruction of noisy inputs: known knots come back, smooth inputs are followed, doubt is told."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reference.schedules import DRIVEN_A_LOAD, DRIVEN_B_LOAD

from thsa_cosim.recordings import Column, TimeAxis, noise_estimate, read_recording
from thsa_cosim.recordings.piecewise import PiecewiseLinear, fit_piecewise_linear
from thsa_cosim.recordings.spline import LinearSpline, removal_costs

SIGMA, QUANTUM = 60.0, 10.0  # N: the load cell
SCENARIOS = Path(__file__).parents[2] / "scenarios"


def measured(clean: np.ndarray, seed: int, sigma: float = SIGMA) -> np.ndarray:
    noisy = clean + np.random.default_rng(seed).normal(0.0, sigma, clean.size)
    return np.asarray(np.round(noisy / QUANTUM) * QUANTUM)


def fit(time: np.ndarray, values: np.ndarray) -> PiecewiseLinear:
    return fit_piecewise_linear(time, values, noise_estimate(values))


@st.composite
def schedules(draw: st.DrawFn) -> tuple[np.ndarray, np.ndarray]:
    """Plateaus of 0.15 s and more, ramps of 50 to 400 kN/s between levels that differ by 5 kN and more."""
    time, level = [0.0], [draw(st.floats(-5e4, 5e4))]
    for _ in range(draw(st.integers(1, 5))):
        step = draw(st.floats(5e3, 4e4)) * draw(st.sampled_from([-1.0, 1.0]))
        begin = time[-1] + draw(st.floats(0.15, 2.0))
        time += [begin, begin + abs(step) / draw(st.floats(5e4, 4e5))]
        level += [level[-1], level[-1] + step]
    return np.array([*time, time[-1] + 0.3]), np.array([*level, level[-1]])


@settings(max_examples=30, deadline=None)
@given(schedules(), st.integers(0, 10_000))
def test_knots_and_levels_of_a_schedule_come_back(schedule: tuple[np.ndarray, np.ndarray], seed: int) -> None:
    knots, levels = schedule
    time = np.arange(0.0, knots[-1], 1e-3)
    clean = np.interp(time, knots, levels)
    found = fit(time, measured(clean, seed))
    assert found.doubt == ""
    slopes = np.diff(levels) / np.diff(knots)
    samples = np.diff(knots) / 1e-3
    assert found.knots.size == knots.size
    # A corner of the slope's change m is where two lines meet, each known to 2 sigma / sqrt(samples) there.
    for k in range(1, knots.size - 1):
        unsure = 2.0 * SIGMA * np.hypot(1.0 / np.sqrt(samples[k - 1]), 1.0 / np.sqrt(samples[k]))
        assert abs(found.knots[k] - knots[k]) < 5.0 * unsure / abs(slopes[k] - slopes[k - 1]) + 1e-5
        assert abs(found.levels[k] - levels[k]) < 5.0 * unsure


@pytest.mark.parametrize("load", [DRIVEN_A_LOAD, DRIVEN_B_LOAD])
def test_the_shipped_loads_to_a_fifth_of_a_millisecond_and_some_newtons(load: object) -> None:
    knots, levels = np.array(load.times), np.array(load.values)  # type: ignore[attr-defined]
    time = np.arange(0.0, knots[-1] + 1.0, 1e-3)
    found = fit(time, measured(np.interp(time, knots, levels), 7))
    np.testing.assert_allclose(found.knots[1:-1], knots[1:], atol=2e-4)
    np.testing.assert_allclose(found.levels[1:-1], levels[1:], atol=15.0)


@pytest.mark.parametrize(("amplitude", "frequency"), [(2e4, 0.1), (2e4, 1.0), (500.0, 5.0)])
def test_a_sine_gets_as_many_knots_as_keep_the_error_below_the_noise(
    amplitude: float, frequency: float
) -> None:
    time = np.arange(0.0, 10.0, 1e-3)
    clean = amplitude * np.sin(2.0 * np.pi * frequency * time)
    found = fit(time, measured(clean, 3))
    assert found.doubt == ""
    assert 10 < found.knots.size < 600
    assert np.sqrt(np.mean((found.at(time) - clean) ** 2)) < 0.7 * SIGMA


def test_a_constant_is_two_knots_at_its_level() -> None:
    time = np.arange(0.0, 20.0, 1e-3)
    found = fit(time, measured(np.full(time.size, 5e3), 1))
    assert found.knots.tolist() == [time[0], time[-1]]
    np.testing.assert_allclose(found.levels, 5e3, atol=6.0 * SIGMA / np.sqrt(time.size))


def test_without_noise_every_sample_stays() -> None:
    time = np.arange(100) * 1e-3
    values = np.sqrt(time)
    found = fit_piecewise_linear(time, values, 0.0)
    assert np.array_equal(found.at(time), values)


def test_steps_take_one_sample() -> None:
    time = np.arange(0.0, 10.0, 1e-3)
    clean = 1e4 * np.sign(np.sin(2.0 * np.pi * 0.7 * time + 0.1))
    found = fit(time, measured(clean, 2))
    assert found.doubt == ""
    assert np.max(np.abs(found.at(time) - clean)) < 3.0 * SIGMA


@settings(max_examples=20, deadline=None)
@given(st.floats(1e-3, 1e3), st.floats(-1e6, 1e6), st.floats(1e-6, 1e3), st.floats(-1e3, 1e3))
def test_units_and_offsets_do_not_matter(gain: float, level: float, step: float, start: float) -> None:
    time = np.arange(800.0)
    clean = np.interp(time, [0.0, 300.0, 400.0, 800.0], [0.0, 0.0, 50.0, 40.0])
    noisy = clean + np.random.default_rng(5).normal(0.0, 1.0, time.size)
    plain = fit_piecewise_linear(time, noisy, 1.0)
    other = fit_piecewise_linear(start + step * time, level + gain * noisy, gain)
    np.testing.assert_allclose((other.knots - start) / step, plain.knots, atol=1e-2)
    np.testing.assert_allclose((other.levels - level) / gain, plain.levels, atol=1e-2)


def test_time_need_not_be_equally_spaced() -> None:
    rng = np.random.default_rng(4)
    time = np.cumsum(rng.uniform(0.3e-3, 1.7e-3, 5000))
    clean = np.interp(time, [0.0, 2.0, 2.2, 9.0], [0.0, 0.0, 4e4, 4e4])
    found = fit_piecewise_linear(time, measured(clean, 4), SIGMA)
    np.testing.assert_allclose(found.knots[1:-1], [2.0, 2.2], atol=3e-4)


def rough(kind: str, count: int) -> np.ndarray:
    white = np.random.default_rng(6).normal(0.0, 200.0, count)
    if kind == "walk":
        return np.asarray(np.cumsum(white))
    if kind == "coloured":
        return np.asarray(np.convolve(white, 0.9 ** np.arange(60))[:count])
    return np.asarray(2e4 * np.sin(2.0 * np.pi * 50e-3 * np.arange(count)))


@pytest.mark.parametrize("kind", ["walk", "coloured", "vibration"])
def test_a_rough_signal_is_doubted(kind: str) -> None:
    clean = rough(kind, 6000)
    assert fit(np.arange(6000) * 1e-3, measured(clean, 8)).doubt


def test_removal_costs_are_the_growth_of_the_sum_of_squares() -> None:
    rng = np.random.default_rng(9)
    t = np.sort(rng.uniform(0.0, 100.0, 400))
    y = np.cumsum(rng.normal(size=400))
    knots = np.array([t[0], 13.0, 30.0, 31.5, 60.0, 88.0, t[-1]])
    spline = LinearSpline(t, y, knots)
    again = [LinearSpline(t, y, np.delete(knots, j)).squares - spline.squares for j in range(1, 6)]
    np.testing.assert_allclose(removal_costs(spline), again, rtol=1e-5)


def read(values: np.ndarray, folder: Path, **options: object) -> object:
    time = np.arange(values.size) * 1e-3
    path = folder / "load.csv"
    np.savetxt(path, np.column_stack([time, values / 1e3]), delimiter=",", header="t,load", comments="")
    column = Column(column="load", unit="kN", smooth="piecewise-linear", **options)  # type: ignore[arg-type]
    return read_recording(path, {"F": column}, time=TimeAxis("t", "s"), units={"F": "N"})


def test_a_recording_gets_the_function_in_the_fmus_unit(tmp_path: Path) -> None:
    clean = np.interp(np.arange(3000), [0, 1000, 1100, 3000], [0.0, 0.0, 2e4, 2e4])
    recording = read(measured(clean, 10), tmp_path)
    assert recording.notes == ()  # type: ignore[attr-defined]
    assert np.sqrt(np.mean((recording.signals["F"] - clean) ** 2)) < 6.0  # type: ignore[attr-defined]
    assert recording.noise["F"] == pytest.approx(SIGMA, rel=0.05)  # type: ignore[attr-defined]


def test_a_given_noise_counts_and_shift_still_works(tmp_path: Path) -> None:
    clean = np.interp(np.arange(3000), [0, 1000, 1100, 3000], [0.0, 0.0, 300.0, 300.0])
    values = measured(clean, 10, sigma=20.0)
    assert np.ptp(read(values, tmp_path).signals["F"]) == pytest.approx(300.0, abs=20.0)  # type: ignore[attr-defined]
    # With so much more noise to expect, fewer knots are warranted.
    bends = {
        noise: np.count_nonzero(np.abs(np.diff(read(values, tmp_path, noise=noise).signals["F"], 2)) > 1e-6)  # type: ignore[attr-defined]
        for noise in (20.0, 2000.0)
    }
    assert bends[20.0] in (2, 3, 4)
    assert bends[2000.0] == 0
    later = read(values, tmp_path, shift=0.5).signals["F"]  # type: ignore[attr-defined]
    assert later[1400] < 30.0 < 270.0 < later[1650]


def test_a_doubted_signal_stays_as_measured_and_a_note_says_so(tmp_path: Path) -> None:
    values = measured(rough("walk", 4000), 11)
    recording = read(values, tmp_path)
    np.testing.assert_allclose(recording.signals["F"], values)  # type: ignore[attr-defined]
    (note,) = recording.notes  # type: ignore[attr-defined]
    assert "F is used as measured, not piecewise linear: " in note


def test_the_shipped_load_is_free_of_noise() -> None:
    column = Column(column="load_kN", unit="kN", smooth="piecewise-linear")
    path = SCENARIOS / "recordings" / "driven_m30_a.parquet"
    recording = read_recording(path, {"F": column}, time=TimeAxis("time_s", "s"), units={"F": "N"})
    # Row k holds the schedule at (k + 1) ms.
    true = np.interp(recording.signals.time + 1e-3, DRIVEN_A_LOAD.times, DRIVEN_A_LOAD.values)
    assert np.sqrt(np.mean((recording.signals["F"] - true) ** 2)) < 3.0
