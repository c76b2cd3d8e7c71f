"""MATLAB files: version 5 by SciPy, version 7.3 (HDF5) by h5py (extra ``mat73``).

Vectors are columns by their name, fields of structures ``log.speed``, columns of a matrix ``data(:,1)``.
"""

import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from thsa_cosim.errors import MissingExtraError
from thsa_cosim.recordings.table import Choose, RawColumn, numeric

_HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_WIDEST_MATRIX = 1000


def read(path: Path, choose: Choose) -> dict[str, RawColumn]:
    """Read the vectors that ``choose`` picks; the version is told by the file's signature."""
    with path.open("rb") as file:
        head = file.read(520)
    if _HDF5_SIGNATURE in (head[:8], head[512:520]):
        return _read_hdf5(path, choose)
    return _read_v5(path, choose)


def _read_v5(path: Path, choose: Choose) -> dict[str, RawColumn]:
    from scipy.io import loadmat

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # scipy warns about MATLAB objects, which are skipped here
        content = loadmat(path, squeeze_me=False, struct_as_record=True)
    found: dict[str, Any] = {}
    for name, value in content.items():
        if not name.startswith("__"):
            found.update(_flatten(name, value, depth=0))
    return {name: numeric(found[name]) for name in choose(list(found))}


def _flatten(name: str, value: Any, depth: int) -> Iterator[tuple[str, Any]]:
    array = np.asarray(value)
    if depth > 8:
        return
    if array.dtype.names and array.size == 1:
        for key in array.dtype.names:
            yield from _flatten(f"{name}.{key}", array[key].flat[0], depth + 1)
    elif array.dtype.kind in "biuf":
        yield from _vectors(name, array)


def _vectors(name: str, array: Any) -> Iterator[tuple[str, Any]]:
    """Yield a vector under its name, the columns of a matrix (rows are samples) as ``name(:,k)``."""
    if array.ndim == 2 and 1 in array.shape and array.size > 1:
        yield name, array.reshape(-1)
    elif array.ndim == 1 and array.size > 1:
        yield name, array
    elif array.ndim == 2 and 1 < array.shape[1] <= _WIDEST_MATRIX and array.shape[0] > 1:
        for k in range(array.shape[1]):
            yield f"{name}(:,{k + 1})", array[:, k]


def _read_hdf5(path: Path, choose: Choose) -> dict[str, RawColumn]:
    try:
        import h5py
    except ImportError:
        raise MissingExtraError("reading MAT 7.3", "mat73") from None
    found: dict[str, Any] = {}

    def visit(name: str, item: Any) -> None:
        numbers = isinstance(item, h5py.Dataset) and item.dtype.kind in "biuf"
        # HDF5 holds MATLAB's matrices transposed; text is stored as integers with a class attribute.
        if numbers and item.attrs.get("MATLAB_class", b"double") != b"char" and not name.startswith("#"):
            found.update(_vectors(name.replace("/", "."), np.asarray(item).T))

    with h5py.File(path, "r") as file:
        file.visititems(visit)
    return {name: numeric(found[name]) for name in choose(list(found))}
