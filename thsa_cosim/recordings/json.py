"""JSON: columns by name, or a list of samples, each an object; numbers beside them are constants of the whole file.

``{"kp": 100, "entries": [{"t": 0.0, "q": 0.1}, ...]}`` and ``{"kp": 100, "t": [0.0, ...], "q": [0.1, ...]}`` both hold
the columns t, q and kp; ``[{"t": 0.0, "q": 0.1}, ...]`` holds t and q.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from thsa_cosim.errors import RecordingError
from thsa_cosim.recordings.table import Choose, RawColumn, split_unit


def read(path: Path, choose: Choose) -> dict[str, RawColumn]:
    """Read the columns that ``choose`` picks; true and false are 1 and 0, a key that a sample lacks is NaN."""
    columns, constants = _parts(path, json.loads(path.read_text(encoding="utf-8-sig")))
    rows = max((len(c) for c in columns.values()), default=0)
    chosen = dict.fromkeys(choose([*columns, *(name for name in constants if name not in columns)]))
    return {
        name: _column(name, columns[name] if name in columns else [constants[name]] * rows) for name in chosen
    }


def _parts(path: Path, content: Any) -> tuple[dict[str, Sequence[Any]], dict[str, Any]]:
    """The columns of a file and its constants."""
    whole: Mapping[str, Any] = content if isinstance(content, dict) else {"samples": content}
    tables = [v for v in whole.values() if _is_table(v)]
    if len(tables) > 1:
        raise RecordingError(
            f"{path}: holds {len(tables)} lists of samples; write one file for each of them."
        )
    constants = {n: v for n, v in whole.items() if isinstance(v, int | float)}
    columns: dict[str, Sequence[Any]]
    if tables:
        names = dict.fromkeys(name for sample in tables[0] for name in sample)
        columns = {name: [sample.get(name) for sample in tables[0]] for name in names}
        return columns, constants
    columns = {n: v for n, v in whole.items() if isinstance(v, list)}
    lengths = {n: len(v) for n, v in columns.items()}
    if len(set(lengths.values())) > 1:
        said = ", ".join(f"{name!r} {length}" for name, length in list(lengths.items())[:4])
        raise RecordingError(f"{path}: its columns differ in length ({said}); write one file for each rate.")
    return columns, constants


def _is_table(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(sample, dict) for sample in value)


def _column(name: str, values: Sequence[Any]) -> RawColumn:
    if any(not (v is None or isinstance(v, int | float)) for v in values):
        return RawColumn(problem="is not numeric")
    numbers = np.array([np.nan if v is None else float(v) for v in values], dtype=np.float64)
    return RawColumn(numbers, split_unit(name)[1])
