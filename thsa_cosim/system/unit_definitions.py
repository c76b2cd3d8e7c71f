"""Units that a file names as it likes and defines by their SI base units (``ssc:Unit``, SSP 1.0, section 4.4.2)."""

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass, field

from thsa_cosim.errors import UnitError
from thsa_cosim.ssv import SSC
from thsa_cosim.units import base_exponents, conversion

_BASES = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")


@dataclass(frozen=True)
class UnitDefinitions:
    """What names of units stand for; a name that is known anyway needs no definition."""

    defined: Mapping[str, tuple[Mapping[str, int], float, float]] = field(default_factory=dict)
    """Exponents over the base units, factor and offset: base = factor * value + offset."""

    def conversion(self, source: str, target: str) -> tuple[float, float]:
        """Return (factor, offset) from ``source`` to ``target``; UnitError if there is none."""
        source, target = source.strip("[] "), target.strip("[] ")  # as tools of CAD write them
        if source == target:
            return 1.0, 0.0
        try:
            return conversion(source, target)
        except UnitError:
            if not {source, target} & set(self.defined):
                raise
        (a, factor, offset), (b, scale, shift) = self._base(source), self._base(target)
        if a != b:
            raise UnitError(
                f"unit {source!r} cannot be turned into {target!r} (their dimensions differ); correct the unit."
            )
        return factor / scale, (offset - shift) / scale

    def _base(self, unit: str) -> tuple[Mapping[str, int], float, float]:
        exponents, factor, offset = self.defined.get(unit) or base_exponents(unit)
        # An angle is no dimension beside others (N.m.s/rad); alone with time it tells rad/s from Hz.
        kept = {name: n for name, n in exponents.items() if n}
        if set(kept) - {"rad", "s"}:
            kept.pop("rad", None)
        return kept, factor, offset


def read_units(root: ET.Element) -> dict[str, tuple[Mapping[str, int], float, float]]:
    """Read every definition within an element; one without base units defines nothing."""
    found: dict[str, tuple[Mapping[str, int], float, float]] = {}
    for unit in root.iter(f"{{{SSC}}}Unit"):
        base = unit.find(f"{{{SSC}}}BaseUnit")
        if base is None:
            continue
        try:
            exponents = {name: int(base.get(name, "0")) for name in _BASES}
            factor, offset = float(base.get("factor", "1")), float(base.get("offset", "0"))
        except ValueError as error:
            raise UnitError(f"the unit {unit.get('name')!r} is not defined by numbers ({error}).") from None
        if factor == 0.0:
            raise UnitError(f"the unit {unit.get('name')!r} has the factor 0; correct it.")
        found[unit.get("name", "")] = exponents, factor, offset
    return found
