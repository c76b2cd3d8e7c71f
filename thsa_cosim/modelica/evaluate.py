"""Expressions in a scope → values."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from itertools import product
from typing import TYPE_CHECKING, Any

from thsa_cosim.errors import ModelicaError
from thsa_cosim.modelica import builtin, overload
from thsa_cosim.modelica.arrays import (
    Partial,
    Record,
    Value,
    binary,
    concatenate,
    each,
    elements,
    fill,
    promote,
    shape,
    unset,
)
from thsa_cosim.modelica.lookup import Lookup, written
from thsa_cosim.modelica.modifier import Binding
from thsa_cosim.modelica.overload import holds_records
from thsa_cosim.modelica.scope import Scope, Variable
from thsa_cosim.modelica.syntax import Syntax
from thsa_cosim.modelica.terms import (
    Enumeration,
    Scalar,
    Term,
    constant,
    make,
    names,
    plain,
    substitute,
    text,
    walk,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

TIME = Term("ref", ("time",))
_RELATIONS = frozenset(("<", "<=", ">", ">=", "==", "<>"))


class Evaluator(Lookup):
    """Evaluates expressions in a scope; ``local`` holds loop variables and the variables of a function."""

    def __init__(
        self, scope: Scope, local: Mapping[str, Value] | None = None, in_function: bool = False
    ) -> None:
        self.scope = scope
        self.local: dict[str, Value] = dict(local or {})
        self.in_function = in_function
        self.connecting = False  # names are those of connectors
        self.ends: list[int] = []

    def with_local(self, local: Mapping[str, Value]) -> Evaluator:
        """The same scope with further loop variables."""
        return Evaluator(self.scope, {**self.local, **local}, self.in_function)

    def error(self, expression: Syntax, what: str) -> ModelicaError:
        """The error with file and line of an expression."""
        return ModelicaError(f"{self.scope.place(expression.line)}: {what}")

    def warn(self, expression: Syntax, what: str) -> None:
        """Warn of something at an expression, once."""
        message = f"{self.scope.place(expression.line)}: {what}"
        if message not in self.scope.world.warned:
            self.scope.world.warned.add(message)
            warnings.warn(message, stacklevel=2)

    def value(self, expression: Syntax) -> Value:
        """Value of an expression; raises ModelicaError, with file and line, for what is not supported."""
        try:
            return getattr(self, f"_{expression.op}")(expression)
        except ModelicaError as error:
            if str(error).startswith(("/", self.scope.definition.file.anchor)) or ".mo:" in str(error):
                raise
            raise self.error(expression, f"{error}.") from error
        except RecursionError as error:
            raise self.error(expression, "this expression depends on itself.") from error

    def structural(self, expression: Syntax, what: str) -> Any:
        """Value of an expression that has to be known at export; its parameters are then fixed there."""
        return self.fixed(self.value(expression), expression, what)

    def fixed(self, value: Value, expression: Syntax, what: str) -> Any:
        """A value as constants."""
        if isinstance(value, list):
            return [self.fixed(v, expression, what) for v in value]
        if isinstance(value, Record):
            return Record(value.type, {k: self.fixed(v, expression, what) for k, v in value.fields.items()})
        if not isinstance(value, Term):
            return value
        done: dict[int, Scalar] = {}
        result = substitute(value, lambda term: self._parameter(term, expression, what), done)
        if isinstance(result, Term):
            raise self.error(expression, f"{what} has to be known at export, but is {text(result)}.")
        return result

    def _parameter(self, term: Term, expression: Syntax, what: str) -> Scalar | None:
        if term.op != "ref":
            return None
        name = term.args[0]
        variable = self.scope.world.variables.get(name)
        if variable is None or variable.variability not in ("parameter", "constant"):
            raise self.error(expression, f"{what} has to be known at export, but depends on {name}.")
        self.scope.world.structural.add(name)
        binding = variable.binding or variable.attributes.get("start")
        return self.fixed(bound(binding), expression, what) if binding else 0.0

    # -- leaves

    def _number(self, expression: Syntax) -> Value:
        return expression.args[0]

    _string = _boolean = _number

    def _end(self, expression: Syntax) -> Value:
        if not self.ends:
            raise self.error(expression, "'end' stands outside of a subscript.")
        return self.ends[-1]

    def _colon(self, expression: Syntax) -> Value:
        raise self.error(expression, "':' stands outside of a subscript.")

    def _function(self, expression: Syntax) -> Value:
        """``function f(a = 1)`` as an argument: a function with some of its inputs given."""
        name, _, named = expression.args
        target = self.scope.find_class(name)
        given = self.local.get(name)
        if isinstance(given, Partial):
            target, earlier = given.target, given.given
        else:
            earlier = {}
        if target is None:
            raise self.error(expression, f"the function {name} is not known.")
        return Partial(target, {**earlier, **{key: self.value(a) for key, a in named.items()}})

    # -- operators

    def _unary(self, expression: Syntax) -> Value:
        operator, operand = expression.args
        value = self.value(operand)
        if holds_records(value):
            return overload.operator(self, operator, [value], expression)
        op = {"-": "neg", "not": "not"}[operator]
        return each(lambda x: make(op, x), value)

    def _binary(self, expression: Syntax) -> Value:
        op, left, right = expression.args
        if op == "and" and (first := self.value(left)) is False:
            return False
        if op == "or" and (first := self.value(left)) is True:
            return True
        a, b = (first if op in ("and", "or") else self.value(left)), self.value(right)
        if holds_records(a) or holds_records(b):
            return overload.operator(self, op, [a, b], expression)
        result = binary(op, a, b)
        if self.in_function and op in _RELATIONS:
            result = each(lambda x: make("noEvent", x) if isinstance(x, Term) else x, result)
        return result

    def _if(self, expression: Syntax) -> Value:
        branches, otherwise = expression.args
        conditions: list[tuple[Scalar, Value]] = []
        for condition, branch in branches:
            chosen = self.folded(self.value(condition), condition)
            if chosen is False:
                continue
            if chosen is True:
                result = self.value(branch)
                break
            conditions.append((chosen, self.value(branch)))
        else:
            result = self.value(otherwise)
        if (
            conditions
            and self.tuned([c for c, _ in conditions])
            and _has_rate([result, *(v for _, v in conditions)])
        ):
            chosen = [v for c, v in conditions if self.fixed(c, expression, "the condition of a derivative")]
            return chosen[0] if chosen else result
        for condition, branch_value in reversed(conditions):
            result = self.select(condition, branch_value, result, expression)
        return result

    def folded(self, condition: Scalar, expression: Syntax) -> Scalar:
        """A condition on parameters alone by their values, if the translation fixes what shapes the equations."""
        if not (
            self.scope.world.folded and isinstance(condition, Term) and self.parameters_only([condition])
        ):
            return condition
        variables = self.scope.world.variables
        if any("fixed" in variables[n].attributes for n in names(condition)):
            return condition
        return bool(self.fixed(condition, expression, "a condition"))

    def by_default(self, condition: Scalar) -> bool | None:
        """What a condition on parameters that are no Reals is before they are set; None for other conditions."""
        if not self.tuned([condition]):
            return None
        structural = set(self.scope.world.structural)
        value = self.fixed(condition, Syntax("boolean", (False,)), "a condition")
        self.scope.world.structural = structural
        return bool(value)

    def parameters_only(self, values: Sequence[Value]) -> bool:
        """Whether values depend on nothing but parameters."""
        variables = self.scope.world.variables
        used = {name for value in values for scalar in elements(value) for name in names(scalar)}
        return all(n in variables and variables[n].variability in ("parameter", "constant") for n in used)

    def tuned(self, conditions: Sequence[Scalar]) -> bool:
        """Whether conditions depend on nothing but parameters that are no Reals."""
        used = {name for c in conditions for name in names(c)}
        return bool(used) and used <= self.scope.world.tunable

    def select(self, condition: Scalar, yes: Value, no: Value, expression: Syntax) -> Value:
        """``if condition then yes else no`` for values of one shape."""
        if shape(yes) != shape(no):
            chosen = self.fixed(condition, expression, "the condition of branches of different sizes")
            return yes if chosen else no
        return each(lambda a, b: make("if", condition, a, b), yes, no)

    # -- arrays

    def _array(self, expression: Syntax) -> Value:
        return [self.value(item) for item in expression.args]

    def _tuple(self, expression: Syntax) -> Value:
        return tuple(self.value(item) for item in expression.args)

    def _matrix(self, expression: Syntax) -> Value:
        rows = []
        for row in expression.args:
            parts = [self.value(item) for item in row]
            rank = max(2, max(len(shape(part)) for part in parts))
            rows.append(concatenate(2, [promote(part, rank) for part in parts]))
        return concatenate(1, rows)

    def _range(self, expression: Syntax) -> Value:
        first, step, last = expression.args
        a = self.structural(first, "the start of a range")
        b = self.structural(last, "the end of a range")
        d = self.structural(step, "the step of a range") if step else 1
        if isinstance(a, Enumeration):
            scope = self.scope.find_class(a.type)
            literals = scope.definition.literals if scope and scope.definition.literals else ()
            return [Enumeration(a.type, literals[k - 1], k) for k in range(a.index, plain(b) + 1)]
        if all(isinstance(v, int) for v in (a, b, d)):
            return list(range(a, b + (1 if d > 0 else -1), d))
        count = int((b - a) / d + 1e-9) + 1
        return [a + k * d for k in range(count)]

    def _comprehension(self, expression: Syntax) -> Value:
        item, iterators = expression.args
        return self._comprehended(item, list(iterators))

    def _comprehended(self, item: Syntax, iterators: list[Any]) -> Value:
        if not iterators:
            return self.value(item)
        # the last iterator varies outermost (Modelica Language Specification 3.6, 10.4.1)
        (name, values), rest = iterators[-1], iterators[:-1]
        listed = self.iterated(name, values, item)
        return [self.with_local({name: v})._comprehended(item, rest) for v in listed]

    def iterated(self, name: str, values: Syntax | None, where: Syntax) -> list[Value]:
        """What a loop variable runs through."""
        if values is None:
            raise self.error(where, f"the loop over {name} has no range, which is a limit of this exporter.")
        if values.op == "name":
            found = self.scope.find_class(".".join(p for p, _ in values.args))
            if found is not None and found.definition.literals:
                return [
                    Enumeration(found.qualified, n, i + 1) for i, n in enumerate(found.definition.literals)
                ]
        result = self.value(values)
        if not isinstance(result, list):
            raise self.error(values, f"the loop over {name} needs a vector.")
        return result

    # -- names

    def _member(self, expression: Syntax) -> Value:
        """A field of a record value (made by the elaboration of records, not by the grammar)."""
        record, field = expression.args
        return self.field(self.value(record), field, expression)

    def _name(self, expression: Syntax) -> Value:
        parts = expression.args
        first, subscripts = parts[0]
        if first in self.local:
            value = self.subscripted(self.local[first], subscripts, expression)
            for name, further in parts[1:]:
                value = self.subscripted(self.field(value, name, expression), further, expression)
            if unset(value):
                raise self.error(expression, f"{written(expression)} is used before it has a value.")
            return value
        if first == "time" and len(parts) == 1:
            return TIME
        return self.of_node(self.node(expression), expression)

    # -- calls

    def _call(self, expression: Syntax) -> Value:
        return builtin.call(self, expression)


def _has_rate(values: Sequence[Value]) -> bool:
    return any(term.op == "der" for value in values for term in walk(elements(value)))


def bound(binding: Binding) -> Value:
    """Value of a binding, for its element of an array."""
    cache = binding.scope.world.__dict__.setdefault("bound", {})
    key = (id(binding.value), id(binding.scope))
    if key not in cache:
        cache[key] = (Evaluator(binding.scope).value(binding.value), binding)
    value = cache[key][0]
    for depth, index in enumerate(binding.indices):
        if not isinstance(value, list):
            break  # one value for all elements, as if it said each
        if depth < len(binding.sizes) and len(value) != binding.sizes[depth]:
            raise ModelicaError(
                f"{binding.scope.place(binding.value.line)}: {len(value)} values are given for an array with "
                f"{binding.sizes[depth]} elements."
            )
        if not 1 <= index <= len(value):
            raise ModelicaError(
                f"{binding.scope.place(binding.value.line)}: {len(value)} values are given for an array with more "
                "elements."
            )
        value = value[index - 1]
    return value


def variable_value(variable: Variable) -> Scalar:
    """Value of a variable: a reference, or what is known at export."""
    if variable.variability not in ("constant", "parameter") or (
        variable.variability == "parameter" and variable.type == "Real"
    ):
        return Term("ref", (variable.name,))
    if variable.state == 0:
        variable.state = 1
        variable.value = _known(variable)
        if _tunable(variable):
            variable.scope.world.tunable.add(variable.name)
            variable.value = Term("ref", (variable.name,))
        variable.state = 2
    elif variable.state == 1:
        raise ModelicaError(f"{variable.place}: the value of {variable.name} depends on itself.")
    return variable.value


def _tunable(variable: Variable) -> bool:
    """Whether a parameter that is no Real can be set in the FMU: the exported class' own one, with a plain value."""
    return (
        variable.variability == "parameter"
        and variable.type in ("Integer", "Boolean", "enumeration")
        and constant(variable.value)
        and not variable.scope.world.folded
        and not variable.final
        and variable.scope.path == ""
        and not {"protected", "fixed"} & variable.prefixes
        and (variable.binding is None or variable.binding.scope is variable.scope)
    )


def _known(variable: Variable) -> Scalar:
    binding = variable.binding or variable.attributes.get("start")
    if binding is None:
        if variable.variability == "constant" and variable.scope.path is None:
            raise ModelicaError(f"{variable.place}: the constant {variable.name} has no value.")
        if variable.type == "enumeration":
            return Enumeration(variable.scope.qualified, variable.enumeration[0], 1)
        return {"Boolean": False, "Integer": 0, "String": ""}.get(variable.type, 0.0)
    value = bound(binding)
    if isinstance(value, (list, Record)):
        raise ModelicaError(f"{variable.place}: {variable.name} is a scalar, but gets an array.")
    if variable.variability == "constant" and isinstance(value, Term):
        value = Evaluator(binding.scope).fixed(value, binding.value, f"the constant {variable.name}")
    if variable.type == "Real" and constant(value) and not isinstance(value, str):
        value = float(plain(value))
    return value


__all__ = ["Evaluator", "bound", "elements", "fill", "product", "variable_value"]
