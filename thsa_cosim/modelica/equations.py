"""Equations and algorithms of all instances → scalar equations, connections, assertions, reinitializations."""

from __future__ import annotations

from typing import Any

from thsa_cosim.errors import ModelicaError
from thsa_cosim.modelica.arrays import elements
from thsa_cosim.modelica.connections import Connections
from thsa_cosim.modelica.evaluate import Evaluator
from thsa_cosim.modelica.flat import Assertion, FlatEquation, Reinit
from thsa_cosim.modelica.pairing import (
    assigned as assigned_names,
)
from thsa_cosim.modelica.pairing import (
    assigns_alike,
    before,
    connects,
    edges,
    enabled,
    implicit_range,
    is_inside,
    paired,
    selected,
)
from thsa_cosim.modelica.scope import DISABLED, Scope
from thsa_cosim.modelica.statements import Env, Statements
from thsa_cosim.modelica.syntax import Equation, Syntax
from thsa_cosim.modelica.terms import Scalar, Term, make


class Collector:
    """Collects the equations of one model, instance by instance."""

    def __init__(self) -> None:
        self.equations: list[FlatEquation] = []
        self.initial: list[FlatEquation] = []
        self.reinits: list[Reinit] = []
        self.assertions: list[Assertion] = []
        self.connections = Connections()
        self.discrete: set[str] = set()
        self.given_flows: set[str] = set()
        self._seen: set[int] = set()

    def collect(self, scope: Scope) -> None:
        """Equations of an instance and of everything in it."""
        if id(scope) in self._seen:
            return
        self._seen.add(id(scope))
        for name in scope.elements:
            if scope.declares(name):
                self._node(scope.component(name), scope)
        self._own(scope)

    def _node(self, node: Any, container: Scope) -> None:
        if isinstance(node, list):
            for part in node:
                self._node(part, container)
        elif isinstance(node, Scope) and node.container is container:
            self.collect(node)

    def _own(self, scope: Scope) -> None:
        for base in scope.bases:
            self._own(base)
        definition = scope.definition
        evaluator = Evaluator(scope)
        for equation in definition.equations:
            self.equations += self.of(equation, evaluator)
        for equation in definition.initial_equations:
            self.initial += self.of(equation, evaluator, initial=True)
        for section in definition.algorithms:
            self.equations += self._algorithm(section, evaluator, False)
        for section in definition.initial_algorithms:
            self.initial += self._algorithm(section, evaluator, True)

    # -- equations

    def of(
        self, equation: Equation, evaluator: Evaluator, initial: bool = False, guard: Scalar = True
    ) -> list[FlatEquation]:
        """Scalar equations of one equation; ``guard`` is the condition of the branch around it."""
        op, place = equation.op, evaluator.scope.place(equation.line)
        if op == "equal":
            return self._equal(equation, evaluator, place)
        if op == "connect":
            if guard is not True:
                raise ModelicaError(f"{place}: connect() under a condition that is not known at export.")
            self._connect(equation, evaluator, place)
            return []
        if op == "for":
            iterators, body = equation.args
            return self._for(list(iterators), body, evaluator, initial, guard, equation)
        if op == "if":
            return self._if(equation, evaluator, initial, guard, place)
        if op == "when":
            if initial:
                raise ModelicaError(f"{place}: a when clause cannot stand among initial equations.")
            return self._when(equation, evaluator, place)
        if op == "call":
            return self._call(equation.args[0], evaluator, guard, place)
        raise ModelicaError(f"{place}: a {op} among equations is not Modelica.")

    def _equal(self, equation: Equation, evaluator: Evaluator, place: str) -> list[FlatEquation]:
        left_side, right_side = equation.args
        right = evaluator.value(right_side)
        if left_side.op == "tuple":
            values = right if isinstance(right, tuple) else (right,)
            made = []
            for item, value in zip(left_side.args, values, strict=False):
                if item.op != "colon":
                    made += paired(evaluator.value(item), value, place)
            return made
        made = paired(evaluator.value(left_side), right[0] if isinstance(right, tuple) else right, place)
        self._note_flows(made, evaluator)
        return made

    def _note_flows(self, made: list[FlatEquation], evaluator: Evaluator) -> None:
        """Remember flows of components' connectors that an equation around the component gives."""
        depth = (evaluator.scope.instance.path or "").count(".") + bool(evaluator.scope.instance.path)
        for equation in made:
            for side in (equation.left, equation.right):
                if isinstance(side, Term) and side.op == "ref" and side.args[0].count(".") >= depth + 2:
                    variable = evaluator.scope.world.variables.get(side.args[0])
                    if variable is not None and "flow" in variable.prefixes:
                        self.given_flows.add(side.args[0])

    def _connect(self, equation: Equation, evaluator: Evaluator, place: str) -> None:
        nodes, inside = [], []
        evaluator = evaluator.with_local({})
        evaluator.connecting = True
        for side in equation.args:
            if side.op != "name":
                raise ModelicaError(f"{place}: connect() takes the names of two connectors.")
            nodes.append(evaluator.node(side) if enabled(side, evaluator) else DISABLED)
            inside.append(is_inside(side, evaluator))
        self.connections.connect(nodes[0], nodes[1], inside[0], inside[1], place)

    def _for(
        self, iterators: list[Any], body: list[Equation], evaluator: Evaluator, initial: bool, guard: Scalar,
        equation: Equation,
    ) -> list[FlatEquation]:  # fmt: skip
        if not iterators:
            return [made for inner in body for made in self.of(inner, evaluator, initial, guard)]
        (name, values), *rest = iterators
        where = Syntax("number", (0,), equation.line)
        if values is None:
            values = implicit_range(name, body, where)
        made = []
        for value in evaluator.iterated(name, values, where):
            made += self._for(rest, body, evaluator.with_local({name: value}), initial, guard, equation)
        return made

    def _if(
        self, equation: Equation, evaluator: Evaluator, initial: bool, guard: Scalar, place: str
    ) -> list[FlatEquation]:
        branches, otherwise = equation.args
        chosen: list[tuple[Scalar, list[Equation]]] = []
        last = otherwise
        for condition, body in branches:
            value = evaluator.folded(evaluator.value(condition), condition)
            if value is False:
                continue
            if value is True:
                last = body
                break
            chosen.append((value, body))
        if not chosen:
            return [made for inner in last for made in self.of(inner, evaluator, initial, guard)]
        if any(connects(body) for _, body in chosen) or connects(last):
            return self._structural_if(chosen, last, evaluator, initial, guard, equation)
        kept = len(self.assertions), len(self.reinits)
        remaining: Scalar = guard
        sides = []
        for condition, body in chosen:
            inner_guard = make("and", remaining, condition)
            sides.append([m for e in body for m in self.of(e, evaluator, initial, inner_guard)])
            remaining = make("and", remaining, make("not", condition))
        sides.append([m for e in last for m in self.of(e, evaluator, initial, remaining)])
        uneven = len({len(side) for side in sides}) > 1
        if uneven or (evaluator.tuned([c for c, _ in chosen]) and (initial or not assigns_alike(sides))):
            del self.assertions[kept[0] :], self.reinits[kept[1] :]
            return self._structural_if(chosen, last, evaluator, initial, guard, equation)
        return selected([c for c, _ in chosen], sides, place)

    def _structural_if(
        self, chosen: list[Any], last: list[Equation], evaluator: Evaluator, initial: bool, guard: Scalar,
        equation: Equation,
    ) -> list[FlatEquation]:  # fmt: skip
        where = Syntax("number", (0,), equation.line)
        for condition, body in chosen:
            if evaluator.fixed(
                condition, where, "the condition of branches with different numbers of equations"
            ):
                return [made for inner in body for made in self.of(inner, evaluator, initial, guard)]
        return [made for inner in last for made in self.of(inner, evaluator, initial, guard)]

    def _call(self, call: Syntax, evaluator: Evaluator, guard: Scalar, place: str) -> list[FlatEquation]:
        if call.op != "call":
            raise ModelicaError(f"{place}: an equation or the call of a function is expected.")
        name, arguments, named = call.args
        if name == "assert":
            self._assert(arguments, named, evaluator, guard, place)
        elif name == "reinit":
            raise ModelicaError(f"{place}: reinit() stands outside of a when clause.")
        elif name == "terminate":
            raise ModelicaError(f"{place}: terminate() is a limit of this exporter.")
        elif not name.startswith(("Connections.", ".Connections.")):
            value = evaluator.value(call)
            if any(
                isinstance(v, Term) for v in elements(value if not isinstance(value, tuple) else list(value))
            ):
                raise ModelicaError(f"{place}: the call of {name}() has no effect here.")
        return []

    def _assert(self, arguments: Any, named: Any, evaluator: Evaluator, guard: Scalar, place: str) -> None:
        condition = evaluator.value(named.get("condition", arguments[0] if arguments else None))
        if guard is not True:
            condition = make("or", make("not", guard), condition)
        if condition is True:
            return
        try:
            message = evaluator.value(named["message"] if "message" in named else arguments[1])
        except (ModelicaError, IndexError):
            message = "an assertion is violated"
        level = "error"
        given = named.get("level", arguments[2] if len(arguments) > 2 else None)
        if given is not None and given.op == "name" and given.args[-1][0] == "warning":
            level = "warning"
        text = message if isinstance(message, str) else "an assertion is violated"
        if level == "error" and (condition is False or evaluator.by_default(condition) is False):
            raise ModelicaError(f"{place}: an assertion fails: {text.rstrip('.')}.")
        self.assertions.append(Assertion(condition, text, level, place))

    # -- when

    def _when(self, equation: Equation, evaluator: Evaluator, place: str) -> list[FlatEquation]:
        branches, _ = equation.args
        fired: list[tuple[Scalar, dict[str, Scalar]]] = []
        earlier: Scalar = False
        for condition, body in branches:
            active = edges(evaluator.value(condition))
            own = make("and", active, make("not", earlier))
            fired.append((active, self._when_body(body, evaluator, own)))
            earlier = make("or", earlier, active)
        names = list(dict.fromkeys(name for _, assigned in fired for name in assigned))
        made = []
        for name in names:
            reference = Term("ref", (name,))
            value: Scalar = Term("pre", (reference,))
            for active, assigned in reversed(fired):
                value = make("if", active, assigned.get(name, Term("pre", (reference,))), value)
            self.discrete.add(name)
            made.append(FlatEquation(reference, value, place, True))
        return made

    def _when_body(self, body: list[Equation], evaluator: Evaluator, guard: Scalar) -> dict[str, Scalar]:
        assigned: dict[str, Scalar] = {}
        for equation in body:
            place = evaluator.scope.place(equation.line)
            if equation.op == "call" and equation.args[0].args[0] == "reinit":
                self._reinit(equation.args[0], evaluator, guard, place)
            elif equation.op == "if":
                self._when_if(equation, evaluator, guard, assigned)
            elif equation.op == "for":
                (name, values), *rest = equation.args[0]
                inner = equation.args[1]
                if rest:
                    inner = [Equation("for", (tuple(rest), inner), equation.line)]
                where = Syntax("number", (0,), equation.line)
                for value in evaluator.iterated(name, values, where):
                    assigned |= self._when_body(inner, evaluator.with_local({name: value}), guard)
            else:
                for flat in self.of(equation, evaluator, False, guard):
                    left = flat.left
                    if not (isinstance(left, Term) and left.op == "ref"):
                        raise ModelicaError(
                            f"{place}: an equation in a when clause has to be 'variable = expression'."
                        )
                    assigned[left.args[0]] = flat.right
        return assigned

    def _when_if(
        self, equation: Equation, evaluator: Evaluator, guard: Scalar, assigned: dict[str, Scalar]
    ) -> None:
        branches, otherwise = equation.args
        conditions, results = [], []
        remaining = guard
        for condition, body in branches:
            value = evaluator.value(condition)
            conditions.append(value)
            results.append(self._when_body(body, evaluator, make("and", remaining, value)))
            remaining = make("and", remaining, make("not", value))
        last = self._when_body(otherwise, evaluator, remaining)
        for name in dict.fromkeys(n for r in (*results, last) for n in r):
            held = assigned.get(name, Term("pre", (Term("ref", (name,)),)))
            value = last.get(name, held)
            for condition, result in zip(reversed(conditions), reversed(results), strict=True):
                value = make("if", condition, result.get(name, held), value)
            assigned[name] = value

    def _reinit(self, call: Syntax, evaluator: Evaluator, guard: Scalar, place: str) -> None:
        _, arguments, _ = call.args
        states, values = elements(evaluator.value(arguments[0])), elements(evaluator.value(arguments[1]))
        for state, value in zip(states, values, strict=True):
            if not (isinstance(state, Term) and state.op == "ref"):
                raise ModelicaError(f"{place}: reinit() takes a state and its new value.")
            self.reinits.append(Reinit(state.args[0], guard, value, place))

    # -- algorithms

    def _algorithm(self, section: list[Equation], evaluator: Evaluator, initial: bool) -> list[FlatEquation]:
        targets = assigned_names(section)
        env: Env = {}
        for name in dict.fromkeys(targets):
            node = evaluator.node(Syntax("name", ((name, ()),), section[0].line))
            whole = evaluator.of_node(node, Syntax("name", ((name, ()),), section[0].line))
            env[name] = before(whole, evaluator, targets[name], initial)
        runner = _Section(self, evaluator)
        after = runner.run(section, env)
        place = evaluator.scope.place(section[0].line)
        made = []
        for name in env:
            whole = evaluator.value(Syntax("name", ((name, ()),), section[0].line))
            for old, reference, value in zip(
                elements(env[name]), elements(whole), elements(after[name]), strict=True
            ):
                if value is old:
                    continue
                if isinstance(reference, Term) and reference.op == "ref":
                    if targets[name]:
                        self.discrete.add(reference.args[0])
                    made.append(FlatEquation(reference, value, place, targets[name]))
        return made


class _Section(Statements):
    """An algorithm section of a model: statements with events."""

    def __init__(self, collector: Collector, evaluator: Evaluator) -> None:
        super().__init__(evaluator)
        self.collector = collector

    def _statement(self, statement: Equation, env: Env) -> Any:
        if statement.op == "when":
            return self._when(statement, env), []
        return super()._statement(statement, env)

    def _when(self, statement: Equation, env: Env) -> Env:
        branches, _ = statement.args
        results = []
        outer = self.guard
        earlier: Scalar = False
        for condition, body in branches:
            active = edges(self._at(env).value(condition))
            self.guard = make("and", outer, make("and", active, make("not", earlier)))
            results.append((active, self.run(body, env)))
            earlier = make("or", earlier, active)
        self.guard = outer
        merged = env
        for active, after in reversed(results):
            merged = self._merged(active, after, merged, statement.line)
        return merged

    def _at(self, env: Env) -> Evaluator:
        made = Evaluator(self.evaluator.scope, {**self.evaluator.local, **env}, False)
        return made

    def _call(self, statement: Equation, env: Env) -> None:
        call = statement.args[0]
        place = self.evaluator.scope.place(statement.line)
        if call.args[0] == "reinit":
            self.collector._reinit(call, self._at(env), self.guard, place)
        else:
            self.collector._call(call, self._at(env), self.guard, place)


__all__ = ["Collector", "edges", "paired"]
