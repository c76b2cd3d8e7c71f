"""FMI 3.0 through ctypes (clauses 2.2, 3.2 and 4.2 of the FMI 3.0.2 standard)."""

import ctypes
import os
from collections.abc import Sequence
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.errors import ParameterError
from thsa_cosim.fmu.arrays import ArrayAccess
from thsa_cosim.fmu.failure import SimulationFailure, Status
from thsa_cosim.fmu.instance import ELEMENTS, Channel, EventInfo, Instance
from thsa_cosim.signals import FloatArray

_STRUCTURAL = ("UInt64", "Int64", "UInt32", "Int32", "UInt16", "Int16", "UInt8", "Int8", "Boolean")
_Log = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p)


class Fmi3Instance(Instance):
    """One FMI 3.0 instance (Co-Simulation or Model Exchange)."""

    prefix = "fmi3"
    types: ClassVar[dict[str, tuple[str, Any]]] = {
        "Float64": ("Float64", np.float64),
        "Float32": ("Float32", np.float32),
        "Int8": ("Int8", np.int8),
        "UInt8": ("UInt8", np.uint8),
        "Int16": ("Int16", np.int16),
        "UInt16": ("UInt16", np.uint16),
        "Int32": ("Int32", np.int32),
        "UInt32": ("UInt32", np.uint32),
        "Int64": ("Int64", np.int64),
        "UInt64": ("UInt64", np.uint64),
        "Enumeration": ("Int64", np.int64),
        "Boolean": ("Boolean", np.bool_),
    }
    step_types = (ctypes.c_void_p, ctypes.c_double, ctypes.c_double, ctypes.c_bool, *(ctypes.c_void_p,) * 4)
    environment = 0
    """Address handed to the callbacks."""
    intermediate_update = 0
    """Address of the intermediate update callback, 0 for none."""
    intermediate_references: Sequence[int] = ()
    event_mode = False
    """Co-Simulation: whether the importer handles events (``event_mode``)."""
    _log: Any = None

    @cached_property
    def _arrays(self) -> ArrayAccess:
        return ArrayAccess(self)

    def instantiate(self) -> None:
        """fmi3InstantiateCoSimulation or fmi3InstantiateModelExchange."""
        self._arrays.forget()

        def log(_env: int, status: int, category: bytes, message: bytes) -> None:
            self.messages.add(status, category, message)

        if self._log is None:
            self._log = _Log(log)
        pointer, boolean, text = ctypes.c_void_p, ctypes.c_bool, ctypes.c_char_p
        resources = f"{self.resources}{os.sep}".encode() if self.resources.is_dir() else None
        common = (b"plant", self.description.guid.encode(), resources, False, False)
        if self.kind == "model-exchange":
            function = self.library.function(
                "fmi3InstantiateModelExchange",
                text,
                text,
                text,
                boolean,
                boolean,
                pointer,
                _Log,
                restype=pointer,
            )
            self.created(function(*common, None, self._log), "InstantiateModelExchange")
            return
        function = self.library.function(
            "fmi3InstantiateCoSimulation",
            text,
            text,
            text,
            boolean,
            boolean,
            boolean,
            boolean,
            pointer,
            ctypes.c_size_t,
            pointer,
            _Log,
            pointer,
            restype=pointer,
        )
        references = np.array(self.intermediate_references, dtype=np.uint32)
        handle = function(
            *common,
            self.event_mode,
            self.event_mode,
            references.ctypes.data if len(references) else None,
            len(references),
            self.environment or None,
            self._log,
            self.intermediate_update or None,
        )
        self.created(handle, "InstantiateCoSimulation")

    def initialize_begin(self, start: float, stop: float, tolerance: float | None) -> None:
        """fmi3EnterInitializationMode."""
        self.call(
            "EnterInitializationMode",
            (ctypes.c_bool, tolerance is not None),
            (ctypes.c_double, tolerance or 0.0),
            (ctypes.c_double, start),
            (ctypes.c_bool, True),
            (ctypes.c_double, stop),
        )

    def do_step(self, time: float, step: float) -> None:
        """fmi3DoStep; SimulationFailure also where the FMU returns early or asks to terminate."""
        reached, _, terminate = self.step(time, step)
        if terminate or reached < time + 0.999 * step:
            what = "asks to terminate" if terminate else "returned early"
            raise SimulationFailure(
                Status.INCOMPLETE, f"the FMU {what} at t = {time:.9g} s{self.messages.last()}"
            )

    def part_of_step(self, time: float, step: float) -> float | None:
        """fmi3DoStep; the last successful time, None where the FMU asks to terminate."""
        reached, _, terminate = self.step(time, step)
        return None if terminate else reached

    def step(self, time: float, step: float) -> tuple[float, bool, bool]:
        """fmi3DoStep; return (last successful time [s], event handling needed, terminate)."""
        flags, last = (ctypes.c_bool * 3)(), ctypes.c_double(np.nan)
        base = ctypes.addressof(flags)
        self.call(
            "DoStep",
            (ctypes.c_double, time),
            (ctypes.c_double, step),
            (ctypes.c_bool, True),
            *((ctypes.c_void_p, base + i) for i in range(3)),
            (ctypes.c_void_p, ctypes.addressof(last)),
            time=time,
        )
        # Where nothing came early the last successful time need not be set.
        reached = time + step if np.isnan(last.value) and not flags[2] else last.value
        return float(reached), flags[0], flags[1]

    # -- clocks ---------------------------------------------------------------------------------------
    def activate_clocks(self, references: Sequence[int]) -> None:
        """fmi3SetClock, in Event Mode."""
        numbers = np.array(references, dtype=np.uint32)
        ticks = np.ones(len(numbers), dtype=np.bool_)
        self.call(
            "SetClock",
            (ctypes.c_void_p, numbers.ctypes.data),
            (ctypes.c_size_t, len(numbers)),
            (ctypes.c_void_p, ticks.ctypes.data),
        )

    def clock_intervals(self, references: Sequence[int]) -> tuple[FloatArray, NDArray[np.bool_]]:
        """fmi3GetIntervalDecimal: intervals (n,) s, infinite if not yet known, and whether each has changed."""
        numbers = np.array(references, dtype=np.uint32)
        intervals, qualifiers = np.full(len(numbers), np.inf), np.zeros(len(numbers), dtype=np.int32)
        self.call(
            "GetIntervalDecimal",
            (ctypes.c_void_p, numbers.ctypes.data),
            (ctypes.c_size_t, len(numbers)),
            (ctypes.c_void_p, intervals.ctypes.data),
            (ctypes.c_void_p, qualifiers.ctypes.data),
        )
        return np.where(qualifiers == 0, np.inf, intervals), qualifiers == 2

    def clock_shifts(self, references: Sequence[int]) -> FloatArray:
        """fmi3GetShiftDecimal: (n,) s."""
        numbers = np.array(references, dtype=np.uint32)
        shifts = np.zeros(len(numbers))
        self.call(
            "GetShiftDecimal",
            (ctypes.c_void_p, numbers.ctypes.data),
            (ctypes.c_size_t, len(numbers)),
            (ctypes.c_void_p, shifts.ctypes.data),
        )
        return shifts

    # -- structural parameters ------------------------------------------------------------------------
    def set_start(self, channels: Sequence[Channel], values: FloatArray) -> None:
        """Set start values; structural parameters in Configuration Mode (clause 2.3.2), before all others."""
        structural = self.description.structural_references
        inside = [
            np.array([c.suffix in _STRUCTURAL and int(r) in structural for r in c.references])
            for c in channels
        ]
        if any(part.any() for part in inside):
            self._refuse_sizes(_parts(channels, inside), values)
            self.call("EnterConfigurationMode")
            self.set_values(_parts(channels, inside), values)
            self.call("ExitConfigurationMode")
        others = _parts(channels, [~part for part in inside])
        super().set_start(others, values)

    def value_function(self, verb: str, suffix: str) -> Any:
        """fmi3SetFloat64, fmi3GetInt32, ...; for elements of arrays a function of the same kind."""
        if suffix.endswith(ELEMENTS):
            return self._arrays.function(verb, suffix.removesuffix(ELEMENTS))
        pointer, size = ctypes.c_void_p, ctypes.c_size_t
        return self.library.function(f"fmi3{verb}{suffix}", pointer, pointer, size, pointer, size)

    def access(self, function: Any, references: int, count: int, values: int) -> int:
        """Set or get ``count`` scalar variables."""
        return int(function(self.handle, references, count, values, count))

    def event_iteration(self) -> EventInfo:
        """fmi3UpdateDiscreteStates."""
        flags = (ctypes.c_bool * 5)()
        time = ctypes.c_double(np.nan)
        base = ctypes.addressof(flags)
        self.call(
            "UpdateDiscreteStates",
            *((ctypes.c_void_p, base + i) for i in range(5)),
            (ctypes.c_void_p, ctypes.addressof(time)),
        )
        again, terminate, nominals, values, defined = flags
        return EventInfo(again, terminate, nominals, values, time.value if defined else None)

    def completed_integrator_step(self) -> tuple[bool, bool]:
        """fmi3CompletedIntegratorStep."""
        event, terminate = ctypes.c_bool(False), ctypes.c_bool(False)
        self.call(
            "CompletedIntegratorStep",
            (ctypes.c_bool, True),
            (ctypes.c_void_p, ctypes.addressof(event)),
            (ctypes.c_void_p, ctypes.addressof(terminate)),
        )
        return event.value, terminate.value

    def directional_derivative(
        self, unknowns: NDArray[np.uint32], known: NDArray[np.uint32], out: FloatArray
    ) -> None:
        """fmi3GetDirectionalDerivative with seed 1."""
        pointer, size, seed = ctypes.c_void_p, ctypes.c_size_t, ctypes.c_double(1.0)
        rows, columns = np.ascontiguousarray(unknowns), np.ascontiguousarray(known)
        self.call(
            "GetDirectionalDerivative",
            (pointer, rows.ctypes.data),
            (size, len(rows)),
            (pointer, columns.ctypes.data),
            (size, len(columns)),
            (pointer, ctypes.addressof(seed)),
            (size, 1),
            (pointer, out.ctypes.data),
            (size, len(out)),
        )

    def _refuse_sizes(self, channels: Sequence[Channel], values: FloatArray) -> None:
        """ParameterError where the length of an array would change: its elements are named by the declared one."""
        declared = {v.value_reference: v for v in self.description.variables.values() if v.element is None}
        for channel in channels:
            for reference, column in zip(channel.references.tolist(), channel.columns, strict=True):
                variable = declared[reference]
                if reference in self.description.dimension_references and values[column] != variable.start:
                    raise ParameterError(
                        f"{self.description.path}: {variable.name} is the length of an array and keeps its start value"
                        f" {variable.start:g}; export the FMU with another one."
                    )


def _parts(channels: Sequence[Channel], kept: Sequence[NDArray[np.bool_]]) -> list[Channel]:
    """The channels without the variables that are not ``kept``."""
    return [
        Channel(c.suffix, c.references[keep], c.dtype, tuple(np.array(c.columns)[keep].tolist()))
        for c, keep in zip(channels, kept, strict=True)
        if keep.any()
    ]
