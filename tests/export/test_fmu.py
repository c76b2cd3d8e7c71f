"""Exported FMUs against closed forms and SciPy, Co-Simulation and Model Exchange, FMI 2.0 and 3.0."""

import json
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
from fmpy import simulate_fmu
from fmpy.validation import validate_fmu
from scipy.integrate import solve_ivp
from scipy.signal import StateSpace, lsim

pytest.importorskip("casadi", reason="the export extra is not installed")
pytest.importorskip("ziglang", reason="the export extra is not installed")

from thsa_cosim.errors import ThsaCosimError
from thsa_cosim.export import export_fmu
from thsa_cosim.export.manifest import main as manifest_main
from thsa_cosim.export.manifest import stale
from thsa_cosim.fmu import Plant, read_description
from thsa_cosim.signals import Signals

REPO = Path(__file__).parents[2]
MODELS = Path(__file__).parents[1] / "modelica"
THSA = REPO / "modelica" / "THSA"
HERE = {"linux": "x86_64-linux", "darwin": "aarch64-darwin", "win32": "x86_64-windows"}[sys.platform]


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """``built(source, fmi)``: path of an FMU for this machine, exported once per test module."""
    folder = tmp_path_factory.mktemp("fmus")

    def build(source: str, fmi: int = 2) -> Path:
        name = Path(source).stem if source.endswith(".mo") else source
        output = folder / f"{name}_{fmi}.fmu"
        if not output.exists():
            model = str(MODELS / source) if source.endswith(".mo") else source
            export_fmu(model, package=THSA, fmi=fmi, output=output, platforms=[HERE])
        return output

    return build


def simulate(path, outputs, time, *, values=None, inputs=None, kind=None, tolerance=None):
    with Plant.open(path, kind=kind) as plant:
        return plant.run(values or {}, inputs, outputs, np.asarray(time, float), tolerance=tolerance)


VERSIONS = pytest.mark.parametrize("fmi", [2, 3])
KINDS = pytest.mark.parametrize("kind", ["co-simulation", "model-exchange"])


@VERSIONS
@KINDS
def test_dahlquist_decays_exponentially(built, fmi, kind):
    time = np.linspace(0, 10, 101)
    got = simulate(
        built("Dahlquist.mo", fmi), ["x", "der(x)"], time, values={"k": 0.7}, kind=kind, tolerance=1e-8
    )
    np.testing.assert_allclose(got["x"], np.exp(-0.7 * time), atol=2e-7)
    np.testing.assert_allclose(got["der(x)"], -0.7 * got["x"], rtol=1e-12)


@VERSIONS
@KINDS
def test_oscillator_follows_a_piecewise_linear_force_exactly(built, fmi, kind):
    knots = np.array([0.0, 2.0, 2.5, 7.0, 12.0, 20.0])
    force = Signals(knots, {"F": np.array([0.0, 3.0, -1.0, -1.0, 2.0, 0.0])}, {"F": "N"})
    time = np.linspace(0, 20, 41)
    got = simulate(
        built("HarmonicOscillator.mo", fmi),
        ["x"],
        time,
        values={"c": 4.0},
        inputs=force,
        kind=kind,
        tolerance=1e-9,
    )
    system = StateSpace([[0.0, 1.0], [-4.0, 0.0]], [[0.0], [1.0]], [[1.0, 0.0]], [[0.0]])
    fine = np.linspace(0, 20, 4001)  # holds every knot; lsim is exact for piecewise-linear inputs
    _, exact, _ = lsim(system, np.interp(fine, knots, force["F"]), fine, X0=[1.0, 0.0])
    np.testing.assert_allclose(got["x"], exact[::100], atol=2e-6)


@VERSIONS
def test_van_der_pol_equals_radau(built, fmi):
    time = np.linspace(0, 2000, 201)

    def rhs(_, x):
        return [x[1], 1000 * (1 - x[0] ** 2) * x[1] - x[0]]

    reference = solve_ivp(rhs, (0, 2000), [2, 0], "Radau", time, rtol=1e-10, atol=1e-12)
    got = simulate(built("VanDerPol.mo", fmi), ["x0"], time, tolerance=1e-8)
    np.testing.assert_allclose(got["x0"], reference.y[0], atol=2e-4)


def test_stiff_network_equals_radau(built):
    knots = np.array([0.0, 1.0, 1.001, 5.0])
    source = Signals(knots, {"u": np.array([0.0, 0.0, 10.0, 10.0])}, {"u": "V"})
    time = np.union1d(np.linspace(0, 5, 501), knots)

    def rhs(t, y):
        u = np.interp(t, knots, source["u"])
        i1, i2 = (u - y[0]) / 1e-3, (y[0] - y[1]) / 1e3
        return [(i1 - i2) / 1e-6, i2 / 1e-3]

    reference = solve_ivp(rhs, (0, 5), [0, 0], "Radau", time, rtol=1e-10, atol=1e-12, max_step=0.05)
    # At every sample a step ends: the solver's own error. Between steps the dense output of a stiff state adds to it.
    for stepping, worst in (("samples", 1e-6), ("free", 5e-6)):
        with Plant.open(built("StiffRC.mo"), stepping=stepping) as plant:
            got = plant.run({}, source, ["u1", "u2"], time, tolerance=1e-8)
        np.testing.assert_allclose(got["u1"], reference.y[0], atol=worst)
        np.testing.assert_allclose(got["u2"], reference.y[1], atol=1e-6)


def test_pendulum_without_friction_keeps_its_energy(built):
    got = simulate(
        built("Pendulum.mo"), ["phi", "E"], np.linspace(0, 10, 1001), values={"d": 0.0}, tolerance=1e-9
    )
    np.testing.assert_allclose(got["E"], 9.80665 * (1 - np.cos(2)), rtol=1e-6)

    def rhs(_, y):
        return [y[1], -9.80665 * np.sin(y[0])]

    reference = solve_ivp(rhs, (0, 10), [2, 0], "DOP853", got.time, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(got["phi"], reference.y[0], atol=2e-6)


@KINDS
def test_stick_slip_equals_radau(built, kind):
    time = np.linspace(0, 4, 401)

    def rhs(t, y):
        s = np.clip(y[1] / 1e-6, -1, 1)
        return [y[1], 100 * (0.05 * t - y[0]) - (1 + 0.5 * np.exp(-((y[1] / 0.01) ** 2))) * s]

    reference = solve_ivp(rhs, (0, 4), [0, 0], "Radau", time, rtol=1e-10, atol=1e-13)
    got = simulate(built("StickSlip.mo"), ["x", "v"], time, kind=kind, tolerance=1e-8)
    np.testing.assert_allclose(got["x"], reference.y[0], atol=2e-6 * np.ptp(reference.y[0]) + 1e-6)


def test_rigid_inertias_move_as_one(built):
    torque = Signals(np.array([0.0, 1.0]), {"tau": np.array([0.0, 4.0])}, {"tau": "N.m"})
    time = np.linspace(0, 1, 11)
    got = simulate(built("RigidInertias.mo"), ["w1", "w2", "phi2"], time, inputs=torque, tolerance=1e-9)
    np.testing.assert_allclose(got["w1"], 2 * time**2 / (2 + 3 / 25), atol=1e-7)
    np.testing.assert_allclose(got["w2"], got["w1"] / 5, rtol=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_random_linear_systems_equal_lsim(tmp_path, seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 7))
    a = rng.normal(size=(n, n)) * 10.0 ** rng.uniform(0, 2)
    a -= (np.linalg.eigvals(a).real.max() + rng.uniform(0.1, 2)) * np.eye(n)
    b, c, d = rng.normal(size=n), rng.normal(size=n), rng.normal()
    lines = ["model Linear", "  input Real u;", "  output Real y;"]
    lines += [f"  Real x{i}(start={float(rng.normal())!r}, fixed=true);" for i in range(n)]
    start = [float(line.split("start=")[1].split(",")[0]) for line in lines if "start=" in line]
    lines.append("equation")
    for i in range(n):
        lines.append(
            f"  der(x{i}) = "
            + " + ".join(f"({float(a[i, j])!r})*x{j}" for j in range(n))
            + f" + ({float(b[i])!r})*u;"
        )
    lines.append("  y = " + " + ".join(f"({float(c[j])!r})*x{j}" for j in range(n)) + f" + ({float(d)!r})*u;")
    source = tmp_path / "Linear.mo"
    source.write_text("\n".join([*lines, "end Linear;", ""]))
    fmu = export_fmu(str(source), package=THSA, output=tmp_path / "Linear.fmu", platforms=[HERE])
    time = np.linspace(0, 2, 81)
    knots = np.linspace(0, 2, 9)
    u = Signals(knots, {"u": rng.normal(size=9)})
    got = simulate(fmu, ["y"], time, inputs=u, tolerance=1e-9)
    fine = np.linspace(0, 2, 801)
    system = StateSpace(a, b[:, None], c[None, :], [[d]])
    _, exact, _ = lsim(system, np.interp(fine, knots, u["u"]), fine, X0=start)
    np.testing.assert_allclose(got["y"], exact[::10], atol=3e-7 * max(1.0, np.ptp(exact)))


@VERSIONS
@pytest.mark.parametrize(
    "source", ["VanDerPol.mo", "StiffRC.mo", "RigidInertias.mo", "THSA.Actuator", "THSA.Benches.Screw"]
)
def test_archives_are_valid_and_run_in_fmpy(built, fmi, source):
    path = built(source, fmi)
    assert validate_fmu(str(path)) == []
    for kind in ("CoSimulation", "ModelExchange"):
        result = simulate_fmu(str(path), fmi_type=kind, stop_time=0.01)
        assert all(np.isfinite(result[name]).all() for name in result.dtype.names)


def test_description_declares_what_an_importer_needs(built):
    description = read_description(built("THSA.Actuator"))
    assert {v.name: v.unit for v in description.outputs} == {
        "v": "m/s",
        "x": "m",
        "w_m": "rad/s",
        "i_q": "A",
        "u_q": "V",
    }
    temperatures = ("T_amb", "T_motor", "T_gearbox", "T_screw")
    assert {v.name: v.unit for v in description.inputs} == {
        "v_cmd": "m/s",
        "F_load": "N",
        **dict.fromkeys(temperatures, "degC"),
    }
    for inner in (
        "motor.P_co",
        "motor.friction.F_f",
        "noBack.tau_nb",
        "gearbox.P_f",
        "nut.friction.F_f",
        "motor.T",
    ):
        assert description.variables[inner].causality == "local"
    gain = description.variables["velocityController.K_p"]
    assert (gain.causality, gain.variability, gain.start) == ("parameter", "tunable", 0.12)


def test_start_values_can_be_replaced_at_export(tmp_path):
    fmu = export_fmu(
        str(MODELS / "Dahlquist.mo"),
        package=THSA,
        output=tmp_path / "d.fmu",
        platforms=[HERE],
        start_values={"k": 2.0, "x": 3.0},
    )
    assert read_description(fmu).variables["k"].start == 2.0
    got = simulate(fmu, ["x"], [0.0, 1.0], tolerance=1e-8)
    np.testing.assert_allclose(got["x"], [3.0, 3.0 * np.exp(-2)], rtol=1e-6)


def test_sources_inside_build_again(built, tmp_path):
    if shutil.which("gcc") is None:
        pytest.skip("no gcc on this machine to build the sources with")
    with zipfile.ZipFile(built("Pendulum.mo")) as archive:
        archive.extractall(tmp_path)
    sources = sorted(str(path) for path in (tmp_path / "sources").glob("*.c"))
    done = subprocess.run(
        ["gcc", "-std=c99", "-Wall", "-Wextra", "-Werror", "-Wno-unused-parameter", "-Wno-unused-const-variable",
         "-Wno-unused-function", "-shared", "-fPIC", *sources, "-o", str(tmp_path / "again.so"), "-lm"],
        capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


SHIPPED = sorted(str(path.relative_to(REPO)) for path in (REPO / "fmus").rglob("*.fmu"))


@pytest.mark.parametrize("path", SHIPPED)
def test_shipped_fmus_validate_silently_and_run_in_fmpy(path):
    def fmpy(*arguments):
        return subprocess.run(
            [sys.executable, "-m", "fmpy", *arguments], capture_output=True, text=True, cwd=REPO
        )

    validated = fmpy("validate", path)
    assert validated.returncode == 0
    assert validated.stdout.strip() == "No problems found."
    for kind in ("CoSimulation", "ModelExchange"):
        result = simulate_fmu(str(REPO / path), fmi_type=kind, stop_time=0.02)
        assert all(np.isfinite(result[name]).all() for name in result.dtype.names)


def test_shipped_fmus_hold_binaries_for_every_platform():
    for path in SHIPPED:
        with zipfile.ZipFile(REPO / path) as archive:
            found = {name.split("/")[1] for name in archive.namelist() if name.startswith("binaries/")}
        if path.startswith("fmus/fmi3"):
            assert found == {
                "x86_64-linux",
                "aarch64-linux",
                "x86_64-windows",
                "x86_64-darwin",
                "aarch64-darwin",
            }
        else:
            assert found == {"linux64", "win64", "darwin64"}


@pytest.mark.slow
@pytest.mark.parametrize("path", ["fmus/THSA.fmu", "fmus/fmi3/THSA.fmu"])
def test_fmpy_compiles_the_sources(tmp_path, path):
    if shutil.which("cmake") is None or shutil.which("gcc") is None:
        pytest.skip("no cmake and gcc on this machine to compile an FMU with")
    fmu = tmp_path / "THSA.fmu"
    shutil.copyfile(REPO / path, fmu)
    compiled = subprocess.run(
        [sys.executable, "-m", "fmpy", "compile", str(fmu)], capture_output=True, text=True
    )
    assert compiled.returncode == 0, compiled.stderr
    time = np.linspace(0, 0.1, 11)
    values = {"v_cmd": 9e-3, "F_load": 55e3}
    got, shipped = (simulate(source, ["i_q", "v"], time, values=values) for source in (fmu, REPO / path))
    np.testing.assert_allclose(got["i_q"], shipped["i_q"], rtol=1e-9)


def test_shipped_fmus_are_up_to_date():
    assert stale(REPO / "fmus" / "manifest.json") == {}


def test_stale_fmu_is_noticed(tmp_path, capsys):
    shutil.copytree(THSA, tmp_path / "modelica" / "THSA")
    shutil.copytree(REPO / "fmus", tmp_path / "fmus")
    manifest = tmp_path / "fmus" / "manifest.json"
    nut = tmp_path / "modelica" / "THSA" / "Nut.mo"
    nut.write_text(nut.read_text().replace("2.7e3", "2.8e3"))
    found = stale(manifest)
    assert set(found) == {
        "THSA.fmu",
        "THSA_FeedForward.fmu",
        "THSA_Thermal.fmu",
        "THSA_Redundant.fmu",
        "Plant.fmu",
        "Gearbox.fmu",
        "Screw.fmu",
        "fmi3/THSA.fmu",
        "fmi3/Gearbox.fmu",
        "fmi3/Screw.fmu",
    }
    assert manifest_main([str(manifest), "--check"]) == 1
    assert "Screw.fmu: the Modelica model or the exporter has changed" in capsys.readouterr().out


def test_manifest_that_is_none_is_refused(tmp_path):
    (tmp_path / "manifest.json").write_text(json.dumps({"fmus": 3}))
    with pytest.raises(ThsaCosimError, match="is no FMU manifest"):
        stale(tmp_path / "manifest.json")
