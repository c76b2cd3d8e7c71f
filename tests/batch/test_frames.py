"""Messages between a runner and its workers: short ones in one piece, long ones in two, all as they were sent."""

import os
import threading

import numpy as np
import pytest

from thsa_cosim.batch.frames import Done, FrameReader, MalformedMessage, write_frame
from thsa_cosim.batch.outcome import Outcome, Status


def received(descriptor: int, count: int, at_a_time: int) -> list[Done]:
    """The first ``count`` messages of a pipe, read a few bytes at a time."""
    reader, found = FrameReader(), []
    while len(found) < count:
        found += reader.feed(os.read(descriptor, at_a_time))
    return found


@pytest.mark.parametrize("size", [0, 3, 400_000])
def test_messages_arrive_as_they_were_sent(size: int) -> None:
    values = np.random.default_rng(size).normal(size=size)
    sent = [Done(k, Outcome(Status.OK, "", None, values + k, 0.1, ""), 1, False) for k in range(3)]
    reading, writing = os.pipe()
    thread = threading.Thread(target=lambda: [write_frame(writing, message) for message in sent])
    thread.start()
    found = received(reading, 3, 70_001)
    thread.join()
    os.close(reading)
    os.close(writing)
    assert [message.serial for message in found] == [0, 1, 2]
    for message, own in zip(found, sent, strict=True):
        assert message.outcome.reduced.tobytes() == own.outcome.reduced.tobytes()


def test_a_message_with_a_changed_byte_is_none_and_does_not_hold_the_buffer() -> None:
    reading, writing = os.pipe()
    write_frame(writing, [1, 2, 3])
    data = bytearray(os.read(reading, 10_000))
    os.close(reading)
    os.close(writing)
    data[-3] ^= 1
    reader = FrameReader()
    with pytest.raises(MalformedMessage):
        list(reader.feed(bytes(data)))
    reader._buffer.clear()  # BufferError if a view of it were left
