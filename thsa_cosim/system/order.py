"""In which order the connected outputs of a system are evaluated: direct feed-through decides, loops are found.

A connected output depends on the connected inputs that its component feeds through (ModelStructure, FMI 2.0.4 clause
2.2.8; where it is silent, on all of them), and each of these on the output that is connected to it. Strongly
connected outputs form an algebraic loop.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from thsa_cosim.system.structure import Component, System

Pin = tuple[str, str]


@dataclass(frozen=True)
class Stage:
    """Outputs that can be read once the earlier stages have been read and written."""

    sources: tuple[Pin, ...]
    is_loop: bool
    """The sources depend on each other: they are the solution of an algebraic loop."""


def stages(system: System) -> tuple[Stage, ...]:
    """Order the sources of a system's connections."""
    sources = list(dict.fromkeys(c.source for c in system.connections))
    index = {pin: k for k, pin in enumerate(sources)}
    writer = {c.target: index[c.source] for c in system.connections}
    n = len(sources)
    depends = np.zeros((n, n), dtype=bool)
    """depends[a, b]: source a needs source b."""
    for a, pin in enumerate(sources):
        for target in _feedthrough(system.component(pin[0]), pin[1], writer):
            depends[a, writer[target]] = True
    if not n:
        return ()
    from scipy.sparse import csr_array  # slow to import, and every worker imports this room
    from scipy.sparse.csgraph import connected_components

    count, labels = connected_components(csr_array(depends), directed=True, connection="strong")
    members = [[sources[k] for k in np.flatnonzero(labels == group)] for group in range(count)]
    loops = [len(found) > 1 or bool(depends[index[found[0]], index[found[0]]]) for found in members]
    between = np.zeros((count, count), dtype=bool)
    for a, b in zip(*np.nonzero(depends), strict=True):
        between[labels[a], labels[b]] |= labels[a] != labels[b]
    return _levels(members, loops, between)


def _feedthrough(component: Component, variable: str, writer: dict[Pin, int]) -> list[Pin]:
    """Connected inputs that a component's output depends on at once."""
    if component.execution != "continuous":
        return []  # its outputs stay as they are until it has stepped
    connected = [pin for pin in writer if pin[0] == component.name]
    known = component.fmu.feedthrough.get(variable)
    return connected if known is None else [pin for pin in connected if pin[1] in known]


def _levels(
    members: Sequence[Sequence[Pin]], loops: Sequence[bool], between: np.ndarray
) -> tuple[Stage, ...]:
    """Group what can be read at the same time; each loop is a stage of its own."""
    found: list[Stage] = []
    done = np.zeros(len(members), dtype=bool)
    while not done.all():
        ready = [k for k in range(len(members)) if not done[k] and not (between[k] & ~done).any()]
        plain = tuple(pin for k in ready if not loops[k] for pin in members[k])
        if plain:
            found.append(Stage(plain, False))
        found += [Stage(tuple(members[k]), True) for k in ready if loops[k]]
        done[ready] = True
    return tuple(found)
