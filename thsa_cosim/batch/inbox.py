"""Where a runner hears from its workers: one queue of messages out of many pipes."""

import contextlib
import os
import queue
import selectors
import threading
import time
from collections import deque
from typing import Any, BinaryIO, Protocol

from thsa_cosim.batch.frames import FrameReader, Malformed, MalformedMessage, read_frame

Event = tuple[Any, Any, float]
"""(worker, message, time.monotonic() of its arrival).

The message None says that the pipe has ended, Malformed that something else than messages comes out of it; it is
not read any further then.
"""


class Inbox(Protocol):
    """Messages of all workers in order of arrival."""

    def add(self, worker: Any, pipe: BinaryIO) -> None:
        """Listen to a worker from now on."""
        ...

    def get(self, timeout: float) -> Event | None:
        """Return the next event, or None after ``timeout`` seconds without any."""
        ...

    def remove(self, worker: Any) -> list[Event]:
        """Forget a worker whose process is gone; return what it had still sent."""
        ...

    def close(self) -> None:
        """Release what belongs to the inbox itself."""
        ...


class SelectInbox:
    """Reads in the caller's thread: no switch of threads per message."""

    def __init__(self) -> None:
        self._selector = selectors.DefaultSelector()
        self._pipes: dict[Any, tuple[BinaryIO, FrameReader]] = {}
        self._events: deque[Event] = deque()

    def add(self, worker: Any, pipe: BinaryIO) -> None:
        """As ``Inbox.add``."""
        os.set_blocking(pipe.fileno(), False)
        self._pipes[worker] = pipe, FrameReader()
        self._selector.register(pipe, selectors.EVENT_READ, worker)

    def get(self, timeout: float) -> Event | None:
        """As ``Inbox.get``."""
        if not self._events:
            for key, _ in self._selector.select(timeout):
                self._read(key.data)
        return self._events.popleft() if self._events else None

    def _read(self, worker: Any) -> None:
        pipe, reader = self._pipes[worker]
        try:
            data = os.read(pipe.fileno(), 1 << 20)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        now = time.monotonic()
        if not data:
            self._selector.unregister(pipe)
            self._events.append((worker, None, now))
            return
        try:
            for message in reader.feed(data):
                self._events.append((worker, message, now))
        except MalformedMessage:
            self._selector.unregister(pipe)
            self._events.append((worker, Malformed(), now))

    def remove(self, worker: Any) -> list[Event]:
        """As ``Inbox.remove``."""
        if worker in self._pipes:
            pipe, _ = self._pipes[worker]
            while pipe in self._selector.get_map():
                before = len(self._events)
                self._read(worker)
                if len(self._events) == before and not _more(pipe):
                    # Nothing more, and no end either: a runaway child of the FMU holds the pipe.
                    self._selector.unregister(pipe)
            del self._pipes[worker]
            pipe.close()
        mine = [event for event in self._events if event[0] is worker]
        self._events = deque(event for event in self._events if event[0] is not worker)
        return mine

    def close(self) -> None:
        """As ``Inbox.close``."""
        self._selector.close()


def _more(pipe: BinaryIO) -> bool:
    with selectors.DefaultSelector() as probe:
        probe.register(pipe, selectors.EVENT_READ)
        return bool(probe.select(0.0))


class ThreadInbox:
    """One listening thread per worker, for systems whose pipes cannot be selected (Windows)."""

    def __init__(self) -> None:
        self._events: queue.SimpleQueue[Event] = queue.SimpleQueue()
        self._pipes: dict[Any, tuple[BinaryIO, threading.Thread]] = {}

    def add(self, worker: Any, pipe: BinaryIO) -> None:
        """As ``Inbox.add``."""

        def listen() -> None:
            try:
                while (message := read_frame(pipe)) is not None:
                    self._events.put((worker, message, time.monotonic()))
            except MalformedMessage:
                self._events.put((worker, Malformed(), time.monotonic()))
                return
            self._events.put((worker, None, time.monotonic()))

        thread = threading.Thread(target=listen, daemon=True)
        self._pipes[worker] = pipe, thread
        thread.start()

    def get(self, timeout: float) -> Event | None:
        """As ``Inbox.get``."""
        try:
            return self._events.get(timeout=timeout)
        except queue.Empty:
            return None

    def remove(self, worker: Any) -> list[Event]:
        """As ``Inbox.remove``."""
        if worker in self._pipes:
            pipe, thread = self._pipes.pop(worker)
            thread.join(5.0)
            if not thread.is_alive():  # else a runaway child of the FMU holds the pipe: closing would block
                pipe.close()
        mine: list[Event] = []
        others: list[Event] = []
        with contextlib.suppress(queue.Empty):
            while True:
                event = self._events.get_nowait()
                (mine if event[0] is worker else others).append(event)
        for event in others:
            self._events.put(event)
        return mine

    def close(self) -> None:
        """As ``Inbox.close``."""


def open_inbox() -> Inbox:
    """Return the inbox for this system."""
    return ThreadInbox() if os.name == "nt" else SelectInbox()
