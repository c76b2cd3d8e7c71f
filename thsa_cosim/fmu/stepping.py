"""Co-Simulation of FMI 2.0 and 3.0: set inputs, do a step, get outputs.

``Tables`` holds the addresses and buffers of one experiment (``plan.Plan``); ``step_through`` runs it. Two
loops do the same calls in the same order: machine code (``compiled.advance``) and ``advance_python``, the
reference, which it equals bit for bit.
"""

import copy
import ctypes
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.errors import ParameterError
from thsa_cosim.fmu.failure import SimulationFailure, Status
from thsa_cosim.fmu.fmi2 import Fmi2Instance
from thsa_cosim.fmu.instance import Channel, Instance, Phase
from thsa_cosim.fmu.plan import Plan
from thsa_cosim.signals import FloatArray, Signals

IntArray = NDArray[np.int64]

_INT, _DOUBLE, _SIZE = ctypes.c_int, ctypes.c_double, ctypes.c_int64
_ACCESS2 = ctypes.CFUNCTYPE(_INT, _SIZE, _SIZE, _SIZE, _SIZE)
_ACCESS3 = ctypes.CFUNCTYPE(_INT, _SIZE, _SIZE, _SIZE, _SIZE, _SIZE)
_STEP2 = ctypes.CFUNCTYPE(_INT, _SIZE, _DOUBLE, _DOUBLE, _INT)
_STEP3 = ctypes.CFUNCTYPE(_INT, _SIZE, _DOUBLE, _DOUBLE, ctypes.c_bool, _SIZE, _SIZE, _SIZE, _SIZE)


def advance_python(
    version: int,
    handle: int,
    do_step: int,
    times: FloatArray,
    steps: FloatArray,
    sets: IntArray,
    slopes: IntArray,
    ends: IntArray,
    gets: IntArray,
    floats: FloatArray,
    flags: NDArray[np.uint8],
    last: FloatArray,
    progress: FloatArray,
) -> tuple[int, int, int]:
    """Step through ``times`` (n,); return (steps done, what ended the loop, its code).

    ``sets``, ``ends`` and ``gets`` have one row per data type: address of the C function, address of the
    value references, their count, address of the value table, bytes per table row. ``slopes`` is one such
    row for fmi2SetRealInputDerivatives (function, references, count, orders, table, row bytes), zero for
    none. What ends it: 0 finished, 1 set, 2 slopes, 3 doStep, 4 set at the end of the step, 5 get,
    6 output number ``code`` is not finite, 7 the FMU asks to terminate, 8 the FMU fell short of the step.
    """

    def bind(rows: IntArray) -> list[tuple[Any, ...]]:
        prototype = _ACCESS2 if version == 2 else _ACCESS3
        return [(prototype(row[0]), *row[1:]) for row in rows.tolist()]

    def access(row: tuple[Any, ...], k: int) -> int:
        function, references, count, table, stride = row
        rest = () if version == 2 else (count,)
        return int(function(handle, references, count, table + k * stride, *rest))

    set_rows, end_rows, get_rows = bind(sets), bind(ends), bind(gets)
    slope = slopes.tolist()
    set_slopes = _ACCESS3(slope[0]) if slope[0] else None
    step = _STEP2(do_step) if version == 2 else _STEP3(do_step)
    flag = flags.ctypes.data
    for k in range(len(steps)):
        progress[1] = times[k]
        for row in set_rows:
            if (code := access(row, k)) not in (0, 1):
                return k, 1, code
        if set_slopes:
            code = set_slopes(handle, slope[1], slope[2], slope[3], slope[4] + k * slope[5])
            if code not in (0, 1):
                return k, 2, code
        progress[2] = k
        if version == 2:
            code = step(handle, times[k], steps[k], 1)
        else:
            flags[1] = 0
            last[0] = np.nan
            code = step(handle, times[k], steps[k], True, flag, flag + 1, flag + 2, last.ctypes.data)
        if code not in (0, 1):
            return k, 3, code
        if version == 3:
            if flags[1]:
                return k, 7, 0
            if last[0] < times[k] + 0.999 * steps[k]:
                return k, 8, 0
        for row in end_rows:
            if (code := access(row, k + 1)) not in (0, 1):
                return k, 4, code
        for row in get_rows:
            if (code := access(row, k + 1)) not in (0, 1):
                return k, 5, code
        finite = np.isfinite(floats[k + 1])
        if not finite.all():
            return k, 6, int(np.argmin(finite))
    return len(steps), 0, 0


def _address_table(instance: Instance, verb: str, rows: Sequence[tuple[Channel, NDArray[Any]]]) -> IntArray:
    table = np.zeros((len(rows), 5), dtype=np.int64)
    for i, (channel, values) in enumerate(rows):
        function = instance.library.address(instance.value_function(verb, channel.suffix))
        references = channel.references.ctypes.data
        table[i] = function, references, len(channel.references), values.ctypes.data, values.strides[0]
    return table


class Tables:
    """The addresses and buffers that the loop works on, for one plan and one FMU; reused by every run."""

    def __init__(self, instance: Instance, plan: Plan) -> None:
        n = len(plan.grid.times)
        self.results = [
            (channel, np.zeros((n, len(channel.references)), dtype=channel.dtype))
            for channel in plan.output_channels
        ]
        doubles = [table for channel, table in self.results if channel.dtype == np.float64]
        self.floats = doubles[0] if doubles else np.empty((n, 0))
        self.singles = any(channel.dtype == np.float32 for channel, _ in self.results)
        self.sets = _address_table(instance, "Set", plan.begin)
        self.ends = _address_table(instance, "Set", plan.end)
        self.gets = _address_table(instance, "Get", self.results)
        self.slopes = np.zeros(6, dtype=np.int64)
        if plan.smooth is not None and plan.mode == "derivative":
            channel, _, table, orders = plan.smooth
            pointer = ctypes.c_void_p
            prototype = (pointer, pointer, ctypes.c_size_t, pointer, pointer)
            function = instance.library.function("fmi2SetRealInputDerivatives", *prototype)
            address, references = instance.library.address(function), channel.references
            row = address, references.ctypes.data, len(references), orders.ctypes.data
            self.slopes[:] = *row, table.ctypes.data, table.strides[0]
        self.do_step = instance.library.address(
            instance.library.function(f"{instance.prefix}DoStep", *instance.step_types)
        )
        self.flags, self.last = np.zeros(8, dtype=np.uint8), np.zeros(1)
        self.signals: Signals | None = None

    def advance(
        self, loop: Any, instance: Instance, plan: Plan, progress: FloatArray, first: int = 0
    ) -> tuple[int, int, int]:
        """Call ``advance_python`` or its compiled twin, from communication point number ``first`` on."""
        version = 2 if instance.prefix == "fmi2" else 3
        slopes = self.slopes.copy()
        slopes[4] += first * slopes[5]
        done, what, code = loop(
            version,
            instance.handle,
            self.do_step,
            plan.grid.times[first:],
            plan.grid.steps[first:],
            _from_row(self.sets, first),
            slopes,
            _from_row(self.ends, first),
            _from_row(self.gets, first),
            self.floats[first:],
            self.flags,
            self.last,
            progress,
        )
        return first + int(done), int(what), int(code)

    def read(self, instance: Instance, plan: Plan, k: int) -> None:
        """Read the outputs at communication point ``k``; SimulationFailure if one is not finite."""
        for channel, table in self.results:
            getter = instance.value_function("Get", channel.suffix)
            references = channel.references
            code = instance.access(getter, references.ctypes.data, len(references), table[k].ctypes.data)
            instance.check(code, f"Get{channel.suffix}")
        _refuse_not_finite(plan, self.results, k)


def _from_row(table: IntArray, first: int) -> IntArray:
    """An address table whose value tables begin ``first`` rows later."""
    later = table.copy()
    later[:, 3] += first * later[:, 4]
    return later


def step_through(instance: Instance, plan: Plan, progress: FloatArray, compiled: bool) -> Signals:
    """Run an initialised instance through ``plan``; SimulationFailure if it does not reach the end."""
    if plan.tables is None:
        plan.tables = Tables(instance, plan)
    tables: Tables = plan.tables
    tables.read(instance, plan, 0)
    progress[0] = Phase.STEP
    if compiled:
        from thsa_cosim.fmu.compiled import advance as loop
    else:
        loop = advance_python
    done, what, code = tables.advance(loop, instance, plan, progress)
    while what and _completed(instance, plan, tables, done, what, code):
        _apply(instance, plan.end, done + 1)
        tables.read(instance, plan, done + 1)
        if done + 1 == len(plan.grid.steps):
            what = 0
            break
        done, what, code = tables.advance(loop, instance, plan, progress, done + 1)
    if what:
        _explain(instance, plan, tables.results, done, what, code)
    if tables.singles:  # the loop looks at doubles only
        for k in range(len(plan.grid.times)):
            _refuse_not_finite(plan, tables.results, k)
    rows: list[FloatArray] = [np.empty(0)] * len(plan.outputs)
    for channel, table in tables.results:
        # One copy for all, whose rows are contiguous signals.
        for column, row in zip(channel.columns, table.T.astype(np.float64, order="C"), strict=True):
            rows[column] = row
    values = dict(zip(plan.outputs, rows, strict=True))
    if tables.signals is None:
        tables.signals = plan.recorded(values)
        return tables.signals
    # The time axis was checked when the first run built its signals.
    signals = copy.copy(tables.signals)
    object.__setattr__(signals, "values", values)
    return signals


_PARTS = 1000
"""Parts in which an FMU may do one communication step."""


def _completed(instance: Instance, plan: Plan, tables: Tables, done: int, what: int, code: int) -> bool:
    """Go on from where the FMU stopped within a step (fmi2Discard, an early return); whether its end was reached."""
    if _ends_with_the_run(instance, plan, tables, done, what, code):
        return True
    if plan.smooth is not None:  # slopes count from the begin of the step
        return False
    begin, end = float(plan.grid.times[done]), float(plan.grid.times[done] + plan.grid.steps[done])
    slack = 1e-9 * (end - begin)
    last: float | None = None
    if what == 3 and code == 2 and isinstance(instance, Fmi2Instance):
        terminated, last = instance.asked_to_stop()
        last = None if terminated else last
    elif what == 8:
        last = float(tables.last[0])
    at = begin
    for _ in range(_PARTS):
        if last is None or not at + slack < last <= end + slack:
            return False
        at = last
        if at >= end - slack:
            return True
        try:
            last = instance.part_of_step(at, end - at)
        except SimulationFailure:
            return False
    return False


def _apply(instance: Instance, rows: Sequence[tuple[Channel, NDArray[Any]]], k: int) -> None:
    """Set the inputs of communication point ``k``."""
    for channel, table in rows:
        setter, references = instance.value_function("Set", channel.suffix), channel.references
        code = instance.access(setter, references.ctypes.data, len(references), table[k].ctypes.data)
        instance.check(code, f"Set{channel.suffix}")


def _ends_with_the_run(
    instance: Instance, plan: Plan, tables: Tables, done: int, what: int, code: int
) -> bool:
    """Whether the FMU asked to terminate in the very last step, having reached its end."""
    if done != len(plan.grid.steps) - 1:
        return False
    last: float | None = None
    if what == 3 and code == 2 and isinstance(instance, Fmi2Instance):
        terminated, last = instance.asked_to_stop()
        last = last if terminated else None
    elif what == 7:
        last = float(tables.last[0])
    return last is not None and last >= plan.grid.times[done] + 0.999 * plan.grid.steps[done]


def _refuse_not_finite(plan: Plan, results: Sequence[tuple[Channel, NDArray[Any]]], k: int) -> None:
    for channel, table in results:
        if table.dtype.kind == "f" and not np.isfinite(table[k]).all():
            i = int(np.argmin(np.isfinite(table[k])))
            name = plan.outputs[channel.columns[i]]
            reason = f"{name} became {table[k, i]} at t = {plan.grid.times[k]:.9g} s"
            raise SimulationFailure(Status.NOT_FINITE, reason)


_FUNCTIONS = {1: "Set{}", 2: "SetRealInputDerivatives", 3: "DoStep", 4: "Set{}", 5: "Get{}"}


def _explain(
    instance: Instance,
    plan: Plan,
    results: Sequence[tuple[Channel, NDArray[Any]]],
    done: int,
    what: int,
    code: int,
) -> None:
    """Raise SimulationFailure for what ended the loop."""
    time = float(plan.grid.times[done])
    if what == 6:
        _refuse_not_finite(plan, results, done + 1)
    if what == 3 and code == 2 and isinstance(instance, Fmi2Instance):
        terminated, last = instance.asked_to_stop()
        if terminated:
            at = time if last is None else last
            raise SimulationFailure(
                Status.INCOMPLETE,
                f"the FMU ended the simulation at t = {at:.9g} s of {plan.grid.times[-1]:.9g} s"
                f"{instance.messages.last()}",
            )
    if what in (7, 8):
        verb = "ended the simulation" if what == 7 else "did less than the communication step"
        reason = f"the FMU {verb} at t = {time:.9g} s of {plan.grid.times[-1]:.9g} s"
        raise SimulationFailure(Status.INCOMPLETE, reason + instance.messages.last())
    suffix = {channel.suffix for channel, _ in (plan.begin if what in (1, 4) else results)}
    instance.check(code, _FUNCTIONS[what].format("/".join(sorted(suffix))), time)


def check_names(values: Sequence[str], plan_owner: Instance) -> None:
    """ParameterError for a name that cannot be set before initialisation (unknown, constant, text)."""
    for name in values:
        variable = plan_owner.description.variable(name)
        if variable.variability == "constant" or variable.causality in ("independent", "calculatedParameter"):
            raise ParameterError(
                f"{plan_owner.description.path}: {name} is a {variable.variability} "
                f"{variable.causality} and cannot be set; name a parameter or a start value."
            )
