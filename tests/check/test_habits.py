"""Habits of tools: what `check` says of them, and that a batch copes."""

import zipfile
from pathlib import Path

import numpy as np
import pytest
from fmu_sources.build import habits2

from thsa_cosim.batch import Experiment, Job, LocalRunner
from thsa_cosim.check import Finding, Verdict, check_fmu
from thsa_cosim.errors import FmuError
from thsa_cosim.fmu import read_description
from thsa_cosim.fmu.probe import missing_binary
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
