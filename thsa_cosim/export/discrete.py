"""Which equations define discrete variables, and which of these can be written out where they are used."""

from collections.abc import Iterable
from dataclasses import dataclass

from thsa_cosim.errors import ModelicaError
from thsa_cosim.export.structure import match
from thsa_cosim.modelica.flat import FlatEquation, FlatModel, FlatVariable
from thsa_cosim.modelica.terms import Enumeration, Scalar, Term, make, walk

_BOOLEAN = frozenset(
    ("and", "or", "not", "<", "<=", ">", ">=", "==", "<>", "edge", "change", "initial", "sample")
)
_REAL = frozenset(("/", "^", "der", "sqrt", "exp", "log", "log10", "sin", "cos", "tan", "asin", "acos", "atan", "atan2",
                   "sinh", "cosh", "tanh"))  # fmt: skip


@dataclass(frozen=True)
class Discrete:
    """``definitions``: discrete variable → its new value; ``inline``: those of them that need no memory;
    ``starts``: value before the first event, from initial equations; the rest of both kinds of equations.
    """

    definitions: dict[str, Scalar]
    inline: frozenset[str]
    starts: dict[str, Scalar]
    equations: tuple[FlatEquation, ...]
    initial_equations: tuple[FlatEquation, ...]


def split_discrete(flat: FlatModel) -> Discrete:
    """Separate the discrete from the continuous part; raises ModelicaError where no equation defines a variable."""
    unknown = {
        v.name: v for v in flat.variables.values() if v.variability == "discrete" and v.causality != "input"
    }
    definitions: dict[str, Scalar] = {v.name: v.binding for v in unknown.values() if v.binding is not None}
    candidates, rest = [], []
    at_events = {str(_name(e.left)) for e in flat.equations if e.event}
    for equation in flat.equations:
        solved = _solutions(equation, flat, unknown, at_events)
        if solved:
            candidates.append((equation, {n: value for n, value in solved.items() if n not in definitions}))
        else:
            rest.append(equation)
    columns = {name: index for index, name in enumerate(n for n in unknown if n not in definitions)}
    incidence = [{columns[name] for name in solved} for _, solved in candidates]
    matching = match(incidence, list(columns.values()))
    used = set(matching.values())
    for name, index in columns.items():
        if index not in matching:
            raise ModelicaError(f"{unknown[name].place}: nothing determines the discrete variable {name}.")
        definitions[name] = candidates[matching[index]][1][name]
    spare = [equation for row, (equation, _) in enumerate(candidates) if row not in used]
    if spare:
        raise ModelicaError(f"{spare[0].place}: the equation {spare[0]} is one too many.")
    starts, initial = _starts(flat, unknown)
    return Discrete(
        definitions, _inline(flat, definitions, starts, unknown), starts, tuple(rest), tuple(initial)
    )


def _solutions(
    equation: FlatEquation, flat: FlatModel, unknown: dict[str, FlatVariable], at_events: set[str]
) -> dict[str, Scalar]:
    """The discrete variables that an equation can be solved for, with their values; none if it is continuous."""
    found: dict[str, Scalar] = {}
    sides = ((equation.left, equation.right), (equation.right, equation.left))
    whole = kind(equation.left, flat) != "Real" and kind(equation.right, flat) != "Real"
    for target, value in sides:
        negated = isinstance(target, Term) and target.op == "not"
        name = _name(target.args[0] if negated else target)
        if name is None or name not in unknown:
            continue
        if unknown[name].type == "Real":
            # a Real elsewhere than on the left of its own equation is just used there
            if target is not equation.left or (name in at_events and not equation.event):
                continue
        elif not whole or (name in at_events and not equation.event):
            continue
        found[name] = make("not", value) if negated else value
    if not found and whole and not _given(equation, at_events):
        raise ModelicaError(
            f"{equation.place}: the equation {equation} of discrete variables cannot be solved."
        )
    return found


def _given(equation: FlatEquation, at_events: set[str]) -> bool:
    """Whether an equation is between a number and something, or uses what a when clause gives."""
    sides = {_name(equation.left), _name(equation.right)}
    return equation.left == 0.0 or bool(sides & at_events)


def _name(term: Scalar) -> str | None:
    return term.args[0] if isinstance(term, Term) and term.op == "ref" else None


def kind(value: Scalar, flat: FlatModel) -> str:
    """ "Boolean", "Integer" or "Real"."""
    for _ in range(10_000):
        if isinstance(value, bool):
            return "Boolean"
        if not isinstance(value, Term):
            return "Integer" if isinstance(value, (int, Enumeration)) else "Real"
        op = value.op
        if op == "ref":
            variable = flat.variables.get(value.args[0])
            return variable.type if variable is not None else "Real"
        if op in _BOOLEAN:
            return "Boolean"
        if op in _REAL:
            return "Real"
        if op in ("integer",):
            return "Integer"
        if op == "if":
            kinds = {kind(value.args[1], flat), kind(value.args[2], flat)}
            return "Real" if "Real" in kinds else kinds.pop()
        if op in ("pre", "noEvent", "neg", "abs", "sign", "floor", "ceil", "start"):
            value = value.args[-1]
            continue
        kinds = {kind(a, flat) for a in value.args}
        return "Integer" if kinds == {"Integer"} else "Real"
    return "Real"


def _starts(
    flat: FlatModel, unknown: dict[str, FlatVariable]
) -> tuple[dict[str, Scalar], list[FlatEquation]]:
    starts: dict[str, Scalar] = {}
    rest = []
    for equation in flat.initial_equations:
        for target, value in ((equation.left, equation.right), (equation.right, equation.left)):
            inner = target.args[0] if isinstance(target, Term) and target.op == "pre" else target
            name = _name(inner)
            if name is not None and name in unknown:
                starts[name] = value
                break
        else:
            rest.append(equation)
    return starts, rest


def _inline(
    flat: FlatModel,
    definitions: dict[str, Scalar],
    starts: dict[str, Scalar],
    unknown: dict[str, FlatVariable],
) -> frozenset[str]:
    """Variables that neither remember anything nor depend on themselves."""
    remembered = set(starts)
    roots: list[Scalar] = list(definitions.values())
    roots += [side for e in (*flat.equations, *flat.initial_equations) for side in (e.left, e.right)]
    roots += [side for r in flat.reinits for side in (r.condition, r.value)]
    roots += [a.condition for a in flat.assertions]
    roots += [v.binding for v in flat.variables.values() if v.binding is not None]
    for term in walk(roots):
        if term.op in ("pre", "change") and _name(term.args[0]):
            remembered.add(str(_name(term.args[0])))
    chosen = {name for name in definitions if name not in remembered and unknown[name].type != "Real"}
    needs = {name: _referred(definitions[name]) & chosen for name in chosen}
    return frozenset(chosen - _cyclic(needs))


def _referred(value: Scalar) -> set[str]:
    return {term.args[0] for term in walk([value]) if term.op == "ref"}


def _cyclic(needs: dict[str, set[str]]) -> set[str]:
    """Names that depend on themselves."""
    found: set[str] = set()
    for name in needs:
        seen: set[str] = set()
        stack: list[str] = list(needs[name])
        while stack:
            top = stack.pop()
            if top == name:
                found.add(name)
                break
            if top not in seen:
                seen.add(top)
                stack.extend(needs.get(top, ()))
    return found


def referenced(values: Iterable[Scalar]) -> set[str]:
    """Names of the variables that some values refer to."""
    return {term.args[0] for term in walk(list(values)) if term.op == "ref"}
