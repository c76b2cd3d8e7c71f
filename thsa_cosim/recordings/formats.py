"""The file formats of recordings: which reader a file's ending asks for, and the columns that it loads."""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from pathlib import Path

from thsa_cosim.errors import RecordingError, ThsaCosimError, did_you_mean, did_you_mean_path
from thsa_cosim.recordings import foreign
from thsa_cosim.recordings.table import Choose, RawColumn, resolve

SUFFIXES: Mapping[str, str] = {
    **dict.fromkeys((".csv", ".txt", ".tsv", ".dat", ".asc", ".lvm"), "csv"),
    **dict.fromkeys((".parquet", ".pq"), "parquet"),
    **dict.fromkeys((".mf4", ".mdf"), "mf4"),
    ".mat": "mat",
    ".json": "json",
    ".tdms": "tdms",
}
"""Reader module per file name ending."""


def column_names(path: Path | str) -> tuple[str, ...]:
    """Return the names of a file's columns; RecordingError as :func:`read_recording`."""
    names: list[str] = []

    def note(found: Sequence[str]) -> Sequence[str]:
        names.extend(found)
        return ()

    _load(Path(path), note)
    return tuple(names)


def load_columns(path: Path | str) -> dict[str, RawColumn]:
    """Return all columns of a file as it holds them; RecordingError as :func:`read_recording`."""
    return _load(Path(path), lambda names: names)[0]


def load_named(path: Path, wanted: Sequence[str]) -> tuple[dict[str, RawColumn], str]:
    """Return the columns of numbers that are asked for, under the names by which they are asked for, and the file's
    SHA-256; RecordingError as :func:`read_recording`.
    """
    full: dict[str, str] = {}

    def choose(names: Sequence[str]) -> list[str]:
        full.update({w: resolve(path, names, w) for w in wanted})
        return list(dict.fromkeys(full.values()))

    loaded, sha256 = _load(path, choose)
    for asked, key in full.items():
        if problem := loaded[key].problem:
            raise RecordingError(f"{path}: column {asked!r} {problem}; use a column of numbers.")
    return {asked: loaded[key] for asked, key in full.items()}, sha256


def _load(path: Path, choose: Choose) -> tuple[dict[str, RawColumn], str]:
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        near = "" if path.exists() else did_you_mean_path(path)
        hint = near or did_you_mean(suffix, SUFFIXES) or f" Known endings: {', '.join(SUFFIXES)}."
        raise RecordingError(f"{path}: file ending {suffix!r} is not a known recording format.{hint}")
    if path.exists() and not path.is_file():  # a pipe would wait for ever, a device has no end
        raise RecordingError(f"{path}: cannot be read (it is a folder, pipe or device); name a file.")
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise RecordingError(f"{path}: no such file; check the path.{did_you_mean_path(path)}") from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise RecordingError(f"{path}: cannot be read ({reason}).") from None
    if not content:
        raise RecordingError(f"{path}: is empty; record or export it again.")
    try:
        return _read(SUFFIXES[suffix], path, choose), hashlib.sha256(content).hexdigest()
    except ThsaCosimError:
        raise
    except Exception as error:  # the parsers raise anything on a damaged file
        reason = " ".join(str(error).split())[:160] or type(error).__name__
        raise RecordingError(
            f"{path}: is no readable {SUFFIXES[suffix]} file ({reason.rstrip('.')}); export it again."
        ) from None


def _read(format_: str, path: Path, choose: Choose) -> dict[str, RawColumn]:
    if format_ in foreign.FORMATS:
        return foreign.read(format_, path, choose)
    read: Callable[[Path, Choose], dict[str, RawColumn]]
    read = import_module(f"thsa_cosim.recordings.{format_}").read
    return read(path, choose)
