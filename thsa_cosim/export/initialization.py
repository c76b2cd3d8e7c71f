"""Initial values: what the initial equations, the fixed start values and the guesses determine."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import casadi as ca

from thsa_cosim.export.block import Block
from thsa_cosim.export.model import column

if TYPE_CHECKING:
    from thsa_cosim.export.causal import Builder


@dataclass(frozen=True)
class Initial:
    """The solution of the initial equations."""

    x_start: ca.SX
    x: ca.SX
    settable: dict[str, float]
    blocks: tuple[Block, ...]
    y_start: ca.SX
    free: dict[str, ca.SX]
    guesses: dict[str, ca.SX]
    solution: dict[str, ca.SX]


def initial_values(builder: "Builder", states: list[str], equations: list[tuple[ca.SX, str]]) -> Initial:
    """Initial values of the states, the symbols of their start values, and the starts that may be set."""
    flat, system = builder.flat.variables, builder.system
    x_start = column(ca.SX.sym(f"start({s})") for s in states)
    required = list(equations)
    optional: list[tuple[ca.SX, str]] = []
    owner: dict[str, str] = {}
    guesses: dict[str, ca.SX] = {}
    for variable in builder.unknowns:
        name = variable.name
        settable = name in states and not builder.depends(variable.start)
        if settable:
            start = x_start[states.index(name)]
        else:
            start = builder.translator.real(0.0 if variable.start is None else variable.start, events=False)
        guesses[name] = start
        if name not in states and variable.fixed is not True:
            continue
        label = f"{name} = its start value"
        if settable:
            owner[label] = name
        (required if variable.fixed is True else optional).append((builder.symbols[name] - start, label))
    for variable in builder.free:
        guesses[variable.name] = builder.translator.real(variable.start or 0.0, events=False)
    free = {v.name: builder.memory.values[v.name] for v in builder.free}
    result = system.solve_initial(required, optional, free, guesses, builder.flat.name)
    solution, used, blocks = result
    values = {
        n: builder.evaluate(flat[owner[label]].start) or 0.0
        for label in used
        if label in owner
        for n in [owner[label]]
    }
    touched = {str(s) for b in blocks for s in ca.symvar(b.guess)}
    for index, name in enumerate(states):  # a start value that is only a guess can be set, too
        if name not in values and str(x_start.nz[index]) in touched:
            values[name] = builder.evaluate(flat[name].start) or 0.0
    return Initial(
        x_start=x_start,
        x=column([solution[name] for name in states]),
        settable=values,
        blocks=blocks,
        y_start=column([solution[n] for b in system.blocks for n in b.names]),
        free={n: solution[n] for n in free},
        guesses=guesses,
        solution=solution,
    )


def first_indicators(builder: "Builder", indicators: ca.SX, x: ca.SX, initial: Initial) -> ca.SX:
    """Event indicators at the start values, from which the search for the initial values sets out."""
    modes = {str(mode) for mode in builder.translator.modes}
    if (
        not initial.blocks
        and not builder.system.simplified
        and not {str(s) for s in ca.symvar(initial.x)} & modes
    ):
        return ca.SX(0, 1)
    unknown = [b.unknown.nz[i] for b in builder.system.blocks for i in range(b.unknown.numel())]
    guesses = [initial.guesses.get(n, ca.SX(0)) for b in builder.system.blocks for n in b.names]
    moved = ca.substitute([indicators], [x, column(unknown)], [initial.x_start, column(guesses)])[0]
    return moved


def simplified_indicators(builder: "Builder", initial: Initial) -> ca.SX:
    """Event indicators where the way from the simplified initial system ends."""
    if not builder.system.simplified:
        return ca.SX(0, 1)
    symbols = {**builder.symbols, **builder.system.symbols}
    known = [symbols[n] for n in initial.solution]
    return ca.substitute([column(builder.translator.indicators)], known, list(initial.solution.values()))[0]
