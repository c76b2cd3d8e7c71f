"""Messages between a runner and its workers: length-prefixed pickles over pipes."""

import os
import pickle
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, BinaryIO, NamedTuple

from thsa_cosim.batch.outcome import Outcome

_HEAD = struct.Struct("<4sIQ")
"""Mark, checksum and length of what follows: an FMU may write into any descriptor of its process."""
_MARK = b"THSA"
_LONGEST = 2**33
_LONG = 2**20
"""Bytes from which on a message is written in two pieces."""


class MalformedMessage(Exception):
    """What came through a pipe is no message."""


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
    stepping: str
    main: dict[str, Any] | None
    """What ``multiprocessing`` needs to import the parent's __main__, where reducers live in it."""


@dataclass(frozen=True)
class Ready:
    """First message from a worker: imports are done, machine code is loaded."""

    rss: int
    """Resident bytes of the idle worker."""
    pid: int
    """Its process id (the runner started the process that supervises it)."""


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
    """The worker ends itself now: a fatal error, or what the FMU has changed in its process."""


@dataclass(frozen=True)
class Malformed:
    """Stands for what came out of a worker's pipe and is no message."""


@dataclass(frozen=True)
class Stop:
    """Last message to a worker; a pipe that ends without it means that the parent has died."""


def pack(message: Any) -> bytes:
    """Return one message as it travels."""
    data = pickle.dumps(message, protocol=pickle.HIGHEST_PROTOCOL)
    return _HEAD.pack(_MARK, zlib.crc32(data), len(data)) + data


def write_frame(descriptor: int, message: Any) -> None:
    """Send one message; OSError if nobody reads any more."""
    data = pickle.dumps(message, protocol=pickle.HIGHEST_PROTOCOL)
    head = _HEAD.pack(_MARK, zlib.crc32(data), len(data))
    # A long message is not copied once more for the sake of a single write.
    for piece in (head, data) if len(data) > _LONG else (head + data,):
        rest = memoryview(piece)
        while rest:
            rest = rest[os.write(descriptor, rest) :]


def _length(head: bytes | bytearray | memoryview) -> tuple[int, int]:
    mark, checksum, length = _HEAD.unpack_from(head)
    if mark != _MARK or length > _LONGEST:
        raise MalformedMessage
    return checksum, length


def _unpack(data: bytes | memoryview, checksum: int) -> Any:
    if zlib.crc32(data) != checksum:
        raise MalformedMessage
    try:
        return pickle.loads(data)
    except Exception:
        raise MalformedMessage from None


def read_frame(pipe: BinaryIO) -> Any | None:
    """Wait for one message; None when the pipe has ended (a torn message counts as ended).

    MalformedMessage for anything else.
    """
    try:
        head = pipe.read(_HEAD.size)
        if len(head) < _HEAD.size:
            return None
        checksum, length = _length(head)
        data = pipe.read(length)
    except (OSError, ValueError):
        return None
    return _unpack(data, checksum) if len(data) == length else None


class FrameReader:
    """Puts messages together from what a pipe has at a time."""

    def __init__(self) -> None:
        self._buffer = bytearray()

    def feed(self, data: bytes) -> Iterator[Any]:
        """Take some bytes; yield the messages that are complete now. MalformedMessage for what is none."""
        self._buffer += data
        while len(self._buffer) >= _HEAD.size:
            checksum, length = _length(self._buffer)
            end = _HEAD.size + length
            if len(self._buffer) < end:
                return
            with memoryview(self._buffer) as whole, whole[_HEAD.size : end] as own:
                message = _unpack(own, checksum)
            del self._buffer[:end]
            yield message
