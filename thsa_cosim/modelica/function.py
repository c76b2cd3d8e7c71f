"""Calls of Modelica functions, written out: the algorithm is run on values that may be terms.

Loops run at export, an ``if`` on an unknown condition runs both branches and selects. What is inside makes no events
(Modelica Language Specification 3.6, 12.2).
"""

from __future__ import annotations

from typing import Any

from thsa_cosim.errors import ModelicaError
from thsa_cosim.modelica import builtin, tables
from thsa_cosim.modelica.arrays import Record, Value, each, fill, shape
from thsa_cosim.modelica.evaluate import Evaluator
from thsa_cosim.modelica.scope import BUILTIN_TYPES, Element, Scope, resolved
from thsa_cosim.modelica.syntax import ClassDefinition, Component, Equation, Syntax
from thsa_cosim.modelica.terms import Enumeration, Term, make

MOST_TURNS = 100_000
MOST_UNKNOWN = 200  # turns of a loop whose end is not known at export


class _Unset:
    """A variable of a function that has no value yet."""

    def __repr__(self) -> str:
        return "(no value)"


UNSET = _Unset()


class _Unknown(ModelicaError):
    """The steps of a function depend on values that are not known at export."""


def apply(evaluator: Evaluator, target: Scope, expression: Syntax) -> Value:
    """Value of a call of a function, a record constructor or an enumeration's conversion."""
    _, arguments, named = expression.args
    positional = [evaluator.value(a) for a in arguments]
    keyed = {name: evaluator.value(a) for name, a in named.items()}
    try:
        return invoke(evaluator, target, positional, keyed, expression)
    except _Unknown:
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
        return _construct(target, positional, keyed, where, evaluator)
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
    run = _Run(target, positional, keyed, evaluator, where)
    return run.call()


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
                self.env[name] = _default(owner, declaration, Evaluator(owner, self.env, True), where)

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
            env, _ = runner.run(statements, self.env)
        finally:
            self.caller.scope.world.__dict__["calls"].pop()
        results = tuple(env[name] for name in self.outputs)
        if not results:
            return ()
        return results[0] if len(results) == 1 else results


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


class Statements:
    """Runs statements on an environment; never changes the one it is given."""

    def __init__(self, evaluator: Evaluator, asserted: Any = None) -> None:
        self.evaluator = evaluator
        self.asserted = asserted

    def _at(self, env: dict[str, Value]) -> Evaluator:
        made = Evaluator(self.evaluator.scope, env, self.evaluator.in_function)
        made.local = env
        return made

    def run(self, statements: list[Equation], env: dict[str, Value]) -> tuple[dict[str, Value], str]:
        """The environment after the statements, and "" or how they were left: "return" or "break"."""
        env = dict(env)
        for position, statement in enumerate(statements):
            op = statement.op
            if op == "assign":
                self._assign(statement, env)
            elif op == "call":
                self._call(statement, env)
            elif op == "if":
                env, left, finished = self._if(statement, env, statements[position + 1 :])
                if left or finished:
                    return env, left
            elif op == "for":
                env, left = self._for(statement, env)
                if left == "return":
                    return env, left
            elif op == "while":
                env, left = self._while(statement, env)
                if left == "return":
                    return env, left
            elif op in ("return", "break"):
                return env, op
            else:
                raise self._error(statement, f"a {op} statement is a limit of this exporter here.")
        return env, ""

    def _error(self, statement: Equation, what: str) -> ModelicaError:
        return ModelicaError(f"{self.evaluator.scope.place(statement.line)}: {what}")

    def _call(self, statement: Equation, env: dict[str, Value]) -> None:
        if self.asserted is not None:
            self.asserted(statement, self._at(env))

    def _assign(self, statement: Equation, env: dict[str, Value]) -> None:
        left, right = statement.args
        value = self._at(env).value(right)
        if left.op == "tuple":
            values = value if isinstance(value, tuple) else (value,)
            for target, part in zip(left.args, values, strict=False):
                if target.op != "colon":
                    self.store(target, part, env)
            return
        if isinstance(value, tuple):
            value = value[0]
        self.store(left, value, env)

    def store(self, target: Syntax, value: Value, env: dict[str, Value]) -> None:
        """``target := value``."""
        (name, subscripts), *rest = target.args
        if name not in env:
            raise self.evaluator.error(target, f"{name} cannot be assigned here.")
        steps: list[Any] = []
        for part, indices in ((None, subscripts), *rest):
            if part is not None:
                steps.append(part)
            if indices:
                steps.append(tuple(indices))
        env[name] = self._placed(env[name], steps, value, target, env)

    def _placed(
        self, old: Value, steps: list[Any], value: Value, target: Syntax, env: dict[str, Value]
    ) -> Value:
        if not steps:
            return value
        first, rest = steps[0], steps[1:]
        if isinstance(first, str):
            if not isinstance(old, Record):
                raise self.evaluator.error(target, f"there is no field {first} to assign.")
            return Record(
                old.type, {**old.fields, first: self._placed(old.fields[first], rest, value, target, env)}
            )
        index, *further = first
        inner = [tuple(further), *rest] if further else rest
        if not isinstance(old, list):
            raise self.evaluator.error(target, "an array without a size is assigned element by element.")
        evaluator = self._at(env)
        evaluator.ends.append(len(old))
        chosen = list(range(1, len(old) + 1)) if index.op == "colon" else evaluator.value(index)
        new = list(old)
        if isinstance(chosen, list):
            for k, i in enumerate(chosen):
                new[i - 1] = self._placed(old[i - 1], inner, value[k], target, env)
        elif isinstance(chosen, Term):
            for k in range(len(old)):
                here = make("noEvent", make("==", chosen, k + 1))
                put = self._placed(old[k], inner, value, target, env)
                new[k] = each(lambda a, b, c=here: make("if", c, a, b), put, old[k])
        else:
            if not 1 <= chosen <= len(old):
                raise self.evaluator.error(target, f"the subscript {chosen} is not in 1:{len(old)}.")
            new[chosen - 1] = self._placed(old[chosen - 1], inner, value, target, env)
        return new

    def _if(
        self, statement: Equation, env: dict[str, Value], rest: list[Equation]
    ) -> tuple[dict[str, Value], str, bool]:
        branches, otherwise = statement.args
        open_branches: list[tuple[Any, list[Equation]]] = []
        last = otherwise
        for condition, body in branches:
            chosen = self._at(env).value(condition)
            if chosen is False:
                continue
            if chosen is True:
                last = body
                break
            open_branches.append((chosen, body))
        if not open_branches:
            after, left = self.run(last, env)
            return after, left, False
        bodies = [body for _, body in open_branches] + [last]
        leaves = any(_leaves(body) for body in bodies)
        results = []
        for body in bodies:
            after, left = self.run(body, env)
            if left == "break":
                raise self._error(
                    statement, "a break under a condition unknown at export is a limit of this exporter."
                )
            if leaves and not left:
                after, left = self.run(rest, after)
            results.append(after)
        merged = results[-1]
        for (condition, _), result in zip(reversed(open_branches), reversed(results[:-1]), strict=True):
            merged = self._merged(condition, result, merged, statement)
        return merged, "return" if leaves else "", leaves

    def _merged(
        self, condition: Any, yes: dict[str, Value], no: dict[str, Value], statement: Equation
    ) -> dict[str, Value]:
        merged = {}
        for name in no:
            a, b = yes.get(name, UNSET), no[name]
            merged[name] = a if a is b else self._select(condition, a, b, statement)
        return merged

    def _select(self, condition: Any, a: Value, b: Value, statement: Equation) -> Value:
        if a is UNSET or b is UNSET:
            return b if a is UNSET else a
        if isinstance(a, tuple):
            return tuple(self._select(condition, x, y, statement) for x, y in zip(a, b, strict=True))
        if shape(a) != shape(b):
            raise self._error(
                statement, "branches that give an array different sizes are a limit of this exporter."
            )

        def choose(x: Any, y: Any) -> Any:
            if x is UNSET or y is UNSET:
                return y if x is UNSET else x
            return make("if", condition, x, y)

        return each(choose, a, b)

    def _for(self, statement: Equation, env: dict[str, Value]) -> tuple[dict[str, Value], str]:
        iterators, body = statement.args
        return self._loop(list(iterators), body, env, statement)

    def _loop(
        self, iterators: list[Any], body: list[Equation], env: dict[str, Value], statement: Equation
    ) -> tuple[dict[str, Value], str]:
        if not iterators:
            return self.run(body, env)
        (name, values), *rest = iterators
        hidden = env.get(name, UNSET)
        where = Syntax("number", (0,), statement.line)
        for value in self._at(env).iterated(name, values, where):
            env, left = self._loop(rest, body, {**env, name: value}, statement)
            if left == "break":
                break
            if left == "return":
                return env, left
        env = dict(env)
        env.pop(name, None)
        if hidden is not UNSET:
            env[name] = hidden
        return env, ""

    def _while(
        self, statement: Equation, env: dict[str, Value], unknown: int = 0
    ) -> tuple[dict[str, Value], str]:
        """Turns run at export; after one whose condition is unknown, the loop goes on as a branch of its own."""
        condition, body = statement.args
        for _ in range(MOST_TURNS):
            chosen = self._at(env).value(condition)
            if not isinstance(chosen, Term) and not chosen:
                return env, ""
            if unknown + isinstance(chosen, Term) > MOST_UNKNOWN:
                place = self.evaluator.scope.place(statement.line)
                raise _Unknown(
                    f"{place}: a while loop on a condition unknown at export is a limit of this exporter."
                )
            after, left = self.run(body, env)
            if isinstance(chosen, Term):
                if left == "return":
                    raise self._error(
                        statement, "a return out of such a while loop is a limit of this exporter."
                    )
                if left != "break":
                    after, _ = self._while(statement, after, unknown + 1)
                return self._merged(chosen, after, env, statement), ""
            env = after
            if left == "break":
                return env, ""
            if left:
                return env, left
        raise self._error(statement, f"a while loop runs more than {MOST_TURNS} times.")


def _leaves(statements: list[Equation]) -> bool:
    for statement in statements:
        if statement.op == "return":
            return True
        if statement.op == "if":
            branches, otherwise = statement.args
            if _leaves(otherwise) or any(_leaves(body) for _, body in branches):
                return True
    return False


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


__all__ = ["ClassDefinition", "Statements", "apply", "invoke"]
