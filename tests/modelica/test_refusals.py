"""Models that Modelica does not allow are refused, each with the file, the line and what is wrong."""

from pathlib import Path

import pytest

ca = pytest.importorskip("casadi", reason="the export extra is not installed")

from thsa_cosim.errors import ModelicaError
from thsa_cosim.export import causal_model

DECAY = "Real x(start=1, fixed=true); equation der(x) = -x;"
COIL = "model Coil parameter Real k=1; Real i(start=1, fixed=true); equation der(i) = -k*i; end Coil; "
WRONG = {
    "misspelt modification": (COIL + f"Coil c(kk=2); {DECAY}", "M.Coil has no kk to modify. Did you mean 'k'?"),
    "misspelt in extends": (COIL + "extends Coil(kk=2);", "M.Coil has no kk to modify"),
    "misspelt in a redeclaration": (
        COIL + "model Bench replaceable model Part=Coil; Part p; end Bench; "
        f"Bench b(redeclare model Part=Coil(r=1)); {DECAY}",
        "has no r to modify",
    ),
    "misspelt attribute": ("Real x(strat=1, fixed=true); equation der(x) = -x;", "no attribute strat"),
    "three values for two": (
        "Real x[2](start={1, 2, 3}, each fixed=true); equation der(x) = -x;",
        "3 values are given for",
    ),
    "two values for three": (
        "Real x[3](start={1, 2}, each fixed=true); equation der(x) = -x;",
        "2 values are given for",
    ),
    "number as a condition": (
        "Real x(start=1, fixed=true); equation der(x) = if x then 1 else 2;",
        "x is a number; it has to be a Boolean",
    ),
    "Boolean in a sum": ("Real x(start=1, fixed=true); equation der(x) = x + true;", "it has to be a number"),
    "Boolean and number": (
        "Real x(start=1, fixed=true); equation der(x) = if time > 1 then true else 2;",
        "one branch of",
    ),
    "declared twice": ("Real x(start=1, fixed=true); Real x; equation der(x) = -x;", "x is declared twice"),
    "not replaceable": (
        COIL + "model Other extends Coil; end Other; model Bench Coil c; end Bench; "
        f"Bench b(redeclare Other c); {DECAY}",
        "c is redeclared, but is not declared replaceable",
    ),
    "does not fit": (
        COIL + "model Other parameter Real z=1; end Other; model Bench replaceable Coil c; end Bench; "
        f"Bench b(redeclare Other c); {DECAY}",
        "M.Other cannot replace c: it has no k, unlike M.Coil",
    ),
    "component for a class": (
        COIL + f"model Bench replaceable model Part=Coil; Part p; end Bench; Bench b(redeclare Coil Part); {DECAY}",
        "Part is a class, not a component",
    ),
    "contains itself": (f"model A A a; end A; A a; {DECAY}", "contains itself without end"),
    "expandable connector": (
        "expandable connector Bus end Bus; Bus bus; connector O=output Real; block S O y=time; end S; S s; "
        "Real x(start=1, fixed=true); equation der(x) = -x; connect(s.y, bus.speed);",
        "expandable connectors are a limit",
    ),
    "endless loop": (
        "function root input Real a; output Real y; algorithm y := a; while abs(y^2 - a) > 1e-9 loop y := (y + a/y)/2; "
        "end while; end root; Real x(start=4, fixed=true); Real y = root(x); equation der(x) = -x;",
        "a while loop on a condition unknown at export",
    ),
    "assertion on a parameter": (
        f'parameter Integer n=2; {DECAY} assert(n > 2, "n is too small");',
        "n is too small",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", sorted(WRONG))
def test_what_modelica_does_not_allow_is_refused_with_its_place(tmp_path: Path, name: str) -> None:
    body, words = WRONG[name]
    file = tmp_path / "M.mo"
    file.write_text(f"model M {body} end M;\n", encoding="utf-8")
    with pytest.raises(ModelicaError) as caught:
        causal_model(str(file), tmp_path / "none")
    assert words in str(caught.value)
    assert "M.mo:1" in str(caught.value)


def test_parameters_that_shape_the_equations_are_fixed_at_export(tmp_path: Path) -> None:
    file = tmp_path / "M.mo"
    file.write_text(
        """model M
          parameter Integer n = 2; parameter Integer m = 3; parameter Boolean fast = true;
          parameter Boolean dynamic = false;
          Real x[n](each start=1, each fixed=true); Real y;
        equation
          for i in 1:n loop der(x[i]) = if fast then -m*x[i] else -x[i]; end for;
          if dynamic then der(y) = x[1] - y; else y = x[1]; end if;
        end M;""",
        encoding="utf-8",
    )
    model = causal_model(str(file), tmp_path / "none")
    assert {v.name: v.start for v in model.variables if v.kind == "parameter"} == {"m": 3.0, "fast": 1.0}
    assert model.states == ("x[1]", "x[2]")


def test_a_homotopy_makes_no_difference_while_the_model_runs(tmp_path: Path) -> None:
    file = tmp_path / "M.mo"
    file.write_text(
        "model M Real x(start=1, fixed=true); Real y = homotopy(actual=if x > 2 then 2 else x, simplified=0);\n"
        "Real z = homotopy(2*x, x); equation der(x) = -x; end M;",
        encoding="utf-8",
    )
    model = causal_model(str(file), tmp_path / "none")
    assert not {"homotopy()"} & {
        str(s) for part in (model.rhs, model.w, model.initial) for s in ca.symvar(part)
    }


@pytest.mark.parametrize(
    ("source", "said"),
    [
        ("model M Real u = sin(time); Real y(start=-1); equation "
         "y = noEvent(if 10*(u + y) > 1 then 1 elseif 10*(u + y) < -1 then -1 else 10*(u + y)); end M;",
         "the loop of y has several solutions at once"),
        ("model M Real x = true; end M;", "of x = true, one side is a Boolean, the other a number"),
        ("operator record V Real x; encapsulated operator function '+' input V a; input V b; output V c; "
         "algorithm c.x := a.x; end '+'; end V; model M V a(x=1); V b(x=2); V c = a / b; end M;",
         r"the record V defines no operator / for these operands"),
        ("function f input Real u; output Real y; algorithm end f; model M Real y = f(time); end M;",
         r"f\(\) gives y no value"),
        ("function f input Real u; output Real y; protected Real a[2]; algorithm a[1] := u; y := sum(a); end f; "
         "model M Real y = f(time); end M;",
         "a is used before it has a value"),
        ("partial model M Real x; end M;", "M is partial; a complete model is needed to export"),
        ("model M Real x(start=1, fixed=true); discrete Real y(start=0); equation der(x) = -x; "
         "when sample(0, x) then y = time; end when; end M;",
         r"the times of a sample\(\) have to be parameters, but depend on x"),
        ("model M parameter Real m = 0; Real x(start=1, fixed=true); Real y; equation der(x) = -x; m*y = x; end M;",
         "singular with the parameters as they are: y cannot be solved from"),
    ],
    ids=["several solutions", "types", "operator record", "no output", "not assigned",
         "partial", "sample at a variable pace", "zero coefficient"],
)  # fmt: skip
def test_what_would_be_wrong_is_refused_by_name(tmp_path: Path, source: str, said: str) -> None:
    file = tmp_path / "M.mo"
    file.write_text(source, encoding="utf-8")
    with pytest.raises(ModelicaError, match=said):
        causal_model(str(file), tmp_path / "none")


DOUBTED = {
    "what only a tool knows": (
        "model M Real x(start=1, fixed=true); discrete Real y(start=0, fixed=true); equation der(x) = -x; "
        "when terminal() then y = x; end when; end M;",
        r"M.mo:1: terminal\(\) is taken as false",
    ),
    "an output without a value in a branch": (
        "model M Real y = f(time); end M; function f input Real u; output Real y; algorithm "
        "if u > 0.5 then y := 1; end if; end f;",
        r"M.mo:1: f\(\) gives y no value in one of its branches",
    ),
}


@pytest.mark.parametrize(("source", "said"), DOUBTED.values(), ids=DOUBTED)
def test_what_may_be_wrong_is_a_named_doubt(tmp_path: Path, source: str, said: str) -> None:
    file = tmp_path / "M.mo"
    file.write_text(source, encoding="utf-8")
    with pytest.warns(UserWarning, match=said):
        causal_model(str(file), tmp_path / "none")
