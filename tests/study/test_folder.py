"""The study folder: continued for the same study, and never mixed with another."""

import datetime
import json
import platform
from importlib.metadata import PackageNotFoundError
from pathlib import Path
from typing import Any

import pytest
from small_scenario import toml, valid, write_folder

from thsa_cosim import __version__
from thsa_cosim.errors import InputError
from thsa_cosim.scenario import load
from thsa_cosim.study import MARKER, claim_folder, describe
from thsa_cosim.study import folder as study_folder
from thsa_cosim.study.folder import changed

ASKED = {"kind": "identify", "cost.error": "squared", "fmu": "a" * 64, "seed": 1}


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("seed", 2, "with seed = 1; this one has seed = 2"),
        ("cost.error", "huber", 'with cost.error = "squared"; this one has cost.error = "huber"'),
        ("cost.error", None, 'with cost.error = "squared"; this one has cost.error not given'),
        ("fmu", "b" * 64, "with fmu sha256 aaaaaaaaaaaa; this one has fmu sha256 bbbbbbbbbbbb"),
        ("kind", "tune", 'with kind = "identify"; this one has kind = "tune"'),
        ("force.band", 20.0, "with force.band not given; this one has force.band = 20.0"),
    ],
)
def test_one_sentence_names_the_key_and_both_values(tmp_path: Path, key: str, value: Any, words: str) -> None:
    assert claim_folder(tmp_path / "study", ASKED) is False
    assert claim_folder(tmp_path / "study", ASKED) is True
    with pytest.raises(InputError) as caught:
        claim_folder(tmp_path / "study", {**ASKED, key: value})
    assert words in str(caught.value)
    assert str(caught.value) == (
        f"{tmp_path / 'study'} holds a study {words}: choose another folder with -o, or change it back."
    )
    assert claim_folder(tmp_path / "study", ASKED) is True


def test_several_changes_name_what_was_asked_before_what_follows_from_it(tmp_path: Path) -> None:
    claim_folder(tmp_path / "study", {**ASKED, "start values.a": 1.0, "parameters (order)": ["a", "b"]})
    with pytest.raises(InputError, match=r"with seed = 1; this one has seed = 2 \(and 2 more\)"):
        claim_folder(tmp_path / "study", {**ASKED, "seed": 2})


def test_the_title_is_shown_as_it_now_is(tmp_path: Path) -> None:
    claim_folder(tmp_path / "study", ASKED, {"title": "old", "command": "a"})
    claim_folder(tmp_path / "study", ASKED, {"title": "new"})
    about = json.loads((tmp_path / "study" / MARKER).read_text())["about"]
    assert (about["title"], about["command"]) == ("new", "a")
    assert "started" in about


def test_a_folder_of_an_older_version_is_refused(tmp_path: Path) -> None:
    (tmp_path / MARKER).write_text('{"kind": "identify", "scenario": "0", "about": {}}')
    with pytest.raises(InputError, match="of an older version"):
        claim_folder(tmp_path, ASKED)


def test_a_folder_that_is_no_study_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(InputError, match="exists and is no study folder"):
        claim_folder(tmp_path, ASKED)
    assert [p.name for p in tmp_path.iterdir()] == ["thesis.tex"]
    with pytest.raises(InputError, match="is no study folder"):
        claim_folder(tmp_path / "thesis.tex", ASKED)
    with pytest.raises(InputError, match="cannot be used"):
        claim_folder(tmp_path / "thesis.tex" / "below", ASKED)


@pytest.mark.parametrize("content", ["", "[1]", "{"])
def test_a_damaged_marker_is_named(tmp_path: Path, content: str) -> None:
    (tmp_path / MARKER).write_text(content)
    with pytest.raises(InputError, match=r"study\.json is damaged"):
        claim_folder(tmp_path, ASKED)


def test_what_was_asked_is_named_before_what_follows_from_it() -> None:
    before = {"start values.a": 1, "parameters (order)": [1], "seed": 1, "fmu": 1, "kind": 1, "same": 1}
    after = dict.fromkeys(before, 2) | {"same": 1, "new": 2}
    assert changed(before, after) == ["kind", "seed", "fmu", "new", "start values.a", "parameters (order)"]
    assert changed(before, before) == []
    assert changed(before, {k: v for k, v in before.items() if k != "fmu"}) == ["fmu"]


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ("α" * 58, '= "' + "α" * 58 + '"'),
        ("α" * 59, '= "' + "α" * 58 + "…"),
        ("f" * 63, '= "' + "f" * 58 + "…"),
        ("f" * 64, "sha256 ffffffffffff"),
        ("F" * 64, '= "' + "F" * 58 + "…"),
        (None, "not given"),
        ([1.5, {"a": None}], '= [1.5, {"a": null}]'),
    ],
)
def test_a_value_is_shown_short(value: Any, words: str) -> None:
    assert study_folder._shown(value) == words


def test_the_marker_says_what_was_asked_when_where_and_with_what(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "deep" / "study"
    begin = datetime.datetime.now(datetime.UTC)
    claim_folder(folder, ASKED, {"title": "α"})
    text = (folder / MARKER).read_text(encoding="utf-8")
    assert text.startswith('{\n  "kind": "identify",')
    marker = json.loads(text)
    assert set(marker) == {"kind", "asked", "about"}
    assert marker["asked"] == ASKED
    about = marker["about"]
    assert set(about) == {"title", "started", "directory", "system", "versions"}
    started = datetime.datetime.fromisoformat(about["started"])
    assert abs(started - begin) < datetime.timedelta(minutes=1)
    assert (about["directory"], about["system"]) == (str(tmp_path), platform.platform())
    assert about["versions"]["thsa-cosim"] == __version__
    assert about["versions"]["Python"] == platform.python_version()
    assert {"numpy", "scipy", "fmpy"} <= set(about["versions"])
    assert all(about["versions"].values())
    assert [p.name for p in folder.iterdir()] == [MARKER]


def test_a_package_that_is_not_installed_is_left_out_of_the_marker(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def installed(name: str) -> str:
        if name == "fmpy":
            raise PackageNotFoundError(name)
        return "1"

    monkeypatch.setattr(study_folder, "version", installed)
    claim_folder(tmp_path / "study", ASKED)
    versions = json.loads((tmp_path / "study" / MARKER).read_text())["about"]["versions"]
    assert set(versions) == {"thsa-cosim", "Python", "numba", "numpy", "pandas", "pint", "scipy"}


def test_a_marker_without_readers_words_is_continued(tmp_path: Path) -> None:
    (tmp_path / MARKER).write_text(json.dumps({"kind": "identify", "asked": ASKED, "about": "lost"}))
    assert claim_folder(tmp_path, ASKED, {"title": "new"}) is True
    assert json.loads((tmp_path / MARKER).read_text())["about"] == {"title": "new"}


def test_an_empty_folder_is_taken(tmp_path: Path) -> None:
    assert claim_folder(tmp_path, ASKED) is False
    assert (tmp_path / MARKER).exists()


def test_why_a_folder_cannot_be_used_is_said(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(InputError) as caught:
        claim_folder(tmp_path / "file" / "study", ASKED)
    assert str(caught.value) == (
        f"The study folder {tmp_path / 'file' / 'study'} cannot be used (Not a directory); choose another with -o."
    )


def test_an_error_without_words_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise PermissionError

    monkeypatch.setattr(Path, "mkdir", refuse)
    with pytest.raises(InputError, match=r"cannot be used \(PermissionError\)"):
        claim_folder(tmp_path / "study", ASKED)


def test_a_reader_learns_what_was_asked_and_with_which_search(tmp_path: Path) -> None:
    write_folder(tmp_path)
    file = tmp_path / "small.toml"
    file.write_text(toml(valid()))
    scenario = load(file)
    about = {
        "title": "small",
        "scenario": str(file),
        "fmu": str(tmp_path / "Small.fmu"),
        "method": "local-first",
        "population": 20,
        "generations": 5,
        "parameters": {"R_s": "ohm", "J": "g.m2"},
    }
    assert describe(scenario) == about  # type: ignore[arg-type]
    untitled = tmp_path / "untitled.toml"
    untitled.write_text(toml({k: v for k, v in valid().items() if k != "title"}))
    assert describe(load(untitled))["title"] == "untitled"  # type: ignore[arg-type]
