"""Every kind of study to its end, as small as it gets: run, written, printed, drawn, opened again.

A fault in what is written after the last simulation loses a study. A diagnosis takes half a minute: its result is made
up here, with all that a result can hold.
"""

import json
import tomllib
from collections.abc import Callable
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console
from small_scenario import toml

import thsa_cosim as tc
from thsa_cosim import cli
from thsa_cosim.api.conduct import KINDS, Conducted, ask, conduct
from thsa_cosim.diagnosis import run as diagnosis
from thsa_cosim.diagnosis.results import (
    Balance,
    Dependence,
    DiagnosisResult,
    EmpiricalLaw,
    EmpiricalTerm,
    EquivalenceClass,
    Evidence,
    FoundEffect,
    Judged,
    SeparatingExperiment,
    Sharpened,
    StructuredError,
    Value,
)
from thsa_cosim.identify import ForceBalance
from thsa_cosim.inspection import Finding, Inspection
from thsa_cosim.report.page import write_page
from thsa_cosim.scenario import Executor, Scenario
from thsa_cosim.signals import Signals
from thsa_cosim.study import Comparison

SCENARIOS = Path(__file__).parents[2] / "scenarios"
RECORDINGS = SCENARIOS / "recordings"


def shipped(name: str) -> dict[str, Any]:
    """A shipped scenario's content, with paths from here."""
    content = tomllib.loads((SCENARIOS / f"{name}.toml").read_text(encoding="utf-8"))
    content["fmu"] = str(SCENARIOS / content["fmu"])
    return content


def motor() -> dict[str, Any]:
    """0.6 s of the motor's bench at two temperatures, one generation, a law and a profile."""
    content = shipped("motor")
    recordings = content["recordings"]
    recordings["fit"] = [str(RECORDINGS / f"motor_{t}.parquet") for t in ("p00", "p25")]
    recordings["validate"] = [str(RECORDINGS / "motor_m30.parquet")]
    recordings["time"]["stop"] = 0.6
    content["search"] |= {
        "method": "differential-evolution",
        "population": 5,
        "generations": 1,
        "profile": ["R_s"],
    }
    return content


def table4() -> dict[str, Any]:
    """Half a second of table IV: one generation, simplex, line, surface and front."""
    content = shipped("table4")
    content["command"]["stop"] = 0.5
    content["metrics"]["window"] = [0.4, 0.5]
    content["search"] |= {"population": 5, "generations": 1}
    content["line"]["generations"] = 1
    content["surface"]["points"] = 3
    return content


def schedule() -> dict[str, Any]:
    """A schedule of two nodes, checked between them, with what a start from rest takes."""
    content = table4()
    content["search"]["polish"] = False
    content["conditions"]["T_amb"]["values"] = [-30.0, 25.0]
    content["schedule"] = {"over": ["T_amb"], "check": {"T_amb": {"values": [0.0], "unit": "degC"}}}
    content["start"] = {"moving": 0.02, "current": "i_q", "current_limit": 40.0}
    for table in ("line", "surface", "pareto"):
        del content[table]
    return content


def driven() -> dict[str, Any]:
    content = shipped("driven")
    recordings = content["recordings"]
    recordings["fit"] = [str(RECORDINGS / "undeclared_fit_1.parquet")]
    recordings["validate"] = [str(RECORDINGS / "undeclared_validate_1.parquet")]
    recordings["time"]["stop"] = 0.6
    content["diagnose"]["package"] = str(SCENARIOS / content["diagnose"]["package"])
    return content


def stages(folder: Path) -> Path:
    """Two stages of the motor's bench in files, which is what stages are in."""
    content = motor()
    del content["recordings"]["fit"][1:], content["search"]["profile"]
    content["search"]["polish"] = False
    lines = [f"{key} = {_toml(value)}" for key, value in content.items()]
    for name in ("first", "second"):
        (folder / f"{name}.toml").write_text("\n".join(lines), encoding="utf-8")
    whole = folder / "all.toml"
    listed = "\n".join(f'[[stages]]\nscenario = "{name}.toml"' for name in ("first", "second"))
    whole.write_text(f'kind = "identify"\ntitle = "benches"\nseed = 1\n{listed}\n', encoding="utf-8")
    return whole


def _toml(value: Any) -> str:
    """A value of a scenario in one line of TOML."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(k)} = {_toml(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return json.dumps(value)


def everything(scenario: Scenario, *_: Any) -> DiagnosisResult:
    """A diagnosis with something in each of its places."""
    error = StructuredError(3e-5, 0.1, 2e-5, "m/s", 600, 1e-5, 4.0)
    value = Value(6e-6, "N.m.s2/rad2", 1e-8, variable="motorEffect.windage.b_q")
    unsure = Value(1.0, "1", np.inf, "the data do not determine it")
    compared = tuple(
        Comparison(r.name, role, r.temperature_degC, r.compared, r.compared, {"v": error})
        for role, recordings in (("fit", scenario.fit), ("validate", scenario.validate))
        for r in recordings
    )
    bins = (0.0, 1.0, 2.0)
    time = np.arange(5) * 0.1
    judged = [
        Judged("windage:motor", "windage0", 900.0, 800.0, 1e-9, {"b_q": value}, "accepted", "", 1),
        Judged(
            "stribeck:motor",
            "stribeck0",
            9.0,
            None,
            0.4,
            {"n": unsure},
            "not testable",
            "nothing depends on it",
            1,
        ),
    ]
    return DiagnosisResult(
        title=scenario.title,
        status="complete",
        seed=scenario.seed,
        version=tc.__version__,
        scenario=scenario.path,
        fmu=scenario.fmu.path,
        fmu_sha256=scenario.fmu.sha256,
        verdict="missing-effect",
        effects=(FoundEffect("windage:motor", "Windage", {"b_q": value}, ("windage:gear",), 0.99, "12 per turn"),),
        before={"fit": {"v": error}, "validate": {"v": error}},
        after={"fit": {"v": error}, "validate": {"v": error}},
        recordings_before={c.recording: {"v": error} for c in compared},
        recordings_after={c.recording: {"v": error} for c in compared},
        declared_before={"b_m": value, "n": unsure},
        declared_after={"b_m": value, "n": unsure},
        unexplained=0.02,
        model=None,
        extended_fmu=None,
        wrapper=None,
        judged=tuple(judged),
        balances=(Balance("electrical", "V", 0.3, 0.2, 0.1, at_fault=True),),
        evidence=Evidence(
            "mechanical", "A", "i_q", "fit", "w_m", "rad/s", 0.4, bins, bins, (0.1, 0.1, 0.1), bins, (np.nan,) * 3
        ),
        dependence=(Dependence("w_m", 1.0, "rad/s", "v", "m/s", 1e-5, np.nan, 1e-6),),
        empirical=EmpiricalLaw((EmpiricalTerm("motor", "v", value),), 90.0, added=False),
        equivalence=(EquivalenceClass(("windage:motor", "windage:gear"), 0.3),),
        experiment=SeparatingExperiment(
            "slow ramps", ("windage:motor", "windage:gear"), 90.0, 2.0,
            Signals(time, {"v_cmd": time}, {"v_cmd": "m/s"}), 40.0, True, {"v": (0.0, 0.4)},
            Sharpened("motorEffect.windage.b_q", 1e-8, 5e-9),
        ),
        comparisons_before=compared,
        comparisons_after=compared,
        force_before=ForceBalance("N", 20.0, {"fit": 3.0}, np.nan),
        force_after=ForceBalance("N", 20.0, {"fit": 2.0}, 1.0),
        threshold=17.0,
        evaluations=321,
        failures={"fmi2DoStep returned fmi2Error": 2},
        notes=("a note",),
        data=Inspection.of((Finding("a", "v", "gaps", "warning", "v has a gap", ((0.0, 0.1),)),), ()),
        asked=scenario.table.model_dump(mode="json", by_alias=True, exclude_unset=True),
    )  # fmt: skip


SMALLEST: dict[str, tuple[str, Callable[..., Any]]] = {
    "simulate": ("simulate", motor),
    "identify": ("identify", motor),
    "identify in stages": ("identify", stages),
    "tune": ("tune", table4),
    "tune a schedule": ("tune", schedule),
    "diagnose": ("diagnose", driven),
}


def strict(text: str) -> Any:
    """JSON as every reader takes it: without NaN and Infinity."""

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is no JSON")

    return json.loads(text, parse_constant=refuse)


def forbidden(*_: Any) -> Any:
    raise AssertionError("a finished study was run again")


def test_no_kind_is_left_out() -> None:
    assert {command for command, _ in SMALLEST.values()} == set(KINDS)


def files_of(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def check_that_it_is_shown_again(
    done: Conducted, scenario: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The command, given on the finished folder: the same output, exit code and files, and nothing is simulated."""
    command, folder = done.asked.kind.name, done.folder
    words = [command, str(scenario), "-o", str(folder), "--no-report", "--workers", "1"]
    words += ["--no-export-fmu"] if command == "identify" else []
    before, tables = files_of(folder), Console(file=StringIO(), width=140)
    done.show(tables)
    with monkeypatch.context() as idle:  # whatever simulates, decides or writes a study is gone
        idle.setattr(Executor, "open_runner", forbidden)
        for kind in KINDS.values():
            idle.setattr(type(kind), "run", forbidden)
            idle.setattr(type(kind), "write", forbidden)
        capsys.readouterr()
        code = cli.run_command(words)
    shown, told = capsys.readouterr()
    assert shown.startswith(tables.file.getvalue())  # type: ignore[attr-defined]
    sentence = f"{folder} holds this study, complete: it is shown again, and nothing is simulated."
    assert told.splitlines().count(sentence) == 1
    assert (code, done.objection in told) == (3 if done.objection else 0, True)
    assert files_of(folder) == before
    if command != "diagnose":  # which is shown from its result alone
        (folder / "result.json").write_text('{"status": "complete"}', encoding="utf-8")
        monkeypatch.setattr(Executor, "open_runner", forbidden)
        cli.run_command(words)
        assert "a finished study was run again" in capsys.readouterr().err


@pytest.mark.parametrize("name", SMALLEST)
def test_a_study_of_every_kind_is_written_printed_drawn_opened_and_shown_again(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(diagnosis, "_diagnose", everything)
    command, make = SMALLEST[name]
    scenario = tmp_path / "asked.toml"
    if make is stages:
        scenario = make(tmp_path)
    else:
        scenario.write_text(toml(make()), encoding="utf-8")
    asked = ask(command, scenario, folder=tmp_path / "study", workers=1)
    done = conduct(asked, quiet=True)
    assert done.status == "complete"
    assert done.files
    assert all(file.is_file() for file in done.files)
    result = strict((done.folder / "result.json").read_text(encoding="utf-8"))
    assert result["kind"] == command
    assert {"status", "seed", "evaluations", "failures", "fmu", "version"} <= set(
        result
    ) or "stages" in result
    assert result["status"] == "complete"
    assert "stages" in result or result["data"]["verdict"] in ("good", "usable", "bad")
    assert (
        "stages" in result
        or result["trust"]["verdict"] in ("explained", "not-explained")
        or command == "tune"
    )

    printed = Console(file=StringIO(), width=120)
    done.show(printed)
    assert printed.file.getvalue().strip()  # type: ignore[attr-defined]

    page = write_page(done.folder).read_text(encoding="utf-8")
    assert str(result["title"]) in page

    study = tc.open_study(done.folder)
    assert type(study) is KINDS[command].study
    assert study.result == result
    check_that_it_is_shown_again(done, scenario, monkeypatch, capsys)


def test_values_that_no_polish_has_looked_at_are_not_called_undetermined(tmp_path: Path) -> None:
    content = motor()
    del content["search"]["profile"]
    content["search"]["polish"] = False
    done = conduct(ask("identify", content, folder=tmp_path / "study", workers=1), quiet=True)
    result = strict((done.folder / "result.json").read_text(encoding="utf-8"))
    assert not any(p["identifiable"] for p in result["points"][0]["parameters"].values())
    assert not any("determine no parameter" in reason for reason in result["trust"]["reasons"])
