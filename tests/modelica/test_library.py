"""Where classes are found: libraries as folders, versions, files, encodings; and what does not disturb."""

from pathlib import Path

import pytest

from thsa_cosim.cli import run_command
from thsa_cosim.errors import ModelicaError
from thsa_cosim.export.flatten import flatten, list_models

DECAY = "der(x) = -k*x;"


def model(name: str, k: float, before: str = "", within: str = "", comment: str = "") -> str:
    return f"""{within}{before}model {name} "{comment}"
      parameter Real k = {k};
      Real x(start = 1, fixed = true);
    equation
      {DECAY}
    end {name};
    """


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder of libraries: two versions of Lib, one in a single file, and what nobody can read."""
    for version, k in (("4.1.0", 41), ("4.10.0", 410)):
        lib = tmp_path / f"Lib {version}"
        (lib / "Sub").mkdir(parents=True)
        inside = model("Inside", k + 1)
        (lib / "package.mo").write_text(
            f"package Lib\n{inside}\npartial model Half Real h; end Half;\nend Lib;\n"
        )
        (lib / "Top.mo").write_text(model("Top", k, within="within Lib;\n"))
        (lib / "Sub" / "package.mo").write_text("within Lib;\npackage Sub\nend Sub;\n")
        (lib / "Sub" / "Deep.mo").write_text(
            "within Lib.Sub;\nmodel Deep\n  extends Lib.Inside;\nend Deep;\n"
        )
        (lib / "Sub" / "Broken.mo").write_bytes(b"within Lib.Sub;\nmodel Broken\n  Real \xff\xfe = ;;; }\n")
    (tmp_path / "One.mo").write_text(
        f"package One\n{model('A', 1)}\npackage P\n{model('B', 2)}\nend P;\nend One;\n"
    )
    (tmp_path / "Unrelated.mo").write_text("model Lib this is no Modelica")
    return tmp_path


def value(name: str, *libraries: Path) -> float:
    return flatten(name, Path("none"), libraries).variables["k"].binding


@pytest.mark.parametrize(
    ("name", "k"),
    [("Lib.Top", 410), ("Lib.Inside", 411), ("Lib.Sub.Deep", 411), ("One.A", 1), ("One.P.B", 2)],
)
def test_any_class_of_a_folder_of_libraries_by_its_name(folder: Path, name: str, k: float) -> None:
    assert value(name, folder) == k


def test_a_library_is_a_packages_folder_or_a_file_too(folder: Path) -> None:
    assert value("Lib.Top", folder / "Lib 4.1.0") == 41
    assert value("Lib.Sub.Deep", folder / "Lib 4.1.0", folder) == 42
    assert value("One.P.B", folder / "One.mo") == 2


def test_the_environment_is_searched_last(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MODELICAPATH", str(folder))
    assert value("Lib.Top") == 410
    assert value("Lib.Top", folder / "Lib 4.1.0") == 41


def test_a_broken_neighbour_matters_only_when_it_is_used(folder: Path) -> None:
    with pytest.raises(ModelicaError, match=r"Broken\.mo:3"):
        value("Lib.Sub.Broken", folder)
    own = folder / "Mine.mo"
    own.write_text("model Mine\n  Lib.Sub.Deep d;\nend Mine;\n")
    assert flatten(str(own), Path("none")).variables["d.k"].binding == 411


def test_a_file_in_latin_1_is_read(tmp_path: Path) -> None:
    file = tmp_path / "Feder.mo"
    file.write_bytes(model("Feder", 3, comment="Dämpfung, Größe µ").encode("latin-1"))
    flat = flatten(str(file), Path("none"))
    assert flat.description == "Dämpfung, Größe µ"
    assert flat.variables["k"].binding == 3


def test_a_file_of_a_package_finds_the_rest_of_it(folder: Path) -> None:
    flat = flatten(str(folder / "Lib 4.1.0" / "Sub" / "Deep.mo"), Path("none"))
    assert (flat.name, flat.variables["k"].binding) == ("Lib.Sub.Deep", 42)


def test_a_misspelt_class_and_a_missing_library_are_named(folder: Path) -> None:
    with pytest.raises(ModelicaError, match=r"Lib holds no class 'Topp'. Did you mean 'Top'"):
        value("Lib.Topp", folder / "Lib 4.1.0")
    with pytest.raises(ModelicaError, match="Add the folder of its library with --library"):
        value("Other.Models.Motor", folder / "Lib 4.1.0")
    with pytest.raises(ModelicaError, match="no such library"):
        value("Lib.Top", folder / "nowhere")


def test_models_are_listed_without_partial_ones(folder: Path) -> None:
    assert list_models(folder / "One.mo") == ["One.A", "One.P.B"]
    with pytest.warns(UserWarning, match=r"Broken\.mo:3"):
        assert list_models(folder / "Lib 4.1.0") == ["Lib.Inside", "Lib.Sub.Deep", "Lib.Top"]


def test_list_on_the_command_line_notes_what_cannot_be_read(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_command(["export", "--list", "--library", str(folder)]) == 0
    said = capsys.readouterr()
    assert said.out.split() == ["Lib.Inside", "Lib.Sub.Deep", "Lib.Top", "One.A", "One.P.B"]
    assert [line.split(":")[0] for line in said.err.splitlines()] == ["note", "note"]
    assert "Broken.mo:3" in said.err
    assert "Unrelated.mo:1" in said.err
