"""Unit strings of Modelica (ModelicaReference 'Units') → base units of the FMI (FMI 2.0.4, 2.2.2; FMI 3.0, 2.4.3)."""

import re
from dataclasses import dataclass

from thsa_cosim.errors import ModelicaError

_BASE = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
_SYMBOLS: dict[str, tuple[dict[str, int], float]] = {
    **{name: ({name: 1}, 1.0) for name in _BASE},
    "1": ({}, 1.0),
    "g": ({"kg": 1}, 1e-3),
    "N": ({"kg": 1, "m": 1, "s": -2}, 1.0),
    "J": ({"kg": 1, "m": 2, "s": -2}, 1.0),
    "W": ({"kg": 1, "m": 2, "s": -3}, 1.0),
    "Pa": ({"kg": 1, "m": -1, "s": -2}, 1.0),
    "Hz": ({"s": -1}, 1.0),
    "C": ({"A": 1, "s": 1}, 1.0),
    "V": ({"kg": 1, "m": 2, "s": -3, "A": -1}, 1.0),
    "Ohm": ({"kg": 1, "m": 2, "s": -3, "A": -2}, 1.0),
    "S": ({"kg": -1, "m": -2, "s": 3, "A": 2}, 1.0),
    "F": ({"kg": -1, "m": -2, "s": 4, "A": 2}, 1.0),
    "H": ({"kg": 1, "m": 2, "s": -2, "A": -2}, 1.0),
    "Wb": ({"kg": 1, "m": 2, "s": -2, "A": -1}, 1.0),
    "T": ({"kg": 1, "s": -2, "A": -1}, 1.0),
    "deg": ({"rad": 1}, 0.017453292519943295),
    "rev": ({"rad": 1}, 6.283185307179586),
    "min": ({"s": 1}, 60.0),
    "h": ({"s": 1}, 3600.0),
    "bar": ({"kg": 1, "m": -1, "s": -2}, 1e5),
    "l": ({"m": 3}, 1e-3),
}
_PREFIXES = {"k": 1e3, "M": 1e6, "G": 1e9, "m": 1e-3, "u": 1e-6, "n": 1e-9, "c": 1e-2, "d": 1e-1, "h": 1e2}
_FACTOR = re.compile(r"([A-Za-z]+|1)([-+]?\d+)?$")


@dataclass(frozen=True)
class BaseUnit:
    """Exponents of the SI base units (and rad), and x_base = factor * x + offset."""

    exponents: dict[str, int]
    factor: float = 1.0
    offset: float = 0.0


def base_unit(unit: str) -> BaseUnit:
    """Base unit of a Modelica unit string such as ``N.m.s/(rad.K2)``; raises ModelicaError when it is unknown."""
    if unit == "degC":
        return BaseUnit({"K": 1}, 1.0, 273.15)
    top, *bottom = unit.split("/")
    if len(bottom) > 1:
        raise ModelicaError(f"The unit {unit!r} has more than one '/'; write a/(b.c).")
    exponents: dict[str, int] = {}
    factor = 1.0
    for text, sign in ((top, 1), *((part, -1) for part in bottom)):
        for word in text.strip("() ").split("."):
            parts = _FACTOR.match(word.strip())
            if parts is None:
                raise ModelicaError(f"The unit {unit!r} is not understood at {word!r}.")
            symbol, power = parts.group(1), sign * int(parts.group(2) or 1)
            dimensions, scale = _symbol(symbol, unit)
            factor *= scale**power
            for name, exponent in dimensions.items():
                exponents[name] = exponents.get(name, 0) + power * exponent
    return BaseUnit({name: exponents[name] for name in _BASE if exponents.get(name)}, factor)


def _symbol(symbol: str, unit: str) -> tuple[dict[str, int], float]:
    if symbol in _SYMBOLS:
        return _SYMBOLS[symbol]
    if len(symbol) > 1 and symbol[0] in _PREFIXES and symbol[1:] in _SYMBOLS:
        dimensions, factor = _SYMBOLS[symbol[1:]]
        return dimensions, factor * _PREFIXES[symbol[0]]
    raise ModelicaError(f"The unit {unit!r} holds {symbol!r}, which is no SI unit that the exporter knows.")
