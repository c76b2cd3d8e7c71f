"""ASAM MDF 4 (and 3): channels with unit and time, by asammdf (extra ``mf4``)."""

import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from thsa_cosim.errors import MissingExtraError, RecordingError, ThsaCosimError
from thsa_cosim.recordings.table import Choose, RawColumn, numeric, split_unit


def read(path: Path, choose: Choose) -> dict[str, RawColumn]:
    """Read the channels that ``choose`` picks, each with the time axis of its group.

    A name that several groups use is listed once per group, as ``group/name`` with the group's number.
    """
    try:
        from asammdf import MDF
    except ImportError:
        raise MissingExtraError("reading MF4", "mf4") from None
    reason = ""
    with _quiet_destructor():
        try:
            # Opened here, because asammdf leaves the file open when it gives up.
            with path.open("rb") as stream, MDF(stream) as file:
                return _read(file, choose)
        except ThsaCosimError:
            raise
        except Exception as error:  # a damaged file makes asammdf raise anything
            reason = " ".join(str(error).split())[:160] or type(error).__name__
        gc.collect()
    raise RecordingError(f"{path}: is no readable MDF file ({reason.rstrip('.')}); export it again.")


def _read(file: Any, choose: Choose) -> dict[str, RawColumn]:
    masters = {(group, index) for group, index in file.masters_db.items()}
    places: dict[str, tuple[int, int]] = {}
    for name, found in file.channels_db.items():
        entries = [place for place in found if place not in masters]
        for group, index in entries:
            places[name if len(entries) == 1 else f"{group}/{name}"] = (group, index)
    return {name: _column(file, *places[name]) for name in choose(list(places))}


@contextmanager
def _quiet_destructor() -> Iterator[None]:
    """Keep the traceback to itself that asammdf's half-built object prints from its destructor."""
    hook = sys.unraisablehook
    sys.unraisablehook = lambda unraisable: None
    try:
        yield
    finally:
        sys.unraisablehook = hook


def _column(file: Any, group: int, index: int) -> RawColumn:
    signal = file.get(group=group, index=index)
    column = numeric(signal.samples)
    if column.problem:
        return column
    unit = (signal.unit or "").strip() or split_unit(signal.name)[1]
    time = np.ascontiguousarray(signal.timestamps, dtype=np.float64)
    return RawColumn(column.values, unit, time)
