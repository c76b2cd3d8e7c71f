"""What instances (FMI 2.0, 3.0, and 1.0 Model Exchange) have in common, seen from stepping loop and integrator."""

import ctypes
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.errors import ParameterError
from thsa_cosim.fmu.description import FmuDescription
from thsa_cosim.fmu.failure import SimulationFailure, Status
from thsa_cosim.fmu.native import Library, Messages, MessageSink, failure, library_path, load_library
from thsa_cosim.fmu.point import InstancePoint, Point
from thsa_cosim.fmu.variable import Variable
from thsa_cosim.signals import FloatArray

ELEMENTS = "Elements"
"""Ending of a channel's data type whose variables are elements of arrays (FMI 3)."""


class Phase(IntEnum):
    """What a plant is doing, for whoever has to explain its death."""

    IDLE = 0
    LOAD = 1
    INSTANTIATE = 2
    INITIALIZE = 3
    STEP = 4
    TERMINATE = 5
    FREE = 6
    RESET = 7
    REDUCE = 8


@dataclass(frozen=True)
class EventInfo:
    """Result of an event iteration (Model Exchange)."""

    needs_update: bool
    terminate: bool
    nominals_changed: bool
    states_changed: bool
    next_event_time: float | None


@dataclass(frozen=True)
class Channel:
    """Variables of one FMI data type: how they are set and got in one call."""

    suffix: str
    """Type in the function name: Real, Integer, Float64, ..."""
    references: NDArray[np.uint32]
    dtype: np.dtype[Any]
    columns: tuple[int, ...]
    """Position of each variable in the caller's list."""
    signs: FloatArray | None = None
    """(n,) -1 for FMI 1.0's negated aliases; None where there are none."""


def _signs(variables: Sequence[Variable]) -> FloatArray | None:
    negated = [v.is_negated and v.type != "Boolean" for v in variables]
    return np.where(negated, -1.0, 1.0) if any(negated) else None


class Instance(ABC):
    """One live instance; every failing call raises SimulationFailure."""

    prefix: str
    types: ClassVar[dict[str, tuple[str, Any]]]
    """FMI data type -> (function suffix, numpy type)"""
    step_types: ClassVar[tuple[Any, ...]] = ()
    """Prototype of doStep."""

    def __init__(
        self, folder: Path, description: FmuDescription, kind: str, sink: MessageSink | None = None
    ) -> None:
        self.description = description
        self.kind = kind
        self.messages = Messages(sink)
        identifier = (
            description.co_simulation_identifier
            if kind == "co-simulation"
            else description.model_exchange_identifier
        )
        self.library: Library = load_library(library_path(folder, description, identifier or ""))
        self.resources = folder / "resources"
        self.handle = 0
        self.input_mode: str | None = None
        """How linear inputs are given, see ``inputs.input_mode``; None: as trusted."""
        self._start: tuple[Sequence[Channel], FloatArray] = (), np.empty(0)
        self._texts: Mapping[int, str] = {}
        self.is_dead = False
        """After fmiXFatal nothing may be called any more, not even FreeInstance."""

    # -- what the two versions do differently -------------------------------------------------------
    @abstractmethod
    def instantiate(self) -> None:
        """Create the instance."""

    @abstractmethod
    def initialize_begin(self, start: float, stop: float, tolerance: float | None) -> None:
        """Enter Initialization Mode."""

    @abstractmethod
    def event_iteration(self) -> EventInfo:
        """Call newDiscreteStates / updateDiscreteStates once."""

    @abstractmethod
    def completed_integrator_step(self) -> tuple[bool, bool]:
        """Return (enter event mode, terminate)."""

    @abstractmethod
    def do_step(self, time: float, step: float) -> None:
        """Go from ``time`` to ``time + step`` [s] (Co-Simulation), inputs as they were last set."""

    def part_of_step(self, time: float, step: float) -> float | None:
        """Like ``do_step``, where less may be done; the time [s] that was reached, None if that is not known."""
        self.do_step(time, step)
        return time + step

    @abstractmethod
    def value_function(self, verb: str, suffix: str) -> Any:
        """Return the C function that sets or gets (``verb``) variables of one type."""

    @abstractmethod
    def access(self, function: Any, references: int, count: int, values: int) -> int:
        """Call a function from ``value_function`` on addresses; return its status code."""

    @abstractmethod
    def directional_derivative(
        self, unknowns: NDArray[np.uint32], known: NDArray[np.uint32], out: FloatArray
    ) -> None:
        """Write d(unknowns)/d(known) (n,) into ``out`` for one known variable."""

    # -- what they do alike -------------------------------------------------------------------------
    def call(self, name: str, *arguments: tuple[Any, Any], time: float | None = None) -> None:
        """Call ``<prefix><name>(instance, ...)`` with (ctype, value) pairs and check its status."""
        function = self.library.function(self.prefix + name, ctypes.c_void_p, *(t for t, _ in arguments))
        self.check(function(self.handle, *(v for _, v in arguments)), name, time)

    def check(self, code: int, name: str, time: float | None = None) -> None:
        """Raise SimulationFailure for a status code other than OK and Warning."""
        if code in (0, 1):
            return
        if code == 4:
            self.is_dead = True
        raise failure(self.prefix, name, code, self.messages, time)

    def channels(self, variables: Sequence[Variable]) -> list[Channel]:
        """Group ``variables`` by FMI data type; ParameterError for a type that holds no number."""
        groups: dict[str, list[int]] = {}
        for column, variable in enumerate(variables):
            if variable.type not in self.types or variable.is_array:
                what = "an array" if variable.is_array else f"of type {variable.type}"
                raise ParameterError(
                    f"{self.description.path}: {variable.name} is {what}; only numbers can be used."
                )
            suffix = self.types[variable.type][0] + (ELEMENTS if variable.element is not None else "")
            groups.setdefault(suffix, []).append(column)
        dtypes = {suffix: np.dtype(dtype) for suffix, dtype in self.types.values()}
        dtypes |= {suffix + ELEMENTS: dtype for suffix, dtype in dtypes.items()}
        return [
            Channel(
                suffix,
                np.array([variables[c].value_reference for c in columns], dtype=np.uint32),
                dtypes[suffix],
                tuple(columns),
                _signs([variables[c] for c in columns]),
            )
            for suffix, columns in groups.items()
        ]

    def set_values(self, channels: Sequence[Channel], values: FloatArray) -> None:
        """Set variables to ``values`` (n,), one C call per data type."""
        for channel in channels:
            wanted = values[list(channel.columns)]
            if channel.signs is not None:
                wanted = wanted * channel.signs
            data = np.ascontiguousarray(wanted).astype(channel.dtype)
            function = self.value_function("Set", channel.suffix)
            code = self.access(function, channel.references.ctypes.data, len(data), data.ctypes.data)
            self.check(code, f"Set{channel.suffix}")

    def get_values(self, channels: Sequence[Channel], out: FloatArray) -> None:
        """Read variables into ``out`` (n,), one C call per data type."""
        for channel in channels:
            data = np.empty(len(channel.references), dtype=channel.dtype)
            function = self.value_function("Get", channel.suffix)
            code = self.access(function, channel.references.ctypes.data, len(data), data.ctypes.data)
            self.check(code, f"Get{channel.suffix}")
            out[list(channel.columns)] = data if channel.signs is None else data * channel.signs

    def set_start(self, channels: Sequence[Channel], values: FloatArray) -> None:
        """Set start values of a new or reset instance.

        Some tools (20-sim) overwrite them when the experiment is set up; ``initialize_begin`` sets them once more.
        """
        self._start = channels, values
        self.set_values(channels, values)

    def set_start_again(self) -> None:
        """Set the start values a second time, where the FMI still allows all of them."""
        self.set_values(*self._start)
        self._set_strings()

    def set_texts(self, texts: Mapping[int, str]) -> None:
        """Set String variables of a new or reset instance by value reference; like ``set_start``."""
        self._texts = texts
        self._set_strings()

    def _set_strings(self) -> None:
        if not self._texts:
            return
        references = np.array(list(self._texts), dtype=np.uint32)
        data = (ctypes.c_char_p * len(references))(*(text.encode() for text in self._texts.values()))
        function = self.value_function("Set", "String")
        code = self.access(function, references.ctypes.data, len(references), ctypes.addressof(data))
        self.check(code, "SetString")

    def initialize_end(self) -> None:
        """Leave Initialization Mode."""
        self.call("ExitInitializationMode")

    def terminate(self) -> None:
        """End the run."""
        self.call("Terminate")

    def reset(self) -> None:
        """Bring the instance back to the state after instantiation."""
        self.call("Reset")

    def free(self) -> None:
        """Destroy the instance (nothing happens if there is none or it is dead)."""
        if self.handle and not self.is_dead:
            self.library.function(f"{self.prefix}FreeInstance", ctypes.c_void_p, restype=None)(self.handle)
        self.handle = 0

    def created(self, handle: int | None, name: str) -> None:
        """Take the handle that ``name`` returned."""
        if not handle:
            reason = f"{self.prefix}{name} returned NULL{self.messages.last()}"
            raise SimulationFailure(Status.LOAD_ERROR, reason)
        self.handle = handle

    # -- going back ----------------------------------------------------------------------------------
    def save_state(self, state: int = 0) -> int:
        """Save the FMU's state, over ``state`` if that is one from before; return its address."""
        held = ctypes.c_void_p(state or None)
        self.call(f"Get{self._state}", (ctypes.c_void_p, ctypes.addressof(held)))
        return held.value or 0

    def restore_state(self, state: int) -> None:
        """Go back to a saved state."""
        self.call(f"Set{self._state}", (ctypes.c_void_p, state))

    def free_state(self, state: int) -> None:
        """Forget a saved state."""
        held = ctypes.c_void_p(state)
        self.call(f"Free{self._state}", (ctypes.c_void_p, ctypes.addressof(held)))

    @property
    def _state(self) -> str:
        return "FMUState" if self.prefix == "fmi3" else "FMUstate"

    # -- Model Exchange ------------------------------------------------------------------------------
    def set_time(self, time: float) -> None:
        """Set the independent variable [s]."""
        self.call("SetTime", (ctypes.c_double, time))

    def enter_event_mode(self) -> None:
        """Enter Event Mode."""
        self.call("EnterEventMode")

    def enter_continuous_time_mode(self) -> None:
        """Enter Continuous-Time Mode."""
        self.call("EnterContinuousTimeMode")

    def vector(self, name: str, values: FloatArray) -> None:
        """Call a function that reads or writes a vector of Reals, e.g. GetContinuousStates."""
        self.call(name, (ctypes.c_void_p, values.ctypes.data), (ctypes.c_size_t, len(values)))

    def point(self, input_channels: Sequence[Channel]) -> Point:
        """Return the instance as the integrator sees it."""
        return InstancePoint(self, input_channels)

    @property
    def has_jacobian(self) -> bool:
        """Whether ``jacobian`` can be called."""
        description = self.description
        return bool(
            description.states
            and description.capabilities.get("providesDirectionalDerivative")
            and len(description.state_references) == description.states
        )

    def jacobian(self, out: FloatArray) -> None:
        """Write df/dx (n, n) at the present point into ``out``, column by column."""
        references = np.array(self.description.state_references, dtype=np.uint32)
        column = np.empty(len(references))
        for j in range(len(references)):
            self.directional_derivative(references[:, 1], references[j : j + 1, 0], column)
            out[:, j] = column
