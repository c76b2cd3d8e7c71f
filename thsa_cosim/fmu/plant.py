"""An opened FMU that can be run again and again."""

import importlib
import logging
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from thsa_cosim.closing import Closing
from thsa_cosim.errors import FmuError
from thsa_cosim.fmu.archive import unpack
from thsa_cosim.fmu.description import FmuDescription, read_description
from thsa_cosim.fmu.event_mode import needs_events, step_with_events
from thsa_cosim.fmu.fmi1_exchange import Fmi1Exchange
from thsa_cosim.fmu.fmi2 import Fmi2Instance
from thsa_cosim.fmu.fmi3 import Fmi3Instance
from thsa_cosim.fmu.inputs import communication_grid
from thsa_cosim.fmu.instance import Instance, Phase
from thsa_cosim.fmu.intermediate import IntermediateUpdate
from thsa_cosim.fmu.native import MessageSink
from thsa_cosim.fmu.plan import Plan
from thsa_cosim.fmu.scratch import ScratchFolder
from thsa_cosim.fmu.stepping import check_names, step_through
from thsa_cosim.fmu.texts import check_texts
from thsa_cosim.fmu.trajectory import follow, is_expected, is_offered, solver_tolerance
from thsa_cosim.signals import FloatArray, Signals

Kind = Literal["co-simulation", "model-exchange"]
Backend = Literal["compiled", "python"]
Reuse = Literal["fresh", "reset"]
Stepping = Literal["free", "samples"]

VARIABLE_STEP = "canHandleVariableCommunicationStepSize"
_PLANS = 64
_log = logging.getLogger(__name__)


class Plant(Closing):
    """An opened FMU: owns its unpacked folder and at most one live instance.

    Use it as a context manager. It is not safe against an FMU that crashes or hangs: runners put it into
    a separate process. Open one Plant at a time per process: many FMUs corrupt each other's instances.
    """

    _read = staticmethod(read_description)
    _unpack = staticmethod(unpack)

    def __init__(
        self,
        description: FmuDescription,
        folder: Path,
        *,
        kind: Kind | None = None,
        backend: Backend | None = None,
        reuse: Reuse = "fresh",
        stepping: Stepping = "free",
        scratch: ScratchFolder | None = None,
        progress: FloatArray | None = None,
        on_message: MessageSink | None = None,
    ) -> None:
        """Take an FMU that is already unpacked into ``folder``; ``Plant.open`` is the usual way in.

        ``scratch`` holds ``folder`` and is removed by ``close``. ``progress`` (4,) is written while running:
        phase, time [s], step, number of the component of a system that is at work (from 1; 0: none).
        """
        self.description = description
        self.folder = folder
        self.kind: Kind = kind or (
            "co-simulation" if description.supports_co_simulation else "model-exchange"
        )
        supported = {
            "co-simulation": description.supports_co_simulation,
            "model-exchange": description.supports_model_exchange,
        }
        if not supported[self.kind]:
            other = next(k for k, yes in supported.items() if yes)
            raise FmuError(f"{description.path} does not support {self.kind}; open it with kind={other!r}.")
        self._backend = backend
        self.reuse: Reuse = reuse
        self.stepping: Stepping = stepping
        self.progress = np.zeros(4) if progress is None else progress
        self._scratch = scratch
        self._on_message = on_message
        self._instance: Instance | None = None
        self._plans: dict[Any, tuple[Any, Any]] = {}
        self._update: IntermediateUpdate | None = None
        self.input_mode: str | None = None
        """How linear inputs are given in Co-Simulation, one of ``inputs.MODES``; None: as trusted."""
        self.texts: Mapping[str, str] = {}
        """Start values of String parameters and inputs by name, for every run."""

    @classmethod
    def open(
        cls,
        path: Path | str,
        *,
        kind: Kind | None = None,
        backend: Backend | None = None,
        reuse: Reuse = "fresh",
        stepping: Stepping = "free",
        on_message: MessageSink | None = None,
    ) -> "Plant":
        """Read and unpack the FMU ``path`` into a temporary folder, which ``close`` removes.

        Parameters
        ----------
        kind
            Co-Simulation unless the FMU has Model Exchange only.
        backend
            "compiled" (numba) or "python", the reference; both give the same bits.
        reuse
            "fresh": a new instance per run. "reset": one instance, fmiXReset between runs; only for FMUs
            whose reset is known to be right (``thsa-cosim check``).
        stepping
            "free": an FMU that offers it is given the whole run in one call, and its solver steps across
            samples (``thsa_cosim.fmu.trajectory``). "samples": it communicates at every output time, as
            other FMUs always do.
        on_message
            Called with each line that the FMU logs.

        Raises
        ------
        FmuError
            If the file is no usable FMU or lacks ``kind``.
        """
        description = cls._read(path)
        scratch = ScratchFolder()
        folder = scratch.path / "fmu"
        try:
            cls._unpack(Path(path), folder)
            return cls(
                description,
                folder,
                kind=kind,
                backend=backend,
                reuse=reuse,
                stepping=stepping,
                scratch=scratch,
                on_message=on_message,
            )
        except BaseException:
            scratch.remove()
            raise

    def run(
        self,
        values: Mapping[str, float],
        inputs: Signals | None,
        outputs: Sequence[str],
        time: FloatArray,
        *,
        tolerance: float | None = None,
        once: bool = False,
        most_steps: int | None = None,
    ) -> Signals:
        """Simulate once.

        Parameters
        ----------
        values
            Start values by variable name, in the FMU's units, set before initialisation.
        inputs
            Input signals in the FMU's units, interpolated linearly (see ``thsa_cosim.fmu.inputs``); inputs
            left out keep their start value.
        outputs
            Names of the variables to record; any causality.
        time
            (n,) s, strictly increasing: communication points and output times. ``time[0]`` is the start;
            the first values are those after initialisation with the inputs at ``time[0]``. A Co-Simulation FMU that
            takes steps of one size only communicates at even points, and outputs are interpolated between them.
        tolerance
            Relative tolerance for the FMU's solver (or, in Model Exchange, ours); ``None``: its default.
        once
            These inputs will not come again: nothing prepared for them is kept.
        most_steps
            Attempts at a step that the solver of an FMU of ours may take in a run of one call; else it has failed.

        Returns
        -------
        Signals
            The outputs at ``time``.

        Raises
        ------
        SimulationFailure
            If the run fails; ``status`` and ``reason`` say how.
        ParameterError, FmuError
            If a name is unknown or cannot be set or driven.
        """
        if self.description.fmi_version == "1.0" and self.kind == "co-simulation":
            from thsa_cosim.fmu.fmi1 import run_fmi1

            mode = self.input_mode or "mean"
            given: dict[str, float | str] = {**values, **self.texts}
            check_texts(self.texts, self.description)
            return run_fmi1(self.folder, self.description, given, inputs, outputs, time, self.progress, mode)
        points = self._points(time)
        try:
            result = self._run(values, inputs, outputs, points, tolerance, once, most_steps)
        except BaseException:
            self._free()
            raise
        if points is not time:
            result = result.resample(time)
        if self.reuse == "fresh":
            self._free()
        self.progress[0] = Phase.IDLE
        return result

    def _points(self, time: FloatArray) -> FloatArray:
        """Communication points for output times (n,) s: even ones for an FMU that takes steps of one size only."""
        description = self.description
        if self.kind == "model-exchange" or description.capabilities.get(VARIABLE_STEP, False):
            return time
        if len(time) < 3 or np.ptp(communication_grid(time).steps) == 0.0:
            return time

        def even() -> FloatArray:
            step = float(np.median(np.diff(time)))
            preferred = description.default_experiment.step
            if preferred is not None and 0.0 < preferred <= 1.5 * step:
                step = preferred
            count = int(np.ceil((time[-1] - time[0]) / step * (1.0 - 1e-9)))
            return np.asarray(time[0] + step * np.arange(count + 1))

        points: FloatArray = self._cached(("points", id(time)), even, keep=time)
        return points

    def _run(
        self,
        values: Mapping[str, float],
        inputs: Signals | None,
        outputs: Sequence[str],
        time: FloatArray,
        tolerance: float | None,
        once: bool,
        most_steps: int | None,
    ) -> Signals:
        instance = self._instance
        if instance is None:
            self.progress[0] = Phase.LOAD
            instance = self._new_instance()
            self._instance = instance
        instance.input_mode = self.input_mode if self.kind == "co-simulation" else "mean"
        fresh = Plan(instance, inputs, outputs, time) if once else None
        plan = fresh or self._plan(instance, inputs, outputs, time)
        names = tuple(values)
        settable = self._cached(("values", names), lambda: self._settable(instance, names))
        instance.messages.clear()
        self.progress[1] = plan.grid.times[0]
        if instance.handle:
            self.progress[0] = Phase.RESET
            instance.reset()
        else:
            self.progress[0] = Phase.INSTANTIATE
            self._prepare_callback(instance, plan)
            instance.instantiate()
            if self._update is not None:
                self._update.block[1] = instance.handle
        self.progress[0] = Phase.INITIALIZE
        instance.set_start(settable, np.fromiter((float(values[n]) for n in names), float, len(names)))
        instance.set_texts(check_texts(self.texts, self.description))
        start, stop = float(plan.grid.times[0]), plan.grid.stop
        if self.kind == "model-exchange":
            from thsa_cosim.fmu.exchange import integrate

            return integrate(instance, plan, self.progress, tolerance)
        exact = plan.mode in ("derivative", "intermediate")
        free = self.stepping == "free" and exact and is_offered(instance)
        if free:
            tolerance = solver_tolerance(instance, plan, tolerance)
        instance.initialize_begin(start, stop, tolerance)
        instance.set_values(plan.input_channels, plan.first)
        instance.initialize_end()
        if free and tolerance is not None:
            signals = follow(instance, plan, self.progress, tolerance, most_steps)
        elif isinstance(instance, Fmi3Instance) and instance.event_mode:
            signals = step_with_events(instance, plan, self.progress)
        else:
            signals = step_through(instance, plan, self.progress, self.backend == "compiled")
        self.progress[0] = Phase.TERMINATE
        instance.terminate()
        return signals

    @property
    def backend(self) -> Backend:
        """What the loop over communication steps runs in; numba is looked for when it is first asked."""
        if self._backend is None:
            self._backend = _default_backend()
        return self._backend

    def warm_up(self) -> None:
        """Import what runs will need besides the FMU, which then counts towards no deadline."""
        if self.kind == "co-simulation" and not (self.stepping == "free" and is_expected(self.description)):
            _ = self.backend

    def _new_instance(self) -> Instance:
        version = self.description.fmi_version
        cls = Fmi2Instance if version == "2.0" else Fmi3Instance if version == "3.0" else Fmi1Exchange
        return cls(self.folder, self.description, self.kind, self._on_message)

    def _settable(self, instance: Instance, names: Sequence[str]) -> Any:
        check_names(names, instance)
        return instance.channels([self.description.variable(name) for name in names])

    def _plan(
        self, instance: Instance, inputs: Signals | None, outputs: Sequence[str], time: FloatArray
    ) -> Plan:
        """Return the prepared experiment; recognised by identity, so pass the same objects again."""
        key = ("plan", id(inputs), id(time), tuple(outputs), instance.input_mode)
        plan: Plan = self._cached(key, lambda: Plan(instance, inputs, outputs, time), keep=(inputs, time))
        return plan

    def _cached(self, key: Any, make: Any, keep: Any = None) -> Any:
        if key not in self._plans:
            while len(self._plans) >= _PLANS:
                del self._plans[next(iter(self._plans))]
            # `keep` holds the objects whose ids are in the key, so that no id is given to another object.
            self._plans[key] = (make(), keep)
        return self._plans[key][0]

    def _prepare_callback(self, instance: Instance, plan: Plan) -> None:
        if not isinstance(instance, Fmi3Instance) or self.kind != "co-simulation":
            return
        instance.event_mode = needs_events(self.description, self.kind)
        in_one_call = self.stepping == "free" and is_offered(instance)
        if plan.mode != "intermediate" or plan.smooth is None or in_one_call:
            instance.intermediate_update, instance.intermediate_references = 0, ()
            self._update = None
            return
        self._update = IntermediateUpdate(instance, self.progress, self.backend == "compiled")
        self._update.prepare(plan, instance)

    def _free(self) -> None:
        if self._instance is None or not self._instance.handle:
            return
        self.progress[0] = Phase.FREE
        self._instance.free()

    @property
    def is_dead(self) -> bool:
        """Whether the FMU reported a fatal error: its process must not use it any more."""
        return self._instance is not None and self._instance.is_dead

    def close(self) -> None:
        """Free the instance and remove the folder if this object unpacked it."""
        self._free()
        self._instance = None
        self._plans.clear()
        if self._scratch is not None:
            self._scratch.remove()


def _default_backend() -> Backend:
    try:
        importlib.import_module("thsa_cosim.fmu.compiled")
    except ImportError:
        _log.warning(
            "Without numba the loop over communication steps runs in Python, up to ten times slower with the same"
            " numbers: pip install 'thsa-cosim[fast]'."
        )
        return "python"
    except Exception as error:
        _log.warning("numba cannot be used (%s): the same numbers, but up to ten times slower.", error)
        return "python"
    return "compiled"
