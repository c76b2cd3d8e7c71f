"""The connections of a system at work: read outputs, write inputs, stage by stage, loops solved by Newton's method."""

from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from thsa_cosim.fmu.failure import SimulationFailure, Status
from thsa_cosim.fmu.instance import Instance
from thsa_cosim.signals import FloatArray
from thsa_cosim.system.order import Pin, stages
from thsa_cosim.system.structure import System

LOOP_TOLERANCE = 1e-12
"""Relative residual below which an algebraic loop counts as solved."""
_ITERATIONS = 30


class Port:
    """Variables of one component and their columns in a vector of the system."""

    def __init__(self, instance: Instance, variables: Sequence[str], columns: Sequence[int]) -> None:
        self._instance = instance
        self._channels = instance.channels([instance.description.variable(name) for name in variables])
        self._columns = np.array(columns, dtype=np.intp)
        self._buffer = np.empty(len(columns))

    def read(self, values: FloatArray) -> None:
        """Read the variables into their columns of ``values``."""
        self._instance.get_values(self._channels, self._buffer)
        values[self._columns] = self._buffer

    def write(self, values: FloatArray) -> None:
        """Set the variables to their columns of ``values``."""
        self._instance.set_values(self._channels, values[self._columns])


class Wiring:
    """The connections between live instances: ``sources`` (n,) are read, ``targets`` (m,) are written."""

    def __init__(self, system: System, instances: Mapping[str, Instance], stepped: Iterable[str]) -> None:
        """``stepped``: components whose outputs somebody else puts into ``values`` (Co-Simulation)."""
        self._instances, self._stepped = instances, frozenset(stepped)
        self.sources = tuple(dict.fromkeys(c.source for c in system.connections))
        self.targets = tuple(c.target for c in system.connections)
        self.index = {pin: k for k, pin in enumerate(self.sources)}
        self.values = np.zeros(len(self.sources))
        """Present values of the sources, each in its own unit."""
        self.feeds = np.array([self.index[c.source] for c in system.connections], dtype=np.intp)
        """Which source each target takes."""
        self.factor = np.array([c.factor for c in system.connections])
        self.offset = np.array([c.offset for c in system.connections])
        self.disturbance = np.zeros(len(self.targets))
        """What is added to each target, in its unit."""
        self._stages = [
            (stage.is_loop, self._reads(stage.sources), *self._writes(stage.sources), stage.sources)
            for stage in stages(system)
        ]

    def _reads(self, sources: Sequence[Pin]) -> list[Port]:
        own = [pin for pin in sources if pin[0] not in self._stepped]
        return [
            Port(
                self._instances[name],
                [v for c, v in own if c == name],
                [self.index[p] for p in own if p[0] == name],
            )
            for name in dict.fromkeys(c for c, _ in own)
        ]

    def _writes(self, sources: Sequence[Pin]) -> tuple[list[Port], list[Port]]:
        """Ports of the integrated components that these sources feed: of continuous inputs, and of all."""
        fed = [k for k, pin in enumerate(self.targets) if self.sources[self.feeds[k]] in sources]
        fed = [k for k in fed if self.targets[k][0] not in self._stepped]

        def ports(columns: Sequence[int]) -> list[Port]:
            names = dict.fromkeys(self.targets[k][0] for k in columns)
            return [
                Port(
                    self._instances[name],
                    [self.targets[k][1] for k in columns if self.targets[k][0] == name],
                    [k for k in columns if self.targets[k][0] == name],
                )
                for name in names
            ]

        def is_continuous(pin: Pin) -> bool:
            variable = self._instances[pin[0]].description.variable(pin[1])
            return variable.is_float and variable.variability == "continuous"

        return ports([k for k in fed if is_continuous(self.targets[k])]), ports(fed)

    def inputs(self) -> FloatArray:
        """Values (m,) of the targets that follow from ``values``."""
        return np.asarray(self.factor * self.values[self.feeds] + self.offset + self.disturbance)

    def propagate(self, time: float, *, events: bool = False) -> None:
        """Read and write everything in order; with ``events`` discrete inputs too (Event or Initialization Mode)."""
        for is_loop, reads, continuous, every, sources in self._stages:
            writes = every if events else continuous
            if is_loop:
                self._solve(time, reads, writes, sources)
                continue
            for port in reads:
                port.read(self.values)
            inputs = self.inputs()
            for port in writes:
                port.write(inputs)

    def _solve(
        self, time: float, reads: Sequence[Port], writes: Sequence[Port], sources: Sequence[Pin]
    ) -> None:
        columns = np.array([self.index[pin] for pin in sources], dtype=np.intp)

        def residual(guess: FloatArray) -> FloatArray:
            self.values[columns] = guess
            inputs = self.inputs()
            for port in writes:
                port.write(inputs)
            for port in reads:
                port.read(self.values)
            return np.asarray(self.values[columns] - guess)

        solution = solve_loop(residual, self.values[columns].copy())
        if solution is None:
            names = ", ".join(".".join(pin) for pin in sources)
            reason = f"the algebraic loop through {names} has no solution at t = {time:.9g} s"
            raise SimulationFailure(Status.NOT_FINITE, reason)
        self.values[columns] = solution


def solve_loop(residual: Callable[[FloatArray], FloatArray], guess: FloatArray) -> FloatArray | None:
    """Solve ``residual(y) = F(y) - y = 0`` by Newton's method with differences; None if it does not converge.

    The last evaluation is at the solution, so that whatever ``residual`` sets stays set there.
    """
    y = np.asarray(guess, dtype=np.float64)
    for _ in range(_ITERATIONS):
        r = residual(y)
        if not np.isfinite(r).all():
            return None
        scale = np.maximum(np.abs(y), np.abs(y + r))
        if (np.abs(r) <= LOOP_TOLERANCE * np.maximum(scale, 1e-9)).all():
            return y
        jacobian = np.empty((len(y), len(y)))
        for k in range(len(y)):
            step = 1e-7 * max(abs(float(y[k])), float(np.max(scale)), 1e-6)
            moved = y.copy()
            moved[k] += step
            jacobian[:, k] = (residual(moved) - r) / step
        try:
            change = np.linalg.solve(jacobian, -r)
        except np.linalg.LinAlgError:
            return None
        following = y + change
        if (np.abs(change) <= 1e-15 * np.maximum(np.abs(following), 1e-300)).all():
            residual(following)
            return following
        y = following
    return None
