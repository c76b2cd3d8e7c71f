"""The exported model: its variables, its equations in explicit form, and what happens at events (CasADi SX)."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import casadi as ca

from thsa_cosim.export.block import Block, Pivot
from thsa_cosim.modelica.flat import FlatModel


@dataclass(frozen=True)
class ModelVariable:
    """One variable of the exported model.

    ``kind`` is "state", "derivative", "input", "parameter", "dependent" or "algebraic"; ``index`` counts within the
    kind. Aliases share kind and index. ``start`` is given where it may be set before initialization. ``discrete`` says
    that the value changes at events only.
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
    discrete: bool = False


@dataclass(frozen=True)
class Events:
    """What happens at events, over the symbols of the model.

    ``z`` are the discrete variables, the first ``left`` of them left limits of continuous ones; ``update`` are their
    new values, ``z_start`` those before the first event; ``reinit`` are the new values of the states. ``samples`` has
    the columns start and interval. In the model's m follow on the modes: z, pre(z), one tick a sample, and a 1 that
    holds while the initial values are found.
    """

    z: tuple[str, ...] = ()
    left: int = 0
    update: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    z_start: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    reinit: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    samples: ca.SX = field(default_factory=lambda: ca.SX(0, 2))
    used: bool = False


@dataclass(frozen=True)
class CausalModel:
    """dx/dt = f(t, x, u, p, d, m, y), w = h(...), g = event indicators, x(0) = initial(...).

    p are the parameters that can be set, d = dependent(p) the calculated ones, m the modes (relation k holds when
    g[k] > 0) and what else is constant between events. y are the unknowns of the implicit ``blocks``, whose residuals
    are zero. All expressions are CasADi SX columns over the symbols of this object.
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
    events: Events = field(default_factory=Events)
    blocks: tuple[Block, ...] = ()
    initial_blocks: tuple[Block, ...] = ()
    y_start: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    g_start: ca.SX = field(
        default_factory=lambda: ca.SX(0, 1)
    )  # g at the guesses, where the initial values need modes
    g_simplified: ca.SX = field(default_factory=lambda: ca.SX(0, 1))  # where homotopy() leads to
    assertions: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    domain: ca.SX = field(default_factory=lambda: ca.SX(0, 1))  # nonzero where a function leaves its domain
    domain_texts: tuple[str, ...] = ()
    relations: tuple[str, ...] = ()  # what holds where g > 0, as text
    pivots: tuple[Pivot, ...] = ()

    @property
    def y(self) -> ca.SX:
        """Unknowns of all implicit blocks."""
        return column(b.unknown.nz[i] for b in self.blocks for i in range(b.unknown.numel()))


def column(entries: Iterable[ca.SX]) -> ca.SX:
    """A column of scalars that stays an SX when it is empty."""
    listed = list(entries)
    return ca.vertcat(*listed) if listed else ca.SX(0, 1)
