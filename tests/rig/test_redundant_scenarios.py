"""The standby lane is tuned for the take-over, and a recording tells which lane or path has failed."""

from pathlib import Path

import pytest

import thsa_cosim as tc

SCENARIOS = Path(__file__).parents[2] / "scenarios"


@pytest.mark.slow
def test_the_standby_lane_takes_over_within_the_limits_of_the_drive(tmp_path: Path) -> None:
    """The pair of table IV saturates the drive at the take-over, the tuned one does not, and is as fast."""
    found = tc.tune(SCENARIOS / "standby.toml", folder=tmp_path / "study", workers=1, quiet=True).result
    before, after = found["before"], found["after"]
    assert before["peak.i_B"] > 39.9
    assert after["peak.i_B"] <= 38.0
    assert after["overshoot"] <= 0.03
    assert after["rise_time"] < 1.02 * before["rise_time"]


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("recording", "failed", "at"), [("lane_a", "motor_A_jammed", 1.37), ("path", "primary_broken", 1.62)]
)
def test_the_first_failure_is_the_one_that_happened(
    recording: str, failed: str, at: float, tmp_path: Path
) -> None:
    study = tc.identify(
        SCENARIOS / "redundant_failure.toml",
        fit=[SCENARIOS / "recordings" / f"redundant_{recording}.parquet"],
        folder=tmp_path / "study",
        workers=1,
        quiet=True,
    )
    found = {name: p["value"] for name, p in study.result["points"][0]["parameters"].items()}
    assert min(found, key=lambda name: found[name]) == failed
    assert found[failed] == pytest.approx(at, abs=1e-3)
    assert study.result["trust"]["verdict"] == "explained"
