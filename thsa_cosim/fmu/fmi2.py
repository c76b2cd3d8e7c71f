"""FMI 2.0 through ctypes (clause 2.1 and 4.2 of the FMI 2.0.4 standard)."""

import contextlib
import ctypes
import importlib.util
import sys
from functools import cache
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.fmu.instance import EventInfo, Instance
from thsa_cosim.fmu.native import Messages
from thsa_cosim.signals import FloatArray

_Logger = ctypes.CFUNCTYPE(
    None, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p
)


class Callbacks(ctypes.Structure):
    """fmi2CallbackFunctions."""

    _fields_: ClassVar = [
        ("logger", _Logger),
        ("allocate_memory", ctypes.c_void_p),
        ("free_memory", ctypes.c_void_p),
        ("step_finished", ctypes.c_void_p),
        ("environment", ctypes.c_void_p),
    ]


class _EventInfo(ctypes.Structure):
    _fields_: ClassVar = [
        ("new_discrete_states_needed", ctypes.c_int),
        ("terminate_simulation", ctypes.c_int),
        ("nominals_changed", ctypes.c_int),
        ("values_changed", ctypes.c_int),
        ("next_event_time_defined", ctypes.c_int),
        ("next_event_time", ctypes.c_double),
    ]


class Fmi2Instance(Instance):
    """One FMI 2.0 instance (Co-Simulation or Model Exchange)."""

    prefix = "fmi2"
    types: ClassVar[dict[str, tuple[str, Any]]] = {
        "Real": ("Real", np.float64),
        "Integer": ("Integer", np.int32),
        "Enumeration": ("Integer", np.int32),
        "Boolean": ("Boolean", np.int32),
    }

    step_types = (ctypes.c_void_p, ctypes.c_double, ctypes.c_double, ctypes.c_int)

    def instantiate(self) -> None:
        """Call fmi2Instantiate."""
        callbacks = shared_callbacks()
        listen(self.messages)
        function = self.library.function(
            "fmi2Instantiate",
            ctypes.c_char_p,
            ctypes.c_int,
            ctypes.c_char_p,
            ctypes.c_char_p,
            ctypes.c_void_p,
            ctypes.c_int,
            ctypes.c_int,
            restype=ctypes.c_void_p,
        )
        handle = function(
            b"plant",
            1 if self.kind == "co-simulation" else 0,
            self.description.guid.encode(),
            self.resources.as_uri().encode(),
            ctypes.addressof(callbacks),
            0,
            0,
        )
        self.created(handle, "Instantiate")

    def initialize_begin(self, start: float, stop: float, tolerance: float | None) -> None:
        """fmi2SetupExperiment, start values again, fmi2EnterInitializationMode."""
        self.call(
            "SetupExperiment",
            (ctypes.c_int, int(tolerance is not None)),
            (ctypes.c_double, tolerance or 0.0),
            (ctypes.c_double, start),
            (ctypes.c_int, 1),
            (ctypes.c_double, stop),
        )
        self.set_start_again()
        self.call("EnterInitializationMode")

    def do_step(self, time: float, step: float) -> None:
        """fmi2DoStep; SimulationFailure also where the FMU discards the step."""
        arguments = (ctypes.c_double, time), (ctypes.c_double, step), (ctypes.c_int, 1)
        self.call("DoStep", *arguments, time=time)

    def part_of_step(self, time: float, step: float) -> float | None:
        """fmi2DoStep; after fmi2Discard the last time that it reached."""
        code = self.library.function("fmi2DoStep", *self.step_types)(self.handle, time, step, 1)
        if code == 2:
            terminated, last = self.asked_to_stop()
            return None if terminated else last
        self.check(code, "DoStep", time)
        return time + step

    def value_function(self, verb: str, suffix: str) -> Any:
        """fmi2SetReal, fmi2GetInteger, ..."""
        pointer = ctypes.c_void_p
        return self.library.function(f"fmi2{verb}{suffix}", pointer, pointer, ctypes.c_size_t, pointer)

    def access(self, function: Any, references: int, count: int, values: int) -> int:
        """Set or get ``count`` variables."""
        return int(function(self.handle, references, count, values))

    def event_iteration(self) -> EventInfo:
        """fmi2NewDiscreteStates."""
        info = _EventInfo()
        self.call("NewDiscreteStates", (ctypes.c_void_p, ctypes.addressof(info)))
        return EventInfo(
            bool(info.new_discrete_states_needed),
            bool(info.terminate_simulation),
            bool(info.nominals_changed),
            bool(info.values_changed),
            info.next_event_time if info.next_event_time_defined else None,
        )

    def completed_integrator_step(self) -> tuple[bool, bool]:
        """fmi2CompletedIntegratorStep."""
        event, terminate = ctypes.c_int(0), ctypes.c_int(0)
        self.call(
            "CompletedIntegratorStep",
            (ctypes.c_int, 1),
            (ctypes.c_void_p, ctypes.addressof(event)),
            (ctypes.c_void_p, ctypes.addressof(terminate)),
        )
        return bool(event.value), bool(terminate.value)

    def directional_derivative(
        self, unknowns: NDArray[np.uint32], known: NDArray[np.uint32], out: FloatArray
    ) -> None:
        """fmi2GetDirectionalDerivative with seed 1."""
        pointer, size, seed = ctypes.c_void_p, ctypes.c_size_t, ctypes.c_double(1.0)
        rows, columns = np.ascontiguousarray(unknowns), np.ascontiguousarray(known)
        self.call(
            "GetDirectionalDerivative",
            (pointer, rows.ctypes.data),
            (size, len(rows)),
            (pointer, columns.ctypes.data),
            (size, len(columns)),
            (pointer, ctypes.addressof(seed)),
            (pointer, out.ctypes.data),
        )

    def asked_to_stop(self) -> tuple[bool, float | None]:
        """After fmi2Discard: whether the FMU wants to end, and the last time it reached (clause 4.2.3)."""
        pointer = ctypes.c_void_p
        terminated, last = ctypes.c_int(0), ctypes.c_double(np.nan)
        boolean = self.library.function("fmi2GetBooleanStatus", pointer, ctypes.c_int, pointer)
        real = self.library.function("fmi2GetRealStatus", pointer, ctypes.c_int, pointer)
        ends = boolean(self.handle, 3, ctypes.addressof(terminated)) <= 1 and bool(terminated.value)
        known = real(self.handle, 2, ctypes.addressof(last)) <= 1 and np.isfinite(last.value)
        return ends, last.value if known else None


_listener: list[Messages | None] = [None]
"""Who hears the messages: there is one live instance per process."""


def _log(_env: int, _name: bytes, status: int, category: bytes, message: bytes) -> None:
    if _listener[0] is not None:
        _listener[0].add(status, category, message)


def listen(messages: Messages) -> None:
    """Let ``messages`` hear what is logged from now on."""
    _listener[0] = messages


def shared_callbacks() -> Callbacks:
    """Callbacks of every instance; they live as long as the process, as late messages may come."""
    callbacks, logger, helper = _callbacks()
    callbacks.logger = logger
    if helper is not None:
        # Its last caller hears every message: another importer here may have been, with a logger that is gone by now.
        helper.addLoggerProxy(ctypes.addressof(callbacks))
    return callbacks


@cache
def _callbacks() -> tuple[Callbacks, Any, Any]:
    """The callbacks, the logger in Python, and fmpy's C helper, which formats before a logger is called, or None."""
    libc = ctypes.CDLL("msvcrt") if hasattr(ctypes, "WinDLL") else ctypes.CDLL(None)
    # The C library's own functions: no Python runs in an FMU's allocations.
    allocate, free = (ctypes.cast(f, ctypes.c_void_p).value for f in (libc.calloc, libc.free))
    logger, helper = _Logger(_log), None
    # Python cannot read printf arguments. The helper is loaded without importing fmpy, which would cost every worker a
    # tenth of a second.
    package = importlib.util.find_spec("fmpy")
    folder = {"linux": "linux64", "darwin": "darwin64", "win32": "win64"}.get(sys.platform, "")
    suffix = {"darwin": ".dylib", "win32": ".dll"}.get(sys.platform, ".so")
    if package is not None and package.origin is not None:
        with contextlib.suppress(OSError, AttributeError):  # no helper here: messages keep their %s
            library = ctypes.CDLL(str(Path(package.origin).parent / "logging" / folder / f"logging{suffix}"))
            library.addLoggerProxy.argtypes, library.addLoggerProxy.restype = [ctypes.c_void_p], None
            helper = library
    return Callbacks(logger, allocate, free, None, None), logger, helper
