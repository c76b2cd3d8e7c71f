"""The exporter's front end: order of equations, index reduction, initialization, modes, and what it refuses."""

from pathlib import Path

import numpy as np
import pytest

ca = pytest.importorskip("casadi", reason="the export extra is not installed")

from thsa_cosim.errors import ModelicaError, ParameterError, ThsaCosimError
from thsa_cosim.export import causal_model, export_fmu
from thsa_cosim.export.causal import CausalModel, make_causal
from thsa_cosim.export.flatten import flatten
from thsa_cosim.export.units import base_unit

REPO = Path(__file__).parents[2]
MODELS = Path(__file__).parents[1] / "modelica"
THSA = REPO / "modelica" / "THSA"


def causal(source: str | Path, tmp_path: Path | None = None) -> CausalModel:
    if isinstance(source, str):
        assert tmp_path is not None
        path = tmp_path / "M.mo"
        path.write_text(source)
        return make_causal(flatten(str(path), THSA))
    return make_causal(flatten(str(source), THSA))


class Evaluated:
    """Right-hand side, algebraic variables and initial values of a causal model as numbers, by name."""

    def __init__(self, model: CausalModel) -> None:
        self.model = model
        arguments = [model.time, model.x, model.u, model.p, model.m]
        d = ca.substitute([model.rhs, model.w, model.g], [model.d], [model.dependent])
        self.functions = ca.Function("f", arguments, d)
        self.start = ca.Function(
            "i",
            [model.time, model.x_start, model.u, model.p, model.m],
            ca.substitute([model.initial], [model.d], [model.dependent]),
        )
        self.p = [v.start for v in sorted(self.of("parameter"), key=lambda v: v.index)]

    def of(self, kind):
        named = {v.index: v for v in self.model.variables if v.kind == kind and v.start is not None}
        return list(named.values())

    def at(self, x, u=(), t=0.0, parameters=None):
        p = list(self.p)
        for variable in self.of("parameter"):
            if parameters and variable.name in parameters:
                p[variable.index] = parameters[variable.name]
        m = np.zeros(self.model.m.numel())
        for _ in range(20):
            rhs, w, g = (np.array(v).ravel() for v in self.functions(t, x, u, p, m))
            fresh = (g > 0).astype(float)
            if np.array_equal(fresh, m):
                break
            m = fresh
        values = {f"der({s})": rhs[i] for i, s in enumerate(self.model.states)}
        values |= dict(zip(self.model.states, x, strict=True))
        for v in self.model.variables:
            if v.kind == "algebraic":
                values[v.name] = w[v.index]
            elif v.kind == "state":
                values[v.name] = x[v.index]
            elif v.kind == "derivative":
                values[v.name] = rhs[v.index]
            elif v.kind == "input":
                values[v.name] = u[v.index]
        return values


def test_actuator_right_hand_side_equals_the_equations_of_the_article():
    model = causal(THSA / "Actuator.mo")
    evaluated = Evaluated(model)
    rng = np.random.default_rng(7)
    for _ in range(40):
        state = dict(
            zip(
                model.states,
                rng.normal(size=8) * [50, 0.05, 5, 100, 50, 1e-3, 9e-3, 9e-3],
                strict=True,
            )
        )
        v_cmd, load, t = rng.normal() * 9e-3, rng.normal() * 5e4, rng.uniform(-55, 25)
        got = evaluated.at(
            list(state.values()), [v_cmd, load, *[t] * (model.u.numel() - 2)]
        )  # one temperature
        k, i = 10e-3 / (2 * np.pi), 30
        w, x, v = state["motor.w_m"], state["stabilizer.x"], state["stabilizer.v"]
        force = 3e8 * (k * state["motor.phi"] / i - x) + 5e5 * (k * w / i - v)
        nut = (-0.07 * t**3 - 1.4 * t**2 + 37 * t + 2.7e3) * np.sign(v) + (230 * t**2 - 3e3 * t + 4e4) * v
        assert got["der(stabilizer.v)"] == pytest.approx((force - nut - load) / 200, rel=1e-9)
        screw_torque = k * force
        no_back = 1.15 * max(0, -screw_torque * np.sign(w)) * np.sign(w)
        gear = (2e-4 * t**2 - 0.25 * t + 11) * np.sign(w) + (1.8e-7 * t - 6e-7) * w / i
        friction = (1e-2 * np.exp(-4e-2 * t) + 3e-2 * np.exp(9e-3 * t)) * np.sign(w)
        friction += (1e-10 * t**3 + 1e-8 * t**2 + 2e-8 * t + 4e-5) * w
        k_t = np.sqrt(1.5) * 4 * (-4e-6 * t**2 + 6e-5 * t + 0.1)
        expected = (k_t * state["motor.i_q"] - friction - (screw_torque + no_back + gear) / i) / 2e-3
        assert got["der(motor.w_m)"] == pytest.approx(expected, rel=1e-9, abs=1e-6)
        error = v_cmd * i / k - w
        i_ref = np.clip(0.12 * error + 0.45 * state["velocityController.z"], -40, 40)
        u_q = np.clip(4 * (i_ref - state["motor.i_q"]) + 1000 * state["currentController.z"], -190, 190)
        assert got["u_q"] == pytest.approx(u_q, rel=1e-9, abs=1e-9)
        r_s = -5e-6 * t**3 + 7e-5 * t**2 + 3e-2 * t + 1.2
        assert got["der(motor.i_q)"] == pytest.approx(
            (u_q - r_s * state["motor.i_q"] - k_t * w) / 2e-3, rel=1e-9, abs=1e-5
        )
        assert got["der(sensor.y)"] == pytest.approx((v - state["sensor.y"]) / 0.010)


def test_actuator_starts_in_equilibrium_under_the_load():
    model = causal(THSA / "Actuator.mo")
    evaluated = Evaluated(model)
    start = np.array(
        evaluated.start(
            0, np.zeros(8), [0, 55e3, *[-30] * (model.u.numel() - 2)], evaluated.p, np.zeros(model.m.numel())
        )
    ).ravel()
    assert start[model.states.index("stabilizer.x")] == pytest.approx(-55e3 / 3e8, rel=1e-12)
    assert np.count_nonzero(start) == 1


def test_constraint_between_states_is_differentiated():
    model = causal(MODELS / "RigidInertias.mo")
    assert set(model.states) == {"w1", "phi1"}
    got = Evaluated(model).at([3.0, 10.0] if model.states[0] == "w1" else [10.0, 3.0], [7.0])
    assert got["der(w1)"] == pytest.approx(7.0 / (2 + 3 / 25))
    assert got["w2"] == pytest.approx(3 / 5)
    assert got["phi2"] == pytest.approx(2.0)


@pytest.mark.parametrize("size", [2, 3, 5])
def test_linear_loops_of_any_size_equal_numpy(tmp_path, size):
    rng = np.random.default_rng(size)
    matrix = rng.normal(size=(size, size)) + 3 * np.eye(size)
    rows = [
        " + ".join(f"({float(matrix[r, c])!r})*z{c}" for c in range(size)) + f" = u + {r}"
        for r in range(size)
    ]
    source = (
        "model M input Real u; "
        + " ".join(f"Real z{i};" for i in range(size))
        + " Real x(start=0, fixed=true);"
    )
    source += " equation " + "; ".join(rows) + "; der(x) = z0 - x; end M;"
    got = Evaluated(causal(source, tmp_path)).at([0.5], [2.0])
    expected = np.linalg.solve(matrix, 2.0 + np.arange(size))
    np.testing.assert_allclose([got[f"z{i}"] for i in range(size)], expected, rtol=1e-10)


def test_relations_become_modes_only_where_they_must(tmp_path):
    source = """model M
      parameter Real p = 1; parameter Boolean on = true; input Real u; Real x(start=0, fixed=true);
      Real y; Real z; Real q;
      Boolean b;
    equation
      der(x) = u;
      y = if p > 0 and on then x else -x;
      z = noEvent(if x > 0.5 then 1 else 0);
      b = x > 0.25;
      q = (if b then 2 else 3) + max(x, u) + abs(x) + sign(x) + min(x, 1);
    end M;"""
    model = causal(source, tmp_path)
    assert (
        model.m.numel() == 5
    )  # b, max, abs (shared with sign), the other half of sign, min; not p, not noEvent
    got = Evaluated(model).at([0.3], [0.1])
    assert got["y"] == 0.3
    assert got["z"] == 0.0
    assert got["q"] == pytest.approx(2 + 0.3 + 0.3 + 1 + 0.3)
    got = Evaluated(model).at([-0.3], [0.1])
    assert got["q"] == pytest.approx(3 + 0.1 + 0.3 - 1 - 0.3)


def test_parameters_that_depend_on_others_are_calculated(tmp_path):
    source = """model M
      parameter Integer n = 3; constant Real c = 2.5; parameter Real a = 2*c + n; parameter Real b = a^2;
      final parameter Real d = b + 1; parameter Real v[2] = {10, 20};
      Real x(start=a, fixed=true); Real y;
    equation
      der(x) = -x; y = b + d + v[2];
    end M;"""
    model = causal(source, tmp_path)
    kinds = {v.name: v.kind for v in model.variables}
    assert kinds["n"] == "parameter"
    assert kinds["a"] == kinds["b"] == kinds["d"] == "dependent"
    evaluated = Evaluated(model)
    assert evaluated.at([0.0])["y"] == 64 + 65 + 20
    assert evaluated.at([0.0], parameters={"n": 1.0})["y"] == 36 + 37 + 20
    start = np.array(evaluated.start(0, [0.0], [], evaluated.p, [])).ravel()
    assert start == [8.0]


REFUSED = {
    "external function": (
        'function f input Real a; output Real b; external "C"; end f; Real x(start=1); equation der(x) = -f(x);',
        "written in C",
    ),
    "comparison of Reals": (
        "Real x(start=1, fixed=true); equation der(x) = if x == 0.5 then 1 else 0;",
        "which has no event",
    ),
    "input derivative": (
        "input Real u; Real x(start=0); Real y; equation x = u; der(x) = y;",
        "derivative",
    ),
    "singular": (
        "Real x(start=1, fixed=true); Real a; Real b; equation der(x) = -x; a + b = x; 2*a + 2*b = x + time; ",
        "singular",
    ),
    "delay": ("Real x(start=1, fixed=true); equation der(x) = -delay(x, 0.1);", "delay"),
    "too many equations": (
        "Real x(start=1, fixed=true); Real y; equation der(x) = -x; y = x; y = 2*x;",
        "one too many",
    ),
    "overdetermined": (
        "Real x(start=1, fixed=true); initial equation x = 2; equation der(x) = -x;",
        "over-determined",
    ),
    "syntax": ("Real x(start=1) equation der(x) = -x;", "M.mo:1: syntax: ';' is expected"),
    "unknown class": (
        "Foo.Bar b; Real x(start=1); equation der(x) = -x;",
        "class Foo.Bar is not found. Add the folder",
    ),
    "unknown name": (
        "Real x(start=1); equation der(x) = -xx;",
        "the name xx is not known. Did you mean 'x'?",
    ),
    "unknown modification": ("Real x(start=1, strt=2); equation der(x) = -x;", "no attribute strt"),
    "assertion on constants": (
        'parameter Integer n = 2; Real x(start=1); equation der(x) = -x; assert(n > 2, "n is too small");',
        "n is too small",
    ),
}


@pytest.mark.parametrize("name", sorted(REFUSED))
def test_unsupported_models_get_one_sentence(tmp_path, name):
    body, word = REFUSED[name]
    with pytest.raises(ThsaCosimError) as caught:
        causal(f"model M {body} end M;", tmp_path)
    assert word in str(caught.value)
    assert "\n" not in str(caught.value)


def test_unknown_class_is_answered_with_the_closest():
    with pytest.raises(ModelicaError, match=r"THSA holds no class 'Actuatr'\. Did you mean 'Actuator'"):
        flatten("Actuatr", THSA)


@pytest.mark.parametrize(
    ("part", "why", "whole"),
    [
        ("Motor", "the input T_w starts at T, which is no parameter or constant.", "THSA.Benches.Motor"),
        ("Screw", "structurally singular", "THSA.Actuator"),
        ("NoBack", "singular", "THSA.Actuator"),
    ],
)
def test_a_part_that_cannot_stand_alone_is_answered_with_the_models_that_hold_it(
    part: str, why: str, whole: str
):
    with pytest.raises(ModelicaError) as caught:
        causal_model(f"THSA.{part}", THSA)
    assert str(caught.value).startswith(f"THSA.{part}: {why}")
    assert f"To use it as a part, export a model that holds it: {whole}, " in str(caught.value)


def test_a_part_with_a_mistake_in_its_text_is_answered_with_the_mistake_alone(tmp_path: Path):
    package = tmp_path / "P"
    package.mkdir()
    (package / "package.mo").write_text("package P end P;")
    (package / "Whole.mo").write_text("within P; model Whole\n  P.Part part;\nend Whole;")
    part = "within P; model Part Real x(start=1, fixed=true); Real y; equation der(x) = -{}; end Part;"
    for name in ("x", "z"):
        (package / "Part.mo").write_text(part.format(name))
        with pytest.raises(ModelicaError) as caught:
            causal_model("P.Part", package)
        assert str(caught.value).endswith("export a model that holds it: P.Whole.") is (name == "x")


def test_unknown_start_value_is_refused(tmp_path):
    with pytest.raises(ParameterError, match="Did you mean 'k'"):
        export_fmu(
            str(MODELS / "Dahlquist.mo"), package=THSA, output=tmp_path / "a.fmu", start_values={"kk": 1.0}
        )


def test_omc_is_asked_for_only_where_it_is(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ModelicaError, match="omc"):
        export_fmu("THSA.Actuator", package=THSA, compiler="omc")


@pytest.mark.parametrize(
    ("unit", "exponents", "factor"),
    [
        ("N.m", {"kg": 1, "m": 2, "s": -2}, 1.0),
        ("N.m.s/(rad.K2)", {"kg": 1, "m": 2, "s": -1, "K": -2, "rad": -1}, 1.0),
        ("A.s/rad", {"s": 1, "A": 1, "rad": -1}, 1.0),
        ("mm/s", {"m": 1, "s": -1}, 1e-3),
        ("Ohm", {"kg": 1, "m": 2, "s": -3, "A": -2}, 1.0),
        ("1", {}, 1.0),
        ("1/s", {"s": -1}, 1.0),
        ("rev/min", {"rad": 1, "s": -1}, 2 * np.pi / 60),
    ],
)
def test_units_have_base_exponents(unit, exponents, factor):
    base = base_unit(unit)
    assert base.exponents == exponents
    assert base.factor == pytest.approx(factor)


def test_every_parameter_of_the_package_has_unit_description_and_bounds():
    missing = []
    for name in ("Actuator", "Benches.Motor", "Benches.Gearbox", "Benches.Screw"):
        for variable in make_causal(flatten(f"THSA.{name}", THSA)).variables:
            if variable.kind == "parameter" and not (
                variable.unit
                and variable.description
                and variable.minimum is not None
                and variable.maximum is not None
            ):
                missing.append(f"{name}: {variable.name}")
            if variable.causality in ("input", "output") and not (variable.unit and variable.description):
                missing.append(f"{name}: {variable.name}")
    assert missing == []


def test_flatten_reads_the_experiment():
    experiment = flatten("THSA.Benches.Motor", THSA).experiment
    assert (experiment.start, experiment.stop, experiment.tolerance, experiment.interval) == (
        0,
        10,
        1e-6,
        1e-3,
    )
