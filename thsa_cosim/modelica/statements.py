"""Statements of algorithms and functions, run at export on values that may be terms.

An ``if`` on a condition that is not known at export runs its branches and selects. A branch that ends with ``return``
or ``break`` leaves the rest to the others, which go on as if it had not been taken: what they know stays known.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any, NamedTuple

from thsa_cosim.errors import ModelicaError
from thsa_cosim.modelica.arrays import UNSET, Record, Value, each, shape
from thsa_cosim.modelica.evaluate import Evaluator
from thsa_cosim.modelica.syntax import Equation, Syntax
from thsa_cosim.modelica.terms import Scalar, Term, make

MOST_TURNS = 100_000
MOST_UNKNOWN = 200  # turns of a loop whose end is not known at export

Env = dict[str, Value]  # values by name
Step = Callable[[Env], "tuple[Env | None, list[_Exit]]"]


class UnknownStepsError(ModelicaError):
    """The steps of a function depend on values that are not known at export."""


class _Exit(NamedTuple):
    """Where a "return" or a "break" leaves, given that no earlier one does."""

    condition: Scalar
    env: Env
    kind: str


class Statements:
    """Runs statements on an environment, whose values stay; ``guard`` is the condition under which they are run."""

    def __init__(self, evaluator: Evaluator, asserted: Any = None) -> None:
        self.evaluator = evaluator
        self.asserted = asserted
        self.guard: Scalar = True
        self.partly: set[str] = set()  # names that some branch gave no value

    def _at(self, env: Env) -> Evaluator:
        made = Evaluator(self.evaluator.scope, env, self.evaluator.in_function)
        made.local = env
        return made

    def run(self, statements: Sequence[Equation], env: Env) -> Env:
        """The environment after the statements."""
        after, exits = self._sequence(statements, env)
        return self._folded(after, exits, statements[0].line if statements else 0)

    def _sequence(self, statements: Sequence[Equation], env: Env) -> tuple[Env | None, list[_Exit]]:
        """The environment where nothing leaves, None if something always does, and the exits in their order."""
        return self._in_turn([partial(self._statement, statement) for statement in statements], dict(env))

    def _in_turn(self, steps: Iterable[Step], env: Env) -> tuple[Env | None, list[_Exit]]:
        """Each step where those before it have not left."""
        exits: list[_Exit] = []
        live: Env | None = env
        outer = self.guard
        for step in steps:
            assert live is not None
            live, more = step(live)
            exits += more
            if live is None:
                break
            for leaving in more:
                self.guard = make("and", self.guard, make("not", leaving.condition))
        self.guard = outer
        return live, exits

    def _statement(self, statement: Equation, env: Env) -> tuple[Env | None, list[_Exit]]:
        op = statement.op
        if op == "assign":
            self._assign(statement, env)
        elif op == "call":
            self._call(statement, env)
        elif op == "if":
            return self._if(statement, env)
        elif op == "for":
            iterators, body = statement.args
            return self._for(list(iterators), body, env, statement)
        elif op == "while":
            return self._while(statement, env)
        elif op in ("return", "break"):
            return None, [_Exit(True, env, op)]
        else:
            raise self._error(statement, f"a {op} statement is a limit of this exporter here.")
        return env, []

    def _error(self, statement: Equation, what: str) -> ModelicaError:
        return ModelicaError(f"{self.evaluator.scope.place(statement.line)}: {what}")

    def _call(self, statement: Equation, env: Env) -> None:
        if self.asserted is not None:
            self.asserted(statement, self._at(env))

    def _assign(self, statement: Equation, env: Env) -> None:
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

    def store(self, target: Syntax, value: Value, env: Env) -> None:
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
        if self.guard is True and not steps:
            self.partly.discard(name)
        env[name] = self._placed(env[name], steps, value, target, env)

    def _placed(self, old: Value, steps: list[Any], value: Value, target: Syntax, env: Env) -> Value:
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

    # -- branches and loops

    def _if(self, statement: Equation, env: Env) -> tuple[Env | None, list[_Exit]]:
        branches, otherwise = statement.args
        outer, path = self.guard, True
        exits: list[_Exit] = []
        ends: list[tuple[Scalar, Env]] = []
        for condition, body in (*branches, (None, otherwise)):
            chosen = True if condition is None else self._at(env).value(condition)
            if chosen is False:
                continue
            here = make("and", path, chosen)
            self.guard = make("and", outer, here)
            after, left = self._sequence(body, env)
            exits += [leaving._replace(condition=make("and", here, leaving.condition)) for leaving in left]
            if after is not None:
                ends.append((chosen, after))
            if chosen is True:
                break
            path = make("and", path, make("not", chosen))
        self.guard = outer
        if not ends:
            return None, exits
        merged = ends[-1][1]
        for chosen, after in reversed(ends[:-1]):
            merged = self._merged(chosen, after, merged, statement.line)
        return merged, exits

    def _folded(self, live: Env | None, exits: Sequence[_Exit], line: int) -> Env:
        """One environment of all ways out."""
        ways = list(exits)
        if live is None:
            live = ways.pop().env
        for leaving in reversed(ways):
            live = self._merged(leaving.condition, leaving.env, live, line)
        return live

    def _after_loop(
        self, live: Env | None, exits: Sequence[_Exit], line: int
    ) -> tuple[Env | None, list[_Exit]]:
        """What a loop leaves behind: its breaks end here, its returns go on."""
        returns: list[_Exit] = []
        broken: Scalar = False
        for leaving in exits:
            if leaving.kind == "break":
                broken = make("or", broken, leaving.condition)
            else:
                condition = make("and", make("not", broken), leaving.condition)
                returns.append(leaving._replace(condition=condition))
        breaks = [leaving for leaving in exits if leaving.kind == "break"]
        if live is None and not breaks:
            return None, returns
        return self._folded(live, breaks, line), returns

    def _for(
        self, iterators: list[Any], body: list[Equation], env: Env, statement: Equation
    ) -> tuple[Env | None, list[_Exit]]:
        (name, values), *rest = iterators
        if rest:
            body = [Equation("for", (tuple(rest), body), statement.line)]
        where = Syntax("number", (0,), statement.line)

        def turn(value: Value, live: Env) -> tuple[Env | None, list[_Exit]]:
            return self._sequence(body, {**live, name: value})

        through = self._at(env).iterated(name, values, where)
        live, exits = self._in_turn([partial(turn, value) for value in through], env)
        live, exits = self._after_loop(live, exits, statement.line)

        def restored(after: Env) -> Env:
            after = {key: value for key, value in after.items() if key != name}
            return {**after, name: env[name]} if name in env else after

        exits = [leaving._replace(env=restored(leaving.env)) for leaving in exits]
        return (None if live is None else restored(live)), exits

    def _while(self, statement: Equation, env: Env) -> tuple[Env | None, list[_Exit]]:
        """Turns run at export; where the condition is unknown, the loop may end there, and goes on as if it did not."""
        condition, body = statement.args
        exits: list[_Exit] = []
        live: Env | None = env
        outer, unknown = self.guard, 0
        for _ in range(MOST_TURNS):
            assert live is not None
            chosen = self._at(live).value(condition)
            more: list[_Exit] = []
            if isinstance(chosen, Term):
                unknown += 1
                if unknown > MOST_UNKNOWN:
                    place = self.evaluator.scope.place(statement.line)
                    raise UnknownStepsError(
                        f"{place}: a while loop on a condition unknown at export is a limit of this exporter."
                    )
                more.append(_Exit(make("not", chosen), live, "break"))
            elif not chosen:
                break
            live, further = self._sequence(body, live)
            more += further
            exits += more
            if live is None:
                break
            for leaving in more:
                self.guard = make("and", self.guard, make("not", leaving.condition))
        else:
            raise self._error(statement, f"a while loop runs more than {MOST_TURNS} times.")
        self.guard = outer
        return self._after_loop(live, exits, statement.line)

    def _merged(self, condition: Any, yes: Env, no: Env, line: int) -> Env:
        merged = {}
        for name in no:
            a, b = yes.get(name, UNSET), no[name]
            if (a is UNSET) != (b is UNSET):
                self.partly.add(name)
            merged[name] = a if a is b else self._select(condition, a, b, line)
        return merged

    def _select(self, condition: Any, a: Value, b: Value, line: int) -> Value:
        if a is UNSET or b is UNSET:
            return b if a is UNSET else a
        if isinstance(a, tuple):
            return tuple(self._select(condition, x, y, line) for x, y in zip(a, b, strict=True))
        if shape(a) != shape(b):
            raise ModelicaError(
                f"{self.evaluator.scope.place(line)}: branches that give an array different sizes are a limit of this "
                "exporter."
            )

        def choose(x: Any, y: Any) -> Any:
            if x is UNSET or y is UNSET:
                return y if x is UNSET else x
            return make("if", condition, x, y)

        return each(choose, a, b)
