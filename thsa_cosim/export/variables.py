"""The table of variables of an exported model; variables that are equal share a place."""

from typing import TYPE_CHECKING

import casadi as ca

from thsa_cosim.errors import ModelicaError
from thsa_cosim.export.discrete import referenced
from thsa_cosim.export.model import ModelVariable, column
from thsa_cosim.modelica.flat import FlatVariable

if TYPE_CHECKING:
    from thsa_cosim.export.causal import Builder


class VariableTable:
    """Makes the table of variables."""

    def __init__(
        self,
        builder: "Builder",
        states: list[str],
        solution: dict[str, ca.SX],
        settable: dict[str, float],
        shown: dict[str, ca.SX],
    ) -> None:
        self.builder, self.states, self.solution = builder, states, solution
        self.settable, self.shown = settable, shown

    def build(self) -> tuple[tuple[ModelVariable, ...], ca.SX, int]:
        """The variables, and the column w of algebraic ones, outputs first."""
        builder, states, solution = self.builder, self.states, self.solution
        place: dict[int, tuple[str, int]] = {}
        columns = (
            ("state", [builder.system.symbols[s] for s in states]),
            ("derivative", [solution[builder.system.derivative_name(s)] for s in states]),
            ("input", [builder.symbols[v.name] for v in builder.inputs]),
        )
        for kind, entries in columns:
            for index, expression in enumerate(entries):
                place.setdefault(expression.element_hash(), (kind, index))
        made: list[ModelVariable] = []
        for kind, group in (
            ("input", builder.inputs),
            ("parameter", builder.parameters),
            ("dependent", builder.dependents),
        ):
            made += [self._variable(v, kind, i, self._start(v, kind)) for i, v in enumerate(group)]
        algebraic: list[ca.SX] = []
        ordered = sorted(
            (*builder.unknowns, *builder.discretes, *builder.free), key=lambda v: v.causality != "output"
        )
        outputs = 0
        for variable in ordered:
            name = variable.name
            if name in states:
                made.append(self._variable(variable, "state", states.index(name), self.settable.get(name)))
                continue
            expression = self._expression(name)
            found = place.get(expression.element_hash()) if variable.causality != "output" else None
            if found is None:
                found = ("algebraic", len(algebraic))
                algebraic.append(expression)
                if variable.causality == "output":
                    outputs += 1
                elif not expression.is_constant():
                    place.setdefault(expression.element_hash(), found)
            made.append(self._variable(variable, found[0], found[1], None))
        made += [self._derivative(index, state) for index, state in enumerate(states)]
        return tuple(made), column(algebraic), outputs

    def _expression(self, name: str) -> ca.SX:
        if name in self.solution:
            return self.solution[name]
        return self.shown[name] if name in self.shown else self.builder.symbols[name]

    def _derivative(self, index: int, state: str) -> ModelVariable:
        return ModelVariable(
            f"der({state})", "derivative", index, "local", _rate(self.builder.flat.variables[state].unit),
            f"Time derivative of {state}", None, None, None, None,
        )  # fmt: skip

    def _start(self, variable: FlatVariable, kind: str) -> float | None:
        if kind == "dependent":
            return None
        given = variable.start if variable.binding is None else variable.binding
        try:
            return self.builder.evaluate(given) or 0.0
        except ModelicaError:
            known = self.builder.flat.variables
            varying = [n for n in sorted(referenced([given])) if n in known and not _is_fixed(known[n])]
            if not varying:
                raise
        raise ModelicaError(
            f"{self.builder.flat.name}: the {kind} {variable.name} starts at {varying[0]}, which is no parameter or"
            " constant."
        )

    def _variable(self, variable: FlatVariable, kind: str, index: int, start: float | None) -> ModelVariable:
        evaluate = self.builder.evaluate
        return ModelVariable(
            name=variable.name,
            kind=kind,
            index=index,
            causality=variable.causality,
            unit=variable.unit,
            description=variable.description,
            start=start,
            minimum=evaluate(variable.minimum),
            maximum=evaluate(variable.maximum),
            nominal=evaluate(variable.nominal),
            discrete=variable.variability == "discrete",
        )


def _is_fixed(variable: FlatVariable) -> bool:
    return variable.variability in ("parameter", "constant")


def _rate(unit: str | None) -> str | None:
    if unit is None:
        return None
    if unit in ("1", ""):
        return "1/s"
    if "/" not in unit:
        return "K/s" if unit == "degC" else f"{unit}/s"  # a change of temperature has no zero point
    top, bottom = unit.split("/", 1)
    return f"{top}/({bottom.strip('()')}.s)"
