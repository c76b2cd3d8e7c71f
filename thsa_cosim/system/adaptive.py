"""Communication steps as short as a tolerance asks for, for systems whose components can all be rolled back.

Over a communication step h all components step once by h, are put back, and step twice by h/2. The method (see
``stepped``) is of second order, so a third of the difference estimates the error of the finer result, which is kept if
the error is within a tenth of the tolerance; otherwise h is shortened (Hairer, Nørsett and Wanner, *Solving
Ordinary Differential Equations I*, II.4). Inputs from outside run linearly over the system's step.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from thsa_cosim.fmu.failure import SimulationFailure, Status
from thsa_cosim.signals import FloatArray
from thsa_cosim.system.stepped import Stepped
from thsa_cosim.system.wiring import Port, Wiring

_SAFETY = 0.8
_LOCAL = 0.1
"""Local errors are held this much below the tolerance, as in Model Exchange, so that global ones come out below it."""
_SHORTEST = 2.0**-16
"""No step is shorter than this share of the system's."""


@dataclass
class _Saved:
    """One component at the beginning of a step."""

    state: int
    now: FloatArray
    slope: FloatArray
    since: float
    before: FloatArray
    is_first: bool


class Adaptive:
    """Takes all components of a system from one tick to the next."""

    def __init__(self, stepped: Sequence[Stepped], wiring: Wiring, tolerance: float) -> None:
        """``tolerance``: of every output, as a share of its largest size so far, or of the
        nominal value that its FMU declares.
        """
        self._stepped, self._wiring, self._tolerance = stepped, wiring, tolerance
        self._saved: list[_Saved] = []
        self._values = wiring.values.copy()
        self._begin, self._step = 0.0, 0.0
        variables = [(s.instance, v) for s in stepped for v in s.instance.description.outputs if v.is_float]
        self._ports = [
            Port(
                s.instance,
                [v.name for of, v in variables if of is s.instance],
                [k for k, (of, _) in enumerate(variables) if of is s.instance],
            )
            for s in stepped
        ]
        self._nominal = np.array([abs(v.nominal or 0.0) for _, v in variables])
        self._scale = self._nominal.copy()

    def begin(self, start: float, step: float) -> None:
        """Begin a run [s]."""
        self._begin, self._step = start, step
        self._scale = np.maximum(self._nominal, np.abs(self._outputs()))

    def cover(self, end: float, longest: float) -> None:
        """Go from where the components are to ``end``, which is at most ``longest`` away [s]."""
        time = self._begin
        width = end - time
        outside = [(s.before_outside, s.outside.copy()) for s in self._stepped]
        self._save()
        self._leap(time, width, end, width, outside)  # shows the size of what is still at zero
        self._scale = np.maximum(self._scale, np.abs(self._outputs()))
        self._restore()
        while end - time > 1e-9 * longest:
            step = min(self._step, end - time)
            if end - time - step < 0.1 * step:
                step = end - time
            self._save()
            self._leap(time, step, end, width, outside)
            once = self._outputs()
            self._restore()
            for half in (time, time + 0.5 * step):
                self._leap(half, 0.5 * step, end, width, outside)
            error = self._error(once)
            if error <= 1.0:
                time += step
                self._scale = np.maximum(self._scale, np.abs(self._outputs()))
            else:
                self._restore()
                if step < _SHORTEST * longest:
                    raise SimulationFailure(
                        Status.INCOMPLETE,
                        f"the coupling tolerance of {self._tolerance:g} asks for communication steps below {step:.2g} s"
                        f" at t = {time:.9g} s",
                    )
            factor = _SAFETY * max(error, 1e-6) ** (-1.0 / 3.0)
            self._step = min(longest, step * min(2.0, max(0.2, factor)))
        for stepped, (_, present) in zip(self._stepped, outside, strict=True):
            stepped.outside[:] = present
        self._begin = end

    def _outputs(self) -> FloatArray:
        found = np.empty(len(self._nominal))
        for port in self._ports:
            port.read(found)
        return found

    def _error(self, once: FloatArray) -> float:
        """Largest estimated error over what a step may have."""
        twice = self._outputs()
        scale = _LOCAL * self._tolerance * np.maximum(self._scale, np.maximum(np.abs(once), np.abs(twice)))
        errors = np.divide(np.abs(twice - once) / 3.0, scale, out=np.zeros_like(scale), where=scale > 0.0)
        return float(np.max(errors, initial=0.0))

    def _leap(
        self,
        time: float,
        step: float,
        end: float,
        width: float,
        outside: Sequence[tuple[FloatArray, FloatArray]],
    ) -> None:
        """One step of all components, one after the other."""
        share = 1.0 - (end - time - step) / width
        for stepped, (first, last) in zip(self._stepped, outside, strict=True):
            stepped.outside[:] = stepped.between(first, last, share)
            stepped.put(time + step)
        for stepped in self._stepped:
            stepped.follow(time, step)
            stepped.put(time + step)
        for stepped in self._stepped:
            stepped.refresh(step)
            stepped.put(time + step)
        for stepped in self._stepped:
            stepped.settle()

    def _save(self) -> None:
        self._values = self._wiring.values.copy()
        self._saved = [
            _Saved(
                s.instance.save_state(old), s.now.copy(), s.slope.copy(), s.since, s.before.copy(), s.is_first
            )
            for s, old in zip(
                self._stepped, [saved.state for saved in self._saved] or [0] * len(self._stepped), strict=True
            )
        ]

    def _restore(self) -> None:
        self._wiring.values[:] = self._values
        for stepped, saved in zip(self._stepped, self._saved, strict=True):
            stepped.instance.restore_state(saved.state)
            stepped.now, stepped.slope = saved.now.copy(), saved.slope.copy()
            stepped.since, stepped.before = saved.since, saved.before.copy()
            stepped.is_first = saved.is_first

    def release(self) -> None:
        """Free the saved states."""
        for stepped, saved in zip(self._stepped, self._saved, strict=False):
            if stepped.instance.handle:
                stepped.instance.free_state(saved.state)
        self._saved = []
