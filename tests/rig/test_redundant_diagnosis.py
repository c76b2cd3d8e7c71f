"""Which lane, which path: units of the redundant actuator with an effect in one of them, diagnosed."""

import sys
from pathlib import Path

import pytest

import thsa_cosim as tc

ROOT = Path(__file__).parents[2]
SCENARIO = ROOT / "scenarios" / "redundant_diagnosis.toml"
sys.path.append(str(ROOT / "benchmarks"))
import redundant_recordings

#: Effect of each unit, and its coefficient with the value that it was simulated with.
UNITS = {
    "lane_A_windage": ("windage:motorA", "b_q", 6e-6),
    "lane_B_saturation": ("torque-constant-saturation:torqueB", "a", 6e-5),
    "primary_play": ("backlash:contactPrimary", "gap", 6e-5),
    "secondary_friction": ("load-dependent-friction:screwSecondary", "mu", 0.03),
}


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("redundant")
    assert redundant_recordings.main([str(folder), *UNITS, "as_drawn", "lane_B_brake_drags"]) == 0
    return folder


def diagnosed(folder: Path, study: Path) -> tc.DiagnoseStudy:
    return tc.diagnose(
        SCENARIO,
        fit=[str(folder / "fit_*.parquet")],
        validate=[str(folder / "validate_*.parquet")],
        folder=study,
        workers=1,
        quiet=True,
    )


@pytest.mark.nightly
@pytest.mark.parametrize("unit", UNITS)
def test_the_lane_or_path_with_the_effect_is_named(unit: str, recordings: Path, tmp_path: Path) -> None:
    name, coefficient, value = UNITS[unit]
    study = diagnosed(recordings / unit, tmp_path / "study")
    assert study.verdict == "missing-effect"
    (effect,) = study.result["effects"]
    assert name == effect["name"] or name in effect["equivalent"]
    found = effect["parameters"][coefficient]
    assert found["value"] == pytest.approx(value, abs=4.0 * found["stderr"])
    assert (study.recordings.loc["validate", "rmse / noise"] < 1.1).all()


@pytest.mark.nightly
def test_a_unit_as_drawn_and_one_whose_brake_drags_lack_no_effect(recordings: Path, tmp_path: Path) -> None:
    """A brake that drags is Coulomb friction, a declared parameter of each lane: a note tells which one.

    What both motors have in common is friction of the gear as well: only the difference of the lanes is determined.
    """
    drawn = diagnosed(recordings / "as_drawn", tmp_path / "drawn").result
    drags = diagnosed(recordings / "lane_B_brake_drags", tmp_path / "drags").result
    for result in (drawn, drags):
        assert result["verdict"] == "no-missing-effect"
        assert result["effects"] == []
    assert not any("from the drawing" in note for note in drawn["notes"])
    assert any(note.startswith("T_fm_B: ") and "from the drawing" in note for note in drags["notes"])
    for result, more in ((drawn, 0.0), (drags, 0.2)):
        found = result["parameters"]["after"]
        assert found["T_fm_B"]["value"] - found["T_fm_A"]["value"] == pytest.approx(more, abs=5e-3)
