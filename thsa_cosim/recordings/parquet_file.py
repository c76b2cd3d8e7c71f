"""Parquet files as NumPy's columns and back, by DuckDB, whose wheel has a third of pyarrow's size.

Arrow keeps what Parquet does not know (a column's unit, durations) as a schema of its own in the file's metadata;
nanoarrow reads that. DuckDB takes ``V`` for ``v``: columns are told apart by their place, never by its names.
"""

import base64
import binascii
import glob
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import duckdb
import nanoarrow as na
import numpy as np
from numpy.typing import NDArray

from thsa_cosim.recordings.table import Choose
from thsa_cosim.signals import FloatArray

_WHOLE = ("TINYINT", "SMALLINT", "INTEGER", "BIGINT", "UTINYINT", "USMALLINT", "UINTEGER", "UBIGINT")
_NUMBERS = (*_WHOLE, "BOOLEAN", "FLOAT", "DOUBLE", "DECIMAL")
_TIME_UNITS = {
    na.TimeUnit.SECOND: "s",
    na.TimeUnit.MILLI: "ms",
    na.TimeUnit.MICRO: "us",
    na.TimeUnit.NANO: "ns",
}
_KINDS = {"VARCHAR": "string", "BLOB": "binary"}


@dataclass(frozen=True, eq=False)
class ParquetColumn:
    """A column: ``kind`` in words, Arrow's ``metadata``, and ``values`` (n,): doubles with NaN for null,
    ``datetime64[ns]`` or ``timedelta64[ns]`` with NaT for null, None where the column is none of these.
    """

    kind: str
    metadata: Mapping[str, str]
    values: NDArray[Any] | None


def read_columns(path: Path, choose: Choose) -> dict[str, ParquetColumn]:
    """Read the columns that ``choose`` picks from the file's top-level names; ValueError for a damaged file."""
    with _duckdb() as database:
        source = _literally(path)
        names = _names(database, source)
        chosen = list(dict.fromkeys(choose(names)))
        described = database.execute(f"SELECT * FROM {_TABLE} LIMIT 0", [source]).description or []
        if len(described) != len(names):
            raise ValueError("its schema contradicts its columns")
        arrow = _arrow_fields(_metadata(database, source), len(names))
        places = [names.index(name) for name in chosen]
        kinds = [str(described[place][1]) for place in places]
        read = [_expression(str(described[p][0]), kind) for p, kind in zip(places, kinds, strict=True)]
        arrays: list[Any] = []
        if read:
            listed = ", ".join(f"{expression} AS c{k}" for k, expression in enumerate(read))
            arrays = list(database.execute(f"SELECT {listed} FROM {_TABLE}", [source]).fetchnumpy().values())
            stated = database.execute("SELECT num_rows FROM parquet_file_metadata(?)", [source]).fetchall()
            if [len(values) for values in arrays] != [stated[0][0]] * len(chosen):
                raise ValueError("it holds another number of rows than it states")
    columns = {}
    for name, place, kind, values in zip(chosen, places, kinds, arrays, strict=True):
        field = arrow[place] if arrow else None
        metadata = {
            k.decode(): v.decode("utf-8", "replace") for k, v in ((field and field.metadata) or {}).items()
        }
        columns[name] = ParquetColumn(_KINDS.get(kind, kind.lower()), metadata, _plain(values, kind, field))
    return columns


def read_metadata(path: Path) -> dict[str, str]:
    """The metadata of the whole file; ValueError for a damaged one."""
    with _duckdb() as database:
        return _metadata(database, _literally(path))


def write_columns(path: Path, columns: Mapping[str, FloatArray], metadata: Mapping[str, str]) -> None:
    """Write columns of doubles (n,) and the file's metadata; NaN becomes null.

    Of names that differ only in case all but the first get a number: write the names into the metadata as well.
    """
    table: dict[str, FloatArray] = {}
    for number, (name, values) in enumerate(columns.items()):
        taken = name.casefold() in {other.casefold() for other in table}
        table[f"{name} ({number})" if taken else name] = np.asarray(values, dtype=np.float64)
    facts = ", ".join(f"{_quoted(key)}: {_text(value)}" for key, value in metadata.items())
    with _duckdb() as database:
        database.register("written", table)
        try:
            to = _text(str(path.absolute()))
            database.execute(
                f"COPY (SELECT * FROM written) TO {to} (FORMAT parquet, KV_METADATA {{{facts}}})"
            )
        finally:
            database.unregister("written")


# A folder ``T=-30`` is no column.
_TABLE = "read_parquet(?, hive_partitioning = false)"


@contextmanager
def _duckdb() -> Iterator[duckdb.DuckDBPyConnection]:
    try:
        with _database().cursor() as connection:
            yield connection
    except duckdb.FatalException as error:  # the database counts as lost
        _database.cache_clear()
        raise ValueError(" ".join(str(error).split())) from None
    except duckdb.IOException as error:
        raise OSError(" ".join(str(error).split())) from None
    except duckdb.Error as error:
        raise ValueError(" ".join(str(error).split())) from None


@cache
def _database() -> duckdb.DuckDBPyConnection:
    """One database in memory, one thread, no temporary files, no extensions from the network."""
    return duckdb.connect(
        ":memory:",
        config={
            "threads": 1,
            "temp_directory": "",
            "autoinstall_known_extensions": False,
            "autoload_known_extensions": False,
            "python_enable_replacements": False,
        },
    )


def _literally(path: Path) -> str:
    return glob.escape(str(path.absolute()))


def _names(database: duckdb.DuckDBPyConnection, source: str) -> list[str]:
    """Names of the columns: of the tree of the schema, which is listed depth first, the root's own children."""
    rows = database.execute(
        "SELECT name, coalesce(num_children, 0) FROM parquet_schema(?)", [source]
    ).fetchall()
    names: list[str] = []
    inside = 0
    for name, children in rows[1:]:
        if inside == 0:
            names.append(str(name))
        else:
            inside -= 1
        inside += int(children)
    return names


def _metadata(database: duckdb.DuckDBPyConnection, source: str) -> dict[str, str]:
    rows = database.execute("SELECT key, value FROM parquet_kv_metadata(?)", [source]).fetchall()
    return {key.decode("utf-8", "replace"): value.decode("utf-8", "replace") for key, value in rows}


def _arrow_fields(metadata: Mapping[str, str], count: int) -> Sequence[Any]:
    """Arrow's field for each column, or none where the file has no schema of Arrow's."""
    packed = metadata.get("ARROW:schema")
    if packed is None:
        return ()
    try:
        fields = list(na.ArrayStream.from_readable(base64.b64decode(packed, validate=True)).schema.fields)
    except (ValueError, RuntimeError, OSError, binascii.Error) as error:
        raise ValueError(f"its Arrow schema cannot be read: {error}") from None
    if len(fields) != count:
        raise ValueError("its Arrow schema has other columns than the file")
    return fields


def _expression(name: str, kind: str) -> str:
    """SQL that gives a column as doubles or as ns; the number of its rows where it is neither."""
    if kind.partition("(")[0] in _NUMBERS:
        # Durations are whole numbers here, and stay whole.
        return _quoted(name) if kind == "BIGINT" else f"CAST({_quoted(name)} AS DOUBLE)"
    if kind == "DATE":
        return f"epoch_ns(CAST({_quoted(name)} AS TIMESTAMP))"
    return f"epoch_ns({_quoted(name)})" if kind.startswith("TIMESTAMP") else "NULL::DOUBLE"


def _plain(values: Any, kind: str, field: Any) -> NDArray[Any] | None:
    if kind == "DATE" or kind.startswith("TIMESTAMP"):
        return np.asarray(np.ma.filled(values, np.iinfo(np.int64).min)).view("datetime64[ns]")
    if kind.partition("(")[0] not in _NUMBERS:
        return None
    if field is not None and field.type == na.Type.DURATION:
        whole = np.ma.filled(values, np.iinfo(np.int64).min)
        return np.asarray(whole).view(f"timedelta64[{_TIME_UNITS[field.unit]}]").astype("timedelta64[ns]")
    return np.asarray(np.ma.filled(values.astype(np.float64), np.nan))


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"'


def _text(value: str) -> str:
    return "'" + value.replace("'", "''") + "'"
