"""Structural analysis of equation systems: matching, index reduction, block order.

Sources: C. Pantelides, "The consistent initialization of differential-algebraic systems", SIAM J. Sci. Stat.
Comput. 9 (1988); R. Tarjan's strongly connected components (through ``scipy.sparse.csgraph``); the choice of states
by priority is the greedy algorithm on the transversal matroid of the incidence.
"""

from collections.abc import Callable, Sequence
from graphlib import TopologicalSorter

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

Incidence = list[set[int]]


def match(incidence: Incidence, columns: Sequence[int]) -> dict[int, int]:
    """Match columns (variables) to rows (equations); earlier columns take precedence.

    Returns column → row. A column that is left out cannot be matched without unmatching an earlier one.
    """
    rows_of: dict[int, list[int]] = {column: [] for column in columns}
    for row, present in enumerate(incidence):
        for column in present:
            if column in rows_of:
                rows_of[column].append(row)
    column_of: dict[int, int] = {}

    def augment(column: int, visited: set[int]) -> bool:
        for row in rows_of[column]:
            if row not in visited:
                visited.add(row)
                if row not in column_of or augment(column_of[row], visited):
                    column_of[row] = column
                    return True
        return False

    for column in columns:
        augment(column, set())
    return {column: row for row, column in column_of.items()}


def blocks(incidence: Incidence, matching: dict[int, int]) -> list[list[tuple[int, int]]]:
    """Block lower triangular order: lists of (row, column) to be solved one after the other."""
    row_of = matching
    position = {row: index for index, row in enumerate(row_of.values())}
    rows = list(row_of.values())
    edges = [
        (position[row], position[row_of[column]])
        for row in rows
        for column in incidence[row]
        if column in row_of and row_of[column] != row
    ]
    size = len(rows)
    sources, targets = (np.array(edges, dtype=int).reshape(-1, 2)).T
    graph = coo_matrix((np.ones(len(edges)), (sources, targets)), shape=(size, size))
    count, label = connected_components(graph, directed=True, connection="strong")
    needs: dict[int, set[int]] = {int(component): set() for component in range(count)}
    for source, target in edges:
        if label[source] != label[target]:
            needs[int(label[source])].add(int(label[target]))
    column_of = {row: column for column, row in row_of.items()}
    members: dict[int, list[tuple[int, int]]] = {component: [] for component in needs}
    for row in rows:
        members[int(label[position[row]])].append((row, column_of[row]))
    return [members[component] for component in TopologicalSorter(needs).static_order()]


def reduce_index(
    incidence: Incidence,
    derivative_of: dict[int, int],
    differentiate_equation: Callable[[int], set[int]],
    differentiate_variable: Callable[[int], int],
    limit: int,
) -> dict[int, int] | None:
    """Pantelides' algorithm: differentiate the equations that constrain states.

    ``incidence`` and ``derivative_of`` (variable → its derivative) grow in place.
    ``differentiate_equation(row)`` appends the derivative of an equation and returns its incidence;
    ``differentiate_variable(column)`` appends the derivative of a variable and returns its column.
    Returns row → row of its derivative, or None when more than ``limit`` equations had to be differentiated (the system
    is singular).
    """
    derived_row: dict[int, int] = {}
    row_of: dict[int, int] = {}
    for start in range(len(incidence)):
        row = start
        while True:
            seen_rows: set[int] = set()
            seen_columns: set[int] = set()
            if _augment(row, incidence, derivative_of, row_of, seen_rows, seen_columns):
                break
            for column in sorted(seen_columns):
                if column not in derivative_of:
                    derivative_of[column] = differentiate_variable(column)
            for seen in sorted(seen_rows):
                derived_row[seen] = len(incidence)
                incidence.append(differentiate_equation(seen))
                if len(derived_row) > limit:
                    return None
            for column in seen_columns:
                if column in row_of:
                    row_of[derivative_of[column]] = derived_row[row_of[column]]
            row = derived_row[row]
    return derived_row


def _augment(
    row: int,
    incidence: Incidence,
    derivative_of: dict[int, int],
    row_of: dict[int, int],
    seen_rows: set[int],
    seen_columns: set[int],
) -> bool:
    seen_rows.add(row)
    highest = [column for column in sorted(incidence[row]) if column not in derivative_of]
    for column in highest:
        if column not in row_of:
            row_of[column] = row
            return True
    for column in highest:
        if column not in seen_columns:
            seen_columns.add(column)
            if _augment(row_of[column], incidence, derivative_of, row_of, seen_rows, seen_columns):
                row_of[column] = row
                return True
    return False
