"""What every format reader returns, and how a column is found by its name."""

import re
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.errors import RecordingError, did_you_mean
from thsa_cosim.signals import FloatArray
from thsa_cosim.units import is_unit

Choose = Callable[[Sequence[str]], Iterable[str]]
"""Gets a file's column names, returns those to load; raises RecordingError for one that is not there."""


@dataclass(frozen=True, eq=False)
class RawColumn:
    """One column as the file holds it.

    ``values`` is (n,) in ``unit`` (None: the file does not say). ``time`` is (n,) s where the format gives
    each channel its own time axis. ``problem`` says why a column cannot be used as numbers.
    """

    values: FloatArray = field(default_factory=lambda: np.empty(0))
    unit: str | None = None
    time: FloatArray | None = None
    problem: str | None = None


def split_unit(header: str) -> tuple[str, str | None]:
    """Return ``("v", "mm/s")`` for ``"v [mm/s]"``; round brackets count only around a unit."""
    text = header.strip()
    if match := re.fullmatch(r"(.+?)\s*\[([^\[\]]*)\]", text):
        return match[1], match[2].strip() or "1"
    match = re.fullmatch(r"(.+?)\s*\((.+)\)", text)
    if match and is_unit(match[2]):
        return match[1], match[2].strip()
    return text, None


def resolve(path: Path, names: Sequence[str], wanted: str) -> str:
    """Return the full name in ``names`` that ``wanted`` means.

    ``wanted`` is a full name, or one without its unit (``v`` for ``v [mm/s]``) or group (``v`` for
    ``DAQ/v``), if only one column fits.

    Raises
    ------
    RecordingError
        If no column or more than one fits.
    """
    for same in (_itself, _without_unit, _without_group):
        fitting = [name for name in names if same(name) == wanted]
        if len(fitting) == 1:
            return fitting[0]
        if fitting:
            listed = ", ".join(repr(name) for name in sorted(set(fitting)))
            many = Counter(fitting).most_common(1)[0][1] > 1
            remedy = "rename them in the file" if many else "give the full name"
            raise RecordingError(
                f"{path}: column {wanted!r} fits {len(fitting)} columns ({listed}); {remedy}."
            )
    hint = did_you_mean(wanted, {f(n) for n in names for f in (_itself, _without_unit, _without_group)})
    if not hint:
        shown = ", ".join(repr(name) for name in names[:12]) + (", ..." if len(names) > 12 else "")
        hint = f" The file holds {shown}." if names else " The file holds no columns."
    raise RecordingError(f"{path}: no column {wanted!r}.{hint}")


def _itself(name: str) -> str:
    return name


def _without_unit(name: str) -> str:
    return split_unit(name)[0]


def _without_group(name: str) -> str:
    return split_unit(name)[0].rsplit("/", 1)[-1]


def sparse_rows(values: FloatArray) -> NDArray[np.intp] | None:
    """Return the rows that hold a number, if a column of a lower rate stands in a table: at most every second row,
    evenly; None otherwise.
    """
    filled = np.flatnonzero(np.isfinite(values))
    if not 2 <= filled.size <= values.size // 2 + 1 or filled.size == values.size:
        return None
    distances = np.diff(filled)
    usual = float(np.median(distances))
    return filled if usual >= 2.0 and distances.max() <= 1.5 * usual + 1.0 else None


def numeric(values: object) -> RawColumn:
    """Return a column from any array: numbers as they are, time stamps as seconds since the first."""
    array = np.asarray(values)
    if array.ndim != 1:
        return RawColumn(problem=f"has {array.ndim} dimensions of shape {array.shape}")
    if array.dtype.kind == "M":
        seconds = (array - array[0]) / np.timedelta64(1, "ns") * 1e-9 if array.size else np.empty(0)
        return RawColumn(np.asarray(seconds, dtype=np.float64), unit="s")
    if array.dtype.kind == "m":
        return RawColumn(np.asarray(array / np.timedelta64(1, "ns") * 1e-9, dtype=np.float64), unit="s")
    if array.dtype.kind not in "biuf":
        return RawColumn(problem="is not numeric")
    return RawColumn(np.ascontiguousarray(array, dtype=np.float64))
