"""Apache Parquet: columns with a ``unit`` entry in their field metadata, or in the name (``v [mm/s]``)."""

from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from thsa_cosim.recordings.arrow import to_numpy
from thsa_cosim.recordings.table import Choose, RawColumn, numeric, split_unit


def read(path: Path, choose: Choose) -> dict[str, RawColumn]:
    """Read the columns that ``choose`` picks; nulls become NaN, time stamps seconds since the first."""
    with pq.ParquetFile(path) as file:
        schema = file.schema_arrow
        chosen = list(dict.fromkeys(choose(schema.names)))
        table = file.read(columns=chosen)
    return {name: _column(table.column(name), schema.field(name)) for name in chosen}


def _column(values: pa.ChunkedArray, field: pa.Field) -> RawColumn:
    kind = field.type
    if pa.types.is_decimal(kind):
        values = values.cast(pa.float64())
    numeric_kind = pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind)
    if not (numeric_kind or pa.types.is_decimal(kind) or pa.types.is_temporal(kind)):
        return RawColumn(problem=f"is not numeric but {kind}")
    column = numeric(to_numpy(values))
    unit = (field.metadata or {}).get(b"unit", b"").decode("utf-8", "replace") or split_unit(field.name)[1]
    return RawColumn(column.values, column.unit or unit, problem=column.problem)
