"""The article's rows: each number of ``docs/article.md``, by a short run or (nightly) by its command."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import thsa_cosim as tc

ROOT = Path(__file__).parents[2]
SCENARIOS = ROOT / "scenarios"
DOCS = ROOT / "docs"
sys.path.append(str(ROOT / "benchmarks"))
import article_numbers as numbers
from article import differences
from article_page import ABSENT, CONTRADICTED, REPRODUCED, cold_start_page, page

from thsa_cosim.efficiency import motor_efficiency

STORED = json.loads((DOCS / "article" / "numbers.json").read_text(encoding="utf-8"))


def test_the_page_is_that_of_the_stored_numbers() -> None:
    """``python benchmarks/article.py`` writes both."""
    assert (DOCS / "article.md").read_text(encoding="utf-8") == page(STORED)
    assert (DOCS / "cold-start.md").read_text(encoding="utf-8") == cold_start_page(STORED)


def test_every_row_has_a_verdict_and_every_picture_is_there() -> None:
    text = (DOCS / "article.md").read_text(encoding="utf-8")
    rows = [line.split(" | ") for line in text.splitlines() if line.startswith("| ") and "claim" not in line]
    assert len(rows) > 40
    assert {row[3] for row in rows} == {REPRODUCED, CONTRADICTED, ABSENT}
    text += (DOCS / "cold-start.md").read_text(encoding="utf-8")
    for name in ("fig7", "fig8", "fig10", "fig11", "tables", "population", "efficiency", "start"):
        assert f"(article/{name}.png)" in text
        assert 10_000 < (DOCS / "article" / f"{name}.png").stat().st_size < 150_000


def test_numbers_without_a_study_are_the_stored_ones() -> None:
    """Laws against copper and the bench's friction, and the recorded responses."""
    now = json.loads(json.dumps(numbers.laws_numbers()))
    assert differences(STORED["laws"], now) == []
    recorded = {name: numbers.response(name) for name in ("tuned_at_25", "optimized")}
    assert differences(STORED["recorded"], recorded) == []


def test_a_number_that_moved_is_told() -> None:
    changed = json.loads(json.dumps(STORED))
    changed["table4"]["after"]["K_p"] *= 1.05
    changed["identified"]["R_s"]["form"] = "quadratic"
    del changed["copper_loss"]["sigma"]
    assert sorted(line.split(":")[0] for line in differences(STORED, changed)) == [
        "/copper_loss",
        "/identified/R_s/form",
        "/table4/after/K_p",
    ]


def test_stored_numbers_support_the_verdicts() -> None:
    """What the page calls reproduced lies within the noise or the digits that the article prints."""
    laws, table4, identified = STORED["laws"], STORED["table4"], STORED["identified"]
    assert laws["R_s_m30"] == pytest.approx(0.498)
    assert laws["R_s_copper_m30"] == pytest.approx(1.51, abs=0.005)
    assert laws["b_g_share_m30"] == pytest.approx(2e-6, rel=0.2)
    assert 0.42 <= table4["before"]["rise_time"] <= 0.45
    assert table4["before"]["steady_state_error"] == pytest.approx(0.0022, abs=3e-4)
    assert table4["article"]["rise_time"] == pytest.approx(0.31, abs=0.015)
    assert STORED["tuned_at_25"]["after"]["K_p"] == pytest.approx(0.12, rel=0.05)
    assert STORED["tuned_at_25"]["after"]["K_i"] == pytest.approx(0.45, rel=0.1)
    assert STORED["current_alone"]["R_s"]["stderr"] == pytest.approx(0.056, rel=0.1)
    assert identified["R_s"]["stderr_m30"] == pytest.approx(0.0041, rel=0.1)
    for name, one in identified.items():
        assert abs(one["m30"] - one["published_m30"]) < 3.0 * one["stderr_m30"], name
        assert one["identifiable"] == (name != "b_g")
    loss = STORED["copper_loss"]
    of_law = loss["formula"] * identified["R_s"]["stderr_m30"] / identified["R_s"]["m30"]
    assert abs(loss["balance"] - loss["formula"]) < 3.0 * np.hypot(loss["sigma"], of_law)


def test_stored_start_and_efficiency_follow_from_the_published_laws() -> None:
    """Static breakaway and efficiencies by tables II and III instead of the identified laws; and by the recording."""
    laws = {name: numbers.published(name) for name in numbers.TABLES}
    for row in STORED["start"]:
        t = row["temperature_degC"]
        motor = numbers.motor_of(laws, t)
        torque = numbers.load_torque(laws, t, 1e3 * row["F_load_kN"], 0.0) + motor["coulomb"]
        assert row["static"] == pytest.approx(torque / motor["torque_constant"], rel=0.01)
        # A start with the tuned gains takes more: it accelerates the motor.
        assert 1.0 < row["breakaway_current"] / row["static"] < 6.0
        assert row["breakaway_margin"] == pytest.approx(40.0 / row["breakaway_current"] - 1.0)
    found = STORED["efficiency"]
    assert found["actuator"]["-30"] == pytest.approx(found["recorded_m30"], rel=0.005)
    speed = 9e-3 * numbers.GEAR_RATIO / numbers.LEAD
    for t in numbers.EFFICIENCY_AT:
        torque = numbers.load_torque(laws, t, 55e3, 9e-3)
        expected = float(motor_efficiency(torque, speed, **numbers.motor_of(laws, t)))
        assert found["motor"][f"{t:g}"] == pytest.approx(expected, rel=0.005)


@pytest.mark.nightly
def test_the_command_finds_the_stored_numbers_again(tmp_path: Path) -> None:
    command = [sys.executable, str(ROOT / "benchmarks" / "article.py"), "--studies", str(tmp_path), "--check"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "0 numbers differ" in done.stdout


@pytest.mark.parametrize("figure", ["fig10", "fig11"])
def test_the_identified_laws_meet_the_articles_validation(figure: str, tmp_path: Path) -> None:
    """Velocity within 0.78 % and current within 3.56 %, whichever of the usual formulas is meant."""
    study = tc.simulate(SCENARIOS / f"{figure}.toml", folder=tmp_path / "study", workers=1, quiet=True)
    (recording,) = json.loads((tmp_path / "study" / "result.json").read_text())["recordings"]
    assert recording["role"] == "validate"
    signals = study.signals(recording["name"])
    for name, unit, limit in (("v", "m/s", 0.0078), ("i_q", "A", 0.0356)):
        measured = signals[f"{name} [{unit}]"]["measured"]
        error = recording["error"][name]
        assert error["nrmse"] <= limit
        name_of = {"fig10": "tuned_at_25", "fig11": "optimized"}[figure]
        assert error["nrmse"] == pytest.approx(STORED["validation"][name_of][name]["range"], rel=0.01)
        assert error["rmse"] / np.sqrt(np.mean(np.square(measured))) <= limit
        assert error["rmse"] == pytest.approx(error["noise"], rel=0.1)  # noise is all that is left
