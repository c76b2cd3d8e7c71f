"""Blocks of equations: solved symbolically where they are small and linear, left to Newton's method otherwise."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from thsa_cosim.errors import ModelicaError
from thsa_cosim.export.structure import Incidence, blocks

if TYPE_CHECKING:
    from thsa_cosim.export.solve import EquationSystem

LARGEST_SYMBOLIC = 3


@dataclass(frozen=True)
class Block:
    """Equations that are solved while the model runs: ``residual(unknown) = 0``, by Newton's method from the last
    solution, or ``linear`` ones directly, which leaves no rounding noise where the solution is exactly 0.
    ``equations`` are their texts with file and line, before some of their unknowns were eliminated.
    """

    names: tuple[str, ...]
    unknown: ca.SX
    residual: ca.SX
    guess: ca.SX
    linear: bool = False
    equations: tuple[str, ...] = ()


@dataclass(frozen=True)
class Pivot:
    """What a block that is solved symbolically is divided by: it may become 0 while the model runs."""

    names: tuple[str, ...]
    equations: tuple[str, ...]
    determinant: ca.SX


class BlockSolver:
    """Solves the blocks of one system in their order."""

    def __init__(
        self,
        system: "EquationSystem",
        rows: Incidence,
        residuals: list[ca.SX],
        labels: list[str],
        model: str,
        guesses: dict[str, ca.SX] | None = None,
    ) -> None:
        self.system, self.rows, self.residuals, self.labels = system, rows, residuals, labels
        self.model, self.guesses = model, guesses
        self.solution: dict[str, ca.SX] = {}
        self.blocks: list[Block] = []
        self.pivots: list[Pivot] = []

    def solve(self, matching: dict[int, int]) -> dict[str, ca.SX]:
        """Name → expression for every matched unknown."""
        system, rows = self.system, self.rows
        for block in blocks(rows, matching):
            known = {system.names[c] for r, _ in block for c in rows[r]} & self.solution.keys()
            symbols, values = [system.symbols[n] for n in known], [self.solution[n] for n in known]
            residual = ca.vertcat(*ca.substitute([self.residuals[r] for r, _ in block], symbols, values))
            names = [system.names[c] for _, c in block]
            self._solve(residual, names, tuple(self.labels[r] for r, _ in block))
        return self.solution

    def _solve(self, residual: ca.SX, names: list[str], labels: tuple[str, ...]) -> None:
        unknown = ca.vertcat(*[self.system.symbols[n] for n in names])
        matrix = ca.jacobian(residual, unknown)
        linear = not ca.depends_on(matrix, unknown)
        if linear and self._singular(matrix):
            listed = "; ".join(labels[:4])
            given = "" if matrix.is_constant() else " with the parameters as they are"
            raise ModelicaError(
                f"{self.model}: singular{given}: {', '.join(names[:6])} cannot be solved from {listed}."
            )
        if linear and len(names) <= LARGEST_SYMBOLIC:
            self._divided(residual, unknown, matrix, names, labels)
            return
        eliminated, residual, rest = _torn(residual, names, self.system.symbols)
        if rest:
            self._reduced(residual, rest, linear, labels)
        symbols = [self.system.symbols[n] for n in rest]
        values = [self.solution[n] for n in rest]
        for name, expression in reversed(eliminated):
            self.solution[name] = ca.substitute([expression], symbols, values)[0]
            symbols.append(self.system.symbols[name])
            values.append(self.solution[name])

    def _divided(
        self, residual: ca.SX, unknown: ca.SX, matrix: ca.SX, names: list[str], labels: tuple[str, ...]
    ) -> None:
        """Solve a small linear block symbolically."""
        constant = ca.substitute([residual], [unknown], [ca.SX.zeros(len(names))])[0]
        self.solution.update(zip(names, ca.vertsplit(_linear_solve(matrix, constant)), strict=True))
        if not matrix.is_constant():
            determinant = ca.det(ca.densify(matrix)) if len(names) > 1 else matrix
            self.pivots.append(Pivot(tuple(names), labels, determinant))

    def _singular(self, matrix: ca.SX) -> bool:
        """Whether a matrix of numbers and parameters has no inverse; False where it depends on anything else."""
        symbols = ca.symvar(matrix)
        values = [v for v in (self.system.parameter(str(symbol)) for symbol in symbols) if v is not None]
        if len(values) < len(symbols):
            return False
        numbers = np.array(ca.evalf(ca.substitute(matrix, ca.vertcat(*symbols), ca.vertcat(*values))))
        return not np.isfinite(numbers).all() or bool(np.linalg.matrix_rank(numbers) < len(numbers))

    def _reduced(self, residual: ca.SX, names: list[str], linear: bool, labels: tuple[str, ...]) -> None:
        unknown = ca.vertcat(*[self.system.symbols[n] for n in names])
        if linear and len(names) <= LARGEST_SYMBOLIC:
            self._divided(residual, unknown, ca.jacobian(residual, unknown), names, labels)
            return
        word = "implicit" if self.guesses is None else "initially"
        fresh = [ca.SX.sym(f"{word}({n})") for n in names]
        residual = ca.substitute([residual], [unknown], [ca.vertcat(*fresh)])[0]
        self.solution.update(zip(names, fresh, strict=True))
        guess = [self.guesses.get(n, ca.SX(0)) if self.guesses else ca.SX(0) for n in names]
        self.blocks.append(
            Block(tuple(names), ca.vertcat(*fresh), residual, ca.vertcat(*guess), linear, labels)
        )


def _torn(
    residual: ca.SX, names: list[str], symbols: dict[str, ca.SX]
) -> tuple[list[tuple[str, ca.SX]], ca.SX, list[str]]:
    """Eliminate unknowns that an equation gives explicitly, with a constant coefficient.

    Returns the eliminated ones in order, each in terms of those that come after it and of the rest; the residual that
    is left, and the names of the rest.
    """
    rows = ca.vertsplit(residual)
    rest = list(names)
    eliminated: list[tuple[str, ca.SX]] = []
    while len(rows) > 1:
        found = _explicit(rows, rest, symbols)
        if found is None:
            break
        row, name, value = found
        rows.pop(row)
        rest.remove(name)
        rows = ca.substitute(rows, [symbols[name]], [value])
        eliminated.append((name, value))
    return eliminated, ca.vertcat(*rows), rest


def _explicit(
    rows: list[ca.SX], names: list[str], symbols: dict[str, ca.SX]
) -> tuple[int, str, ca.SX] | None:
    unknown = {str(symbols[n]): n for n in names}
    counted = []
    for index, row in enumerate(rows):
        present = [unknown[str(s)] for s in ca.symvar(row) if str(s) in unknown]
        counted.append((len(present), index, present))
    for _, index, present in sorted(counted):
        for name in present:
            slope = ca.jacobian(rows[index], symbols[name])
            if slope.is_constant() and abs(float(slope)) > 1e-12:
                rest = ca.substitute([rows[index]], [symbols[name]], [ca.SX(0)])[0]
                return index, name, -rest / float(slope)
    return None


def _linear_solve(matrix: ca.SX, constant: ca.SX) -> ca.SX:
    """x with matrix x + constant = 0."""
    if matrix.numel() == 1:
        if matrix.is_constant() and float(matrix) in (1.0, -1.0):
            return -constant if float(matrix) == 1.0 else constant
        return -constant / matrix
    return -ca.mtimes(ca.inv_minor(ca.densify(matrix)), constant)
