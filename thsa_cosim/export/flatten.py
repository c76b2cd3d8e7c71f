"""A class by its name or by its file → the flat model; where the libraries are looked for."""

import os
import re
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path

from thsa_cosim.errors import ModelicaError, did_you_mean, did_you_mean_path
from thsa_cosim.modelica.flat import Experiment, FlatEquation, FlatModel, FlatVariable
from thsa_cosim.modelica.flatten import flatten_class
from thsa_cosim.modelica.library import Library, unversioned
from thsa_cosim.modelica.syntax import ClassDefinition, Component, Extends
from thsa_cosim.shipped import shipped

__all__ = [
    "Experiment",
    "FlatEquation",
    "FlatModel",
    "FlatVariable",
    "components",
    "flatten",
    "holders",
    "list_models",
    "locate",
]


def flatten(model: str, package: Path, libraries: Sequence[Path] = (), *, folded: bool = False) -> FlatModel:
    """Flatten a Modelica class.

    Parameters
    ----------
    model:
        Qualified class name (``THSA.Actuator``, or ``Actuator`` for the package at hand) or the path of a
        ``.mo`` file that holds the class.
    package:
        Folder of the Modelica package (it holds ``package.mo``) that the class belongs to or uses.
    libraries:
        Further packages, folders of packages or files; those of the environment variable MODELICAPATH follow.
    folded:
        Fix all Boolean and Integer parameters at export. Without it those of the class itself can be set in the FMU
        where they do not shape its equations.

    Raises
    ------
    ModelicaError
        The class is not found, does not compile, or is outside the exportable subset.
    """
    library, _, name = _find(model, package, libraries)
    return flatten_class(library, name, folded)


def locate(model: str, package: Path, libraries: Sequence[Path] = ()) -> tuple[Path, str]:
    """File and qualified name of a class given by name or ``.mo`` file; raises ModelicaError if there is none."""
    _, file, name = _find(model, package, libraries)
    return file, name


def components(model: str, package: Path, libraries: Sequence[Path] = ()) -> dict[str, Component]:
    """Components that a class declares or inherits, by name, less those that an extends clause redeclares.

    Raises ModelicaError if the class, or one that it extends, is not found.
    """
    library, _, name = _find(model, package, libraries)
    definition = library.find(name)
    assert definition is not None  # `_find` has found it
    found: dict[str, Component] = {}
    _gather(library, definition, name, found)
    return found


def _gather(library: Library, definition: ClassDefinition, name: str, found: dict[str, Component]) -> None:
    redeclared: set[str] = set()
    for element in definition.elements:
        if isinstance(element, Extends):
            base, base_name = _base(library, element.type, name)
            if base is None:
                continue  # a built-in type, or what flattening reports better
            own: dict[str, Component] = {}
            _gather(library, base, base_name, own)
            taken = {a.redeclare.name for a in element.arguments if isinstance(a.redeclare, Component)}
            found |= {key: value for key, value in own.items() if key not in taken}
            redeclared |= taken
    for element in definition.elements:
        if isinstance(element, Component) and element.name not in redeclared:
            found[element.name] = element


def _base(library: Library, base: str, name: str) -> tuple[ClassDefinition | None, str]:
    """A class by its name as written in the class ``name``: looked up from there outwards (MLS 3.6, 5.3)."""
    scope = name.split(".")
    for depth in range(len(scope), -1, -1):
        qualified = ".".join([*scope[:depth], base.lstrip(".")])
        if qualified != name and (found := library.find(qualified)) is not None:
            return found, qualified
    return None, base


def holders(model: str, package: Path, libraries: Sequence[Path] = ()) -> list[str]:
    """Classes of a class's own package that hold a component of it, those that share its name first.

    By the text of the files, without parsing them: for a message. Only a qualified name is recognised.
    """
    library, _, name = _find(model, package, libraries)
    top, own = name.split(".")[0], name.rsplit(".", 1)[-1]
    definition = library.top(top)
    if definition is None or definition.file.name != "package.mo":
        return []
    root = definition.file.parent
    component = re.compile(rf"^\s*{re.escape(name)}\s+\w", re.MULTILINE)
    found = [
        ".".join((top, *file.relative_to(root).with_suffix("").parts))
        for file in sorted(root.rglob("*.mo"))
        if file.name != "package.mo" and component.search(file.read_text(encoding="utf-8", errors="replace"))
    ]
    return sorted(found, key=lambda holder: holder.rsplit(".", 1)[-1] != own)


def list_models(library: Path, search: Sequence[Path] = ()) -> list[str]:
    """Names of all models and blocks of a library that are not partial; raises ModelicaError if it is none.

    Warns of files that cannot be read.
    """
    _check(library)
    found = Library([library, *search])
    names: list[str] = []
    for top in Library([library]).names():
        try:
            definition = found.top(top)
        except ModelicaError as error:
            warnings.warn(str(error), stacklevel=2)
            continue
        if definition is not None:
            names += _models(found, definition, top)
    return names


def _models(library: Library, definition: ClassDefinition, name: str) -> Iterator[str]:
    if definition.kind in ("model", "block") and "partial" not in definition.prefixes:
        yield name
    for child in library.children(definition):
        try:
            nested = library.nested(definition, child)
        except ModelicaError as error:
            warnings.warn(str(error), stacklevel=2)
            continue
        if nested is not None:
            yield from _models(library, nested, f"{name}.{child}")


def _check(path: Path) -> None:
    if not path.exists():
        raise ModelicaError(
            f"{path}: no such library; give a package's folder, a folder of packages or a .mo file."
            f"{did_you_mean_path(path)}"
        )


def _search(package: Path, libraries: Sequence[Path]) -> list[Path]:
    """The places of libraries in order of precedence."""
    for path in libraries:
        _check(path)
    environment = [Path(p) for p in os.environ.get("MODELICAPATH", "").split(os.pathsep) if p]
    own = [package] if (package / "package.mo").is_file() else []
    return [*own, *libraries, *(p for p in environment if p.exists())]


def _with_shipped(search: Sequence[Path]) -> list[Path]:
    """Behind all others the package THSA that is shipped: a drive of one's own is built from its blocks."""
    return [*search, shipped("modelica", "THSA")]


def _find(model: str, package: Path, libraries: Sequence[Path]) -> tuple[Library, Path, str]:
    search = _search(package, libraries)
    if model.endswith(".mo"):
        return _of_file(Path(model), _with_shipped(search))
    library = Library(_with_shipped(search) if search else [])
    names = [model]
    own = unversioned(package.name)
    if (package / "package.mo").is_file() and model.split(".")[0] != own:
        names.insert(0, f"{own}.{model}")
    for name in names:
        definition = library.find(name)
        if definition is not None:
            return library, definition.file, name
    if not search:
        raise ModelicaError(
            f"{package}: is no Modelica package (no package.mo); give its folder with --package, or --library."
            f"{did_you_mean_path(package)}"
        )
    raise ModelicaError(_not_found(library, search, names))


def _not_found(library: Library, search: list[Path], names: list[str]) -> str:
    """What is missing: a class in the innermost package that exists, or its library."""
    for name in reversed(names):
        parts = name.split(".")
        for depth in range(len(parts) - 1, 0, -1):
            around = library.find(".".join(parts[:depth]))
            if around is not None and (depth > 1 or len(parts) == 2):
                hint = did_you_mean(parts[depth], library.children(around))
                return f"{around.file}: {'.'.join(parts[:depth])} holds no class {parts[depth]!r}.{hint}"
    model = names[-1]
    own = Library(search)  # without the shipped package, which nobody asked for
    known = [n for top in own.names() for n in _known(own, top)]
    hint = did_you_mean(names[0], known)
    if "." in model and not hint:
        hint = " Add the folder of its library with --library, or to MODELICAPATH."
    return f"{search[0]}: holds no class {model!r}.{hint}"


def _known(library: Library, top: str) -> list[str]:
    """Names to compare a misspelt one with; of a large library only the first level."""
    definition = library.top(top)
    if definition is None:
        return []
    children = library.children(definition)
    return [top, *(f"{top}.{child}" for child in children)]


def _of_file(file: Path, search: list[Path]) -> tuple[Library, Path, str]:
    if not file.is_file():
        raise ModelicaError(f"{file}: no such file; give a .mo file or a class name such as THSA.Actuator.")
    root, prefix = _package_of(file)
    if root is not None:
        library = Library([root, *search])
        within, classes = library.read(root / Path(*prefix.split(".")[1:], file.name) if prefix else file)
        return library, file, ".".join(part for part in (prefix, _chosen(file, library, classes)) if part)
    library = Library([file, *search, file.parent])
    within, classes = library.read(file)
    if within:  # a file of a package that lies elsewhere: its names are looked up from the top
        library.files[file] = ("", classes)
    return library, file, _chosen(file, library, classes)


def _package_of(file: Path) -> tuple[Path | None, str]:
    """Root folder of the package that a file lies in by its ``within`` clause, and that clause."""
    within, _ = Library([]).read(file)
    if not within:
        return (file.parent, "") if file.name == "package.mo" else (None, "")
    folder = file.parent if file.name != "package.mo" else file.parent.parent
    for part in reversed(within.split(".")):
        if unversioned(folder.name) != part or not (folder / "package.mo").is_file():
            return None, ""
        root, folder = folder, folder.parent
    return root, within


def _chosen(file: Path, library: Library, classes: list[ClassDefinition]) -> str:
    """The model of a file: the one that carries its name, or the one that the others serve."""
    candidates: dict[str, ClassDefinition] = {}

    def gather(definition: ClassDefinition, name: str) -> None:
        if definition.kind in ("model", "block", "class") and "partial" not in definition.prefixes:
            candidates[name] = definition
        elif definition.kind == "package":
            for element in definition.elements:
                if isinstance(element, ClassDefinition):
                    gather(element, f"{name}.{element.name}")

    for definition in classes:
        gather(definition, definition.name)
    if not candidates:
        partial = [d.name for d in classes if d.kind in ("model", "block") and "partial" in d.prefixes]
        what = f"{partial[0]} is partial" if partial else "declares no model or block"
        raise ModelicaError(f"{file}: {what}; a complete model is needed to export.")
    stem = file.parent.name if file.name == "package.mo" else file.stem
    if stem in candidates:
        return stem
    used = {t.rsplit(".", 1)[-1] for c in classes for t in _types(c)}
    free = [name for name in candidates if name.rsplit(".", 1)[-1] not in used]
    if len(free) == 1:
        return free[0]
    chosen, *others = free or candidates
    warnings.warn(
        f"{file}: holds several models; {chosen} is exported, the first that no other one uses. For another one "
        f"({', '.join(others)}): thsa-cosim export NAME --library {file}.",
        stacklevel=2,
    )
    return chosen


def _types(definition: ClassDefinition) -> Iterator[str]:
    """Names of the classes that a class uses."""
    if definition.base is not None:
        yield definition.base
    for element in definition.elements:
        if isinstance(element, ClassDefinition):
            yield from _types(element)
        elif isinstance(element, (Component, Extends)):
            yield element.type
            for argument in element.arguments:
                if isinstance(argument.redeclare, Component):
                    yield argument.redeclare.type
                elif isinstance(argument.redeclare, ClassDefinition):
                    yield from _types(argument.redeclare)
