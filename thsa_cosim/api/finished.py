"""A finished study, kept as its command left it: the same command again shows it and simulates nothing.

``finished.json`` holds what was printed, which files were written, and what result.json they belong to. Where any of it
is not as it was, the study is conducted again: from its journal, as far as that goes.
"""

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from thsa_cosim.report.files import RESULT, write_json
from thsa_cosim.study import digest_of_file

if TYPE_CHECKING:
    from rich.console import Console

FINISHED = "finished.json"
#: Columns of what is kept, as of what is printed into a pipe.
WIDTH = 140


@dataclass(frozen=True)
class Finished:
    """What is left of a study's end: what it printed, the files that it wrote, why its result is of no use."""

    printed: str
    files: tuple[Path, ...]
    objection: str


def keep_finished(
    folder: Path,
    show: Callable[["Console"], None],
    files: Iterable[Path],
    objection: str,
    words: Mapping[str, Any],
) -> None:
    """Keep the end of a study whose files are written; ``words``: all that is shown and asks nothing."""
    from rich.console import Console

    # In a notebook, a console shows what it prints, whatever its file.
    out = Console(file=StringIO(), width=WIDTH, color_system=None, force_terminal=False, force_jupyter=False)
    show(out)
    content = {
        "result": digest_of_file(folder / RESULT),
        "words": dict(words),
        "objection": objection,
        "files": [path.relative_to(folder).as_posix() for path in files],
        "printed": out.file.getvalue(),  # type: ignore[attr-defined]
    }
    write_json(folder / FINISHED, content)


def finished(folder: Path, words: Mapping[str, Any]) -> Finished | None:
    """The end of the study in ``folder``; None unless all of it is there as it was, under the same words."""
    try:
        kept = json.loads((folder / FINISHED).read_text(encoding="utf-8"))
        files = tuple(folder / name for name in kept["files"])
        same = kept["result"] == digest_of_file(folder / RESULT) and kept["words"] == json.loads(
            json.dumps(dict(words))
        )
        found = Finished(str(kept["printed"]), files, str(kept["objection"]))
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return found if same and all(path.is_file() for path in files) else None
