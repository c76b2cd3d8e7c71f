"""The durable table of evaluated vectors.

A CSV file that grows by whole rows: ``stage, index, <parameters>, cost, cost.<term>..., status, reason``.
Numbers are written so that reading gives the same bits (``pandas.read_csv(..., float_precision="round_trip")``).
A search with a fixed seed that asks here before it simulates repeats an interrupted study exactly: known
vectors are looked up, the rest is simulated, and the end is that of the undisturbed run.
"""

import contextlib
import csv
import io
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from thsa_cosim.batch.outcome import Status
from thsa_cosim.closing import Closing
from thsa_cosim.errors import InputError


@dataclass(frozen=True)
class JournalRow:
    """One evaluated vector."""

    stage: str
    """What the vector belongs to, e.g. a temperature point; vectors are looked up per stage."""
    index: int
    """Number of the evaluation within its stage."""
    values: tuple[float, ...]
    """(parameters,) in the order of ``Journal.names``."""
    cost: float
    terms: tuple[float, ...]
    """(terms,) the named parts of the cost, in the order of ``Journal.terms``."""
    status: Status = Status.OK
    reason: str = ""


class Journal(Closing):
    """Append-only table of evaluated vectors; a context manager.

    Rows are in the file, and on the disk, when ``append`` returns. A last line that a kill or a power
    failure has torn is dropped when the journal is opened again.
    """

    def __init__(self, path: Path, names: Sequence[str], terms: Sequence[str], file: BinaryIO) -> None:
        """``Journal.open`` is the way in."""
        self.path = path
        self.names, self.terms = tuple(names), tuple(terms)
        self._file = file
        self._known: dict[tuple[str, tuple[float, ...]], JournalRow] = {}
        self._rows: list[JournalRow] = []

    @classmethod
    def open(cls, path: Path | str, names: Sequence[str], terms: Sequence[str] = ()) -> "Journal":
        """Open or create the journal ``path`` of vectors over ``names`` with cost ``terms``.

        Raises
        ------
        InputError
            If the file is another study's journal, is damaged before its last line, or is in use.
        """
        path = Path(path)
        path.parent.mkdir(parents=True, exist_ok=True)
        is_new = not path.exists()
        file = path.open("a+b", buffering=0)
        try:
            _lock(path, file)
            journal = cls(path, names, terms, file)
            journal._load()
        except BaseException:
            file.close()
            raise
        if is_new:
            _sync_folder(path.parent)
        return journal

    @property
    def rows(self) -> tuple[JournalRow, ...]:
        """All rows in the order in which they were appended."""
        return tuple(self._rows)

    def __len__(self) -> int:
        return len(self._rows)

    def known(self, stage: str, values: Sequence[float]) -> JournalRow | None:
        """Return the row of exactly these values (bit for bit), or None."""
        return self._known.get((stage, tuple(values)))

    def append(self, rows: Sequence[JournalRow]) -> None:
        """Write rows durably, all in one piece; they are on the disk when this returns."""
        if not rows:
            return
        for row in rows:
            if len(row.values) != len(self.names) or len(row.terms) != len(self.terms):
                raise ValueError(
                    f"{self.path} takes {len(self.names)} values and {len(self.terms)} terms, "
                    f"not {len(row.values)} and {len(row.terms)}."
                )
        self._write("".join(_line(_cells(row)) for row in rows))
        for row in rows:
            self._remember(row)

    def close(self) -> None:
        """Close the file and release its lock."""
        self._file.close()

    # -- file -----------------------------------------------------------------------------------------
    @property
    def _header(self) -> list[str]:
        return ["stage", "index", *self.names, "cost", *(f"cost.{t}" for t in self.terms), "status", "reason"]

    def _write(self, text: str) -> None:
        data = memoryview(text.encode())
        while data:
            data = data[self._file.write(data) :]
        os.fsync(self._file.fileno())

    def _load(self) -> None:
        self._file.seek(0)
        content = self._file.read()
        lines = content.split(b"\n")
        torn = lines.pop()  # what follows the last newline: nothing, or a torn line
        end = len(content) - len(torn)
        if not lines:
            self._file.truncate(0)
            self._write(_line(self._header))
            return
        if lines[0].decode("utf-8", "replace") != _line(self._header).rstrip("\n"):
            raise InputError(
                f"{self.path} is the journal of a study with other parameters or cost terms; "
                "choose another output folder."
            )
        for number, line in enumerate(lines[1:], start=2):
            row = _parse(line, len(self.names), len(self.terms))
            if row is not None:
                self._remember(row)
            elif number == len(lines):
                end -= len(line) + 1
            else:
                raise InputError(f"{self.path}, line {number} is damaged; delete that line and run again.")
        if end < len(content):
            self._file.truncate(end)
            os.fsync(self._file.fileno())

    def _remember(self, row: JournalRow) -> None:
        self._rows.append(row)
        self._known.setdefault((row.stage, row.values), row)


@dataclass(frozen=True)
class JournalTable:
    """A journal as somebody else sees it: the parameters' and terms' names, and the whole rows so far."""

    names: tuple[str, ...]
    terms: tuple[str, ...]
    rows: tuple[JournalRow, ...]
    in_use: bool
    """A study is writing it."""


def read_journal(path: Path) -> JournalTable:
    """Read a journal that another process may be writing; a torn last line is left out.

    Raises InputError if the file is no journal.
    """
    with path.open("rb") as file:
        in_use = _is_locked(file)
        lines = file.read().split(b"\n")[:-1]
    header = next(csv.reader([lines[0].decode("utf-8", "replace")]), []) if lines else []
    costs = [k for k, name in enumerate(header) if name == "cost"]
    if lines and (header[:2] != ["stage", "index"] or header[-2:] != ["status", "reason"] or not costs):
        raise InputError(f"{path} is no journal of a study; delete it, or choose another folder.")
    # Of columns with this name the last one is the cost: a parameter may be called so, a term is cost.<term>.
    names, terms = header[2 : costs[-1]] if costs else [], header[costs[-1] + 1 : -2] if costs else []
    parsed = (_parse(line, len(names), len(terms)) for line in lines[1:])
    rows = tuple(row for row in parsed if row is not None)
    return JournalTable(tuple(names), tuple(t.removeprefix("cost.") for t in terms), rows, in_use)


def _is_locked(file: BinaryIO) -> bool:
    """Whether another process holds the journal open for writing (where the system has flock)."""
    try:
        import fcntl
    except ImportError:
        return False
    try:
        fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    fcntl.flock(file, fcntl.LOCK_UN)
    return False


def _parse(line: bytes, names: int, terms: int) -> JournalRow | None:
    """A row of ``names`` values and ``terms`` cost terms; None if the line is none."""
    try:
        (cells,) = csv.reader([line.decode()], strict=True)
        if len(cells) != names + terms + 5:
            return None
        numbers = [float(cell) for cell in cells[2 : names + terms + 3]]
        return JournalRow(
            stage=cells[0],
            index=int(cells[1]),
            values=tuple(numbers[:names]),
            cost=numbers[names],
            terms=tuple(numbers[names + 1 :]),
            status=Status(cells[-2]),
            reason=cells[-1],
        )
    except (ValueError, csv.Error):
        return None


def _cells(row: JournalRow) -> list[str]:
    numbers = [_number(x) for x in (*row.values, row.cost, *row.terms)]
    # One row is one line, so that a torn row is a torn line.
    return [
        " ".join(row.stage.split()),
        str(row.index),
        *numbers,
        str(row.status),
        " ".join(row.reason.replace("\0", " ").split()),
    ]


def _number(value: float) -> str:
    """Shortest text that reads back as the same float; nan and inf as pandas reads them."""
    value = float(value)
    return repr(value) if math.isfinite(value) else str(value)


def _line(cells: Sequence[str]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(cells)
    return text.getvalue()


def _lock(path: Path, file: BinaryIO) -> None:
    """Keep a second process from writing the same journal (where the system has flock)."""
    try:
        import fcntl
    except ImportError:
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise InputError(f"{path} is in use by another run; wait for it or choose another folder.") from None
    except OSError:
        pass  # some network file systems have no locks


def _sync_folder(folder: Path) -> None:
    """Make a new file's name durable."""
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
