"""What the catalogue knows of a physical effect, in the terms of the slot that it plugs into."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

from thsa_cosim.signals import FloatArray

Role = Literal["coefficient", "shape"]
Values = Mapping[str, float]
"""An effect's parameters by name."""
Connectors = Mapping[str, FloatArray]
"""The variables that a block reads in its slot (`slots.INPUTS`) over a run, and ``time`` [s]: each (n,)."""
Law = Callable[[Values, Connectors], FloatArray]
"""What a block gives, (n,)."""


@dataclass(frozen=True)
class EffectParameter:
    """A parameter of an effect's Modelica class, in multiples of the scales of its slot.

    ``dimension`` is a product of powers of the slot's scales (``"F/V^2"``; ``"1"`` for a plain number, or a unit
    such as ``"s"``); ``typical``, ``lower``, ``upper`` and ``starts`` are multiples of it. A coefficient makes the
    effect vanish at its ``neutral`` value and acts nearly linearly; a shape parameter only matters next to it and
    is tried from every one of ``starts``. ``scanned`` shapes are wave numbers whose starts come from a periodogram
    of the residual besides.
    """

    name: str
    dimension: str
    typical: float
    description: str
    role: Role = "coefficient"
    lower: float = -1e3
    upper: float = 1e3
    starts: tuple[float, ...] = ()
    neutral: float = 0.0
    fixed: bool = False
    scanned: bool = False

    def scale(self, slot: Mapping[str, float]) -> float:
        """Value of the dimension with the slot's scales (F, V, Z, I, U, P, in the model's units)."""
        value = 1.0
        for symbol, power in powers(self.dimension):
            value *= slot.get(symbol, 1.0) ** power
        return value

    def unit(self, units: Mapping[str, str]) -> str:
        """Modelica unit, with those of the slot's scales put in: ``"F/V^2"`` → ``"N.s2/m2"``."""
        exponents: dict[str, int] = {}
        for symbol, power in powers(self.dimension):
            for factor, exponent in _factors(units.get(symbol, symbol)).items():
                exponents[factor] = exponents.get(factor, 0) + power * exponent
        above = ".".join(f"{f}{e if e > 1 else ''}" for f, e in exponents.items() if e > 0) or "1"
        below = [f"{f}{-e if e < -1 else ''}" for f, e in exponents.items() if e < 0]
        return above + ("" if not below else "/" + (below[0] if len(below) == 1 else f"({'.'.join(below)})"))


def _factors(unit: str) -> dict[str, int]:
    """``"N.m/(rad/s)"`` → {N: 1, m: 1, rad: -1, s: 1}; numbers are left out."""
    found: dict[str, int] = {}
    signs, sign = [1], 1
    for token in re.findall(r"[A-Za-z]+\d*|1|[./()]", unit):
        if token == "(":
            signs.append(signs[-1] * sign)
            sign = 1
        elif token == ")":
            signs.pop()
            sign = 1
        elif token in "./":
            sign = -1 if token == "/" else 1
        elif token != "1":
            name, exponent = re.match(r"([A-Za-z]+)(\d*)", token).groups()  # type: ignore[union-attr]
            found[name] = found.get(name, 0) + signs[-1] * sign * int(exponent or 1)
    return found


def powers(dimension: str) -> list[tuple[str, int]]:
    """``"F/V^2"`` → [("F", 1), ("V", -2)]."""
    found = []
    for sign, symbol, exponent in re.findall(r"(^|[*/])\s*([A-Za-z]+)(?:\^(\d+))?", dimension):
        found.append((symbol, (-1 if sign == "/" else 1) * int(exponent or 1)))
    return found


@dataclass(frozen=True)
class Variant:
    """One way in which an effect can act: a Modelica class in the slots of an interface.

    ``block`` and ``interface`` are class names within ``THSA.Effects`` and ``THSA.Interfaces`` (or qualified);
    ``slots`` restricts it to slots of these names (without the ending ``Effect``; ``motor`` takes ``motorA`` as well),
    None: all of the interface.
    ``beside``: offered only once another variant of the block is in the model, as a further part of the same effect.
    ``instead``: another form, tried in the place where the effect was accepted.
    ``law``: the block's equation, for FMUs without source (`diagnosis.blackbox`); None: not for those.
    """

    interface: str
    block: str
    parameters: tuple[EffectParameter, ...]
    slots: tuple[str, ...] | None = None
    law: Law | None = None
    beside: bool = False
    instead: bool = False

    @property
    def component(self) -> str:
        """Name of the component in the slot: the class name in lower camel case."""
        last = self.block.rsplit(".", 1)[-1]
        return last[0].lower() + last[1:]


@dataclass(frozen=True)
class Effect:
    """A physical effect: what it is, where it is described, how it shows, and how a model gets it."""

    name: str
    title: str
    physics: str
    source: str
    signature: str
    variants: tuple[Variant, ...]
    part: Literal["screw"] | None = None
    """Offered only to machines that have this part."""
