"""Several searches at once over one runner: their requests are gathered and answered as one batch.

A search (SciPy's, say) calls a function and waits for its answer. Each search therefore runs in a thread of
its own and asks; once every unfinished search waits, the main thread answers all of them together, so that
no worker idles while one search has few vectors to try. What a search is told never depends on the others,
and neither does its result.
"""

import queue
import threading
from collections.abc import Callable, Generator, Sequence
from typing import Generic, TypeVar

Request = TypeVar("Request")
Reply = TypeVar("Reply")
Result = TypeVar("Result")

Ask = Callable[[Request], Reply]
Task = Callable[[Callable[[Request], Reply]], Result]


class _Cancelled(BaseException):
    """Ends a search whose answer will never come; no search may catch it as an Exception."""


class _Searcher(Generic[Request, Reply, Result]):
    """One search in its thread."""

    def __init__(self, index: int, task: Task[Request, Reply, Result], inbox: "queue.Queue[int]") -> None:
        self.index = index
        self.request: Request | None = None
        self.result: Result | None = None
        self.error: BaseException | None = None
        self.done = False
        self._inbox = inbox
        self._task = task
        self._answers: queue.Queue[tuple[bool, Reply | None]] = queue.Queue()
        self.thread = threading.Thread(target=self._run, name=f"search-{index}", daemon=True)

    def _run(self) -> None:
        try:
            self.result = self._task(self._ask)
        except _Cancelled:
            pass
        except BaseException as error:
            self.error = error
        self.done = True
        self._inbox.put(self.index)

    def _ask(self, request: Request) -> Reply:
        self.request = request
        self._inbox.put(self.index)
        usable, reply = self._answers.get()
        if not usable:
            raise _Cancelled
        return reply  # type: ignore[return-value]  # a usable answer is a Reply

    def answer(self, reply: Reply) -> None:
        self.request = None
        self._answers.put((True, reply))

    def cancel(self) -> None:
        self._answers.put((False, None))


def interleave(
    tasks: Sequence[Task[Request, Reply, Result]],
    serve: Callable[[Sequence[tuple[int, Request]]], Sequence[Reply]],
) -> Generator[tuple[int, Result], None, None]:
    """Run ``tasks`` and yield ``(index, result)`` as they finish.

    Each task is called with a function ``ask``; ``serve`` runs in the calling thread, gets the requests of
    all waiting tasks as ``(index, request)`` in order, and returns their replies in that order. An
    exception of a task or of ``serve`` (a KeyboardInterrupt, too) cancels the other tasks and is raised.
    """
    inbox: queue.Queue[int] = queue.Queue()
    searchers = [_Searcher(index, task, inbox) for index, task in enumerate(tasks)]
    running = {s.index for s in searchers}
    waiting: set[int] = set()
    for searcher in searchers:
        searcher.thread.start()
    try:
        while running:
            while len(waiting) < len(running):
                searcher = searchers[inbox.get()]
                if not searcher.done:
                    waiting.add(searcher.index)
                    continue
                running.discard(searcher.index)
                if searcher.error is not None:
                    raise searcher.error
                yield searcher.index, searcher.result  # type: ignore[misc]  # a finished task has a Result
            if not running:
                return
            order = sorted(waiting)
            requests = [(k, searchers[k].request) for k in order]
            replies = serve(requests)  # type: ignore[arg-type]  # a waiting task has a Request
            waiting.clear()
            for k, reply in zip(order, replies, strict=True):
                searchers[k].answer(reply)
    finally:
        for k in running:
            searchers[k].cancel()
        for k in running:
            searchers[k].thread.join(timeout=5.0)
