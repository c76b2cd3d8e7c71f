"""What is shipped beside the code: the Modelica package, its FMUs, the scenarios and their recordings.

In a checkout these are the folders ``modelica``, ``fmus`` and ``scenarios``; a wheel carries them inside the package,
side by side as in the checkout, so that the paths in a scenario hold in both.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from thsa_cosim.errors import InputError, did_you_mean

FOLDERS = ("modelica", "fmus", "scenarios")
_IN_WHEEL = Path(__file__).parent / "_shipped"


def shipped(*parts: str) -> Path:
    """Return the path of something shipped, such as ``shipped("modelica", "THSA")``; InputError if it is not there."""
    root = _IN_WHEEL if _IN_WHEEL.is_dir() else Path(__file__).parents[1]
    path = root.joinpath(*parts)
    if not path.exists():
        raise InputError(f"{path} is missing: this installation is incomplete; install thsa-cosim again.")
    return path


def modelica_package(beside: Path = Path()) -> Path:
    """Return the folder of the Modelica package THSA: the one at ``beside``/modelica, else the shipped one."""
    own = beside / "modelica" / "THSA"
    return own if (own / "package.mo").is_file() else shipped("modelica", "THSA")


@dataclass(frozen=True)
class Example:
    """A shipped scenario; ``needs`` are its files, relative to the shipped root, ``missing`` what is not shipped."""

    name: str
    title: str
    kind: str
    needs: tuple[Path, ...]
    missing: tuple[str, ...]


def examples() -> dict[str, Example]:
    """Return the shipped scenarios by name."""
    return {path.stem: _example(path) for path in sorted(shipped("scenarios").glob("*.toml"))}


def copy_example(name: str, folder: Path) -> list[Path]:
    """Copy a shipped scenario with its FMU, recordings and Modelica package; return the files, scenario first.

    Files keep their places (``scenarios/motor.toml``, ``fmus/Motor.fmu``), so that several examples share them.
    InputError if ``name`` is unknown, or a file of ``folder`` differs from the one that would be copied.
    """
    import shutil  # with its compressors half a command's start

    known = examples()
    if name not in known:
        raise InputError(
            f"There is no example {name!r}.{did_you_mean(name, known) or ' Known: ' + ', '.join(known) + '.'}"
        )
    root = shipped()
    package = [p.relative_to(root) for p in sorted(shipped("modelica").rglob("*")) if p.is_file()]
    wanted = [*known[name].needs, *package, Path("fmus", "manifest.json")]
    for place in wanted:
        target = folder / place
        if target.exists() and target.read_bytes() != (root / place).read_bytes():
            raise InputError(
                f"{target} exists and differs from the example's; choose another folder with -o."
            )
    for place in wanted:
        target = folder / place
        if not target.exists():
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(root / place, target)
    return [folder / place for place in wanted]


def _example(path: Path) -> Example:
    import tomllib

    content = tomllib.loads(path.read_text(encoding="utf-8"))
    needs, missing = [path], []
    for text in _texts(content):
        found = _files(path.parent, text)
        needs += found
        if not found and Path(text).suffix in (".fmu", ".parquet", ".csv", ".mat", ".toml"):
            missing.append(text)
    if (content.get("recordings") or {}).get("fit") == []:
        missing.append("its recordings")
    needs += _licences(needs)
    for stage in [p for p in needs[1:] if p.suffix == ".toml"]:
        needs += [shipped() / place for place in _example(stage).needs]
    root = shipped().resolve()
    places = dict.fromkeys(p.resolve().relative_to(root) for p in needs)
    return Example(
        path.stem,
        content.get("title", path.stem),
        content.get("kind", "identify"),
        tuple(places),
        tuple(missing),
    )


def _licences(files: Sequence[Path]) -> list[Path]:
    """What belongs to measured recordings of others: ``servo_LICENSE.txt`` to ``servo_*``, and where they come from."""
    licences = {p.with_name(f"{p.stem.split('_')[0]}_LICENSE.txt") for p in files}
    found = sorted(p for p in licences if p.is_file())
    return [*found, *(p.with_name("SOURCES.md") for p in found[:1])]


def _files(folder: Path, text: str) -> list[Path]:
    """The files that a text of a scenario names, relative to it; none for a text that is no path."""
    if "." not in text or "\n" in text or len(text) > 200 or Path(text).is_absolute():
        return []
    return sorted(p for p in folder.glob(text) if p.is_file())


def _texts(content: Any) -> Iterator[str]:
    if isinstance(content, str):
        yield content
    elif isinstance(content, list | dict):
        for inner in content.values() if isinstance(content, dict) else content:
            yield from _texts(inner)
