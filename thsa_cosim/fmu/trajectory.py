"""A whole run in one call: what FMUs of ``thsa_cosim.export`` offer beside the FMI (``runtime/trajectory.h``).

The FMU's solver steps across samples, stops where an input bends or jumps and at events, and fills the rows from its
dense output. An FMU that does not export the function is stepped through its communication points (``stepping``).
"""

import copy
import ctypes
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.fmu.description import FmuDescription
from thsa_cosim.fmu.instance import Instance, Phase
from thsa_cosim.fmu.plan import Plan
from thsa_cosim.fmu.segments import MERGED, Segments, segments
from thsa_cosim.signals import FloatArray, Signals

FUNCTION = "thsaTrajectory1"
SAFETY, LOOSEST = 0.5, 5e-5
"""The FMU's solver is given this share of the tolerance, and no larger one. On a grid of samples steps are shorter than
any tolerance asks for; free ones are as long as it allows. The rig's sensors see 5e-5 of full speed as 0.07 standard
deviations; what every shipped scenario errs by is printed by ``benchmarks/stepping.py``."""
DENSE = 0.5
"""Share of samples at which an input bends or jumps from which on steps are as short as on the grid: the tolerance is
then the one that is asked for."""


class Trajectory(ctypes.Structure):
    """``Trajectory`` of ``runtime/trajectory.h``."""

    _fields_: ClassVar = [
        *((name, ctypes.c_size_t) for name in ("n_inputs", "n_segments", "n_outputs", "n_times")),
        *((name, ctypes.c_void_p) for name in ("inputs", "starts", "values", "slopes", "outputs", "times")),
        *((name, ctypes.c_void_p) for name in ("results", "progress")),
        *((name, ctypes.c_size_t) for name in ("done", "steps", "rejected", "events")),
        ("reached", ctypes.c_double),
    ]


class Course:
    """The arrays of one plan for one FMU, and the C struct that points to them; reused by every run."""

    def __init__(self, plan: Plan, merged: float) -> None:
        self.segments: Segments = segments(
            plan.inputs, plan.input_variables, plan.linear, plan.grid.times, merged
        )
        inputs = [v.value_reference for v in plan.input_variables]
        self._inputs = np.array(inputs, dtype=np.uint32)
        references = np.zeros(len(plan.outputs), dtype=np.uint32)
        for channel in plan.output_channels:
            references[list(channel.columns)] = channel.references
        self._outputs, self._times = references, plan.grid.times
        stretches = self.segments
        self.struct = Trajectory(len(inputs), len(stretches), len(references), len(self._times))
        arrays: dict[str, NDArray[Any]] = {
            "inputs": self._inputs,
            "starts": stretches.starts,
            "values": stretches.values,
            "slopes": stretches.slopes,
            "outputs": self._outputs,
            "times": self._times,
        }
        for name, array in arrays.items():
            setattr(self.struct, name, array.ctypes.data)
        self.signals: Signals | None = None


def is_expected(description: FmuDescription) -> bool:
    """Whether an FMU says that it comes from our exporter, so that ``is_offered`` will be true of its library."""
    return description.tool.startswith("thsa")


def is_offered(instance: Instance) -> bool:
    """Whether the FMU runs whole trajectories."""
    return instance.kind == "co-simulation" and instance.library.exports(FUNCTION)


def solver_tolerance(instance: Instance, plan: Plan, tolerance: float | None) -> float:
    """The tolerance that the FMU is given for ``tolerance`` (None: that of its default experiment)."""
    wanted = tolerance or instance.description.default_experiment.tolerance or 1e-6
    tight = min(LOOSEST, SAFETY * wanted)
    bends = len(_course(plan, tight).segments) > DENSE * len(plan.grid.times)
    return wanted if bends else tight


def _course(plan: Plan, tolerance: float) -> Course:
    merged = min(MERGED, tolerance)
    if merged not in plan.courses:
        plan.courses[merged] = Course(plan, merged)
    course: Course = plan.courses[merged]
    return course


def follow(
    instance: Instance, plan: Plan, progress: FloatArray, tolerance: float, most_steps: int | None = None
) -> Signals:
    """Run an initialised instance through ``plan``; SimulationFailure if it does not reach the end.

    ``tolerance``: what ``solver_tolerance`` gave. Inputs keep within it, and within ``segments.MERGED``, of their
    samples. ``most_steps``: attempts at a step that the run may take; older FMUs know no such limit.
    """
    course = _course(plan, tolerance)
    struct, n = course.struct, len(plan.grid.times)
    results = np.empty((len(plan.outputs), n))
    struct.results, struct.progress = results.ctypes.data, progress[1:].ctypes.data
    struct.steps = most_steps or 0
    progress[0] = Phase.STEP
    function = instance.library.function(FUNCTION, ctypes.c_void_p, ctypes.c_void_p)
    code = function(instance.handle, ctypes.addressof(struct))
    if code not in (0, 1):
        instance.check(code, FUNCTION, float(struct.reached))
    values = dict(zip(plan.outputs, results, strict=True))
    if course.signals is None:
        course.signals = plan.recorded(values)
        return course.signals
    # The time axis was checked when the first run built its signals.
    signals = copy.copy(course.signals)
    object.__setattr__(signals, "values", values)
    return signals
