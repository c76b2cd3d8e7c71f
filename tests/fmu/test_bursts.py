"""A burst of events that rounding noise makes ends: steps then grow to the length that the tolerance allows."""

from pathlib import Path

import pytest
from courses import noted_courses

from thsa_cosim.fmu import Plant
from thsa_cosim.scenario import load
from thsa_cosim.simulate import _cases

SCENARIO = Path(__file__).parents[2] / "scenarios" / "driven_check.toml"


def test_grazing_events_of_the_driven_check_do_not_leave_blind_steps_behind(monkeypatch):
    runs = noted_courses(monkeypatch)
    for recording, _, experiment in _cases(load(SCENARIO)):
        with Plant.open(experiment.fmu, stepping="free") as plant:
            plant.run(
                experiment.fixed,
                experiment.inputs,
                experiment.outputs,
                experiment.time,
                tolerance=experiment.tolerance,
            )
        # about 1,000 for 17 to 20 s; 209,000 where the burst at 20.2149 s of the third is never left
        assert runs[-1].steps == pytest.approx(950, abs=550), recording.name
