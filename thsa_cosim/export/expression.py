"""Terms → CasADi expressions; what changes at events only becomes a symbol of its own.

A relation such as ``v > v_r`` that depends on a continuous variable becomes a *mode* m (0 or 1) with an event
indicator g = v - v_r; the mode is frozen between events (Modelica Language Specification 3.6, 8.5). ``v >= v_r`` is the
negation of ``v < v_r``, so that it holds where g is 0. Inside ``noEvent`` and over what is discrete the relation is
evaluated where it stands. ``pre``, ``edge``, ``sample`` and ``integer`` use the discrete variables of `Memory`.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import casadi as ca

from thsa_cosim.errors import ModelicaError
from thsa_cosim.export.domain import continued
from thsa_cosim.modelica.terms import Enumeration, Scalar, Term, text

_UNARY: dict[str, Callable[[ca.SX], ca.SX]] = {
    "sin": ca.sin,
    "cos": ca.cos,
    "tan": ca.tan,
    "asin": ca.asin,
    "acos": ca.acos,
    "atan": ca.atan,
    "sinh": ca.sinh,
    "cosh": ca.cosh,
    "tanh": ca.tanh,
    "exp": ca.exp,
    "log": ca.log,
    "log10": ca.log10,
    "sqrt": lambda a: continued(ca.sqrt, a),
    "neg": lambda a: -a,
    "not": ca.logic_not,
}
_BINARY: dict[str, Callable[[ca.SX, ca.SX], ca.SX]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "^": lambda a, b: power(a, b),
    "and": ca.logic_and,
    "or": ca.logic_or,
    "atan2": ca.atan2,
}
_DEPTH = 4  # of terms in messages
_RELATIONS = frozenset(("<", "<=", ">", ">="))
_WHOLE = frozenset(("floor", "ceil", "integer", "div", "mod", "rem"))


def power(base: ca.SX, exponent: ca.SX) -> ca.SX:
    """``base**exponent``; small whole exponents become products, which are exact and have no log in derivatives."""
    if exponent.is_constant() and float(exponent) in (2.0, 3.0, 4.0):
        result = base
        for _ in range(int(float(exponent)) - 1):
            result = result * base
        return result
    if exponent.is_constant() and float(exponent) > 0 and float(exponent) % 1:
        return continued(lambda b: b**exponent, base)
    return base**exponent


@dataclass
class Memory:
    """Discrete variables by name, each with the symbols of its value and of its value before the event.

    ``updates`` holds the new value at an event; ``left`` names those that only keep the left limit of a continuous
    variable; ``samples`` are pairs (start, interval) with the symbol that is 1 when they are due.
    """

    names: list[str] = field(default_factory=list)
    values: dict[str, ca.SX] = field(default_factory=dict)
    before: dict[str, ca.SX] = field(default_factory=dict)
    updates: dict[str, ca.SX] = field(default_factory=dict)
    left: set[str] = field(default_factory=set)
    samples: list[tuple[ca.SX, ca.SX, ca.SX]] = field(default_factory=list)
    initial: ca.SX = field(default_factory=lambda: ca.SX.sym("initial()"))
    uses_initial: bool = False

    def add(self, name: str) -> ca.SX:
        """A discrete variable; returns the symbol of its value."""
        if name not in self.values:
            self.names.append(name)
            self.values[name] = ca.SX.sym(f"now({name})")
            self.before[name] = ca.SX.sym(f"pre({name})")
        return self.values[name]

    def is_initial(self) -> ca.SX:
        """1 while the initial values are being found."""
        self.uses_initial = True
        return self.initial

    def symbols(self) -> set[str]:
        """Names of the symbols that change at events only."""
        held = [
            *self.values.values(),
            *self.before.values(),
            *(tick for *_, tick in self.samples),
            self.initial,
        ]
        return {str(symbol) for symbol in held}


@dataclass
class Translator:
    """Translates terms of one model and collects the modes that their relations need.

    ``symbols`` maps names to CasADi symbols or values; ``derivatives`` maps names to the symbols of their time
    derivatives; ``discrete`` names the symbols (parameters, constants) whose relations need no event. ``inline``
    holds Boolean and Integer variables by their defining expression. ``relations`` are the texts of the modes.
    """

    symbols: dict[str, ca.SX]
    derivatives: Callable[[str], ca.SX]
    discrete: frozenset[str]
    inline: dict[str, Scalar] = field(default_factory=dict)
    memory: Memory = field(default_factory=Memory)
    modes: list[ca.SX] = field(default_factory=list)
    indicators: list[ca.SX] = field(default_factory=list)
    relations: list[str] = field(default_factory=list)
    _done: dict[tuple[int, bool], ca.SX] = field(default_factory=dict)
    _kept: list[Term] = field(default_factory=list)
    _pending: set[str] = field(default_factory=set)
    _floors: list[tuple[ca.SX, ca.SX]] = field(default_factory=list)

    def real(self, value: Scalar, events: bool = True) -> ca.SX:
        """Translate a scalar (a Boolean becomes 0 or 1); raises ModelicaError for what is not supported."""
        if isinstance(value, Enumeration):
            return ca.SX(float(value.index))
        if not isinstance(value, Term):
            if not isinstance(value, (bool, int, float)):
                raise ModelicaError(f"a number is needed, not {value!r}.")
            return ca.SX(float(value))
        key = (id(value), events)
        if key not in self._done:
            self._kept.append(value)
            self._done[key] = self._translate(value, events)
        return self._done[key]

    def _translate(self, term: Term, events: bool) -> ca.SX:
        op, args = term.op, term.args
        if op == "ref":
            return self._variable(args[0], events)
        if op in _BINARY:
            return _BINARY[op](self.real(args[0], events), self.real(args[1], events))
        if op in _UNARY:
            return _UNARY[op](self.real(args[0], events))
        if op in _RELATIONS:
            a, b = (self.real(x, events) for x in args)
            return self._ordered(op, a, b, events, _shown(op, *args))
        if op in ("==", "<>"):
            return self._equal(op, *(self.real(x, events) for x in args), events=events)
        if op == "if":
            condition = self.real(args[0], events)
            return select(condition, self.real(args[1], events), self.real(args[2], events))
        if op == "noEvent":
            return self.real(args[0], events=False)
        if op == "homotopy":
            return self.real(args[0], events)
        if op in ("start", "smooth"):
            return self.real(args[-1], events)
        if op in ("max", "min", "abs", "sign"):
            return self._kinked(term, events)
        if op == "der":
            return self._derivative(args[0], events)
        if op in _WHOLE:
            return self._rounded(op, [self.real(a, events) for a in args], events, text(term, _DEPTH))
        return self._discrete(term)

    def _discrete(self, term: Term) -> ca.SX:
        op, args = term.op, term.args
        if op == "initial":
            return self.memory.is_initial()
        if op == "pre":
            return self._before(args[0])
        if op == "change":
            return ca.if_else(self.real(args[0]) == self._before(args[0]), 0, 1)
        if op == "edge":
            now, before = self.real(args[0]), self._before(args[0])
            return ca.logic_and(
                ca.logic_and(now, ca.logic_not(before)), ca.logic_not(self.memory.is_initial())
            )
        if op == "sample":
            return self._sample(*(self.real(a) for a in args))
        raise ModelicaError(f"the function {op}() is a limit of this exporter.")

    # -- relations

    def _timeless(self, expression: ca.SX) -> bool:
        held = self.memory.symbols() | {str(mode) for mode in self.modes}
        return all(str(s) in self.discrete or str(s) in held for s in ca.symvar(expression))

    def _ordered(self, op: str, a: ca.SX, b: ca.SX, events: bool, shown: str) -> ca.SX:
        difference = a - b if op in (">", "<=") else b - a
        if not events or self._timeless(difference):
            inclusive = op in ("<=", ">=")
            side = -difference if inclusive else difference
            return side >= 0 if inclusive else side > 0
        mode = self._mode(difference, shown)
        return ca.logic_not(mode) if op in ("<=", ">=") else mode

    def _mode(self, difference: ca.SX, shown: str) -> ca.SX:
        for mode, indicator in zip(self.modes, self.indicators, strict=True):
            if ca.is_equal(indicator, difference, 20):
                return mode
        mode = ca.SX.sym(f"mode({len(self.modes)})")
        self.modes.append(mode)
        self.indicators.append(difference)
        self.relations.append(shown)
        return mode

    def _equal(self, op: str, a: ca.SX, b: ca.SX, *, events: bool) -> ca.SX:
        if events and not self._timeless(a - b):
            raise ModelicaError("two Reals that vary in time are compared with == or <>, which has no event.")
        return a == b if op == "==" else a != b

    # -- variables

    def _variable(self, name: str, events: bool) -> ca.SX:
        if name in self.inline:
            if name in self._pending:
                raise ModelicaError(f"{name} depends on itself.")
            self._pending.add(name)
            try:
                return self.real(self.inline[name])  # the equation of a variable is outside of any noEvent()
            finally:
                self._pending.discard(name)
        if name not in self.symbols:
            raise ModelicaError(f"the variable {name} has no value that the exporter knows.")
        return self.symbols[name]

    def _derivative(self, argument: Scalar, events: bool) -> ca.SX:
        if isinstance(argument, Term) and argument.op == "ref":
            name = argument.args[0]
            if str(self.symbols.get(name, "")) in self.discrete:
                return ca.SX(0)
            return self.derivatives(name)
        expression = self.real(argument, events)
        result = ca.SX(0)
        names = {str(symbol): name for name, symbol in self.symbols.items()}
        for symbol in ca.symvar(expression):
            name = names.get(str(symbol), str(symbol))
            if str(symbol) in self.discrete or str(symbol) in self.memory.symbols():
                continue
            if name not in self.symbols and not name.startswith("der("):
                continue
            rate = ca.SX(1) if name == "time" else self.derivatives(name)
            result += ca.jacobian(expression, symbol) * rate
        return result

    def _before(self, argument: Scalar) -> ca.SX:
        """pre(): of a discrete variable its value before the event, of any other expression its left limit."""
        memory = self.memory
        if isinstance(argument, Term) and argument.op == "ref" and argument.args[0] in memory.before:
            return memory.before[argument.args[0]]
        if isinstance(argument, Term) and argument.op == "not":
            return ca.logic_not(self._before(argument.args[0]))
        expression = self.real(argument)
        if expression.is_constant():
            return expression
        for name, update in memory.updates.items():
            if ca.is_equal(update, expression, 20):
                return memory.before[name]
        held = memory.symbols() | {str(m) for m in self.modes}
        discrete = all(str(s) in self.discrete or str(s) in held for s in ca.symvar(expression))
        name = f"_{'condition' if discrete else 'left'}[{len(memory.names) + 1}]"
        memory.add(name)
        memory.updates[name] = expression
        if not discrete:
            memory.left.add(name)
        return memory.before[name]

    def _sample(self, start: ca.SX, interval: ca.SX) -> ca.SX:
        for known_start, known_interval, tick in self.memory.samples:
            if ca.is_equal(known_start, start, 20) and ca.is_equal(known_interval, interval, 20):
                return tick
        tick = ca.SX.sym(f"tick({len(self.memory.samples)})")
        self.memory.samples.append((start, interval, tick))
        return tick

    def _rounded(self, op: str, values: list[ca.SX], events: bool, shown: str) -> ca.SX:
        if op in ("floor", "integer"):
            return self._floor(values[0], events, shown)
        if op == "ceil":
            return -self._floor(-values[0], events, shown)
        a, b = values
        quotient = a / b
        if op == "mod":
            return a - self._floor(quotient, events, shown) * b
        above = self._ordered(">=", quotient, ca.SX(0), events, f"sign of {shown}")
        up, down = self._floor(quotient, events, shown), -self._floor(-quotient, events, shown)
        whole = select(above, up, down)
        return whole if op == "div" else a - whole * b

    def _floor(self, value: ca.SX, events: bool, shown: str) -> ca.SX:
        """The largest whole number not above the value; a discrete variable whose steps are events."""
        if not events or self._timeless(value):
            return ca.floor(value)
        for known, symbol in self._floors:
            if ca.is_equal(known, value, 20):
                return symbol
        name = f"_floor[{len(self.memory.names) + 1}]"
        now = self.memory.add(name)
        self._floors.append((value, now))
        above = ca.logic_not(self._mode(now + 1 - value, f"step of {shown}"))
        below = self._mode(now - value, f"step of {shown}")
        step = select(
            above, ca.fmax(now + 1, ca.floor(value)), select(below, ca.fmin(now - 1, ca.floor(value)), now)
        )
        self.memory.updates[name] = select(self.memory.is_initial(), ca.floor(value), step)
        return now

    def _kinked(self, term: Term, events: bool) -> ca.SX:
        function, args = term.op, (*term.args, 0.0)[:2]
        first, second = (self.real(a, events) for a in args)
        above = self._ordered(">", first, second, events, _shown(">", *args))
        if function == "max":
            return select(above, first, second)
        if function == "min":
            return select(above, second, first)
        if function == "abs":
            return select(above, first, -first)
        below = self._ordered(">", -first, ca.SX(0), events, _shown("<", *args))
        return above - below


def _shown(op: str, a: Scalar, b: Scalar) -> str:
    """A relation as its mode has it, for messages: that of ``a >= b`` holds where a < b."""
    strict = {">=": "<", "<=": ">"}.get(op, op)
    return f"{text(a, _DEPTH)} {strict} {text(b, _DEPTH)}"


def select(condition: ca.SX, yes: ca.SX, no: ca.SX) -> ca.SX:
    """``if condition then yes else no`` that does not let a NaN of the branch not taken through."""
    if condition.is_constant():
        return yes if float(condition) else no
    return ca.if_else(condition, yes, no)


__all__ = ["Memory", "Translator", "power", "select", "text"]
