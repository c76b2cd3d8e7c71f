"""States that parameters hold at rest: which they are, and that leaving them out of the solver changes no result."""

from pathlib import Path

import numpy as np
import pytest

ca = pytest.importorskip("casadi", reason="the export extra is not installed")
pytest.importorskip("ziglang", reason="the export extra is not installed")

import fmpy
from fmpy.fmi2 import FMU2Slave
from scipy.linalg import expm

from thsa_cosim.export import export_fmu
from thsa_cosim.export.compile import native_platform
from thsa_cosim.export.expression import select
from thsa_cosim.export.resting import moving
from thsa_cosim.fmu import Plant
from thsa_cosim.signals import Signals

P, Q, X = (ca.SX.sym(name) for name in "pqx")
RATES = {
    "x": (X, lambda p, q: True),
    "0": (ca.SX(0), lambda p, q: False),
    "0.5": (ca.SX(0.5), lambda p, q: True),
    "if p > 0 then x else 0": (select(P > 0, X, ca.SX(0)), lambda p, q: p > 0),
    "if p > 0 then 0 else x": (select(P > 0, ca.SX(0), X), lambda p, q: p <= 0),
    "if p > 0 then x else 2 x": (select(P > 0, X, 2 * X), lambda p, q: True),
    "if x > 0 then 1 else 0": (select(X > 0, ca.SX(1), ca.SX(0)), lambda p, q: True),
    "-(if p > 0 then x else 0)/q": (-select(P > 0, X, ca.SX(0)) / Q, lambda p, q: p > 0),
    "(if p > 0 then x else 0) (if q > 0 then x else 0)": (
        select(P > 0, X, ca.SX(0)) * select(Q > 0, X, ca.SX(0)), lambda p, q: p > 0 and q > 0,
    ),
    "(if p > 0 then x else 0) + (if q > 0 then x else 0)": (
        select(P > 0, X, ca.SX(0)) + select(Q > 0, X, ca.SX(0)), lambda p, q: p > 0 or q > 0,
    ),
    "if p > 0 then (if q > 0 then x else 0) else 0": (
        select(P > 0, select(Q > 0, X, ca.SX(0)), ca.SX(0)), lambda p, q: p > 0 and q > 0,
    ),
    "p x": (P * X, lambda p, q: True),
}  # fmt: skip


@pytest.mark.parametrize("name", RATES)
def test_a_state_rests_where_parameters_alone_make_its_rate_0(name: str):
    rate, moves = RATES[name]
    found = ca.Function("found", [P, Q], [moving(rate, frozenset("pq"))])
    for p in (-1.0, 0.0, 2.0):
        for q in (-1.0, 0.5):
            assert bool(float(found(p, q))) == moves(p, q), (p, q)


#: y rests while k = 0; x moves before it, z and w after it, and w has an event where x falls to a half.
MODEL = """model Rest
  parameter Real k = 0;
  Real x(start=1, fixed=true); Real y(start=0.5, fixed=true); Real z(start=0, fixed=true); Real w(start=0, fixed=true);
  output Real o = z;
equation
  der(x) = -x;
  der(y) = if k > 0 or k < 0 then k*(x - y) else 0;
  der(z) = y - 3*z;
  der(w) = if x > 0.5 then 1 else 0;
end Rest;
"""
TIME = np.linspace(0.0, 2.0, 41)
NAMES = ("x", "y", "z", "w")


def exact(k: float, time: np.ndarray, start: np.ndarray) -> np.ndarray:
    """(n, 3) x, y and z."""
    matrix = np.array([[-1.0, 0.0, 0.0], [k, -k, 0.0], [0.0, 1.0, -3.0]])
    return np.array([expm(matrix * t) @ start for t in time])


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("rest")
    (folder / "Rest.mo").write_text(MODEL)
    return export_fmu(
        str(folder / "Rest.mo"), output=folder / "Rest.fmu", platforms=(native_platform().fmi3,)
    )


@pytest.mark.slow
def test_one_instance_runs_with_and_without_the_state_at_rest(fmu: Path):
    runs = []
    with Plant.open(fmu) as plant:
        for k in (0.0, 4.0, 0.0, -0.3):
            found = plant.run({"k": k}, Signals(TIME, {}), NAMES, TIME, tolerance=1e-10)
            runs.append(np.stack([found[name] for name in NAMES], axis=1))
            np.testing.assert_allclose(runs[-1][:, :3], exact(k, TIME, np.array([1.0, 0.5, 0.0])), atol=1e-8)
            np.testing.assert_allclose(runs[-1][:, 3], np.minimum(TIME, np.log(2.0)), atol=1e-8)
    np.testing.assert_array_equal(runs[0], runs[2])
    assert np.all(runs[0][:, 1] == 0.5)


@pytest.mark.slow
def test_a_state_comes_to_rest_and_moves_again_within_a_run(fmu: Path, tmp_path: Path):
    description = fmpy.read_model_description(fmu)
    vr = {v.name: v.valueReference for v in description.modelVariables}
    slave = FMU2Slave(
        guid=description.guid,
        unzipDirectory=fmpy.extract(fmu, tmp_path),
        modelIdentifier=description.coSimulation.modelIdentifier,
    )
    slave.instantiate()
    slave.setupExperiment(tolerance=1e-10, startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    expected = np.array([1.0, 0.5, 0.0])
    saved = None
    for step, k in enumerate((0.0, 4.0, 4.0, 0.0, 1.0)):
        slave.setReal([vr["k"]], [k])
        if step == 2:
            saved = slave.getFMUState()
            slave.setReal([vr["k"]], [0.0])
            slave.doStep(0.25 * step, 0.25)
            slave.setFMUState(saved)  # y moves again, as it did there
        slave.doStep(0.25 * step, 0.25)
        expected = exact(k, np.array([0.25]), expected)[0]
        found = slave.getReal([vr[name] for name in NAMES[:3]])
        np.testing.assert_allclose(found, expected, atol=1e-7, err_msg=f"step {step}")
    slave.freeFMUState(saved)
    slave.terminate()
    slave.freeInstance()


@pytest.mark.slow
def test_a_model_may_have_nothing_that_moves_and_implicit_equations(tmp_path: Path):
    (tmp_path / "Held.mo").write_text(
        "model Held parameter Real k = 0; Real x(start=1, fixed=true); output Real y(start=1); equation "
        "der(x) = if k > 0 then -y else 0; y^3 + y = 2*x; end Held;"
    )
    fmu = export_fmu(
        str(tmp_path / "Held.mo"), output=tmp_path / "Held.fmu", platforms=(native_platform().fmi3,)
    )
    with Plant.open(fmu) as plant:
        held = plant.run({"k": 0.0}, Signals(TIME, {}), ("x", "y"), TIME)
        moved = plant.run({"k": 1.0}, Signals(TIME, {}), ("x", "y"), TIME, tolerance=1e-10)
    assert np.all(held["x"] == 1.0)
    np.testing.assert_allclose(held["y"], 1.0, atol=1e-12)
    # x = (y^3 + y)/2 and x' = -y, so that y' (3 y^2 + 1)/2 = -y: time from y alone
    y = moved["y"]
    np.testing.assert_allclose(0.75 * (1 - y**2) - 0.5 * np.log(y), TIME, atol=1e-7)
