"""The page of a running study, written again and again; the browser loads it anew by itself."""

import time
from collections.abc import Callable, Iterator
from pathlib import Path

from thsa_cosim.report.folder import Study, read_study
from thsa_cosim.report.page.write import PAGE, Live, write_page
from thsa_cosim.report.parts.failures import evaluations

QUIET_S = 60.0
"""A folder in which nothing changes for so long belongs to no running study, unless a journal says so."""


def follow(
    folder: Path,
    output: Path | None = None,
    *,
    every: float = 5.0,
    sleep: Callable[[float], None] = time.sleep,
) -> Iterator[Path]:
    """Write the page every ``every`` s while the study in ``folder`` runs, then once more; yields its path each time.

    Raises InputError as ``write_page`` does.
    """
    begin, first = time.monotonic(), None
    try:
        while _is_going(study := read_study(folder), output or folder / PAGE):
            done = sum(evaluations(part) for part in study.parts)
            first = done if first is None else first
            elapsed = time.monotonic() - begin
            rate = (done - first) / elapsed if elapsed > 0.0 else 0.0
            yield write_page(folder, output, Live(every, rate))
            sleep(every)
    finally:
        page = write_page(folder, output)
    yield page


def _is_going(study: Study, page: Path) -> bool:
    if study.status == "running":
        return True
    if study.status in ("complete", "interrupted"):
        return False
    changed = [
        p.stat().st_mtime for p in study.whole.folder.rglob("*") if p.is_file() and p.name != page.name
    ]
    return time.time() - max(changed, default=0.0) < QUIET_S
