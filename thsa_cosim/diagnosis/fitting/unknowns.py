"""The unknowns of a fit: declared parameters (with what the drawing says of them) and an effect's parameters."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from thsa_cosim.diagnosis.catalogue.candidate import Candidate
from thsa_cosim.diagnosis.catalogue.declared import DeclaredEffect
from thsa_cosim.search import Box
from thsa_cosim.signals import FloatArray

#: A declared parameter so many spreads from the drawing is a finding of its own: a brake that drags, a weak magnet
#: (set while looking at a simulated unit whose brake drags).
FAR = 5.0


@dataclass(frozen=True)
class Unknown:
    """One number to be fitted, in the FMU variable's unit.

    ``start`` and ``spread`` are mean and standard deviation of what is known beforehand (the drawing; infinite:
    nothing); ``scale`` is a change of ordinary size. ``group`` restricts it to the recordings of one temperature.
    ``offset`` is added for the FMU: a law's value at that temperature less its coefficient alpha0.
    """

    name: str
    variable: str
    unit: str
    start: float
    spread: float
    scale: float
    lower: float
    upper: float
    group: str | None = None
    declared: bool = True
    offset: float = 0.0


@dataclass(frozen=True)
class Unknowns:
    """An ordered set of unknowns; vectors are in their units."""

    members: tuple[Unknown, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names in the order of the vectors."""
        return tuple(u.name for u in self.members)

    @property
    def start(self) -> FloatArray:
        """(n,) start values."""
        return np.array([u.start for u in self.members])

    def at_drawing(self, vector: FloatArray) -> FloatArray:
        """(n,) ``vector`` with the declared parameters at their start values."""
        return np.where([u.declared for u in self.members], self.start, vector)

    @property
    def scale(self) -> FloatArray:
        """(n,) ordinary changes."""
        return np.array([u.scale for u in self.members])

    @property
    def precision(self) -> FloatArray:
        """(n,) 1/spread, 0 where nothing is known."""
        return np.array([1.0 / u.spread if np.isfinite(u.spread) else 0.0 for u in self.members])

    @property
    def box(self) -> Box:
        """Bounds and scales (n,)."""
        lower = np.array([u.lower for u in self.members])
        upper = np.array([u.upper for u in self.members])
        return Box(lower, upper, self.scale)

    def clip(self, vector: FloatArray) -> FloatArray:
        """``vector`` (n,) within the bounds."""
        return self.box.clip(vector)

    def prior(self, vector: FloatArray) -> FloatArray:
        """(n,) deviation of ``vector`` from what is known, in standard deviations."""
        return np.asarray((vector - self.start) * self.precision)

    def is_far(self, vector: FloatArray) -> bool:
        """Whether a declared parameter of ``vector`` (n,) is more than `FAR` spreads from the drawing."""
        return bool(np.any(np.abs(self.prior(vector)) > FAR))

    def assignments(self, vector: FloatArray, group: str) -> dict[str, float]:
        """FMU start values for a recording of ``group``."""
        return {
            u.variable: float(x) + u.offset
            for u, x in zip(self.members, vector, strict=True)
            if u.group is None or u.group == group
        }

    def with_members(self, further: Sequence[Unknown]) -> "Unknowns":
        """These and ``further``."""
        return Unknowns((*self.members, *further))

    def index(self, names: Sequence[str]) -> list[int]:
        """Positions of the named unknowns."""
        position = {name: k for k, name in enumerate(self.names)}
        return [position[name] for name in names]

    def named(self, vector: FloatArray) -> Mapping[str, float]:
        """Values by name."""
        return dict(zip(self.names, vector.tolist(), strict=True))


#: Relative spread of a shape that is known: an integer order of a machine.
EXACT = 1e-6


def declared_unknowns_of(effects: Sequence[DeclaredEffect]) -> tuple[Unknown, ...]:
    """The parameters of known effects as declared unknowns, of which only the start is known; each variable once."""
    found = {
        u.name: replace(u, start=effect.starts[u.name.rpartition(".")[2]], declared=True)
        for effect in effects
        for u in unknowns_of(effect.candidate, effect.starts)
    }
    return tuple(found.values())


def unknowns_of(
    candidate: Candidate, shapes: Mapping[str, float], held: Collection[str] = ()
) -> tuple[Unknown, ...]:
    """The candidate's parameters as unknowns: coefficients at neutral, shapes at the given starts.

    ``held``: names of shapes that are known there.
    """
    made = []
    for p in candidate.parameters:
        shape = p.role == "shape"
        if shape and p.fixed:
            continue
        start = shapes[p.name] if shape else p.neutral
        made.append(
            Unknown(
                name=p.variable,
                variable=p.variable,
                unit=p.unit,
                start=start,
                spread=EXACT * abs(start) if shape and p.name in held else np.inf,
                scale=0.3 * (abs(start) or abs(p.typical)) if shape else p.typical,
                lower=p.lower,
                upper=p.upper,
                declared=False,
            )
        )
    return tuple(made)
