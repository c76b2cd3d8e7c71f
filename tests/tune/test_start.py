"""The start from rest: terms against closed forms, the static breakaway against the rig's equations, bad tables."""

import tomllib
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import thsa_cosim as tc
from thsa_cosim.errors import ScenarioError
from thsa_cosim.fmu import Plant
from thsa_cosim.report.page import write_page
from thsa_cosim.scenario.metrics_schema import START_METRICS, StartTable
from thsa_cosim.signals import Signals
from thsa_cosim.tune.combine import worst_of
from thsa_cosim.tune.start import start_terms

ROOT = Path(__file__).parents[2]
SPEC = StartTable(moving=0.1, current="i", current_limit=10.0, voltage="u", voltage_limit=100.0)


def run(speed: np.ndarray, current: np.ndarray) -> dict[str, float]:
    time = np.linspace(0.0, 1.0, 101)
    signals = Signals(time, {"v": speed, "i": current, "u": -40.0 * time})
    return dict(zip(SPEC.terms, start_terms(SPEC, signals, "v", 0.1), strict=True))


def test_terms_of_a_straight_start() -> None:
    """Motion from 0.3 s on, current 5 A per s: a tenth of the last speed is reached at 0.37 s."""
    time = np.linspace(0.0, 1.0, 101)
    found = run(-np.maximum(time - 0.3, 0.0), -5.0 * time)
    assert found["start_time"] == pytest.approx(0.27)
    assert found["breakaway_current"] == pytest.approx(1.85)
    assert found["breakaway_margin"] == pytest.approx(10.0 / 1.85 - 1.0)
    assert found["current_reserve"] == pytest.approx(0.5)
    assert found["voltage_reserve"] == pytest.approx(0.6)


def test_what_does_not_start_or_does_not_stay_in_motion_has_no_start_time() -> None:
    time = np.linspace(0.0, 1.0, 101)
    for speed in (np.zeros_like(time), np.where(time < 0.5, 1.0, 0.0)):
        found = run(speed, 5.0 * time)
        assert np.isnan([found[n] for n in ("start_time", "breakaway_current", "breakaway_margin")]).all()
        assert found["current_reserve"] == pytest.approx(0.5)


def test_without_a_voltage_there_is_no_reserve_of_it() -> None:
    assert StartTable(current="i", current_limit=1.0).terms == START_METRICS[:-1]
    with pytest.raises(ValueError, match="go together"):
        StartTable(current="i", current_limit=1.0, voltage="u")


def test_the_worst_margin_is_the_smallest_and_the_worst_time_the_largest() -> None:
    terms = np.array([[0.1, 5.0, 2.0, 0.5, 0.4], [0.2, 6.0, 1.0, 0.6, 0.3]])
    assert worst_of(START_METRICS, terms).tolist() == [0.2, 6.0, 1.0, 0.5, 0.3]


def scenario(**changes: Any) -> dict[str, Any]:
    """``cold_start.toml`` with a tiny search and without the loop's margins."""
    content = tomllib.loads((ROOT / "scenarios" / "cold_start.toml").read_text(encoding="utf-8"))
    content["fmu"] = str(ROOT / "fmus" / "THSA.fmu")
    content["search"] |= {"population": 5, "generations": 1}
    del content["loop"], content["compare"]
    content["requirements"] = [r for r in content["requirements"] if r["metric"] in START_METRICS]
    return content | changes


def static_current(temperature: float, force: float) -> float:
    """Coulomb friction of all elements, the load and the no-back device over K_t, by the rig's equations, in A."""
    t, lead = temperature, 10e-3 / (2.0 * np.pi)
    screw = lead * (force + 2.7e3 + 37.0 * t - 1.4 * t**2 - 0.07 * t**3)
    gear = screw + 1.15 * max(0.0, -screw) + 11.0 - 0.25 * t + 2e-4 * t**2
    motor = 1e-2 * np.exp(-4e-2 * t) + 3e-2 * np.exp(9e-3 * t)
    return float((gear / 30.0 + motor) / (np.sqrt(1.5) * 4.0 * (0.1 + 6e-5 * t - 4e-6 * t**2)))


def test_a_slow_ramp_gives_the_static_breakaway() -> None:
    """0.1 mm/s² for 8 s with the gains of 25 degC, at the ends of temperature and load."""
    spec = StartTable(current="i_q", current_limit=40.0)
    time = np.arange(0.0, 8.0, 0.01)
    with Plant.open(ROOT / "fmus" / "THSA.fmu") as plant:
        for temperature, force in product((-55.0, 25.0), (-55e3, 0.0, 55e3)):
            columns = {"v_cmd": 1e-4 * time, "F_load": np.full_like(time, force)}
            inputs = Signals(time, columns | {"T_amb": np.full_like(time, temperature)})
            signals = plant.run({}, inputs, ["v", "i_q"], time)
            found = dict(zip(spec.terms, start_terms(spec, signals, "v", 0.0), strict=True))
            expected = static_current(temperature, force)
            assert found["breakaway_current"] == pytest.approx(expected, rel=0.05)
            assert found["breakaway_margin"] == pytest.approx(40.0 / found["breakaway_current"] - 1.0)


def test_tables_and_page_hold_the_start(tmp_path: Path) -> None:
    small = scenario()
    small["conditions"]["T_amb"]["values"] = [-55.0, 25.0]
    small["conditions"]["F_load"]["values"] = [55.0]
    small["requirements"][0] = {"metric": "start_time", "maximum": 1e-4, "hard": False}
    study = tc.tune(small, folder=tmp_path / "study", workers=1, quiet=True)
    header, *lines = (tmp_path / "study" / "start.csv").read_text().splitlines()
    assert header == ",".join(["gains", "temperature_degC", "F_load_kN", *START_METRICS])
    assert len(lines) == 2 * 2
    assert "start" in study.plots
    page = write_page(tmp_path / "study").read_text(encoding="utf-8")
    assert "Start from rest" in page
    assert "breakaway margin" in page


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"start": {"current": "i_x", "current_limit": 1.0}, "requirements": []}, "start.current"),
        ({"start": {"current": "i_q", "current_limit": -1.0}}, "current_limit"),
        ({"start": None}, r"\[start\]"),
    ],
)
def test_a_wrong_table_is_one_sentence(change: dict[str, Any], message: str, tmp_path: Path) -> None:
    content = scenario()
    for key, value in change.items():
        if value is None:
            del content[key]
        else:
            content[key] = value
    with pytest.raises(ScenarioError, match=message):
        tc.tune(content, folder=tmp_path / "study", workers=1, quiet=True)
