"""The separating experiment on a plant in closed form: within what the rig can run, and where rivals differ most."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from thsa_cosim.batch import Experiment, Job, Outcome, Status
from thsa_cosim.costs.channels import Channel
from thsa_cosim.diagnosis.explaining import experiment as room
from thsa_cosim.diagnosis.explaining.profiles import Range, input_range, profiles, travel
from thsa_cosim.diagnosis.fitting.trials import Trial
from thsa_cosim.signals import Signals
from thsa_cosim.study import Case

TIME = np.arange(8001) * 1e-3
NOISE = 0.05
Force = Callable[[Signals], np.ndarray]


def recorded() -> Signals:
    """Speeds to 9 mm/s at 30 mm/s2, loads from -10 to 50 kN at 200 kN/s."""
    speed = np.interp(TIME, [1.0, 1.3, 3.0, 3.6, 5.3, 5.6], [0.0, 9e-3, 9e-3, -9e-3, -9e-3, 0.0])
    load = np.interp(TIME, [2.0, 2.3, 6.0, 6.2], [-10e3, 50e3, 50e3, 10e3])
    return Signals(
        TIME,
        {"v_cmd": speed, "F_load": load, "T_amb": np.full(TIME.size, -20.0)},
        {"v_cmd": "m/s", "F_load": "N", "T_amb": "degC"},
    )


def trial() -> Trial:
    channel = Channel("i_q", TIME, np.zeros(TIME.size), NOISE)
    measured = Signals(TIME, {"i_q": np.zeros(TIME.size)}, {"i_q": "A"})
    case = Case("fit_1", Path("rig.fmu"), recorded(), TIME, {}, (channel,), measured, -20.0, None)
    return Trial(case, "fit", "-20 degC")


@dataclass(frozen=True)
class Rig:
    """Runs jobs in closed form: ``i_q`` is the force of the rival that a job names."""

    experiments: Sequence[Experiment]
    forces: Mapping[float, Force]
    broken: str = ""

    def __enter__(self) -> "Rig":
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def run(self, jobs: Sequence[Job]) -> list[Outcome]:
        inputs = {e.name: e.inputs for e in self.experiments}
        outcomes = []
        for job in jobs:
            own = inputs[job.experiment]
            assert own is not None
            if self.broken and self.broken in job.experiment:
                outcomes.append(Outcome(Status.CRASH, "broken", None, None, 0.0, ""))
                continue
            found = Signals(own.time, {"i_q": self.forces[job.values["rival"]](own)})
            outcomes.append(Outcome(Status.OK, "", found, None, 0.0, ""))
        return outcomes


def scored(name: str, number: float, residual: np.ndarray) -> Any:
    unknowns = SimpleNamespace(assignments=lambda vector, group: {"rival": number})
    fit = SimpleNamespace(unknowns=unknowns, vector=np.zeros(1), residual=residual)
    return SimpleNamespace(candidate=SimpleNamespace(name=name, effect=SimpleNamespace(name=name)), fit=fit)


def find(monkeypatch: pytest.MonkeyPatch, other: Force, **changed: Any) -> Any:
    """The experiment between a rival without force and one with ``other``."""
    still: Force = lambda s: np.zeros(s.time.size)  # noqa: E731
    broken = changed.pop("broken", "")

    def open_runner(_: Any, experiments: Any) -> Any:
        return Rig(experiments, {1.0: still, 2.0: other}, broken)

    winner = scored("windage", 1.0, np.zeros(TIME.size))
    rival = scored("stribeck:screw", 2.0, np.full(TIME.size, 0.5))
    attribution = SimpleNamespace(
        rounds=(SimpleNamespace(accepted=winner, scored=(winner, rival), rivals=(), factors=np.ones(1)),),
        accepted=(winner,),
    )
    spec = SimpleNamespace(command="v_cmd", load="F_load")
    given = {"found": attribution, "spec": spec} | changed
    scenario = SimpleNamespace(simulation=None)
    return room.separating_experiment(scenario, given["spec"], given["found"], [trial()], open_runner)  # type: ignore[arg-type]


def slow(inputs: Signals) -> np.ndarray:
    """Friction at creep only."""
    speed = np.abs(inputs["v_cmd"])
    return np.where((speed > 1e-4) & (speed < 1.5e-3), 0.2, 0.0)


def loaded(inputs: Signals) -> np.ndarray:
    return 1e-5 * inputs["F_load"] * np.sign(inputs["v_cmd"])


def test_it_moves_where_the_rivals_differ(monkeypatch: pytest.MonkeyPatch):
    assert "creep" in find(monkeypatch, slow).name or "triangle" in find(monkeypatch, slow).name
    assert find(monkeypatch, loaded).name.endswith("at the highest load")
    fast = find(monkeypatch, lambda s: np.where(np.abs(s["v_cmd"]) > 8.5e-3, 1.0, 0.0))
    assert fast.name.startswith(("reversals at full speed", "speeds from creep to full"))


def test_distances_are_in_variances_of_the_noise(monkeypatch: pytest.MonkeyPatch):
    best = find(monkeypatch, loaded)
    expected = np.sum((loaded(best.inputs) / NOISE) ** 2)
    assert best.distance == pytest.approx(expected)
    # 0.5 standard deviations at every sample of the recording, for as many samples as the experiment has
    assert best.present == pytest.approx(0.25 * best.inputs.time.size)
    assert best.rivals == ("windage", "stribeck:screw")


def test_inputs_keep_units_and_what_is_not_varied(monkeypatch: pytest.MonkeyPatch):
    best = find(monkeypatch, loaded)
    assert best.inputs.units == recorded().units
    np.testing.assert_array_equal(best.inputs["T_amb"], -20.0)
    assert np.median(np.diff(best.inputs.time)) == pytest.approx(1e-3)


def test_a_failed_simulation_only_costs_its_profile(monkeypatch: pytest.MonkeyPatch):
    whole = find(monkeypatch, loaded)
    without = find(monkeypatch, loaded, broken=whole.name)
    assert without.name != whole.name
    assert without.distance <= whole.distance


def test_a_tie_of_a_later_effect_is_separated_rather_than_the_first_one_from_its_runner_up(
    monkeypatch: pytest.MonkeyPatch,
):
    first, runner_up = (scored(n, k, np.zeros(TIME.size)) for n, k in (("backlash", 1.0), ("cogging", 1.0)))
    winner, rival = scored("windage", 1.0, np.zeros(TIME.size)), scored("stribeck", 2.0, np.ones(TIME.size))
    rounds = (
        SimpleNamespace(accepted=first, scored=(first, runner_up), rivals=(), factors=np.ones(1)),
        SimpleNamespace(accepted=winner, scored=(winner, rival), rivals=(rival,), factors=np.full(1, 2.0)),
    )
    best = find(monkeypatch, loaded, found=SimpleNamespace(rounds=rounds, accepted=(first, winner)))
    assert best.rivals == ("windage", "stribeck")
    assert best.present == pytest.approx(0.25 * best.inputs.time.size), "by the factors of its own round"
    dropped = SimpleNamespace(rounds=rounds, accepted=(first,))
    assert find(monkeypatch, loaded, found=dropped).rivals == ("backlash", "cogging")


def test_nothing_to_separate(monkeypatch: pytest.MonkeyPatch):
    alone = scored("windage", 1.0, np.zeros(TIME.size))
    for rounds in (
        (),
        (SimpleNamespace(accepted=None, scored=(), rivals=()),),
        (SimpleNamespace(accepted=alone, scored=(alone,), rivals=()),),
    ):
        accepted = tuple(r.accepted for r in rounds if r.accepted is not None)
        found = SimpleNamespace(rounds=rounds, accepted=accepted)
        assert find(monkeypatch, loaded, found=found) is None
    assert find(monkeypatch, loaded, spec=SimpleNamespace(command=None, load="F_load")) is None


def test_every_profile_is_one_that_the_rig_has_the_speed_load_rate_and_travel_for():
    signals = [recorded()]
    command, load = input_range(signals, "v_cmd"), input_range(signals, "F_load")
    assert (command.lowest, command.highest) == (-9e-3, 9e-3)
    assert command.rate == pytest.approx(30e-3)
    assert load.rate == pytest.approx(200e3)
    limit = travel(signals, "v_cmd")
    assert limit == pytest.approx(9e-3 * (1.7 + 0.3))  # one way, with its ramps
    menu = profiles(TIME, command, load, limit)
    assert len({p.name for p in menu}) == len(menu) >= 12
    for profile in menu:
        assert np.abs(profile.command).max() <= 9e-3 * (1 + 1e-9)
        assert profile.command[0] == 0.0
        assert profile.command[-1] == pytest.approx(0.0, abs=1e-4)
        position = np.cumsum(profile.command) * 1e-3
        assert np.ptp(position) <= 1.2 * limit + 1e-5
        assert profile.load is not None
        assert load.lowest - 1e-6 <= profile.load.min() <= profile.load.max() <= load.highest + 1e-6
        assert np.abs(np.diff(profile.load)).max() <= load.rate * 1e-3 * (1 + 1e-6)
        if "sine" not in profile.name:
            assert np.abs(np.diff(profile.command)).max() <= command.rate * 1e-3 * (1 + 1e-6)


def test_a_rig_without_room_or_load_gets_fewer_profiles():
    command = Range(-9e-3, 9e-3, 30e-3)
    free = profiles(TIME, command, None, 1.0)
    assert all(p.load is None for p in free)
    assert len(profiles(TIME, command, None, 2e-3)) < len(free)
    assert profiles(TIME, command, Range(5.0, 5.0, 0.0), 1.0)[0].load is not None
    assert replace(command, lowest=2e-3).reach == 9e-3
