"""What the integrator asks of an instance some thousand times a second: functions and buffers are bound once."""

import ctypes
from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np

from thsa_cosim.signals import FloatArray

if TYPE_CHECKING:
    from thsa_cosim.fmu.instance import Channel, Instance


class Point(Protocol):
    """A model in Continuous-Time Mode at one time, with states and inputs."""

    def place(self, time: float, states: FloatArray, inputs: FloatArray) -> None:
        """Set the time [s], the states (n,) and the inputs (m,), of which only continuous ones are set."""
        ...

    def derivatives(self, time: float) -> FloatArray:
        """Return dx/dt (n,) there, in a buffer that the next call overwrites."""
        ...


class InstancePoint:
    """The point of one FMU instance (FMI 2.0.4 clause 3.2.2, FMI 3.0.2 clause 3.2.1)."""

    def __init__(self, instance: "Instance", input_channels: "Sequence[Channel]") -> None:
        self._instance = instance
        n = instance.description.states
        pointer, function, prefix = ctypes.c_void_p, instance.library.function, instance.prefix
        self._derivatives = "GetContinuousStateDerivatives" if prefix == "fmi3" else "GetDerivatives"
        self._x, self._dx = np.zeros(n), np.zeros(n)
        self._x_address, self._dx_address = self._x.ctypes.data, self._dx.ctypes.data
        self._set_time = function(f"{prefix}SetTime", pointer, ctypes.c_double)
        self._set_states = function(f"{prefix}SetContinuousStates", pointer, pointer, ctypes.c_size_t)
        self._get_derivatives = function(f"{prefix}{self._derivatives}", pointer, pointer, ctypes.c_size_t)
        self._continuous = [
            (
                channel,
                np.zeros(len(channel.references), dtype=channel.dtype),
                list(channel.columns),
                instance.value_function("Set", channel.suffix),
            )
            for channel in input_channels
            if channel.dtype.kind == "f"
        ]
        """Outside of Event Mode only continuous inputs may change."""

    def place(self, time: float, states: FloatArray, inputs: FloatArray) -> None:
        """See :class:`Point`."""
        instance, n = self._instance, len(self._x)
        if code := self._set_time(instance.handle, time):
            instance.check(code, "SetTime", time)
        if n:
            self._x[:] = states
            if code := self._set_states(instance.handle, self._x_address, n):
                instance.check(code, "SetContinuousStates", time)
        for channel, buffer, columns, setter in self._continuous:
            buffer[:] = inputs[columns] if channel.signs is None else inputs[columns] * channel.signs
            code = instance.access(setter, channel.references.ctypes.data, len(buffer), buffer.ctypes.data)
            if code:
                instance.check(code, f"Set{channel.suffix}", time)

    def derivatives(self, time: float) -> FloatArray:
        """See :class:`Point`."""
        if len(self._dx) and (
            code := self._get_derivatives(self._instance.handle, self._dx_address, len(self._dx))
        ):
            self._instance.check(code, self._derivatives, time)
        return self._dx
