"""Apache Parquet: columns with a ``unit`` entry in their field metadata, or in the name (``v [mm/s]``)."""

from pathlib import Path

from thsa_cosim.recordings.parquet_file import ParquetColumn, read_columns
from thsa_cosim.recordings.table import Choose, RawColumn, numeric, split_unit


def read(path: Path, choose: Choose) -> dict[str, RawColumn]:
    """Read the columns that ``choose`` picks; nulls become NaN, time stamps seconds since the first."""
    return {name: _column(name, found) for name, found in read_columns(path, choose).items()}


def _column(name: str, found: ParquetColumn) -> RawColumn:
    if found.values is None:
        return RawColumn(problem=f"is not numeric but {found.kind}")
    column = numeric(found.values)
    unit = found.metadata.get("unit", "") or split_unit(name)[1]
    return RawColumn(column.values, column.unit or unit, problem=column.problem)
