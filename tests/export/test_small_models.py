"""Small models, each in an FMU of its own because what they show concerns the exported class itself."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("casadi", reason="the export extra is not installed")
pytest.importorskip("ziglang", reason="the export extra is not installed")

import fmpy

from thsa_cosim.export import export_fmu

pytestmark = pytest.mark.slow
e = np.exp
Reference = Callable[[np.ndarray], np.ndarray]
# source, variable, its values over time, start values
MODELS: dict[str, tuple[str, str, Reference, dict[str, float]]] = {
    "Integer parameter": (
        "parameter Integer n=3; parameter Real k=n/2; Real x(start=1, fixed=true); equation der(x) = -k*x;",
        "x", lambda t: e(-2.5 * t), {"n": 5},
    ),
    "Boolean parameter of a component": (
        "model A parameter Boolean up=true; Real x(start=0, fixed=true); equation der(x) = if up then 1 else -2; "
        "end A; parameter Boolean on=true; A a(up=on); equation",
        "a.x", lambda t: -2 * t, {"on": False},
    ),
    "enumeration parameter": (
        "type E=enumeration(a, b, c); parameter E m=E.a; Real x(start=0, fixed=true); "
        "equation der(x) = if m == E.a then 1 elseif m == E.b then 2 else 3;",
        "x", lambda t: 3 * t, {"m": 3},
    ),
    "Boolean and Integer inputs": (
        "input Boolean on(start=true); input Integer n(start=2); Real x(start=0, fixed=true); "
        "equation der(x) = if on then n else 0;",
        "x", lambda t: 2 * t, {},
    ),
    "protected input": (
        "connector I=input Real; connector O=output Real; block C parameter Real k=1; O y; equation y = k; end C; "
        "parameter Boolean other=false; C a(k=3) if not other; C b(k=5) if other; Real x(start=0, fixed=true); "
        "protected I u; equation connect(a.y, u); connect(b.y, u); der(x) = u;",
        "x", lambda t: 3 * t, {},
    ),
    "class extends": (
        "package P replaceable model X parameter Real k=1; Real x(start=1, fixed=true); equation der(x) = -k*x; end X; "
        "end P; package Q extends P; redeclare model extends X(k=3) Real y; equation y = 2*x; end X; "
        "end Q; Q.X z; equation",
        "z.y", lambda t: 2 * e(-3 * t), {},
    ),
    "function as an argument": (
        "partial function F input Real x; output Real y; end F; "
        "function power extends F; input Real n; algorithm y := x^n; end power; "
        "function simpson input F g; input Real a; output Real y; algorithm y := (g(0) + 4*g(a/2) + g(a))*a/6; "
        "end simpson; Real x(start=0, fixed=true); equation der(x) = simpson(function power(n=2), 3);",
        "x", lambda t: 9 * t, {},
    ),
    "derivative of a derivative": (
        "Real x(start=1, fixed=true); Real v(start=0, fixed=true); equation v = der(x); der(der(x)) = -x;",
        "x", lambda t: np.cos(t), {},
    ),
    "enumeration set by when": (
        "type S=enumeration(idle, run, stop); S s(start=S.idle, fixed=true); Real x(start=0, fixed=true); equation "
        "when time > 0.25 then s = S.run; elsewhen time > 0.75 then s = S.stop; end when; "
        "der(x) = if s == S.run then 2 else 0;",
        "x", lambda t: np.interp(t, [0, 0.25, 0.75, 1], [0, 0, 1, 1]), {},
    ),
    "each with a vector": (
        "model R parameter Real k[2]={1, 1}; Real x(start=1, fixed=true); equation der(x) = -k*{1, 1}*x; end R; "
        "R r[2](each k={1, 2}); equation",
        "r[2].x", lambda t: e(-3 * t), {},
    ),
    "external C of math.h": (
        'function s input Real x; output Real y; external "C" y = sin(x); end s; '
        "Real x(start=0, fixed=true); equation der(x) = s(time);",
        "x", lambda t: 1 - np.cos(t), {},
    ),
    "while loop over a table": (
        "function look input Real x; input Real X[:]; input Real Y[:]; output Real y; protected Integer i; algorithm "
        "i := 1; while i < size(X, 1) - 1 and x >= X[i + 1] loop i := i + 1; end while; "
        "y := Y[i] + (x - X[i])*(Y[i + 1] - Y[i])/(X[i + 1] - X[i]); end look; "
        "Real x(start=0, fixed=true); Real y = look(x, {0, 0.25, 1}, {0, 1, 4}); equation der(x) = 1;",
        "y", lambda t: np.interp(t, [0, 0.25, 1], [0, 1, 4]), {},
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", sorted(MODELS))
def test_small_model_equals_its_closed_form(tmp_path: Path, name: str) -> None:
    body, variable, reference, start = MODELS[name]
    file = tmp_path / "M.mo"
    file.write_text(f"model M {body} end M;\n", encoding="utf-8")
    fmu = export_fmu(str(file), package=tmp_path / "none", output=tmp_path / "M.fmu", platforms=["linux64"])
    for kind in ("CoSimulation", "ModelExchange"):
        run = fmpy.simulate_fmu(
            str(fmu), stop_time=1.0, output_interval=0.01, relative_tolerance=1e-8, start_values=start,
            output=[variable], fmi_type=kind,
        )  # fmt: skip
        assert run["time"][-1] == pytest.approx(1.0)
        assert run[variable] == pytest.approx(reference(run["time"]), abs=2e-4)
