"""From sampled inputs to what an FMU is given at every communication point.

Inputs are piecewise linear between the samples of a recording, or hold from sample to sample where
``Signals.held`` names them, and are constant outside of the recording. Between two communication points
t_k and t_k+1 the FMU is given, for linear inputs, one of

``derivative``
    FMI 2.0 with ``canInterpolateInputs``: u(t_k) and the slope (u(t_k+1) - u(t_k)) / h by
    fmi2SetRealInputDerivatives (clause 4.2.1). Exact where samples lie on communication points.
``intermediate``
    FMI 3.0 with intermediate update and inputs that allow it: u(t) whenever the FMU asks (clause 4.2.2).
    Exact likewise.
``mean``
    The mean (u(t_k) + u(t_k+1)) / 2, held over the step, so that the states see the input
    without delay (second order in h).
``hold``
    u(t_k), held over the step: delays by h/2 (first order in h), but an FMU whose own solver looks at the input
    at both ends of its step may want just that.

Held, discrete, Integer and Boolean inputs keep u(t_k) over the step. Outputs at t_k are always read with
u(t_k) applied, so that row k of the result belongs to row k of the input also under direct feed-through.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from thsa_cosim.errors import ParameterError
from thsa_cosim.fmu.description import FmuDescription
from thsa_cosim.fmu.variable import Variable
from thsa_cosim.signals import FloatArray, Signals


@dataclass(frozen=True)
class Grid:
    """Communication points: ``times`` (n,) and ``steps`` (n-1,) in s."""

    times: FloatArray
    steps: FloatArray

    @property
    def stop(self) -> float:
        """Last communication point [s], not below what the steps add up to."""
        reached = self.times[-2] + self.steps[-1] if len(self.times) > 1 else self.times[-1]
        return float(max(self.times[-1], reached))


def communication_grid(time: FloatArray) -> Grid:
    """Return the communication points for output times ``time`` (n,) in s, strictly increasing.

    Equally spaced times (to 1e-6 of the step) get one step size bit for bit: some FMUs refuse a step
    that differs from the last in its last digit.
    """
    time = np.ascontiguousarray(time, dtype=np.float64)
    if time.ndim != 1 or len(time) < 1 or not np.isfinite(time).all() or not (np.diff(time) > 0.0).all():
        raise ParameterError("The output times must be finite and strictly increasing, at least one of them.")
    if len(time) < 3:
        return Grid(time, np.diff(time))
    step = (time[-1] - time[0]) / (len(time) - 1)
    even = time[0] + step * np.arange(len(time))
    if np.max(np.abs(even - time)) <= 1e-6 * step:
        return Grid(even, np.full(len(time) - 1, step))
    return Grid(time, np.diff(time))


def input_variables(description: FmuDescription, inputs: Signals | None) -> list[Variable]:
    """Return the FMU's inputs that ``inputs`` drives; ParameterError for a name that is none."""
    variables = []
    for name in inputs.names if inputs is not None else ():
        variable = description.variable(name)
        if variable.causality != "input":
            raise ParameterError(
                f"{description.path}: {name} is no input but a {variable.causality}; "
                f"inputs are {', '.join(v.name for v in description.inputs) or 'none'}."
            )
        variables.append(variable)
    return variables


def is_linear(inputs: Signals | None, variable: Variable) -> bool:
    """Tell whether an input runs linearly between samples (and does not hold)."""
    held = inputs is not None and variable.name in inputs.held
    return variable.is_float and variable.variability == "continuous" and not held


def sampled(inputs: Signals | None, variables: Sequence[Variable], times: FloatArray) -> FloatArray:
    """Return the inputs at ``times``: (n, inputs); linear or held, whole numbers for what is no float."""
    table = np.empty((len(times), len(variables)))
    if inputs is None or not variables:
        return table
    held = frozenset(v.name for v in variables if not is_linear(inputs, v))
    at_times = Signals(inputs.time, inputs.values, inputs.units, held).resample(times)
    for column, variable in enumerate(variables):
        values = at_times[variable.name]
        table[:, column] = values if variable.is_float else np.rint(values)
    return table


MODES = ("hold", "mean", "derivative", "intermediate")
"""Ways to give linear inputs, see above; "hold" keeps u(t_k) over the step."""


def input_modes(description: FmuDescription, linear: Sequence[Variable]) -> tuple[str, ...]:
    """Return the ways that an FMU offers to give the linear inputs ``linear``, in the order of ``MODES``."""
    modes = ["hold", "mean"]
    if description.fmi_version == "2.0" and description.capabilities.get("canInterpolateInputs"):
        modes.append("derivative")
    if (
        description.fmi_version == "3.0"
        and description.capabilities.get("providesIntermediateUpdate")
        and not description.clocks
        and all(v.intermediate_update and v.type == "Float64" for v in linear)
    ):
        modes.append("intermediate")
    return tuple(modes)


def input_mode(description: FmuDescription, linear: Sequence[Variable]) -> str:
    """Return the way to give linear inputs where nothing was tried: the best one for our own FMUs, else "mean".

    What a foreign FMU offers beyond holding may be wrong: Dymola's Co-Simulation is off by a third of the range
    after a kink if input derivatives are set. A trial (``batch.handling``) finds the best one.
    """
    return input_modes(description, linear)[-1] if is_ours(description) else "mean"


def is_ours(description: FmuDescription) -> bool:
    """Tell whether this toolkit has exported an FMU, so that what it offers is known to be right."""
    return description.tool.startswith("thsa-cosim")
