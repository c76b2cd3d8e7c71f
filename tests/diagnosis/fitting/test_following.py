"""Which place can follow which measured speed, what it is given, and by which gain."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from diagnosis.analytic import MOTOR, bench, candidates, unknowns
from thsa_cosim.diagnosis.fitting import following as room
from thsa_cosim.diagnosis.fitting.following import (
    HARDLY,
    MEANS,
    TOLERANCE,
    Followed,
    Following,
    driven,
    find_followed,
    with_lag,
    without_lag,
)
from thsa_cosim.signals import Signals

TRIALS = bench(candidates("windage"), {}).of("fit")
CASE = TRIALS[0].case
SPEED = np.sin(CASE.time)


def signals(**columns: np.ndarray) -> dict[str, Signals]:
    load = np.full(CASE.time.size, 3.0)
    own = {"motorEffect.v": SPEED, "motorEffect.N": load, "i": 0.0 * load, "u": 0.0 * load, **columns}
    return {CASE.name: Signals(CASE.time, own)}


def test_a_place_follows_the_output_that_is_its_speed():
    found = find_followed([MOTOR], TRIALS, signals(u=SPEED))
    assert found is not None
    assert (found.slot, found.channel) == (MOTOR, "u")
    assert found.unit_gain == pytest.approx(3.0 / np.abs(SPEED).max())


def test_a_lagged_speed_another_interface_or_no_run_is_none():
    assert find_followed([MOTOR], TRIALS, signals(u=np.sin(CASE.time - 0.01))) is None
    assert find_followed([replace(MOTOR, interface="SensorEffect")], TRIALS, signals(u=SPEED)) is None
    assert find_followed([MOTOR], TRIALS, {}) is None


def test_what_is_followed_is_means_of_the_measured_samples():
    followed = Followed(MOTOR, "u", 1.0)
    made = driven(TRIALS[0], followed).case
    given = made.inputs["motorMeasured"]
    channel = next(c for c in CASE.channels if c.name == "u")
    time, means = (
        x[: given.size // MEANS * MEANS].reshape(-1, MEANS).mean(axis=1)
        for x in (channel.time, channel.measured)
    )
    np.testing.assert_allclose(given, np.interp(made.inputs.time, time, means))
    assert made.inputs.names == (*CASE.inputs.names, "motorMeasured")
    assert made.channels is CASE.channels


class Runner:
    """Opens once, and is closed."""

    notes: tuple[str, ...] = ()

    def __init__(self) -> None:
        self.closed = False

    def __enter__(self) -> "Runner":
        return self

    def __exit__(self, *given: object) -> None:
        self.closed = True


def test_the_least_gain_counts_that_follows_about_as_well_as_the_largest(monkeypatch: pytest.MonkeyPatch):
    opened: list[Runner] = []

    def open_runner(experiments: Any) -> Any:
        opened.append(Runner())
        return opened[-1]

    own = bench(candidates("windage"), {})
    asked: list[float] = []

    def left(followed: Followed, gain: float, *_given: Any) -> float:
        asked.append(gain / followed.unit_gain)
        return 1.0 if asked[-1] == room.STEPS[-1] else 1.0 + 10.0 / asked[-1]

    with Following(own, [MOTOR], lambda _values: signals(u=SPEED), open_runner) as following:
        monkeypatch.setattr(following, "_left", left)
        unit = following.followed(unknowns(), unknowns().start)
        assert unit is not None
        found = following.gain(unknowns(), unknowns().start)
        assert found == pytest.approx(next(s for s in room.STEPS if s >= 200.0) * unit.unit_gain)
        assert len(asked) <= 5, "by bisection"
        assert not opened, "processes start when they are needed"
        first, second = following.at(1.0), following.at(2.0)
        assert (first._fixed, second._fixed) == ({"motorEffect.g_m": 1.0}, {"motorEffect.g_m": 2.0})
        assert len(opened) == 1
    assert opened[0].closed


def test_a_finer_free_run_has_its_own_processes_and_a_bench_can_go_over_to_it():
    opened: list[tuple[Runner, list[float | None]]] = []

    def open_runner(experiments: Any) -> Any:
        opened.append((Runner(), [e.tolerance for e in experiments]))
        return opened[-1][0]

    own = bench(candidates("windage"), {})
    own.trials = tuple(replace(t, case=replace(t.case, tolerance=1e-4)) for t in own.trials)
    own.residuals(unknowns(), unknowns().start[None, :], "fit")
    with Following(own, [MOTOR], lambda _values: signals(u=SPEED), open_runner) as following:
        fine = following.finer(1e-6)
        ((runner, tolerances),) = opened
        assert tolerances == [1e-6] * len(own.trials)
        assert own.evaluations == 1
        own.go_over(fine)
        assert own.trials == fine.trials
        assert own._engine is fine._engine
        assert own.evaluations == 1, "what ran before counts, and nothing twice"
        assert following.finer(1e-6) is own, "it has that tolerance"
        own.go_over(own)
        assert own.evaluations == 1
        assert len(opened) == 1
    assert runner.closed


def test_without_a_speed_that_is_measured_there_is_no_gain():
    own = bench(candidates("windage"), {})
    with Following(own, [MOTOR], lambda _values: signals(), lambda _: None) as following:  # type: ignore[arg-type,return-value]
        assert following.gain(unknowns(), unknowns().start) is None
    assert room.STEPS[0] == 1.0


def behind(lag: float, speed: np.ndarray, time: np.ndarray) -> np.ndarray:
    """A sensor of first order, whose input is linear between the samples: exact."""
    shown = np.empty_like(speed)
    shown[0] = speed[0]
    for k, (step, before, now) in enumerate(zip(np.diff(time), speed[:-1], speed[1:], strict=True)):
        slope, decay = (now - before) / step, np.exp(-step / lag)
        shown[k + 1] = now - slope * lag + (shown[k] - before + slope * lag) * decay
    return shown


def test_a_place_follows_a_signal_behind_a_lag_only_where_that_is_asked_for():
    late = signals(u=behind(0.02, SPEED, CASE.time))
    assert find_followed([MOTOR], TRIALS, late) is None
    found = find_followed([MOTOR], TRIALS, late, lagged=True)
    assert found is not None
    assert (found.channel, found.lag) == ("u", pytest.approx(0.02, rel=1e-2))
    other = signals(u=SPEED**2)
    assert find_followed([MOTOR], TRIALS, other, lagged=True) is None
    position = 1e-3 * np.cumsum(SPEED) * np.median(np.diff(CASE.time))
    assert find_followed([MOTOR], TRIALS, signals(u=position), lagged=True) is None, "behind an endless lag"
    both = find_followed([MOTOR], TRIALS, signals(i=behind(0.02, SPEED, CASE.time), u=SPEED), lagged=True)
    assert both is not None
    assert (both.channel, both.lag) == ("u", 0.0), "what shows it by itself comes first, in whatever order"


def test_a_sensor_that_lags_is_known_where_a_place_sticks_and_slips_between_the_samples():
    """The integral of what samples show drifts away; what a lag makes of them does not."""
    fine = np.arange(0.0, CASE.time[-1], 2e-5)
    phase = 2.0 * np.pi * 0.47 / np.median(np.diff(CASE.time)) * fine
    slipping = np.sin(fine) + 0.8 * np.sign(np.sin(fine)) * np.maximum(0.0, np.sin(phase + np.sin(fine))) ** 4
    columns = {"motorEffect.v": slipping, "u": with_lag(fine, slipping, 0.05, 0.0)}
    at = {name: np.interp(CASE.time, fine, column) for name, column in columns.items()}
    found = find_followed([MOTOR], TRIALS, signals(**at), lagged=True)
    assert found is not None
    assert found.lag == pytest.approx(0.05, rel=0.1)


def test_what_a_lag_shows_of_a_step_and_of_a_ramp():
    time = np.linspace(0.0, 1.0, 401)
    faded = np.exp(-time / 0.1)
    np.testing.assert_allclose(with_lag(time, np.ones(401), 0.1, 0.0), 1.0 - faded, atol=1e-12)
    np.testing.assert_allclose(with_lag(time, time, 0.1, 0.0), time - 0.1 + 0.1 * faded, atol=1e-12)


@pytest.mark.parametrize("mean_of", [1, 2])
def test_what_a_lagging_sensor_was_shown_comes_back(mean_of: int):
    raw = np.arange(0.0, 4.0, 1e-3)
    speed = np.sin(2.0 * np.pi * 3.0 * raw) + 0.3 * np.sin(2.0 * np.pi * 120.0 * raw)
    shown = behind(0.01, speed, raw)
    time, means = (x[: raw.size // mean_of * mean_of].reshape(-1, mean_of).mean(axis=1) for x in (raw, shown))
    found = without_lag(time, means, 0.01, mean_of, raw)
    inner = (raw > 0.5) & (raw < 3.5)
    assert np.std(means - np.interp(time, raw, speed)) > 0.2, "the lag takes much of it"
    assert np.std(found[inner] - speed[inner]) < 0.06


def test_a_followed_signal_behind_a_lag_does_not_count_and_the_gain_is_the_one_that_leaves_least(
    monkeypatch: pytest.MonkeyPatch,
):
    own = bench(candidates("windage"), {})
    late = signals(u=behind(0.02, SPEED, CASE.time))
    runner = Runner()

    def left(following: Following, gain: float, *_given: Any) -> float:
        followed = following.followed(unknowns(), unknowns().start)
        assert followed is not None
        return abs(np.log10(gain / followed.unit_gain) + 1.0)

    monkeypatch.setattr(Following, "_beside", left)
    with Following(own, [MOTOR], lambda _values: late, lambda _: runner) as following:  # type: ignore[arg-type,return-value]
        assert following.gain(unknowns(), unknowns().start) is None, "not without being asked"
        place = following.of(MOTOR)
        assert place is following.of(MOTOR)
        unit = place.followed(unknowns(), unknowns().start)
        assert unit is not None
        assert place.gain(unknowns(), unknowns().start) == pytest.approx(0.1 * unit.unit_gain)
        assert place.beside_signal(1.0).weights == {"u": HARDLY}
        assert place.at(1.0).weights == {}
        assert following.of(replace(MOTOR, name="elsewhere")).followed(unknowns(), unknowns().start) is None
    assert runner.closed


def test_means_are_undone_with_the_lag():
    followed = Followed(MOTOR, "u", 1.0, lag=0.02)
    behind = driven(TRIALS[0], followed).case
    given = behind.inputs["motorMeasured"]
    assert behind.tolerance == TOLERANCE, "it bends at every sample"
    assert driven(TRIALS[0], Followed(MOTOR, "u", 1.0)).case.tolerance == TRIALS[0].case.tolerance
    channel = next(c for c in CASE.channels if c.name == "u")
    aim = without_lag(channel.time, channel.measured, 0.02, channel.mean_of, CASE.inputs.time)
    np.testing.assert_array_equal(given, aim)
