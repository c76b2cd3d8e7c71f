"""Stages: read and checked at once, and what an earlier one found becomes start values of a later one."""

import pytest
from small_scenario import set_in, toml, valid, write_folder

from thsa_cosim.errors import RecordingError, ScenarioError, ThsaCosimError
from thsa_cosim.scenario import Scenario, StagedScenario, hand_on, load


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("stages")
    write_folder(path)
    (path / "first.toml").write_text(toml(valid()))
    second = set_in(set_in(valid(), "parameters/0", ...), "parameters/0/name", "inertia")
    (path / "second.toml").write_text(toml(second))
    last = valid() | {"kind": "simulate"}
    for key in ("parameters", "search"):
        del last[key]
    (path / "last.toml").write_text(toml(last))
    return path


STAGES = {
    "kind": "identify",
    "title": "all",
    "seed": 5,
    "stages": [
        {"scenario": "first.toml", "give": ["R_s"]},
        {"scenario": "second.toml"},
        {"scenario": "last.toml"},
    ],
}


def loaded(folder, data, **options):
    (folder / "all.toml").write_text(toml(data))
    return load(folder / "all.toml", **options)


def test_stages_are_read_in_order_and_share_the_seed(folder):
    study = loaded(folder, STAGES)
    assert isinstance(study, StagedScenario)
    assert [(s.name, s.give) for s in study.stages] == [
        ("first", ("R_s",)),
        ("second", ("inertia",)),
        ("last", ()),
    ]
    assert {s.scenario.seed for s in study.stages} == {5}
    assert {s.scenario.seed for s in loaded(folder, STAGES, seed=8).stages} == {8}
    assert isinstance(load(folder / "first.toml"), Scenario)


def test_what_a_stage_found_is_handed_on_in_the_units_of_the_next_fmu(folder):
    first, second, last = loaded(folder, STAGES).stages
    found = {-30.0: {"R_s": 0.5, "J": 1.5}, 25.0: {"R_s": 1.9, "J": 1.5}}
    later = hand_on(first, lambda t: found[t], second.scenario)
    for point, resistance in zip(later.points, (0.5, 1.9), strict=True):
        assert point.fixed["motor.R_s.a0"] == resistance
        assert point.fixed["motor.R_s.a1"] == point.fixed["motor.R_s.a2"] == 0.0
        assert point.fixed["velocityController.K_p"] == 0.12
        assert "motor.J" not in point.fixed  # searched there, and not given
    final = hand_on(second, lambda t: {"inertia": 3.0}, hand_on(first, lambda t: found[t], last.scenario))
    assert [p.fixed["motor.J"] for p in final.points] == pytest.approx([3e-3, 3e-3])
    assert [p.fixed["motor.R_s.a0"] for p in final.points] == [0.5, 1.9]
    assert "motor.R_s.a0" not in last.scenario.points[0].fixed


def test_a_variable_that_is_searched_again_is_not_overwritten(folder):
    first = loaded(folder, STAGES).stages[0]
    assert (
        hand_on(first, lambda t: {"R_s": 0.5, "J": 1.0}, first.scenario).points[0].fixed
        == first.scenario.fixed
    )


@pytest.mark.parametrize(
    ("key", "value", "error", "what"),
    [
        ("stages/0/scenaro", "x", ScenarioError, "stages[1]: unknown key 'scenaro'"),
        ("stages/0/scenario", ..., ScenarioError, "stages[1].scenario: is missing"),
        ("stages/1/scenario", "secnd.toml", ScenarioError, "stages[2]: "),
        ("stages/1/scenario", "secnd.toml", ScenarioError, "Did you mean 'second.toml'?"),
        ("stages/1/scenario", "first.toml", ScenarioError, "stage 'first' appears twice"),
        ("stages/1/scenario", "all.toml", ScenarioError, "has stages itself"),
        (
            "stages/0/give",
            ["Rs"],
            ScenarioError,
            "stages[1].give names 'Rs', which first.toml does not find.",
        ),
        ("stages", [], ScenarioError, "stages: needs at least 1 entry"),
        ("fmu", "x.fmu", ScenarioError, "unknown key 'fmu'"),
        ("kind", "identfy", ScenarioError, "Did you mean 'identify'?"),
        ("kind", ..., ScenarioError, "kind: is missing"),
    ],
)
def test_wrong_stages_are_one_sentence(folder, key, value, error, what):
    data = {**STAGES, "stages": [dict(stage) for stage in STAGES["stages"]]}
    with pytest.raises(error) as caught:
        loaded(folder, set_in(data, key, value))
    message = str(caught.value)
    assert message.startswith(f"{folder / 'all.toml'}: ")
    assert what in message
    assert "\n" not in message


def test_a_stage_s_own_mistake_names_stage_and_file(folder):
    (folder / "bad.toml").write_text(toml(set_in(valid(), "recordings/fit", ["runs/none.csv"])))
    data = {**STAGES, "stages": [{"scenario": "first.toml"}, {"scenario": "bad.toml"}]}
    with pytest.raises(RecordingError) as caught:
        loaded(folder, data)
    assert "all.toml: stages[2]: " in str(caught.value)
    assert "none.csv: no such file" in str(caught.value)


def test_recordings_cannot_replace_those_of_all_stages(folder):
    with pytest.raises(ThsaCosimError, match="or run one stage alone"):
        loaded(folder, STAGES, fit=["runs/warm.csv"])
