"""One file cut into parts to fit and to score, and the lead-in that brings a model into the right state."""

from pathlib import Path

import numpy as np
import pytest
from small_scenario import toml, valid, write_folder

from thsa_cosim.errors import RecordingError, ScenarioError
from thsa_cosim.fmu import Plant
from thsa_cosim.identify.problem import build_point
from thsa_cosim.scenario import Scenario, load
from thsa_cosim.signals import Signals
from thsa_cosim.simulate import simulate
from thsa_cosim.study import Place

EMPS = Path(__file__).parents[2] / "fmus" / "EMPS.fmu"
PARTS = [
    {"name": "first", "use": "fit", "stop": 0.2},
    {"name": "rest", "use": "validate", "start": 0.3},
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("parts")
    write_folder(path)
    return path


def cut(folder, parts, lead_in=0.0, **options) -> Scenario:
    data = valid()
    data["cost"] = {"channels": {"i_q": {}}}
    data["recordings"] |= {"fit": ["runs/warm.csv"], "validate": [], "parts": parts}
    data["recordings"]["time"]["lead_in"] = lead_in
    file = folder / "cut.toml"
    file.write_text(toml(data))
    return load(file, **options)


def test_a_file_is_cut_into_a_part_to_fit_and_a_part_to_score(folder):
    scenario = cut(folder, PARTS)
    (fit,), (held_out,) = scenario.fit, scenario.validate
    assert (fit.name, held_out.name) == ("warm first", "warm rest")
    assert fit.sha256 == held_out.sha256
    assert fit.duration == pytest.approx(0.2)
    assert held_out.duration == pytest.approx(0.19)
    whole = cut(folder, []).fit[0].signals
    assert np.array_equal(held_out.signals["i_q"], whole["i_q"][30:])


def test_files_of_the_command_line_are_cut_alike(folder):
    scenario = cut(folder, PARTS, fit=[folder / "runs" / "cold_1.csv"])
    assert [r.name for r in scenario.fit] == ["cold_1 first"]
    assert [r.name for r in scenario.validate] == ["cold_1 rest"]


def test_validate_files_take_the_place_of_parts_and_stay_whole(folder):
    scenario = cut(folder, PARTS, validate=[folder / "runs" / "check.csv"])
    assert [r.name for r in scenario.fit] == ["warm first"]
    assert [(r.name, round(r.duration, 2)) for r in scenario.validate] == [("check", 0.49)]


def test_the_lead_in_begins_earlier_and_is_not_compared(folder):
    scenario = cut(folder, PARTS, lead_in=0.05)
    (fit,), (held_out,) = scenario.fit, scenario.validate
    # No sample lies before the file's first: the lead-in is taken from the part itself.
    assert fit.duration == pytest.approx(0.2)
    assert fit.compared.time[0] == pytest.approx(0.05)
    assert held_out.duration == pytest.approx(0.24)
    assert len(held_out.compared) == 20
    (case,) = build_point(scenario, scenario.points[0]).cases
    assert case.time[0] == 0.0
    assert len(case.inputs) == 21
    assert case.channels[0].time[0] == case.measured.time[0] == pytest.approx(0.05)


@pytest.mark.parametrize(
    ("parts", "sentence"),
    [
        ([{"name": "a", "use": "validate"}], "no entry of parts has use = 'fit'"),
        ([PARTS[0], PARTS[0]], "two entries of parts are named 'first'"),
        (
            [{"name": "a", "use": "fit", "stop": 0.2}, {"name": "b", "use": "validate", "start": 0.1}],
            "parts 'a' and 'b' overlap, but only one is fitted",
        ),
        ([{"name": "a", "use": "fit", "start": 0.2, "stop": 0.1}], "parts[a]: start must lie before stop"),
        ([{"name": "a", "use": "fitt"}], "must be 'fit' or 'validate', not 'fitt'. Did you mean 'fit'?"),
        ([{"name": "a", "use": "fit", "from": 0.1}], "unknown key 'from'"),
    ],
)
def test_parts_that_make_no_sense_are_refused_in_a_sentence(folder, parts, sentence):
    with pytest.raises(ScenarioError) as caught:
        cut(folder, parts)
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)


def test_cuts_are_made_in_one_place(folder):
    data = valid()
    data["recordings"]["parts"] = PARTS
    data["recordings"]["time"]["start"] = 0.1
    (folder / "twice.toml").write_text(toml(data))
    with pytest.raises(ScenarioError, match=r"time\.start and time\.stop cut whole files"):
        load(folder / "twice.toml")


def test_a_lead_in_that_leaves_nothing_is_refused(folder):
    with pytest.raises(RecordingError, match=r"a lead-in of 0\.2 s leaves nothing of 0\.2 s to compare"):
        cut(folder, PARTS, lead_in=0.2)


def test_a_drive_that_is_cut_in_motion_needs_its_lead_in(tmp_path):
    """The plant's own output, cut while it moves at 31 mm/s: the FMU starts at rest on the reference."""
    time = np.arange(0.0, 2.0, 1e-3)
    drive = Signals(time, {"q_ref": 0.02 * np.sin(2 * np.pi * time / 4.0), "F_load": 0.0 * time})
    with Plant.open(EMPS) as plant:
        run = plant.run({}, drive, ("q", "F"), time)
    columns = np.column_stack([time, drive["q_ref"], run["q"], run["F"]])
    np.savetxt(tmp_path / "run.csv", columns, delimiter=",", header="t,q_ref,q,F", comments="", fmt="%.12g")

    def error(lead_in: float) -> float:
        data = {
            "kind": "simulate",
            "fmu": str(EMPS),
            "recordings": {
                "fit": ["run.csv"],
                "time": {"column": "t", "unit": "s", "lead_in": lead_in},
                "parts": [{"name": "later", "use": "fit", "start": 0.4}],
                "columns": {
                    "q_ref": {"column": "q_ref", "unit": "m"},
                    "F_load": {"value": 0.0, "unit": "N"},
                    "F": {"column": "F", "unit": "N"},
                },
            },
        }
        (tmp_path / "later.toml").write_text(toml(data))
        result = simulate(load(tmp_path / "later.toml"), Place(tmp_path / f"study_{lead_in}"))
        return result.recordings[0].errors["F"].rmse

    assert error(0.0) > 5.0  # N
    assert error(0.3) < 1e-3
