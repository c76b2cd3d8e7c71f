"""FMUs that a study keeps: known again by all that they were made from, and by their own content."""

import hashlib
import json
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError
from pathlib import Path

import pytest

from thsa_cosim.study import export_digest, exported, is_made_from, note_made_from


@pytest.fixture
def package(tmp_path: Path) -> Path:
    folder = tmp_path / "Small"
    (folder / "Effects").mkdir(parents=True)
    (folder / "package.mo").write_text("package Small end Small;")
    (folder / "package.order").write_text("Effects\n")
    (folder / "Effects" / "Drag.mo").write_text("within Small.Effects; block Drag end Drag;")
    return folder


def digest(
    package: Path, source: str = "model M end M;", platforms: tuple[str, ...] | None = ("linux64",)
) -> str:
    return export_digest(source, package, platforms)


EDITS: dict[str, Callable[[Path], object]] = {
    "a class": lambda p: (p / "Effects" / "Drag.mo").write_text("within Small.Effects; model Drag end Drag;"),
    "a further class": lambda p: (p / "Effects" / "More.mo").write_text(
        "within Small.Effects; block More end More;"
    ),
    "a lost class": lambda p: (p / "Effects" / "Drag.mo").unlink(),
    "a renamed class": lambda p: (p / "Effects" / "Drag.mo").rename(p / "Effects" / "Pull.mo"),
    "the order of classes": lambda p: (p / "package.order").write_text("\nEffects\n"),
}


@pytest.mark.parametrize("edit", EDITS)
def test_an_edited_package_makes_another_fmu(package: Path, edit: str) -> None:
    before = digest(package)
    EDITS[edit](package)
    assert digest(package) != before


def test_what_takes_no_part_in_an_export_does_not_count(package: Path) -> None:
    before = digest(package)
    (package / "notes.txt").write_text("not Modelica")
    (package / "package.mo").write_bytes((package / "package.mo").read_bytes().replace(b"\n", b"\r\n"))
    assert digest(package) == before == digest(Path(package.rename(package.with_name("Moved"))))


def test_the_note_says_what_the_fmu_is_made_from(tmp_path: Path) -> None:
    fmu = tmp_path / "Model.fmu"
    fmu.write_bytes(b"an FMU")
    note_made_from(fmu, "d")
    note = json.loads((tmp_path / "Model.made-from.json").read_text(encoding="utf-8"))
    assert note == {"made from": "d", "sha256": hashlib.sha256(b"an FMU").hexdigest()}


def test_the_class_the_platforms_and_the_tools_count(
    package: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen = [digest(package), digest(package, source="model N end N;"), digest(package, platforms=None)]
    seen.append(digest(package, platforms=("linux64", "win64")))
    for tool in ("casadi", "fmpy", "ziglang"):
        with monkeypatch.context() as other:
            versions = {tool: "0.0"}
            other.setattr(exported, "version", lambda name, v=versions: v.get(name, "1"))
            seen.append(digest(package))
    with monkeypatch.context() as other:
        other.setattr(exported, "__version__", "another")
        seen.append(digest(package))
    installed = tmp_path / "thsa_cosim"
    for room in ("export", "modelica"):
        (installed / room).mkdir(parents=True)
    with monkeypatch.context() as other:
        other.setattr(exported.thsa_cosim, "__file__", str(installed / "__init__.py"))
        for name in ("export/emit.py", "export/solver.c", "export/solver.h", "modelica/flatten.py"):
            seen.append(digest(package))
            (installed / name).write_text("edited")
        seen.append(digest(package))
    assert len(set(seen)) == len(seen)


def test_a_tool_that_is_not_installed_leaves_the_others_counting(
    package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def of(versions: dict[str, str]) -> str:
        def version(name: str) -> str:
            if name not in versions:
                raise PackageNotFoundError(name)
            return versions[name]

        monkeypatch.setattr(exported, "version", version)
        return digest(package)

    assert of({"ziglang": "1"}) == of({"ziglang": "1"})
    assert len({of({}), of({"ziglang": "1"}), of({"ziglang": "2"}), of({"casadi": "1", "ziglang": "1"})}) == 4


def test_a_kept_fmu_is_known_by_its_note_and_its_content(tmp_path: Path) -> None:
    fmu = tmp_path / "Model.fmu"
    assert not is_made_from(fmu, "d")
    fmu.write_bytes(b"an FMU")
    assert not is_made_from(fmu, "d")
    note_made_from(fmu, "d")
    assert is_made_from(fmu, "d")
    assert not is_made_from(fmu, "e")
    assert [p.name for p in sorted(tmp_path.iterdir())] == ["Model.fmu", "Model.made-from.json"]
    fmu.write_bytes(b"another FMU")
    assert not is_made_from(fmu, "d")
    note_made_from(fmu, "e")
    assert is_made_from(fmu, "e")
    fmu.unlink()
    assert not is_made_from(fmu, "e")


@pytest.mark.parametrize("content", ["", "[]", '{"made from": "d"', '{"made from": "d"}'])
def test_a_damaged_note_is_no_note(tmp_path: Path, content: str) -> None:
    fmu = tmp_path / "Model.fmu"
    fmu.write_bytes(b"an FMU")
    note_made_from(fmu, "d")
    note = tmp_path / "Model.made-from.json"
    assert json.loads(note.read_text())["made from"] == "d"
    note.write_text(content)
    assert is_made_from(fmu, "d") is False
