"""Model Exchange: our own integration of an FMU's right-hand side, with all of its events.

Inputs are applied as u(t) at every call of the right-hand side, so results do not depend on the output
times: outputs between the solver's steps come from its interpolation of the states. Integration stops at every
kink of a linear input (no pulse is stepped over; see ``segments``) and restarts, through Event Mode, wherever an
input jumps. State events are located by CVODE's root finding, and the signs of the event indicators are compared
after every step as well (an indicator that returns from exactly zero has no root); time and step events follow
FMI 2.0.4 clause 3.2 and FMI 3.0.2 clause 3.2.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from thsa_cosim.fmu.clocks import Schedule
from thsa_cosim.fmu.cvode import Cvode
from thsa_cosim.fmu.event_mode import handle_event
from thsa_cosim.fmu.failure import SimulationFailure, Status
from thsa_cosim.fmu.fmi3 import Fmi3Instance
from thsa_cosim.fmu.instance import Instance, Phase
from thsa_cosim.fmu.plan import Plan
from thsa_cosim.fmu.segments import MERGED, segments, time_slack
from thsa_cosim.signals import FloatArray, Signals

_SAFETY = 0.1
"""Local errors are held this much below the tolerance, so that global errors come out near it."""
_EVENTS_AT_ONE_TIME = 200
_CRAWL = 1e-9
_CRAWLING_STEPS = 1000
"""So many steps in a row below _CRAWL of the simulated time: the solver creeps up to a point without end."""


@dataclass(frozen=True)
class Segment:
    """A stretch of time over which every input is linear: u(t) = value + slope (t - start)."""

    start: float
    stop: float
    value: FloatArray
    slope: FloatArray
    jumps: bool
    """Whether some input jumps at ``start``."""


def stretches(plan: Plan, merged: float) -> list[Segment]:
    """Return the linear stretches of the inputs between the first and the last output time."""
    found = segments(plan.inputs, plan.input_variables, plan.linear, plan.grid.times, merged)
    ends = [*found.starts[1:].tolist(), found.stop]
    return [
        Segment(float(start), end, value, slope, bool(jumps))
        for start, end, value, slope, jumps in zip(
            found.starts, ends, found.values, found.slopes, found.jumps, strict=True
        )
    ]


class _Run:
    """One integration from the first to the last output time."""

    def __init__(self, instance: Instance, plan: Plan, progress: FloatArray, tolerance: float | None) -> None:
        self.instance, self.plan, self.progress = instance, plan, progress
        description = instance.description
        self.rtol = _SAFETY * (tolerance or description.default_experiment.tolerance or 1e-6)
        self.nx, self.nz = description.states, description.event_indicators
        self.segment = Segment(0.0, 0.0, np.empty(0), np.empty(0), False)
        self.rows = np.full((len(plan.grid.times), len(plan.outputs)), np.nan)
        self.next_row = 0
        self.next_event: float | None = None
        self.ends = False
        self.schedule: Schedule | None = None
        if isinstance(instance, Fmi3Instance) and description.clocks:
            self.schedule = Schedule(instance, description.clocks, float(plan.grid.times[0]))
        self._z = np.zeros(self.nz)
        self.point = instance.point(plan.input_channels)

    # -- the FMU at one point -------------------------------------------------------------------------
    def place(self, time: float, states: FloatArray) -> None:
        """Give the FMU a time, states and the inputs there."""
        self.progress[1] = time
        segment = self.segment
        self.point.place(time, states, segment.value + segment.slope * (time - segment.start))

    def apply_inputs(self, time: float) -> None:
        """Set all inputs to u(time), in Event Mode or before."""
        segment = self.segment
        values = segment.value + segment.slope * (time - segment.start)
        self.instance.set_values(self.plan.input_channels, values)

    def rhs(self, time: float, states: FloatArray, out: FloatArray) -> None:
        """dx/dt for CVODE."""
        self.place(time, states)
        if not self.nx:
            out[:] = 0.0
            return
        out[:] = self.point.derivatives(time)
        if not np.isfinite(out).all():
            i = int(np.argmin(np.isfinite(out)))
            reason = f"the derivative of state {i + 1} became {out[i]} at t = {time:.9g} s"
            raise SimulationFailure(Status.NOT_FINITE, reason)

    def roots(self, time: float, states: FloatArray, out: FloatArray) -> None:
        """Event indicators for CVODE."""
        self.place(time, states)
        self.instance.vector("GetEventIndicators", self._z)
        out[:] = self._z

    def signs(self) -> FloatArray:
        """Signs of the event indicators at the present point."""
        if self.nz:
            self.instance.vector("GetEventIndicators", self._z)
        return np.asarray(self._z > 0.0, dtype=np.float64)

    def record(self, time: float, states: FloatArray) -> None:
        """Read the outputs as the next row."""
        self.place(time, states)
        row = self.rows[self.next_row]
        self.instance.get_values(self.plan.output_channels, row)
        if not np.isfinite(row).all():
            i = int(np.argmin(np.isfinite(row)))
            reason = f"{self.plan.outputs[i]} became {row[i]} at t = {time:.9g} s"
            raise SimulationFailure(Status.NOT_FINITE, reason)
        self.next_row += 1

    def states(self) -> FloatArray:
        """Present continuous states; one that stands still if the FMU has none."""
        x = np.ones(max(self.nx, 1))
        if self.nx:
            self.instance.vector("GetContinuousStates", x)
        return x

    def absolute_tolerance(self) -> FloatArray:
        """rtol times the nominal values of the states, as the FMI suggests (FMI 2.0.4 clause 2.2.7)."""
        nominal = np.ones(max(self.nx, 1))
        if self.nx:
            self.instance.vector("GetNominalsOfContinuousStates", nominal)
        usable = np.isfinite(nominal) & (nominal != 0.0)
        return self.rtol * np.where(usable, np.abs(nominal), 1.0)

    # -- events ---------------------------------------------------------------------------------------
    def iterate_events(self, time: float) -> None:
        """Event iteration in Event Mode, clocks that are due included, then on to Continuous-Time Mode."""
        terminate, self.next_event = handle_event(self.instance, self.schedule, time)
        self.ends |= terminate
        if self.schedule is not None and np.isfinite(self.schedule.next):
            own = np.inf if self.next_event is None else self.next_event
            self.next_event = min(own, self.schedule.next)
        self.instance.enter_continuous_time_mode()

    def event(self, time: float, solver: Cvode) -> None:
        """Handle an event at the present point and restart the solver."""
        self.instance.enter_event_mode()
        if self.plan.input_channels:
            self.apply_inputs(time)
        self.iterate_events(time)
        solver.restart(time, self.states(), self.absolute_tolerance())

    # -- the loop -------------------------------------------------------------------------------------
    def integrate(self) -> None:
        times = self.plan.grid.times
        slack = time_slack(times)
        following: Iterator[Segment] = iter(stretches(self.plan, min(MERGED, self.rtol)))
        self.segment = next(following)
        instance, t1, t = self.instance, float(times[-1]), float(times[0])
        instance.initialize_begin(t, t1, self.rtol)
        if self.plan.input_channels:
            self.apply_inputs(t)
        instance.initialize_end()
        if self.schedule is not None:
            self.schedule.begin()
        self.iterate_events(t)
        self.progress[0] = Phase.STEP
        solver = Cvode(
            t,
            self.states(),
            self.rhs,
            rtol=self.rtol,
            atol=self.absolute_tolerance(),
            roots=self.roots,
            root_count=self.nz,
            jacobian=self.jacobian if instance.has_jacobian else None,
        )
        try:
            self.record(t, solver.states)
            signs = self.signs()
            here = crawled = 0
            while t < t1 - slack and not self.ends:
                stop = min(self.segment.stop, t1)
                if self.next_event is not None:
                    stop = min(stop, max(self.next_event, t))
                if not self.nx:
                    stop = min(stop, float(times[self.next_row]))
                before = t
                if stop - t > slack * 1e-3 and (self.nx or self.nz):
                    t, is_root = solver.step(stop)
                else:
                    t, is_root = stop, False
                crawled = crawled + 1 if t - before < _CRAWL * (t1 - float(times[0])) else 0
                if crawled > _CRAWLING_STEPS:
                    reason = f"the integrator does not get past t = {t:.9g} s"
                    raise solver.failure or SimulationFailure(Status.INCOMPLETE, reason)
                while self.next_row < len(times) and times[self.next_row] < t - slack:
                    self.record(float(times[self.next_row]), solver.at(float(times[self.next_row])))
                self.place(t, solver.states)
                step_event, terminate = self._completed()
                self.ends |= terminate
                is_time_event = self.next_event is not None and t >= self.next_event - 1e-3 * slack
                is_jump = self._advance_segment(t, slack, following)
                is_state_event = is_root or bool((self.signs() != signs).any())
                if step_event or is_time_event or is_jump or is_state_event:
                    here = here + 1 if t - before <= slack * 1e-3 else 0
                    if here > _EVENTS_AT_ONE_TIME:
                        reason = f"events follow each other without end at t = {t:.9g} s"
                        raise SimulationFailure(Status.FMI_ERROR, reason)
                    self.event(t, solver)
                    self.place(t, solver.states)
                    signs = self.signs()
                while self.next_row < len(times) and times[self.next_row] <= t + slack and not self.ends:
                    self.record(t, solver.states)
            while self.next_row < len(times) and times[self.next_row] <= t + slack:
                self.record(t, solver.states)  # it ended itself just where the run ends
        finally:
            solver.close()
        if self.next_row < len(times):
            reason = f"the FMU ended the simulation at t = {t:.9g} s of {t1:.9g} s"
            raise SimulationFailure(Status.INCOMPLETE, reason + instance.messages.last())

    def _completed(self) -> tuple[bool, bool]:
        if not self.instance.description.capabilities.get("needsCompletedIntegratorStep", True):
            return False, False
        return self.instance.completed_integrator_step()

    def _advance_segment(self, time: float, slack: float, later: Iterator[Segment]) -> bool:
        """Go on to the stretch of inputs that begins at ``time``; return whether an input jumps there."""
        jumps = False
        while time >= self.segment.stop - 1e-3 * slack:
            segment = next(later, None)
            if segment is None:
                break
            self.segment = segment
            jumps |= segment.jumps
        return jumps

    # -- exact Jacobian -------------------------------------------------------------------------------
    def jacobian(self, time: float, states: FloatArray, out: FloatArray) -> None:
        """df/dx for CVODE."""
        self.place(time, states)
        self.instance.jacobian(out)


def integrate(instance: Instance, plan: Plan, progress: FloatArray, tolerance: float | None) -> Signals:
    """Initialise and integrate an instance; SimulationFailure if it does not reach the end.

    ``tolerance`` is relative; None: the FMU's default experiment, else 1e-6.
    """
    run = _Run(instance, plan, progress, tolerance)
    run.integrate()
    progress[0] = Phase.TERMINATE
    instance.terminate()
    values = {name: np.ascontiguousarray(run.rows[:, i]) for i, name in enumerate(plan.outputs)}
    return plan.recorded(values)
