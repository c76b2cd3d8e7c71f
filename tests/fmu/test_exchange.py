"""Model Exchange: closed forms, every kind of event, no dependence on the output times."""

import ctypes
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy.logging import addLoggerProxy
from fmu_sources import build

from fmu.test_plant import lag
from thsa_cosim.fmu import Plant, SimulationFailure, Status
from thsa_cosim.fmu.fmi2 import Callbacks, shared_callbacks
from thsa_cosim.fmu.fmi3 import Fmi3Instance
from thsa_cosim.signals import Signals

RAMP = np.linspace(0.0, 1.0, 11)


@pytest.mark.parametrize("fmu", [build.lag2, build.lag3])
def test_result_does_not_depend_on_the_output_times(fmu: Callable[[], Path]) -> None:
    """fmpy's own Model Exchange is 14 % off at 0.1 s with a ramp, as it holds inputs between outputs."""
    inputs = Signals(RAMP, {"u": RAMP**2}, {})
    exact = lag(RAMP, inputs["u"], 0.05, 2.0)
    for count in (11, 101, 1001):
        time = np.linspace(0.0, 1.0, count)
        with Plant.open(fmu(), kind="model-exchange") as plant:
            found = plant.run({"tau": 0.05, "k": 2.0}, inputs, ["y", "feed"], time, tolerance=1e-7)
        assert np.max(np.abs(found["y"][:: count // 10] - exact)) < 2e-6
        assert np.max(np.abs(found["feed"] - np.interp(time, RAMP, inputs["u"]))) < 1e-12


def test_a_pulse_of_one_sample_is_not_stepped_over() -> None:
    time = np.linspace(0.0, 10.0, 10001)
    u = np.zeros_like(time)
    u[7000] = 1.0
    with Plant.open(build.lag2(), kind="model-exchange") as plant:
        found = plant.run({}, Signals(time, {"u": u}), ["y"], np.array([0.0, 7.1, 10.0]), tolerance=1e-8)
    assert found["y"][1] == pytest.approx(lag(time, u, 0.1, 1.0)[7100], rel=1e-4)


def test_held_inputs_jump_through_event_mode() -> None:
    inputs = Signals(RAMP, {"u": RAMP}, {}, frozenset({"u"}))
    with Plant.open(build.lag2(), kind="model-exchange") as plant:
        found = plant.run({}, inputs, ["y", "feed"], RAMP, tolerance=1e-8)
    x = np.zeros(11)
    for k in range(10):
        x[k + 1] = (x[k] - RAMP[k]) * np.exp(-1.0) + RAMP[k]
    assert np.max(np.abs(found["y"] - x)) < 1e-6
    assert np.array_equal(found["feed"], RAMP)


def _bounces(e: float, count: int, g: float = 9.81) -> np.ndarray:
    """Times of the first impacts of a ball dropped from 1 m."""
    fall = np.sqrt(2.0 / g)
    return fall + np.concatenate(([0.0], np.cumsum(2.0 * fall * e ** np.arange(1, count))))


def test_state_events_are_located_and_none_is_missed() -> None:
    time = np.linspace(0.0, 2.0, 9)
    with Plant.open(build.events2()) as plant:
        found = plant.run({}, None, ["h", "v", "bounces"], time, tolerance=1e-9)
    impacts = _bounces(0.7, 40)
    assert np.array_equal(found["bounces"], [np.count_nonzero(impacts < t) for t in time])
    # Height within the fourth flight from the closed form.
    k = 5
    n = int(np.count_nonzero(impacts < time[k]))
    s = time[k] - impacts[n - 1]
    v0 = 9.81 * impacts[0] * 0.7**n
    assert found["h"][k] == pytest.approx(v0 * s - 4.905 * s**2, abs=1e-6)


def test_zeno_behaviour_ends_with_a_reason_in_bounded_time() -> None:
    end = _bounces(0.3, 200)[-1]
    with Plant.open(build.events2()) as plant:
        try:
            found = plant.run({"e": 0.3}, None, ["h"], np.linspace(0.0, end + 0.5, 5))
        except SimulationFailure as failure:
            assert failure.status in (Status.FMI_ERROR, Status.INCOMPLETE)  # noqa: PT017
        else:
            assert np.isfinite(found["h"]).all()


def test_time_events() -> None:
    values = {"kick": 0.2, "dv": 3.0}
    time = np.linspace(0.0, 0.4, 5)
    with Plant.open(build.events2()) as plant:
        found = plant.run(values, None, ["v"], time, tolerance=1e-9)
    # At the event itself the value after it is recorded.
    assert np.max(np.abs(found["v"] - (-9.81 * time + 3.0 * (time >= 0.2)))) < 1e-9


def test_step_events() -> None:
    with Plant.open(build.events2()) as plant:
        found = plant.run({"h": 5.0, "ceiling": 4.0}, None, ["steps"], np.array([0.0, 0.1]))
        none = plant.run({"h": 3.0, "ceiling": 4.0}, None, ["steps"], np.array([0.0, 0.1]))
    assert found["steps"][-1] == 1.0
    assert none["steps"][-1] == 0.0


def test_discrete_inputs_change_in_event_mode_only() -> None:
    times = np.array([0.0, 0.1, 0.2])
    inputs = Signals(times, {"off": np.array([0.0, 1.0, 0.0])}, {})
    with Plant.open(build.events2()) as plant:
        found = plant.run({}, inputs, ["v"], np.array([0.0, 0.05, 0.1, 0.15, 0.2, 0.3]), tolerance=1e-9)
    fallen = np.array([0.0, 0.05, 0.1, 0.1, 0.1, 0.2])
    assert np.max(np.abs(found["v"] + 9.81 * fallen)) < 1e-9


def test_termination_by_the_fmu_is_incomplete() -> None:
    with Plant.open(build.events2()) as plant:
        with pytest.raises(SimulationFailure, match=r"ended the simulation at t = 0\.3 s of 1 s") as caught:
            plant.run({"end": 0.3}, None, ["h"], np.linspace(0.0, 1.0, 11))
        assert caught.value.status is Status.INCOMPLETE
        assert plant.run({"end": 0.3}, None, ["h"], np.linspace(0.0, 0.2, 3))["h"].size == 3


def test_fmi3_events_and_exact_jacobian(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []
    original = Fmi3Instance.directional_derivative

    def count(self: Fmi3Instance, *arguments: Any) -> None:
        original(self, *arguments)
        asked.append(arguments[2].copy())

    monkeypatch.setattr(Fmi3Instance, "directional_derivative", count)
    time = np.linspace(0.0, 3.0, 301)
    inputs = Signals(time, {"u": 1.0 - np.cos(2.0 * np.pi * time)}, {})
    with Plant.open(build.lag3(), kind="model-exchange") as plant:
        found = plant.run({"tau": 0.01}, inputs, ["y", "count"], time, tolerance=1e-8)
    exact = lag(time, inputs["u"], 0.01, 1.0)
    assert np.max(np.abs(found["y"] - exact)) < 1e-6
    assert len(asked) > 3
    assert all(column.tolist() == [-100.0] for column in asked)
    assert found["count"][-1] == np.count_nonzero(np.diff((exact > 0.5).astype(int)))


@pytest.mark.parametrize(
    ("fault", "status"),
    [
        ("error", Status.FMI_ERROR),
        ("fatal", Status.FMI_FATAL),
        ("discard", Status.FMI_DISCARD),
        ("nan", Status.NOT_FINITE),
    ],
)
def test_failures_of_the_right_hand_side(fault: str, status: Status) -> None:
    time = np.linspace(0.0, 1.0, 11)
    inputs = Signals(time, {"u": time}, {})
    with Plant.open(build.lag2(), kind="model-exchange") as plant:
        with pytest.raises(SimulationFailure) as caught:
            plant.run({"fault": build.FAULTS[fault]}, inputs, ["y"], time)
        assert caught.value.status is status


def test_messages_are_heard_after_another_importer_took_the_logger() -> None:
    shared_callbacks()  # as instances before have done
    heard: list[bytes] = []
    logger = type(Callbacks().logger)(lambda *given: heard.append(given[-1]))
    other = Callbacks(logger, None, None, None, None)
    addLoggerProxy(ctypes.byref(other))
    inputs, failing = Signals(RAMP, {"u": RAMP}, {}), {"fault": build.FAULTS["error"]}
    with (
        Plant.open(build.lag2(), kind="model-exchange") as plant,
        pytest.raises(SimulationFailure, match="solver failed with 42 in lag"),
    ):
        plant.run(failing, inputs, ["y"], RAMP)
    assert not heard


def test_error_follows_the_tolerance() -> None:
    time = np.linspace(0.0, 2.0, 201)
    inputs = Signals(time, {"u": np.sin(9.0 * time)}, {})
    exact = lag(time, inputs["u"], 0.05, 1.0)
    errors = []
    for tolerance in (1e-4, 1e-6, 1e-8):
        with Plant.open(build.lag2(), kind="model-exchange") as plant:
            found = plant.run({"tau": 0.05}, inputs, ["y"], time, tolerance=tolerance)
        errors.append(float(np.max(np.abs(found["y"] - exact))))
    for error, tolerance in zip(errors, (1e-4, 1e-6, 1e-8), strict=True):
        assert error < 20.0 * tolerance
    assert errors[2] < 1e-2 * errors[0]


def test_fmi1_inputs_are_applied_at_every_right_hand_side() -> None:
    inputs = Signals(RAMP, {"u": RAMP**2}, {})
    exact = lag(RAMP, inputs["u"], 0.05, 2.0)
    with Plant.open(build.exchange1()) as plant:
        assert plant.kind == "model-exchange"
        for count in (11, 101):
            time = np.linspace(0.0, 1.0, count)
            found = plant.run({"tau": 0.05, "k": 2.0}, inputs, ["y"], time, tolerance=1e-7)
            assert np.max(np.abs(found["y"][:: count // 10] - exact)) < 2e-6


def test_fmi1_state_and_time_events() -> None:
    time = np.linspace(0.0, 1.2, 241)
    with Plant.open(build.exchange1()) as plant:
        found = plant.run({"at": 0.5}, None, ["h", "v", "bounces", "late"], time, tolerance=1e-9)
        again = plant.run({"at": 0.5}, None, ["h"], time, tolerance=1e-9)
    first = np.sqrt(2.0 / 9.81)
    later = time[time > first] - first
    up = 0.7 * 9.81 * first
    expected = np.concatenate(
        (1.0 - 0.5 * 9.81 * time[time <= first] ** 2, up * later - 0.5 * 9.81 * later**2)
    )
    assert np.max(np.abs(found["h"] - expected)[time < first + 2.0 * up / 9.81]) < 1e-7
    assert np.array_equal(found["bounces"], 1.0 * (time > first) + (time > first + 2.0 * up / 9.81))
    assert np.array_equal(found["late"], 1.0 * (time >= 0.5))
    assert np.array_equal(again["h"], found["h"])
    assert found.units["h"] == "m"


def test_fmi1_says_why_it_cannot_be_instantiated() -> None:
    with Plant.open(build.exchange1("{other}")) as plant, pytest.raises(SimulationFailure) as caught:
        plant.run({}, None, ["y"], RAMP)
    assert caught.value.status is Status.LOAD_ERROR
    assert "The GUID {other} is wrong" in caught.value.reason
