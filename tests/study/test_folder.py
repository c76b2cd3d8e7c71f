"""The study folder: continued for the same study, and never mixed with another."""

import json
from pathlib import Path
from typing import Any

import pytest

from thsa_cosim.errors import InputError
from thsa_cosim.study import MARKER, claim_folder

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
    assert str(caught.value).endswith(": choose another folder with -o, or change it back.")
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
