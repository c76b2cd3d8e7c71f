"""A run that cannot go on says why in the words of the model: the loop, the division, the variable, the events."""

import zipfile
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("casadi", reason="the export extra is not installed")
pytest.importorskip("ziglang", reason="the export extra is not installed")

import fmpy

from thsa_cosim.export import export_fmu

MODEL = """
model Faults
  parameter Real slope = 0;
  parameter Real mass = 1;
  parameter Real pole = 0;
  parameter Real ringing = 0;
  parameter Real level = 1;
  Real x(start = 0, fixed = true);
  Real a(start = 1), b(start = 1);
  Real q(start = 1);
  Real v(start = 0, fixed = true);
  Real r(start = 0, fixed = true);
  discrete Real bell(start = 0, fixed = true);
  parameter Real n = 2;
  Real w1(start = 0, fixed = true), w2, tau;
initial equation
  q*exp(q) = level;
equation
  der(x) = 1;
  a*exp(b) = 1;
  a + exp(b) = 3 - slope*x;
  der(q) = 0;
  mass*der(v) = 1;
  der(r) = x/(1 - pole);
  w1 = n*w2;
  der(w1) = tau;
  der(w2) = 1 - n*tau;
  bell = if ringing*x > 0.25 then 1 - pre(bell) else 0;
end Faults;
"""


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("explain")
    (folder / "Faults.mo").write_text(MODEL, encoding="utf-8")
    return export_fmu(
        str(folder / "Faults.mo"), package=folder, output=folder / "Faults.fmu", platforms=["linux64"]
    )


def complaint(fmu: Path, **start: float) -> str:
    """The first thing that the FMU says of the end of a run, "" if it reaches its end."""
    said: list[str] = []

    def log(_environment: Any, _instance: Any, status: int, _category: Any, message: bytes) -> None:
        if status >= 2:
            said.append(message.decode())

    try:
        fmpy.simulate_fmu(str(fmu), stop_time=1.0, output_interval=0.01, start_values=start, logger=log)
    except Exception:
        return said[0]
    return ""


def test_the_sources_hold_file_names_without_folders(fmu: Path) -> None:
    with zipfile.ZipFile(fmu) as archive:
        source = archive.read("sources/model.c").decode()
    assert "der(w1 = (n * w2)) (Faults.mo:25)" in source
    assert fmu.parent.name not in source


def test_a_model_without_faults_runs(fmu: Path) -> None:
    assert complaint(fmu) == ""


def test_a_loop_without_a_solution(fmu: Path) -> None:
    found = complaint(fmu, slope=2.0)  # a + 1/a >= 2, or 3 - 2 x < 2 from x = 0.5 on
    assert "have no solution that Newton's method finds" in found
    assert "(a * exp(b)) = 1 (Faults.mo:20)" in found
    assert float(found.split("at time ")[1].split(":")[0]) == pytest.approx(0.5, abs=0.011)


def test_an_initial_loop_without_a_solution(fmu: Path) -> None:
    found = complaint(fmu, level=-1.0)  # q exp(q) >= -1/e
    assert "the initial equations have no solution" in found
    assert "(q * exp(q)) = level (Faults.mo:17)" in found


def test_a_division_by_a_coefficient_of_0(fmu: Path) -> None:
    found = complaint(fmu, mass=0.0)
    assert (
        "der(v) cannot be solved from (mass * der(v)) = 1 (Faults.mo:23), where its coefficient is 0" in found
    )


def test_a_derivative_that_is_no_number(fmu: Path) -> None:
    assert "der(r) is not a finite number" in complaint(fmu, pole=1.0)


def test_events_without_end(fmu: Path) -> None:
    found = complaint(fmu, ringing=1.0)
    assert "the event iteration does not settle at time 0.25" in found
    assert "bell changes again and again" in found
