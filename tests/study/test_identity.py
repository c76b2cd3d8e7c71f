"""What makes two runs the same study: every key of every kind counts, and files count by their content."""

import hashlib
import json
import re
import shutil
import zipfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import SimpleNamespace, UnionType
from typing import Annotated, Any, Union, get_args, get_origin

import numpy as np
import pytest
from small_scenario import toml, valid, write_folder

from thsa_cosim import __version__
from thsa_cosim.scenario import KINDS, Table, load
from thsa_cosim.scenario.schema import StagesTable
from thsa_cosim.scenario.tune_schema import TuneTable
from thsa_cosim.ssv import ParameterSet, write_ssv
from thsa_cosim.study import digest_of_recording, identity, shown_words, stages_identity, study_identity
from thsa_cosim.study.digest import digest_of_file, digest_of_folder
from thsa_cosim.study.folder import changed
from thsa_cosim.study.identity import BY_CONTENT, SHOWN_ONLY, _plain, flatten

ALL_KINDS: dict[str, type[Table]] = {**KINDS, "tune": TuneTable, "stages": StagesTable}
#: Keys of a kind that are read off a scenario's table: fewer would mean that the walk below has lost some.
AT_LEAST = {"identify": 95, "simulate": 68, "diagnose": 119, "tune": 135, "stages": 1}


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


@pytest.mark.parametrize("kind", sorted(set(ALL_KINDS) - {"stages"}))
def test_what_is_shown_only_is_kept_apart_and_all_of_it(kind: str) -> None:
    cls = ALL_KINDS[kind]
    scenario = SimpleNamespace(table=filled(cls, {}))
    words = shown_words(scenario)  # type: ignore[arg-type]
    assert {re.sub(r"\[.*?\]", "", key) for key in words} == {k for k in keys_of(cls) if k in SHOWN_ONLY}
    for key in SHOWN_ONLY:
        if key in keys_of(cls):
            assert shown_words(SimpleNamespace(table=filled(cls, {key: "other"}))) != words  # type: ignore[arg-type]


def test_what_is_left_out_is_in_the_schema_still() -> None:
    known = {key for cls in ALL_KINDS.values() for key in keys_of(cls)}
    assert {*SHOWN_ONLY, *BY_CONTENT} <= known


def test_a_table_that_means_something_by_being_there_counts(folder: Path) -> None:
    data = valid()
    before = flatten(loaded(folder, data).table)
    data["parameters"][1]["law"] = {}
    assert changed(before, flatten(loaded(folder, data).table)) == ["parameters[J].law"]


def test_the_order_of_parameters_and_recordings_counts(folder: Path) -> None:
    data = valid()
    before = study_identity(loaded(folder, data))
    data["parameters"].reverse()
    data["recordings"]["fit"].reverse()
    assert changed(before, study_identity(loaded(folder, data))) == [
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


def loaded(folder: Path, data: dict[str, Any]) -> Any:
    file = folder / "small.toml"
    file.write_text(toml(data))
    return load(file)


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
    before = study_identity(loaded(folder, diagnosis()))
    EDITS[key](folder)
    assert changed(before, study_identity(loaded(folder, diagnosis()))) == [key]


def test_an_edited_class_beside_the_scenario_is_another_study(folder: Path) -> None:
    (folder / "Mine.mo").write_text("model Mine end Mine;")
    data = diagnosis()
    data["diagnose"]["model"] = "Mine.mo"
    before = study_identity(loaded(folder, data))
    edit(folder / "Mine.mo", "model Mine", "model Mine Real x = 1;")
    assert changed(before, study_identity(loaded(folder, data))) == ["diagnose.model"]


def test_another_fmu_is_another_study(folder: Path) -> None:
    before = study_identity(loaded(folder, valid()))
    with zipfile.ZipFile(folder / "Small.fmu", "a") as archive:
        archive.writestr("resources/table.txt", "1 2 3")
    assert changed(before, study_identity(loaded(folder, valid()))) == ["fmu"]


def test_where_the_files_lie_does_not_count(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    before = study_identity(loaded(folder, diagnosis()))
    elsewhere = tmp_path_factory.mktemp("elsewhere") / "moved"
    shutil.copytree(folder, elsewhere)
    assert study_identity(loaded(elsewhere, diagnosis())) == before


def test_the_command_counts_and_seed_options_do(folder: Path) -> None:
    scenario = loaded(folder, valid())
    assert changed(study_identity(scenario), study_identity(scenario, "simulate")) == ["kind"]
    seeded = load(folder / "small.toml", seed=11)
    assert changed(study_identity(scenario), study_identity(seeded)) == ["seed"]


def test_stages_count_with_all_that_they_ask(folder: Path) -> None:
    (folder / "one.toml").write_text(toml(valid()))
    stages = folder / "stages.toml"
    stages.write_text(toml({"kind": "identify", "stages": [{"scenario": "one.toml"}]}))
    before = stages_identity(load(stages))  # type: ignore[arg-type]
    data = valid()
    data["parameters"][0]["upper"] = 6.0
    (folder / "one.toml").write_text(toml(data))
    after = stages_identity(load(stages))  # type: ignore[arg-type]
    assert changed(before, after) == ["stages[one].parameters[R_s].upper"]
    words = shown_words(load(stages))
    assert words["stages[one].title"] == data["title"]
    stages.write_text(toml({"kind": "identify", "stages": [{"scenario": "one.toml", "give": ["J"]}]}))
    again = stages_identity(load(stages))  # type: ignore[arg-type]
    assert changed(after, again) == ["stages[one].give"]


# -- the identity itself, key by key ---------------------------------------------------------------------
def tuning() -> dict[str, Any]:
    gain = {"unit": "A.s/rad", "lower": 0.01, "upper": 1.0}
    return {
        "kind": "tune",
        "fmu": "Small.fmu",
        "command": {
            "input": "w_cmd",
            "output": "w_m",
            "unit": "rad/s",
            "shape": "step",
            "final": 9.0,
            "stop": 1.0,
        },
        "conditions": {"T_amb": {"values": [-30.0, 20.0], "unit": "degC"}},
        "parameters": [{"name": "K_p", "variable": "velocityController.K_p", **gain}],
        "before": {"K_p": 0.12},
        "metrics": {"window": [0.8, 1.0]},
        "cost": {"unit": "rad/s", "kappa_rise": 1.0, "kappa_steady": 1.0},
        "parameter_set": "start.ssv",
        "uncertainty": {
            "result": "result.json",
            "samples": 2,
            "temperature": "T_amb",
            "variables": {"J": "motor.J"},
        },
    }


@pytest.fixture
def identified(folder: Path) -> Path:
    """The result of an identification, as far as a tuning reads it."""
    point = {
        "temperature_degC": 20.0,
        "parameters": {"J": {"value": 2e-3, "stderr": 1e-4, "unit": "kg.m2"}},
        "correlation": [[1.0]],
    }
    (folder / "result.json").write_text(json.dumps({"points": [point]}))
    return folder / "result.json"


def test_a_tuning_counts_its_start_values_and_how_sure_they_are(folder: Path, identified: Path) -> None:
    before = study_identity(loaded(folder, tuning()))
    assert before["kind"] == "tune"
    assert before["start values.motor.gain"] == 2.0
    assert before["before.K_p"] == 0.12
    assert before["conditions.T_amb.values"] == [-30.0, 20.0]
    assert len(before["uncertainty.result"]) == 64
    assert study_identity(loaded(folder, tuning())) == before
    edit(identified, "0.0001", "0.0002")
    assert changed(before, study_identity(loaded(folder, tuning()))) == ["uncertainty.result"]
    edit(identified, "0.0002", "0.0001")
    EDITS["start values.motor.gain"](folder)
    assert changed(before, study_identity(loaded(folder, tuning()))) == ["start values.motor.gain"]
    sure = study_identity(loaded(folder, {k: v for k, v in tuning().items() if k != "uncertainty"}))
    assert not [key for key in sure if key.startswith("uncertainty")]


def test_a_tuning_counts_what_is_in_its_profiles_and_not_where_they_are(folder: Path) -> None:
    data = {
        **{k: v for k, v in tuning().items() if k not in ("uncertainty",)},
        "command": {"input": "w_cmd", "output": "w_m", "unit": "rad/s", "shape": "recorded"},
        "profile": {
            "recordings": ["runs/warm.csv"],
            "time": {"column": "time", "unit": "s"},
            "columns": {"w_cmd": {"column": "command", "unit": "rad/s"}},
        },
        "metrics": {"window": [0.3, 0.4]},
    }
    before = study_identity(loaded(folder, data))
    (folder / "runs" / "warm.csv").rename(folder / "warm.csv")
    data["profile"]["recordings"] = ["warm.csv"]
    assert study_identity(loaded(folder, data)) == before
    edit(folder / "warm.csv", ",10,", ",9,")
    assert changed(before, study_identity(loaded(folder, data))) == ["profile.recordings[warm]"]


def test_a_file_is_known_by_its_content(tmp_path: Path) -> None:
    file = tmp_path / "curve.txt"
    file.write_bytes(b"abc")
    # FIPS 180-2, appendix B.1
    assert digest_of_file(file) == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"


def test_a_scenario_is_asked_key_by_key(folder: Path) -> None:
    scenario = loaded(folder, valid())
    asked = study_identity(scenario)
    expected = {
        "kind": "identify",
        "seed": 3,
        "fmu": scenario.fmu.sha256,
        "temperature.input": "T_amb",
        "temperature.round_to": 1.0,
        "fixed.velocityController.K_p": 0.12,
        "start values.velocityController.K_p": 0.12,
        "parameters (order)": ["R_s", "J"],
        "parameters[R_s].lower": 0.05,
        "parameters[R_s].law.form": "linear",
        "parameters[R_s].law.published": [1.2, 0.03],
        "parameters[J].scale": "log",
        "cost.channels (order)": ["i_q", "w_m"],
        "cost.channels.i_q.weight": 2.0,
        "cost.channels.w_m.noise": 0.2,
        "cost.mask": [[0.1, 0.12]],
        "recordings.columns.T_amb.unit": "degC",
        "recordings.fit (order)": [r.name for r in scenario.fit],
        "recordings.validate (order)": ["check"],
        "recordings.validate[check]": digest_of_recording(scenario.validate[0]),
        "versions.thsa-cosim": __version__,
        "versions.numpy": version("numpy"),
        "versions.scipy": version("scipy"),
        "versions.fmpy": version("fmpy"),
    }
    assert {key: asked.get(key) for key in expected} == expected
    assert not [key for key in asked if "title" in key or "description" in key or "diagnose" in key]
    json.dumps(asked, allow_nan=False)


def test_only_a_diagnosis_counts_the_model_and_the_effects(folder: Path) -> None:
    scenario = loaded(folder, diagnosis())
    content = {key for key in study_identity(scenario) if key in ("diagnose.package", "diagnose.catalogue")}
    assert content == {"diagnose.package", "diagnose.catalogue"}
    other = study_identity(scenario, "identify")
    assert (other["kind"], "diagnose.package" in other, "diagnose.catalogue" in other) == (
        "identify",
        False,
        False,
    )
    assert other["diagnose.model"] == "Small"


def test_a_start_value_of_one_temperature_counts_by_its_name(folder: Path) -> None:
    scenario = loaded(folder, valid())
    cold = scenario.points[0]
    asked = study_identity(scenario.given({cold.temperature_degC: {"motor.gain": 4.0}}))
    assert changed(study_identity(scenario), asked) == [f"start values[{cold.label}].motor.gain"]
    assert asked[f"start values[{cold.label}].motor.gain"] == 4.0


def test_the_lead_in_counts(folder: Path) -> None:
    recording = loaded(folder, valid()).fit[0]
    digests = {digest_of_recording(replace(recording, lead_in=t)) for t in (0.0, 0.1, 0.2)}
    assert len(digests) == 3


def test_the_start_values_of_a_recording_count(folder: Path) -> None:
    recording = loaded(folder, valid()).fit[0]
    starts: list[dict[str, float]] = [{}, {"motor.gain": 2.0}, {"motor.gain": 3.0}, {"motor.J": 2.0}]
    assert len({digest_of_recording(replace(recording, start=start)) for start in starts}) == 4


def test_stages_are_asked_in_their_order_and_with_one_version(folder: Path) -> None:
    for name in ("one", "two"):
        (folder / f"{name}.toml").write_text(toml(valid()))
    stages = folder / "stages.toml"

    def asked(*names: str) -> dict[str, Any]:
        stages.write_text(toml({"kind": "identify", "stages": [{"scenario": f"{n}.toml"} for n in names]}))
        return stages_identity(load(stages))  # type: ignore[arg-type]

    before = asked("one", "two")
    assert before["kind"] == "identify in stages"
    assert before["stages (order)"] == ["one", "two"]
    assert before["stages[one].seed"] == before["stages[two].seed"]
    assert [key for key in before if "versions." in key and not key.startswith("versions.")] == []
    assert before["versions.thsa-cosim"] == __version__
    assert changed(before, asked("two", "one")) == ["stages (order)"]


def test_a_package_that_is_not_installed_leaves_the_others_counting(monkeypatch: pytest.MonkeyPatch) -> None:
    def installed(name: str) -> str:
        if name == "fmpy":
            raise PackageNotFoundError(name)
        return f"{name} 1"

    monkeypatch.setattr(identity, "version", installed)
    assert identity._versions() == {
        "versions.thsa-cosim": __version__,
        "versions.numpy": "numpy 1",
        "versions.scipy": "scipy 1",
    }


def test_members_without_a_name_are_counted_from_one() -> None:
    class Edge(Table):
        at: float

    class Path_(Table):
        edges: list[Edge]

    asked = flatten(Path_(edges=[Edge(at=1.0), Edge(at=2.0)]))
    assert asked == {"edges[1].at": 1.0, "edges[2].at": 2.0, "edges (order)": ["1", "2"]}
    assert flatten(Path_(edges=[Edge(at=1.0)])) == {"edges[1].at": 1.0}


def test_what_tables_are_made_of_becomes_plain() -> None:
    @dataclass
    class Pair:
        first: Any
        second: Any

    found = _plain(Pair(np.array([1.0, 2.0]), {1: (Path("a") / "b", None)}))
    assert found == {"first": [1.0, 2.0], "second": {"1": [str(Path("a") / "b"), None]}}
    assert _plain([Pair, "text"]) == [Pair, "text"]


def test_names_contents_and_borders_of_files_count_and_line_ends_do_not(tmp_path: Path) -> None:
    def of(**files: bytes) -> str:
        folder = tmp_path / f"{len(list(tmp_path.iterdir()))}"
        for name, content in files.items():
            path = folder / name.replace("__", "/").replace("_", ".")
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        return digest_of_folder(folder, ["*.mo", "package.order"])

    assert of(a_mo=b"x\r\ny", sub__b_mo=b"z") == of(sub__b_mo=b"z", a_mo=b"x\ny")
    assert of(a_mo=b"x\ny") != of(a_mo=b"xy") != of(a_mo=b"x\n\ny")
    different = [
        of(),
        of(a_mo=b"x"),
        of(b_mo=b"x"),
        of(sub__a_mo=b"x"),
        of(a_mo=b"x", b_mo=b""),
        of(a_mo=b"xb.mo"),
    ]
    assert len(set(different)) == len(different)
    assert of(a_mo=b"x", other_txt=b"no") == of(a_mo=b"x")
    assert digest_of_folder(tmp_path / "not there", ["*"]) == of()


def test_the_digest_of_a_folder_is_the_same_on_every_machine(tmp_path: Path) -> None:
    """In the order of the names with "/", whatever a platform sorts paths by: "a.mo" before "a/b.mo"."""
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "b.mo").write_bytes(b"1")
    (tmp_path / "a.mo").write_bytes(b"22")
    content = b"a.mo\x002\x0022" + b"a/b.mo\x001\x001"
    assert digest_of_folder(tmp_path, ["*.mo"]) == hashlib.sha256(content).hexdigest()
