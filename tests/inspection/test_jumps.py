"""What no machine does from one sample to the next, and what two signals of one shaft tell that do not simply agree."""

import numpy as np
import pytest

from thsa_cosim.inspection import Finding
from thsa_cosim.inspection.channel import Channel
from thsa_cosim.inspection.recording import inspect_channels
from thsa_cosim.signals import FloatArray

TIME = np.arange(6000) * 1e-3
COMMAND = np.interp(TIME, [0, 0.5, 0.8, 2.0, 2.6, 4.0, 4.4, 6.0], [0, 0, 30, 30, -20, -20, 10, 10])
"""rad/s"""


def signals(noise: int = 1) -> dict[str, tuple[FloatArray, str]]:
    rng = np.random.default_rng(noise)
    angle = np.concatenate(([0.0], np.cumsum(0.5 * (COMMAND[1:] + COMMAND[:-1]) * 1e-3)))
    return {
        "w_cmd": (COMMAND, "rad/s"),
        "w": (COMMAND + rng.normal(0.0, 0.1, TIME.size), "rad/s"),
        "phi": (angle + rng.normal(0.0, 1e-3, TIME.size), "rad"),
        "i": (0.05 * COMMAND + 2.0 * np.sin(5.0 * TIME) + rng.normal(0.0, 0.02, TIME.size), "A"),
    }


def found(own: dict[str, tuple[FloatArray, str]], time: FloatArray = TIME) -> list[Finding]:
    channels = [
        Channel("run", name, unit, "input" if name == "w_cmd" else "output", time, values)
        for name, (values, unit) in own.items()
    ]
    return [f for f in inspect_channels("run", channels, [time]) if f.severity != "note"]


def told(own: dict[str, tuple[FloatArray, str]], time: FloatArray = TIME) -> set[tuple[str, str]]:
    return {(f.channel, f.kind) for f in found(own, time)}


def changed(name: str, values: FloatArray) -> dict[str, tuple[FloatArray, str]]:
    own = signals()
    return {**own, name: (values, own[name][1])}


def test_the_clean_signals_have_no_finding() -> None:
    assert told(signals()) == set()


@pytest.mark.parametrize("first", [0.0, 30.0])
def test_a_command_that_is_there_from_the_first_sample_is_answered_there(first: float) -> None:
    command = np.where(TIME < 2.0, first, np.where(TIME < 4.0, -20.0, 10.0))
    kick = np.zeros(TIME.size)
    for at in (0, 2000, 4000):
        kick[at + 1 :] += 40.0 * np.exp(-np.arange(TIME.size - at - 1) / 3.0)  # the first sample is at rest
    current = kick + np.random.default_rng(1).normal(0.0, 0.05, TIME.size)
    own = {**signals(), "w_cmd": (command, "rad/s"), "i": (current, "A")}
    del own["w"], own["phi"]
    assert (("i", "step") in told(own)) == (first == 0.0)  # without a command something else switched it


@pytest.mark.parametrize("count", [3, 12, 20, 50, 100, 101, 150])
def test_short_recordings_are_inspected(count: int) -> None:
    """Also with a slip of the unit, a speed without its sign and a position that sticks, which look at stretches."""
    step = TIME.size // count
    own = {name: (values[::step][:count], unit) for name, (values, unit) in signals().items()}
    for name, values in (
        ("w", own["w"][0] * 30.0 / np.pi),
        ("w", np.abs(own["w"][0])),
        ("phi", np.where(np.arange(count) < count // 2, own["phi"][0], own["phi"][0][count // 2])),
    ):
        found({**own, name: (values, own[name][1])}, TIME[::step][:count])
    if count >= 100:
        assert ("w", "unit") in told(
            {**own, "w": (own["w"][0] * 30.0 / np.pi, "rad/s")}, TIME[::step][:count]
        )


def test_an_angle_that_wraps_is_named_with_its_period() -> None:
    (finding,) = found(changed("phi", np.mod(signals()["phi"][0], 2.0 * np.pi)))
    assert (finding.channel, finding.kind) == ("phi", "wrapped")
    assert "unwrap = 6.28319" in finding.remedy


def test_a_16_bit_counter_that_wraps_is_named() -> None:
    current = signals()["i"][0]
    counts = np.mod(np.round(current / 4e-3), 400)  # 1.6 A a turn
    assert ("i", "wrapped") in told(changed("i", counts * 4e-3))


@pytest.mark.parametrize("name", ["w", "phi", "i"])
def test_a_tare_is_a_step_and_a_burst_a_disturbance(name: str) -> None:
    values = signals()[name][0]
    tare, burst = values.copy(), values.copy()
    tare[3300:] += 0.3 * np.ptp(values)
    burst[[k + j for k in (900, 3100, 5000) for j in range(6)]] += 0.4 * np.ptp(values)
    assert (name, "step") in told(changed(name, tare))
    assert (name, "spikes") in told(changed(name, burst))


def test_a_sign_that_is_switched_midway_is_no_wrap() -> None:
    values = signals()["w"][0].copy()
    values[1500:] *= -1.0
    assert ("w", "step") in told(changed("w", values))
    assert ("w", "wrapped") not in told(changed("w", values))


def test_a_magnitude_recorded_for_a_speed_is_named() -> None:
    assert ("w", "sign") in told(changed("w", np.abs(signals()["w"][0])))


def test_a_position_that_stays_while_its_speed_does_not_is_stuck() -> None:
    values = np.round(signals()["phi"][0], 2)  # so coarse an encoder has no noise to miss
    values[4500:] = values[4500]
    assert ("phi", "stuck") in told(changed("phi", values))


def test_columns_that_are_exchanged_are_named() -> None:
    own = signals()
    swapped = {**own, "w": (own["i"][0], "rad/s"), "i": (own["w"][0], "A")}
    assert ("w", "unit") in told(swapped)
    swapped = {**own, "w": (own["phi"][0], "rad/s"), "phi": (own["w"][0], "rad")}
    assert {c for c, _ in told(swapped)} & {"w", "phi"}


@pytest.mark.parametrize("factor", [1e3, 1e6, 1e-3])
def test_a_time_in_another_unit_is_named(factor: float) -> None:
    assert ("time", "unit") in told(signals(), TIME * factor)


def test_a_time_in_another_unit_is_named_without_a_position() -> None:
    lagged = COMMAND.copy()
    steps = np.where(TIME < 0.5, 0.0, np.where(TIME < 2.0, 30.0, np.where(TIME < 4.0, -20.0, 10.0)))
    for k in range(1, TIME.size):  # 20 ms
        lagged[k] = lagged[k - 1] + 0.05 * (steps[k - 1] - lagged[k - 1])
    own = {
        "w_cmd": (steps, "rad/s"),
        "w": (lagged + np.random.default_rng(2).normal(0.0, 0.1, TIME.size), "rad/s"),
    }
    assert told(own) == set()
    for factor in (1e3, 1e6, 1e-3):
        assert ("time", "unit") in told(own, TIME * factor + 0.25 * factor)


def test_a_logger_that_starts_again_is_told_from_rows_out_of_order() -> None:
    again = np.concatenate((TIME[:3000], TIME[:3000]))
    (restart,) = (f for f in found(signals(), again) if f.channel == "time")
    assert "started again" in restart.text
    order = TIME.copy()
    order[[10, 11]] = order[[11, 10]]
    (swap,) = (f for f in found(signals(), order) if f.kind == "repeated-stamps")
    assert "goes back once" in swap.text
    assert "started again" not in swap.text


@pytest.mark.parametrize("until", [4000, TIME.size])
def test_a_sensor_that_stops_on_its_largest_value_is_stuck(until: int) -> None:
    current = signals()["i"][0].copy()
    current[2500] = current.max() + 0.01
    current[2500:until] = current[2500]
    assert ("i", "stuck") in told(changed("i", current))
    assert ("i", "clipped") not in told(changed("i", current))


def test_a_current_on_its_limit_for_once_is_not_stuck() -> None:
    current = np.minimum(signals()["i"][0], 2.2)
    assert told(changed("i", current)) & {("i", "stuck"), ("i", "clipped")} == {("i", "clipped")}


@pytest.mark.parametrize("code", [65.535, -32.768, 12.5])
def test_a_level_off_all_others_is_a_code(code: float) -> None:
    current = signals()["i"][0].copy()
    current[[900, 1700, 2900, 3300, 4100, 5200]] = code
    assert told(changed("i", current)) == {("i", "sentinel")}
