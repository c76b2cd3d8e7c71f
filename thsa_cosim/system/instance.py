"""A system as one instance: the integrator sees one vector of states, one of event indicators, one event iteration.

Model Exchange components are integrated together (see ``integrated``), their connections exact at every call of the
right-hand side; Co-Simulation components act at time events of the whole (see ``stepped``).
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.fmu.description import FmuDescription
from thsa_cosim.fmu.failure import SimulationFailure, Status
from thsa_cosim.fmu.fmi2 import Fmi2Instance
from thsa_cosim.fmu.fmi3 import Fmi3Instance
from thsa_cosim.fmu.instance import Channel, EventInfo, Instance
from thsa_cosim.fmu.native import Messages, MessageSink
from thsa_cosim.fmu.point import Point
from thsa_cosim.fmu.variable import Variable
from thsa_cosim.signals import FloatArray
from thsa_cosim.system.adaptive import Adaptive
from thsa_cosim.system.description import DISTURBANCE, SystemDescription
from thsa_cosim.system.integrated import Integrated
from thsa_cosim.system.member import crowded, member, named, own_processes
from thsa_cosim.system.point import SystemPoint
from thsa_cosim.system.stepped import Stepped
from thsa_cosim.system.wiring import Port, Wiring

_EVENT_ITERATIONS = 100


class SystemInstance(Instance):
    """One live instance of every component of a system; every failing call names its component."""

    prefix = "fmi2"  # it serves what FMI 2.0 Model Exchange has
    types: ClassVar[dict[str, tuple[str, Any]]] = Fmi2Instance.types | Fmi3Instance.types

    def __init__(
        self,
        folder: Path,
        description: SystemDescription,
        kind: str,
        sink: MessageSink | None = None,
        progress: FloatArray | None = None,
    ) -> None:
        """``folder``: the unpacked archive, in which each component has ``components/<name>``; ``progress`` (4,) is
        told which component is at work.
        """
        self.description: FmuDescription = description
        self._system, self._pins, self._folder, self._sink = (
            description.system,
            description.pins,
            folder,
            sink,
        )
        self.kind, self.messages, self.handle, self.is_dead = kind, Messages(sink), 0, False
        self._progress = np.zeros(4) if progress is None else progress
        self._names = list(description.variables)
        self._given: dict[str, dict[str, float]] = {}
        self._apart = {*own_processes(self._system), *crowded(self._system, folder)}
        self._build()

    def _build(self) -> None:
        """Load every component's FMU and connect them."""
        self.parts: dict[str, Instance] = {}
        for number, component in enumerate(self._system.components, 1):
            name = component.name
            place, apart = self._folder / "components" / name, name in self._apart
            part = member(component, number, place, self._progress, apart=apart, sink=self._sink)
            part.messages = self.messages
            self.parts[name] = part
        continuous = [c.name for c in self._system.components if c.execution == "continuous"]
        self._integrated = Integrated({name: self.parts[name] for name in continuous})
        self._others = [c for c in self._system.components if c.execution != "continuous"]
        self._wiring = Wiring(self._system, self.parts, [c.name for c in self._others])
        # At one instant, what has to catch up with it goes first, then what samples there.
        order = sorted(self._others, key=lambda c: c.execution == "sampled")
        self._stepped = [Stepped(c, self.parts[c.name], self._wiring, self._driven(c.name)) for c in order]
        tolerance = self._system.coupling_tolerance
        self._adaptive = tolerance and Adaptive(self._stepped, self._wiring, tolerance)
        self._time = 0.0
        self._ports: dict[tuple[str, str], Port] = {}
        self._disturbed = {".".join(pin): k for k, pin in enumerate(self._wiring.targets)}

    def _driven(self, name: str) -> list[str]:
        """Inputs of a stepped component that come from outside the system."""
        connected = {pin for pin in self._wiring.targets if pin[0] == name}
        return [v.name for v in self.parts[name].description.inputs if (name, v.name) not in connected]

    # -- life ---------------------------------------------------------------------------------------
    def instantiate(self) -> None:
        """Instantiate every component; one that is refused beside the others gets a separate process."""
        self._given = {}
        try:
            for component in self._system.components:
                with named(component.name):
                    self.parts[component.name].instantiate()
        except SimulationFailure as failure:
            beside = [n for n, part in self.parts.items() if part.handle]
            self.free()
            name = component.name
            if failure.status != Status.LOAD_ERROR or name in self._apart or not beside:
                raise
            self._apart.add(name)
            self._build()
            self.instantiate()
            return
        self.handle = 1
        self._give_starts()

    def set_start(self, channels: Sequence[Channel], values: FloatArray) -> None:
        """Set start values through the names of the system, beside those of the system itself.

        Each component keeps its own: a tool that overwrites them at its set-up is given them once more.
        """
        self._given = {}
        for channel in channels:
            for reference, column in zip(channel.references.tolist(), channel.columns, strict=True):
                for (name, own), factor, offset in self._pins[self._name(reference)]:
                    if name != DISTURBANCE:
                        self._given.setdefault(name, {})[own] = factor * float(values[column]) + offset
        self._give_starts()
        self.set_values(channels, values)

    def set_texts(self, texts: Mapping[int, str]) -> None:
        """Set String variables of components through the names of the system."""
        given: dict[str, dict[int, str]] = {}
        for reference, text in texts.items():
            for (name, own), *_ in self._pins[self._name(reference)]:
                variable = self.parts[name].description.variable(own)
                given.setdefault(name, {})[variable.value_reference] = text
        for name, part in self.parts.items():
            with named(name):
                part.set_texts(given.get(name, {}))

    def _give_starts(self) -> None:
        for component in self._system.components:
            part = self.parts[component.name]
            starts = {**component.start, **self._given.get(component.name, {})}
            channels = part.channels([part.description.variable(n) for n in starts])
            with named(component.name):
                part.set_start(channels, np.fromiter(starts.values(), float, len(starts)))

    def initialize_begin(self, start: float, stop: float, tolerance: float | None) -> None:
        """Bring every component into Initialization Mode."""
        self._time = start
        for component in self._system.components:
            # A step that begins before the end may go beyond it.
            beyond = 2.0 * (component.step or 0.0)
            with named(component.name):
                self.parts[component.name].initialize_begin(start, stop + beyond, tolerance)

    def initialize_end(self) -> None:
        """Settle the connections and leave Initialization Mode."""
        self._begin_stepped()
        self._wiring.propagate(self._time, events=True)
        for stepped in self._stepped:
            stepped.write_inputs()
        for name, part in self.parts.items():
            with named(name):
                part.initialize_end()
        self._begin_stepped()

    def _begin_stepped(self) -> None:
        """Take the stepped components' outputs as they are now."""
        for stepped in self._stepped:
            stepped.begin(self._time)
            stepped.put(self._time)
        if self._adaptive:
            self._adaptive.begin(self._time, self._others[0].step or 0.0)

    def terminate(self) -> None:
        """End the run in every component."""
        for part in self.parts.values():
            part.terminate()

    def reset(self) -> None:
        """Bring every component back to the state after instantiation, with its own start values."""
        for component in self._system.components:
            self.parts[component.name].reset()
        self._given = {}
        self._give_starts()

    def free(self) -> None:
        """Destroy every instance that lives."""
        if self._adaptive:
            self._adaptive.release()
        for part in self.parts.values():
            part.free()
        self.handle = 0

    # -- variables ------------------------------------------------------------------------------------
    def channels(self, variables: Sequence[Variable]) -> list[Channel]:
        """One channel for everything: its references are value references of the system."""
        if not variables:
            return []
        for variable in variables:
            for (name, own), *_ in self._pins[variable.name]:
                if name == DISTURBANCE:
                    continue
                self.parts[name].channels([self.parts[name].description.variable(own)])  # a number?
        references = np.array([v.value_reference for v in variables], dtype=np.uint32)
        return [Channel("System", references, np.dtype(np.float64), tuple(range(len(variables))))]

    def set_values(self, channels: Sequence[Channel], values: FloatArray) -> None:
        """Set variables of components through the names of the system."""
        for channel in channels:
            for reference, column in zip(channel.references.tolist(), channel.columns, strict=True):
                for (name, own), factor, offset in self._pins[self._name(reference)]:
                    self._set(name, own, factor * float(values[column]) + offset)

    def get_values(self, channels: Sequence[Channel], out: FloatArray) -> None:
        """Read variables of components through the names of the system."""
        for channel in channels:
            for reference, column in zip(channel.references.tolist(), channel.columns, strict=True):
                name = self._name(reference)
                (part, own), factor, offset = self._pins[name][0]
                value = np.empty(1)
                if part == DISTURBANCE:
                    value[0] = self._wiring.disturbance[self._disturbed[own]]
                else:
                    self._port(part, own).read(value)
                takes = self.description.variables[name].causality in ("input", "parameter")
                out[column] = (value[0] - offset) / factor if takes else factor * value[0] + offset

    def _name(self, reference: int) -> str:
        return self._names[reference]

    def _port(self, part: str, variable: str) -> Port:
        key = part, variable
        if key not in self._ports:
            self._ports[key] = Port(self.parts[part], [variable], [0])
        return self._ports[key]

    def _set(self, part: str, variable: str, value: float) -> None:
        if part == DISTURBANCE:
            self._wiring.disturbance[self._disturbed[variable]] = value
            return
        for stepped in self._stepped:
            if stepped.component.name == part and stepped.drive(variable, value):
                return
        with named(part):
            self._port(part, variable).write(np.array([value]))

    # -- Model Exchange -------------------------------------------------------------------------------
    def point(self, input_channels: Sequence[Channel]) -> Point:
        """The system as the integrator sees it."""
        return SystemPoint(self, input_channels)

    def move_to(self, time: float) -> None:
        """Extrapolate the outputs of stepped components to ``time``."""
        self._time = time
        for stepped in self._stepped:
            stepped.put(time)

    def propagate(self, *, events: bool = False) -> None:
        """Bring all connections up to date."""
        self._wiring.propagate(self._time, events=events)

    def set_time(self, time: float) -> None:
        """Set the independent variable of every integrated component [s]."""
        self.move_to(time)
        self._integrated.set_time(time)

    def enter_event_mode(self) -> None:
        """Bring every integrated component into Event Mode."""
        self._integrated.enter_event_mode()

    def enter_continuous_time_mode(self) -> None:
        """Bring every integrated component into Continuous-Time Mode."""
        self._integrated.enter_continuous_time_mode()

    def event_iteration(self) -> EventInfo:
        """Let stepped components act, then iterate events and connections until nothing changes."""
        self._act()
        if not self._integrated:
            return EventInfo(False, False, False, False, min(s.next_time for s in self._stepped))
        terminate = nominals = states = False
        for _ in range(_EVENT_ITERATIONS):
            before = self._wiring.values.copy()
            self.propagate(events=True)
            info = self._integrated.event_iteration()
            terminate |= info.terminate
            nominals |= info.nominals_changed
            states |= info.states_changed
            self.propagate(events=True)
            if terminate or (not info.needs_update and np.array_equal(before, self._wiring.values)):
                break
        else:
            raise SimulationFailure(
                Status.FMI_ERROR, "the event iteration of the system does not come to an end"
            )
        following = info.next_event_time
        for stepped in self._stepped:
            following = min(np.inf if following is None else following, stepped.next_time)
        return EventInfo(False, terminate, nominals, states, following)

    def _act(self) -> None:
        """Step what is due, in the order of the components, each seeing what the ones before it have found."""
        if self._adaptive:
            step = self._others[0].step or 0.0
            if self._time >= self._stepped[0].next_time - 1e-9 * step:
                self._adaptive.cover(self._time, step)
                for stepped in self._stepped:
                    stepped.covered()
            return
        acted = []
        for stepped in self._stepped:
            self.propagate(events=True)
            with named(stepped.component.name):
                if stepped.act(self._time):
                    acted.append(stepped)
            stepped.put(self._time)
        if acted:
            self.propagate(events=True)
        for stepped in acted:
            stepped.settle()

    def completed_integrator_step(self) -> tuple[bool, bool]:
        """Tell every integrated component; (enter event mode, terminate) if any asks for it."""
        return self._integrated.completed_integrator_step()

    def vector(self, name: str, values: FloatArray) -> None:
        """Read a vector of all integrated components, one after the other."""
        self._integrated.vector(name, values)

    def place_states(self, time: float, states: FloatArray) -> None:
        """Set time and states of every integrated component."""
        self.move_to(time)
        self._integrated.place(time, states)

    def derivatives(self, out: FloatArray) -> None:
        """Write dx/dt of every integrated component."""
        self._integrated.derivatives(out)

    # -- Jacobian -------------------------------------------------------------------------------------
    @property
    def has_jacobian(self) -> bool:
        """Whether every integrated component offers directional derivatives of what is needed."""
        return bool(
            self.description.states and self.description.capabilities["providesDirectionalDerivative"]
        )

    def jacobian(self, out: FloatArray) -> None:
        """df/dx = A + B G (I - D G)^-1 C, from the components' own derivatives and the connections."""
        self._integrated.jacobian(self._wiring, out)

    # -- what a system does not have --------------------------------------------------------------------
    def do_step(self, time: float, step: float) -> None:
        """A system is integrated by us."""
        raise NotImplementedError

    def value_function(self, verb: str, suffix: str) -> Any:
        """A system has no C functions of its own."""
        raise NotImplementedError

    def access(self, function: Any, references: int, count: int, values: int) -> int:
        """A system has no C functions of its own."""
        raise NotImplementedError

    def directional_derivative(
        self, unknowns: NDArray[np.uint32], known: NDArray[np.uint32], out: FloatArray
    ) -> None:
        """Derivatives of a system come as its whole Jacobian."""
        raise NotImplementedError
