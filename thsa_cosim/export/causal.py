"""Flat model → explicit ordinary differential equation with outputs, events and initial values (CasADi SX)."""

from collections.abc import Iterable
from dataclasses import dataclass

import casadi as ca

from thsa_cosim.errors import ModelicaError
from thsa_cosim.export.expression import Translator, equation_text
from thsa_cosim.export.flatten import Expression, FlatModel, FlatVariable
from thsa_cosim.export.solve import EquationSystem


@dataclass(frozen=True)
class ModelVariable:
    """One variable of the exported model.

    ``kind`` is "state", "derivative", "input", "parameter", "dependent" or "algebraic"; ``index`` counts within the
    kind. Aliases share kind and index. ``start`` is given where it may be set before initialization.
    """

    name: str
    kind: str
    index: int
    causality: str
    unit: str | None
    description: str
    start: float | None
    minimum: float | None
    maximum: float | None
    nominal: float | None


@dataclass(frozen=True)
class CausalModel:
    """dx/dt = f(t, x, u, p, d, m), w = h(...), g = event indicators, x(0) = initial(...).

    p are the parameters that can be set, d = dependent(p) the calculated ones, m the modes (relation k holds when
    g[k] > 0). All expressions are CasADi SX columns over the symbols of this object.
    """

    flat: FlatModel
    states: tuple[str, ...]
    variables: tuple[ModelVariable, ...]
    time: ca.SX
    x: ca.SX
    u: ca.SX
    p: ca.SX
    d: ca.SX
    m: ca.SX
    x_start: ca.SX
    rhs: ca.SX
    w: ca.SX
    outputs: int
    g: ca.SX
    dependent: ca.SX
    initial: ca.SX


def make_causal(flat: FlatModel) -> CausalModel:
    """Order and solve the equations of a flat model.

    Raises ModelicaError, naming the equation and the variable, for a singular system, an algebraic loop that is not
    linear, a constraint that needs the derivative of an input, and an over-determined initialization.
    """
    return _Builder(flat).build()


class _Builder:
    """Holds what the steps of one translation share."""

    def __init__(self, flat: FlatModel) -> None:
        self.flat = flat
        self.values: dict[str, float] = {}
        self.time = ca.SX.sym("time")
        self.parameters: list[FlatVariable] = []
        self.dependents: list[FlatVariable] = []
        self.inputs: list[FlatVariable] = []
        self.unknowns: list[FlatVariable] = []
        self.booleans: dict[str, Expression] = {}
        symbols: dict[str, ca.SX] = {"time": self.time}
        for variable in flat.variables.values():
            self._sort(variable, symbols)
        self.symbols = symbols
        discrete = frozenset(v.name for v in (*self.parameters, *self.dependents))
        self.translator = Translator(symbols, self._derivative, discrete, self.booleans)
        self.system = EquationSystem(self.time, frozenset(v.name for v in self.inputs))

    def _sort(self, variable: FlatVariable, symbols: dict[str, ca.SX]) -> None:
        name = variable.name
        if variable.variability == "constant" or (
            variable.variability == "parameter" and variable.type != "Real"
        ):
            symbols[name] = ca.SX(self._value(name))
        elif variable.variability == "parameter":
            symbols[name] = ca.SX.sym(name)
            (
                self.dependents if variable.final or self._depends(variable.binding) else self.parameters
            ).append(variable)
        elif variable.type == "Boolean":
            if variable.causality != "local":
                raise ModelicaError(
                    f"{self.flat.name}: {name} is a Boolean {variable.causality}; the exporter supports Real ones."
                )
            if variable.binding is not None:
                self.booleans[name] = variable.binding
        elif variable.type != "Real":
            raise ModelicaError(
                f"{self.flat.name}: {name} is an Integer that varies in time, which the exporter does not support."
            )
        elif variable.causality == "input":
            symbols[name] = ca.SX.sym(name)
            self.inputs.append(variable)
        else:
            symbols[name] = ca.SX.sym(name)
            self.unknowns.append(variable)

    def _depends(self, expression: Expression | None) -> bool:
        """Whether a binding refers to a parameter that can be set."""
        if expression is None:
            return False
        if "VarRef" in expression:
            referred = self.flat.variables.get(str(expression["VarRef"]["name"]["name"]))
            return referred is None or (referred.variability == "parameter" and referred.type == "Real")
        return any(self._depends(part) for part in _children(expression))

    def _value(self, name: str, pending: tuple[str, ...] = ()) -> float:
        """Default value of a parameter or constant."""
        if name not in self.values:
            variable = self.flat.variables.get(name)
            if variable is None or variable.variability == "continuous" or name in pending:
                raise ModelicaError(
                    f"{self.flat.name}: the value of {(*pending, name)[0]} depends on {name}, which has no fixed value."
                )
            self.values[name] = self._evaluate(variable.binding or variable.start, (*pending, name)) or 0.0
        return self.values[name]

    def _evaluate(self, expression: Expression | None, pending: tuple[str, ...] = ()) -> float | None:
        """Numeric value of an attribute at the default parameters, None when there is none."""
        if expression is None:
            return None

        class Defaults(dict[str, ca.SX]):
            def __missing__(_, key: str) -> ca.SX:
                return ca.SX(self._value(key, pending))

            def __contains__(_, key: object) -> bool:
                return True

        translator = Translator(Defaults(), self._derivative, frozenset(), {})
        literal = expression.get("Literal", {}).get("value", {})
        if "Boolean" in literal:
            return float(literal["Boolean"])
        try:
            return float(translator.real(expression))
        except ModelicaError:
            return float(translator.condition(expression))

    def _derivative(self, name: str) -> ca.SX:
        return self.system.derivative(name)

    def build(self) -> CausalModel:
        system, translate = self.system, self.translator
        for variable in self.unknowns:
            system.add_variable(variable.name, self.symbols[variable.name], self._preference(variable))
        remaining = [e for e in self.flat.equations if not self._defines_boolean(e.residual)]
        for equation in remaining:
            system.add_equation(self._translated(equation.residual), equation_text(equation.residual))
        for variable in self.unknowns:
            if variable.binding is not None:
                bound = self.symbols[variable.name] - translate.real(variable.binding)
                system.add_equation(bound, f"{variable.name} = (its declaration)")
        dependent = self._dependent_values()
        initial_equations = [
            (self._translated(e.residual), equation_text(e.residual)) for e in self.flat.initial_equations
        ]
        states = system.prepare(self.flat.name)
        solution = system.solve(states, self.flat.name)
        x = column([system.symbols[s] for s in states])
        rhs = column([solution[system.derivative_name(s)] for s in states])
        x_start, initial, settable = self._initial(states, initial_equations)
        variables, algebraic, outputs = self._variables(states, solution, settable)
        replace = list(solution)
        indicators = ca.substitute(
            [column(translate.indicators)],
            [system.symbols[n] for n in replace],
            [solution[n] for n in replace],
        )[0]
        return CausalModel(
            flat=self.flat,
            states=tuple(states),
            variables=variables,
            time=self.time,
            x=x,
            u=column([self.symbols[v.name] for v in self.inputs]),
            p=column([self.symbols[v.name] for v in self.parameters]),
            d=column([self.symbols[v.name] for v in self.dependents]),
            m=column(translate.modes),
            x_start=x_start,
            rhs=rhs,
            w=algebraic,
            outputs=outputs,
            g=indicators,
            dependent=dependent,
            initial=initial,
        )

    def _translated(self, residual: Expression) -> ca.SX:
        try:
            return self.translator.real(residual)
        except ModelicaError as error:
            raise ModelicaError(
                f"{self.flat.name}: in the equation {equation_text(residual)}: {error}"
            ) from error

    def _defines_boolean(self, residual: Expression) -> bool:
        """Take ``b = condition`` out of the equations; b is inlined where it is used."""
        body = residual.get("Binary", {})
        target = body.get("lhs", {}).get("VarRef")
        if body.get("op") != "Sub" or target is None:
            return False
        name = str(target["name"]["name"])
        variable = self.flat.variables.get(name)
        if variable is None or variable.type != "Boolean" or variable.variability != "continuous":
            return False
        self.booleans[name] = body["rhs"]
        return True

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
            v.name: self.translator.real(v.binding or v.start or {"Literal": {"value": {"Real": 0.0}}})
            for v in self.dependents
        }
        for _ in values:
            names = list(values)
            expressions = ca.substitute(
                list(values.values()), [self.symbols[n] for n in names], list(values.values())
            )
            values = dict(zip(names, expressions, strict=True))
        dependent = column(values.values())
        cyclic = {str(s) for s in ca.symvar(dependent)} & set(values)
        if cyclic:
            raise ModelicaError(f"{self.flat.name}: the parameter {min(cyclic)} depends on itself.")
        return dependent

    def _initial(
        self, states: list[str], equations: list[tuple[ca.SX, str]]
    ) -> tuple[ca.SX, ca.SX, dict[str, float]]:
        """Initial values of the states, the symbols of their start values, and the starts that may be set."""
        flat = self.flat.variables
        x_start = ca.SX.sym("x_start", len(states))
        required = list(equations)
        optional: list[tuple[ca.SX, str]] = []
        owner: dict[str, str] = {}
        for variable in self.unknowns:
            if variable.name not in states and variable.fixed is not True:
                continue
            settable = variable.name in states and not self._depends(variable.start)
            if settable:
                start = x_start[states.index(variable.name)]
            elif variable.start is not None:
                start = self.translator.real(variable.start)
            else:
                start = ca.SX(0)
            label = f"{variable.name} = its start value"
            if settable:
                owner[label] = variable.name
            (required if variable.fixed is True else optional).append(
                (self.symbols[variable.name] - start, label)
            )
        solution, used = self.system.solve_initial(required, optional, self.flat.name)
        initial = column([solution[name] for name in states])
        settable_starts = {
            owner[label]: self._evaluate(flat[owner[label]].start) or 0.0 for label in used if label in owner
        }
        return x_start, initial, settable_starts

    def _variables(
        self, states: list[str], solution: dict[str, ca.SX], settable: dict[str, float]
    ) -> tuple[tuple[ModelVariable, ...], ca.SX, int]:
        """The table of variables, and the column w of algebraic ones, outputs first."""
        place: dict[int, tuple[str, int]] = {}
        columns = (
            ("state", [self.system.symbols[s] for s in states]),
            ("derivative", [solution[self.system.derivative_name(s)] for s in states]),
            ("input", [self.symbols[v.name] for v in self.inputs]),
        )
        for kind, entries in columns:
            for index, expression in enumerate(entries):
                place.setdefault(expression.element_hash(), (kind, index))
        made: list[ModelVariable] = []
        for kind, group in (
            ("input", self.inputs),
            ("parameter", self.parameters),
            ("dependent", self.dependents),
        ):
            made += [self._variable(v, kind, i, self._start(v, kind)) for i, v in enumerate(group)]
        algebraic: list[ca.SX] = []
        ordered = sorted(self.unknowns, key=lambda v: v.causality != "output")
        outputs = 0
        for variable in ordered:
            name = variable.name
            if name in states:
                made.append(self._variable(variable, "state", states.index(name), settable.get(name)))
                continue
            expression = solution[name]
            found = place.get(expression.element_hash()) if variable.causality != "output" else None
            if found is None:
                found = ("algebraic", len(algebraic))
                algebraic.append(expression)
                if variable.causality == "output":
                    outputs += 1
                elif not expression.is_constant():
                    place.setdefault(expression.element_hash(), found)
            made.append(self._variable(variable, found[0], found[1], None))
        for index, state in enumerate(states):
            unit = self.flat.variables[state].unit
            made.append(
                ModelVariable(
                    f"der({state})",
                    "derivative",
                    index,
                    "local",
                    _rate(unit),
                    f"Time derivative of {state}",
                    None,
                    None,
                    None,
                    None,
                )
            )
        return tuple(made), column(algebraic), outputs

    def _start(self, variable: FlatVariable, kind: str) -> float | None:
        if kind == "dependent":
            return None
        return self._evaluate(variable.binding or variable.start) or 0.0

    def _variable(self, variable: FlatVariable, kind: str, index: int, start: float | None) -> ModelVariable:
        return ModelVariable(
            name=variable.name,
            kind=kind,
            index=index,
            causality=variable.causality,
            unit=variable.unit,
            description=variable.description,
            start=start,
            minimum=self._evaluate(variable.minimum),
            maximum=self._evaluate(variable.maximum),
            nominal=self._evaluate(variable.nominal),
        )


def column(entries: Iterable[ca.SX]) -> ca.SX:
    """A column of scalars that stays an SX when it is empty."""
    listed = list(entries)
    return ca.vertcat(*listed) if listed else ca.SX(0, 1)


def _children(expression: Expression) -> list[Expression]:
    body = next(iter(expression.values()))
    if not isinstance(body, dict):
        return []
    parts = [body[key] for key in ("lhs", "rhs", "else_branch") if body.get(key)]
    parts += body.get("args", [])
    parts += [part for branch in body.get("branches", []) for part in branch]
    return parts


def _rate(unit: str | None) -> str | None:
    if unit is None:
        return None
    if unit in ("1", ""):
        return "1/s"
    if "/" not in unit:
        return f"{unit}/s"
    top, bottom = unit.split("/", 1)
    return f"{top}/({bottom.strip('()')}.s)"
