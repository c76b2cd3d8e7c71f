"""A warm-up in one recording against the campaign of eight plateaus: the laws of motor and screw."""

from pathlib import Path

import numpy as np
import pytest
from reference import warm_up
from reference.radau import simulate_motor
from reference.rig import LAWS, NARROW, rig_at
from reference.waves import Wave

import thsa_cosim as tc
from thsa_cosim.errors import ScenarioError
from thsa_cosim.laws import published_law
from thsa_cosim.scenario import load

SCENARIOS = Path(__file__).parents[2] / "scenarios"
TEMPERATURES = np.linspace(-55.0, 22.0, 78)


def law_errors(scenario: str, folder: Path) -> dict[str, float]:
    """Largest deviation of each identified law from the rig's own, relative to the largest value of that."""
    found = tc.identify(
        SCENARIOS / f"{scenario}.toml", folder=folder / scenario, workers=1, quiet=True
    ).result
    assert found["trust"]["verdict"] == "explained"
    errors = {}
    for name, law in found["laws"].items():
        true = np.array([LAWS[name](t) for t in TEMPERATURES.tolist()])
        identified = published_law(law["form"], law["coefficients"])(TEMPERATURES)
        errors[name] = float(np.abs(identified - true).max() / np.abs(true).max())
    return errors


@pytest.mark.parametrize(
    "part", [pytest.param("screw", marks=pytest.mark.slow), pytest.param("motor", marks=pytest.mark.nightly)]
)
def test_laws_are_within_twice_the_errors_of_eight_plateaus(part: str, tmp_path: Path) -> None:
    campaign, warm = law_errors(part, tmp_path), law_errors(f"warm_up_{part}", tmp_path)
    assert set(warm) == set(campaign)
    print({name: (campaign[name], warm[name]) for name in warm})
    assert all(warm[name] < 2.0 * campaign[name] for name in warm)


def test_the_motor_of_the_recording_is_that_of_the_rig() -> None:
    """The generator's integration with fixed steps against Radau, at one temperature."""
    time = np.arange(301) * 0.02
    command = warm_up.plateaus(warm_up.SPEEDS, time, 1)
    found = warm_up.motor(command, np.full(time.shape, -30.0), NARROW)
    expected = simulate_motor(rig_at(-30.0), Wave(time, command, hold=True), time, NARROW, rtol=1e-8)
    for name, values in expected.items():
        assert np.abs(found[name] - values).max() < 1e-5 * np.ptp(values), name


def test_the_recording_lasts_20_minutes_and_warms_up() -> None:
    scenario = load(SCENARIOS / "warm_up_screw.toml")
    (recording,) = scenario.fit
    assert recording.signals.time[-1] - recording.signals.time[0] <= 1200.0
    off = recording.signals["T_amb"] - warm_up.temperature("screw", recording.signals.time)
    assert np.abs(off).max() < 0.1
    assert [p.temperature_degC for p in scenario.points] == [None]
    assert len(scenario.parameters) == 4 + 3
    assert not [f for f in scenario.data.findings if f.kind == "temperature-drift"]


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ('smooth = "piecewise-linear"', 'smooth = "mean"', "stays between"),
        ('form = "cubic", published = [2.7e3, 37.0, -1.4, -0.07]', 'form = "vogel"', "needs one of constant"),
        ('law_block = "nut.F_fn"\n', "", "needs the TemperatureLaw block"),
        ('input = "T_amb"', 'column = "screw_temperature_degC"\nunit = "degC"', "needs temperature.input"),
    ],
)
def test_what_cannot_be_searched_as_a_law_is_refused(
    before: str, after: str, said: str, tmp_path: Path
) -> None:
    text = (SCENARIOS / "warm_up_screw.toml").read_text()
    assert before in text
    text = text.replace(before, after, 1).replace('"recordings/', f'"{SCENARIOS}/recordings/')
    file = tmp_path / "own.toml"
    file.write_text(text.replace('"../fmus/', f'"{SCENARIOS.parent}/fmus/'))
    with pytest.raises(ScenarioError, match=said):
        load(file)
