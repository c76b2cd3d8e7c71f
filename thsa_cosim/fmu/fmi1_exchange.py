"""FMI 1.0 Model Exchange through ctypes (FMI for Model Exchange 1.0, January 2010, clause 2).

It has no modes: events are handled by ``EventUpdate``, which iterates inside the FMU, and the result of
``Initialize`` stands for the first of them. Functions carry the model identifier in front of their names.
"""

import ctypes
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.fmu.description import FmuDescription
from thsa_cosim.fmu.failure import SimulationFailure, Status
from thsa_cosim.fmu.fmi2 import listen, shared_callbacks
from thsa_cosim.fmu.instance import EventInfo, Instance
from thsa_cosim.fmu.native import MessageSink
from thsa_cosim.signals import FloatArray

_NAMES = {"GetNominalsOfContinuousStates": "GetNominalContinuousStates"}
"""What FMI 2.0 calls otherwise."""


class _Callbacks(ctypes.Structure):
    _fields_: ClassVar = [
        ("logger", ctypes.c_void_p),
        ("allocate_memory", ctypes.c_void_p),
        ("free_memory", ctypes.c_void_p),
    ]


class _EventInfo(ctypes.Structure):
    _fields_: ClassVar = [
        ("iteration_converged", ctypes.c_char),
        ("state_references_changed", ctypes.c_char),
        ("state_values_changed", ctypes.c_char),
        ("terminate_simulation", ctypes.c_char),
        ("upcoming_time_event", ctypes.c_char),
        ("next_event_time", ctypes.c_double),
    ]


class Fmi1Exchange(Instance):
    """One FMI 1.0 instance (Model Exchange)."""

    types: ClassVar[dict[str, tuple[str, Any]]] = {
        "Real": ("Real", np.float64),
        "Integer": ("Integer", np.int32),
        "Enumeration": ("Integer", np.int32),
        "Boolean": ("Boolean", np.int8),
    }

    def __init__(
        self, folder: Path, description: FmuDescription, kind: str, sink: MessageSink | None = None
    ) -> None:
        super().__init__(folder, description, kind, sink)
        self.prefix = f"{description.model_exchange_identifier}_fmi"
        self._info: _EventInfo | None = None
        self._tolerance: float | None = None

    def instantiate(self) -> None:
        """Call fmiInstantiateModel."""
        shared = shared_callbacks()
        listen(self.messages)
        logger = ctypes.cast(shared.logger, ctypes.c_void_p).value
        callbacks = _Callbacks(logger, shared.allocate_memory, shared.free_memory)
        function = self.library.function(
            f"{self.prefix}InstantiateModel",
            ctypes.c_char_p,
            ctypes.c_char_p,
            _Callbacks,
            ctypes.c_char,
            restype=ctypes.c_void_p,
        )
        self._info = None
        self.created(function(b"plant", self.description.guid.encode(), callbacks, b"\0"), "InstantiateModel")

    def initialize_begin(self, start: float, stop: float, tolerance: float | None) -> None:
        """fmiSetTime; what else there is to say comes with fmiInitialize."""
        self._tolerance = tolerance
        self.set_time(start)
        self.set_start_again()

    def initialize_end(self) -> None:
        """fmiInitialize."""
        self._info = _EventInfo()
        self.call(
            "Initialize",
            (ctypes.c_char, bytes([self._tolerance is not None])),
            (ctypes.c_double, self._tolerance or 0.0),
            (ctypes.c_void_p, ctypes.addressof(self._info)),
        )

    def event_iteration(self) -> EventInfo:
        """fmiEventUpdate; the first time, what fmiInitialize said."""
        info, self._info = self._info, None
        if info is None:
            info = _EventInfo()
            self.call("EventUpdate", (ctypes.c_char, b"\0"), (ctypes.c_void_p, ctypes.addressof(info)))
        return EventInfo(
            needs_update=info.iteration_converged == b"\0",
            terminate=info.terminate_simulation != b"\0",
            nominals_changed=False,
            states_changed=info.state_values_changed != b"\0",
            next_event_time=info.next_event_time if info.upcoming_time_event != b"\0" else None,
        )

    def completed_integrator_step(self) -> tuple[bool, bool]:
        """fmiCompletedIntegratorStep."""
        event = ctypes.c_char(b"\0")
        self.call("CompletedIntegratorStep", (ctypes.c_void_p, ctypes.addressof(event)))
        return event.value != b"\0", False

    def enter_event_mode(self) -> None:
        """There are no modes."""

    def enter_continuous_time_mode(self) -> None:
        """There are no modes."""

    def reset(self) -> None:
        """There is no reset: a new instance."""
        self.free()
        self.instantiate()

    def free(self) -> None:
        """fmiFreeModelInstance."""
        if self.handle and not self.is_dead:
            self.library.function(f"{self.prefix}FreeModelInstance", ctypes.c_void_p, restype=None)(
                self.handle
            )
        self.handle = 0

    def vector(self, name: str, values: FloatArray) -> None:
        """See :class:`Instance`."""
        super().vector(_NAMES.get(name, name), values)

    def value_function(self, verb: str, suffix: str) -> Any:
        """<identifier>_fmiSetReal, ..."""
        pointer = ctypes.c_void_p
        return self.library.function(
            f"{self.prefix}{verb}{suffix}", pointer, pointer, ctypes.c_size_t, pointer
        )

    def access(self, function: Any, references: int, count: int, values: int) -> int:
        """Set or get ``count`` variables."""
        return int(function(self.handle, references, count, values))

    def do_step(self, time: float, step: float) -> None:
        """There are no steps in Model Exchange."""
        raise SimulationFailure(Status.FMI_ERROR, "FMI 1.0 Model Exchange has no doStep")

    def directional_derivative(
        self, unknowns: NDArray[np.uint32], known: NDArray[np.uint32], out: FloatArray
    ) -> None:
        """There are none."""
        raise SimulationFailure(Status.FMI_ERROR, "FMI 1.0 has no directional derivatives")
