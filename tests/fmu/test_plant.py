"""Plant: Co-Simulation against closed forms, compiled against Python, faults as failures."""

import threading
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from fmu_sources import build
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from thsa_cosim.errors import FmuError, ParameterError
from thsa_cosim.fmu import Plant, SimulationFailure, Status
from thsa_cosim.fmu.plan import Plan
from thsa_cosim.signals import FloatArray, Signals

TIME = np.linspace(0.0, 1.0, 101)
TAU, GAIN = 0.05, 2.0


def lag(times: FloatArray, u: FloatArray, tau: float, gain: float) -> FloatArray:
    """Exact response of tau x' = gain u - x, x(0) = 0, to u linear between samples."""
    x = np.zeros(len(times))
    for k, h in enumerate(np.diff(times)):
        slope = gain * (u[k + 1] - u[k]) / h
        particular = gain * u[k] - slope * tau
        x[k + 1] = (x[k] - particular) * np.exp(-h / tau) + particular + slope * h
    return x


def wave(time: FloatArray = TIME, held: bool = False) -> Signals:
    return Signals(time, {"u": np.sin(7.0 * time) + time}, {"u": "m/s"}, frozenset({"u"} if held else ()))


VALUES = {"tau": TAU, "k": GAIN}


@pytest.mark.parametrize("backend", ["compiled", "python"])
@pytest.mark.parametrize("fmu", [build.lag2, build.lag3])
def test_linear_inputs_are_exact_where_the_fmu_allows(fmu: Callable[[], Path], backend: str) -> None:
    inputs = wave()
    with Plant.open(fmu(), backend=backend) as plant:
        found = plant.run(VALUES, inputs, ["y", "feed"], TIME)
    assert np.max(np.abs(found["y"] - lag(TIME, inputs["u"], TAU, GAIN))) < 1e-13
    assert np.max(np.abs(found["feed"] - inputs["u"])) < 1e-14
    assert found["y"].dtype == np.float64
    assert found.units["y"] == ("m/s" if fmu is build.lag2 else "1")


@pytest.mark.parametrize("fmu", [build.lag2, build.lag3])
def test_other_fmus_get_the_mean_over_the_step_without_delay(fmu: Callable[..., Path]) -> None:
    option = {"interpolates": False} if fmu is build.lag2 else {"updates": False}
    errors = []
    for count in (101, 201):
        time = np.linspace(0.0, 1.0, count)
        inputs = wave(time)
        with Plant.open(fmu(**option)) as plant:
            found = plant.run(VALUES, inputs, ["y", "feed"], time)
        errors.append(np.max(np.abs(found["y"] - lag(time, inputs["u"], TAU, GAIN))))
        # Direct feed-through shows u(t_k) at t_k, not the mean.
        assert np.array_equal(found["feed"], inputs["u"])
    assert errors[0] < 6e-3
    # Second order in the step: half the step, a quarter of the error (first order would be a half).
    assert errors[1] < 0.3 * errors[0]


@pytest.mark.parametrize("interpolates", [True, False])
def test_held_inputs_are_held(interpolates: bool) -> None:
    inputs = wave(held=True)
    with Plant.open(build.lag2(interpolates=interpolates)) as plant:
        found = plant.run(VALUES, inputs, ["y", "feed"], TIME)
    x = np.zeros(len(TIME))
    for k, h in enumerate(np.diff(TIME)):
        x[k + 1] = (x[k] - GAIN * inputs["u"][k]) * np.exp(-h / TAU) + GAIN * inputs["u"][k]
    assert np.max(np.abs(found["y"] - x)) < 1e-13
    assert np.array_equal(found["feed"], inputs["u"])


def test_inputs_on_other_samples_are_interpolated_and_hold_outside() -> None:
    inputs = Signals(np.array([0.2, 0.6]), {"u": np.array([1.0, 3.0])}, {"u": "m/s"})
    with Plant.open(build.lag2()) as plant:
        found = plant.run({}, inputs, ["feed"], TIME)
    assert np.max(np.abs(found["feed"] - np.interp(TIME, [0.2, 0.6], [1.0, 3.0]))) < 1e-14


def test_first_row_is_the_state_after_initialisation_with_the_first_input() -> None:
    time = TIME + 3.0
    inputs = Signals(time, {"u": time.copy()}, {"u": "m/s"})
    with Plant.open(build.lag2()) as plant:
        found = plant.run({"y": 0.25}, inputs, ["y", "feed"], time)
    assert found["y"][0] == 0.25
    assert found["feed"][0] == 3.0
    assert found.time[0] == 3.0


def test_inputs_left_out_keep_their_start_value() -> None:
    with Plant.open(build.lag2()) as plant:
        found = plant.run({"u": 4.0, "tau": 0.01}, None, ["y", "u"], TIME)
    assert found["y"][-1] == pytest.approx(4.0)
    assert (found["u"] == 4.0).all()


@pytest.mark.parametrize("backend", ["compiled", "python"])
def test_whole_numbers_and_booleans(backend: str) -> None:
    switch = np.where(TIME < 0.5, 0.0, 1.0)
    inputs = Signals(
        TIME, {"u": np.full_like(TIME, 9.0), "offset": 1000.0 * switch, "invert": switch}, {"u": "m/s"}
    )
    with Plant.open(build.lag2(), backend=backend) as plant:
        found = plant.run({}, inputs, ["steps", "y", "above", "feed"], TIME)
    assert np.array_equal(found["steps"], np.arange(101) + 1000.0 * switch)
    assert np.array_equal(found["above"], (found["y"] > 0.5) != switch.astype(bool))
    assert found.names == ("steps", "y", "above", "feed")


def test_float32_and_int32_of_fmi3() -> None:
    inputs = Signals(TIME, {"single": TIME, "flag": np.round(TIME)}, {})
    with Plant.open(build.lag3()) as plant:
        found = plant.run({}, inputs, ["single", "flag", "count"], TIME)
    assert np.array_equal(found["single"], TIME.astype(np.float32).astype(np.float64))
    assert np.array_equal(found["flag"], np.round(TIME))


@st.composite
def experiments(draw: st.DrawFn) -> tuple[FloatArray, FloatArray, float, float]:
    steps = draw(st.lists(st.floats(1e-4, 0.3), min_size=1, max_size=30))
    time = np.concatenate(([0.0], np.cumsum(steps)))
    u = np.array(draw(st.lists(st.floats(-1e3, 1e3), min_size=len(time), max_size=len(time))))
    return time, u, draw(st.floats(1e-2, 10.0)), draw(st.floats(-5.0, 5.0))


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(experiment=experiments(), held=st.booleans())
def test_compiled_equals_python_bit_for_bit(
    plants: list[tuple[Plant, Plant]], experiment: tuple[FloatArray, FloatArray, float, float], held: bool
) -> None:
    time, u, tau, gain = experiment
    inputs = Signals(time, {"u": u}, {}, frozenset({"u"} if held else ()))
    for fast, slow in plants:
        a, b = (p.run({"tau": tau, "k": gain}, inputs, ["y", "feed"], time) for p in (fast, slow))
        assert a["y"].tobytes() == b["y"].tobytes()
        assert a["feed"].tobytes() == b["feed"].tobytes()


@pytest.fixture(scope="module")
def plants() -> object:
    fmus = [
        build.lag2(),
        build.lag2(interpolates=False),
        build.lag3(),
        build.lag3(updates=False),
    ]
    pairs = [(Plant.open(f, backend="compiled"), Plant.open(f, backend="python")) for f in fmus]
    yield pairs
    for pair in pairs:
        for plant in pair:
            plant.close()


def test_runs_repeat_bit_for_bit_fresh_and_after_reset() -> None:
    inputs = wave()
    with Plant.open(build.lag2()) as fresh, Plant.open(build.lag2(), reuse="reset") as reset:
        first = fresh.run(VALUES, inputs, ["y"], TIME)["y"].tobytes()
        fresh.run({"tau": 3.0, "y": 7.0}, inputs, ["y"], TIME)
        assert fresh.run(VALUES, inputs, ["y"], TIME)["y"].tobytes() == first
        for _ in range(3):
            assert reset.run(VALUES, inputs, ["y"], TIME)["y"].tobytes() == first
            reset.run({"tau": 3.0, "y": 7.0}, inputs, ["y"], TIME)


def test_a_wrong_reset_shows_only_when_reset_is_used() -> None:
    inputs = wave()
    fmu = build.lag2("WRONG_RESET")
    with Plant.open(fmu) as fresh, Plant.open(fmu, reuse="reset") as reset:
        for plant, same in ((fresh, True), (reset, False)):
            a, b = (plant.run(VALUES, inputs, ["y"], TIME)["y"] for _ in range(2))
            assert np.array_equal(a, b) is same


def test_close_removes_the_folder() -> None:
    plant = Plant.open(build.lag2())
    folder = plant.folder
    assert folder.is_dir()
    plant.close()
    assert not folder.exists()
    plant.close()


FAILURES = {
    "error": (Status.FMI_ERROR, r"fmi2DoStep returned fmi2Error at t = 0\.5 s: solver failed with 42 in lag"),
    "fatal": (Status.FMI_FATAL, r"fmi2DoStep returned fmi2Fatal at t = 0\.5 s"),
    "discard": (Status.FMI_DISCARD, r"fmi2DoStep returned fmi2Discard at t = 0\.5 s: step refused"),
    "pending": (Status.FMI_ERROR, r"fmi2DoStep returned fmi2Pending"),
    "nan": (Status.NOT_FINITE, r"y became nan at t = 0\.51 s"),
    "inf": (Status.NOT_FINITE, r"y became inf at t = 0\.51 s"),
    "short": (Status.INCOMPLETE, r"ended the simulation at t = 0\.5 s of 1 s"),
    "init_error": (Status.FMI_ERROR, r"fmi2EnterInitializationMode returned fmi2Error"),
    "term_error": (Status.FMI_ERROR, r"fmi2Terminate returned fmi2Error"),
}


@pytest.mark.parametrize("backend", ["compiled", "python"])
@pytest.mark.parametrize("fault", FAILURES)
def test_failures_have_status_and_reason_and_the_plant_lives_on(fault: str, backend: str) -> None:
    status, says = FAILURES[fault]
    with Plant.open(build.lag2(), backend=backend) as plant:
        good = plant.run(VALUES, wave(), ["y"], TIME)["y"]
        with pytest.raises(SimulationFailure, match=says) as caught:
            plant.run({"fault": build.FAULTS[fault]}, wave(), ["y"], TIME)
        assert caught.value.status is status
        assert plant.is_dead is (fault == "fatal")
        if fault != "fatal":
            assert np.array_equal(plant.run(VALUES, wave(), ["y"], TIME)["y"], good)


@pytest.mark.parametrize("backend", ["compiled", "python"])
def test_fmi3_discard_terminate_and_short_steps(backend: str) -> None:
    with Plant.open(build.lag3(), backend=backend) as plant:
        for values, status, says in (
            ({"fault": 1}, Status.FMI_DISCARD, "fmi3DoStep returned fmi3Discard at t = 0 s"),
            ({"fault": 2}, Status.INCOMPLETE, "did less than the communication step"),
            ({"stop_at": 0.5}, Status.INCOMPLETE, "ended the simulation"),
        ):
            with pytest.raises(SimulationFailure, match=says) as caught:
                plant.run(values, None, ["y"], TIME)
            assert caught.value.status is status


@pytest.mark.parametrize("backend", ["compiled", "python"])
def test_a_step_that_is_done_in_parts_is_gone_on_with(backend: str) -> None:
    """fmi2Discard with the last successful time, in every step; the inputs are those of the whole step."""
    with (
        Plant.open(build.habits2(), backend=backend) as whole,
        Plant.open(build.habits2("PARTS"), backend=backend) as parts,
    ):
        wanted = whole.run({"tau": TAU}, wave(), ["y"], TIME)["y"]
        found = parts.run({"tau": TAU}, wave(), ["y"], TIME)["y"]
    np.testing.assert_allclose(found, wanted, rtol=1e-12, atol=1e-14)


def test_wrong_guid_is_a_load_error_with_the_fmus_own_words() -> None:
    with (
        Plant.open(build.lag2(guid="{other}")) as plant,
        pytest.raises(SimulationFailure, match=r"NULL: wrong GUID \{other\}") as caught,
    ):
        plant.run({}, None, ["y"], TIME)
    assert caught.value.status is Status.LOAD_ERROR


def test_missing_platform_and_unloadable_library(tmp_path: Path) -> None:
    xml = build.LAG2.format(guid="{lag}", interpolates="true")
    library = tmp_path / "broken.so"
    library.write_bytes(b"\x7fELF not really")
    for fmu, says in (
        (
            build.write_fmu(tmp_path / "a.fmu", xml, build.library("lag2.c"), "other"),
            "has no library lag2.so",
        ),
        (build.write_fmu(tmp_path / "b.fmu", xml, library, "lag2"), "cannot be loaded"),
        (
            build.write_fmu(tmp_path / "c.fmu", xml, build.library("lag1.c"), "lag2"),
            "does not export the function",
        ),
    ):
        with Plant.open(fmu) as plant, pytest.raises(SimulationFailure, match=says) as caught:
            plant.run({}, None, ["y"], TIME)
        assert caught.value.status is Status.LOAD_ERROR


def test_misuse_is_an_input_error() -> None:
    with Plant.open(build.lag2()) as plant:
        for arguments, says in (
            (({"tua": 1.0}, None, ["y"], TIME), "Did you mean 'tau'"),
            (({}, None, ["yy"], TIME), "no variable 'yy'"),
            (({}, Signals(TIME, {"y": TIME}), ["y"], TIME), "y is no input but a output"),
            (({}, None, ["y"], TIME[::-1]), "strictly increasing"),
            (({"der(y)": 1.0}, None, ["y"], np.array([np.nan])), "finite"),
        ):
            with pytest.raises((FmuError, ParameterError), match=says):
                plant.run(*arguments)
    with Plant.open(build.lag3()) as plant, pytest.raises(ParameterError, match="vector is an array"):
        plant.run({"vector": 1.0}, None, ["y"], TIME)
    with pytest.raises(FmuError, match="does not support model-exchange"):
        Plant.open(build.lag1(), kind="model-exchange")


def test_messages_reach_the_listener_formatted() -> None:
    lines: list[str] = []
    with (
        Plant.open(build.lag2(), on_message=lines.append) as plant,
        pytest.raises(SimulationFailure),
    ):
        plant.run({"fault": build.FAULTS["error"]}, None, ["y"], TIME)
    assert lines == ["[Error] logStatusError: solver failed with 42 in lag\n"]


def test_fmi1_co_simulation_through_fmpy() -> None:
    time = np.linspace(0.0, 1.0, 201)
    inputs = wave(time)
    with Plant.open(build.lag1()) as plant:
        found = plant.run({"tau": TAU}, inputs, ["y", "u", "steps"], time)
        assert np.array_equal(found["u"], inputs["u"])
        assert np.max(np.abs(found["y"] - lag(time, inputs["u"], TAU, 1.0))) < 1e-3
        assert np.array_equal(found["steps"], np.arange(201.0))
        again = plant.run({"tau": TAU}, inputs, ["y"], time)
        assert np.array_equal(again["y"], found["y"])
        with pytest.raises(SimulationFailure) as caught:
            plant.run({}, Signals(time, {"u": 2e3 * time}), ["y"], time)
        assert caught.value.status is Status.FMI_DISCARD


def test_uneven_steps() -> None:
    time = np.array([0.0, 0.1, 0.11, 0.5, 0.50001, 1.0])
    inputs = wave(time)
    with Plant.open(build.lag2()) as plant:
        found = plant.run(VALUES, inputs, ["y"], time)
    assert np.max(np.abs(found["y"] - lag(time, inputs["u"], TAU, GAIN))) < 1e-13
    assert np.array_equal(found.time, time)


def test_single_time_gives_the_initial_values() -> None:
    with Plant.open(build.lag2()) as plant:
        found = plant.run({"y": 0.5}, None, ["y"], np.array([2.0]))
    assert found["y"].tolist() == [0.5]


def test_the_loop_releases_the_gil() -> None:
    ticks = []
    stop = threading.Event()

    def tick() -> None:
        while not stop.wait(0.01):
            ticks.append(1)

    thread = threading.Thread(target=tick)
    with Plant.open(build.lag2()) as plant:
        plant.run({}, None, ["y"], np.linspace(0.0, 1.0, 11))
        thread.start()
        plant.run({"fault": build.FAULTS["slow"], "at": 0.0}, None, ["y"], np.linspace(0.0, 0.4, 5))
        stop.set()
        thread.join()
    assert len(ticks) > 10


def test_an_fmu_that_overwrites_the_communication_points_is_blamed_for_it() -> None:
    with Plant.open(build.lag2()) as plant:
        instance = plant._new_instance()
        plan = Plan(instance, None, ("y",), np.linspace(0.0, 1.0, 11))
        assert plan.recorded({"y": np.zeros(11)}).names == ("y",)
        spoilt = SimpleNamespace(grid=SimpleNamespace(times=np.zeros(11)), units={})
        with pytest.raises(SimulationFailure, match="overwritten memory that is not its own") as caught:
            Plan.recorded(spoilt, {"y": np.zeros(11)})  # type: ignore[arg-type]
    assert caught.value.status is Status.CRASH
