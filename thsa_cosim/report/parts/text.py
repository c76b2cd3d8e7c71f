"""Numbers as text: values with their errors, shares, durations, lists of names."""

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

from thsa_cosim.report.parts.content import Cell

DASH = "–"


def number(value: float | None, digits: int = 4) -> str:
    """A number for a table; a dash where there is none."""
    return "–" if value is None or value != value else f"{value:.{digits}g}"


def plus_minus(value: float | None, stderr: float | None) -> str:
    """``0.4981 ± 0.0021``: the error with two digits, the value to the same decimal place."""
    if value is None or not math.isfinite(value):
        return DASH
    if stderr is None or not math.isfinite(stderr) or stderr <= 0.0:
        return number(value)
    size = max(abs(value), stderr)
    exponent = math.floor(math.log10(size)) if size > 0.0 else 0
    shift = exponent if not -3 <= exponent < 5 else 0
    scaled, error = value / 10.0**shift, stderr / 10.0**shift
    decimals = min(max(1 - math.floor(math.log10(error)), 0), 9)
    rounded = round(scaled, decimals) + 0.0  # no −0
    text = f"{rounded:.{decimals}f} ± {error:.{decimals}f}"
    return text if shift == 0 else f"({text})e{shift}"


def bound_text(estimate: Mapping[str, Any]) -> str:
    """``at its upper bound`` for a value within a thousandth of the searched range of one, else nothing."""
    low, high, value = estimate.get("lower"), estimate.get("upper"), estimate.get("value")
    if low is None or high is None or value is None or not high > low:
        return ""
    logarithmic = low > 0.0 and high > 30.0 * low and value > 0.0
    place = math.log(value / low) / math.log(high / low) if logarithmic else (value - low) / (high - low)
    return "at its lower bound" if place < 1e-3 else "at its upper bound" if place > 1.0 - 1e-3 else ""


def percent(share: float | None, digits: int = 2) -> str:
    """``1.2 %``, or a dash."""
    return DASH if share is None or not math.isfinite(share) else f"{number(100.0 * share, digits)} %"


def count(items: int, noun: str, plural: str = "") -> str:
    """``1 recording``, ``8 recordings``."""
    return f"{items} {noun if items == 1 else plural or noun + 's'}"


def listing(names: Sequence[str], most: int = 6) -> str:
    """``a, b and c``; beyond ``most`` names the rest is counted."""
    shown = list(names[:most])
    if len(names) > most:
        shown.append(f"{len(names) - most} more")
    return shown[0] if len(shown) == 1 else ", ".join(shown[:-1]) + f" and {shown[-1]}" if shown else DASH


def degrees(temperature: float | None) -> str:
    """``−30 °C``, or ``all temperatures`` for a point that has none."""
    if temperature is None:
        return "all temperatures"
    tenths = round(temperature, 1) + 0.0  # no −0
    return f"{tenths:g} °C".replace("-", "−")


def search_label(label: str) -> str:
    """A point's or group's own label, such as ``-30 degC``, as it is shown."""
    return re.sub(r"(?<!\w)-(?=\d)", "−", label).replace(" degC", " °C")


def significant(value: float | None, digits: int) -> str:
    """A number with exactly ``digits`` significant digits (``1.00``), so that columns line up."""
    if value is None or not math.isfinite(value):
        return DASH
    return f"{value:#.{digits}g}".rstrip(".")


def quantity(value: float | None, unit: str, digits: int = 4) -> str:
    """``0.45 A``; a number without unit stands alone."""
    text = number(value, digits)
    return text if unit in ("", "1") or text == DASH else f"{text} {unit}"


def significant_cell(value: float | None, digits: int = 3, mark: str = "") -> Cell:
    """A cell with a number of exactly ``digits`` digits."""
    return Cell(significant(value, digits), value, mark)


def number_cell(value: float | None, digits: int = 4, mark: str = "") -> Cell:
    """A cell with a number."""
    return Cell(number(value, digits), value, mark)


def text_cell(text: object, mark: str = "") -> Cell:
    """A cell with a text that sorts as such."""
    return Cell(str(text), str(text), mark)
