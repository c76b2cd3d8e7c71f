"""Which place can follow which measured speed, what it is given, and by which gain."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from diagnosis.analytic import MOTOR, bench, candidates, unknowns
from thsa_cosim.diagnosis.fitting import following as room
from thsa_cosim.diagnosis.fitting.following import MEANS, Followed, Following, driven, find_followed
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


def test_without_a_speed_that_is_measured_there_is_no_gain():
    own = bench(candidates("windage"), {})
    with Following(own, [MOTOR], lambda _values: signals(), lambda _: None) as following:  # type: ignore[arg-type,return-value]
        assert following.gain(unknowns(), unknowns().start) is None
    assert room.STEPS[0] == 1.0
