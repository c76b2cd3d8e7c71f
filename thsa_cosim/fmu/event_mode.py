"""FMI 3.0 Co-Simulation with Event Mode: for FMUs whose clocks the importer has to tick (clause 4.2.1).

A communication step ends early at a tick, and where the FMU asks for an event or returns early; then the clocks are
activated in Event Mode, discrete inputs are set, and the step goes on. All other FMUs are stepped by ``stepping``.
"""

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.fmu.clocks import Schedule
from thsa_cosim.fmu.description import FmuDescription
from thsa_cosim.fmu.failure import SimulationFailure, Status
from thsa_cosim.fmu.fmi3 import Fmi3Instance
from thsa_cosim.fmu.inputs import sampled
from thsa_cosim.fmu.instance import Channel, Instance, Phase
from thsa_cosim.fmu.plan import Plan
from thsa_cosim.signals import FloatArray, Signals

_EVENTS_AT_ONE_TIME = 200


def needs_events(description: FmuDescription, kind: str) -> bool:
    """Whether an FMU is to be stepped with Event Mode: it has clocks that tick by time."""
    timed = any(clock.is_timed for clock in description.clocks)
    return kind == "co-simulation" and timed and bool(description.capabilities.get("hasEventMode"))


def handle_event(instance: Instance, schedule: Schedule | None, time: float) -> tuple[bool, float | None]:
    """Tick the clocks that are due and iterate, in Event Mode; return (terminate, next event time of the FMU's own).

    SimulationFailure if the iteration does not come to an end.
    """
    following: float | None = None
    for _ in range(_EVENTS_AT_ONE_TIME):
        ticked = schedule.due(time) if schedule is not None else []
        if ticked and isinstance(instance, Fmi3Instance):
            instance.activate_clocks(ticked)
        info = instance.event_iteration()
        following = info.next_event_time
        if info.terminate:
            return True, following
        again = schedule is not None and schedule.refresh(time, ticked)
        if not info.needs_update and not again:
            return False, following
    raise SimulationFailure(Status.FMI_ERROR, "the event iteration does not come to an end")


class _Stepping:
    def __init__(self, instance: Fmi3Instance, plan: Plan, progress: FloatArray, start: float) -> None:
        self.instance, self.plan, self.progress = instance, plan, progress
        self.schedule = Schedule(instance, instance.description.clocks, start)
        self.inputs = sampled(plan.inputs, plan.input_variables, plan.grid.times)
        smooth = [v.is_float and v.variability == "continuous" for v in plan.input_variables]
        self.smooth = np.array(smooth, dtype=bool)
        self.channels = [
            part for channel in plan.input_channels if (part := _part(channel, self.smooth)) is not None
        ]
        """Continuous inputs: those that may change in Step Mode."""

    def event(self, time: float, row: FloatArray) -> None:
        """Go through Event Mode, with all inputs at ``row``."""
        self.instance.enter_event_mode()
        self.instance.set_values(self.plan.input_channels, row)
        self._iterate(time)

    def _iterate(self, time: float) -> None:
        terminate, _ = handle_event(self.instance, self.schedule, time)
        if terminate:
            self._ended(time)
        self.instance.call("EnterStepMode")

    def _ended(self, time: float) -> None:
        reason = f"the FMU ended the simulation at t = {time:.9g} s of {self.plan.grid.times[-1]:.9g} s"
        raise SimulationFailure(Status.INCOMPLETE, reason + self.instance.messages.last())

    def run(self) -> FloatArray:
        """Step an instance that has just left Initialization Mode; return the outputs, (n, outputs)."""
        plan, instance, times = self.plan, self.instance, self.plan.grid.times
        rows = np.full((len(times), len(plan.outputs)), np.nan)
        self.schedule.begin()
        self._iterate(float(times[0]))
        self._record(rows, 0)
        self.progress[0] = Phase.STEP
        for k in range(len(times) - 1):
            self.progress[1], self.progress[2] = times[k], k
            held = self.inputs[k]
            if plan.mode == "mean":
                held = np.where(plan.linear, 0.5 * (self.inputs[k] + self.inputs[k + 1]), held)
            instance.set_values(self.channels, held)
            self._step(float(times[k]), float(times[k + 1]), held)
            changed = (self.inputs[k + 1] != self.inputs[k])[~self.smooth].any()
            if changed:
                self.event(float(times[k + 1]), self.inputs[k + 1])
            else:
                instance.set_values(self.channels, self.inputs[k + 1])
            self._record(rows, k + 1)
        return rows

    def _step(self, time: float, end: float, held: FloatArray) -> None:
        """Go from ``time`` to ``end``, with stops at ticks and events."""
        slack = 1e-9 * (end - time)
        here = 0
        while time < end - slack:
            stop = min(end, max(self.schedule.next, time))
            if stop > time + slack:
                reached, wants_event, terminate = self.instance.step(time, stop - time)
                if terminate and reached < float(self.plan.grid.times[-1]) - slack:
                    self._ended(reached)
                stop = stop if reached > stop - slack else reached
            else:
                wants_event = False
            here = here + 1 if stop <= time + slack else 0
            if here > _EVENTS_AT_ONE_TIME:
                reason = f"the FMU does not get past t = {time:.9g} s"
                raise SimulationFailure(Status.INCOMPLETE, reason + self.instance.messages.last())
            time = stop
            if wants_event or self.schedule.next <= time + slack:
                self.event(time, held)

    def _record(self, rows: FloatArray, k: int) -> None:
        self.instance.get_values(self.plan.output_channels, rows[k])
        if not np.isfinite(rows[k]).all():
            i = int(np.argmin(np.isfinite(rows[k])))
            reason = f"{self.plan.outputs[i]} became {rows[k, i]} at t = {self.plan.grid.times[k]:.9g} s"
            raise SimulationFailure(Status.NOT_FINITE, reason)


def _part(channel: Channel, wanted: NDArray[np.bool_]) -> Channel | None:
    inside = [i for i, column in enumerate(channel.columns) if wanted[column]]
    if not inside:
        return None
    columns = tuple(channel.columns[i] for i in inside)
    return Channel(channel.suffix, channel.references[inside], channel.dtype, columns)


def step_with_events(instance: Fmi3Instance, plan: Plan, progress: FloatArray) -> Signals:
    """Run an initialised instance through ``plan``; SimulationFailure if it does not reach the end."""
    rows = _Stepping(instance, plan, progress, float(plan.grid.times[0])).run()
    values = {name: np.ascontiguousarray(rows[:, i]) for i, name in enumerate(plan.outputs)}
    return plan.recorded(values)
