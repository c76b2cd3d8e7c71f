"""Which recordings a scenario or the command line means."""

import glob
import os
from collections.abc import Sequence
from pathlib import Path

from thsa_cosim.errors import ScenarioError, did_you_mean_path


def expand(path: Path, key: str, own: Sequence[str], replaced_by: Sequence[Path | str]) -> list[Path]:
    """Return the files that ``replaced_by`` means (relative to here), else ``own`` (relative to the scenario).

    A name with ``*``, ``?`` or ``[`` that is no file is a glob, sorted by name; no file comes twice.

    Raises
    ------
    ScenarioError
        If a glob matches nothing.
    """
    folder, names = (Path(), [str(n) for n in replaced_by]) if replaced_by else (path.parent, list(own))
    option = f"--{key.rsplit('.', 1)[-1]}" if replaced_by else key
    found: dict[str, Path] = {}
    for name in names:
        for file in _matches(option, folder, name):
            found.setdefault(os.path.realpath(file), file)  # resolve() raises on loops of links
    return list(found.values())


def _matches(option: str, folder: Path, name: str) -> list[Path]:
    plain = folder / name
    try:
        if not glob.has_magic(name) or plain.exists():
            return [plain]
        matches = sorted(Path(p) for p in glob.glob(str(plain), recursive=True))  # noqa: PTH207 (absolute patterns)
    except (OSError, ValueError, RecursionError) as error:
        raise ScenarioError(f"{option}: {name!r} is no usable path ({error}).") from None
    if matches:
        return matches
    raise ScenarioError(
        f"{option}: {name!r} matches no file in {folder.resolve()}.{did_you_mean_path(plain)}"
    )


def named(paths: Sequence[Path]) -> list[tuple[Path, str]]:
    """Return each path with a name of its own: the stem, with folders before it where stems repeat."""
    names = [p.stem for p in paths]
    for depth in range(1, 12):
        repeated = {n for n in names if names.count(n) > 1}
        if not repeated:
            break
        names = [
            "/".join((*Path(os.path.realpath(p)).parts[-1 - depth : -1], p.stem)) if n in repeated else n
            for p, n in zip(paths, names, strict=True)
        ]
    return [(p, n if names.count(n) == 1 else str(p)) for p, n in zip(paths, names, strict=True)]
