"""Names in a scope → components, and elements of arrays (Modelica Language Specification 3.6, chapter 5 and 10.5)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from thsa_cosim.errors import ModelicaError, did_you_mean
from thsa_cosim.modelica.arrays import Partial, Record, Value, each
from thsa_cosim.modelica.scope import DISABLED, Scope, Variable
from thsa_cosim.modelica.syntax import Import, Syntax
from thsa_cosim.modelica.terms import Enumeration, Scalar, Term, make, plain, text


class Lookup:
    """What the evaluation of expressions knows about names; `Evaluator` adds the values."""

    scope: Scope
    local: dict[str, Value]
    connecting: bool
    ends: list[int]

    def error(self, expression: Syntax, what: str) -> ModelicaError:
        """The error with file and line of an expression."""
        raise NotImplementedError

    def value(self, expression: Syntax) -> Value:
        """Value of an expression."""
        raise NotImplementedError

    def fixed(self, value: Value, expression: Syntax, what: str) -> Any:
        """A value as constants."""
        raise NotImplementedError

    def node(self, expression: Syntax) -> Any:
        """The component (or enumeration literal, or list of components) that a name stands for."""
        parts = list(expression.args)
        if parts[0][0] == "":
            found: Any = self.scope.world.top(parts[1][0])
            rest = parts[2:]
        else:
            found = self._first(parts[0][0])
            rest = parts[1:]
            if found is not None and not (isinstance(found, Scope) and found.path is None):
                found = self.subscripted(found, parts[0][1], expression)
        if found is None:
            raise self._unknown(expression, parts[0][0] or parts[1][0])
        for name, subscripts in rest:
            found = self.subscripted(self.member(found, name, expression), subscripts, expression)
        return found

    def _first(self, name: str) -> Any:
        scope: Scope | None = self.scope
        while scope is not None:
            if scope.declares(name):
                return scope.component(name)
            found = scope.member_class(name) or scope.imported(name) or self._imported_component(scope, name)
            if found is not None:
                return found
            if "encapsulated" in scope.definition.prefixes:
                break
            scope = scope.parent
        return self.scope.world.top(name)

    def _imported_component(self, scope: Scope, name: str) -> Any:
        for element in scope.definition.elements:
            if isinstance(element, Import):
                packages = list(element.wildcards)
                wanted = name
                if name in element.names and "." in element.names[name]:
                    package, wanted = element.names[name].rsplit(".", 1)
                    packages = [package]
                for package in packages:
                    found = scope._absolute(package)
                    if found is not None and found.declares(wanted):
                        return found.component(wanted)
        return None

    def member(self, node: Any, name: str, where: Syntax) -> Any:
        """A component of a component, a class of a class, a literal of an enumeration."""
        if isinstance(node, list):
            return [self.member(part, name, where) for part in node]
        if isinstance(node, Record):
            return self.field(node, name, where)
        if node is DISABLED:
            raise self.error(where, f"{written(where)} belongs to a component whose condition is false.")
        if isinstance(node, Scope):
            if node.declares(name):
                return node.component(name)
            if node.definition.literals and name in node.definition.literals:
                return Enumeration(node.qualified, name, node.definition.literals.index(name) + 1)
            found = node.member_class(name)
            if found is None:
                for base in node.bases:  # a type that is derived from an enumeration
                    if base.definition.literals or base.bases:
                        return self.member(base, name, where)
            if found is not None:
                return found
        if isinstance(node, Scope) and "expandable" in node.definition.prefixes:
            raise self.error(
                where, f"{written(where)}: expandable connectors are a limit of this exporter ({node.path})."
            )
        known = list(node.elements) if isinstance(node, Scope) else []
        raise self.error(where, f"{written(where)}: there is no {name}.{did_you_mean(name, known)}")

    def _unknown(self, expression: Syntax, name: str) -> ModelicaError:
        known = [*self.scope.elements, *self.local]
        return self.error(
            expression, f"the name {written(expression)} is not known.{did_you_mean(name, known)}"
        )

    def of_node(self, node: Any, where: Syntax) -> Value:
        """Value of a component."""
        if isinstance(node, Variable):
            from thsa_cosim.modelica.evaluate import variable_value

            return variable_value(node)
        if isinstance(node, list):
            return [self.of_node(part, where) for part in node]
        if node is DISABLED:
            raise self.error(where, f"{written(where)} belongs to a component whose condition is false.")
        if isinstance(node, Scope):
            if node.path is None:
                if node.definition.literals:
                    return [
                        Enumeration(node.qualified, n, i + 1) for i, n in enumerate(node.definition.literals)
                    ]
                if node.definition.kind == "function":
                    return Partial(node, {})
                raise self.error(where, f"{written(where)} is a class, not a value.")
            fields = {n: node.component(n) for n in node.elements if node.declares(n)}
            return Record(
                node.qualified, {n: self.of_node(f, where) for n, f in fields.items() if f is not DISABLED}
            )
        return node

    def subscripted(self, value: Any, subscripts: Sequence[Syntax], where: Syntax) -> Any:
        """An element or a slice of an array."""
        if not subscripts:
            return value
        first, rest = subscripts[0], subscripts[1:]
        if not isinstance(value, list):
            raise self.error(where, f"{written(where)} has more subscripts than dimensions.")
        if first.op == "colon":
            return [self.subscripted(v, rest, where) for v in value]
        self.ends.append(len(value))
        try:
            index = self.value(first)
        finally:
            self.ends.pop()
        if isinstance(index, list):
            if index and all(isinstance(i, bool) for i in index):
                index = [k + 1 for k, chosen in enumerate(index) if chosen]
            return [self.subscripted(self._element(value, i, where), rest, where) for i in index]
        return self.subscripted(self._element(value, index, where), rest, where)

    def _element(self, value: list[Any], index: Scalar, where: Syntax) -> Any:
        if isinstance(index, bool):
            index = int(index) + 1
        if isinstance(index, Term) and (self.connecting or isinstance(value[0] if value else None, Scope)):
            index = self.fixed(index, where, f"a subscript of {written(where)}")  # which component it is
        index = plain(index)
        if isinstance(index, Term):
            return self._variable_index(value, index, where)
        if isinstance(index, float) and index == int(index):
            index = int(index)
        if not isinstance(index, int) or not 1 <= index <= len(value):
            raise self.error(
                where, f"the subscript {text(index)} of {written(where)} is not in 1:{len(value)}."
            )
        return value[index - 1]

    def _variable_index(self, value: list[Any], index: Term, where: Syntax) -> Value:
        values = [self.of_node(v, where) for v in value]
        if not values:
            raise self.error(where, f"{written(where)} is empty.")
        result = values[-1]
        for k in range(len(values) - 1, 0, -1):
            chosen = make("noEvent", make("<=", index, k))
            result = each(lambda a, b, c=chosen: make("if", c, a, b), values[k - 1], result)
        return result

    def field(self, value: Value, name: str, where: Syntax) -> Value:
        """A field of a record, or of every record of an array."""
        if isinstance(value, list):
            return [self.field(v, name, where) for v in value]
        if not isinstance(value, Record) or name not in value.fields:
            raise self.error(where, f"there is no field {name}.")
        return value.fields[name]


def written(expression: Syntax) -> str:
    """A name as it is written, for messages."""
    if expression.op == "name":
        return ".".join(part + ("[…]" if subscripts else "") for part, subscripts in expression.args)
    return "the expression"
