"""The C compiler of the ziglang wheel, one at a time: two that run at once may wait for each other without end."""

import contextlib
import os
from collections.abc import Iterator, Sequence
from pathlib import Path


@contextlib.contextmanager
def one_at_a_time(command: Sequence[str]) -> Iterator[None]:
    """Wait until no other process of this user runs zig, if ``command`` does, and let others wait meanwhile.

    Compilers that share a cache lock its manifests in different orders (ziglang/zig, issue 22453). Where the system has
    no flock, or the cache cannot be written, nobody waits.
    """
    with contextlib.ExitStack() as stack:
        if "ziglang" in command:
            with contextlib.suppress(ImportError, OSError, RuntimeError):
                import fcntl

                folder = _cache()
                folder.mkdir(parents=True, exist_ok=True)
                file = stack.enter_context((folder / "thsa-cosim.lock").open("ab"))
                fcntl.flock(file, fcntl.LOCK_EX)
        yield


def _cache() -> Path:
    """Where zig keeps what it has compiled; RuntimeError without a home."""
    if own := os.environ.get("ZIG_GLOBAL_CACHE_DIR"):
        return Path(own)
    home = os.environ.get("XDG_CACHE_HOME")
    return (Path(home) if home else Path.home() / ".cache") / "zig"
