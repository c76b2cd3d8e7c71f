"""What the integrator asks of a system some thousand times a second."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from thsa_cosim.fmu.instance import Channel
from thsa_cosim.signals import FloatArray

if TYPE_CHECKING:
    from thsa_cosim.system.instance import SystemInstance


class SystemPoint:
    """The point of a system; see ``thsa_cosim.fmu.point.Point``."""

    def __init__(self, instance: "SystemInstance", input_channels: Sequence[Channel]) -> None:
        self._instance = instance
        self._channels = _continuous_only(instance, input_channels)
        self._dx = np.zeros(instance.description.states)

    def place(self, time: float, states: FloatArray, inputs: FloatArray) -> None:
        """Set time, states and inputs, then bring the connections up to date."""
        self._instance.place_states(time, states)
        self._instance.set_values(self._channels, inputs)
        self._instance.propagate()

    def derivatives(self, time: float) -> FloatArray:
        """Return dx/dt."""
        del time
        self._instance.derivatives(self._dx)
        return self._dx


def _continuous_only(instance: "SystemInstance", channels: Sequence[Channel]) -> list[Channel]:
    variables = list(instance.description.variables.values())
    found = []
    for channel in channels:
        keep = [
            i
            for i, reference in enumerate(channel.references.tolist())
            if variables[reference].is_float and variables[reference].variability == "continuous"
        ]
        columns = tuple(channel.columns[i] for i in keep)
        found.append(replace(channel, references=channel.references[keep], columns=columns))
    return [channel for channel in found if len(channel.references)]
