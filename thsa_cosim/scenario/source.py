"""What a scenario is read from: a TOML file, or its content in Python."""

import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from thsa_cosim.errors import ScenarioError, did_you_mean, did_you_mean_path
from thsa_cosim.scenario.sentences import one_line
from thsa_cosim.scenario.table import Table

Source = Path | str | Mapping[str, Any] | Table
"""A TOML file, or what stands in it as a dict or as a validated table; paths are then relative to the working
directory. In a dict, paths, tuples and arrays may stand for texts and lists."""

#: What sentences call a scenario that comes from no file.
UNNAMED = Path("scenario")


def read_source(source: Source) -> tuple[Path, dict[str, Any]]:
    """Return the file's path (or what stands for it) and its tables; ScenarioError if it cannot be read."""
    if isinstance(source, Table):
        return UNNAMED, source.model_dump(by_alias=True, exclude_unset=True)
    if isinstance(source, Mapping):
        return UNNAMED, {str(key): _plain(value) for key, value in source.items()}
    try:
        path = Path(source)
    except TypeError:
        kind = type(source).__name__
        raise ScenarioError(
            f"A scenario is the path of a TOML file, or its content as a dict, not {kind}."
        ) from None
    return path, read_toml(path)


def _plain(value: Any) -> Any:
    """As TOML would have it."""
    if isinstance(value, Mapping):
        return {str(key): _plain(member) for key, member in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(member) for member in value]
    return str(value) if isinstance(value, Path) else value


def read_toml(path: Path) -> dict[str, Any]:
    """Return the file's tables; ScenarioError if it is missing or no TOML."""
    if path.is_dir():
        raise ScenarioError(one_line(f"{path}: is a folder; name a scenario file (.toml){_in_folder(path)}."))
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except FileNotFoundError:
        near = did_you_mean_path(path)
        raise ScenarioError(one_line(f"{path}: no such scenario file; check the path.{near}")) from None
    except UnicodeDecodeError:
        raise ScenarioError(one_line(f"{path}: is {_no_text(path)}")) from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise ScenarioError(one_line(f"{path}: cannot be read ({reason}).")) from None
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
        raise ScenarioError(one_line(f"{path}: is no valid TOML ({error}); correct it.")) from None


def _in_folder(folder: Path) -> str:
    """``, such as folder/motor.toml``, if the folder holds one."""
    found = min(folder.glob("*.toml"), default=None)
    return "" if found is None else f", such as {found}"


def _no_text(path: Path) -> str:
    """What a file that is no UTF-8 text is, and what to do about it."""
    if path.suffix.lower() == ".toml":
        return "not UTF-8 text; save it as UTF-8."
    model = path.suffix.lower() in (".fmu", ".ssp")
    what, arguments = ("a model", f"{path} RECORDING") if model else ("no text", f"MODEL.fmu {path}")
    return f"{what}, no scenario file (.toml); 'thsa-cosim init {arguments}' writes one."


def about_kind(data: Mapping[str, Any], known: Iterable[str]) -> tuple[str, str]:
    """Return what is wrong with ``kind``, which is none of ``known``, and a hint at what was meant."""
    kind = data.get("kind")
    if kind is not None:
        return f"is {kind!r}", did_you_mean(kind, known) if isinstance(kind, str) else ""
    misspelt = next((k for k in data if did_you_mean(k, ["kind"])), None)
    if misspelt is None:
        return "is missing", ""
    return f"is missing ({misspelt!r} is no key)", did_you_mean(misspelt, ["kind"])
