"""Several searches over one engine: answered together, ended together."""

import threading
import time

import pytest

from thsa_cosim.study import interleave


def countdown(steps: int):
    def task(ask):
        return [ask(k) for k in range(steps)]

    return task


def test_interleaving_answers_all_waiting_tasks_in_one_batch() -> None:
    batches = []

    def serve(requests):
        batches.append(list(requests))
        return [index * 100 + request for index, request in requests]

    found = dict(interleave([countdown(3), countdown(1), countdown(2)], serve))
    assert found == {0: [0, 1, 2], 1: [100], 2: [200, 201]}
    assert batches == [[(0, 0), (1, 0), (2, 0)], [(0, 1), (2, 1)], [(0, 2)]]


def test_interleaving_serves_in_the_calling_thread() -> None:
    threads = set()

    def serve(requests):
        threads.add(threading.current_thread())
        return [0 for _ in requests]

    list(interleave([countdown(2), countdown(2)], serve))
    assert threads == {threading.current_thread()}


def test_an_error_in_one_task_ends_the_others_and_is_raised() -> None:
    ended = []

    def patient(ask):
        try:
            while True:
                ask(0)
        finally:
            ended.append(True)

    def broken(ask):
        ask(0)
        raise ZeroDivisionError("one")

    with pytest.raises(ZeroDivisionError, match="one"):
        list(interleave([patient, broken, patient], lambda requests: [0 for _ in requests]))
    assert ended == [True, True]
    assert not [t for t in threading.enumerate() if t.name.startswith("search-")]


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_an_interrupted_batch_keeps_what_was_yielded(error: type[BaseException]) -> None:
    def serve(requests):
        if len(requests) == 1:
            raise error
        return [0 for _ in requests]

    found = {}

    def consume() -> None:
        found.update((index, result) for index, result in interleave([countdown(1), countdown(5)], serve))

    with pytest.raises(error):
        consume()
    assert found == {0: [0]}
    time.sleep(0.05)
    assert not [t for t in threading.enumerate() if t.name.startswith("search-")]


def test_a_task_without_questions_finishes() -> None:
    assert dict(interleave([countdown(0), countdown(1)], lambda requests: [7] * len(requests))) == {
        0: [],
        1: [7],
    }
    assert list(interleave([], lambda requests: [])) == []
