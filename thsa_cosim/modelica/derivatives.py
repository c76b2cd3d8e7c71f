"""Derivatives of derivatives: ``der(der(x))`` gets a variable for the inner one, which may become a state."""

from __future__ import annotations

from dataclasses import replace

from thsa_cosim.modelica.flat import FlatEquation, FlatVariable
from thsa_cosim.modelica.terms import Scalar, Term, make, substitute, walk


def with_rates(
    equations: list[FlatEquation], initial: list[FlatEquation], variables: dict[str, FlatVariable]
) -> tuple[list[FlatEquation], list[FlatEquation], dict[str, FlatVariable]]:
    """The equations without nested derivatives, and the variables with those that this takes.

    A derivative inside of ``der(…)`` becomes the variable ``_der_<k>``, with the equation that defines it.
    """
    roots = [side for e in (*equations, *initial) for side in (e.left, e.right)]
    roots += [v.binding for v in variables.values() if v.binding is not None]
    inner = {
        str(t.args[0]): t
        for outer in walk(roots)
        if outer.op == "der"
        for t in walk(outer.args)
        if t.op == "der"
    }
    if not inner:
        return equations, initial, variables
    made: dict[str, str] = {}
    added: list[FlatEquation] = []
    extended = dict(variables)

    def inside(term: Term) -> Scalar | None:
        if term.op != "der":
            return None
        argument = substitute(term.args[0], inside, {})
        key = str(argument)
        if key not in made:
            made[key] = name = f"_der_{len(made) + 1}"
            extended[name] = _rate(name, f"Time derivative of {key}")
            added.append(FlatEquation(Term("ref", (name,)), make("der", argument), ""))
        return Term("ref", (made[key],))

    def outside(term: Term) -> Scalar | None:
        if term.op != "der":
            return None
        return make("der", substitute(term.args[0], inside, {}))

    def rewritten(equation: FlatEquation) -> FlatEquation:
        left, right = (substitute(side, outside, {}) for side in (equation.left, equation.right))
        return FlatEquation(left, right, equation.place, equation.event)

    for name, variable in variables.items():
        if isinstance(variable.binding, Term):
            extended[name] = replace(variable, binding=substitute(variable.binding, outside, {}))
    equations, initial = [rewritten(e) for e in equations], [rewritten(e) for e in initial]
    return [*equations, *added], initial, extended


def _rate(name: str, description: str) -> FlatVariable:
    return FlatVariable(
        name, "Real", "continuous", "local", None, None, description, None, None, None, None, None, None, False,
        "default", False, "",
    )  # fmt: skip
