"""Habits of tools: what `check` says of them, and that a batch copes."""

import time
import zipfile
from pathlib import Path

import numpy as np
import pytest
from fmu_sources.build import HABITS2, events2, habits2, library, write_fmu

from thsa_cosim.batch import Experiment, Job, LocalRunner, Outcome, Status, TimeIsOver
from thsa_cosim.check import Finding, Verdict, bench, budget, check_fmu, numerics
from thsa_cosim.check.trials import Trials
from thsa_cosim.cli import run_command
from thsa_cosim.errors import FmuError
from thsa_cosim.fmu import read_description
from thsa_cosim.fmu.probe import _what_differs, kinked_inputs, missing_binary
from thsa_cosim.signals import Signals

TIME = np.linspace(0.0, 1.0, 101)
STEP = Signals(TIME, {"u": np.ones(TIME.size)})


def lines(fmu: Path) -> dict[str, Finding]:
    return {finding.name: finding for finding in check_fmu(fmu, cycles=2).findings}


def test_one_instance_per_process_costs_processes_and_no_run() -> None:
    experiment = Experiment("step", habits2("ONCE"), STEP, ("y",), TIME, {})
    with LocalRunner([experiment], workers=1, backend="python") as runner:
        outcomes = runner.run([Job("step", {"gain": float(k)}) for k in range(5)])
        assert [o.reason for o in outcomes] == [""] * 5
        assert "only one instance per process" in runner.one_run_per_process
    last = [o.signals["y"][-1] for o in outcomes if o.signals is not None]
    np.testing.assert_allclose(last, np.arange(5.0) * (1.0 - np.exp(-10.0)), rtol=1e-9)


@pytest.mark.slow
def test_one_instance_per_process_is_said_and_is_no_failure() -> None:
    found = lines(habits2("ONCE"))
    assert found["fresh instance"].verdict is Verdict.WARNING
    assert "only one instance per process" in found["fresh instance"].text
    assert found["runs"].verdict is Verdict.OK
    assert Verdict.FAILED not in {f.verdict for f in found.values()}


@pytest.mark.parametrize(
    ("flags", "verdict", "text"),
    [
        ("", Verdict.NOT_TRIED, "takes steps of 0.01 s only, as it declares"),
        ('canHandleVariableCommunicationStepSize="true"', Verdict.WARNING, "declares steps of any size"),
    ],
)
def test_an_fmu_of_one_step_is_told_from_one_that_breaks_its_word(
    flags: str, verdict: Verdict, text: str
) -> None:
    found = lines(habits2("FIXED_STEP", flags=flags))
    assert found["communication step"].verdict is verdict
    assert text in found["communication step"].text
    assert "larger inputs" not in found  # what half a step would tell cannot be asked


def test_an_output_that_is_not_set_before_the_first_step_is_named() -> None:
    found = lines(habits2("FIRST_VALUE=-1e9"))
    assert "not set before the first step" in found["first values"].text
    assert "declared values" not in found


def test_parameters_that_start_elsewhere_than_declared_are_named() -> None:
    found = lines(habits2("OTHER_START"))
    assert "it starts with others" in found["declared values"].text
    assert "first values" not in found


def test_a_licence_that_is_lost_before_the_stop_time_fails(tmp_path: Path) -> None:
    """Two seconds run; the FMU says that it is meant for five."""
    xml = HABITS2.replace("{flags}", "").replace('stopTime="1"', 'stopTime="5"')
    path = write_fmu(tmp_path / "licence.fmu", xml, library("habits2.c", "LICENCE=2.0"), "habits2")
    found = lines(path)
    assert found["runs"].verdict is Verdict.FAILED
    assert "the licence was lost; with its inputs at rest it fails, too" in found["runs"].text


@pytest.mark.slow
def test_a_duration_that_nobody_declared_is_said(tmp_path: Path) -> None:
    xml = HABITS2.replace("{flags}", "").replace('stopTime="1" ', "")
    path = write_fmu(tmp_path / "endless.fmu", xml, library("habits2.c"), "habits2")
    assert "1 s in 100 steps (it declares no stop time: see --duration)" in lines(path)["runs"].text


def test_inputs_that_ask_too_much_are_told_from_an_fmu_that_fails() -> None:
    found = lines(habits2("NAN_ABOVE=0.5"))
    assert found["runs"].verdict is Verdict.WARNING
    assert "inputs at their start values" in found["runs"].text
    assert "say how far they run (--input NAME=VALUE)" in found["runs"].text


def test_a_jump_between_two_communication_points_is_no_error_of_the_step() -> None:
    found = lines(habits2("JUMPS"))
    assert found["communication step"].values["change"] < 0.05
    assert found["communication step"].verdict is not Verdict.FAILED


def test_an_fmu_that_steps_by_itself_is_no_failure_and_told_no_shorter_step() -> None:
    found = lines(habits2("OWN_STEP"))
    assert found["communication step"].verdict is Verdict.WARNING
    assert "it steps by itself, every 0.01 s" in found["communication step"].text
    assert "use that step" not in found["communication step"].text
    assert found["inputs"].verdict is Verdict.NOT_TRIED


@pytest.mark.slow
def test_a_slow_fmu_is_tried_over_its_begin(monkeypatch: pytest.MonkeyPatch) -> None:
    """100 steps take 0.5 s at least, where a run may take 0.2 s, or is killed."""
    monkeypatch.setattr(bench, "LONGEST_RUN", 0.2)
    slow = habits2("SLOW=5000")
    found = lines(slow)
    assert found["runs"].verdict is Verdict.WARNING
    assert "so what follows is tried over" in found["runs"].text
    report = check_fmu(slow, deadline_s=0.4, cycles=2)
    runs = next(f for f in report.findings if f.name == "runs")
    assert "; slow: 1 s of it takes" in runs.text
    assert "all of it more than 0.4 s (see --deadline); tried to" in runs.text
    assert runs.verdict is Verdict.WARNING


@pytest.mark.parametrize(("slowness", "verdict"), [(30_000, Verdict.WARNING), (30_000_000, Verdict.FAILED)])
def test_one_that_becomes_slow_is_told_from_one_that_hangs(
    slowness: int, verdict: Verdict, monkeypatch: pytest.MonkeyPatch
) -> None:
    """50 of 100 steps take 30 ms each, or the first of them never returns; the deadline is 1 s."""
    slow = habits2(f"SLOW={slowness}", "SLOW_FROM=0.495")
    monkeypatch.setattr(Trials, "lines", lambda *_: None)
    report = check_fmu(slow, deadline_s=1.0, cycles=1)
    runs = next(f for f in report.findings if f.name == "runs")
    assert runs.verdict is verdict
    assert ("all of it more than 1 s (see --deadline); tried to" in runs.text) is (verdict is Verdict.WARNING)


def test_the_time_limit_bounds_what_comes_before_the_first_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """A whole run takes 3 s where a run may take 0.6 s and the check 0.1 s: one run is made."""
    begun: list[str] = []
    run = LocalRunner.run

    def counted(self: LocalRunner, jobs: list[Job], *args: object) -> list[Outcome]:
        outcomes = run(self, jobs)
        begun.extend(job.experiment for job in jobs)
        return outcomes

    monkeypatch.setattr(LocalRunner, "run", counted)
    report = check_fmu(habits2("SLOW=30000"), deadline_s=0.6, limit_s=0.1, cycles=1)
    runs = next(f for f in report.findings if f.name == "runs")
    assert len(begun) <= 1
    assert runs.verdict is report.verdict is Verdict.WARNING
    assert "of 1 s: whether it is slow or hangs there was not tried (see --time-limit" in runs.text


def test_a_runner_begins_no_job_after_its_time() -> None:
    experiment = Experiment("step", habits2("SLOW=2000"), STEP, ("y",), TIME, {})
    jobs = [Job("step")] * 3
    with LocalRunner([experiment], backend="python", ends_at=time.monotonic() + 1e-3) as runner:
        while time.monotonic() <= runner._ends_at:
            time.sleep(1e-3)
        with pytest.raises(TimeIsOver) as none:
            runner.run(jobs)
        runner._ends_at = time.monotonic() + 0.05  # a run takes 0.2 s
        with pytest.raises(TimeIsOver) as some:
            runner.run(jobs)
    assert none.value.outcomes == ()
    assert [outcome.ok for outcome in some.value.outcomes] == [True]


def test_inputs_of_a_run_that_is_cut_are_cut_and_run_no_faster() -> None:
    description = read_description(habits2())
    whole, begin = kinked_inputs(description, TIME), kinked_inputs(description, TIME[:40], whole=TIME)
    assert whole is not None
    assert begin is not None
    np.testing.assert_array_equal(begin["u"], whole["u"][:40])
    assert np.ptp(begin["u"]) > 0.0


def test_a_parameter_that_is_declared_constant_is_read_and_not_set(tmp_path: Path) -> None:
    xml = HABITS2.replace("{flags}", "")
    at = xml.index('name="gain"')
    wrong = xml[:at] + xml[at:].replace('variability="fixed"', 'variability="constant"', 1)
    assert wrong != xml
    path = write_fmu(tmp_path / "constant.fmu", wrong, library("habits2.c"), "habits2")
    description = read_description(path)
    assert description.variables["gain"].start == read_description(habits2()).variables["gain"].start
    assert "gain" not in [v.name for v in description.parameters]
    found = lines(path)
    assert found["description"].verdict is Verdict.WARNING
    assert 'causality="parameter" and variability="constant"' in found["description"].text
    assert found["start values"].text == "each of 1 changes some output"


def test_where_a_description_lies_too_deep_is_said(tmp_path: Path) -> None:
    deeper = tmp_path / "deeper.fmu"
    with zipfile.ZipFile(habits2()) as source, zipfile.ZipFile(deeper, "w") as target:
        for name in source.namelist():
            target.writestr(f"Vendor/{name}", source.read(name))
    with pytest.raises(FmuError, match=r"it has Vendor/modelDescription\.xml"):
        read_description(deeper)


def test_backslashes_hide_no_library(tmp_path: Path) -> None:
    windows = tmp_path / "windows.fmu"
    with zipfile.ZipFile(habits2()) as source, zipfile.ZipFile(windows, "w") as target:
        for name in source.namelist():
            info = zipfile.ZipInfo("x")
            info.filename = name.replace("/", "\\")
            target.writestr(info, source.read(name))
    assert missing_binary(read_description(windows)) == ""


def test_an_fmu_that_ends_the_simulation_itself_is_tried_until_then() -> None:
    """The bouncing ball of events2.c terminates at its parameter ``end``."""
    report = check_fmu(events2(), values={"end": 0.5}, cycles=2)
    found = {finding.name: finding for finding in report.findings}
    assert found["runs"].verdict is Verdict.WARNING
    assert "it ends the simulation itself at t = 0.5 s of" in found["runs"].text
    assert found["fresh instance"].verdict is Verdict.OK


@pytest.mark.slow
def test_a_library_that_keeps_something_between_instances_is_tried_with_one_run_per_process() -> None:
    found = lines(habits2("KEEPS"))
    assert found["new process"].verdict is Verdict.OK
    assert found["fresh instance"].verdict is Verdict.WARNING
    assert "a second run in one process changes y by" in found["fresh instance"].text
    assert "a new process nothing: the library keeps something" in found["fresh instance"].text
    assert found["communication step"].values["change"] < 1e-3
    assert found["start values"].text == "each of 2 changes some output"
    assert found["memory over instances"].verdict is Verdict.NOT_TRIED


def test_a_check_ends_after_its_time_limit_and_names_what_it_left(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command(["check", str(habits2()), "--time-limit", "1e-6"]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert (
        "1e-06 s are over (--time-limit): not tried are inputs, fresh instance and communication step"
        in shown
    )
    assert "verdict: warning" in shown


def test_runs_that_hang_do_not_take_longer_than_a_line_may(monkeypatch: pytest.MonkeyPatch) -> None:
    """A clock that goes on by a deadline of 10 s with every run."""
    clock = iter(np.arange(0.0, 1e4, 10.0).tolist())
    monkeypatch.setattr(budget.time, "monotonic", lambda: next(clock))
    watch = budget.Watch(limit_s=1e9)
    assert len(list(watch.while_affordable(60))) <= 2 * budget.SECONDS / 10.0 + budget.LEAST
    monkeypatch.setattr(budget.time, "monotonic", lambda: 0.0)
    assert list(budget.Watch().while_affordable(60)) == list(range(60))


def test_changes_that_fall_with_the_step_are_told_from_those_that_do_not() -> None:
    """Runs whose error is proportional to their step, and runs that differ at random."""

    def runs(error: list[float]) -> list[tuple[float, Outcome]]:
        found = []
        for k, e in enumerate(error):
            time = np.linspace(0.0, 1.0, 10 * 2**k + 1)
            found.append((0.1 / 2**k, Outcome(Status.OK, signals=Signals(time, {"y": time * (1.0 + e)}))))
        return found

    judged = (Verdict.FAILED, "halving 0.2 s changes y by 4.0e-01 of its range", {"change": 0.4})
    converging = numerics.judge_shorter_steps(judged, runs([0.4, 0.2, 0.1, 0.05]))
    assert "it falls with the step, but halving 0.025 s still changes" in converging[1]
    random = numerics.judge_shorter_steps(judged, runs([0.0, 0.5, 0.0, 0.5]))
    assert "shorter steps change as much: no step is known to be right" in random[1]
    assert converging[0] is random[0] is Verdict.FAILED
    nobodys = numerics.judge_shorter_steps(judged, runs([0.4, 0.2, 0.1, 0.05]), nobodys=True)
    assert nobodys[0] is Verdict.WARNING
    assert "the FMU declares none; see --step" in nobodys[1]
    assert numerics.judge_shorter_steps(judged, runs([0.0, 0.5, 0.0, 0.5]), nobodys=True)[0] is Verdict.FAILED


def test_of_unknowns_that_are_expected_only_the_difference_is_said() -> None:
    expected = "ModelStructure/InitialUnknowns does not contain the expected set of variables."
    said = _what_differs(f"{expected} Expected {{a, b[1,2], c}} but was {{a, d}}.")
    assert said == f"{expected[:-1]}: it lacks b[1,2], c; it has too much d"
    assert _what_differs("another") == "another"
