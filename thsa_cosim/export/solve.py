"""The equation system of one model: state selection, block order and symbolic solution."""

import math
from collections.abc import Callable

import casadi as ca

from thsa_cosim.errors import ModelicaError
from thsa_cosim.export.block import Block, BlockSolver, Pivot
from thsa_cosim.export.structure import Incidence, blocks, match, reduce_index

STABILIZATION = 10.0  # 1/s
HOMOTOPY = "homotopy()"  # name of the symbol that goes from 1 (simplified) to 0 (actual)


class EquationSystem:
    """Variables (by name) and residual equations; grows while constraints are differentiated."""

    def __init__(
        self, time: ca.SX, inputs: frozenset[str], parameter: Callable[[str], float | None] | None = None
    ) -> None:
        self.time = time
        self.inputs = inputs
        self.parameter = parameter or (
            lambda name: None
        )  # value of a parameter by name; None for what is none
        self.names: list[str] = []
        self.symbols: dict[str, ca.SX] = {}
        self.residuals: list[ca.SX] = []
        self.labels: list[str] = []
        self._columns: dict[str, int] = {}
        self._preference: dict[str, tuple[int, ...]] = {}
        self._derivatives: dict[str, str] = {}
        self.blocks: tuple[Block, ...] = ()
        self.pivots: tuple[Pivot, ...] = ()
        self.simplified: dict[int, ca.SX] = {}  # residuals with homotopy, by equation; their path is HOMOTOPY
        self._full: tuple[list[ca.SX], list[str]] = ([], [])

    def add_variable(self, name: str, symbol: ca.SX, preference: tuple[int, ...] = (-1,)) -> int:
        """Add an unknown; the higher ``preference`` sorts, the rather it becomes a state."""
        self._columns[name] = len(self.names)
        self.names.append(name)
        self.symbols[name] = symbol
        self._preference[name] = preference
        return self._columns[name]

    def add_equation(self, residual: ca.SX, label: str, place: str = "") -> int:
        """Add a residual that is zero; ``label`` is its text for messages, ``place`` its file and line."""
        self.residuals.append(residual)
        self.labels.append(f"{label} ({place})" if place else label)
        return len(self.residuals) - 1

    @property
    def has_derivatives(self) -> bool:
        """Whether any unknown is differentiated."""
        return bool(self._derivatives)

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
        incidence = [self.incidence(residual) for residual in self.residuals]
        self._check_regular(incidence, model)
        derivative_of = {self._columns[n]: self._columns[d] for n, d in self._derivatives.items()}

        def differentiate_equation(row: int) -> set[int]:
            residual = self._differentiate(row, model)
            self.add_equation(residual, f"der({self.labels[row]})")
            return self.incidence(residual)

        def differentiate_variable(column: int) -> int:
            self.derivative(self.names[column])
            return self._columns[self._derivatives[self.names[column]]]

        limit = 4 * len(incidence) + 16
        derived = reduce_index(
            incidence, derivative_of, differentiate_equation, differentiate_variable, limit
        )
        if derived is None:
            raise ModelicaError(
                f"{model}: the system is structurally singular; constraints cannot be differentiated to an end."
            )
        self._full = (list(self.residuals), list(self.labels))
        chosen = self._choose(incidence, derivative_of, model)
        moving = self._moving(derived)
        if moving:
            self._stabilize(moving, derived)
            incidence = [self.incidence(residual) for residual in self.residuals]
            chosen = self._choose(incidence, derivative_of, model)
        return [name for name in self.names if name in chosen]

    def _choose(self, incidence: Incidence, derivative_of: dict[int, int], model: str) -> set[str]:
        """Match unknowns and equations; what is left of the candidates are the states."""
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
        return chosen

    def _moving(self, derived: dict[int, int]) -> list[int]:
        """Constraints between states that no choice of states solves everywhere: their slopes are not constant."""
        first = set(derived) - set(derived.values())
        found = []
        for block in blocks(self._rows, self._matching):
            rows = [row for row, _ in block if row in first]
            if not rows:
                continue
            unknown = ca.vertcat(*[self.symbols[self.names[column]] for _, column in block])
            matrix = ca.jacobian(ca.vertcat(*[self.residuals[row] for row, _ in block]), unknown)
            if {str(s) for s in ca.symvar(matrix)} & self._columns.keys():
                found += rows
        return found

    def _stabilize(self, moving: list[int], derived: dict[int, int]) -> None:
        """Keep all states of these constraints; (d/dt + rate)^n c = 0 lets them drift no further (J. Baumgarte, Comput.
        Methods Appl. Mech. Eng. 1 (1972) 1)."""
        drop = set()
        for row in moving:
            chain = [row]
            while chain[-1] in derived:
                chain.append(derived[chain[-1]])
            order = len(chain) - 1
            self.residuals[chain[-1]] = sum(
                (
                    math.comb(order, k) * STABILIZATION ** (order - k) * self.residuals[member]
                    for k, member in enumerate(chain)
                ),
                ca.SX(0),
            )
            drop |= set(chain[:-1])
        kept = [row for row in range(len(self.residuals)) if row not in drop]
        self.residuals = [self.residuals[row] for row in kept]
        self.labels = [self.labels[row] for row in kept]

    def solve(self, model: str) -> dict[str, ca.SX]:
        """Every unknown that is no state, in terms of states, inputs, parameters, modes, time and ``blocks``."""
        solver = BlockSolver(self, self._rows, self.residuals, self.labels, model)
        solution = solver.solve(self._matching)
        self.blocks, self.pivots = tuple(solver.blocks), tuple(solver.pivots)
        return solution

    def solve_initial(
        self,
        required: list[tuple[ca.SX, str]],
        optional: list[tuple[ca.SX, str]],
        free: dict[str, ca.SX],
        guesses: dict[str, ca.SX],
        model: str,
    ) -> tuple[dict[str, ca.SX], list[str], tuple[Block, ...]]:
        """Solve for all unknowns, and the ``free`` parameters, with the initial equations.

        Returns the solution, the labels of the equations that were used, and the implicit blocks, whose unknowns are
        symbols of their own.
        """
        names, symbols = list(self.names), dict(self.symbols)
        for name, symbol in free.items():
            self._columns[name] = self._columns[str(symbol)] = len(self.names)
            self.names.append(name)
            self.symbols[name] = symbol
        try:
            return self._solve_initial(required, optional, guesses, model)
        finally:
            for name, symbol in free.items():
                del self._columns[name], self._columns[str(symbol)]
            self.names, self.symbols = names, symbols

    def _solve_initial(
        self,
        required: list[tuple[ca.SX, str]],
        optional: list[tuple[ca.SX, str]],
        guesses: dict[str, ca.SX],
        model: str,
    ) -> tuple[dict[str, ca.SX], list[str], tuple[Block, ...]]:
        full, full_labels = self._full
        residuals = [*full, *[r for r, _ in required]]
        labels = [*full_labels, *[t for _, t in required]]
        rows = [self.incidence(residual) for residual in residuals]
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
            trial = [*rows, self.incidence(residual)]
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
        used = labels[len(full_labels) :]
        for row, residual in self.simplified.items():
            residuals[row] = residual
            rows[row] = rows[row] | self.incidence(residual)
        solver = BlockSolver(self, rows, residuals, labels, model, guesses)
        solution = solver.solve(matching)
        if self.simplified:
            path = [s for r in self.simplified.values() for s in ca.symvar(r) if str(s) == HOMOTOPY][:1]
            final = ca.substitute(list(solution.values()), path, [ca.SX(0)] * len(path))
            solution = dict(zip(solution, final, strict=True))
        return solution, used, tuple(solver.blocks)

    def _match_rows(self, rows: Incidence) -> dict[int, int]:
        return match(rows, range(len(self.names)))

    def incidence(self, residual: ca.SX) -> set[int]:
        """Columns of the unknowns that a residual depends on."""
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
