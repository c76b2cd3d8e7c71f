"""The types of a flat model: a condition is a Boolean, and no number is made of one."""

from __future__ import annotations

from thsa_cosim.errors import ModelicaError
from thsa_cosim.modelica.flat import FlatModel
from thsa_cosim.modelica.terms import Enumeration, Scalar, Term, text

_BOOLEAN = frozenset(
    ("and", "or", "not", "<", "<=", ">", ">=", "==", "<>", "edge", "change", "initial", "sample")
)
_LOGICAL = frozenset(("and", "or", "not", "edge"))
_ALIKE = frozenset(("<", "<=", ">", ">=", "==", "<>", "min", "max"))  # false < true
_NUMERIC = frozenset(("+", "-", "*", "/", "^", "neg", "der", "sqrt", "exp", "log", "sin", "cos",
                      "tan", "abs", "sign"))  # fmt: skip
_THROUGH = frozenset(("pre", "noEvent", "start", "smooth", "homotopy"))


def check_types(flat: FlatModel) -> None:
    """Raises ModelicaError, with file and line, where a Boolean stands for a number or a number for a Boolean."""
    checker = _Checker(flat)
    for equation in (*flat.equations, *flat.initial_equations):
        checker.check(equation.left, equation.place)
        checker.check(equation.right, equation.place)
        checker.agree(equation.left, equation.right, equation.place)
    for variable in flat.variables.values():
        if variable.binding is not None:
            checker.check(variable.binding, variable.place)
            checker.agree(Term("ref", (variable.name,)), variable.binding, variable.place)
    for reinit in flat.reinits:
        checker.check(reinit.value, reinit.place)


class _Checker:
    def __init__(self, flat: FlatModel) -> None:
        self.flat = flat
        self.known: dict[int, bool | None] = {}
        self._kept: list[Scalar] = []  # what is known by its id has to stay alive

    def boolean(self, value: Scalar) -> bool | None:
        """Whether a value is a Boolean; None where that is not known."""
        if not isinstance(value, Term):
            return isinstance(value, bool) if not isinstance(value, (str, Enumeration)) else False
        return self.known.get(id(value))

    def agree(self, left: Scalar, right: Scalar, place: str) -> None:
        """Refuse a number that is set equal to a Boolean."""
        self._kept.append(left)
        self.check(left, place)
        if {self.boolean(left), self.boolean(right)} == {True, False}:
            raise ModelicaError(
                f"{place}: of {text(left)} = {text(right)}, one side is a Boolean, the other a number."
            )

    def check(self, root: Scalar, place: str) -> None:
        """Check a value from its leaves up."""
        stack = [root]
        while stack:
            term = stack[-1]
            if not isinstance(term, Term) or id(term) in self.known:
                stack.pop()
                continue
            waiting = [a for a in term.args if isinstance(a, Term) and id(a) not in self.known]
            if waiting:
                stack.extend(waiting)
                continue
            stack.pop()
            self.known[id(term)] = self._kind(term, place)

    def _kind(self, term: Term, place: str) -> bool | None:
        op, args = term.op, term.args
        if op == "ref":
            variable = self.flat.variables.get(args[0])
            return variable.type == "Boolean" if variable is not None else None
        if op in _NUMERIC:
            self._all(args, False, term, place)
        elif op in _LOGICAL:
            self._all(args, True, term, place)
        elif op in _ALIKE:
            kinds = {self.boolean(a) for a in args}
            if {True, False} <= kinds:
                raise ModelicaError(f"{place}: {text(term)} compares a Boolean with a number.")
            if op in ("min", "max"):
                return True if True in kinds else False if False in kinds else None
        elif op == "if":
            self._all(args[:1], True, term, place)
            kinds = {self.boolean(args[1]), self.boolean(args[2])}
            if kinds == {True, False}:
                raise ModelicaError(f"{place}: one branch of {text(term)} is a Boolean, the other a number.")
            return True if True in kinds else False if False in kinds else None
        if op in _THROUGH:
            return self.boolean(args[-1])
        return op in _BOOLEAN

    def _all(self, values: tuple[Scalar, ...], wanted: bool, term: Term, place: str) -> None:
        for value in values:
            if self.boolean(value) is (not wanted):
                what = "a number" if wanted else "a Boolean"
                needs = "a Boolean" if wanted else "a number"
                raise ModelicaError(
                    f"{place}: in {text(term)}, {text(value)} is {what}; it has to be {needs}."
                )
