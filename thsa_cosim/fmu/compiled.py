"""The communication loop in machine code: numba over the FMU's own function pointers.

Addresses are arguments, so one compiled loop serves every FMU and is kept on disk between processes.
``stepping.advance_python`` is the reference that it equals bit for bit.
"""
# mypy: ignore-errors
# numba compiles these functions from its own signatures, which mypy cannot follow.

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import carray, cfunc, njit, types
from numba.core import config
from numba.extending import intrinsic

_INT = ir.IntType(64)
_DOUBLE = ir.DoubleType()
_STATUS = ir.IntType(32)


def _function(*arguments: ir.Type) -> ir.FunctionType:
    return ir.FunctionType(_STATUS, arguments)


_ACCESS2 = _function(_INT, _INT, _INT, _INT)
_ACCESS3 = _function(_INT, _INT, _INT, _INT, _INT)
_STEP2 = _function(_INT, _DOUBLE, _DOUBLE, _STATUS)
_STEP3 = _function(_INT, _DOUBLE, _DOUBLE, _STATUS, _INT, _INT, _INT, _INT)


def _call(builder: Any, address: Any, prototype: ir.FunctionType, arguments: Any) -> Any:
    return builder.call(builder.inttoptr(address, prototype.as_pointer()), arguments)


@intrinsic
def _access2(_context, address, handle, references, count, values):
    """fmi2SetReal and its kin; with orders in place of values and so on, see _access3."""
    signature = types.int32(types.int64, types.int64, types.int64, types.int64, types.int64)

    def generate(_target, builder, _signature, arguments):
        return _call(builder, arguments[0], _ACCESS2, arguments[1:])

    return signature, generate


@intrinsic
def _access3(_context, address, handle, references, count, values, size):
    """fmi3SetFloat64 and its kin, and fmi2SetRealInputDerivatives, which takes five arguments too."""
    signature = types.int32(*(types.int64,) * 6)

    def generate(_target, builder, _signature, arguments):
        return _call(builder, arguments[0], _ACCESS3, arguments[1:])

    return signature, generate


@intrinsic
def _step2(_context, address, handle, time, step):
    """fmi2DoStep."""
    signature = types.int32(types.int64, types.int64, types.float64, types.float64)

    def generate(_target, builder, _signature, arguments):
        return _call(builder, arguments[0], _STEP2, [*arguments[1:], _STATUS(1)])

    return signature, generate


@intrinsic
def _step3(_context, address, handle, time, step, flags, last):
    """fmi3DoStep; ``flags`` is the address of three bytes, ``last`` of one double."""
    signature = types.int32(types.int64, types.int64, types.float64, types.float64, types.int64, types.int64)

    def generate(_target, builder, _signature, arguments):
        address, handle, time, step, flags, last = arguments
        event, terminate, early = flags, builder.add(flags, _INT(1)), builder.add(flags, _INT(2))
        return _call(
            builder, address, _STEP3, [handle, time, step, _STATUS(1), event, terminate, early, last]
        )

    return signature, generate


@intrinsic
def _as_pointer(_context, address):
    signature = types.voidptr(types.int64)

    def generate(target, builder, signature, arguments):
        return builder.inttoptr(arguments[0], target.get_value_type(signature.return_type))

    return signature, generate


@contextmanager
def _cache_folder() -> Iterator[bool]:
    """Let numba keep compiled code in the user's cache folder; yields whether it can be written."""
    base = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME")
    folder = Path(base).expanduser() if base else Path("~/.cache").expanduser()
    folder = folder / "thsa-cosim" / f"numba-{numba.__version__}"
    before = config.CACHE_DIR
    try:
        folder.mkdir(parents=True, exist_ok=True)
        usable = os.access(folder, os.W_OK | os.X_OK)
    except OSError:
        usable = False
    try:
        if usable:
            config.CACHE_DIR = str(folder)
        yield usable
    finally:
        config.CACHE_DIR = before


def _compile(decorate: Callable[..., Callable[[Any], Any]], signature: Any, **options: Any) -> Any:
    """Compile with the disk cache, and without where the cache cannot be used or is damaged."""

    def wrap(function: Any) -> Any:
        with _cache_folder() as usable:
            if usable:
                try:
                    return decorate(signature, cache=True, **options)(function)
                except Exception:  # a broken or foreign cache must never stop a study
                    pass
            return decorate(signature, **options)(function)

    return wrap


_TABLE = types.Array(types.int64, 2, "C", readonly=False)
_VECTOR = types.Array(types.float64, 1, "C")
_INTS = types.Array(types.int64, 1, "C")


@_compile(
    njit,
    types.Tuple((types.int64, types.int64, types.int64))(
        types.int64,  # FMI major version
        types.int64,  # handle
        types.int64,  # address of doStep
        _VECTOR,  # times
        _VECTOR,  # steps
        _TABLE,  # sets
        _INTS,  # slopes
        _TABLE,  # ends
        _TABLE,  # gets
        types.Array(types.float64, 2, "C"),  # floats
        types.Array(types.uint8, 1, "C"),  # flags
        _VECTOR,  # last
        _VECTOR,  # progress
    ),
    nogil=True,
)
def advance(version, handle, do_step, times, steps, sets, slopes, ends, gets, floats, flags, last, progress):
    """Step through ``times``; same contract as ``stepping.advance_python``."""
    flags_address = flags.ctypes.data
    last_address = last.ctypes.data
    for k in range(len(steps)):
        progress[1] = times[k]
        for i in range(len(sets)):
            values = sets[i, 3] + k * sets[i, 4]
            if version == 2:
                code = _access2(sets[i, 0], handle, sets[i, 1], sets[i, 2], values)
            else:
                code = _access3(sets[i, 0], handle, sets[i, 1], sets[i, 2], values, sets[i, 2])
            if code > 1 or code < 0:
                return k, 1, code
        if slopes[0] != 0:
            values = slopes[4] + k * slopes[5]
            code = _access3(slopes[0], handle, slopes[1], slopes[2], slopes[3], values)
            if code > 1 or code < 0:
                return k, 2, code
        progress[2] = k
        if version == 2:
            code = _step2(do_step, handle, times[k], steps[k])
        else:
            flags[1] = 0
            last[0] = np.nan
            code = _step3(do_step, handle, times[k], steps[k], flags_address, last_address)
        if code > 1 or code < 0:
            return k, 3, code
        if version == 3:
            if flags[1] != 0:
                return k, 7, 0
            if last[0] < times[k] + 0.999 * steps[k]:
                return k, 8, 0
        for i in range(len(ends)):
            values = ends[i, 3] + (k + 1) * ends[i, 4]
            if version == 2:
                code = _access2(ends[i, 0], handle, ends[i, 1], ends[i, 2], values)
            else:
                code = _access3(ends[i, 0], handle, ends[i, 1], ends[i, 2], values, ends[i, 2])
            if code > 1 or code < 0:
                return k, 4, code
        for i in range(len(gets)):
            values = gets[i, 3] + (k + 1) * gets[i, 4]
            if version == 2:
                code = _access2(gets[i, 0], handle, gets[i, 1], gets[i, 2], values)
            else:
                code = _access3(gets[i, 0], handle, gets[i, 1], gets[i, 2], values, gets[i, 2])
            if code > 1 or code < 0:
                return k, 5, code
        for i in range(floats.shape[1]):
            if not np.isfinite(floats[k + 1, i]):
                return k, 6, i
    return len(steps), 0, 0


@_compile(
    cfunc,
    types.void(
        types.voidptr,
        types.float64,
        types.uint8,
        types.uint8,
        types.uint8,
        types.uint8,
        types.int64,
        types.int64,
    ),
)
def intermediate_update(
    environment, time, set_requested, _get_allowed, _step_finished, _can_return_early, early, _early_time
):
    """fmi3IntermediateUpdateCallback: set u(time); ``environment`` is laid out by ``intermediate``."""
    if early != 0:
        carray(_as_pointer(early), 1, dtype=np.uint8)[0] = 0
    block = carray(environment, 9, dtype=np.int64)
    progress = carray(_as_pointer(block[7]), 3, dtype=np.float64)
    if set_requested == 0 or progress[0] != 4.0:
        return
    k = int(progress[2])
    count = block[3]
    offset = time - carray(_as_pointer(block[8] + 8 * k), 1, dtype=np.float64)[0]
    values = carray(_as_pointer(block[4] + k * block[6]), count, dtype=np.float64)
    slopes = carray(_as_pointer(block[5] + k * block[6]), count, dtype=np.float64)
    scratch = np.empty(count)
    for i in range(count):
        scratch[i] = values[i] + slopes[i] * offset
    _access3(block[0], block[1], block[2], count, scratch.ctypes.data, count)
