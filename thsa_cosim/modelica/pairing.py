"""What the equations of branches, loops and algorithms are made of: pairs of sides, edges, ranges, assigned names."""

from __future__ import annotations

from typing import Any

from thsa_cosim.errors import ModelicaError
from thsa_cosim.modelica.arrays import Record, Value, elements, shape
from thsa_cosim.modelica.evaluate import Evaluator, bound
from thsa_cosim.modelica.flat import FlatEquation
from thsa_cosim.modelica.scope import DISABLED, Scope
from thsa_cosim.modelica.syntax import Equation, Syntax
from thsa_cosim.modelica.terms import Scalar, Term, make, plain, walk


def paired(left: Value, right: Value, place: str) -> list[FlatEquation]:
    """Scalar equations of ``left = right``."""
    if isinstance(left, Record) and isinstance(right, Record):
        missing = set(left.fields) ^ set(right.fields)
        if missing:
            raise ModelicaError(f"{place}: the records of the two sides differ in {sorted(missing)[0]}.")
        return [e for key in left.fields for e in paired(left.fields[key], right.fields[key], place)]
    if isinstance(left, list) and isinstance(right, list):
        if len(left) != len(right):
            raise ModelicaError(
                f"{place}: the sides of the equation have the sizes {list(shape(left))} and {list(shape(right))}."
            )
        return [e for a, b in zip(left, right, strict=True) for e in paired(a, b, place)]
    if isinstance(left, (list, Record)) or isinstance(right, (list, Record)):
        raise ModelicaError(f"{place}: one side of the equation is an array or a record, the other is not.")
    if isinstance(left, str) or isinstance(right, str):
        return []
    if not isinstance(left, Term) and not isinstance(right, Term) and plain(left) == plain(right):
        return []
    return [FlatEquation(left, right, place)]


def edges(condition: Value) -> Scalar:
    """When a when clause with this condition becomes active."""
    result: Scalar = False
    for part in elements(condition):
        if isinstance(part, Term):
            active = part if part.op in ("initial", "sample") else Term("edge", (part,))
            result = make("or", result, active)
    return result


def selected(conditions: list[Scalar], sides: list[list[FlatEquation]], place: str) -> list[FlatEquation]:
    """Equations that choose between those of the branches."""

    def target(equation: FlatEquation) -> str | None:
        left = equation.left
        return left.args[0] if isinstance(left, Term) and left.op == "ref" else None

    first = [target(e) for e in sides[0]]
    by_name = None not in first and all(
        sorted(map(str, map(target, s))) == sorted(map(str, first)) for s in sides
    )
    if by_name and len(set(first)) == len(first):
        sides = [sorted(side, key=lambda e: first.index(target(e))) for side in sides]
    made = []
    for row in zip(*sides, strict=True):
        if len({target(e) for e in row}) == 1 and target(row[0]) is not None:
            value = row[-1].right
            for condition, equation in zip(reversed(conditions), reversed(row[:-1]), strict=True):
                value = make("if", condition, equation.right, value)
            made.append(FlatEquation(row[0].left, value, place))
            continue
        residual = make("-", row[-1].left, row[-1].right)
        for condition, equation in zip(reversed(conditions), reversed(row[:-1]), strict=True):
            residual = make("if", condition, make("-", equation.left, equation.right), residual)
        made.append(FlatEquation(residual, 0.0, place))
    return made


def assigns_alike(sides: list[list[FlatEquation]]) -> bool:
    """Whether all branches are ``variable = expression`` for the same variables, without derivatives."""
    targets = [sorted(str(e.left) for e in side) for side in sides]
    plain_left = all(isinstance(e.left, Term) and e.left.op == "ref" for side in sides for e in side)
    rates = any(t.op == "der" for side in sides for e in side for t in walk([e.right]))
    return plain_left and not rates and all(t == targets[0] for t in targets)


def connects(body: list[Equation]) -> bool:
    """Whether a connect clause stands among equations, or in the branches and loops of these."""
    for equation in body:
        if equation.op == "connect":
            return True
        if equation.op == "for" and connects(equation.args[1]):
            return True
        if equation.op == "if":
            branches, otherwise = equation.args
            if connects(otherwise) or any(connects(b) for _, b in branches):
                return True
    return False


def implicit_range(name: str, body: list[Equation], where: Syntax) -> Syntax:
    """``for i loop`` runs over the size of the first array that i is a subscript of."""

    def search(part: Any) -> Syntax | None:
        if isinstance(part, Syntax):
            if part.op == "name":
                for depth, (_, subscripts) in enumerate(part.args):
                    for place, subscript in enumerate(subscripts):
                        if subscript.op == "name" and subscript.args == ((name, ()),):
                            array = (*part.args[:depth], (part.args[depth][0], ()))
                            axis = Syntax("number", (place + 1,), part.line)
                            whole = Syntax("name", array, part.line)
                            size = Syntax("call", ("size", (whole, axis), {}), part.line)
                            return Syntax("range", (Syntax("number", (1,), part.line), None, size), part.line)
            return search(part.args)
        if isinstance(part, (tuple, list)):
            for inner in part:
                found = search(inner)
                if found is not None:
                    return found
        return None

    found = search(body)
    if found is None:
        raise ModelicaError(f"the loop over {name} has no range")
    return found


def assigned(section: list[Equation], in_when: bool = False) -> dict[str, bool]:
    """Names that statements assign, and whether a when clause does."""
    found: dict[str, bool] = {}
    for statement in section:
        if statement.op == "assign":
            left = statement.args[0]
            for target in left.args if left.op == "tuple" else (left,):
                if target.op == "name":
                    name = target.args[0][0]
                    found[name] = found.get(name, False) or in_when
        elif statement.op in ("if", "when"):
            branches, otherwise = statement.args
            for body in [*(b for _, b in branches), otherwise]:
                for name, inside in assigned(body, in_when or statement.op == "when").items():
                    found[name] = found.get(name, False) or inside
        elif statement.op in ("for", "while"):
            for name, inside in assigned(statement.args[1], in_when).items():
                found[name] = found.get(name, False) or inside
    return found


def before(value: Value, evaluator: Evaluator, discrete: bool, initial: bool) -> Value:
    """What the variables of an algorithm hold when it starts (Modelica Language Specification 3.6, 11.1.2)."""
    if isinstance(value, list):
        return [before(v, evaluator, discrete, initial) for v in value]
    if isinstance(value, Record):
        return Record(
            value.type, {k: before(v, evaluator, discrete, initial) for k, v in value.fields.items()}
        )
    if not isinstance(value, Term) or value.op != "ref":
        return value
    variable = evaluator.scope.world.variables.get(value.args[0])
    if variable is not None and (discrete or variable.variability == "discrete"):
        return Term("pre", (value,))
    start = variable.attributes.get("start") if variable else None
    value = bound(start) if start else 0.0
    return Term("start", (value,)) if not isinstance(value, Term) else value


def enabled(side: Syntax, evaluator: Evaluator) -> bool:
    """Whether no component of a connector's name is switched off by its condition."""
    node = evaluator._first(side.args[0][0])
    for (_, subscripts), (name, _) in zip(side.args, side.args[1:], strict=False):
        if node is DISABLED:
            return False
        node = evaluator.subscripted(node, subscripts, side)
        if isinstance(node, Scope):
            node = node.component(name) if node.declares(name) else node
        else:
            return True
    return node is not DISABLED


def is_inside(side: Syntax, evaluator: Evaluator) -> bool:
    """Whether a connector belongs to the boundary of the class that connects it."""
    if len(side.args) == 1:
        return True
    node = evaluator._first(side.args[0][0])
    while isinstance(node, list):
        if not node:
            return False
        node = node[0]
    return isinstance(node, Scope) and node.definition.kind == "connector"
