"""C statements of a graph, compiled and run, against CasADi's own evaluation of the same expressions."""

import ctypes
import sys
from itertools import product

import numpy as np
import pytest

ca = pytest.importorskip("casadi", reason="the export extra is not installed")
pytest.importorskip("ziglang", reason="the export extra is not installed")

from thsa_cosim.export.compile import PLATFORMS, compile_library
from thsa_cosim.export.emit import statements
from thsa_cosim.export.expression import select
from thsa_cosim.export.graph import Graph

SUFFIX = {"linux": ".so", "darwin": ".dylib", "win32": ".dll"}[sys.platform]
X = [ca.SX.sym(name) for name in ("c", "d", "v", "w")]
C, D, V, W = X
BOTH = select(C, V, W)

CHOICES = {
    "plain": [BOTH],
    "of a negation": [select(ca.logic_not(C), V, W)],
    "a chain": [select(C, V, select(D, W, select(V > W, V * W, V - W)))],
    "the branch is used elsewhere, too": [BOTH, ca.if_else(C, V, 0)],
    "the negation is used elsewhere, too": [BOTH, ca.logic_not(C)],
    "the negation is a value of another choice": [select(C, V, W), select(D, ca.logic_not(C), V > W)],
    "a condition that is a choice": [select(select(C, D, ca.logic_not(D)), V, W)],
    "nested negations": [select(D, select(ca.logic_not(C), ca.logic_not(D), V), ca.logic_not(C))],
    "one costly branch": [select(C, ca.exp(ca.sin(V)), W)],
    "two costly branches": [select(C, ca.exp(ca.sin(V)), ca.exp(ca.cos(W)))],
    "inside of a costly branch": [select(C, ca.exp(select(D, V, W)) * BOTH, select(D, W, V))],
    "shared by two blocks": [select(C, ca.exp(V) * select(D, V, W), W), select(C, ca.sin(V) + select(D, V, W), V)],
}  # fmt: skip


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    """All cases as functions f0, f1, … of one library; unused variables are errors."""
    text = [
        "#include <math.h>",
        "#pragma GCC visibility push(default)",
        '#pragma GCC diagnostic error "-Wunused"',
    ]
    for k, expressions in enumerate(CHOICES.values()):
        graph = Graph()
        outputs = [(f"y[{i}]", graph.add(expression)) for i, expression in enumerate(expressions)]
        symbols = {symbol.name(): f"x[{i}]" for i, symbol in enumerate(X)}
        body = statements(graph, outputs, symbols, {})
        text += [f"void f{k}(const double *x, double *y) {{", *body, "}"]
    folder = tmp_path_factory.mktemp("choices")
    (folder / "cases.c").write_text("\n".join(text) + "\n")
    compile_library(
        folder, ["cases.c"], next(p for p in PLATFORMS if p.suffix == SUFFIX), folder / f"cases{SUFFIX}"
    )
    return ctypes.CDLL(str(folder / f"cases{SUFFIX}")), "\n".join(text)


@pytest.mark.parametrize("case", list(CHOICES))
def test_conditionals_equal_casadi(compiled, case):
    expressions = CHOICES[case]
    function = getattr(compiled[0], f"f{list(CHOICES).index(case)}")
    function.argtypes = 2 * [ctypes.c_void_p]
    expected = ca.Function("expected", [ca.vertcat(*X)], [ca.vertcat(*expressions)])
    rng = np.random.default_rng(20)
    for c, d in product((0.0, 1.0), repeat=2):
        for _ in range(5):
            x = np.array([c, d, *rng.normal(size=2)])
            y = np.full(len(expressions), np.nan)
            function(x.ctypes.data, y.ctypes.data)
            np.testing.assert_array_max_ulp(y, np.asarray(expected(x)).ravel(), maxulp=2)


def test_a_choice_is_one_statement_and_lets_no_nan_through(compiled):
    library, text = compiled
    assert "x[0] != 0.0 ? x[2] : x[3];" in text
    library.f0.argtypes = 2 * [ctypes.c_void_p]
    x, y = np.array([1.0, 0.0, 2.5, np.nan]), np.zeros(1)
    library.f0(x.ctypes.data, y.ctypes.data)
    assert y[0] == 2.5
