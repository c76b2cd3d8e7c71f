"""Messages between a runner and its workers: length-prefixed pickles over pipes."""

import os
import pickle
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, BinaryIO, NamedTuple

from thsa_cosim.batch.outcome import Outcome

_LENGTH = struct.Struct("<Q")


@dataclass(frozen=True)
class Setup:
    """First message to a worker."""

    root: str
    """The study's folder: experiments, unpacked FMUs."""
    folder: str
    """The worker's own folder: console, progress, cwd/."""
    memory_limit: int | None
    """Bytes that the worker may grow by."""
    console_limit: int
    """Bytes of native output kept per run."""
    kind: str | None
    backend: str | None
    reuse: str
    main: dict[str, Any] | None
    """What ``multiprocessing`` needs to import the parent's __main__, where reducers live in it."""


@dataclass(frozen=True)
class Ready:
    """First message from a worker: imports are done, machine code is loaded."""

    rss: int
    """Resident bytes of the idle worker."""


class Order(NamedTuple):
    """One job for a worker; orders travel in lists."""

    serial: int
    experiment: int
    values: dict[str, float]
    keep_signals: bool


@dataclass(frozen=True)
class Recall:
    """Give back the orders that are not begun: another worker has nothing to do."""


@dataclass(frozen=True)
class Returned:
    """The orders given back."""

    serials: tuple[int, ...]


class Done(NamedTuple):
    """One finished job."""

    serial: int
    outcome: Outcome
    rss: int
    leaves: bool
    """The worker ends itself now, as the FMU reported a fatal error."""


@dataclass(frozen=True)
class Stop:
    """Last message to a worker; a pipe that ends without it means that the parent has died."""


def write_frame(descriptor: int, message: Any) -> None:
    """Send one message; OSError if nobody reads any more."""
    data = pickle.dumps(message, protocol=pickle.HIGHEST_PROTOCOL)
    frame = memoryview(_LENGTH.pack(len(data)) + data)
    while frame:
        frame = frame[os.write(descriptor, frame) :]


def read_frame(pipe: BinaryIO) -> Any | None:
    """Wait for one message; None when the pipe has ended (a torn message counts as ended)."""
    try:
        head = pipe.read(_LENGTH.size)
        if len(head) < _LENGTH.size:
            return None
        (length,) = _LENGTH.unpack(head)
        data = pipe.read(length)
    except (OSError, ValueError):
        return None
    return pickle.loads(data) if len(data) == length else None


class FrameReader:
    """Puts messages together from what a pipe has at a time."""

    def __init__(self) -> None:
        self._buffer = bytearray()

    def feed(self, data: bytes) -> Iterator[Any]:
        """Take some bytes; yield the messages that are complete now."""
        self._buffer += data
        while len(self._buffer) >= _LENGTH.size:
            (length,) = _LENGTH.unpack_from(self._buffer)
            end = _LENGTH.size + length
            if len(self._buffer) < end:
                return
            message = pickle.loads(memoryview(self._buffer)[_LENGTH.size : end].tobytes())
            del self._buffer[:end]
            yield message
