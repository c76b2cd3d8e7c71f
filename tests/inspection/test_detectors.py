"""The data check: every kind of defect is named on channels of every bench, and clean recordings have no finding."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.interpolate import CubicSpline

from inspection.defects import DEFECTS
from thsa_cosim.inspection import Finding, inspect_file
from thsa_cosim.inspection.channel import Channel, correlation
from thsa_cosim.inspection.recording import inspect_channels
from thsa_cosim.inspection.time_axis import time_findings
from thsa_cosim.recordings import noise_estimate
from thsa_cosim.recordings.independence import independence

RECORDINGS = Path(__file__).parents[2] / "scenarios" / "recordings"
CHANNELS = {
    "motor_p25": ("motor_speed_rad_s", "q_current_A", "q_voltage_V"),
    "screw_m30": ("velocity_mm_s", "force_kN"),
    "gearbox_p00": ("force_kN",),
    "driven_m30_b": ("velocity_mm_s", "position_mm", "load_kN"),
}
UNITS = {"rad_s": "rad/s", "mm_s": "mm/s", "A": "A", "V": "V", "kN": "kN", "mm": "mm", "degC": "degC"}
INPUTS = ("command", "load", "temperature")


def load(name: str) -> pd.DataFrame:
    return pd.read_parquet(RECORDINGS / f"{name}.parquet").astype(float)


def found(table: pd.DataFrame, inputs: tuple[str, ...] = INPUTS) -> list[Finding]:
    """Findings above "note"."""
    time = table["time_s"].to_numpy()
    channels = [
        Channel(
            recording="run",
            name=name,
            unit=next(u for ending, u in UNITS.items() if name.endswith(ending)),
            role="input" if any(word in name for word in inputs) else "output",
            time=time,
            values=table[name].to_numpy(),
            held="command" in name,
        )
        for name in table
        if name != "time_s"
    ]
    return [f for f in inspect_channels("run", channels, [time]) if f.severity != "note"]


TRUE_FINDINGS = {
    "servo": {
        "several-rates",
        "coarse-resolution",
        "clipped",
    },  # uneven stamps, counts, a goal at rest, a full duty
    "cogging": {"jitter"},
    "warm_up": {"temperature-drift"},
}
"""Recordings of machines, and of failures, on which there is something to report."""


@pytest.mark.parametrize("path", sorted(RECORDINGS.glob("*.parquet")), ids=lambda p: p.stem)
def test_a_clean_recording_has_no_finding(path: Path) -> None:
    known = next((kinds for name, kinds in TRUE_FINDINGS.items() if path.stem.startswith(name)), set())
    found = [f for f in inspect_file(path).data.findings if f.severity != "note"]
    assert [f for f in found if f.kind not in known] == []


SMOOTH_OR_HELD = (
    "upsampled_by_a_spline",
    "upsampled_by_a_filter",
    "held_at_no_fixed_rate",
    "held_from_the_middle_on",
    "packets_lost",
)


def inputs_of(name: str) -> tuple[str, ...]:
    return (*INPUTS, "velocity") if name.startswith(("screw", "gearbox")) else INPUTS


def is_input(name: str, channel: str) -> bool:
    return any(word in channel for word in inputs_of(name))


def cases() -> list[tuple[str, str, str]]:
    return [(d, name, channel) for d in DEFECTS for name, own in CHANNELS.items() for channel in own]


@pytest.mark.parametrize(("defect", "name", "channel"), cases())
def test_a_defect_is_named_on_its_channel(defect: str, name: str, channel: str) -> None:
    table = load(name)
    time, values = table["time_s"].to_numpy(), table[channel].to_numpy()
    damage, kinds = DEFECTS[defect]
    if defect == "hum" and time[1] > 0.005:
        pytest.skip("sampled too slowly for a mains line")
    if defect == "dropouts" and np.median(np.abs(values)) < 10.0 * noise_estimate(values):
        pytest.skip("it is at zero most of the time")
    if defect == "coarse" and (
        channel.startswith(("load", "velocity")) or np.ptp(values) < 50 * noise_estimate(values)
    ):
        pytest.skip("its noise dithers every lattice of that size, or it is an input")
    if defect in SMOOTH_OR_HELD and (is_input(name, channel) or channel == "position_mm"):
        pytest.skip("an input may well be smooth; the noise of this position is one step of its encoder")
    seed = sum(map(ord, defect + name + channel))
    table[channel] = damage(time, values, np.random.default_rng(seed))
    if np.unique(table[channel]).size < 5:
        pytest.skip("two levels: there is no noise to be seen, which loading refuses")
    inputs = inputs_of(name)
    hits = [f for f in found(table, inputs) if f.channel == channel and f.kind in kinds]
    assert hits, [(f.channel, f.kind) for f in found(table, inputs)]


def stamps(change: str, rng: np.random.Generator) -> np.ndarray:
    time = np.arange(4000) * 1e-3
    if change == "jitter":
        return np.sort(time + rng.uniform(-4e-4, 4e-4, time.size))
    if change == "gaps":
        return time[(time < 1.0) | (time > 1.3)]
    if change == "lost-samples":
        return time[rng.random(time.size) > 0.3]
    if change == "several-rates":
        return np.concatenate((time[:2000], 2.0 + 3e-3 * np.arange(1000)))
    if change == "repeated-stamps":
        return np.round(time, 2)
    assert change == "too-short"
    return time[:30]


@pytest.mark.parametrize(
    "kind", ["jitter", "gaps", "lost-samples", "several-rates", "repeated-stamps", "too-short"]
)
def test_a_time_axis_is_named_for_what_is_wrong_with_it(kind: str) -> None:
    kinds = {
        f.kind for f in time_findings("run", stamps(kind, np.random.default_rng(3))) if f.severity != "note"
    }
    assert kind in kinds
    assert kinds <= {kind, *(("gaps",) if kind == "lost-samples" else ())}


@pytest.mark.parametrize("start", [0.0, 1.7e9, -5.0])
def test_a_regular_time_axis_has_no_finding(start: float) -> None:
    assert list(time_findings("run", start + np.arange(4000) * 1e-3)) == []


def test_a_command_that_comes_late_is_named() -> None:
    table = load("motor_m30")
    table["speed_command_rad_s"] = table["speed_command_rad_s"].shift(20).fillna(0.0)
    assert [(f.channel, f.kind) for f in found(table)] == [("speed_command_rad_s", "delay")]


@pytest.mark.parametrize(("factor", "kind"), [(30 / np.pi, "unit"), (180 / np.pi, "unit"), (-1.0, "sign")])
def test_a_speed_that_is_not_its_command_is_named(factor: float, kind: str) -> None:
    table = load("motor_m30")
    table["motor_speed_rad_s"] *= factor
    named = [(f.channel, f.kind) for f in found(table)]
    assert named == [
        ("motor_speed_rad_s", kind),
        ("speed_command_rad_s", kind),
    ]  # which is wrong, they do not tell


def test_a_recording_that_begins_in_motion_or_gets_warm_is_named() -> None:
    table = load("motor_m30")
    late = table[table["time_s"] > 1.5]
    assert ("motor_speed_rad_s", "moving-start") in [(f.channel, f.kind) for f in found(late)]
    table["temperature_degC"] = np.linspace(-30.0, -24.0, len(table))
    assert [(f.channel, f.kind) for f in found(table)] == [("temperature_degC", "temperature-drift")]


def test_kelvin_called_celsius_is_named() -> None:
    table = load("motor_m30")
    table["temperature_degC"] += 273.15
    assert [(f.channel, f.kind) for f in found(table)] == [("temperature_degC", "unit")]
    time, noise = np.arange(500) * 1e-2, np.random.default_rng(1).normal(0.0, 0.2, 500)
    called_kelvin = Channel("run", "T", "K", "input", time, 20.0 + noise)
    (finding,) = [f for f in inspect_channels("run", [called_kelvin], [time]) if f.kind == "unit"]
    assert 'unit = "degC"' in finding.remedy


def test_a_signal_that_is_rectified_is_clipped() -> None:
    table = load("motor_p25")
    table["q_current_A"] = table["q_current_A"].clip(lower=0.0)
    assert [(f.channel, f.kind) for f in found(table)] == [("q_current_A", "clipped")]


def test_the_noise_of_an_upsampled_channel_is_that_of_its_own_samples() -> None:
    x = load("motor_p25")["q_current_A"].to_numpy()
    knots = np.arange(0, x.size, 4)
    fine = CubicSpline(knots, x[knots])(np.arange(x.size))
    assert noise_estimate(fine) == pytest.approx(noise_estimate(x), rel=0.25)


def test_motion_and_ripple_are_no_smooth_noise() -> None:
    time = np.arange(8000) * 1e-3
    rng = np.random.default_rng(1)
    for ripple in (5.0, 12.0, 45.0):
        motion = 50.0 * np.sin(2 * np.pi * 0.3 * time) + np.sin(2 * np.pi * ripple * time)
        for noise in (1e-4, 1e-2, 0.3):
            assert independence(motion + rng.normal(0.0, noise, time.size)).kind is None


def stepped(seed: int = 0) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Four set points of a speed, and a voltage that answers each step with a spike of two samples."""
    random = np.random.default_rng(seed)
    time = np.arange(0.0, 6.0, 1e-3)
    speed = np.select([time < 0.5, time < 2.0, time < 4.0], [0.0, 5.0, -60.0], 150.0)
    voltage = 0.5 * speed + random.normal(0.0, 0.3, time.size)
    for k in np.flatnonzero(np.diff(speed)) + 1:
        voltage[k : k + 2] += 25.0 * np.sign(speed[k] - speed[k - 1])
    return time, {"w_cmd": speed, "u_q": voltage}


def findings(time: np.ndarray, columns: dict[str, np.ndarray]) -> list[tuple[str, str]]:
    channels = [Channel("run", name, "1", "other", time, values) for name, values in columns.items()]
    return [(f.channel, f.kind) for f in inspect_channels("run", channels, [time]) if f.severity != "note"]


def test_the_answer_to_a_step_of_the_command_is_no_spike() -> None:
    time, columns = stepped()
    assert findings(time, columns) == []
    columns["u_q"][[1000, 3000, 5000]] += 25.0
    assert findings(time, columns) == [("u_q", "spikes")]


def test_a_schedule_of_set_points_is_no_coarse_sensor() -> None:
    time, columns = stepped()
    columns["x"] = np.round(30.0 * np.sin(time))  # a sensor: from one level to the next
    assert findings(time, columns) == [("x", "coarse-resolution")]


def test_signals_that_do_not_vary_have_no_correlation() -> None:
    noise = np.random.default_rng(1).normal(size=200)
    with np.errstate(all="raise"):
        assert correlation(np.full(200, 3.0), noise) == 0.0
        assert correlation(np.full(200, 1e308), np.full(200, 1e308)) == 0.0
        assert correlation(noise, 2.0 - 3.0 * noise) == pytest.approx(-1.0)
        assert correlation(np.array([1.0]), np.array([2.0])) == 0.0
