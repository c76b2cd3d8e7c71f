"""The equation system of one model: state selection, block order and symbolic solution."""

import casadi as ca
import numpy as np

from thsa_cosim.errors import ModelicaError
from thsa_cosim.export.structure import Incidence, blocks, match, reduce_index


class EquationSystem:
    """Variables (by name) and residual equations; grows while constraints are differentiated."""

    def __init__(self, time: ca.SX, inputs: frozenset[str]) -> None:
        self.time = time
        self.inputs = inputs
        self.names: list[str] = []
        self.symbols: dict[str, ca.SX] = {}
        self.residuals: list[ca.SX] = []
        self.labels: list[str] = []
        self._columns: dict[str, int] = {}
        self._preference: dict[str, tuple[int, ...]] = {}
        self._derivatives: dict[str, str] = {}

    def add_variable(self, name: str, symbol: ca.SX, preference: tuple[int, ...] = (-1,)) -> int:
        """Add an unknown; the higher ``preference`` sorts, the rather it becomes a state."""
        self._columns[name] = len(self.names)
        self.names.append(name)
        self.symbols[name] = symbol
        self._preference[name] = preference
        return self._columns[name]

    def add_equation(self, residual: ca.SX, label: str) -> int:
        """Add a residual that is zero; ``label`` is its text for messages."""
        self.residuals.append(residual)
        self.labels.append(label)
        return len(self.residuals) - 1

    def derivative_name(self, name: str) -> str:
        """Name of the time derivative of an unknown."""
        return self._derivatives[name]

    def derivative(self, name: str) -> ca.SX:
        """Symbol of the time derivative of an unknown, made at the first call."""
        if name not in self._columns:
            raise ModelicaError(f"der({name}) is the derivative of an input, a parameter or an unknown name.")
        if name not in self._derivatives:
            derived = f"der({name})"
            self._derivatives[name] = derived
            self.add_variable(derived, ca.SX.sym(derived))
        return self.symbols[self._derivatives[name]]

    def prepare(self, model: str) -> list[str]:
        """Differentiate constraints where needed and choose the states; returns their names in order."""
        incidence = [self._incidence(residual) for residual in self.residuals]
        self._check_regular(incidence, model)
        derivative_of = {self._columns[n]: self._columns[d] for n, d in self._derivatives.items()}

        def differentiate_equation(row: int) -> set[int]:
            residual = self._differentiate(row, model)
            self.add_equation(residual, f"der({self.labels[row]})")
            return self._incidence(residual)

        def differentiate_variable(column: int) -> int:
            self.derivative(self.names[column])
            return self._columns[self._derivatives[self.names[column]]]

        limit = 4 * len(incidence) + 16
        if not reduce_index(incidence, derivative_of, differentiate_equation, differentiate_variable, limit):
            raise ModelicaError(
                f"{model}: the system is structurally singular; constraints cannot be differentiated to an end."
            )
        self._rows = incidence
        candidates = sorted(self._derivatives, key=lambda n: self._preference[n])
        mandatory = [column for column in range(len(self.names)) if column not in derivative_of]
        order = mandatory + [self._columns[n] for n in candidates]
        self._matching = match(incidence, order)
        for column in mandatory:
            if column not in self._matching:
                raise ModelicaError(
                    f"{model}: no equation determines {self.names[column]}; the system is structurally singular."
                )
        chosen = {n for n in candidates if self._columns[n] not in self._matching}
        for name in chosen & set(self._derivatives.values()):
            raise ModelicaError(
                f"{model}: {name} would have to be a state; name it with a variable of its own."
            )
        return [name for name in self.names if name in chosen]

    def solve(self, states: list[str], model: str) -> dict[str, ca.SX]:
        """Every unknown that is no state, in terms of states, inputs, parameters, modes and time."""
        return self._solve_blocks(self._rows, self.residuals, self.labels, self._matching, model)

    def solve_initial(
        self, required: list[tuple[ca.SX, str]], optional: list[tuple[ca.SX, str]], model: str
    ) -> tuple[dict[str, ca.SX], list[str]]:
        """Solve for all unknowns with the initial equations; returns the solution and the labels that were used."""
        residuals = [*self.residuals, *[r for r, _ in required]]
        labels = [*self.labels, *[t for _, t in required]]
        rows = [self._incidence(residual) for residual in residuals]
        columns = list(range(len(self.names)))
        matching = self._match_rows(rows)
        unmatched = set(range(len(rows))) - set(matching.values())
        if unmatched:
            label = labels[max(unmatched)]
            raise ModelicaError(
                f"{model}: the initialization is over-determined; drop fixed=true or the equation {label}."
            )
        for residual, label in optional:
            if len(rows) == len(columns):
                break
            trial = [*rows, self._incidence(residual)]
            extended = self._match_rows(trial)
            if len(extended) == len(trial):
                rows, matching = trial, extended
                residuals.append(residual)
                labels.append(label)
        missing = [self.names[column] for column in columns if column not in matching]
        if missing:
            raise ModelicaError(
                f"{model}: nothing determines the initial value of {missing[0]}; give it a start value with fixed=true."
            )
        used = labels[len(self.labels) :]
        return self._solve_blocks(rows, residuals, labels, matching, model), used

    def _match_rows(self, rows: Incidence) -> dict[int, int]:
        return match(rows, range(len(self.names)))

    def _incidence(self, residual: ca.SX) -> set[int]:
        return {self._columns[str(s)] for s in ca.symvar(residual) if str(s) in self._columns}

    def _differentiate(self, row: int, model: str) -> ca.SX:
        residual = self.residuals[row]
        result = ca.jacobian(residual, self.time)
        for symbol in ca.symvar(residual):
            name = str(symbol)
            if name in self._columns:
                result += ca.jacobian(residual, symbol) * self.derivative(name)
            elif name in self.inputs:
                raise ModelicaError(
                    f"{model}: the equation {self.labels[row]} constrains states with the input {name}, whose "
                    "derivative would be needed (higher index); put a stiffness or a filter between them."
                )
        return result

    def _check_regular(self, incidence: Incidence, model: str) -> None:
        """Every equation needs a variable of its own, a variable and its derivative counting as one."""
        base = {self._columns[d]: self._columns[n] for n, d in self._derivatives.items()}
        merged = [{base.get(column, column) for column in row} for row in incidence]
        columns = sorted(
            {column for row in merged for column in row} | set(range(len(self.names))) - set(base)
        )
        matching = match(merged, columns)
        free = [column for column in columns if column not in matching]
        spare = sorted(set(range(len(merged))) - set(matching.values()))
        if free and spare:
            raise ModelicaError(
                f"{model}: structurally singular: nothing determines {self.names[free[0]]}, and the equation "
                f"{self.labels[spare[0]]} is one too many."
            )
        if free:
            raise ModelicaError(f"{model}: too few equations: nothing determines {self.names[free[0]]}.")
        if spare:
            raise ModelicaError(f"{model}: too many equations: {self.labels[spare[0]]} is one too many.")

    def _solve_blocks(
        self, rows: Incidence, residuals: list[ca.SX], labels: list[str], matching: dict[int, int], model: str
    ) -> dict[str, ca.SX]:
        solution: dict[str, ca.SX] = {}
        for block in blocks(rows, matching):
            known = {self.names[c] for r, _ in block for c in rows[r]} & solution.keys()
            symbols, values = [self.symbols[n] for n in known], [solution[n] for n in known]
            residual = ca.vertcat(*ca.substitute([residuals[r] for r, _ in block], symbols, values))
            names = [self.names[c] for _, c in block]
            unknown = ca.vertcat(*[self.symbols[n] for n in names])
            matrix = ca.jacobian(residual, unknown)
            if ca.depends_on(matrix, unknown):
                listed = "; ".join(labels[r] for r, _ in block[:4])
                what = "equation is not linear in" if len(block) == 1 else "algebraic loop is not linear in"
                raise ModelicaError(f"{model}: the {what} {', '.join(names[:6])}: {listed}.")
            if matrix.is_constant() and np.linalg.matrix_rank(np.array(ca.DM(matrix))) < len(block):
                listed = "; ".join(labels[r] for r, _ in block[:4])
                raise ModelicaError(
                    f"{model}: singular: {', '.join(names[:6])} cannot be solved from {listed}."
                )
            constant = ca.substitute([residual], [unknown], [ca.SX.zeros(len(block))])[0]
            solution.update(zip(names, ca.vertsplit(_linear_solve(matrix, constant)), strict=True))
        return solution


def _linear_solve(matrix: ca.SX, constant: ca.SX) -> ca.SX:
    """x with matrix x + constant = 0."""
    if matrix.numel() == 1:
        if matrix.is_constant() and float(matrix) in (1.0, -1.0):
            return -constant if float(matrix) == 1.0 else constant
        return -constant / matrix
    if matrix.shape[0] <= 3:
        return -ca.mtimes(ca.inv_minor(ca.densify(matrix)), constant)
    return -ca.solve(matrix, constant)
