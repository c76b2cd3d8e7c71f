"""Signals in the study folder: ``signals/<role>/<recording>.parquet``, measured beside simulated.

Columns: ``time_s``, then ``<channel>.<variant>`` in the channel's unit; variants are ``measured`` and ``simulated``,
or what else was compared (``before``, ``after``). The file's metadata hold, as JSON, ``units`` (channel → unit),
``variants`` and ``columns``. ``pandas.read_parquet`` reads the columns, ``read_signals`` both.
"""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from thsa_cosim.errors import InputError
from thsa_cosim.recordings.parquet_file import read_columns, read_metadata, write_columns
from thsa_cosim.signals import FloatArray, Signals

FOLDER = "signals"
TIME = "time_s"


@dataclass(frozen=True, eq=False)
class SignalFile:
    """Signals of one recording: ``channels`` → variant → (n,), over ``time`` (n,) in s."""

    role: str
    name: str
    time: FloatArray
    channels: Mapping[str, Mapping[str, FloatArray]]
    units: Mapping[str, str]


def file_name(text: str) -> str:
    """A name that is safe in any file system, from text that comes out of a user's file."""
    return re.sub(r"[^\w.+-]+", "_", text).strip("._") or "unnamed"


def write_signals(folder: Path, role: str, name: str, variants: Mapping[str, Signals]) -> Path:
    """Write ``variants`` (over the first one's time) to the study folder; return the file's path.

    A variant with a coarser time axis is interpolated; beyond its end it has no value.
    """
    first = next(iter(variants.values()))
    columns: dict[str, FloatArray] = {TIME: first.time}
    units: dict[str, str] = {}
    for variant, signals in variants.items():
        on_samples = signals if signals.time is first.time else signals.resample(first.time)
        beyond = first.time > signals.time[-1] * (1.0 + 1e-12) + 1e-9
        for channel in signals.names:
            columns[f"{channel}.{variant}"] = np.where(beyond, np.nan, on_samples[channel])
            units[channel] = signals.units[channel]
    facts = {"units": json.dumps(units), "variants": json.dumps(list(variants)), "name": name, "role": role}
    facts["columns"] = json.dumps(list(columns))
    path = folder / FOLDER / file_name(role) / f"{file_name(name)}.parquet"
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(".part")
    write_columns(partial, columns, facts)
    partial.replace(path)
    return path


def read_signals(path: Path) -> SignalFile:
    """Read what ``write_signals`` wrote; InputError for any other file."""
    try:
        metadata = read_metadata(path)
        facts = _facts(path, metadata)
        read = read_columns(path, lambda names: names)
        names = json.loads(metadata.get("columns", "null")) or list(read)
        columns = {
            name: np.asarray(column.values, dtype=np.float64)
            for name, column in zip(names, read.values(), strict=True)
        }
        time = columns.pop(TIME)
    except (OSError, KeyError, ValueError) as error:
        reason = " ".join(str(error).split())[:120]
        raise InputError(
            f"{path} holds no signals of a study ({reason}); repeat the study's command."
        ) from None
    channels: dict[str, dict[str, FloatArray]] = {}
    # Both may hold dots; without the list of variants the last dot parts them.
    variants = sorted(facts.variants, key=len, reverse=True)
    for column, values in columns.items():
        variant = next((v for v in variants if column.endswith(f".{v}")), column.rpartition(".")[2])
        channel = column.removesuffix(f".{variant}")
        channels.setdefault(channel, {})[variant] = values
    return SignalFile(facts.role, facts.name, time, channels, facts.units)


@dataclass(frozen=True)
class _Facts:
    """What the metadata of a signal file say."""

    role: str
    name: str
    units: dict[str, str]
    variants: list[str]


def _facts(path: Path, found: Mapping[str, str]) -> _Facts:
    return _Facts(
        role=found.get("role", path.parent.name),
        name=found.get("name", path.stem),
        units=json.loads(found.get("units", "{}")),
        variants=json.loads(found.get("variants", "[]")),
    )


def signal_units(folder: Path) -> dict[str, str]:
    """Unit by channel over all signal files of a study folder."""
    units: dict[str, str] = {}
    for path in signal_paths(folder):
        units.update(_facts(path, read_metadata(path)).units)
    return units


def signal_paths(folder: Path) -> list[Path]:
    """The signal files of a study folder: fitted before held-out recordings, each in order of their names."""
    return sorted((folder / FOLDER).glob("*/*.parquet"))
