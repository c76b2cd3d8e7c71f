"""An instance in a separate process, for an FMU that cannot share one with the other components of a system.

The process lives from ``instantiate`` to ``free``. Its death is a SimulationFailure here; a call that hangs is ended
with the whole run by whoever watches that. Each call costs some 0.1 ms, and each run the start of a process.
"""

import contextlib
import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.errors import MachineError
from thsa_cosim.fmu.description import FmuDescription
from thsa_cosim.fmu.failure import SimulationFailure, Status
from thsa_cosim.fmu.fmi2 import Fmi2Instance
from thsa_cosim.fmu.fmi3 import Fmi3Instance
from thsa_cosim.fmu.instance import Channel, EventInfo, Instance
from thsa_cosim.fmu.native import Messages, MessageSink
from thsa_cosim.signals import FloatArray

_BOOT = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[1]); "
    "from thsa_cosim.fmu.apart import serve; serve(int(sys.argv[2]))"
)
_PATIENCE_S = 2.0
"""So long may a process take to end by itself."""


class ApartInstance(Instance):
    """An FMI 2.0 or 3.0 instance whose every call runs in another process (POSIX)."""

    def __init__(
        self, folder: Path, description: FmuDescription, kind: str, sink: MessageSink | None = None
    ) -> None:
        cls = Fmi2Instance if description.fmi_version == "2.0" else Fmi3Instance
        self.prefix, self.types = cls.prefix, cls.types  # type: ignore[misc]
        self.description, self.kind = description, kind
        self.messages, self.handle, self.is_dead, self.input_mode = Messages(sink), 0, False, None
        self._folder = folder
        self._start: tuple[Sequence[Channel], FloatArray] = (), np.empty(0)
        self._process: subprocess.Popen[bytes] | None = None
        self._pipe: Connection[Any, Any] | None = None

    def ask(self, verb: str, *arguments: Any) -> Any:
        """Let the other process call a method of its instance and return what comes of it."""
        assert self._pipe is not None
        try:
            self._pipe.send((verb, arguments))
            failure, result, said = self._pipe.recv()
        except (OSError, EOFError):
            raise SimulationFailure(Status.CRASH, self._last_words()) from None
        for status, text in said:
            self.messages.add(status, None, text.encode())
        if failure is not None:
            raise SimulationFailure(*failure)
        return result

    def _last_words(self) -> str:
        code = self._end()
        if code is not None and code < 0:
            import signal

            with contextlib.suppress(ValueError):
                return f"its process died by {signal.Signals(-code).name}"
        return f"its process ended with exit code {code}"

    def _end(self) -> int | None:
        """End the process; return its exit code."""
        process, pipe = self._process, self._pipe
        self._process, self._pipe, self.handle = None, None, 0
        if process is None or pipe is None:
            return None
        pipe.close()  # which ends it
        try:
            return process.wait(_PATIENCE_S)
        except subprocess.TimeoutExpired:
            process.kill()
            return process.wait()

    # -- life -------------------------------------------------------------------------------------------
    def instantiate(self) -> None:
        """Start the process, and instantiate there."""
        if os.name == "nt":
            raise MachineError("An FMU in a separate process needs Linux or macOS.")
        ours, theirs = Pipe()
        paths = json.dumps([str(Path(p).absolute()) for p in sys.path])
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-c", _BOOT, paths, str(theirs.fileno())],
            stdin=subprocess.DEVNULL,
            pass_fds=(theirs.fileno(),),
        )
        theirs.close()
        self._pipe = ours
        try:
            self.ask("open", self._folder, self.description, self.kind)
            self.ask("instantiate")
        except BaseException:
            self._end()
            raise
        self.handle = 1

    def initialize_begin(self, start: float, stop: float, tolerance: float | None) -> None:
        """Enter Initialization Mode, start values set once more."""
        self.ask("initialize_begin", start, stop, tolerance)

    def set_start(self, channels: Sequence[Channel], values: FloatArray) -> None:
        """Set start values of a new or reset instance."""
        self.ask("set_start", list(channels), values)

    def set_texts(self, texts: Mapping[int, str]) -> None:
        """Set String variables of a new or reset instance."""
        self.ask("set_texts", dict(texts))

    def initialize_end(self) -> None:
        """Leave Initialization Mode."""
        self.ask("initialize_end")

    def terminate(self) -> None:
        """End the run."""
        self.ask("terminate")

    def reset(self) -> None:
        """Bring the instance back to the state after instantiation."""
        self.ask("reset")

    def free(self) -> None:
        """Destroy the instance and end its process."""
        if self._process is not None:
            with contextlib.suppress(SimulationFailure):
                self.ask("free")
            self._end()

    # -- values -----------------------------------------------------------------------------------------
    def set_values(self, channels: Sequence[Channel], values: FloatArray) -> None:
        """Set variables to ``values`` (n,)."""
        if channels:
            self.ask("set_values", list(channels), values)

    def get_values(self, channels: Sequence[Channel], out: FloatArray) -> None:
        """Read variables into ``out`` (n,)."""
        if channels:
            found = self.ask("get_values", list(channels), len(out))
            columns = [c for channel in channels for c in channel.columns]
            out[columns] = found[columns]

    def vector(self, name: str, values: FloatArray) -> None:
        """Read or write a vector of Reals."""
        values[:] = self.ask("vector", name, values)

    # -- going on ---------------------------------------------------------------------------------------
    def set_time(self, time: float) -> None:
        """Set the independent variable [s]."""
        self.ask("set_time", time)

    def enter_event_mode(self) -> None:
        """Enter Event Mode."""
        self.ask("enter_event_mode")

    def enter_continuous_time_mode(self) -> None:
        """Enter Continuous-Time Mode."""
        self.ask("enter_continuous_time_mode")

    def event_iteration(self) -> EventInfo:
        """Call newDiscreteStates / updateDiscreteStates once."""
        found: EventInfo = self.ask("event_iteration")
        return found

    def completed_integrator_step(self) -> tuple[bool, bool]:
        """Return (enter event mode, terminate)."""
        event, terminate = self.ask("completed_integrator_step")
        return event, terminate

    def do_step(self, time: float, step: float) -> None:
        """Go from ``time`` to ``time + step`` [s]."""
        self.ask("do_step", time, step)

    def save_state(self, state: int = 0) -> int:
        """Save the FMU's state; its address is one of the other process."""
        return int(self.ask("save_state", state))

    def restore_state(self, state: int) -> None:
        """Go back to a saved state."""
        self.ask("restore_state", state)

    def free_state(self, state: int) -> None:
        """Forget a saved state."""
        self.ask("free_state", state)

    def directional_derivative(
        self, unknowns: NDArray[np.uint32], known: NDArray[np.uint32], out: FloatArray
    ) -> None:
        """Write d(unknowns)/d(known) (n,) into ``out``."""
        out[:] = self.ask("directional_derivative", unknowns, known, len(out))

    # -- what only the other process has ----------------------------------------------------------------
    def value_function(self, verb: str, suffix: str) -> Any:
        """There are no C functions on this side."""
        raise NotImplementedError

    def access(self, function: Any, references: int, count: int, values: int) -> int:
        """There are no C functions on this side."""
        raise NotImplementedError


class _Host:
    """The other side: one instance and what it is asked for."""

    def __init__(self) -> None:
        self._instance: Instance
        self.said: list[tuple[int, str]] = []

    def answer(self, verb: str, arguments: tuple[Any, ...]) -> Any:
        """Do what ``ask`` names; methods that fill an array return it."""
        if verb == "open":
            folder, description, kind = arguments
            cls = Fmi2Instance if description.fmi_version == "2.0" else Fmi3Instance
            self._instance = cls(folder, description, kind)
            self._instance.messages = _Heard(self.said)
            return None
        method = getattr(self._instance, verb)
        if verb in ("get_values", "directional_derivative"):
            out = np.zeros(arguments[-1])
            method(*arguments[:-1], out)
            return out
        if verb == "vector":
            method(*arguments)
            return arguments[1]
        return method(*arguments)


class _Heard(Messages):
    """Messages on their way to the other side."""

    def __init__(self, said: list[tuple[int, str]]) -> None:
        super().__init__()
        self._said = said

    def add(self, status: int, category: bytes | None, message: bytes | None) -> None:
        """Take one log message, for here and for there."""
        super().add(status, category, message)
        self._said.append((status, (message or b"").decode("utf-8", "replace")))


def serve(descriptor: int) -> None:
    """Entry point of the process: answer until the pipe ends."""
    pipe: Connection[Any, Any] = Connection(descriptor)
    host = _Host()
    with contextlib.suppress(EOFError, OSError):
        while True:
            verb, arguments = pipe.recv()
            failure, result = None, None
            try:
                result = host.answer(verb, arguments)
            except SimulationFailure as error:
                failure = (error.status, error.reason)
            pipe.send((failure, result, host.said[-8:]))
            host.said.clear()
    os._exit(0)  # native destructors and threads of an FMU could still crash or hang
