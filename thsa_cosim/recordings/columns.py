"""What a recording holds: columns of numbers, with the unit that the file states or the name suggests."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from thsa_cosim.errors import RecordingError
from thsa_cosim.recordings import load_columns, noise_estimate, split_unit
from thsa_cosim.recordings.table import sparse_rows
from thsa_cosim.signals import FloatArray
from thsa_cosim.units import is_unit, same_dimension

#: Unit endings of names such as ``velocity_mm_s``, in the order in which they are tried: longest first.
_ENDINGS = (
    "mm/s2", "m/s2", "rad/s2", "mm/s", "um/s", "m/s", "km/h", "rad/s", "deg/s", "N.m", "Nm", "kN", "mN", "MPa",
    "kPa", "Pa", "bar", "degC", "degF", "rpm", "Hz", "kHz", "mA", "mV", "kV", "kW", "mm", "um", "cm", "ms", "us",
    "deg", "rad", "min", "kg", "Ohm", "N", "m", "s", "A", "V", "W", "K",
)  # fmt: skip
#: What drives state their speed in; that it counts turns is for the scenario to say, and for a draft to propose.
_PER_MINUTE = {"1/min", "min-1", "min^-1", "min⁻¹", "/min", "U/min", "Upm"}
TIME_NAMES = {"time", "t", "zeit", "temps", "timestamp", "elapsed", "seconds"}


@dataclass(frozen=True)
class FoundColumn:
    """A column of numbers: its full ``name``, the ``words`` of it, its ``unit`` and ``noise`` (1 σ) in that unit.

    ``stated``: whether the file itself gives the unit; otherwise the name suggests it. ``unit`` None: neither.
    ``constant``: all values are equal. ``silent``: mostly the value before, as a command's. ``text``: the name without
    group and unit.
    ``own_time``: the format gives the column a time axis of its own. ``increasing``: as a time axis must be.
    """

    name: str
    words: tuple[str, ...]
    unit: str | None
    stated: bool
    own_time: bool
    increasing: bool
    noise: float
    constant: bool = False
    silent: bool = False
    text: str = ""

    @property
    def plain(self) -> str:
        """The name without group, unit and unit ending."""
        return self.text or "_".join(self.words)


def find_columns(path: Path) -> tuple[FoundColumn, ...]:
    """Return the columns of ``path`` that hold finite numbers, in its order.

    Raises
    ------
    RecordingError
        If the file cannot be read, or holds no such column.
    """
    found, problem = [], ""
    for name, raw in load_columns(path).items():
        if raw.problem or raw.values.size < 2:
            problem = problem or f" ({name!r} {raw.problem or 'holds fewer than two values'})"
            continue
        rows = sparse_rows(raw.values)
        values = raw.values if rows is None else raw.values[rows]
        if not np.isfinite(values).all():
            continue
        plain, unit = split_unit(name)
        plain = plain.rsplit("/", 1)[-1]
        stated = raw.unit if raw.unit is not None and (raw.unit in _PER_MINUTE or is_unit(raw.unit)) else unit
        if stated is not None and stated.replace(" ", "") in _PER_MINUTE:
            stated = "rpm"
        stem, suggested = (plain, None) if stated else _ending(plain)
        found.append(
            FoundColumn(
                name=name,
                words=words(stem),
                unit=stated or suggested,
                stated=stated is not None,
                own_time=raw.time is not None,
                increasing=rows is None and _increases(values),
                noise=noise_estimate(values),
                constant=bool(values.min() == values.max()),
                silent=_is_command(values),
                text=stem,
            )
        )
    if not found:
        raise RecordingError(
            f"{path}: holds no column of finite numbers{problem}; repair or export it again."
        )
    return tuple(found)


def unused_columns(path: Path, found: Sequence[FoundColumn]) -> dict[str, str]:
    """Return why each of the other columns of ``path`` cannot be used, by its name."""
    known = {column.name for column in found}
    reasons = {}
    for name, raw in load_columns(path).items():
        if name in known:
            continue
        blank = int(np.sum(~np.isfinite(raw.values))) if not raw.problem else 0
        if raw.problem:
            reasons[name] = raw.problem
        elif raw.values.size < 2:
            reasons[name] = "holds fewer than two values"
        elif blank == raw.values.size:
            reasons[name] = "holds no number at all"
        else:
            reasons[name] = (
                f"holds no number in {blank} of {raw.values.size} rows; missing = [] would leave them out"
            )
    return reasons


def time_column(columns: Sequence[FoundColumn]) -> FoundColumn | None:
    """Return the column that is time: an increasing one, by its name, else by its unit; None if there is none."""
    rising = [c for c in columns if c.increasing and (c.unit is None or same_dimension(c.unit, "s"))]
    named = [c for c in rising if TIME_NAMES & {word.lower() for word in c.words}]
    timed = [c for c in rising if c.unit is not None]
    return next(iter([*named, *timed]), None)


def _ending(name: str) -> tuple[str, str | None]:
    """Return a name without the unit that it ends with, and that unit: ``position_m``, but not ``w_m``."""
    for unit in _ENDINGS:
        ending = re.sub(r"\W", "_", unit)
        match = re.fullmatch(rf"(.+)[_ .-]{re.escape(ending)}", name)
        if match and (len(unit) > 1 or any(len(word) > 2 for word in words(match[1]))):
            return match[1], unit
    return name, None


def words(text: str) -> tuple[str, ...]:
    """Return the words of a name or a sentence: ``motorSpeed_2`` gives motor, Speed, 2."""
    return tuple(re.findall(r"[A-Z]?[^\W\d_A-Z]+|[A-Z]+(?![^\W\d_A-Z])|\d+", text))


def _is_command(values: FloatArray) -> bool:
    """Whether a column mostly keeps its value, for long, and changes without noise."""
    same = np.diff(values) == 0.0
    return bool(np.mean(same) > 0.5 and np.mean(same[1:] & same[:-1]) > 0.8 * np.mean(same))


def _increases(values: FloatArray) -> bool:
    return bool((np.diff(values) > 0.0).all())
