"""Linearisation of an FMU around a state, and its loop opened at one of its signals.

Model Exchange gives dx/dt = f(x, u, p) and any signal s(x, u, p) at a state of our choice. A loop is opened
at s without touching the model: s acts on dx/dt through some b = ∂f/∂s that is seen whenever a parameter that
acts through s alone (a gain of the controller) is changed while state and inputs stay, b = Δf / Δs. Then
dx/dt = (A - b c) x + b s with A = ∂f/∂x, c = ∂s/∂x is the open system from s to s, and -c (jωI - A + b c)⁻¹ b
the loop's transfer function. No matter whether the controller feeds forward or observes: what returns to s
counts.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from thsa_cosim.errors import FmuError
from thsa_cosim.fmu.description import FmuDescription
from thsa_cosim.fmu.failure import SimulationFailure, Status
from thsa_cosim.fmu.fmi2 import Fmi2Instance
from thsa_cosim.fmu.fmi3 import Fmi3Instance
from thsa_cosim.fmu.instance import Channel, Instance
from thsa_cosim.fmu.texts import check_texts
from thsa_cosim.signals import FloatArray

_STEP = 1e-6
"""Difference step relative to a state's size (at least its nominal value)."""
_GAIN_STEP = 0.1
"""Relative change of a gain that shows how the signal acts."""
_EVENTS_AT_ONE_TIME = 200
_ENOUGH = 1e-3
"""A gain that moves the signal by this share of its size shows its direction to eight digits: no other is tried."""


@dataclass(frozen=True, eq=False)
class OpenLoop:
    """dx/dt = a x + b s, s returned = c x: ``a`` (n, n), ``b`` (n,), ``c`` (n,) around one state.

    ``derivatives``: "directional" where the FMU gave ∂f/∂x itself, else "differences".
    """

    states: tuple[str, ...]
    a: FloatArray
    b: FloatArray
    c: FloatArray
    derivatives: str

    def response(self, omega: FloatArray) -> np.ndarray[tuple[int], np.dtype[np.complex128]]:
        """Loop transfer function L(jω) (m,) at ``omega`` (m,) in rad/s; 1 + L is the return difference."""
        modes, vectors = np.linalg.eig(self.a)
        with np.errstate(all="ignore"):
            residues = (self.c @ vectors) * np.linalg.lstsq(vectors, self.b.astype(complex), rcond=None)[0]
            found = -np.sum(residues / (1j * omega[:, None] - modes), axis=1)
        # Modes that coincide have no full set of eigenvectors: a few frequencies tell whether the sum is right.
        few = np.unique(np.linspace(0, omega.size - 1, 5).astype(int))
        exact = self._solved(omega[few])
        if np.allclose(found[few], exact, rtol=1e-8, atol=0.0):
            return np.asarray(found, dtype=np.complex128)
        return self._solved(omega)

    def _solved(self, omega: FloatArray) -> np.ndarray[tuple[int], np.dtype[np.complex128]]:
        matrices = 1j * omega[:, None, None] * np.eye(len(self.b)) - self.a
        states = np.linalg.solve(matrices, np.broadcast_to(self.b[:, None], (len(omega), len(self.b), 1)))
        return np.asarray(-np.squeeze(self.c @ states, axis=-1), dtype=np.complex128)


def state_names(description: FmuDescription) -> tuple[str, ...]:
    """Names of the continuous states, in the order of the state vector; FmuError if they are not stated."""
    if not description.state_names:
        raise FmuError(
            f"{description.path} does not say which variables its states are; it cannot be linearised."
        )
    return description.state_names


_refusing: set[str] = set()
"""Digests of FMUs that do not give every derivative themselves: an instance that refused a call is not used again."""


def open_loop(
    description: FmuDescription,
    folder: Path,
    *,
    values: Mapping[str, float],
    inputs: Mapping[str, float],
    time: float,
    states: FloatArray,
    signal: str,
    gains: Sequence[str],
    texts: Mapping[str, str] | None = None,
) -> OpenLoop:
    """Linearise at ``states`` (n,) and open the loop at ``signal``.

    Parameters
    ----------
    folder
        Where the FMU is unpacked.
    values, inputs
        Start values and constant inputs by name, in the FMU's units.
    time
        Simulated time of that state, s.
    gains
        Parameters that act through ``signal`` alone; the one that moves it most is used.
    texts
        Start values of String variables by name.

    Raises
    ------
    SimulationFailure
        If the FMU refuses, or no gain moves the signal.
    FmuError
        If the FMU does not name its states.
    """
    names = state_names(description)
    if description.sha256 not in _refusing:
        with _Point(description, folder, values, inputs, time, states, signal, texts) as point:
            try:
                exact = _exact(point, states, gains, values)
            except SimulationFailure:
                _refusing.add(description.sha256)
                exact = None
        if exact is not None:
            a, b, c = exact
            return OpenLoop(names, a - np.outer(b, c), b, c, "directional")
    with _Point(description, folder, values, inputs, time, states, signal, texts) as point:
        size = np.maximum(np.abs(states), point.nominal())
        steps = _STEP * size
        probes = [states] + [
            states + step * row for step, row in zip(steps, np.eye(len(states)), strict=True)
        ]
        here = [point.evaluate(x) for x in probes]
        below = [
            point.evaluate(states - step * row) for step, row in zip(steps, np.eye(len(states)), strict=True)
        ]
        jacobian = np.stack(
            [(up - down) / (2.0 * h) for up, down, h in zip(here[1:], below, steps, strict=True)], axis=1
        )
        kind = point.directional(states, jacobian)
    best = np.zeros(len(states) + 1)
    # At the working point a controller that feeds forward perfectly has no error: then move the states as well.
    moved = [states + 1e-3 * s * row for s, row in zip(size, np.eye(len(states)), strict=True)]
    for group in ([states], moved):
        base = here[:1]
        if group is moved:
            with _Point(description, folder, values, inputs, time, states, signal, texts) as point:
                base = [point.evaluate(x) for x in group]
        enough = _ENOUGH * max(1.0, abs(float(base[0][-1])))
        for name in gains:
            value = values[name]
            changed = {**values, name: value * (1.0 + _GAIN_STEP) if value else _GAIN_STEP}
            with _Point(description, folder, changed, inputs, time, states, signal, texts) as point:
                found = [point.evaluate(x) - before for x, before in zip(group, base, strict=True)]
            best = max([best, *(f for f in found if np.isfinite(f).all())], key=lambda f: abs(float(f[-1])))
            if abs(best[-1]) > enough:
                break
        if abs(best[-1]) > 1e-3 * enough:
            break
    else:
        raise SimulationFailure(
            Status.FMI_ERROR, f"no gain moves {signal!r}; the loop cannot be opened there"
        )
    b = best[:-1] / best[-1]
    c = jacobian[-1]
    return OpenLoop(names, jacobian[:-1] - np.outer(b, c), b, c, kind)


def _exact(
    point: "_Point", states: FloatArray, gains: Sequence[str], values: Mapping[str, float]
) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """∂f/∂x (n, n), b (n,) and ∂s/∂x (n,) as the FMU gives them; None if it gives none, or no gain moves the signal.

    FMI 2.0.4 promises derivatives of state derivatives and outputs with respect to states and inputs. Our exporter's
    FMUs give them of every signal, and with respect to parameters too, as FMI 3.0 does for tunable ones.
    SimulationFailure from one that does not.
    """
    if not point.description.capabilities.get("providesDirectionalDerivative"):
        return None
    jacobian = point.sensitivities([k for k, _ in point.description.state_references], states)
    size = np.maximum(np.abs(states), point.nominal())
    # At the working point a controller that feeds forward perfectly has no error: then the states are moved.
    moved = states + 1e-3 * size
    for place in (states, moved):
        enough = _ENOUGH * max(1.0, abs(float(point.evaluate(place)[-1])))
        best = np.zeros(len(states) + 1)
        for name in gains:
            column = point.sensitivities([point.description.variable(name).value_reference], place)
            if not np.isfinite(column).all():
                continue
            change = column[:, 0] * _GAIN_STEP * (abs(values[name]) or 1.0)
            best = max(best, change, key=lambda f: abs(float(f[-1])))
            if abs(best[-1]) > enough:
                break
        if abs(best[-1]) > 1e-3 * enough:
            return jacobian[:-1], best[:-1] / best[-1], jacobian[-1]
    return None


class _Point:
    """One Model Exchange instance held at a time; gives (dx/dt, s) for states of our choice."""

    def __init__(
        self,
        description: FmuDescription,
        folder: Path,
        values: Mapping[str, float],
        inputs: Mapping[str, float],
        time: float,
        states: FloatArray,
        signal: str,
        texts: Mapping[str, str] | None,
    ) -> None:
        cls = Fmi2Instance if description.fmi_version == "2.0" else Fmi3Instance
        self._instance: Instance = cls(folder, description, "model-exchange")
        self._derivatives = (
            "GetDerivatives" if description.fmi_version == "2.0" else "GetContinuousStateDerivatives"
        )
        self.description = description
        self._signal: list[Channel] = []
        try:
            self._begin(values, inputs, time, states, signal, texts or {})
        except BaseException:
            self._instance.free()
            raise

    def _begin(
        self,
        values: Mapping[str, float],
        inputs: Mapping[str, float],
        time: float,
        states: FloatArray,
        signal: str,
        texts: Mapping[str, str],
    ) -> None:
        instance, description = self._instance, self.description
        instance.instantiate()
        _set(instance, values)
        instance.set_texts(check_texts(texts, description))
        instance.initialize_begin(0.0, max(time, 1.0), None)
        _set(instance, inputs)
        instance.initialize_end()
        self._iterate()
        self._signal = instance.channels([description.variable(signal)])
        instance.set_time(time)
        self.evaluate(states)
        # Branches are frozen in Continuous-Time Mode: let the FMU choose those that belong to these states.
        instance.enter_event_mode()
        self._iterate()

    def _iterate(self) -> None:
        for _ in range(_EVENTS_AT_ONE_TIME):
            if not self._instance.event_iteration().needs_update:
                break
        else:
            raise SimulationFailure(Status.FMI_ERROR, "the event iteration does not come to an end")
        self._instance.enter_continuous_time_mode()

    def evaluate(self, states: FloatArray) -> FloatArray:
        """Return dx/dt and the signal (n + 1,) at ``states`` (n,)."""
        self._instance.vector("SetContinuousStates", np.ascontiguousarray(states))
        out = np.empty(len(states))
        self._instance.vector(self._derivatives, out)
        signal = np.empty(1)
        self._instance.get_values(self._signal, signal)
        return np.append(out, signal)

    def nominal(self) -> FloatArray:
        """Return the states' nominal values (n,), 1 where they are of no use."""
        nominal = np.ones(self.description.states)
        self._instance.vector("GetNominalsOfContinuousStates", nominal)
        usable = np.isfinite(nominal) & (nominal != 0.0)
        return np.where(usable, np.abs(nominal), 1.0)

    def directional(self, states: FloatArray, jacobian: FloatArray) -> str:
        """Replace ∂f/∂x in ``jacobian`` (n + 1, n) by the FMU's own where it gives it; say which it is."""
        if not self.description.capabilities.get("providesDirectionalDerivative"):
            return "differences"
        self._instance.vector("SetContinuousStates", np.ascontiguousarray(states))
        references = np.array(self.description.state_references, dtype=np.uint32)
        column = np.empty(len(states))
        for j in range(len(states)):
            self._instance.directional_derivative(references[:, 1], references[j : j + 1, 0], column)
            jacobian[:-1, j] = column
        return "directional"

    def sensitivities(self, knowns: Sequence[int], states: FloatArray) -> FloatArray:
        """∂(dx/dt, signal)/∂knowns (n + 1, m) at ``states`` by the FMU itself."""
        self._instance.vector("SetContinuousStates", np.ascontiguousarray(states))
        rows = [derivative for _, derivative in self.description.state_references]
        unknowns = np.array([*rows, *self._signal[0].references], dtype=np.uint32)
        found, column = np.empty((len(unknowns), len(knowns))), np.empty(len(unknowns))
        for j, known in enumerate(np.array(knowns, dtype=np.uint32)[:, None]):
            self._instance.directional_derivative(unknowns, known, column)
            found[:, j] = column
        return found

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._instance.free()


def _set(instance: Instance, values: Mapping[str, float]) -> None:
    variables = [instance.description.variable(name) for name in values]
    instance.set_values(instance.channels(variables), np.array(list(values.values()), dtype=np.float64))
