"""How inputs reach an FMU: what is right is found by trial, not believed."""

import os
from pathlib import Path

import numpy as np
import pytest
from fmu_sources import build

from tests.fmu.test_plant import lag
from thsa_cosim.batch import Experiment, Job, LocalRunner, Runner
from thsa_cosim.batch.handling import largest_change, try_input_handling
from thsa_cosim.batch.own_step import moves_within, own_step
from thsa_cosim.batch.repetition import try_repetition
from thsa_cosim.errors import ParameterError
from thsa_cosim.fmu import Plant, read_description
from thsa_cosim.scenario.executor import Executor
from thsa_cosim.scenario.handling import settle, settle_handling
from thsa_cosim.scenario.model import SimulationTable
from thsa_cosim.signals import Signals

TIME = np.linspace(0.0, 1.0, 201)
KINKS = np.interp(TIME, [0.0, 0.2, 0.4, 0.7, 1.0], [0.0, 1.0, 1.0, -0.5, 0.2])


def experiment(*defines: str, tool: str = "vendor") -> Experiment:
    return Experiment("x", build.lag2(*defines, tool=tool), Signals(TIME, {"u": KINKS}), ("y",), TIME)


@pytest.mark.parametrize("kind", ["co-simulation", "model-exchange"])
def test_start_values_survive_a_tool_that_resets_them_in_setup(kind: str) -> None:
    with Plant.open(build.lag2("RESET_IN_SETUP"), kind=kind) as plant:  # type: ignore[arg-type]
        found = plant.run({"tau": 0.3}, Signals(TIME, {"u": KINKS}), ["y"], TIME, tolerance=1e-9)["y"]
    assert np.max(np.abs(found - lag(TIME, KINKS, 0.3, 1.0))) < 1e-6


def test_derivatives_that_are_declared_but_wrong_are_not_used() -> None:
    """Exact where they are right; 0.3 of the signal off after each kink where they are wrong."""
    right, wrong = try_input_handling(experiment()), try_input_handling(experiment("WRONG_SLOPE"))
    assert right.best is not None
    assert wrong.best is not None
    assert right.best.mode == "derivative"
    assert wrong.best.mode == "mean"
    errors = {way.mode: way.error for way in wrong.ways}
    assert errors["derivative"] > 0.3
    assert errors["mean"] < 2e-3 < errors["hold"]
    assert "against Model Exchange" in wrong.sentence()
    assert f"{errors['derivative']:.1e}" in wrong.sentence()


def test_a_foreign_fmu_is_tried_ours_is_trusted_and_a_key_fixes_it() -> None:
    foreign, ours = experiment("WRONG_SLOPE"), experiment(tool="thsa-cosim tests")
    assert settle_handling(SimulationTable(), [ours]).modes == (None,)
    settled = settle_handling(SimulationTable(), [foreign, foreign])
    assert settled.modes == ("mean", "mean")
    assert "WARNING" not in settled.notes[0]
    fixed = settle_handling(SimulationTable(inputs="derivative"), [foreign])
    assert fixed.modes == ("derivative",)
    assert "WARNING: y of this Co-Simulation is" in fixed.notes[0]
    with LocalRunner([foreign], backend="python") as runner:
        assert runner.run([Job("x")])[0].ok


@pytest.mark.parametrize(("habit", "found"), [("KEEPS", True), ("FIRST_WINS", True), ("EULER", False)])
def test_what_a_library_keeps_between_instances_is_found(habit: str, found: bool) -> None:
    step = Experiment("x", build.habits2(habit), Signals(TIME, {"u": np.ones(201)}), ("y",), TIME)
    repetition = try_repetition(step, backend="python")
    assert repetition.first.ok
    assert ("changes y" in repetition.fault) is found
    assert repetition.limits == ({"recycle_runs": 1} if found else {})


@pytest.mark.slow
def test_a_study_gives_each_run_a_process_where_a_second_instance_is_wrong() -> None:
    """Every instance has the parameters of the first one in its process."""
    flags = 'canBeInstantiatedOnlyOncePerProcess="true" canHandleVariableCommunicationStepSize="true"'
    fmu = build.habits2("FIRST_WINS", flags=flags)
    step = Experiment("x", fmu, Signals(TIME, {"u": np.ones(201)}), ("y",), TIME)
    jobs = [Job("x", {"tau": tau}) for tau in (0.1, 0.2, 0.4)]
    exact = [1.0 - np.exp(-TIME / tau) for tau in (0.1, 0.2, 0.4)]

    def worst(runner: Runner) -> float:
        with runner:
            found = [outcome.signals for outcome in runner.run(jobs)]
        return max(
            float(np.max(np.abs(s["y"] - y))) for s, y in zip(found, exact, strict=True) if s is not None
        )

    guarded = Executor().open_runner(SimulationTable(), [step])
    assert [
        n
        for n in guarded.notes
        if "keeps something in its process: a second run in one process changes y" in n
    ]
    assert worst(guarded) < 1e-9
    assert worst(LocalRunner([step], backend="python")) > 0.01


def test_an_fmu_that_repeats_itself_keeps_its_process() -> None:
    settled = settle(SimulationTable(), [experiment()])
    assert not settled.limits
    assert not any("process" in note for note in settled.notes)


def test_a_way_that_the_fmu_does_not_offer_is_refused() -> None:
    with Plant.open(build.lag2(interpolates=False)) as plant:
        plant.input_mode = "derivative"
        with pytest.raises(ParameterError, match="choose one of hold, mean"):
            plant.run({}, Signals(TIME, {"u": KINKS}), ["y"], TIME)


def test_a_signal_that_is_zero_but_for_rounding_is_no_alarm() -> None:
    base = {"a": np.sin(TIME), "b": 1e-14 * np.cos(50.0 * TIME), "c": 5.0 + 1e-13 * np.sin(TIME)}
    found = {"a": base["a"] + 1e-5, "b": -base["b"], "c": base["c"][::-1]}
    change, worst = largest_change(base, found)
    assert worst == "a"
    assert change == pytest.approx(1e-5 / np.ptp(base["a"]))


@pytest.mark.slow
def test_a_drive_exported_by_dymola() -> None:
    """Set TUTORIAL_FMUS to a check-out of https://github.com/modelica/fmi-beginners-tutorial-2025."""
    path = Path(os.environ.get("TUTORIAL_FMUS", "")) / "part2" / "Drive.fmu"
    if not path.is_file():
        pytest.skip("TUTORIAL_FMUS names no check-out of the tutorial")
    time = np.linspace(0.0, 2.0, 2001)
    inputs = {
        "V": np.interp(time, [0.0, 0.1, 0.4, 0.9, 1.3, 1.6, 2.0], [0.0, 0.0, 100.0, 100.0, 30.0, 60.0, 60.0]),
        "LoadTorque_Nm": np.interp(time, [0.0, 1.0, 1.1, 1.7, 2.0], [0.0, 0.0, 2.0, 2.0, 0.0]),
    }
    trial = try_input_handling(Experiment("x", path, Signals(time, inputs), ("w",), time))
    assert trial.reference == "Model Exchange"
    errors = {way.mode: way.error for way in trial.ways}
    assert trial.best is not None
    assert trial.best.mode == "mean"
    assert errors["mean"] < 1e-4
    assert errors["derivative"] > 1e-2


def test_an_fmu_that_steps_by_itself_is_compared_with_no_shorter_step() -> None:
    """Between two of its own steps it shows the later one."""
    coarse = np.linspace(0.0, 1.0, 101)
    wave = Signals(coarse, {"u": np.sin(9.0 * coarse)})
    trial = try_input_handling(Experiment("own", build.habits2("OWN_STEP"), wave, ("y",), coarse))
    assert trial.best is None
    assert trial.sentence().startswith("it steps by itself, every 0.01 s")
    assert "simulation.step" not in trial.sentence()
    dense = np.linspace(0.0, 1.0, 501)
    trial = try_input_handling(Experiment("own", build.habits2("OWN_STEP"), wave, ("y",), dense))
    assert trial.sentence().endswith("set simulation.step = 0.01")
    plain = try_input_handling(Experiment("plain", build.habits2(), wave, ("y",), coarse))
    assert plain.best is not None
    assert plain.best.mode == "mean"


def test_inputs_that_are_held_are_no_step_of_the_fmus_own() -> None:
    fmu = read_description(build.habits2())
    assert moves_within(fmu, None)
    assert moves_within(fmu, Signals(TIME, {"u": TIME}))
    assert not moves_within(fmu, Signals(TIME, {"u": TIME}, {}, frozenset({"u"})))
    stairs = np.repeat(np.arange(20.0), 4)
    time = np.arange(80.0)
    assert own_step(time, {"a": stairs}) == 4.0
    assert own_step(time, {"a": stairs, "b": time}) is None
    assert own_step(time, {"a": 0.0 * time}) is None


@pytest.mark.parametrize("late", [-3, -1, 1, 3])
def test_a_jump_may_come_a_little_earlier_or_later(late: int) -> None:
    time = np.linspace(0.0, 10.0, 1001)
    wanted = {"y": 0.1 * time + (time >= 5.0)}
    found = {"y": 0.1 * time + (time >= 5.0 + 0.01 * late - 1e-9)}
    assert largest_change(wanted, found)[0] > 0.4
    assert largest_change(wanted, found, jumps=True)[0] < 0.01
    much_later = {"y": 0.1 * time + (time >= 5.2)}
    assert largest_change(wanted, much_later, jumps=True)[0] > 0.4
    higher = {"y": wanted["y"] + 0.2 * (time >= 5.0)}
    assert largest_change(wanted, higher, jumps=True)[0] > 0.09


def test_a_signal_that_switches_all_the_time_is_compared_by_its_integral() -> None:
    beat = np.arange(1001) % 5
    wanted = {"y": (beat < 2) * 1.0}
    shifted = {"y": np.roll(wanted["y"], 1)}
    assert largest_change(wanted, shifted)[0] == 1.0
    assert largest_change(wanted, shifted, jumps=True)[0] < 0.005
    assert largest_change(wanted, {"y": (beat < 3) * 1.0}, jumps=True)[0] > 0.3
