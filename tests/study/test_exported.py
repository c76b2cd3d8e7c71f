"""FMUs that a study keeps: known again by all that they were made from, and by their own content."""

import errno
import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError
from pathlib import Path

import pytest

from thsa_cosim.study import export_digest, exported, is_made_from, keep, note_made_from, take_kept


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
    for room in ("export", "modelica", "fmu", "system"):
        (installed / room).mkdir(parents=True)
    with monkeypatch.context() as other:
        other.setattr(exported.thsa_cosim, "__file__", str(installed / "__init__.py"))
        for name in (
            "export/emit.py",
            "export/solver.c",
            "export/solver.h",
            "modelica/flatten.py",
            "fmu/sources.py",
            "system/order.py",
        ):
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


def test_the_shipped_blocks_count(package: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shipped = tmp_path / "shipped"
    monkeypatch.setattr(exported, "shipped", lambda *_: shipped)
    shipped.mkdir()
    before = digest(package)
    (shipped / "Screw.mo").write_text("within THSA; model Screw end Screw;")
    assert digest(package) != before


def test_without_ziglang_the_machines_compiler_counts(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def version(name: str) -> str:
        if name == "ziglang":
            raise PackageNotFoundError(name)
        return "1"

    monkeypatch.setattr(exported, "version", version)
    seen = set()
    for compiler in ("gcc 12", "gcc 13", None):
        monkeypatch.setattr("thsa_cosim.export.compile.compiler_version", lambda c=compiler: c)
        seen |= {digest(package), digest(package)}
    assert len(seen) == 3


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("THSA_COSIM_CACHE", str(tmp_path / "cache"))
    monkeypatch.delenv("MODELICAPATH", raising=False)
    return tmp_path / "cache" / "fmus"


def fmu_of(folder: Path, content: bytes = b"an FMU") -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "Model.fmu").write_bytes(content)
    return folder / "Model.fmu"


def test_another_study_takes_what_one_has_kept(cache: Path, tmp_path: Path) -> None:
    other = tmp_path / "Other.fmu"
    assert not take_kept(other, "d")
    keep(fmu_of(tmp_path / "one"), "d")
    assert not take_kept(other, "e")
    assert not other.exists()
    assert take_kept(other, "d")
    assert other.read_bytes() == b"an FMU"
    assert [path.suffix for path in cache.iterdir()] == [".fmu"]


def test_a_copy_is_not_tied_to_the_kept_one(cache: Path, tmp_path: Path) -> None:
    keep(fmu_of(tmp_path / "one"), "d")
    other = tmp_path / "Other.fmu"
    take_kept(other, "d")
    other.write_bytes(b"spoilt")
    assert take_kept(other, "d")
    assert other.read_bytes() == b"an FMU"


@pytest.mark.parametrize("content", [b"", b"an FM", b"an FMu", b"an FMU and more"])
def test_a_damaged_kept_fmu_is_forgotten(cache: Path, tmp_path: Path, content: bytes) -> None:
    keep(fmu_of(tmp_path / "one"), "d")
    (kept,) = cache.iterdir()
    kept.write_bytes(content)
    other = tmp_path / "Other.fmu"
    assert not take_kept(other, "d")
    assert not other.exists()
    assert not kept.exists()
    keep(fmu_of(tmp_path / "one"), "d")
    assert take_kept(other, "d")


def test_a_damaged_one_does_not_hide_a_sound_one(cache: Path, tmp_path: Path) -> None:
    keep(fmu_of(tmp_path / "one"), "d")
    for name in ("0" * 64, "f" * 64):
        (cache / f"d-{name}.fmu").write_bytes(b"torn")
    assert take_kept(tmp_path / "Other.fmu", "d")


def test_only_the_newest_are_kept(cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(exported, "KEPT", 2)
    for number, name in enumerate("ab"):
        keep(fmu_of(tmp_path / "one"), name)
        (kept,) = cache.glob(f"{name}-*")
        os.utime(kept, (number, number))
    assert take_kept(tmp_path / "Other.fmu", "a")  # used again: the other one is now the oldest
    keep(fmu_of(tmp_path / "one"), "c")
    assert sorted(path.name[0] for path in cache.iterdir()) == ["a", "c"]


def test_nothing_is_kept_where_further_libraries_are_searched(
    cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    keep(fmu_of(tmp_path / "one"), "d")
    monkeypatch.setenv("MODELICAPATH", str(tmp_path))
    assert not take_kept(tmp_path / "Other.fmu", "d")
    keep(fmu_of(tmp_path / "one"), "e")
    assert [path.name[0] for path in cache.iterdir()] == ["d"]


@pytest.mark.parametrize("place", ["", "file", "file/below", "dangling"])
def test_a_cache_that_cannot_be_written_is_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: str
) -> None:
    (tmp_path / "file").write_text("")
    (tmp_path / "dangling").symlink_to(tmp_path / "nowhere" / "at" / "all")
    monkeypatch.setenv("THSA_COSIM_CACHE", str(tmp_path / place) if place else "")
    fmu = fmu_of(tmp_path / "one")
    keep(fmu, "d")
    assert not take_kept(tmp_path / "Other.fmu", "d")
    assert fmu.read_bytes() == b"an FMU"


def test_a_full_disk_leaves_nothing_in_the_cache(
    cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def torn(_: Path, target: Path) -> None:
        target.write_bytes(b"an")
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("thsa_cosim.export.cache.shutil.copyfile", torn)
    keep(fmu_of(tmp_path / "one"), "d")
    assert list(cache.iterdir()) == []
    assert not take_kept(tmp_path / "Other.fmu", "d")


def test_a_cache_that_can_only_be_read_is_used(
    cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    keep(fmu_of(tmp_path / "one"), "d")

    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(errno.EROFS, "Read-only file system")

    monkeypatch.setattr(Path, "touch", refuse)
    monkeypatch.setattr(Path, "unlink", refuse)
    assert take_kept(tmp_path / "Other.fmu", "d")
    (kept,) = cache.iterdir()
    kept.write_bytes(b"torn")
    assert not take_kept(tmp_path / "Another.fmu", "d")


def test_a_study_that_cannot_be_written_says_so(cache: Path, tmp_path: Path) -> None:
    keep(fmu_of(tmp_path / "one"), "d")
    with pytest.raises(FileNotFoundError):
        take_kept(tmp_path / "no such folder" / "Other.fmu", "d")


def test_several_studies_keep_and_take_at_once(cache: Path, tmp_path: Path) -> None:
    code = (
        "import sys; from pathlib import Path; from thsa_cosim.study import exported\n"
        "exported.KEPT = 3\n"
        "own = Path(sys.argv[1]); fmu = own / 'Model.fmu'; content = bytes(200_000) + own.name.encode()\n"
        "for turn in range(20):\n"
        "    fmu.write_bytes(content); exported.keep(fmu, f'd{turn % 4}')\n"
        "    if exported.take_kept(fmu, f'd{turn % 4}'): assert len(fmu.read_bytes()) == len(content)\n"
    )
    folders = [tmp_path / f"study{k}" for k in range(2)]
    for folder in folders:
        folder.mkdir()
    studies = [
        subprocess.Popen([sys.executable, "-c", code, str(f)], stderr=subprocess.PIPE) for f in folders
    ]
    assert [(study.communicate()[1], study.returncode) for study in studies] == [(b"", 0)] * 2
    for kept in cache.iterdir():
        assert kept.stem.split("-")[1] == hashlib.sha256(kept.read_bytes()).hexdigest()
