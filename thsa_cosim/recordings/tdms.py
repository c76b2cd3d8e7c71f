"""NI TDMS: channels with their ``unit_string`` and waveform timing, by npTDMS (extra ``tdms``)."""

from pathlib import Path
from typing import Any

import numpy as np

from thsa_cosim.errors import MissingExtraError
from thsa_cosim.recordings.table import Choose, RawColumn, numeric, split_unit
from thsa_cosim.signals import FloatArray

_UNIT_PROPERTIES = ("unit_string", "NI_UnitDescription", "unit", "Unit")


def read(path: Path, choose: Choose) -> dict[str, RawColumn]:
    """Read the channels (``group/channel``) that ``choose`` picks; waveform channels carry their own time."""
    try:
        from nptdms import TdmsFile
    except ImportError:
        raise MissingExtraError("reading TDMS", "tdms") from None
    # Opened here, because npTDMS leaves the file open when it gives up.
    with path.open("rb") as stream, TdmsFile.open(stream) as file:
        channels = {f"{g.name}/{c.name}": c for g in file.groups() for c in g.channels()}
        return {name: _column(channels[name]) for name in choose(list(channels))}


def _column(channel: Any) -> RawColumn:
    column = numeric(channel[:])
    if column.problem:
        return column
    unit = next(
        (str(channel.properties[p]).strip() for p in _UNIT_PROPERTIES if channel.properties.get(p)), None
    )
    step = channel.properties.get("wf_increment")
    time: FloatArray | None = None
    if step:
        start = float(channel.properties.get("wf_start_offset") or 0.0)
        time = start + float(step) * np.arange(column.values.size, dtype=np.float64)
    return RawColumn(column.values, column.unit or unit or split_unit(channel.name)[1], time)
