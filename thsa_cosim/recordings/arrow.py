"""Arrow's columns as NumPy's arrays and back; Arrow's own ways import pandas, a sixth of a second."""

from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from thsa_cosim.signals import FloatArray

_FLOATS = {pa.float64(): np.float64, pa.float32(): np.float32}


def to_numpy(column: pa.ChunkedArray) -> NDArray[Any]:
    """The values (n,) of a column, in its own type; nulls as Arrow gives them."""
    kind = _FLOATS.get(column.type)
    if kind is None or column.null_count or column.num_chunks == 0:
        return np.asarray(column.to_numpy())
    parts = [_chunk(chunk, kind) for chunk in column.chunks]
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def _chunk(chunk: pa.Array, kind: Any) -> NDArray[Any]:
    values: NDArray[Any] = np.frombuffer(chunk.buffers()[1], dtype=kind)
    return values[chunk.offset : chunk.offset + len(chunk)]


def from_numpy(values: FloatArray) -> pa.Array:
    """A column of doubles (n,), whose NaN stay NaN."""
    packed = np.ascontiguousarray(values, dtype=np.float64)
    return pa.Array.from_buffers(pa.float64(), packed.size, [None, pa.py_buffer(packed)])
