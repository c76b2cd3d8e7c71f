"""Whether the equations of a loop can have several solutions at once, as those of an amplifier with positive feedback.

Newton's method follows one solution and cannot know which other one comes next where it ends. A loop that is linear
between relations without events (saturation, say) has one solution for all right sides only if the determinants of all
its pieces have one sign (S. Scholtes, Introduction to Piecewise Differentiable Equations, Springer 2012, 2.3).
"""

import itertools
from collections.abc import Callable

import casadi as ca
import numpy as np

from thsa_cosim.export.block import Block
from thsa_cosim.export.graph import Graph

_RELATIONS = frozenset((ca.OP_LT, ca.OP_LE))
_MOST_RELATIONS = 8
_HELD = ("mode(", "now(", "pre(", "tick(", "initial(")


def several_solutions(block: Block, parameter: Callable[[str], float | None]) -> bool:
    """Whether pieces of a block disagree in the sign of their determinant; False where that is not known.

    ``parameter`` gives the value of a parameter by the name of its symbol, None for other symbols.
    """
    residual, relations = _opened(block)
    if not 0 < len(relations) <= _MOST_RELATIONS:
        return False
    matrix = ca.jacobian(residual, block.unknown)
    if ca.depends_on(matrix, block.unknown):
        return False
    known = {str(relation) for relation in relations}
    given: dict[str, float] = {}
    for symbol in ca.symvar(matrix):
        name = str(symbol)
        if name in known:
            continue
        value = 0.0 if name.startswith(_HELD) else parameter(name)
        if value is None:
            return False
        given[name] = value
    others = [s for s in ca.symvar(matrix) if str(s) in given]
    numbers = ca.substitute(matrix, ca.vertcat(*others), ca.vertcat(*[given[str(s)] for s in others]))
    pieces = ca.Function("pieces", [ca.vertcat(*relations)], [numbers])
    signs = set()
    for choice in itertools.product((0.0, 1.0), repeat=len(relations)):
        signs.add(float(np.sign(np.linalg.det(np.array(pieces(ca.DM(choice)))))))
    return signs >= {-1.0, 1.0}


def _opened(block: Block) -> tuple[ca.SX, list[ca.SX]]:
    """The residual with a symbol for every relation between unknowns, and these symbols."""
    graph = Graph()
    targets = graph.add_column(block.residual)
    unknown = {str(block.unknown.nz[i]) for i in range(block.unknown.numel())}
    original = graph.expressions()
    made: dict[int, ca.SX] = {}
    relations: list[ca.SX] = []
    for index in graph.needed(targets):
        node = graph.nodes[index]
        if node.op is None:
            made[index] = ca.SX(node.constant) if node.constant is not None else original[index]
        elif node.op in _RELATIONS and graph.below[index] & unknown:
            made[index] = ca.SX.sym(f"relation({len(relations)})")
            relations.append(made[index])
        else:
            arguments = [made[a] for a in node.arguments]
            make = ca.SX.unary if len(arguments) == 1 else ca.SX.binary
            made[index] = make(node.op, *arguments)
    return ca.vertcat(*[made[target] for target in targets]), relations
