"""What the messages of a running model call its states, relations, discrete variables, loops and divisions."""

import re

from thsa_cosim.export.block import Block, Pivot
from thsa_cosim.export.model import CausalModel


def texts(model: CausalModel) -> list[str]:
    """What messages at run time call the states, relations, discrete variables, loops and divisions."""
    relations = [_cut(relation, 100) for relation in model.relations]
    divided = [_solved(pivot) for pivot in model.pivots]
    return [*model.states, *relations, *model.events.z, *loop_texts(model), *divided]


def loop_texts(model: CausalModel) -> list[str]:
    """What is said of a loop without a solution: of the running model, of its initialization, and of all at once."""
    found = [_unsolved(block) for block in (*model.blocks, *model.initial_blocks)]
    return [*found, "the Jacobian of its loops is singular"] if model.blocks else found


def _solved(pivot: Pivot) -> str:
    """What is said of a block that is divided by 0."""
    listed = "; ".join(_equation(label) for label in pivot.equations[:3])
    more = f"; and {len(pivot.equations) - 3} more" if len(pivot.equations) > 3 else ""
    fault = "which are singular there" if len(pivot.equations) > 1 else "where its coefficient is 0"
    return f"{', '.join(pivot.names)} cannot be solved from {listed}{more}, {fault}"


def _unsolved(block: Block) -> str:
    """What is said of a loop that has no solution."""
    how = "are singular" if block.linear else "have no solution that Newton's method finds"
    listed = "; ".join(_equation(label) for label in block.equations[:3])
    more = len(block.equations) - 3
    names = ", ".join(block.names[:4]) + (", ..." if len(block.names) > 4 else "")
    return f"the equations of {names} {how}: {listed}" + (f"; and {more} more" if more > 0 else "")


def _equation(label: str) -> str:
    """A label with its place shortened to file name and line, and its text to what can be read."""
    found = re.fullmatch(
        r"(.*) \(([^()]*:\d+)\)(\)*)", label, re.DOTALL
    )  # of derivatives: der(equation (place))
    return f"{_cut(found[1] + found[3], 60)} ({short(found[2])})" if found else _cut(label, 60)


def _cut(shown: str, most: int) -> str:
    return shown if len(shown) <= most else f"{shown[: most - 3]}..."


def quoted(message: str) -> str:
    """A C string literal."""
    plain = message.encode("ascii", "replace").decode()[:400]
    escaped = plain.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n").replace("?", "\\?")
    return f'"{escaped}"'


def short(place: str) -> str:
    """File name and line of a place."""
    return place.replace("\\", "/").rsplit("/", 1)[-1]
