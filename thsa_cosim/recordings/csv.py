"""Text tables as laboratories write them, LabVIEW measurement files (.lvm) among them.

Found out, not asked for: encoding (UTF-8 with or without BOM, UTF-16, Windows-1252), delimiter (tab ; , |
blanks), decimal point or comma, comment lines (# % //), lines before the header, a row of units under it or
units in it (``v [mm/s]``).
"""

import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from thsa_cosim.errors import RecordingError
from thsa_cosim.recordings.table import Choose, RawColumn, numeric, split_unit
from thsa_cosim.signals import FloatArray
from thsa_cosim.units import is_unit

_DELIMITERS = ("\t", ";", ",", "|", " ")
_COMMENTS = ("#", "%", "//")
_SPECIAL = {
    **dict.fromkeys(
        ("", "nan", "na", "n/a", "null", "none", "-", "--", "#n/a", "1.#qnan", "-1.#ind", "1.#ind"), np.nan
    ),
    **dict.fromkeys(("inf", "+inf", "1.#inf"), np.inf),
    **dict.fromkeys(("-inf", "-1.#inf"), -np.inf),
}
_NUMBER = {
    mark: re.compile(rf"[+-]?(\d+({re.escape(mark)}\d*)?|{re.escape(mark)}\d+)([eE][+-]?\d+)?")
    for mark in ".,"
}
_MOST_WORDS = 20
"""Lines of words under a table."""
_MOST_NUMBERED = 3
"""Rows of numbers above a table from which on they are no names."""
_HALF_DAY = re.compile(r"\s*([aApP])\.?[mM]\.?$")
_STAMP = re.compile(r"(\d{4}-\d\d-\d\d|\d{1,2}[./]\d{1,2}[./]\d{2,4})([ T]+\d{1,2}:\d\d.*)?|\d+:\d\d:\d\d.*")
_DAY = re.compile(r"(\d{1,2})[./](\d{1,2})[./](\d{4}|\d\d)(?:[ T]+(.*))?")


class _Dialect(NamedTuple):
    share: float  # of cells that are numbers
    delimiter: str
    decimal: str
    width: int
    leading: int  # the column that holds numbers most often


@dataclass(frozen=True)
class _Layout:
    delimiter: str
    decimal: str
    width: int
    header: list[str]
    units: list[str]
    first: int  # index of the first line with data
    step: tuple[float, float] | None = None  # LabVIEW without time column: (start, step) in s


def read(path: Path, choose: Choose) -> dict[str, RawColumn]:
    """Read the columns that ``choose`` picks.

    Raises
    ------
    RecordingError
        If the file is no text, holds no table with two columns of numbers or more, or a row is too long.
    """
    numbered = _lines(path)
    layout = _layout(path, numbered)
    rows = [(number, line) for number, line in numbered[layout.first :] if not line.startswith(_COMMENTS)]
    rows = _without_end(path, rows, layout)
    chosen = list(dict.fromkeys(choose([name for name in layout.header if name])))
    named = [[k for k, other in enumerate(layout.header) if other == name] for name in chosen]
    places = [k for places in named for k in places]
    found = dict(zip(places, _columns(path, rows, layout, places), strict=True))
    columns: dict[str, RawColumn] = {}
    for name, (k, *more) in zip(chosen, named, strict=True):
        column = _one([(place, found[place]) for place in (k, *more)])
        unit = layout.units[k] if k < len(layout.units) and layout.units[k] else split_unit(name)[1]
        time: FloatArray | None = None
        if layout.step is not None:
            time = layout.step[0] + layout.step[1] * np.arange(len(rows), dtype=np.float64)
        columns[name] = RawColumn(column.values, column.unit or unit, time, column.problem)
    return columns


def _one(columns: Sequence[tuple[int, RawColumn]]) -> RawColumn:
    """The column of a name that the header has once, or more often over the same numbers."""
    first = columns[0][1]
    for place, other in columns[1:]:
        if not np.array_equal(first.values, other.values, equal_nan=True) or first.problem != other.problem:
            places = f"columns {columns[0][0] + 1} and {place + 1}"
            return RawColumn(
                problem=f"is named twice in the header ({places}), over other numbers; rename one"
            )
    return first


def _lines(path: Path) -> list[tuple[int, str]]:
    """Return the numbered lines that are not blank."""
    content = path.read_bytes()
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        text = content.decode("utf-16", "replace")
    elif (
        len(content) > 200 and content[1:200:2].count(0) > 90 and 0 not in content[0:200:2]
    ):  # without its mark
        text = content.decode("utf-16-le", "replace")
    else:
        try:
            text = content.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = content.decode("cp1252", "replace")
    text = text.rstrip("\0")  # blocks that were allocated when the power went
    if "\0" in text:
        raise RecordingError(f"{path}: is binary, not a text table; check its format and ending.")
    lines = re.split(r"\r\n|\n|\r", text.replace("\u2212", "-"))
    return [(k, line) for k, line in enumerate(lines, start=1) if line.strip(" \t;,")]


def _without_end(path: Path, rows: list[tuple[int, str]], layout: _Layout) -> list[tuple[int, str]]:
    """Leave out a last line that was cut off, and words under the table; a second header is refused."""
    for number, line in rows:
        if line[:1] not in "0123456789+-.," and _split(line, layout.delimiter) == layout.header:
            raise RecordingError(
                f"{path}: line {number} holds the header again, so two recordings are joined; split the file there."
            )
    last = len(rows)
    while last > 1 and len(rows) - last < _MOST_WORDS:
        cells = _split(rows[last - 1][1], layout.delimiter)
        words = bool(cells) and not any(_is_number(cell, layout.decimal) for cell in cells)
        before = len(_split(rows[last - 2][1], layout.delimiter))
        cut = last == len(rows) and len(cells) < min(before, layout.width)
        if not (words and len(cells) < layout.width) and not cut:
            break
        last -= 1
    return rows[:last]


def _split(line: str, delimiter: str) -> list[str]:
    if delimiter == " ":
        return line.split()
    if '"' in line:
        cells = next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])
    else:
        cells = line.split(delimiter)
    return [cell.strip() for cell in cells]


def _is_number(cell: str, decimal: str) -> bool:
    return _NUMBER[decimal].fullmatch(cell) is not None


def _layout(path: Path, numbered: list[tuple[int, str]]) -> _Layout:
    lines = [line for _, line in numbered]
    if any(line.startswith("***End_of_Header***") for line in lines[:100]):
        return _labview_layout(path, lines)
    offset, forced = 0, None
    if lines and (match := re.fullmatch(r"sep=(.)", lines[0].strip().lower())):  # Excel's own hint
        offset, forced = 1, match[1]
    dialect = _dialect(path, lines[offset:], (forced,) if forced else _DELIMITERS)
    return _find_header(path, lines, offset, dialect)


def _dialect(path: Path, lines: Sequence[str], delimiters: Sequence[str]) -> _Dialect:
    """Return the dialect that makes most cells numbers."""
    body = [line for line in lines if not line.startswith(_COMMENTS)]
    # The header is short and the table long: the second half is data, a sample of it will do.
    half = body[len(body) // 2 :]
    sample = half[:: max(1, len(half) // 200)]
    quoted = any('"' in line for line in sample)
    best = _Dialect(0.0, "", "", 0, 0)
    # Semicolons and tabs are nothing but delimiters: what they part are cells, though their numbers be unreadable.
    sure = [d for d in delimiters if d in "\t;" and len({line.count(d) for line in body[:1] + sample}) == 1]
    sure = [d for d in sure if all(d in line for line in sample[:1])]
    for delimiter in sure[:1] or delimiters:
        rows = [_split(line, delimiter) for line in sample]
        width = Counter(map(len, rows)).most_common(1)[0][0] if rows else 0
        if width < 2:
            continue
        for decimal in ".,":
            if decimal == delimiter and not quoted:
                continue
            fitting = [[_is_number(cell, decimal) for cell in row] for row in rows if len(row) == width]
            share = sum(map(sum, fitting)) / sum(map(len, rows))
            if share > best.share:
                often = [sum(column) for column in zip(*fitting, strict=True)]
                best = _Dialect(share, delimiter, decimal, width, often.index(max(often)))
    if best.width == 0:
        raise RecordingError(
            f"{path}: holds no table of numbers with two columns or more; export it as text with a header row."
        )
    return best


def _find_header(path: Path, lines: Sequence[str], offset: int, dialect: _Dialect) -> _Layout:
    """Find the first row of data, the names above it and the units between."""
    delimiter, decimal, width = dialect.delimiter, dialect.decimal, dialect.width
    above: list[list[str]] = []
    first = len(lines)
    for k in range(offset, len(lines)):
        line = lines[k]
        comment = line.startswith(_COMMENTS)
        cells = _split(line.lstrip("#%/").strip() if comment else line, delimiter)
        fits = width - 1 <= len(cells) <= width
        if fits and not comment and _is_data(cells, dialect):
            first = k
            break
        if fits:
            above.append(cells)
    if first == len(lines):
        raise RecordingError(f"{path}: holds a header but no rows of numbers.")
    other = "." if decimal == "," else ","
    if sum(_are_numbers(cells, other) for cells in above) >= _MOST_NUMBERED:
        raise RecordingError(
            f"{path}: rows above row {first + 1} have the decimal sign {other!r}, those from there on {decimal!r};"
            " export it with one of them."
        )
    units = above.pop() if len(above) > 1 and _are_units(above[-1], decimal) else []
    header = above[-1] if above else [f"column {k + 1}" for k in range(width)]
    return _Layout(delimiter, decimal, width, header, [_bare(unit) for unit in units], first)


def _is_data(cells: Sequence[str], dialect: _Dialect) -> bool:
    """Return whether a row is no header: a number where numbers are, or nothing but numbers and blanks."""
    numbers = [_is_number(cell, dialect.decimal) for cell in cells]
    blank = [cell.lower() in _SPECIAL for cell in cells]
    plain = any(numbers) and all(n or b for n, b in zip(numbers, blank, strict=True))
    leading = dialect.leading < len(cells) and numbers[dialect.leading]
    return (plain or leading) and not _are_units(cells, dialect.decimal)


def _are_numbers(cells: Sequence[str], decimal: str) -> bool:
    """Return whether a row holds nothing but numbers with this decimal sign, and it at least once."""
    filled = [cell for cell in cells if cell.lower() not in _SPECIAL]
    return any(decimal in cell for cell in filled) and all(_is_number(cell, decimal) for cell in filled)


def _bare(unit: str) -> str:
    match = re.fullmatch(r"\[(.*)\]|\((.*)\)", unit)
    return (match[1] or match[2] or "1") if match else unit


def _are_units(cells: Sequence[str], decimal: str) -> bool:
    """Return whether a row is one of units: all of them units or blank, and not all of them numbers."""
    texts = [cell for cell in cells if cell not in ("", "-", "1")]
    return bool(texts) and all(not _is_number(t, decimal) and is_unit(_bare(t)) for t in texts)


def _labview_layout(path: Path, lines: Sequence[str]) -> _Layout:
    """Read the two header blocks of a LabVIEW measurement file (NI, "LVM file specification")."""
    ends = [k for k, line in enumerate(lines) if line.startswith("***End_of_Header***")]
    if len(ends) > 2:
        raise RecordingError(f"{path}: holds {len(ends) - 1} LabVIEW segments; export one segment per file.")
    meta: dict[str, list[str]] = {}
    for line in lines[: ends[-1]]:
        cells = line.split("\t" if "\t" in line else ",")
        meta.setdefault(cells[0].strip(), [cell.strip() for cell in cells[1:]])
    delimiter = "," if (meta.get("Separator") or ["Tab"])[0].lower().startswith("comma") else "\t"
    decimal = (
        ","
        if (meta.get("Decimal_Separator") or ["."])[0] == ""
        else (meta.get("Decimal_Separator") or ["."])[0]
    )
    start = ends[-1] + 1
    if start + 1 >= len(lines):
        raise RecordingError(f"{path}: holds a LabVIEW header but no data.")
    header = _split(lines[start], delimiter)
    columns = (meta.get("X_Columns") or ["One"])[0]
    if columns == "Multi":
        raise RecordingError(f"{path}: has one X column per channel; export it with a single X column.")
    stated = meta.get("Y_Unit_Label", [])
    channels = [name for name in header if name not in ("X_Value", "Comment")]
    by_name = dict(zip(channels, stated, strict=False)) | {"X_Value": "s"}
    implicit = None
    if columns == "No":
        x0, dx = (_first_number(path, meta, key, decimal) for key in ("X0", "Delta_X"))
        implicit = (x0, dx)
    units = [by_name.get(name, "") for name in header]
    return _Layout(delimiter, decimal, len(header), header, units, start + 1, implicit)


def _first_number(path: Path, meta: dict[str, list[str]], key: str, decimal: str) -> float:
    try:
        return float((meta.get(key) or [""])[0].replace(decimal, "."))
    except ValueError:
        raise RecordingError(
            f"{path}: has no time column and no number after {key!r} in its header."
        ) from None


def _columns(
    path: Path, rows: Sequence[tuple[int, str]], layout: _Layout, places: Sequence[int]
) -> list[RawColumn]:
    """Return the columns at ``places``."""
    width = max(layout.width, len(layout.header))
    for number, line in rows:
        if '"' not in line and layout.delimiter != " " and line.count(layout.delimiter) < width:
            continue
        if len(_split(line, layout.delimiter)) > width:
            raise RecordingError(
                f"{path}: line {number} has more cells than the header names; repair the file."
            )
    lines = [line for _, line in rows]
    # Where the comma is decimal, a point may be another decimal mark or part thousands: cell by cell says where it is.
    ambiguous = layout.decimal == "," and any("." in line for line in lines)
    if layout.decimal == "," and layout.delimiter != ",":
        lines = [line.replace(",", ".") for line in lines]
    if not ambiguous and (layout.decimal == "." or layout.delimiter != ","):
        try:
            table = np.loadtxt(
                lines,
                delimiter=None if layout.delimiter == " " else layout.delimiter,
                usecols=places,
                quotechar='"',
                comments=None,
                ndmin=2,
            )
        except ValueError:
            pass  # a cell that is blank or no number: find out which
        else:
            return [RawColumn(np.ascontiguousarray(column)) for column in table.T]
    cells = [_split(line, layout.delimiter) for _, line in rows]
    return [
        _column(
            [row[k] if k < len(row) else "" for row in cells], [number for number, _ in rows], layout.decimal
        )
        for k in places
    ]


def _column(cells: Sequence[str], numbers: Sequence[int], decimal: str) -> RawColumn:
    """Return numbers, or seconds since the first time stamp, or what stands in the way."""
    if cells and _STAMP.fullmatch(cells[0]):
        try:
            return _stamps(cells)
        except ValueError:
            pass
    values = np.empty(len(cells))
    for k, cell in enumerate(cells):
        if _is_number(cell, decimal):
            values[k] = float(cell.replace(decimal, "."))
        elif cell.lower() in _SPECIAL:
            values[k] = _SPECIAL[cell.lower()]
        else:
            return RawColumn(problem=f"is not numeric: {cell[:30]!r} on line {numbers[k]}")
    return RawColumn(values)


def _stamps(cells: Sequence[str]) -> RawColumn:
    if _DAY.fullmatch(cells[0]):
        return _dated(cells)
    if "-" in cells[0]:
        plain = [cell.removesuffix("Z").replace(",", ".") for cell in cells]
        return numeric(np.array(plain, dtype="datetime64[ns]"))
    return RawColumn(_past_midnight(_clock(cells)), unit="s")


def _clock(cells: Sequence[str]) -> FloatArray:
    """Seconds of the day of texts such as 09:41:22,000 or 9:41:22 PM; without seconds, they are 0."""
    halves = [_HALF_DAY.search(cell) for cell in cells]
    plain = [cell[: half.start()] if half else cell for cell, half in zip(cells, halves, strict=True)]
    parts = [[float(part.replace(",", ".")) for part in cell.split(":")] for cell in plain]
    clock = np.array([[*row, 0.0, 0.0][:3] for row in parts])
    for row, half in zip(clock, halves, strict=True):
        if half:  # 12 AM is midnight, 12 PM is noon
            row[0] = row[0] % 12.0 + (12.0 if half[1] in "pP" else 0.0)
    return np.asarray(clock @ np.array([3600.0, 60.0, 1.0]), dtype=np.float64)


def _past_midnight(seconds: FloatArray) -> FloatArray:
    """Add a day where the clock starts again."""
    return np.asarray(seconds + 86400.0 * np.concatenate(([0], np.cumsum(np.diff(seconds) < -43200.0))))


def _dated(cells: Sequence[str]) -> RawColumn:
    """Seconds since the first of dates such as 17.03.2026 09:41:22,000; the day comes first unless it cannot."""
    found = [_DAY.fullmatch(cell) for cell in cells]
    if not all(found):
        raise ValueError("not all of them are dates")
    rows = [m.groups() for m in found if m]
    first, second = (np.array([int(row[k]) for row in rows]) for k in (0, 1))
    # Over midnight a day follows the other, and no month.
    months_first = second.max() > 12 or (np.ptp(first) == 0 and np.ptp(second) == 1 and "/" in cells[0])
    day, month = (second, first) if months_first else (first, second)
    days_first = first.max() > 12 or (np.ptp(first) == 1 and np.ptp(second) == 0) or "/" not in cells[0]
    if months_first or days_first or (np.ptp(first) == 0 and np.ptp(second) == 0):
        years = [int(row[2]) + (2000 if len(row[2]) == 2 else 0) for row in rows]
        texts = [f"{y:04d}-{m:02d}-{d:02d}" for y, m, d in zip(years, month, day, strict=True)]
        days = np.array(texts, dtype="datetime64[D]").astype(np.int64)
        seconds = _clock([row[3] or "0:00:00" for row in rows]) + 86400.0 * (days - days[0])
        return RawColumn(np.asarray(seconds - seconds[0], dtype=np.float64), unit="s")
    return RawColumn(
        problem=f"does not say which is the day and which the month: {cells[0]!r}; write 2026-03-17"
    )
