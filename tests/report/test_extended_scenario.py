"""The extended model of a diagnosis as a scenario that can be identified from other recordings."""

import tomllib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from thsa_cosim.diagnosis.results import Value
from thsa_cosim.report.diagnose.extended import write_extended_scenario
from thsa_cosim.scenario import load
from thsa_cosim.scenario.source import read_toml

ROOT = Path(__file__).parents[2]


def result(**more: Any) -> Any:
    """A diagnosis of the shipped servo, whose FMU stands for the one with an effect: T_c plays a coefficient."""
    asked = read_toml(ROOT / "scenarios" / "servo.toml")
    asked["parameters"] = [p for p in asked["parameters"] if p["name"] != "T_c"]
    effect = SimpleNamespace(
        name="load-dependent-friction:gear",
        parameters={
            "mu": Value(0.4, "N.m", 0.01, variable="T_c"),
            "v_S": Value(0.2, "kg", 0.01, variable="m", role="shape"),
        },
    )
    whole = {
        "extended_fmu": ROOT / "fmus" / "Servo.fmu",
        "effects": (effect,),
        "known": (),
        "asked": asked,
        "scenario": ROOT / "scenarios" / "servo.toml",
        "title": 'A "servo"',
        "declared_after": {"R": Value(2900.0, "mOhm", 1.0), "K_t": Value(9.0, "N.m/A", 1.0)},
    }
    return SimpleNamespace(**(whole | more))


def test_it_can_be_loaded_with_the_found_values_as_starts(tmp_path: Path) -> None:
    path = write_extended_scenario(result(), tmp_path)
    assert path == tmp_path / "extended.toml"
    assert path is not None
    content = tomllib.loads(path.read_text())
    assert content["title"] == 'A "servo", with load-dependent-friction:gear'
    assert "diagnose" not in content
    assert all("spread" not in p for p in content["parameters"])
    starts = {p["name"]: p.get("start") for p in content["parameters"]}
    assert starts["R"] == pytest.approx(2.9)
    assert starts["K_t"] is None, "a value beyond the bounds is no start"
    assert starts["load-dependent-friction:gear.mu"] == 0.4
    assert content["fixed"]["m"] == 0.2, "shapes keep the value that was found"
    path.write_text(path.read_text().replace('"Servo.fmu"', f'"{ROOT / "fmus" / "Servo.fmu"}"'))
    found = load(path)
    assert [r.name for r in found.fit][:2] == ["servo_kp100_lift_and_drop", "servo_kp100_sin_sin"]
    assert found.parameters.names[-1] == "load-dependent-friction:gear.mu"
    coefficient = found.parameters.parameters[-1]
    assert (coefficient.lower, coefficient.upper) == (0.0, 2.0), (
        "five times as large, as far as the FMU allows"
    )


def test_a_known_effect_is_identified_again_like_one_that_was_found(tmp_path: Path) -> None:
    parameters = {
        "c": Value(0.3, "N.m", 0.01, variable="T_c"),
        "v_S": Value(0.2, "kg", 0.0, variable="m", role="shape"),
    }
    spring = SimpleNamespace(name="spring:gear", parameters=parameters)
    found = SimpleNamespace(
        name="windage:gear", parameters={"b_q": Value(0.1, "N.m.s/rad", 0.01, variable="b")}
    )
    path = write_extended_scenario(result(known=(spring,), effects=(found,)), tmp_path)
    assert path is not None
    content = tomllib.loads(path.read_text())
    starts = {p["name"]: p.get("start") for p in content["parameters"]}
    assert (starts["spring:gear.c"], starts["windage:gear.b_q"]) == (0.3, 0.1)
    assert content["fixed"]["m"] == 0.2
    assert content["title"] == 'A "servo", with windage:gear'


@pytest.mark.parametrize("lacks", [{"extended_fmu": None}, {"effects": ()}, {"asked": {}}])
def test_there_is_none_without_an_effect_or_an_fmu(tmp_path: Path, lacks: dict[str, Any]) -> None:
    assert write_extended_scenario(result(**lacks), tmp_path) is None
    assert not list(tmp_path.iterdir())
