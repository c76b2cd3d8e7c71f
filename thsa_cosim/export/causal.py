"""Flat model → explicit ordinary differential equation with outputs, events and initial values (CasADi SX)."""

import math
from dataclasses import replace

import casadi as ca

from thsa_cosim.errors import ModelicaError
from thsa_cosim.export.discrete import referenced, split_discrete
from thsa_cosim.export.domain import with_domains
from thsa_cosim.export.expression import Translator
from thsa_cosim.export.initialization import Initial, first_indicators, initial_values, simplified_indicators
from thsa_cosim.export.model import CausalModel, Events, column
from thsa_cosim.export.solve import HOMOTOPY, EquationSystem
from thsa_cosim.export.uniqueness import several_solutions
from thsa_cosim.export.variables import VariableTable
from thsa_cosim.modelica.flat import Assertion, FlatEquation, FlatModel, FlatVariable
from thsa_cosim.modelica.terms import Scalar, Term, make, plain, substitute, text, walk

INFINITE = 1e100
"""Stands for Modelica.Constants.inf as a start value ("not yet"): sums with it have to stay finite."""


def make_causal(flat: FlatModel) -> CausalModel:
    """Order and solve the equations of a flat model.

    Raises ModelicaError, naming the equation and the variable, for a singular system, a constraint that needs the
    derivative of an input, and an over-determined initialization.
    """
    if flat.reinits and any(v.state_select in ("prefer", "always") for v in flat.variables.values()):
        # what else jumps at a reinit depends on the choice of states: those that the model prefers are made candidates
        try:
            return with_domains(Builder(flat, preferred=True).build())
        except ModelicaError:
            pass
    return with_domains(Builder(flat).build())


class Builder:
    """Holds what the steps of one translation share."""

    def __init__(self, flat: FlatModel, preferred: bool = False) -> None:
        self.flat = flat
        self.preferred = preferred  # preferred states without a derivative in the equations get one
        self.values: dict[str, float] = {}
        self.time = ca.SX.sym("time")
        self.parameters: list[FlatVariable] = []
        self.dependents: list[FlatVariable] = []
        self.inputs: list[FlatVariable] = []
        self.unknowns: list[FlatVariable] = []
        self.free: list[FlatVariable] = []  # parameters that the initial equations determine
        self.discretes: list[FlatVariable] = []
        self.split = split_discrete(flat)
        self.symbols: dict[str, ca.SX] = {"time": self.time}
        self.translator = Translator(self.symbols, self._derivative, frozenset(), {})
        self.memory = self.translator.memory
        self._determined: dict[str, bool] = {}
        for variable in flat.variables.values():
            self._sort(variable)
        self.translator.discrete = frozenset(v.name for v in (*self.parameters, *self.dependents))
        self.system = EquationSystem(self.time, frozenset(v.name for v in self.inputs), self._parameter)

    def _sort(self, variable: FlatVariable) -> None:
        name, symbols = variable.name, self.symbols
        if variable.variability == "constant" or (
            variable.structural and variable.variability == "parameter"
        ):
            symbols[name] = ca.SX(self._value(name))
        elif variable.tunable:
            symbols[name] = ca.SX.sym(name)
            self.parameters.append(variable)
        elif variable.variability == "parameter" and variable.type != "Real":
            if isinstance(variable.binding, Term) and self.depends(variable.binding):
                self.translator.inline[name] = variable.binding
            else:
                symbols[name] = ca.SX(self._value(name))
        elif variable.variability == "parameter":
            self._sort_parameter(variable)
        elif variable.causality == "input":
            symbols[name] = ca.SX.sym(name)
            self.inputs.append(variable)
        elif variable.variability == "discrete":
            self.discretes.append(variable)
            if name in self.split.inline:
                self.translator.inline[name] = self.split.definitions[name]
            else:
                symbols[name] = self.memory.add(name)
        else:
            symbols[name] = ca.SX.sym(name)
            self.unknowns.append(variable)

    def _sort_parameter(self, variable: FlatVariable) -> None:
        name = variable.name
        if variable.binding is None and variable.fixed is False:
            self.symbols[name] = self.memory.add(name)
            self.free.append(variable)
        elif self._from_free(variable.binding):
            self.symbols[name] = ca.SX.sym(name)
            self.unknowns.append(variable)
        else:
            self.symbols[name] = ca.SX.sym(name)
            calculated = variable.final or self.depends(variable.binding)
            (self.dependents if calculated else self.parameters).append(variable)

    def _from_free(self, binding: Scalar | None) -> bool:
        """Whether a binding depends on a parameter that the initial equations determine."""
        for name in referenced([binding]):
            if name not in self._determined:
                variable = self.flat.variables.get(name)
                self._determined[name] = False
                if variable is not None and variable.variability == "parameter":
                    free = variable.binding is None and variable.fixed is False and not variable.structural
                    self._determined[name] = free or self._from_free(variable.binding)
            if self._determined[name]:
                return True
        return False

    def depends(self, value: Scalar | None) -> bool:
        """Whether a value refers to a parameter that can be set."""
        for name in referenced([value]):
            variable = self.flat.variables.get(name)
            if variable is None or (
                variable.variability == "parameter"
                and not variable.structural
                and (variable.type == "Real" or variable.tunable or self.depends(variable.binding))
            ):
                return True
        return False

    def _parameter(self, name: str) -> float | None:
        """Default value of a parameter that a symbol stands for; None for what is no parameter, or found initially."""
        known = {v.name for v in (*self.parameters, *self.dependents)}
        return self._value(name) if name in known else None

    def _value(self, name: str, pending: tuple[str, ...] = ()) -> float:
        """Default value of a parameter or constant."""
        if name not in self.values:
            variable = self.flat.variables.get(name)
            if variable is None or variable.variability not in ("parameter", "constant") or name in pending:
                raise ModelicaError(
                    f"{self.flat.name}: the value of {(*pending, name)[0]} depends on {name}, which has no fixed value."
                )
            given = variable.start if variable.binding is None else variable.binding
            self.values[name] = self.evaluate(given, (*pending, name)) or 0.0
        return self.values[name]

    def evaluate(self, value: Scalar | None, pending: tuple[str, ...] = ()) -> float | None:
        """Numeric value of an attribute at the default parameters, None when there is none."""
        if value is None:
            return None

        def known(term: Term) -> Scalar | None:
            if term.op == "ref":
                return self._value(term.args[0], pending)
            return term.args[0] if term.op == "noEvent" and not isinstance(term.args[0], Term) else None

        result = plain(substitute(value, known, {}))
        if isinstance(result, Term):
            return float(Translator({}, self._derivative, frozenset()).real(result, events=False))
        return float(result)

    def _derivative(self, name: str) -> ca.SX:
        return self.system.derivative(name)

    # -- the steps

    def build(self) -> CausalModel:
        """The model; raises ModelicaError as `make_causal` does."""
        system, translate = self.system, self.translator
        for variable in self.unknowns:
            system.add_variable(variable.name, self.symbols[variable.name], self._preference(variable))
        for equation in self.split.equations:
            row = system.add_equation(self._translated(equation), str(equation), equation.place)
            self._simplify(row, equation)
        for variable in self.unknowns:
            if variable.binding is not None:
                reference = Term("ref", (variable.name,))
                bound = self._at(variable.place, Term("-", (reference, variable.binding)))
                row = system.add_equation(
                    bound, f"{variable.name} = {text(variable.binding)}", variable.place
                )
                self._simplify(row, FlatEquation(reference, variable.binding, variable.place))
        dependent = self._dependent_values()
        initial_equations = [
            (self._translated(e), f"{e} ({e.place})" if e.place else str(e))
            for e in self.split.initial_equations
        ]
        self._updates()
        reinits = [(r, self._at(r.place, r.condition), self._at(r.place, r.value)) for r in self.flat.reinits]
        asserted = [self._assertion(a) for a in self.flat.assertions]
        shown = {v.name: self._at(v.place, Term("ref", (v.name,))) for v in self.discretes}
        self._finish_updates()
        self._give_a_state()
        if self.preferred:
            for variable in self.unknowns:
                if variable.state_select in ("prefer", "always"):
                    system.derivative(variable.name)
        states = system.prepare(self.flat.name)
        solution = system.solve(self.flat.name)
        for block in system.blocks:
            if several_solutions(block, self._parameter):
                raise ModelicaError(
                    f"{self.flat.name}: the loop of {', '.join(block.names[:4])} has several solutions at once "
                    "(positive feedback through noEvent()), of which the exporter cannot tell the right one; let the "
                    "relation make events, or put a state (a capacity, a filter) into the loop."
                )
        initial = initial_values(self, states, initial_equations)
        unknown = [system.symbols[n] for n in solution]
        solved = list(solution.values())

        def final(expression: ca.SX) -> ca.SX:
            return ca.substitute([expression], unknown, solved)[0]

        x = column([system.symbols[s] for s in states])
        shown = {name: final(expression) for name, expression in shown.items()}
        table = VariableTable(self, states, solution, initial.settable, shown)
        variables, algebraic, outputs = table.build()
        indicators = final(column(translate.indicators))
        return CausalModel(
            flat=self.flat,
            states=tuple(states),
            variables=variables,
            time=self.time,
            x=x,
            u=column([self.symbols[v.name] for v in self.inputs]),
            p=column([self.symbols[v.name] for v in self.parameters]),
            d=column([self.symbols[v.name] for v in self.dependents]),
            m=self._constant_between_events(),
            x_start=initial.x_start,
            rhs=column([solution[system.derivative_name(s)] for s in states]),
            w=algebraic,
            outputs=outputs,
            g=indicators,
            relations=tuple(translate.relations),
            pivots=system.pivots,
            g_start=first_indicators(self, indicators, x, initial),
            g_simplified=simplified_indicators(self, initial),
            dependent=dependent,
            initial=initial.x,
            events=self._events(final, x, states, reinits, initial),
            blocks=system.blocks,
            initial_blocks=initial.blocks,
            y_start=initial.y_start,
            assertions=final(column(asserted)),
        )

    def _give_a_state(self) -> None:
        """A model with events and no state gets one: the stepping loop finds events on the way of the states."""
        if self.system.has_derivatives or not (self.translator.modes or self.memory.samples):
            return
        name = "_time"
        variable = FlatVariable(
            name, "Real", "continuous", "local", None, None, "No state of the model: constant, for the solver", 0.0,
            None, None, None, None, True, False, "default", False, "",
        )  # fmt: skip
        self.flat = replace(self.flat, variables={**self.flat.variables, name: variable})
        self.symbols[name] = ca.SX.sym(name)
        self.unknowns.append(variable)
        self.system.add_variable(name, self.symbols[name], self._preference(variable))
        self.system.add_equation(self.system.derivative(name), f"der({name}) = 0")

    def _translated(self, equation: FlatEquation) -> ca.SX:
        try:
            return self.translator.real(equation.left) - self.translator.real(equation.right)
        except ModelicaError as error:
            raise ModelicaError(f"{equation.place}: in the equation {equation}: {error}") from error

    def _simplify(self, row: int, equation: FlatEquation) -> None:
        """Note what an equation with homotopy() is on the way from the simplified to the actual initial system."""
        if not any(term.op == "homotopy" for term in walk((equation.left, equation.right))):
            return

        def along(term: Term) -> Scalar | None:
            if term.op != "homotopy":
                return None
            actual, simplified = (make("noEvent", substitute(a, along, {})) for a in term.args)
            return make("+", actual, make("*", Term("ref", (HOMOTOPY,)), make("-", simplified, actual)))

        if HOMOTOPY not in self.symbols:
            self.symbols[HOMOTOPY] = ca.SX.sym(HOMOTOPY)
        sides = [substitute(side, along, {}) for side in (equation.left, equation.right)]
        self.system.simplified[row] = self._at(equation.place, make("-", *sides))

    def _at(self, place: str, value: Scalar) -> ca.SX:
        try:
            return self.translator.real(value)
        except ModelicaError as error:
            raise ModelicaError(f"{place}: in {text(value)}: {error}") from error

    def _assertion(self, assertion: Assertion) -> ca.SX:
        """Positive where the assertion is violated; assertions make no events."""
        try:
            return ca.logic_not(self.translator.real(assertion.condition, events=False))
        except ModelicaError as error:
            raise ModelicaError(f"{assertion.place}: in an assertion: {error}") from error

    def _updates(self) -> None:
        memory = self.memory
        for variable in self.discretes:
            if variable.name not in self.split.inline:
                memory.updates[variable.name] = self._at(
                    variable.place, self.split.definitions[variable.name]
                )
        for variable in self.free:
            memory.updates[variable.name] = memory.before[variable.name]

    def _finish_updates(self) -> None:
        """Left limits of continuous variables come first."""
        memory = self.memory
        memory.names.sort(key=lambda name: name not in memory.left)

    def _constant_between_events(self) -> ca.SX:
        memory = self.memory
        entries = list(self.translator.modes)
        if self._eventful:
            entries += [memory.values[n] for n in memory.names]
            entries += [memory.before[n] for n in memory.names]
            entries += [tick for *_, tick in memory.samples]
            entries.append(memory.initial)
        return column(entries)

    @property
    def _eventful(self) -> bool:
        memory = self.memory
        return bool(memory.names or memory.samples or memory.uses_initial or self.flat.reinits)

    def _events(self, final, x: ca.SX, states: list[str], reinits, initial: Initial) -> Events:  # type: ignore[no-untyped-def]
        memory = self.memory
        fresh = [x.nz[i] for i in range(len(states))]
        for reinit, condition, value in reversed(reinits):
            if reinit.state not in states:
                raise ModelicaError(
                    f"{reinit.place}: reinit({reinit.state}, …): {reinit.state} is no state of the exported model; "
                    "give it stateSelect=StateSelect.always."
                )
            k = states.index(reinit.state)
            fresh[k] = ca.if_else(condition, value, fresh[k])
        starts = [initial.free.get(n, self._z_start(n)) for n in memory.names]
        samples = [final(ca.horzcat(start, interval)) for start, interval, _ in memory.samples]
        held = memory.symbols() | {v.name for v in (*self.parameters, *self.dependents)}
        for times in samples:
            varying = {str(s) for s in ca.symvar(times)} - held
            if varying:
                raise ModelicaError(
                    f"{self.flat.name}: the times of a sample() have to be parameters, but depend on {min(varying)}."
                )
        return Events(
            z=tuple(memory.names),
            left=len(memory.left),
            update=final(column([memory.updates[n] for n in memory.names])),
            z_start=final(column(starts)),
            reinit=final(column(fresh)) if reinits else ca.SX(0, 1),
            samples=ca.vertcat(*samples) if samples else ca.SX(0, 2),
            used=self._eventful,
        )

    def _z_start(self, name: str) -> ca.SX:
        if name in self.split.starts:
            return self._at(self.flat.variables[name].place, Term("noEvent", (self.split.starts[name],)))
        variable = self.flat.variables.get(name)
        if variable is None:
            return self.memory.updates[name]
        start = self.translator.real(0.0 if variable.start is None else variable.start, events=False)
        if start.is_constant() and abs(float(start)) > INFINITE:
            return ca.SX(math.copysign(INFINITE, float(start)))
        return start

    @staticmethod
    def _preference(variable: FlatVariable) -> tuple[int, ...]:
        """Sorts variables from least to most wanted as a state."""
        select = {"never": 0, "avoid": 1, "default": 2, "prefer": 3, "always": 4}[variable.state_select]
        return (
            select,
            int(variable.fixed is True),
            int(variable.fixed is not None),
            -variable.name.count("."),
        )

    def _dependent_values(self) -> ca.SX:
        """Calculated parameters in terms of those that can be set."""
        values = {
            v.name: self._at(v.place, v.binding if v.binding is not None else v.start or 0.0)
            for v in self.dependents
        }
        for _ in values:
            names = list(values)
            if not {str(s) for s in ca.symvar(column(values.values()))} & set(names):
                break
            expressions = ca.substitute(
                list(values.values()), [self.symbols[n] for n in names], list(values.values())
            )
            values = dict(zip(names, expressions, strict=True))
        dependent = column(values.values())
        cyclic = {str(s) for s in ca.symvar(dependent)} & set(values)
        if cyclic:
            raise ModelicaError(f"{self.flat.name}: the parameter {min(cyclic)} depends on itself.")
        return dependent


__all__ = ["Builder", "CausalModel", "make_causal"]
