"""Where classes come from: files and folders, read only when a class in them is asked for."""

import hashlib
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from thsa_cosim.errors import ModelicaError
from thsa_cosim.modelica.parser import parse_file
from thsa_cosim.modelica.syntax import ClassDefinition


class Library:
    """The top-level classes that a model may use.

    Parameters
    ----------
    paths:
        In order of precedence: folders of packages (they hold ``package.mo``), folders that hold packages or ``.mo``
        files, as in MODELICAPATH, and ``.mo`` files. A folder of packages may carry a version (``Modelica 4.1.0``).
    """

    def __init__(self, paths: Sequence[Path]) -> None:
        self.paths = list(paths)
        self.files: dict[Path, tuple[str, list[ClassDefinition]]] = {}
        self._top: dict[str, ClassDefinition | None] = {}
        self._nested: dict[tuple[int, str], ClassDefinition | None] = {}

    def read(self, file: Path) -> tuple[str, list[ClassDefinition]]:
        """The within clause and the classes of a file, parsed once."""
        if file not in self.files:
            self.files[file] = parse_file(file)
        return self.files[file]

    def top(self, name: str) -> ClassDefinition | None:
        """A class by its name at the top of the hierarchy."""
        if name not in self._top:
            self._top[name] = next(self._find(name), None)
        return self._top[name]

    def _find(self, name: str) -> Iterator[ClassDefinition]:
        for path in self.paths:
            if path.is_file():
                within, classes = self.read(path)
                yield from (c for c in classes if c.name == name and not within)
                continue
            if (path / "package.mo").is_file():
                if unversioned(path.name) == name:
                    yield self._package(path, name)
                continue
            for folder in _folders(path, name):
                yield self._package(folder, name)
            file = path / f"{name}.mo"
            if file.is_file():
                within, classes = self.read(file)
                yield from (c for c in classes if c.name == name and not within)

    def _package(self, folder: Path, name: str) -> ClassDefinition:
        _, classes = self.read(folder / "package.mo")
        for definition in classes:
            if definition.name == name:
                return definition
        raise ModelicaError(
            f"{folder / 'package.mo'}: does not define the package {name}, as its folder says."
        )

    def nested(self, definition: ClassDefinition, name: str) -> ClassDefinition | None:
        """A class that is defined inside another one, in its text or in its folder."""
        key = (id(definition), name)
        if key not in self._nested:
            self._nested[key] = self._find_nested(definition, name)
        return self._nested[key]

    def _find_nested(self, definition: ClassDefinition, name: str) -> ClassDefinition | None:
        for element in definition.elements:
            if isinstance(element, ClassDefinition) and element.name == name:
                return element
        if definition.file.name != "package.mo" or definition not in self.read(definition.file)[1]:
            return None
        folder = definition.file.parent
        for file in (folder / f"{name}.mo", folder / name / "package.mo"):
            if file.is_file():
                for found in self.read(file)[1]:
                    if found.name == name:
                        return found
                raise ModelicaError(f"{file}: does not define the class {name}, as its name says.")
        return None

    def children(self, definition: ClassDefinition) -> list[str]:
        """Names of the classes inside a class."""
        found = [e.name for e in definition.elements if isinstance(e, ClassDefinition)]
        if definition.file.name == "package.mo" and definition in self.read(definition.file)[1]:
            folder = definition.file.parent
            found += [p.stem for p in folder.glob("*.mo") if p.name != "package.mo"]
            found += [p.parent.name for p in folder.glob("*/package.mo")]
        return sorted(set(found))

    def find(self, name: str) -> ClassDefinition | None:
        """A class by its qualified name."""
        first, *rest = name.split(".")
        found = self.top(first)
        for part in rest:
            if found is None:
                return None
            found = self.nested(found, part)
        return found

    def names(self) -> list[str]:
        """Names of the top-level classes that the paths hold, without reading any file of a package."""
        found: set[str] = set()
        for path in self.paths:
            if path.is_file():
                found |= {c.name for c in self.read(path)[1]}
            elif (path / "package.mo").is_file():
                found.add(unversioned(path.name))
            elif path.is_dir():
                found |= {unversioned(p.parent.name) for p in path.glob("*/package.mo")}
                found |= {p.stem for p in path.glob("*.mo")}
        return sorted(found)

    def digest(self) -> str:
        """SHA-256 over the files that were read, by name and content, independent of where they lie."""
        digest = hashlib.sha256()
        contents = sorted((f.name.encode(), f.read_bytes().replace(b"\r\n", b"\n")) for f in self.files)
        for name, content in contents:
            digest.update(name + b"\0" + content + b"\0")
        return digest.hexdigest()


def unversioned(folder: str) -> str:
    """``Modelica 4.1.0`` → ``Modelica`` (Modelica Language Specification 3.6, 13.4)."""
    return re.sub(r"[ -]\d[\w.+-]*$", "", folder)


def _folders(path: Path, name: str) -> list[Path]:
    """Folders of a package in a folder of packages, the one without a version first, then the newest."""
    plain = path / name
    found = [plain] if (plain / "package.mo").is_file() else []
    versioned = [p.parent for p in path.glob(f"{name} *[0-9]*/package.mo")] if path.is_dir() else []
    versioned = [p for p in versioned if unversioned(p.name) == name]

    def version(folder: Path) -> list[int]:
        return [int(number) for number in re.findall(r"\d+", folder.name[len(name) :])]

    return found + sorted(versioned, key=version, reverse=True)
