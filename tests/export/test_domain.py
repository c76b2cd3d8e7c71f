"""Functions outside their domain end a run by name; relations that chatter end in bounded time, or slide."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("casadi", reason="the export extra is not installed")

from thsa_cosim.export import export_fmu
from thsa_cosim.export.causal import make_causal
from thsa_cosim.export.flatten import flatten
from thsa_cosim.fmu import Plant
from thsa_cosim.fmu.failure import SimulationFailure


def source(folder: Path, body: str) -> Path:
    file = folder / "M.mo"
    file.write_text(f"model M\n{body}\nend M;\n")
    return file


@pytest.mark.parametrize(
    ("expression", "text"),
    [
        ("sqrt(x)", "sqrt of x in y: it is a negative number"),
        ("log(p + x)", "log of (p+x) in y: it is a number that is not positive"),
        ("log10(x)", "in y: it is a number that is not positive"),
        ("asin(2*x)", "in y: it is a number beyond 1"),
        ("x^1.5", "power of x in y: it is a negative number with a broken exponent"),
        ("x^p", "power of x in y: it is a negative number with a broken exponent"),
        ("if x > 0 then sqrt(x) else 0", "sqrt of x in y: it is a negative number"),
    ],
)
def test_a_call_that_can_leave_its_domain_is_watched(tmp_path: Path, expression: str, text: str) -> None:
    body = (
        f"parameter Real p = 2; Real x(start = 1, fixed = true); Real y = {expression}; equation der(x) = -1;"
    )
    (found,) = make_causal(flatten(str(source(tmp_path, body)), Path("none"))).domain_texts
    assert text in found


@pytest.mark.parametrize(
    "expression",
    ["sqrt(x^2 + 1e-6)", "log(exp(x) + 1)", "x^3", "x^(-2)", "(x*x)^(p/2)"],
)
def test_a_call_that_cannot_leave_it_costs_nothing(tmp_path: Path, expression: str) -> None:
    body = (
        f"parameter Real p = 2; Real x(start = 1, fixed = true); Real y = {expression}; equation der(x) = -1;"
    )
    assert make_causal(flatten(str(source(tmp_path, body)), Path("none"))).domain_texts == ()


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("ziglang", reason="the export extra is not installed")
    folder = tmp_path_factory.mktemp("domain")
    body = """
      parameter Real a = 1;
      Real x(start = 0.5, fixed = true);
      Real unread = sqrt(x + a);
      Real guarded = if x > 0 then sqrt(x) else 0;
      Real both = if noEvent(x > 0) then log(x) else 1;
      Real shared = if x > 0 then sqrt(x) else -sqrt(-x);
      Real again = if noEvent(x > 0) then 2*sqrt(x) else -2*sqrt(-x);
      Real s(start = 0.5, fixed = true);
      Real v(start = 0.5, fixed = true);
      parameter Real start = 0.5;
    equation
      der(x) = -1;
      der(s) = if s > 0 then -1 else 1;
      der(v) = 0.5*sin(time) - (if v > 0 then 1 else -1);
    """
    return export_fmu(
        str(source(folder, body)), package=folder, output=folder / "M.fmu", platforms=["linux64"]
    )


KINDS = pytest.mark.parametrize("kind", ["co-simulation", "model-exchange"])
T = np.linspace(0, 1, 5)


@KINDS
def test_a_variable_that_nobody_reads_ends_the_run_where_it_is_not_a_number(fmu: Path, kind: str) -> None:
    with (
        Plant.open(fmu, kind=kind) as plant,
        pytest.raises(SimulationFailure, match=r"sqrt of \(x\+a\) in unread"),
    ):
        plant.run({"a": -0.1}, None, ["x"], T)


@pytest.mark.parametrize("stepping", ["samples", "free"])
def test_so_it_does_however_the_steps_are_chosen(fmu: Path, stepping: str) -> None:
    with Plant.open(fmu, stepping=stepping) as plant, pytest.raises(SimulationFailure, match="sqrt of"):
        plant.run({"a": -0.1}, None, ["x"], T)


@KINDS
def test_branches_not_taken_are_not_watched_and_relations_slide(fmu: Path, kind: str) -> None:
    with Plant.open(fmu, kind=kind) as plant:
        found = plant.run({}, None, ["guarded", "shared", "again", "s", "v"], T)
    np.testing.assert_allclose(found["guarded"], np.sqrt(np.maximum(0.5 - T, 0)), atol=1e-6)
    root = np.sign(0.5 - T) * np.sqrt(np.abs(0.5 - T))
    np.testing.assert_allclose(found["shared"], root, atol=1e-6)
    np.testing.assert_allclose(found["again"], 2 * root, atol=1e-6)
    np.testing.assert_allclose(found["s"], np.maximum(0.5 - T, 0), atol=2e-3)
    np.testing.assert_allclose(found["v"], np.maximum(0, 1 - 0.5 * np.cos(T) - T), atol=2e-3)
