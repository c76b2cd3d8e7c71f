"""Calls of Modelica functions, written out: the algorithm is run on values that may be terms.

Loops run at export, an ``if`` on an unknown condition runs both branches and selects. What is inside makes no events
(Modelica Language Specification 3.6, 12.2).
"""

from __future__ import annotations

from typing import Any

from thsa_cosim.modelica import builtin, overload, tables
from thsa_cosim.modelica.arrays import UNSET, Record, Value, each, elements, fill, shape
from thsa_cosim.modelica.evaluate import Evaluator
from thsa_cosim.modelica.redeclaration import resolved
from thsa_cosim.modelica.scope import BUILTIN_TYPES, Element, Scope
from thsa_cosim.modelica.statements import Statements, UnknownStepsError
from thsa_cosim.modelica.syntax import Component, Equation, Syntax
from thsa_cosim.modelica.terms import Enumeration


def apply(evaluator: Evaluator, target: Scope, expression: Syntax) -> Value:
    """Value of a call of a function, a record constructor or an enumeration's conversion."""
    _, arguments, named = expression.args
    positional = [evaluator.value(a) for a in arguments]
    keyed = {name: evaluator.value(a) for name, a in named.items()}
    try:
        return invoke(evaluator, target, positional, keyed, expression)
    except UnknownStepsError:
        given = [*positional, *keyed.values()]
        if not evaluator.parameters_only(given):
            raise
        # its parameters are then fixed at export
        what = f"an argument of {target.qualified}()"
        positional = [evaluator.fixed(v, expression, what) for v in positional]
        keyed = {name: evaluator.fixed(v, expression, what) for name, v in keyed.items()}
        return invoke(evaluator, target, positional, keyed, expression)


def invoke(
    evaluator: Evaluator, target: Scope, positional: list[Value], keyed: dict[str, Value], where: Syntax
) -> Value:
    """The same with the arguments evaluated."""
    scope = _implementation(target)
    kind = scope.definition.kind
    if scope.definition.literals:
        index = evaluator.fixed(positional[0], where, "the argument of an enumeration's conversion")
        return Enumeration(scope.qualified, scope.definition.literals[index - 1], index)
    if kind == "record" or (kind == "operator" and "record" in scope.definition.prefixes):
        made = overload.constructed(evaluator, scope, positional, keyed, where)
        return _construct(target, positional, keyed, where, evaluator) if made is None else made
    if kind == "operator":
        constructor = scope.member_class("fromReal")
        if constructor is not None:
            return invoke(evaluator, constructor, positional, keyed, where)
    if kind not in ("function", "operator"):
        if kind == "class" and scope.member_class("constructor") is not None:
            made = scope.member_class("constructor")
            assert made is not None
            return _External(made, positional, keyed, evaluator, where).call()
        raise evaluator.error(where, f"{target.qualified} is a {kind}, not a function.")
    if scope.definition.external is not None:
        return _External(target, positional, keyed, evaluator, where).call()
    if "partial" in scope.definition.prefixes:
        raise evaluator.error(where, f"the function {target.qualified} is partial: it has to be redeclared.")
    mapped = _vectorized(target, positional, keyed, evaluator, where)
    if mapped is not None:
        calls = [invoke(evaluator, target, list(p), k, where) for p, k in mapped]
        several = bool(calls) and isinstance(calls[0], tuple)
        return tuple(list(part) for part in zip(*calls, strict=True)) if several else calls
    run = _Run(target, positional, keyed, evaluator, where)
    return run.call()


def _vectorized(
    target: Scope, positional: list[Value], keyed: dict[str, Value], evaluator: Evaluator, where: Syntax
) -> list[tuple[list[Value], dict[str, Value]]] | None:
    """Arguments of each call where some are arrays of what the function takes (Modelica Language Specification 3.6,
    12.4.6); None where they fit as they are.
    """
    inputs = [(name, e) for name, e in _declared(target) if "input" in e.declaration.prefixes]
    given = dict(zip((name for name, _ in inputs), positional, strict=False)) | keyed
    extra = {
        name: given[name]
        for name, element in inputs
        if isinstance(given.get(name), list) and len(shape(given[name])) > _rank(element)
    }
    if not extra or len(positional) > len(inputs):
        return None
    sizes = {len(value) for value in extra.values()}
    if len(sizes) > 1:
        raise evaluator.error(where, f"{target.qualified}() gets arrays of different sizes.")
    names = [name for name, _ in inputs[: len(positional)]]
    turns = []
    for k in range(sizes.pop()):
        here = {name: value[k] if name in extra else value for name, value in given.items()}
        turns.append(([here[n] for n in names], {n: v for n, v in here.items() if n not in names}))
    return turns


def _rank(element: Element) -> int:
    """Dimensions of a declaration with those of its type."""
    declaration, owner, _ = resolved(element)
    target = None if declaration.type in BUILTIN_TYPES else owner.find_class(declaration.type)
    return len(declaration.dimensions) + (len(target.definition.dimensions) if target else 0)


def _implementation(target: Scope) -> Scope:
    """The class that holds the algorithm of a function: itself, or the one that a short definition names."""
    scope = target
    _ = scope.elements
    while scope.definition.base is not None and scope.bases:
        scope = scope.bases[0]
    if not scope.definition.algorithms and scope.definition.external is None:
        for base in scope.bases:
            inner = _implementation(base)
            if inner.definition.algorithms or inner.definition.external is not None:
                return inner
    return scope


def _declared(target: Scope) -> list[tuple[str, Element]]:
    return [(name, e) for name, e in target.elements.items() if isinstance(e.declaration, Component)]


def _construct(
    target: Scope, positional: list[Value], keyed: dict[str, Value], where: Syntax, evaluator: Evaluator
) -> Record:
    given = list(positional)
    fields: dict[str, Value] = {}
    for name, element in _declared(target):
        declaration, owner, mod = resolved(element)
        if name in keyed:
            fields[name] = keyed[name]
        elif given and "constant" not in declaration.prefixes:
            fields[name] = given.pop(0)
        elif mod is not None and mod.binding is not None:
            inner = Evaluator(mod.binding.scope, fields, True)
            fields[name] = inner.value(mod.binding.value)
        else:
            fields[name] = _default(owner, declaration, Evaluator(owner, fields, True), where)
    return Record(target.qualified, fields)


def _default(owner: Scope, declaration: Component, evaluator: Evaluator, where: Syntax) -> Value:
    """Initial value of a variable without a binding."""
    sizes = []
    for dimension in declaration.dimensions:
        if dimension.op == "colon":
            return UNSET
        sizes.append(int(evaluator.structural(dimension, "the size of an array")))
    value: Value = UNSET
    if declaration.type not in BUILTIN_TYPES:
        target = owner.find_class(declaration.type)
        if target is None:
            raise owner.unknown_class(declaration.type, declaration.line)
        _ = target.elements
        if target.builtin is None and target.definition.literals is None and target.definition.kind != "type":
            value = _construct_unset(target, where)
        sizes += [int(evaluator.structural(d, "the size of an array")) for d in target.definition.dimensions]
    return fill(value, sizes)


def _construct_unset(target: Scope, where: Syntax) -> Record:
    fields: dict[str, Value] = {}
    for name, element in _declared(target):
        declaration, owner, mod = resolved(element)
        inner = Evaluator(owner, {}, True)
        fields[name] = (
            Evaluator(mod.binding.scope, fields, True).value(mod.binding.value)
            if mod is not None and mod.binding is not None
            else _default(owner, declaration, inner, where)
        )
    return Record(target.qualified, fields)


class _Run:
    """One call."""

    def __init__(
        self,
        target: Scope,
        positional: list[Value],
        keyed: dict[str, Value],
        caller: Evaluator,
        where: Syntax,
    ) -> None:
        self.target = target
        self.where = where
        self.caller = caller
        self.outputs: list[str] = []
        self.env: dict[str, Value] = {}
        given = list(positional)
        waiting: list[tuple[str, Component, Scope, Any]] = []
        for name, element in _declared(target):
            declaration, owner, mod = resolved(element)
            if "input" in declaration.prefixes:
                if name in keyed:
                    self.env[name] = keyed[name]
                elif given:
                    self.env[name] = given.pop(0)
                elif mod is not None and mod.binding is not None:
                    inner = Evaluator(mod.binding.scope, self.env, True)
                    self.env[name] = inner.value(mod.binding.value)
                else:
                    raise caller.error(where, f"{target.qualified}() needs a value for {name}.")
                continue
            if "output" in declaration.prefixes:
                self.outputs.append(name)
            waiting.append((name, declaration, owner, mod))
        if given or set(keyed) - set(self.env):
            extra = next(iter(set(keyed) - set(self.env)), "one argument more")
            raise caller.error(where, f"{target.qualified}() does not take {extra}.")
        for name, declaration, owner, mod in self._ordered(waiting):
            if mod is not None and mod.binding is not None:
                self.env[name] = Evaluator(mod.binding.scope, self.env, True).value(mod.binding.value)
            else:
                value = _default(owner, declaration, Evaluator(owner, self.env, True), where)
                for field, child in (mod.children if mod is not None else {}).items():
                    if isinstance(value, Record) and field in value.fields and child.binding is not None:
                        inner = Evaluator(child.binding.scope, self.env, True)
                        value.fields[field] = inner.value(child.binding.value)
                self.env[name] = value

    def _ordered(self, waiting: list[Any]) -> list[Any]:
        """Declarations whose sizes or bindings use others come after these."""
        names = {name for name, *_ in waiting}
        done: list[Any] = []
        placed: set[str] = set()
        rest = list(waiting)
        while rest:
            for item in rest:
                _, declaration, _, mod = item
                used = {n for d in declaration.dimensions for n in _names_in(d)}
                if mod is not None and mod.binding is not None:
                    used |= _names_in(mod.binding.value)
                if not (used & names) - placed - {item[0]}:
                    break
            else:
                item = rest[0]
            rest.remove(item)
            done.append(item)
            placed.add(item[0])
        return done

    def call(self) -> Value:
        if len(self.caller.scope.world.__dict__.setdefault("calls", [])) > 200:
            raise self.caller.error(self.where, f"{self.target.qualified}() calls itself without end.")
        self.caller.scope.world.__dict__["calls"].append(self.target.qualified)
        try:
            scope = _implementation(self.target)
            statements = [s for section in scope.definition.algorithms for s in section]
            runner = Statements(Evaluator(scope, {}, True))
            env = runner.run(statements, self.env)
        finally:
            self.caller.scope.world.__dict__["calls"].pop()
        for name in self.outputs:
            if name in runner.partly and not any(_asserts(s) for s in statements):
                what = f"{self.target.qualified}() gives {name} no value in one of its branches"
                self.caller.warn(
                    self.where, f"{what}; that of another branch is taken, Modelica leaves it open."
                )
        for name in self.outputs:
            if any(value is UNSET for value in elements(env[name])):
                raise self.caller.error(self.where, f"{self.target.qualified}() gives {name} no value.")
        results = tuple(env[name] for name in self.outputs)
        if not results:
            return ()
        return results[0] if len(results) == 1 else results


def _asserts(statement: Any) -> bool:
    """Whether a statement, or one inside it, is an assertion: what follows a failed one does not matter."""
    if isinstance(statement, Equation) and statement.op == "call":
        return bool(statement.args[0].args[0] == "assert")
    if isinstance(statement, Syntax) or not isinstance(statement, tuple):
        return False
    return any(_asserts(part) for part in statement)


def _names_in(expression: Any) -> set[str]:
    if isinstance(expression, Syntax):
        if expression.op == "name":
            found = {expression.args[0][0]}
            for _, subscripts in expression.args:
                for subscript in subscripts:
                    found |= _names_in(subscript)
            return found
        return _names_in(expression.args)
    if isinstance(expression, dict):
        return {n for v in expression.values() for n in _names_in(v)}
    if isinstance(expression, tuple):
        return {n for v in expression for n in _names_in(v)}
    return set()


class _External:
    """A call of an external function: a built-in one, or a table."""

    def __init__(
        self,
        target: Scope,
        positional: list[Value],
        keyed: dict[str, Value],
        caller: Evaluator,
        where: Syntax,
    ) -> None:
        self.run = _Run(target, positional, keyed, caller, where)
        self.caller, self.where, self.target = caller, where, target

    def call(self) -> Value:
        scope = _implementation(self.target)
        assert scope.definition.external is not None
        language, name = scope.definition.external
        inputs = [self.run.env[n] for n, e in _declared(self.target) if "input" in e.declaration.prefixes]
        if language == "builtin" or (language == "C" and name in builtin.MATH_H):
            short = scope.definition.name if name not in builtin.SCALAR else name
            if short in builtin.SCALAR:
                return each(lambda *x: builtin.scalar(self.caller, short, *x), *inputs)
        found = tables.FUNCTIONS.get(name)
        if found is not None:
            return found(self.caller, self.where, inputs)
        raise self.caller.error(
            self.where,
            f"the function {self.target.qualified} is written in {language}, which is a limit of this exporter.",
        )


__all__ = ["apply", "invoke"]
