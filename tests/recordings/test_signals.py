"""From columns to signals: cutting, shifting, smoothing, resampling, and the noise of a channel."""

import hashlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from thsa_cosim.errors import RecordingError
from thsa_cosim.recordings import Column, TimeAxis, noise_estimate, quantum, read_recording
from thsa_cosim.recordings.repair import Repair

RATE = 0.01


@pytest.fixture
def ramp(tmp_path):
    """10 s of time, a straight line, a command that steps at 5 s, and a temperature around -30 degC."""
    time = np.arange(1001) * RATE + 100.0
    rows = np.column_stack(
        [time, 2.0 * (time - 100.0), (time >= 105.0 - 1e-9) * 1.0, -30.0 + 0.1 * (-1.0) ** np.arange(1001)]
    )
    file = tmp_path / "ramp.csv"
    np.savetxt(file, rows, delimiter=";", header="t;line;step;T", comments="", fmt="%.10g")
    return file


def read(file, columns, **axis):
    units = {"line": "m/s", "step": "m/s", "T": "K"}
    return read_recording(file, columns, time=TimeAxis("t", "s", **axis), units=units)


@pytest.mark.parametrize("number", [1e200, -1.7976931348623157e308])
def test_numbers_that_nothing_measures_are_refused_until_they_are_called_missing(tmp_path, number):
    rows = np.column_stack([np.arange(100) * RATE, np.sin(np.arange(100.0)), np.zeros(100), np.zeros(100)])
    rows[40, 1] = number
    file = tmp_path / "run.csv"
    np.savetxt(file, rows, delimiter=";", header="t;line;step;T", comments="", fmt="%.17g")
    with pytest.raises(RecordingError, match=r"at 0\.4 s.*which nothing measures.*missing"):
        read(file, {"line": Column("line", "m/s")})
    mended = Column("line", "m/s", repair=Repair(missing=(number,)))
    assert np.max(np.abs(read(file, {"line": mended}).signals["line"])) < 2.0


def test_time_starts_at_zero_or_where_the_file_starts(ramp):
    line = {"line": Column("line", "m/s")}
    assert read(ramp, line).signals.time[[0, -1]] == pytest.approx([0.0, 10.0])
    assert read(ramp, line, from_zero=False).signals.time[[0, -1]] == pytest.approx([100.0, 110.0])
    assert read(ramp, line).duration == pytest.approx(10.0)


def test_cut_is_in_the_time_of_the_file(ramp):
    found = read(ramp, {"line": Column("line", "m/s")}, start=102.005, stop=104.0)
    assert found.signals["line"][[0, -1]] == pytest.approx([4.02, 8.0])
    assert found.signals.time[0] == 0.0
    with pytest.raises(
        RecordingError, match=r"0 samples lie between 200 s and 110 s.*runs from 100 s to 110 s"
    ):
        read(ramp, {"line": Column("line", "m/s")}, start=200.0)


def test_scale_offset_and_sign(ramp):
    found = read(ramp, {"line": Column("line", "mm/s", scale=-3.0, offset=1.0)})
    assert found.signals["line"] == pytest.approx((1.0 - 6.0 * found.signals.time) * 1e-3)


def test_shift_moves_a_signal_later(ramp):
    found = read(ramp, {"line": Column("line", "m/s", shift=0.5), "step": Column("step", "m/s", shift=-0.25)})
    time = found.signals.time
    assert found.signals["line"] == pytest.approx(np.maximum(2.0 * (time - 0.5), 0.0), abs=1e-9)
    assert found.signals["step"][time < 4.735].max() == 0.0
    assert found.signals["step"][time > 4.755].min() == 1.0


def test_mean_makes_a_constant_and_the_temperature(ramp):
    found = read_recording(
        ramp,
        {"T": Column("T", "degC", smooth="mean")},
        time=TimeAxis("t", "s"),
        units={"T": "K"},
        temperature="T",
    )
    assert np.ptp(found.signals["T"]) == 0.0
    assert found.temperature_degC == pytest.approx(-30.0, abs=1e-3)
    assert found.signals["T"][0] == pytest.approx(243.15, abs=1e-3)
    besides = read_recording(
        ramp, {"line": Column("line", "m/s")}, time=TimeAxis("t", "s"), temperature=Column("T", "degC")
    )
    assert besides.temperature_degC == pytest.approx(-30.0, abs=1e-3)
    assert besides.signals.names == ("line",)


def test_constants_are_signals(ramp):
    found = read(ramp, {"line": Column("line", "m/s"), "T": Column(value=-30.0, unit="degC")})
    assert found.signals["T"] == pytest.approx(np.full(1001, 243.15))


def test_resampling_of_a_line_is_exact_and_a_held_step_stays_a_step(ramp):
    columns = {"line": Column("line", "m/s"), "step": Column("step", "m/s", interpolation="hold")}
    found = read(ramp, columns, step=0.003)
    assert np.diff(found.signals.time) == pytest.approx(0.003)
    assert found.signals["line"] == pytest.approx(2.0 * found.signals.time, abs=1e-9)
    assert set(np.unique(found.signals["step"])) == {0.0, 1.0}
    assert found.signals.held == {"step"}
    time = found.signals.time
    assert found.signals["step"][time < 5.0 - 1e-6].max() == 0.0
    with pytest.raises(RecordingError, match="a step of 20 s does not fit a recording of 10 s"):
        read(ramp, columns, step=20.0)
    with pytest.raises(RecordingError, match="does not fit"):
        read(ramp, columns, step=1e-300)


def test_the_digest_is_the_file_s(ramp):
    found = read(ramp, {"line": Column("line", "m/s")})
    assert found.sha256 == hashlib.sha256(ramp.read_bytes()).hexdigest()
    assert found.name == "ramp"


def test_values_that_are_cut_away_need_not_be_finite(tmp_path):
    file = tmp_path / "run.csv"
    file.write_text("t;v\n0;nan\n1;1\n2;2\n3;inf\n")
    found = read_recording(file, {"v": Column("v", "m/s")}, time=TimeAxis("t", "s", start=1.0, stop=2.0))
    assert found.signals["v"].tolist() == [1.0, 2.0]
    with pytest.raises(RecordingError, match=r"is nan at 0 s \(sample 1, 2 in all\).*cut it"):
        read_recording(file, {"v": Column("v", "m/s")}, time=TimeAxis("t", "s"))


def moving(time):
    """A signal with everything that occurs: slopes, curvature, kinks, steps."""
    return np.sin(7.0 * time) * 3.0 + np.clip(time - 2.0, 0, 1) * 20.0 + 40.0 * (time % 2.5 > 1.2)


@pytest.mark.parametrize("sigma", [0.02, 0.2, 2.0])
@pytest.mark.parametrize("step", [0.0, 0.1, 1.0, 3.0])
def test_noise_is_found_within_five_percent_whatever_the_quantisation(sigma, step):
    time = np.arange(10000) * 1e-3
    clean = moving(time)
    noisy = clean + sigma * np.random.default_rng(7).standard_normal(time.size)
    if step == 0.0:
        assert noise_estimate(noisy) == pytest.approx(sigma, rel=0.05)
        assert quantum(noisy) == 0.0
        return
    read_out = np.round(noisy / step) * step
    assert quantum(read_out) == pytest.approx(step)
    if sigma >= step:
        assert noise_estimate(read_out) == pytest.approx(np.hypot(sigma, step / np.sqrt(12)), rel=0.05)
    else:
        # Below the quantum nothing but the rounding can be seen; what is claimed is at least that.
        assert (
            step / np.sqrt(12) * 0.999
            <= noise_estimate(read_out)
            <= 1.5 * np.hypot(sigma, step / np.sqrt(12))
        )


def test_quantum_survives_float32_and_unit_conversion():
    rng = np.random.default_rng(1)
    position = np.round(rng.normal(0, 1, 5000).cumsum() / 1.0) * 1.0  # um
    assert quantum((position * 1e-3).astype(np.float32).astype(np.float64) * 1e-3) == pytest.approx(
        1e-6, rel=1e-3
    )


def test_no_noise_is_claimed_where_none_can_be_seen():
    assert noise_estimate(np.zeros(1000)) == 0.0
    assert noise_estimate(np.random.default_rng(0).normal(size=8)) == 0.0
    assert noise_estimate(np.linspace(0, 1, 1000)) < 1e-12
    assert quantum(np.zeros(100)) == 0.0


@settings(deadline=None)
@given(st.floats(1e-6, 1e6), st.floats(-100, 100), st.floats(-100, 100), st.integers(0, 2**32 - 1))
def test_noise_scales_and_ignores_offset_and_slope(scale, offset, slope, seed):
    noise = np.random.default_rng(seed).standard_normal(400)
    k = np.arange(400) / 400
    plain = noise_estimate(noise)
    assert noise_estimate(scale * (noise + offset + slope * k)) == pytest.approx(scale * plain, rel=1e-6)
