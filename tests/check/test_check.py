"""`check_fmu` against FMUs that are right, wrong in one known way each, or that take their process down."""

import json
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from fmu_sources.build import FAULTS, LAG2, events2, lag2, library, write_fmu

from thsa_cosim.batch import Outcome, Status
from thsa_cosim.check import CheckReport, Excitation, Finding, Verdict, check_fmu, numerics
from thsa_cosim.errors import FmuError, ParameterError
from thsa_cosim.fmu import probe, read_description
from thsa_cosim.fmu.sources import compile_sources
from thsa_cosim.signals import Signals

FMUS = Path(__file__).parents[2] / "fmus"

CARELESS = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Careless" guid="{careless}" generationTool="thsa-cosim tests">
 <CoSimulation modelIdentifier="careless2" canHandleVariableCommunicationStepSize="true"/>
 <DefaultExperiment startTime="0" stopTime="1" stepSize="0.01"/>
 <ModelVariables>
  <ScalarVariable name="tau" valueReference="1" causality="parameter" variability="fixed" initial="exact">
    <Real start="0.5" min="0.1"/></ScalarVariable>
  <ScalarVariable name="y" valueReference="2" causality="output" variability="continuous" initial="exact">
    <Real start="1"/></ScalarVariable>
 </ModelVariables>
 <ModelStructure><Outputs><Unknown index="2"/></Outputs></ModelStructure>
</fmiModelDescription>
"""
RIGHT = {
    "description": Verdict.OK,
    "platform": Verdict.OK,
    "demands": Verdict.OK,
    "inputs": Verdict.OK,
    "runs": Verdict.OK,
    "new process": Verdict.OK,
    "fresh instance": Verdict.OK,
    "reset": Verdict.OK,
    "reset of start values": Verdict.OK,
    "communication step": Verdict.OK,
    "longer step": Verdict.OK,
    "start values": Verdict.OK,
    "model exchange": Verdict.NOT_TRIED,
    "memory over instances": Verdict.OK,
    "file handles over instances": Verdict.OK,
    "memory over resets": Verdict.OK,
    "file handles over resets": Verdict.OK,
}
Build = Callable[..., Path]


@pytest.fixture(scope="module")
def build(tmp_path_factory: pytest.TempPathFactory) -> Build:
    folder = tmp_path_factory.mktemp("check")

    def careless(*flags: str) -> Path:
        path = folder / f"careless_{'_'.join(flags)}.fmu"
        if not path.exists():
            write_fmu(path, CARELESS, library("careless2.c", *flags), "careless2")
        return path

    return careless


def verdicts(report: CheckReport) -> dict[str, Verdict]:
    return {finding.name: finding.verdict for finding in report.findings}


def line(report: CheckReport, name: str) -> Finding:
    return next(finding for finding in report.findings if finding.name == name)


def test_a_right_fmu_passes_every_trial_and_says_what_it_is(build: Build) -> None:
    seen: list[Finding] = []
    report = check_fmu(build(), cycles=20, on_finding=seen.append)
    assert verdicts(report) == RIGHT
    assert tuple(seen) == report.findings
    assert report.verdict is Verdict.OK
    assert report.reuse == "reset"
    as_json = json.loads(json.dumps(report.to_dict()))
    assert as_json["facts"]["fmi_version"] == "2.0"
    assert as_json["facts"]["tool"] == "thsa-cosim tests"
    assert as_json["facts"]["variables"] == {
        "input": [],
        "output": ["y"],
        "parameter": ["tau"],
        "tunable parameter": [],
    }
    assert as_json["findings"][0]["verdict"] == "ok"
    assert len(as_json["fmu"]["sha256"]) == 64


@pytest.mark.parametrize(
    ("flag", "wrong", "verdict"),
    [
        ("EULER", {"communication step"}, Verdict.WARNING),
        ("KEEPS_VALUES", {"reset of start values"}, Verdict.WARNING),
        (
            "SHARED",
            {"fresh instance", "communication step", "reset", "reset of start values"},
            Verdict.FAILED,
        ),
        ("PER_PROCESS", None, Verdict.FAILED),
        ("LEAKS", {"memory over instances"}, Verdict.WARNING),
        ("HANDLES", {"file handles over instances"}, Verdict.WARNING),
    ],
)
def test_each_broken_promise_shows_in_its_line_alone(
    build: Build, flag: str, wrong: set[str] | None, verdict: Verdict
) -> None:
    report = check_fmu(build(flag), cycles=20)
    found = {name for name, v in verdicts(report).items() if v is not RIGHT[name]}
    if wrong is None:  # every comparison is with a run of another process, except the leaks
        assert "new process" in found
        assert not any(name.startswith(("memory", "file")) for name in found)
    else:
        assert found == wrong
    assert report.verdict is verdict
    assert report.reuse == ("reset" if not any(n.startswith("reset") for n in found) else "fresh")


def test_change_by_the_communication_step_is_the_one_of_forward_euler(build: Build) -> None:
    report = check_fmu(build("EULER"), cycles=2)
    n = np.arange(101)
    coarse, fine = (1.0 - 0.01 / 0.5) ** n, (1.0 - 0.005 / 0.5) ** (2 * n)
    expected = np.abs(coarse - fine).max() / np.ptp(coarse)
    assert line(report, "communication step").values["change"] == pytest.approx(expected, rel=1e-6)


def test_leaks_are_measured(build: Build) -> None:
    leak = line(check_fmu(build("LEAKS"), cycles=30), "memory over instances")
    assert leak.values["growth_bytes_per_run"] == pytest.approx(2**16, rel=0.2)
    handles = line(check_fmu(build("HANDLES"), cycles=30), "file handles over instances")
    assert handles.values["left_open"] == 29


@pytest.mark.parametrize("fault", ["segfault", "exit", "error", "nan", "hang"])
def test_an_fmu_that_dies_or_hangs_costs_lines_not_the_report(fault: str) -> None:
    report = check_fmu(lag2(), values={"fault": FAULTS[fault]}, deadline_s=2.0, cycles=5)
    assert line(report, "runs").verdict is Verdict.FAILED
    assert report.verdict is Verdict.FAILED
    assert line(report, "reset").verdict is Verdict.NOT_TRIED
    status = {"segfault": "crash", "hang": "timeout", "nan": "not-finite", "error": "fmi-error"}.get(
        fault, fault
    )
    assert line(report, "runs").text.startswith(status)


def test_wrong_reset_is_found_and_both_interfaces_compared() -> None:
    report = check_fmu(lag2("WRONG_RESET"), cycles=5)
    assert "ramping" in line(report, "runs").text
    assert line(report, "reset").verdict is Verdict.FAILED
    assert line(report, "model exchange").verdict is Verdict.OK
    assert line(report, "inputs").text.startswith("linear within a step, exactly")
    assert report.reuse == "fresh"
    assert report.verdict is Verdict.WARNING
    assert "nothing changes with fault, at" in line(report, "start values").text


def test_a_balance_that_is_zero_but_for_the_solvers_errors_is_not_compared() -> None:
    time = np.linspace(0.0, 1.0, 11)
    first = Signals(time, {"v": time, "residual": 1e-6 * np.sin(9.0 * time)})
    exchange = Outcome(Status.OK, "", Signals(time, {"v": time * (1 + 1e-5), "residual": 1e-4 * time}))
    tight = Signals(time, {"v": time, "residual": 1e-8 * time})
    assert numerics.judge_exchange(first, exchange)[0] is Verdict.WARNING
    assert numerics.shrinking(first, tight) == {"residual"}
    verdict, text, _ = numerics.judge_exchange(first, exchange, ("residual",))
    assert verdict is Verdict.OK
    assert text.endswith("residual not compared: zero but for the solver's errors")
    # One that is small for itself stays as small.
    assert numerics.shrinking(first, first) == set()


def test_a_part_that_sticks_is_less_than_the_tolerance_of_one_that_moves() -> None:
    time = np.linspace(0.0, 1.0, 11)
    units = {"w_A": "rad/s", "w_B": "rad/s", "x": "m"}
    signals = Signals(
        time, {"w_A": 300.0 * time, "w_B": 4e-5 * time, "x": 4e-5 * time, "no unit": 1e-9 * time}, units
    )
    assert numerics.below(signals, 1e-6) == {"w_B"}
    assert numerics.below(signals, 1e-7) == set()


def test_a_parameter_is_idle_only_if_none_of_the_values_of_a_search_shows() -> None:
    """The fault at 2 s comes after the end; one at 0.5 s does not."""
    given = {"duration": 1.0, "parameters": ("kick",), "values": {"dv": 1.0}}
    late = check_fmu(events2(), excitation=Excitation(**given, alternatives={"kick": (2.0,)}), cycles=1)
    assert line(late, "start values").verdict is Verdict.WARNING
    found = check_fmu(events2(), excitation=Excitation(**given, alternatives={"kick": (2.0, 0.5)}), cycles=1)
    assert line(found, "start values").text == "each of 1 changes some output"


def test_derivatives_that_are_wrong_show_with_their_figure() -> None:
    report = check_fmu(lag2("WRONG_SLOPE", tool="vendor"), cycles=2)
    assert line(report, "inputs").verdict is Verdict.OK
    assert line(report, "inputs").text.startswith("held at the mean of a step")
    assert line(report, "inputs").values["error_derivative"] > 0.2
    assert line(report, "model exchange").verdict is Verdict.OK
    assert line(report, "larger inputs").verdict is Verdict.OK


def test_nothing_that_moves_earns_no_reset(build: Build) -> None:
    """tau alone says how fast y falls from 1; from 0 it stays there."""
    report = check_fmu(build("AT_REST"), cycles=2)
    assert line(report, "runs").verdict is Verdict.WARNING
    assert line(report, "reset").verdict is Verdict.OK
    assert line(report, "start values").verdict is Verdict.WARNING
    assert "are ignored" in line(report, "start values").text
    assert report.reuse == "fresh"


def test_a_long_experiment_is_run_to_its_end(build: Build) -> None:
    """20,000 steps are declared; a multiple of the step reaches the stop time."""
    path = write_fmu(
        build("EULER").with_name("long.fmu"),
        CARELESS.replace('stopTime="1" stepSize="0.01"', 'stopTime="20" stepSize="0.001"'),
        library("careless2.c"),
        "careless2",
    )
    report = check_fmu(path, cycles=2)
    assert "20 s in 2000 steps" in line(report, "runs").text
    given = Excitation(duration=0.5, step=0.002, values={"tau": 0.7})
    assert "0.5 s in 250 steps" in line(check_fmu(path, excitation=given, cycles=2), "runs").text


def test_a_step_that_is_too_long_without_an_error_is_seen(build: Build) -> None:
    """Forward Euler is stable up to 2 tau."""
    given = Excitation(step=0.08, duration=8.0, values={"tau": 0.0500001})
    report = check_fmu(build("EULER"), excitation=given, cycles=2)
    assert line(report, "communication step").verdict is Verdict.FAILED
    assert line(report, "longer step").verdict is Verdict.WARNING
    assert "without an error" in line(report, "longer step").text
    assert report.verdict is Verdict.FAILED


def test_where_a_step_is_too_long_shorter_ones_are_tried(build: Build) -> None:
    """Forward Euler of exp(-t/tau), tau = 0.5 s, unstable above 1 s: what half a step changes has a closed form."""

    def change(h: float) -> float:
        n = np.arange(round(12.0 / h) + 1)
        coarse, fine = (1.0 - h / 0.5) ** n, (1.0 - 0.5 * h / 0.5) ** (2 * n)
        return float(np.abs(coarse - fine).max() / np.ptp(coarse))

    def found(step: float) -> Finding:
        report = check_fmu(build("EULER"), excitation=Excitation(step=step, duration=12.0), cycles=2)
        return line(report, "communication step")

    assert change(0.08) > numerics.STEP_WARNING > change(0.04)
    usable = found(0.08)
    assert usable.verdict is Verdict.WARNING
    assert usable.text.endswith(f"; halving 0.04 s changes {change(0.04):.1e}: use that step")
    assert usable.values["usable_step_s"] == pytest.approx(0.04)
    assert change(1.2 / 16) > numerics.STEP_WARNING, "the shortest one tried"
    unstable = found(1.2)
    assert unstable.verdict is Verdict.FAILED
    assert unstable.text.endswith(f"halving 0.075 s still changes {change(0.075):.1e}: use a shorter one")


def test_where_co_simulation_fails_model_exchange_is_tried() -> None:
    report = check_fmu(lag2("NO_STEPS", tool="vendor"), cycles=2)
    assert line(report, "runs").verdict is Verdict.WARNING
    assert 'set interface = "model-exchange"' in line(report, "runs").text
    assert report.verdict is Verdict.WARNING


def test_an_unknown_name_is_refused() -> None:
    with pytest.raises(FmuError, match="Did you mean 'tau'"):
        check_fmu(lag2(), values={"taU": 1.0})
    with pytest.raises(ParameterError, match="those are u"):
        check_fmu(lag2(), excitation=Excitation(ends={"tau": 1.0}))


def test_missing_binary_is_named(tmp_path: Path) -> None:
    path = tmp_path / "lag.fmu"
    with zipfile.ZipFile(lag2()) as right, zipfile.ZipFile(path, "w") as wrong:
        for name in right.namelist():
            wrong.writestr(name.replace("linux64", "solaris64"), right.read(name))
    report = check_fmu(path)
    assert line(report, "platform").verdict is Verdict.FAILED
    assert "solaris64" in line(report, "platform").text
    assert line(report, "runs").verdict is Verdict.FAILED


def test_c_sources_are_built_on_request(tmp_path: Path) -> None:
    path, built = tmp_path / "sources.fmu", tmp_path / "built.fmu"
    source = (Path(__file__).parents[1] / "fmu_sources" / "careless2.c").read_bytes()
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", CARELESS)
        archive.writestr("sources/careless2.c", source)
    report = check_fmu(path, cycles=2)
    assert line(report, "platform").verdict is Verdict.FAILED
    assert "--compile OUT.fmu" in line(report, "platform").text
    assert compile_sources(path, built) == built
    assert line(check_fmu(built, cycles=2), "runs").verdict is Verdict.OK
    with pytest.raises(FmuError, match="holds no C sources"):
        compile_sources(lag2(), built)


def test_a_library_under_another_name_is_no_library(tmp_path: Path) -> None:
    path = tmp_path / "lag.fmu"
    with zipfile.ZipFile(lag2()) as right, zipfile.ZipFile(path, "w") as wrong:
        wrong.writestr("binaries/", b"")
        for name in right.namelist():
            wrong.writestr(name.replace("lag2.so", "libhelper.so"), right.read(name))
    report = check_fmu(path, cycles=2)
    assert line(report, "platform").verdict is Verdict.FAILED
    assert line(report, "platform").text.startswith(
        "binaries/linux64 does not hold lag2.so, but libhelper.so; "
    )


def test_what_is_no_fmu_is_an_input_error(tmp_path: Path) -> None:
    path = tmp_path / "no.fmu"
    path.write_text("no archive")
    with pytest.raises(FmuError, match="no zip archive"):
        check_fmu(path)


def test_trial_inputs_stay_within_their_bounds(tmp_path: Path) -> None:
    start = '<Real start="0" unit="m/s"/>'
    xml = LAG2.format(guid="{lag}", interpolates="true")
    u = xml.index('name="u"')
    xml = xml[:u] + xml[u:].replace(start, '<Real start="2" min="-1" max="2" unit="m/s"/>', 1)
    description = read_description(write_fmu(tmp_path / "lag.fmu", xml, library("lag2.c"), "lag2"))
    signals = probe.raised_inputs(description, probe.trial_time(description))
    assert signals is not None
    assert signals.names == ("u",)
    assert signals["u"][0] == 2.0
    assert signals["u"][-1] == pytest.approx(1.7)
    changed = probe.changed_parameters(description)
    assert changed["tau"] == pytest.approx(0.101)
    assert "fault" not in changed


@pytest.mark.parametrize("name", ["THSA.fmu", "fmi3/THSA.fmu"])
def test_our_own_fmu_earns_reset(name: str) -> None:
    report = check_fmu(FMUS / name, cycles=5)
    assert report.verdict is Verdict.OK, [f for f in report.findings if f.verdict is not Verdict.OK]
    assert report.reuse == "reset"
    assert line(report, "communication step").values["change"] < 1e-5
