"""Which material a parameter stands for, by its unit, and what that material's law must look like."""

from dataclasses import dataclass

from thsa_cosim.errors import UnitError
from thsa_cosim.laws.law import CANDIDATES
from thsa_cosim.units import base_exponents


@dataclass(frozen=True)
class Quantity:
    """A kind of parameter and how its material behaves.

    ``rises``: whether it grows with temperature (None: no material decides). ``physical``: the physical form that
    selection weighs as well, "" for none. ``source``: what says so.
    """

    name: str
    text: str
    rises: bool | None
    physical: str
    source: str


RESISTANCE = Quantity(
    "winding-resistance", "the resistance of copper", True, "copper", "0.393 %/K at 20 degC, IEC 60028"
)
FLUX = Quantity(
    "magnet-flux",
    "the flux of permanent magnets",
    False,
    "",
    "−0.02 %/K for AlNiCo to −0.20 %/K for ferrite, IEC 60404-8-1",
)
VISCOUS = Quantity(
    "viscous-friction",
    "the viscosity of a lubricant",
    False,
    "vogel",
    "Vogel 1921; Walther 1931, ASTM D341",
)
COULOMB = Quantity(
    "coulomb-friction", "friction of a lubricated contact", False, "vogel", "seals and preload can differ"
)
QUANTITIES = {q.name: q for q in (RESISTANCE, FLUX, VISCOUS, COULOMB)}

_BY_DIMENSION = {
    (("kg", 1), ("m", 2), ("s", -3), ("A", -2)): RESISTANCE,
    (("kg", 1), ("m", 2), ("s", -2), ("A", -1)): FLUX,
    (("kg", 1), ("m", 2), ("s", -1)): VISCOUS,
    (("kg", 1), ("s", -1)): VISCOUS,
    (("kg", 1), ("m", 1), ("s", -2)): COULOMB,
    (("kg", 1), ("m", 2), ("s", -2)): COULOMB,
}


def quantity_of(unit: str, named: str | None = None) -> Quantity | None:
    """The quantity ``named`` ("none": none), or the one that ``unit`` suggests; None where neither says."""
    if named is not None:
        return QUANTITIES.get(named)
    try:
        exponents, _, _ = base_exponents(unit)
    except UnitError:
        return None
    return _BY_DIMENSION.get(tuple((base, n) for base, n in exponents.items() if base != "rad"))


def candidates_for(quantity: Quantity | None) -> tuple[str, ...]:
    """The forms that selection weighs for ``quantity``."""
    return CANDIDATES if quantity is None or not quantity.physical else (*CANDIDATES, quantity.physical)
