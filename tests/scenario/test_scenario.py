"""Scenarios: what a valid one becomes, and one sentence for everything that is wrong with another."""

import copy
import datetime
import shutil
import string
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from small_scenario import VALID, set_in, toml, valid, write_folder, write_recording

from thsa_cosim.errors import (
    InputError,
    ParameterError,
    RecordingError,
    ScenarioError,
    ThsaCosimError,
    UnitError,
)
from thsa_cosim.fmu import read_description
from thsa_cosim.scenario import KINDS, Scenario, load
from thsa_cosim.ssv import ParameterSet, write_ssv

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("scenario")
    write_folder(path)
    return path


def loaded(folder, data, **options):
    file = folder / "small.toml"
    file.write_text(toml(data))
    return load(file, Scenario, **options)


def sentence(folder, data, error=ThsaCosimError, **options):
    with pytest.raises(error) as caught:
        loaded(folder, data, **options)
    message = str(caught.value)
    assert str(folder) in message
    assert "\n" not in message
    return message


def test_a_temperature_that_starts_below_absolute_zero_needs_no_column() -> None:
    fmu = read_description(ROOT / "fmus" / "THSA.fmu")
    assert [v.name for v in fmu.inputs if v.may_stay_open] == ["T_motor", "T_gearbox", "T_screw"]
    kelvin = replace(fmu.variables["T_motor"], unit="K", start=-1.0)
    assert kelvin.may_stay_open
    assert not replace(kelvin, start=0.0).may_stay_open
    assert not replace(kelvin, causality="parameter").may_stay_open
    assert not replace(kelvin, unit="m", start=-300.0).may_stay_open


def test_a_valid_scenario_in_full(folder):
    scenario = loaded(folder, valid())
    assert (scenario.kind, scenario.title, scenario.seed) == ("identify", "small", 3)
    assert scenario.inputs == ("w_cmd", "T_amb")
    assert scenario.measured == scenario.outputs == ("w_m", "i_q")
    assert [r.name for r in scenario.fit] == ["cold_1", "cold_2", "warm"]
    assert [r.name for r in scenario.validate] == ["check"]
    assert scenario.fixed == {"velocityController.K_p": 0.12, "motor.R_s.a1": 0.0, "motor.R_s.a2": 0.0}
    assert scenario.parameters.names == ("R_s", "J")
    assert scenario.parameters["J"].variable_unit == "kg.m2"
    assert scenario.parameters["R_s"].description == "about motor.R_s.a0"
    assert scenario.parameters.assignments({"R_s": 1.0, "J": 2.0}) == {"motor.R_s.a0": 1.0, "motor.J": 2e-3}
    law = scenario.laws["R_s"]
    assert (law.form, law.published, law.compared_form) == ("linear", [1.2, 0.03], "linear")
    assert scenario.cost.channels["w_m"].noise == 0.2
    assert scenario.cost.channels["i_q"].weight == 2.0
    window = scenario.cost.window
    assert (window.start, window.stop, scenario.cost.mask) == (0.0, 0.4, [[0.1, 0.12]])
    assert (scenario.search.population, scenario.search.strategy) == (20, "best1bin")
    assert (scenario.search.mutation, scenario.search.crossover, scenario.search.generations) == (
        0.16,
        0.5,
        5,
    )
    assert scenario.simulation.deadline == 10.0


def test_recordings_are_grouped_by_rounded_temperature_coldest_first(folder):
    scenario = loaded(folder, valid())
    assert [p.temperature_degC for p in scenario.points] == [-30.0, 25.0]
    cold, warm = scenario.points
    assert ([r.name for r in cold.fit], [r.name for r in cold.validate]) == (["cold_1", "cold_2"], ["check"])
    assert ([r.name for r in warm.fit], warm.validate) == (["warm"], ())
    assert cold.label == "-30 degC"
    joint = loaded(folder, set_in(valid(), "temperature/group", "joint"))
    assert [(p.temperature_degC, len(p.fit)) for p in joint.points] == [(None, 3)]
    without = loaded(folder, set_in(valid(), "temperature", ...))
    assert [(p.temperature_degC, len(p.fit), len(p.validate)) for p in without.points] == [(None, 3, 1)]


def test_inputs_measured_values_and_noise(folder):
    scenario = loaded(folder, valid())
    run = scenario.fit[0]
    drive = scenario.drive(run)
    assert drive.names == ("w_cmd", "T_amb")
    assert drive.held == {"w_cmd"}
    assert np.ptp(drive["T_amb"]) == 0.0
    assert scenario.noise(run, "w_m") == 0.2
    assert scenario.noise(run, "i_q") == pytest.approx(0.05, rel=0.5)


def test_law_coefficients_can_be_parameters(folder):
    data = set_in(valid(), "temperature/group", "joint")
    more = {"name": "R_s1", "variable": "motor.R_s.a1", "unit": "Ohm/K", "lower": -1.0, "upper": 1.0}
    data["parameters"].append(more)
    scenario = loaded(folder, data)
    assert scenario.fixed == {"velocityController.K_p": 0.12, "motor.R_s.a2": 0.0}
    assert scenario.points[0].space.names == ("R_s", "J", "R_s1")


def test_parameters_per_recording(folder):
    scenario = loaded(folder, set_in(valid(), "parameters/1/per", "recording"))
    assert scenario.parameters.names == ("R_s", "J")
    assert scenario.points[0].space.names == ("R_s", "J[cold_1]", "J[cold_2]")
    assert scenario.points[1].space.names == ("R_s", "J[warm]")


def test_zero_by_glob_and_fixed_wins_over_a_law_block(folder):
    data = set_in(valid(), "parameters/0/law_block", ...)
    scenario = loaded(folder, set_in(data, "parameters/0/zero", ["motor.R_s.a?"]))
    assert scenario.fixed["motor.R_s.a1"] == scenario.fixed["motor.R_s.a2"] == 0.0
    assert "motor.R_s.a0" not in scenario.fixed
    data = set_in(valid(), "fixed/motor.R_s.a1", 0.5)
    assert loaded(folder, data).fixed["motor.R_s.a1"] == 0.5


def test_parameter_set_gives_start_values_in_its_own_units(folder):
    write_ssv(
        folder / "set.ssv",
        ParameterSet(
            "s", {"motor.J": 3.0, "velocityController.K_p": 9.0, "motor.gain": 2.0}, {"motor.J": "g.m2"}
        ),
    )
    data = set_in(set_in(valid(), "parameter_set", "set.ssv"), "parameters/1", ...)
    scenario = loaded(folder, data)
    assert scenario.fixed["motor.J"] == pytest.approx(3e-3)
    assert scenario.fixed["velocityController.K_p"] == 0.12
    assert scenario.fixed["motor.gain"] == 2.0
    write_ssv(folder / "set.ssv", ParameterSet("s", {"motor.J": 3.0}, {"motor.J": "kg"}))
    assert "set.ssv: 'motor.J': unit 'kg' cannot be turned into 'kg.m2'" in sentence(folder, data, UnitError)
    write_ssv(folder / "set.ssv", ParameterSet("s", {"motor.JJ": 3.0}))
    assert (
        "parameter_set (set.ssv): Small.fmu has no variable 'motor.JJ'. Did you mean 'motor.J'?"
        in sentence(folder, data, ScenarioError)
    )


def test_given_start_values_of_an_earlier_stage(folder):
    scenario = loaded(folder, valid()).given({-30.0: {"motor.gain": 2.0, "motor.J": 1.0}})
    assert scenario.points[0].fixed["motor.gain"] == 2.0
    assert "motor.J" not in scenario.points[0].fixed
    assert "motor.gain" not in scenario.points[1].fixed


def simulate():
    data = valid()
    for key in ("parameters", "search"):
        del data[key]
    return data | {"kind": "simulate"}


def test_simulate_needs_no_parameters_and_records_every_output(folder):
    data = simulate()
    scenario = loaded(folder, set_in(data, "recordings/columns/i_q", ...) | {"cost": {}})
    assert scenario.kind == "simulate"
    assert scenario.measured == ("w_m",)
    assert scenario.outputs == ("w_m", "i_q")
    assert scenario.parameters.dimension == 0
    only = loaded(
        folder,
        simulate() | {"outputs": ["flux"], "recordings": {**data["recordings"], "fit": []}, "cost": {}},
    )
    assert only.outputs == ("w_m", "flux")
    assert [p.temperature_degC for p in only.points] == [-30.0]


def test_command_line_recordings_replace_the_scenario_s(folder, monkeypatch):
    monkeypatch.chdir(folder / "runs")
    scenario = loaded(folder, valid(), fit=["cold_1.csv"], validate=["w*.csv"], seed=9)
    assert [r.name for r in scenario.fit] == ["cold_1"]
    assert [r.name for r in scenario.validate] == ["warm"]
    assert scenario.seed == 9
    assert "--fit: 'none*.csv' matches no file" in sentence(folder, valid(), ScenarioError, fit=["none*.csv"])
    assert "no such file" in sentence(folder, valid(), RecordingError, fit=[folder / "runs" / "cold_3.csv"])


def test_names_stay_apart_when_files_share_theirs(folder, tmp_path):
    for part in ("unit_a", "unit_b"):
        (tmp_path / part).mkdir()
        write_recording(tmp_path / part / "fit_1.csv", -30)
    scenario = loaded(folder, valid(), fit=sorted(tmp_path.glob("*/fit_1.csv")))
    assert [r.name for r in scenario.fit] == ["unit_a/fit_1", "unit_b/fit_1"]


def test_the_same_recording_is_read_once_and_never_both_fit_and_validate(folder):
    data = set_in(valid(), "recordings/fit", ["runs/warm.csv", "runs/w*.csv", "./runs/../runs/warm.csv"])
    assert len(loaded(folder, data).fit) == 1
    data = set_in(valid(), "recordings/validate", ["runs/warm.csv"])
    assert "both a fit and a validate recording" in sentence(folder, data, ScenarioError)


def test_fmu_can_be_replaced(folder, tmp_path):
    shutil.copy(folder / "Small.fmu", tmp_path / "Other.fmu")
    data = set_in(valid(), "fmu", "none.fmu")
    assert loaded(folder, data, fmu=tmp_path / "Other.fmu").fmu.path.name == "Other.fmu"
    described = loaded(folder, valid()).fmu
    assert loaded(folder, data, fmu=described).fmu is described
    assert "none.fmu" in sentence(folder, data, InputError)
    (folder / "bad.fmu").write_bytes(b"no archive")
    assert "bad.fmu" in sentence(folder, set_in(valid(), "fmu", "bad.fmu"), InputError)


WRONG = [
    # misspelt keys in every table
    ("tittle", 1, "unknown key 'tittle'", "Did you mean 'title'?"),
    ("recordings/collumns", {}, "recordings: unknown key 'collumns'", "Did you mean 'columns'?"),
    ("recordings/time/colum", "t", "recordings.time: unknown key 'colum'", "Did you mean 'column'?"),
    (
        "recordings/columns/i_q/units",
        "A",
        "recordings.columns.i_q: unknown key 'units'",
        "Did you mean 'unit'?",
    ),
    ("temperature/roundto", 1, "temperature: unknown key 'roundto'", "Did you mean 'round_to'?"),
    ("parameters/0/lowr", 1, "parameters[R_s]: unknown key 'lowr'", "Did you mean 'lower'?"),
    ("parameters/0/law/from", 1, "parameters[R_s].law: unknown key 'from'", "Did you mean 'form'?"),
    ("cost/chanels", {}, "cost: unknown key 'chanels'", "Did you mean 'channels'?"),
    ("cost/channels/i_q/wieght", 1, "cost.channels.i_q: unknown key 'wieght'", "Did you mean 'weight'?"),
    ("cost/window/stopp", 1, "cost.window: unknown key 'stopp'", "Did you mean 'stop'?"),
    ("search/popluation", 1, "search: unknown key 'popluation'", "Did you mean 'population'?"),
    ("simulation/tolerence", 1, "simulation: unknown key 'tolerence'", "Did you mean 'tolerance'?"),
    # missing and wrongly typed values
    ("fmu", ..., "fmu: is missing", "add it"),
    ("recordings", ..., "recordings: is missing", ""),
    ("recordings/columns", ..., "recordings.columns: is missing", ""),
    ("parameters/0/lower", ..., "parameters[R_s].lower: is missing", ""),
    ("parameters/0/name", ..., "parameters[1].name: is missing", ""),
    ("parameters", [], "parameters: needs at least 1 entry", ""),
    ("parameters/0/lower", "low", "parameters[R_s].lower: must be a number, not 'low'", ""),
    ("parameters/0/lower", True, "must be a number, not True", ""),
    ("parameters/0/lower", float("nan"), "parameters[R_s].lower: must be a finite number, not nan", ""),
    ("parameters/0/upper", float("inf"), "must be a finite number", ""),
    ("seed", 1.5, "seed: must be a whole number, not 1.5", ""),
    ("seed", -1, "seed: must be greater than or equal to 0, not -1", ""),
    ("title", 7, "title: must be a text in quotes, not 7", ""),
    ("search", 7, "search: must be a table, not 7", ""),
    ("recordings/fit", "a.csv", "recordings.fit: must be an array, not 'a.csv'", ""),
    ("search/polish", 1, "search.polish: must be true or false, not 1", ""),
    ("search/population", 3, "search.population: must be greater than or equal to 5", ""),
    ("search/crossover", 1.5, "search.crossover: must be less than or equal to 1", ""),
    ("search/strategy", "best1bim", "search.strategy: must be", "Did you mean 'best1bin'?"),
    (
        "cost/error",
        "square",
        "cost.error: must be 'squared', 'absolute' or 'huber'",
        "Did you mean 'squared'?",
    ),
    ("parameters/0/scale", "lg", "parameters[R_s].scale: must be 'linear' or 'log'", "Did you mean 'log'?"),
    ("parameters/0/law/form", "cubi", "parameters[R_s].law.form: must be one of", "Did you mean 'cubic'?"),
    ("parameters/0/law/published", [1.0], "published holds 1 coefficients, but linear has 2", ""),
    (
        "cost/channels/w_m/noise",
        "estimat",
        "cost.channels.w_m.noise: must be 'estimate' or a number above 0",
        "",
    ),
    ("cost/channels/w_m/noise", 0, "must be 'estimate' or a number above 0", ""),
    ("cost/mask", [[2.0, 1.0]], "cost.mask: must hold pairs", ""),
    ("cost/window", {"start": 2.0, "stop": 1.0}, "cost.window: start must lie before stop", ""),
    ("temperature/column", "temperature", "temperature: needs either 'input'", ""),
    ("recordings/columns/i_q/value", 1.0, "recordings.columns.i_q: needs either 'column'", ""),
    ("recordings/columns/i_q/scale", 0.0, "scale = 0 would erase the signal", ""),
    # kinds
    ("kind", ..., "kind is missing", 'supported kinds are "identify" or "simulate"'),
    ("kind", "identfy", "kind is 'identfy'", "Did you mean 'identify'?"),
    ("kind", "tune", "kind is 'tune': run 'thsa-cosim tune ", ""),
    ("kind", 3, "kind is 3", ""),
    # against the FMU
    (
        "parameters/0/variable",
        "motr.R_s.a0",
        "parameters[R_s].variable: Small.fmu has no variable",
        "'motor.R_s.a0'",
    ),
    ("parameters/0/variable", "w_m", "'w_m' is a output of Small.fmu, no parameter", ""),
    ("fixed/velocityControler.K_i", 1.0, 'fixed."velocityControler.K_i"', "'velocityController.K_i'"),
    ("fixed/T_amb", 1.0, "fixed.T_amb: 'T_amb' is a input", "[recordings.columns.T_amb]"),
    ("fixed/motor.J", 1.0, "fixed.\"motor.J\" is searched for as parameter 'J'", "remove one"),
    ("recordings/columns/w_n", {"column": "speed"}, "recordings.columns.w_n: Small.fmu has no", "'w_m'"),
    ("recordings/columns/motor.J", {"column": "speed"}, "is searched for as parameter 'J'", "remove one"),
    ("recordings/columns/T_amb", ..., "recordings.columns.T_amb is missing: input 'T_amb'", ""),
    ("recordings/columns/i_q", {"value": 1.0}, "recordings.columns.i_q is an output", ""),
    ("temperature/input", "T_amd", "temperature.input: Small.fmu has no variable 'T_amd'", "'T_amb'"),
    ("cost/channels/T_amb", {}, "cost.channels.T_amb is an input", ""),
    ("cost/channels/i_d", {}, "cost.channels.i_d has no recorded column", "'i_q'"),
    ("parameters/0/law_block", "motor.R_x", "law_block: Small.fmu has no block 'motor.R_x'", "'motor.R_s'"),
    ("parameters/0/zero", ["motor.b*"], "zero: 'motor.b*' matches no parameter", ""),
    ("parameters/1/name", "R_s", "parameter 'R_s' appears twice", ""),
    ("search/profile", ["Rs"], "search.profile names 'Rs'", "'R_s'"),
]
WRONG_VALUES = [
    ("parameters/0/lower", 9.0, ParameterError, "'R_s': lower = 9 must be below upper = 5"),
    ("parameters/0/start", 9.0, ParameterError, "start = 9 must lie between"),
    (
        "parameters/0/upper",
        500.0,
        ParameterError,
        "parameters[R_s].upper: 500 Ohm is outside what Small.fmu allows",
    ),
    ("parameters/0/lower", -1.0, ParameterError, "(min = 0)"),
    ("fixed/velocityController.K_i", -1.0, ParameterError, "allows for 'velocityController.K_i' (min = 0)"),
    ("parameters/1/lower", 0.0, ParameterError, "above 0 on a log scale"),
    ("parameters/0/unit", "V", UnitError, "'R_s' (motor.R_s.a0): unit 'V' cannot be turned into 'Ohm'"),
    ("parameters/0/unit", "omh", UnitError, "unknown unit 'omh'"),
    (
        "recordings/columns/i_q/unit",
        "V",
        UnitError,
        "'current' for 'i_q': unit 'V' cannot be turned into 'A'",
    ),
    ("recordings/columns/i_q/unit", ..., UnitError, "'current' states no unit; add unit"),
    ("recordings/time/unit", "A", UnitError, "cannot be turned into 's'"),
    (
        "recordings/columns/i_q/column",
        "curent",
        RecordingError,
        "no column 'curent'. Did you mean 'current'?",
    ),
    (
        "recordings/fit",
        ["runs/wram.csv"],
        RecordingError,
        "no such file; check the path. Did you mean 'warm.csv'?",
    ),
    ("recordings/fit", ["runs/wram*.csv"], ScenarioError, "recordings.fit: 'runs/wram*.csv' matches no file"),
    ("recordings/fit", [], ScenarioError, "recordings.fit names no recording"),
    ("parameter_set", "none.ssv", ParameterError, "none.ssv: cannot be read"),
]


@pytest.mark.parametrize(
    ("key", "value", "what", "remedy"), WRONG, ids=[f"{w[0]}={w[1]!r}"[:60] for w in WRONG]
)
def test_wrong_keys_and_values_are_one_sentence(folder, key, value, what, remedy):
    message = sentence(
        folder, set_in(valid(), key, value), ScenarioError if "twice" not in what else ParameterError
    )
    assert message.startswith(f"{folder / 'small.toml'}: ")
    assert what in message
    assert remedy in message


@pytest.mark.parametrize(("key", "value", "error", "what"), WRONG_VALUES)
def test_wrong_files_units_and_bounds_are_one_sentence(folder, key, value, error, what):
    assert what in sentence(folder, set_in(valid(), key, value), error)


def test_a_channel_without_noise_asks_for_a_number(folder):
    data = set_in(valid(), "recordings/columns/i_q/smooth", "mean")
    assert loaded(folder, data)  # the noise is that of the file, not of its mean
    rows = (folder / "runs" / "warm.csv").read_text().splitlines()
    flat = [",".join((*row.split(",")[:3], "1.0", row.split(",")[4])) for row in rows[1:]]
    (folder / "runs" / "flat.csv").write_text("\n".join((rows[0], *flat)))
    data = set_in(valid(), "recordings/fit", ["runs/flat.csv"])
    assert "no noise can be seen on 'i_q'" in sentence(folder, data, ScenarioError)
    assert loaded(folder, set_in(data, "cost/channels/i_q/noise", 0.05))


@pytest.mark.parametrize(
    ("content", "what"),
    [
        (b"kind = \n", "is no valid TOML"),
        (b"\xff\xfe\x00", "is not UTF-8"),
        (b"", "kind is missing"),
        (b"knd = 'identify'", "('knd' is no key)"),
        (b"a = " + b"[" * 3000 + b"]" * 3000, "is no valid TOML"),
        (b"kind = 'identify'\nkind = 'identify'", "is no valid TOML"),
    ],
)
def test_what_is_no_scenario_file(tmp_path, content, what):
    file = tmp_path / "x.toml"
    file.write_bytes(content)
    with pytest.raises(ScenarioError, match=r"x\.toml: ") as caught:
        load(file)
    assert what in str(caught.value)


def test_missing_scenario_file_and_folder(folder):
    (folder / "small.toml").write_text(toml(valid()))
    with pytest.raises(
        ScenarioError, match=r"no such scenario file; check the path\. Did you mean 'small\.toml'"
    ):
        load(folder / "smal.toml")
    with pytest.raises(ScenarioError, match=r"is a folder; name a scenario file.*small\.toml"):
        load(folder)
    with pytest.raises(ScenarioError, match="cannot be read"):
        load("nul\0.toml")


def test_every_kind_has_its_table():
    assert set(KINDS) == {"diagnose", "identify", "simulate"}


def paths(data, prefix=""):
    pairs = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in pairs:
        yield f"{prefix}{key}"
        yield from paths(value, f"{prefix}{key}/")


PATHS = sorted(paths(VALID))
TEXT = st.text(st.characters(codec="utf-8", exclude_categories=["Cs"]), max_size=12) | st.sampled_from(
    [
        "motor.J",
        "w_m",
        "T_amb",
        "rad/s",
        "*",
        "[",
        "",
        ".",
        "/",
        "runs",
        "runs/*",
        "..",
        "\0",
        "estimate",
        "log",
        "%",
    ]
)
SCALAR = (
    TEXT
    | st.booleans()
    | st.integers(-(10**30), 10**30)
    | st.integers(-3, 3)
    | st.floats()
    | st.just(datetime.date(2026, 11, 21))
)
VALUE = st.recursive(
    SCALAR,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(TEXT, inner, max_size=3),
    max_leaves=4,
)


def get(data, path):
    for part in path.split("/"):
        data = data[int(part)] if isinstance(data, list) else data[part]
    return data


@st.composite
def mutated(draw):
    data = copy.deepcopy(VALID)
    for _ in range(draw(st.integers(1, 3))):
        path = draw(st.sampled_from(PATHS))
        try:
            change = draw(st.sampled_from(["delete", "replace", "misspell", "move", "add"]))
            if change == "delete":
                set_in(data, path, ...)
            elif change == "replace":
                set_in(data, path, draw(VALUE))
            elif change == "misspell":
                value = get(data, path)
                set_in(data, path, ...)
                set_in(data, path + draw(st.sampled_from(string.ascii_letters)), value)
            elif change == "move":
                set_in(data, draw(st.sampled_from(PATHS)), copy.deepcopy(get(data, path)))
            else:
                set_in(data, f"{path}/{draw(TEXT).replace('/', '')}", draw(VALUE))
        except (KeyError, IndexError, TypeError, ValueError, AttributeError):
            continue  # an earlier change took the place away
    return data


RELAXED = settings(max_examples=400, deadline=None, suppress_health_check=[HealthCheck.too_slow])


def outcome(file):
    """Return the message of an input error, "" for a scenario; anything else is a failure."""
    try:
        assert isinstance(load(file), Scenario)
    except ThsaCosimError as error:
        return str(error)
    return ""


@RELAXED
@given(mutated())
def test_a_mutated_scenario_is_a_scenario_or_one_sentence(folder, data):
    file = folder / "mutated.toml"
    file.write_text(toml(data), encoding="utf-8")
    message = outcome(file)
    assert message.isprintable()
    assert len(message) < 1000


@RELAXED
@given(st.data())
def test_damaged_text_is_a_scenario_or_one_sentence(folder, data):
    content = bytearray(toml(VALID).encode())
    for _ in range(data.draw(st.integers(1, 5))):
        place = data.draw(st.integers(0, len(content) - 1))
        content[place : place + data.draw(st.integers(0, 3))] = data.draw(st.binary(max_size=3))
    file = folder / "damaged.toml"
    file.write_bytes(bytes(content))
    assert outcome(file).isprintable()


@pytest.mark.skipif(not (ROOT / "fmus" / "Motor.fmu").exists(), reason="needs fmus/Motor.fmu")
def test_the_shipped_motor_scenario():
    scenario = load(ROOT / "scenarios" / "motor.toml")
    assert [p.temperature_degC for p in scenario.points] == [-55, -50, -40, -30, -20, -10, 0, 25]
    assert scenario.parameters.names == ("R_s", "psi_pm", "T_fm", "b_m")
    assert (scenario.search.population, scenario.search.generations) == (45, 30)
    assert (scenario.search.mutation, scenario.search.crossover) == (0.16, 0.5)
    noise = [scenario.noise(r, "i_q") for r in scenario.fit]
    assert noise == pytest.approx([0.05] * 8, rel=0.05)
    assert [scenario.noise(r, "u_q") for r in scenario.fit] == pytest.approx([0.3] * 8, rel=0.05)
    assert scenario.fixed["motor.R_s.a1"] == 0.0
    assert scenario.drive(scenario.fit[0]).held == {"w_cmd"}
