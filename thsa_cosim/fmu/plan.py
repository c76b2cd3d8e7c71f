"""One experiment prepared for one FMU: communication points and tables of input values."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.errors import ParameterError
from thsa_cosim.fmu.failure import SimulationFailure, Status
from thsa_cosim.fmu.inputs import (
    communication_grid,
    input_mode,
    input_modes,
    input_variables,
    is_linear,
    sampled,
)
from thsa_cosim.fmu.instance import Channel, Instance
from thsa_cosim.signals import FloatArray, Signals


class Plan:
    """One experiment prepared for one instance: communication points, input tables, output channels."""

    def __init__(
        self, instance: Instance, inputs: Signals | None, outputs: Sequence[str], time: FloatArray
    ) -> None:
        description = instance.description
        self.grid = communication_grid(time)
        self.outputs = tuple(outputs)
        variables = input_variables(description, inputs)
        self.input_channels = instance.channels(variables)
        output_variables = [description.variable(name) for name in outputs]
        self.output_channels = instance.channels(output_variables)
        self.units = {v.name: v.unit or "1" for v in output_variables}
        linear = np.array([is_linear(inputs, v) for v in variables], dtype=bool)
        ramps = [v for v, yes in zip(variables, linear, strict=True) if yes]
        self.mode = instance.input_mode or input_mode(description, ramps)
        if self.mode not in input_modes(description, ramps):
            raise ParameterError(
                f"{description.path} cannot be given its inputs by {self.mode!r}; "
                f"choose one of {', '.join(input_modes(description, ramps))}."
            )
        table = sampled(inputs, variables, self.grid.times)
        self.first = table[0] if variables else np.empty(0)
        moves = (table != table[0]).any(axis=0)
        begin = table.copy()
        if self.mode == "mean":
            begin[:-1, linear] = 0.5 * (table[:-1, linear] + table[1:, linear])
        # An input that never moves is set once, before the first step.
        self.begin = self._rows(begin, moves)
        # With slopes given, linear inputs have arrived at u(t_k+1) by themselves.
        arrives = linear if self.mode == "derivative" else np.zeros_like(linear)
        self.end = self._rows(table, moves & ~arrives)
        uses_slopes = self.mode in ("derivative", "intermediate") and (moves & linear).any()
        self.smooth = self._smooth_channel(table, moves & linear) if uses_slopes else None
        self.inputs, self.input_variables, self.linear = inputs, variables, linear
        self.tables: Any = None
        """Kept here by ``stepping`` between runs."""
        self.courses: dict[float, Any] = {}
        """Kept here by ``trajectory`` between runs."""

    def recorded(self, values: Mapping[str, FloatArray]) -> Signals:
        """The outputs at the communication points; SimulationFailure if the FMU has spoilt those."""
        try:
            return Signals(self.grid.times, values, self.units)
        except ValueError:
            raise SimulationFailure(
                Status.CRASH, "the FMU has overwritten memory that is not its own (the communication points)"
            ) from None

    def _rows(self, table: FloatArray, wanted: NDArray[np.bool_]) -> list[tuple[Channel, NDArray[Any]]]:
        """One contiguous (n, variables) table per data type, of the ``wanted`` columns."""
        rows = []
        for channel in self.input_channels:
            inside = [i for i, c in enumerate(channel.columns) if wanted[c]]
            if inside:
                columns = tuple(channel.columns[i] for i in inside)
                part = Channel(channel.suffix, channel.references[inside], channel.dtype, columns)
                rows.append((part, np.ascontiguousarray(table[:, columns].astype(channel.dtype))))
        return rows

    def _smooth_channel(
        self, table: FloatArray, wanted: NDArray[np.bool_]
    ) -> tuple[Channel, FloatArray, FloatArray, NDArray[np.int32]] | None:
        """Linear double inputs: channel, values (n, m), slopes (n-1, m), derivative orders (m,)."""
        for channel in self.input_channels:
            if channel.suffix not in ("Real", "Float64"):
                continue
            inside = [i for i, c in enumerate(channel.columns) if wanted[c]]
            columns = [channel.columns[i] for i in inside]
            values = np.ascontiguousarray(table[:, columns])
            slopes = np.ascontiguousarray(np.diff(values, axis=0) / self.grid.steps[:, None])
            part = Channel(channel.suffix, channel.references[inside], channel.dtype, tuple(columns))
            return part, values, slopes, np.ones(len(inside), dtype=np.int32)
        return None
