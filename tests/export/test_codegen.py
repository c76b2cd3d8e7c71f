"""The generated C against CasADi's own evaluation of the same expressions, at random points and modes."""

import ctypes
import sys
from pathlib import Path

import numpy as np
import pytest

ca = pytest.importorskip("casadi", reason="the export extra is not installed")
pytest.importorskip("ziglang", reason="the export extra is not installed")

from thsa_cosim.export.archive import make_sources
from thsa_cosim.export.causal import make_causal
from thsa_cosim.export.codegen import first_value_references, model_source
from thsa_cosim.export.compile import PLATFORMS, compile_library
from thsa_cosim.export.flatten import flatten

REPO = Path(__file__).parents[2]
MODELS = Path(__file__).parents[1] / "modelica"
THSA = REPO / "modelica" / "THSA"
SUFFIX = {"linux": ".so", "darwin": ".dylib", "win32": ".dll"}[sys.platform]


class Compiled:
    """``model.c`` of a causal model as a shared library."""

    def __init__(self, model, folder: Path) -> None:
        self.model = model
        sources = make_sources(model, 2)
        for name, content in sources.files.items():
            (folder / name).write_bytes(content)
        header = (folder / "model.h").read_text()
        (folder / "model.h").write_text("#pragma GCC visibility push(default)\n" + header)
        platform = next(p for p in PLATFORMS if p.suffix == SUFFIX)
        compile_library(folder, ["model.c"], platform, folder / f"model{SUFFIX}")
        self.library = ctypes.CDLL(str(folder / f"model{SUFFIX}"))
        self.d = np.full(model.d.numel() + model_source(model).cache + 1, np.nan)

    def call(self, name, size, *arguments):
        result = [np.full(max(1, n), np.nan) for n in size]
        if name == "jacobian":  # entries of A and B that are always 0 are the caller's
            result[:2] = [np.zeros(max(1, n)) for n in size[:2]]
        passed = [
            ctypes.c_double(a) if isinstance(a, float) else a.ctypes.data_as(ctypes.c_void_p)
            for a in arguments
        ]
        passed += [r.ctypes.data_as(ctypes.c_void_p) for r in result]
        assert getattr(self.library, f"model_{name}")(*passed) == 0
        return [r[:n] for r, n in zip(result, size, strict=True)]

    def set_parameters(self, p):
        self.library.model_dependent(
            p.ctypes.data_as(ctypes.c_void_p), self.d.ctypes.data_as(ctypes.c_void_p)
        )


@pytest.mark.parametrize("source", ["THSA.Actuator", "THSA.Benches.Gearbox", "Pendulum.mo", "StickSlip.mo"])
def test_every_function_equals_casadi(tmp_path, source):
    model = make_causal(flatten(str(MODELS / source) if source.endswith(".mo") else source, THSA))
    compiled = Compiled(model, tmp_path)
    t, x, u, p, d, m = (model.time, model.x, model.u, model.p, model.d, model.m)
    n_x, n_u, n_p, n_w, n_g = (c.numel() for c in (x, u, p, model.w, model.g))
    seeds = [ca.SX.sym(s, n) for s, n in (("sx", n_x), ("su", n_u), ("sp", n_p))]
    with_dependent = ca.substitute([model.rhs, model.w, model.g], [d], [model.dependent])
    both = ca.vertcat(with_dependent[0], with_dependent[1])
    reference = {
        "rhs": ca.Function("f", [t, x, u, p, m], [with_dependent[0]]),
        "w": ca.Function("f", [t, x, u, p, m], [with_dependent[1]]),
        "g": ca.Function("f", [t, x, u, p, m], [with_dependent[2]]),
        "jacobian": ca.Function(
            "f", [t, x, u, p, m], [ca.densify(ca.jacobian(with_dependent[0], v)) for v in (x, u, t)]
        ),
        "directional": ca.Function(
            "f", [t, x, u, p, m, *seeds], [ca.jtimes(both, ca.vertcat(x, u, p), ca.vertcat(*seeds))]
        ),
    }
    rng = np.random.default_rng(3)
    starts = {v.index: v.start for v in model.variables if v.kind == "parameter"}
    nominal = np.array([starts[i] for i in range(n_p)])
    named = {v.name: v.index for v in model.variables if v.kind == "parameter"}
    for trial in range(60):
        if trial % 3 == 0:  # keep parameters for some points, so that the cache is both used and renewed
            parameters = nominal * rng.uniform(0.8, 1.2, n_p)
            for name, index in named.items():
                if name.endswith("r_b"):
                    parameters[index] = rng.choice([0.7, 1.0, 1.6])
            compiled.set_parameters(parameters)
        if trial % 2 == 0:
            inputs = rng.normal(size=n_u) * 10
        state, modes, time = rng.normal(size=n_x), rng.integers(0, 2, n_g).astype(float), float(rng.uniform())
        at = (time, state, inputs, parameters, compiled.d, modes)
        given = (time, state, inputs, parameters, modes)

        def close(got, wanted):
            wanted = np.array(wanted).ravel(order="F")
            np.testing.assert_allclose(
                got, wanted, rtol=1e-9, atol=1e-12 * max(1.0, np.abs(wanted).max(initial=0))
            )

        close(compiled.call("rhs", [n_x], *at)[0], reference["rhs"](*given))
        wanted = reference["w"](*given)
        close(compiled.call("algebraic", [n_w], *at)[0], wanted)
        close(compiled.call("outputs", [model.outputs], *at)[0], wanted[: model.outputs])
        close(compiled.call("indicators", [n_g], *at)[0], reference["g"](*given))
        for got, matrix in zip(
            compiled.call("jacobian", [n_x * n_x, n_x * n_u, n_x], *at),
            reference["jacobian"](*given),
            strict=True,
        ):
            close(got, matrix)
        directions = [rng.normal(size=n) for n in (n_x, n_u, n_p)]
        got = np.concatenate(compiled.call("directional", [n_x, n_w], *at, *directions))
        close(got, reference["directional"](*given, *directions))


def test_value_references_do_not_overlap():
    model = make_causal(flatten("THSA.Actuator", THSA))
    first = first_value_references(model)
    assert list(first) == [
        "state",
        "derivative",
        "input",
        "parameter",
        "dependent",
        "algebraic",
        "indicator",
        "end",
    ]
    assert first["state"] == 1
    assert sorted(first.values()) == list(first.values())


def test_models_that_differ_in_values_alone_differ_in_one_short_file(tmp_path: Path) -> None:
    """So that a compiler that keeps objects, as zig does, compiles hundreds of bytes and not the equations."""
    text = "model M\n  parameter Real k = {};\n  Real x(start = {}, fixed = true);\nequation der(x) = -k*x;\nend M;\n"
    made = []
    for k, start in ((1.0, 2.0), (1.5, -3.0)):
        (tmp_path / "M.mo").write_text(text.format(k, start))
        made.append(make_sources(make_causal(flatten(str(tmp_path / "M.mo"), THSA)), 2))
    one, other = made
    assert one.token != other.token
    assert one.files.keys() == other.files.keys()
    differing = [name for name, content in one.files.items() if other.files[name] != content]
    assert differing == ["model_start.c"]
    assert "model_start.c" in one.compiled
    assert len(other.files["model_start.c"]) < 1000
    assert f'"{other.token}"'.encode() in other.files["model_start.c"]
    assert b"{(-3.0)}" in other.files["model_start.c"]
