"""The Model Exchange components of a system as one: a vector of states, a vector of event indicators, one Jacobian."""

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from thsa_cosim.fmu.instance import EventInfo, Instance
from thsa_cosim.signals import FloatArray
from thsa_cosim.system.member import named
from thsa_cosim.system.wiring import Wiring

_VECTORS = {"GetContinuousStates", "GetNominalsOfContinuousStates", "GetEventIndicators"}


class Integrated:
    """The integrated components, one after the other; a call that fails names its component."""

    def __init__(self, parts: Mapping[str, Instance]) -> None:
        self._parts = parts
        self._states = _slices([part.description.states for part in parts.values()])
        self._indicators = _slices([part.description.event_indicators for part in parts.values()])

    def __bool__(self) -> bool:
        return bool(self._parts)

    def set_time(self, time: float) -> None:
        """Set the independent variable of every component [s]."""
        for part in self._parts.values():
            part.set_time(time)

    def enter_event_mode(self) -> None:
        """Bring every component into Event Mode."""
        for name, part in self._parts.items():
            with named(name):
                part.enter_event_mode()

    def enter_continuous_time_mode(self) -> None:
        """Bring every component into Continuous-Time Mode."""
        for name, part in self._parts.items():
            with named(name):
                part.enter_continuous_time_mode()

    def event_iteration(self) -> EventInfo:
        """One event iteration of every component; what any of them asks for, the earliest of their time events."""
        found = []
        for name, part in self._parts.items():
            with named(name):
                found.append(part.event_iteration())
        times = [info.next_event_time for info in found if info.next_event_time is not None]
        return EventInfo(
            any(info.needs_update for info in found),
            any(info.terminate for info in found),
            any(info.nominals_changed for info in found),
            any(info.states_changed for info in found),
            min(times, default=None),
        )

    def completed_integrator_step(self) -> tuple[bool, bool]:
        """Tell every component; (enter event mode, terminate) if any asks for it."""
        event = terminate = False
        for name, part in self._parts.items():
            if part.description.capabilities.get("needsCompletedIntegratorStep", True):
                with named(name):
                    wants, ends = part.completed_integrator_step()
                event |= wants
                terminate |= ends
        return event, terminate

    def vector(self, name: str, values: FloatArray) -> None:
        """Read a vector of all components into ``values``."""
        assert name in _VECTORS
        places = self._indicators if name == "GetEventIndicators" else self._states
        for (component, part), where in zip(self._parts.items(), places, strict=True):
            piece = np.zeros(where.stop - where.start)
            if len(piece):
                with named(component):
                    part.vector(name, piece)
            values[where] = piece

    def place(self, time: float, states: FloatArray) -> None:
        """Set time [s] and states (n,) of every component."""
        for part, where in zip(self._parts.values(), self._states, strict=True):
            part.set_time(time)
            if where.stop > where.start:
                part.vector("SetContinuousStates", np.ascontiguousarray(states[where]))

    def derivatives(self, out: FloatArray) -> None:
        """Write dx/dt (n,) of every component."""
        for part, where in zip(self._parts.values(), self._states, strict=True):
            if where.stop > where.start:
                piece = np.empty(where.stop - where.start)
                verb = "GetDerivatives" if part.prefix == "fmi2" else "GetContinuousStateDerivatives"
                part.vector(verb, piece)
                out[where] = piece

    def jacobian(self, wiring: Wiring, out: FloatArray) -> None:
        """df/dx (n, n) = A + B G (I - D G)^-1 C, from the components' own derivatives and the connections."""
        sources, targets = wiring.sources, wiring.targets
        n, s, m = len(out), len(sources), len(targets)
        a, b = np.zeros((n, n)), np.zeros((n, m))
        c, d = np.zeros((s, n)), np.zeros((s, m))
        for (name, part), where in zip(self._parts.items(), self._states, strict=True):
            description = part.description
            pairs = np.array(description.state_references, dtype=np.uint32).reshape(-1, 2)
            rows = [k for k, pin in enumerate(sources) if pin[0] == name]
            outputs = [description.variable(sources[k][1]).value_reference for k in rows]
            unknowns = np.array([*pairs[:, 1].tolist(), *outputs], dtype=np.uint32)
            columns = [
                k
                for k, (owner, own) in enumerate(targets)
                if owner == name and description.variable(own).is_float
            ]
            inputs = [description.variable(targets[k][1]).value_reference for k in columns]
            states = list(range(where.start, where.stop))
            for knowns, places, of_states, of_outputs in (
                (pairs[:, 0].tolist(), states, a, c),
                (inputs, columns, b, d),
            ):
                for known, place in zip(knowns, places, strict=True):
                    slope = np.empty(len(unknowns))
                    one = np.array([known], dtype=np.uint32)
                    part.directional_derivative(unknowns, one, slope)
                    of_states[where, place] = slope[: len(pairs)]
                    of_outputs[rows, place] = slope[len(pairs) :]
        gain = np.zeros((m, s))
        gain[np.arange(m), wiring.feeds] = wiring.factor
        out[:] = a + b @ gain @ np.linalg.solve(np.eye(s) - d @ gain, c) if s else a


def _slices(sizes: Sequence[int]) -> list[slice]:
    ends = np.cumsum([0, *sizes]).tolist()
    return [slice(a, b) for a, b in pairwise(ends)]
