"""Components that go on by Co-Simulation, at communication steps or ticks of their own.

``coupled``: at t_k+1 the component steps from t_k with the mean of its inputs at both ends (second order in the step,
as in ``thsa_cosim.fmu.inputs``); between its steps the others see its outputs extrapolated linearly, which again is of
second order. ``sampled``: at its tick t_k a controller takes its inputs as they are, and its outputs change at once
(or ``delay`` later) and are held; so a continuous PI that is exported as Co-Simulation becomes its sampled form. Ticks
may be late (``jitter``); the controller goes on in its nominal step all the same, as one with a fixed gain does.
"""

import zlib
from collections.abc import Sequence

import numpy as np

from thsa_cosim.fmu.instance import Instance
from thsa_cosim.signals import FloatArray
from thsa_cosim.system.structure import Component
from thsa_cosim.system.wiring import Port, Wiring

_TIME = 1e-9
"""Ticks closer than this share of a step are one."""


class Stepped:
    """One Co-Simulation component between its steps."""

    def __init__(
        self, component: Component, instance: Instance, wiring: Wiring, driven: Sequence[str]
    ) -> None:
        """``driven``: its inputs that come from outside the system."""
        assert component.step is not None
        self.component, self.instance = component, instance
        self._wiring, self._step = wiring, component.step
        columns = [k for k, pin in enumerate(wiring.targets) if pin[0] == component.name]
        self._targets = np.array(columns, dtype=np.intp)
        names = [wiring.targets[k][1] for k in columns]
        self._inputs = Port(instance, [*names, *driven], range(len(names) + len(driven)))
        self._floats = np.array(
            [instance.description.variable(n).is_float for n in (*names, *driven)], dtype=bool
        )
        self._sources = np.array(
            [k for k, pin in enumerate(wiring.sources) if pin[0] == component.name], dtype=np.intp
        )
        self._outputs = Port(
            instance, [wiring.sources[k][1] for k in self._sources], range(len(self._sources))
        )
        self._driven = list(driven)
        self.outside = np.array(
            [instance.description.variable(n).start or 0.0 for n in driven], dtype=np.float64
        )
        """Present values of ``driven``."""
        self._ticks = 0
        self.is_first = True
        self._start = self.since = 0.0
        self.before = np.zeros(len(names) + len(driven))
        self.now = np.zeros(len(self._sources))
        self.slope = np.zeros(len(self._sources))
        self._waiting: tuple[float, FloatArray] | None = None
        self._late = np.random.default_rng(0)
        self._tick = 0.0

    def begin(self, time: float) -> None:
        """Take the state after initialisation."""
        self._start = self.since = time
        self._ticks = 0 if self.component.execution == "sampled" else 1
        self._waiting = None
        self.is_first = True
        self.slope[:] = 0.0
        self._late = np.random.default_rng(zlib.crc32(self.component.name.encode()))
        self._tick = self._next_tick()
        self.now = self._read()
        self.before = self._present()

    def put(self, time: float) -> None:
        """Put the outputs at ``time`` into the wiring's values."""
        self._wiring.values[self._sources] = self.now + self.slope * (time - self.since)

    @property
    def next_time(self) -> float:
        """When it acts next [s]."""
        return min(self._tick, self._waiting[0]) if self._waiting is not None else self._tick

    def _next_tick(self) -> float:
        """When the tick of the present number comes: as due, or late."""
        due = self._start + self._ticks * self._step
        return due + self.component.jitter * self._late.random() if self.component.jitter else due

    def act(self, time: float) -> bool:
        """Do what is due at ``time``; return whether its outputs may have changed."""
        if time < self.next_time - _TIME * self._step:
            return False
        if self._waiting is not None and time >= self._waiting[0] - _TIME * self._step:
            self.now, self._waiting = self._waiting[1], None
        if time >= self._tick - _TIME * self._step:
            (self._sample if self.component.execution == "sampled" else self._follow)(time)
            self._tick = self._next_tick()
        return True

    def _sample(self, time: float) -> None:
        self._inputs.write(self._present())
        self.instance.do_step(self._start + self._ticks * self._step, self._step)
        self._ticks += 1
        found = self._read()
        if self.component.delay > 0.0:
            self._waiting = (time + self.component.delay, found)
        else:
            self.now = found

    def _follow(self, time: float) -> None:
        self.follow(self._start + (self._ticks - 1) * self._step, self._step, time)
        self._ticks += 1

    def follow(self, begin: float, step: float, end: float | None = None) -> None:
        """Step from ``begin`` with the mean of the inputs at both ends; at ``end`` (``begin + step``) all is known."""
        present = self._present()
        self._inputs.write(np.where(self._floats, 0.5 * (self.before + present), self.before))
        self.instance.do_step(begin, step)
        self._inputs.write(present)  # outputs belong to the inputs here, also under direct feed-through
        found = self._read()
        self.slope = np.zeros_like(found) if self.is_first else (found - self.now) / step
        self.now, self.since = found, begin + step if end is None else end
        self.is_first = False

    def refresh(self, step: float) -> None:
        """Read the outputs again, with the inputs that the others have found meanwhile (direct feed-through)."""
        self._inputs.write(self._present())
        found = self._read()
        self.slope = self.slope + (found - self.now) / step if not self.is_first else self.slope
        self.now = found

    def covered(self) -> None:
        """Count a tick up to which somebody else has taken the component."""
        self._ticks += 1
        self._tick = self._next_tick()

    @property
    def before_outside(self) -> FloatArray:
        """Inputs from outside the system when it last settled."""
        return self.before[len(self.before) - len(self._driven) :].copy()

    def between(self, first: FloatArray, last: FloatArray, share: float) -> FloatArray:
        """Inputs from outside at a ``share`` of the way; what is no float keeps its value until the end."""
        floats = self._floats[len(self._floats) - len(self._driven) :]
        held = last if share >= 1.0 - 1e-9 else first
        return np.where(floats, first + share * (last - first), held)

    def settle(self) -> None:
        """Remember the inputs at this point, once everything that is due has acted."""
        self.before = self._present()

    def _present(self) -> FloatArray:
        return np.concatenate((self._wiring.inputs()[self._targets], self.outside))

    def _read(self) -> FloatArray:
        found = np.empty(len(self._sources))
        self._outputs.read(found)
        return found

    def drive(self, variable: str, value: float) -> bool:
        """Take a value for an input from outside the system; False if the variable is none of them."""
        if variable not in self._driven:
            return False
        self.outside[self._driven.index(variable)] = value
        return True

    def write_inputs(self) -> None:
        """Set the inputs to their present values (Initialization Mode)."""
        self._inputs.write(self._present())
