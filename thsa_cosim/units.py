"""Units: conversion between the spellings of recordings, scenarios, Modelica and the FMI.

Modelica and FMI 2.0 (section 2.2.2) write ``N.m/(rad/s)``, ``kg.m2``, ``s-1``; people write ``Nm``,
``N*m``, ``m/s^2``, ``°C``. All of them are accepted.
"""

import re
from collections import Counter
from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING, TypeVar, cast

from thsa_cosim.errors import UnitError, did_you_mean
from thsa_cosim.signals import FloatArray

if TYPE_CHECKING:
    import pint

Numeric = TypeVar("Numeric", float, FloatArray)

_COMMON = (
    "1", "%", "rad", "deg", "s", "ms", "Hz", "m", "mm", "um", "m/s", "mm/s", "m/s2", "rad/s", "deg/s", "rpm",
    "kg", "kg.m2", "N", "kN", "N/m", "N.s/m", "N/(m/s)", "N.m", "N.m.s/rad", "N.m/(rad/s)", "Pa", "bar", "A",
    "V", "W", "Ohm", "H", "Wb", "V.s/rad", "A/(rad/s)", "degC", "K",
)  # fmt: skip
_SPELLINGS = {"": "1", "-": "1", "U/min": "rpm", "rev/min": "rpm", "r/min": "rpm"}
_ANGLES = {"radian", "degree", "turn", "revolution", "revolutions_per_minute", "revolutions_per_second"}
_OFFSET_UNITS = {name: f"delta_{name}" for name in ("degree_Celsius", "degree_Fahrenheit", "degree_Reaumur")}


_SI = {
    "rad": "rad", "m": "m", "s": "s", "kg": "kg", "A": "A", "K": "K", "N": "kg.m.s-2", "Pa": "kg.m-1.s-2",
    "J": "kg.m2.s-2", "W": "kg.m2.s-3", "V": "kg.m2.s-3.A-1", "Ohm": "kg.m2.s-3.A-2", "ohm": "kg.m2.s-3.A-2",
    "H": "kg.m2.s-2.A-2", "Wb": "kg.m2.s-2.A-1",
}  # fmt: skip
"""Symbols that are read without pint, which takes a third of a second to import and to read its definitions."""
_SCALED = {"mm": ("m", -3), "um": ("m", -6), "km": ("m", 3), "ms": ("s", -3), "us": ("s", -6), "g": ("kg", -3),
           "mA": ("A", -3), "kN": ("N", 3), "mV": ("V", -3), "kV": ("V", 3), "kW": ("W", 3), "kPa": ("Pa", 3),
           "MPa": ("Pa", 6), "mH": ("H", -3), "uH": ("H", -6), "mWb": ("Wb", -3)}  # fmt: skip
_TOKEN = re.compile(r"([A-Za-z]+)([+-]?\d{1,2}(?!\d))?(?!\d)")


@lru_cache(maxsize=1024)
def _plain(unit: str) -> tuple[dict[str, int], int] | None:
    """Base exponents and power of ten of products and quotients of well-known symbols; None: ask pint."""
    text = unit.strip()
    if text == "1":
        return {}, 0
    if len(text) > 80:
        return None
    text = text.removeprefix("1") if text.startswith("1/") else "." + text
    found: Counter[str] = Counter()
    ten, at, sign = 0, 0, 1
    signs = [1]
    while at < len(text):
        operator, at = text[at], at + 1
        if operator == ")" and len(signs) > 1:
            signs.pop()
            continue
        if operator not in "./*":
            return None
        sign = signs[-1] if operator != "/" else -signs[-1]
        while text[at : at + 1] == "(":
            signs.append(sign)
            at += 1
        symbol = _TOKEN.match(text, at)
        if symbol is None or symbol[1] is None:
            return None
        base, scale = _SCALED.get(symbol[1], (symbol[1], 0))
        if base not in _SI:
            return None
        at = symbol.end()
        power = sign * int(symbol[2] or 1)
        ten += scale * power
        for name, exponent in re.findall(r"([A-Za-z]+)(-?\d)?", _SI[base]):
            found[name] += power * int(exponent or 1)
    return ({name: n for name, n in found.items() if n}, ten) if len(signs) == 1 else None


def _without_angle(exponents: dict[str, int]) -> dict[str, int]:
    return {name: n for name, n in exponents.items() if name != "rad"}


def _plainly(source: str, target: str) -> tuple[float, float] | None:
    """``conversion`` of well-known symbols; None: ask pint."""
    a, b = _plain(source), _plain(target)
    if a is None or b is None or a[0] != b[0]:
        return None
    return float(Fraction(10) ** (a[1] - b[1])), 0.0


@lru_cache(maxsize=1)
def _registry() -> "pint.UnitRegistry[float]":
    import pint

    registry: pint.UnitRegistry[float] = pint.UnitRegistry()
    registry.define("newton_meter = newton * meter = Nm")
    registry.define("newton_meter_second = newton * meter * second = Nms")
    for alias in ("ohm = Ohm = Ohms", "volt = Volt = Volts", "revolution = rev", "ampere = Ampere = Amps"):
        registry.define(f"@alias {alias}")
    return registry


def _pint_spelling(unit: str) -> str:
    text = _SPELLINGS.get(unit.strip(), unit.strip())
    # A digit straight after a symbol is an exponent (m2, s-1), a dot between symbols a product (N.m).
    text = re.sub(r"(?<!\w)([^\W\d_]+)([+-]?\d+)(?!\w)", r"\1**(\2)", text)
    return re.sub(r"(?<!\d)\.|\.(?!\d)", "*", text)


@lru_cache(maxsize=1024)
def _parse(unit: str) -> "pint.Unit":
    if len(unit) > 80:
        raise UnitError(f"unit {unit[:40]!r}... is too long to be a unit.")
    try:
        if "//" in unit:
            raise ValueError(unit)
        return _registry().parse_units(_pint_spelling(unit))
    except Exception:  # pint raises a dozen types, AssertionError and TokenError among them
        raise UnitError(
            f"unknown unit {unit!r}; write it as in 'N.m/(rad/s)'.{did_you_mean(unit, _COMMON)}"
        ) from None


def _speaks_of_angle(unit: "pint.Unit") -> bool:
    return bool(_ANGLES & set(unit._units))


def _check_frequency(source: str, target: str) -> None:
    """Refuse Hz against rad/s: pint takes both as 1/s, which hides a factor of 2 pi."""
    a, b = _parse(source), _parse(target)
    if _speaks_of_angle(a) == _speaks_of_angle(b):
        return
    if a.dimensionality != b.dimensionality or dict(a.dimensionality) != {"[time]": -1}:
        return
    plain, name = (b, target) if _speaks_of_angle(a) else (a, source)
    if set(plain._units) != {"second"}:
        other = source if name is target else target
        raise UnitError(
            f"unit {name!r} does not say whether it counts turns or radians, so it cannot be turned into"
            f" {other!r}; write 'rpm', 'rev/s' or 'rad/s'."
        )


@lru_cache(maxsize=1024)
def conversion(source: str, target: str) -> tuple[float, float]:
    """Return ``(factor, offset)`` such that ``value_in_target = factor * value_in_source + offset``.

    Raises
    ------
    UnitError
        If a unit is unknown, the dimensions differ, or the pair hides a factor of 2 pi (Hz and rad/s).
    """
    if source == target == "degC":
        return 1.0, 0.0
    if (plain := _plainly(source, target)) is not None:
        return plain
    b = _parse(target)
    try:
        a = _parse(source)
    except UnitError:
        raise UnitError(
            f"unknown unit {source!r}; write it as in 'N.m/(rad/s)'.{_meant(source, target)}"
        ) from None
    if source == target or a == b:
        return 1.0, 0.0
    _check_frequency(source, target)
    registry = _registry()
    try:
        factor = registry.Quantity(1.0, _difference(a)).to(_difference(b)).magnitude
        offset = 0.0
        if _OFFSET_UNITS.keys() & (set(a._units) | set(b._units)):
            offset = registry.Quantity(0.0, a).to(b).magnitude
    except Exception:
        raise UnitError(
            f"unit {source!r} cannot be turned into {target!r} (their dimensions differ); correct the unit."
            f"{_meant(source, target)}"
        ) from None
    return factor, offset


def _meant(unit: str, target: str) -> str:
    """Return a hint at ``target``, or a common unit of its dimension, that looks like ``unit``."""
    dimension = _parse(target).dimensionality
    return did_you_mean(unit, [target, *(u for u in _COMMON if _parse(u).dimensionality == dimension)])


def _difference(unit: "pint.Unit") -> "pint.Unit":
    """Return the unit of a difference: degC becomes delta_degC, everything else stays."""
    names = list(unit._units)
    return _parse(_OFFSET_UNITS[names[0]]) if len(names) == 1 and names[0] in _OFFSET_UNITS else unit


def convert(values: Numeric, source: str, target: str) -> Numeric:
    """Return ``values`` (scalar or (n,)) converted from ``source`` to ``target``, offsets included (degC, K).

    Raises
    ------
    UnitError
        As :func:`conversion`.
    """
    factor, offset = conversion(source, target)
    if factor == 1.0 and offset == 0.0:
        return values
    return values * factor + offset


def same_dimension(a: str, b: str) -> bool:
    """Return whether ``a`` converts to ``b``; raises :class:`UnitError` if either unit is unknown."""
    # A temperature in degC has the dimension of one in K.
    plain = [_plain("K" if unit == "degC" else unit) for unit in (a, b)]
    if plain[0] is not None and plain[1] is not None:
        first, second = plain[0][0], plain[1][0]
        if first == second or _without_angle(first) != _without_angle(second):
            return first == second
    _parse(a), _parse(b)
    try:
        conversion(a, b)
    except UnitError:
        return False
    return True


def is_unit(text: str) -> bool:
    """Return whether ``text`` is a unit that can be converted."""
    if text == "degC" or _plain(text) is not None:
        return True
    try:
        _parse(text)
    except UnitError:
        return False
    return True


def base_exponents(unit: str) -> tuple[dict[str, int], float, float]:
    """Return FMI base-unit exponents, factor and offset of ``unit`` (FMI 2.0.4 section 2.2.2, ``BaseUnit``).

    The exponents are over kg, m, s, A, K, mol, cd and rad; ``base = factor * value + offset``.
    """
    if (plain := _plain(unit)) is not None:
        order = ("kg", "m", "s", "A", "K", "rad")
        return (
            {name: plain[0][name] for name in order if name in plain[0]},
            float(Fraction(10) ** plain[1]),
            0.0,
        )
    parsed = _parse(unit)
    dimensions = {
        "[mass]": "kg", "[length]": "m", "[time]": "s", "[current]": "A",
        "[temperature]": "K", "[substance]": "mol", "[luminosity]": "cd",
    }  # fmt: skip
    exponents = {dimensions[d]: round(cast(float, e)) for d, e in dict(parsed.dimensionality).items()}
    angle = sum(e for name, e in parsed._units.items() if name in _ANGLES)
    if angle:
        exponents["rad"] = round(cast(float, angle))
    ordered = {base: exponents[base] for base in dimensions.values() if exponents.get(base)}
    if exponents.get("rad"):
        ordered["rad"] = exponents["rad"]
    base = "*".join(f"{name}**{power}" for name, power in ordered.items()) or "1"
    factor, offset = conversion(unit, base)
    return ordered, factor, offset
