"""What is to be closed is a context manager."""

from types import TracebackType
from typing import Self


class Closing:
    """``with`` closes it at the end, whatever happened; a subclass says what ``close`` means."""

    def close(self) -> None:
        """Give back what is held; closing twice does no harm."""
        raise NotImplementedError

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
