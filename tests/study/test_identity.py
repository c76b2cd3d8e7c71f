"""What makes two runs the same study: every key of every kind counts, and files count by their content."""

import shutil
import zipfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

import pytest
from small_scenario import toml, valid, write_folder

from thsa_cosim.scenario import KINDS, Table, load_scenario
from thsa_cosim.scenario import load as load_any
from thsa_cosim.scenario.schema import StagesTable
from thsa_cosim.scenario.tune_schema import TuneTable
from thsa_cosim.ssv import ParameterSet, write_ssv
from thsa_cosim.study import stages_identity, study_identity
from thsa_cosim.study.folder import changed
from thsa_cosim.study.identity import BY_CONTENT, SHOWN_ONLY, flatten

ALL_KINDS: dict[str, type[Table]] = {**KINDS, "tune": TuneTable, "stages": StagesTable}
#: Keys of a kind that are read off a scenario's table: fewer would mean that the walk below has lost some.
AT_LEAST = {"identify": 66, "simulate": 38, "diagnose": 85, "tune": 82, "stages": 1}


def tables_in(annotation: Any) -> tuple[type[Table] | None, type | None]:
    """The table class inside of an annotation, and what holds several of them: list, dict or None."""
    origin = get_origin(annotation)
    if isinstance(annotation, type) and issubclass(annotation, Table):
        return annotation, None
    for member in get_args(annotation):
        found, holder = tables_in(member)
        if found is not None:
            return found, origin if origin in (list, dict) else holder
    assert origin in (None, list, dict, Union, UnionType, Annotated) or get_args(annotation)
    return None, None


def filled(cls: type[Table], values: Mapping[str, Any]) -> Table:
    """A table with every key given, unchecked: ``values`` by schema path, else a text that names the key."""

    def build(cls: type[Table], path: tuple[str, ...]) -> Table:
        content: dict[str, Any] = {}
        for name, field in cls.model_fields.items():
            own = (*path, field.alias or name)
            table, holder = tables_in(field.annotation)
            if table is None:
                content[name] = values.get(".".join(own), f"value of {name}")
            else:
                member = build(table, own)
                content[name] = {list: [member], dict: {"chosen": member}}.get(holder, member)
        return cls.model_construct(**content)

    return build(cls, ())


def keys_of(cls: type[Table], path: tuple[str, ...] = ()) -> Iterator[str]:
    """Schema paths of all keys below a table."""
    for name, field in cls.model_fields.items():
        own = (*path, field.alias or name)
        table, _ = tables_in(field.annotation)
        yield from keys_of(table, own) if table is not None else [".".join(own)]


@pytest.mark.parametrize("kind", ALL_KINDS)
def test_every_key_of_every_kind_counts(kind: str) -> None:
    cls = ALL_KINDS[kind]
    before, counted = flatten(filled(cls, {})), []
    for key in keys_of(cls):
        after = flatten(filled(cls, {key: "another value"}))
        if key in SHOWN_ONLY or key in BY_CONTENT:
            assert after == before, key
            continue
        keys = changed(before, after)
        assert keys, f"{key} may be changed without notice"
        last = key.rsplit(".", 1)[-1]
        assert any(last in k.rsplit("[", 1)[-1] or k.endswith(" (order)") for k in keys), (key, keys)
        counted.append(key)
    assert len(counted) == len(set(counted)) >= AT_LEAST[kind], f"{kind}: {len(counted)} keys"


def test_what_is_left_out_is_in_the_schema_still() -> None:
    known = {key for cls in ALL_KINDS.values() for key in keys_of(cls)}
    assert {*SHOWN_ONLY, *BY_CONTENT} <= known


def test_a_table_that_means_something_by_being_there_counts(folder: Path) -> None:
    data = valid()
    before = flatten(load(folder, data).table)
    data["parameters"][1]["law"] = {}
    assert changed(before, flatten(load(folder, data).table)) == ["parameters[J].law"]


def test_the_order_of_parameters_and_recordings_counts(folder: Path) -> None:
    data = valid()
    before = study_identity(load(folder, data))
    data["parameters"].reverse()
    data["recordings"]["fit"].reverse()
    assert changed(before, study_identity(load(folder, data))) == [
        "parameters (order)",
        "recordings.fit (order)",
    ]


# -- what files hold ----------------------------------------------------------------------------------
@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_folder(tmp_path)
    (tmp_path / "package").mkdir()
    (tmp_path / "package" / "Effect.mo").write_text("block Effect end Effect;")
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "drag.py").write_text("EFFECT = None")
    start = ParameterSet("start", {"motor.gain": 2.0}, {}, "test")
    write_ssv(tmp_path / "start.ssv", start)
    return tmp_path


def load(folder: Path, data: dict[str, Any]) -> Any:
    file = folder / "small.toml"
    file.write_text(toml(data))
    return load_any(file)


def diagnosis() -> dict[str, Any]:
    model = {"model": "Small", "package": "package", "catalogue": "own"}
    return {**valid(), "kind": "diagnose", "parameter_set": "start.ssv", "diagnose": model}


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


EDITS: dict[str, Callable[[Path], None]] = {
    "recordings.fit[cold_2]": lambda f: edit(f / "runs" / "cold_2.csv", "0.2", "0.3"),
    "recordings.validate[check]": lambda f: edit(f / "runs" / "check.csv", "0.2", "0.3"),
    "start values.motor.gain": lambda f: write_ssv(
        f / "start.ssv", ParameterSet("start", {"motor.gain": 3.0}, {}, "test")
    ),
    "diagnose.package": lambda f: edit(f / "package" / "Effect.mo", "block", "model"),
    "diagnose.catalogue": lambda f: edit(f / "own" / "drag.py", "None", "1"),
}


@pytest.mark.parametrize("key", EDITS)
def test_an_edited_file_is_another_study(folder: Path, key: str) -> None:
    before = study_identity(load(folder, diagnosis()))
    EDITS[key](folder)
    assert changed(before, study_identity(load(folder, diagnosis()))) == [key]


def test_another_fmu_is_another_study(folder: Path) -> None:
    before = study_identity(load(folder, valid()))
    with zipfile.ZipFile(folder / "Small.fmu", "a") as archive:
        archive.writestr("resources/table.txt", "1 2 3")
    assert changed(before, study_identity(load(folder, valid()))) == ["fmu"]


def test_where_the_files_lie_does_not_count(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    before = study_identity(load(folder, diagnosis()))
    elsewhere = tmp_path_factory.mktemp("elsewhere") / "moved"
    shutil.copytree(folder, elsewhere)
    assert study_identity(load(elsewhere, diagnosis())) == before


def test_the_command_counts_and_seed_options_do(folder: Path) -> None:
    scenario = load(folder, valid())
    assert changed(study_identity(scenario), study_identity(scenario, "simulate")) == ["kind"]
    seeded = load_scenario(folder / "small.toml", seed=11)
    assert changed(study_identity(scenario), study_identity(seeded)) == ["seed"]


def test_stages_count_with_all_that_they_ask(folder: Path) -> None:
    (folder / "one.toml").write_text(toml(valid()))
    stages = folder / "stages.toml"
    stages.write_text(toml({"kind": "identify", "stages": [{"scenario": "one.toml"}]}))
    before = stages_identity(load_any(stages))  # type: ignore[arg-type]
    data = valid()
    data["parameters"][0]["upper"] = 6.0
    (folder / "one.toml").write_text(toml(data))
    after = stages_identity(load_any(stages))  # type: ignore[arg-type]
    assert changed(before, after) == ["stages[one].parameters[R_s].upper"]
    stages.write_text(toml({"kind": "identify", "stages": [{"scenario": "one.toml", "give": ["J"]}]}))
    again = stages_identity(load_any(stages))  # type: ignore[arg-type]
    assert changed(after, again) == ["stages[one].give"]
