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
from thsa_cosim.diagnosis.fitting.unknowns import Unknown, Unknowns
from thsa_cosim.scenario.diagnose_schema import LimitsTable
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
            force = job.values["k"] * self.forces[job.values["rival"]](own)
            found = Signals(own.time, {"i_q": force + job.values["c"] * np.sign(own["v_cmd"])})
            outcomes.append(Outcome(Status.OK, "", found, None, 0.0, ""))
        return outcomes


def scored(name: str, number: float, residual: np.ndarray, known: float = 1e12) -> Any:
    """A model whose force a job names by ``number``, and whose friction ``c`` the recordings know so well."""
    friction = Unknown("c", "c", "A", 0.0, np.inf, 1.0, -9.0, 9.0)
    size = Unknown("k", "k", "1", 1.0, np.inf, 1.0, -9.0, 9.0, declared=False)
    unknowns = Unknowns((friction, size))
    assigned = lambda vector, group: {"rival": number, "c": vector[0], "k": vector[1]}  # noqa: E731
    fit = SimpleNamespace(
        unknowns=SimpleNamespace(
            assignments=assigned,
            members=unknowns.members,
            names=unknowns.names,
            scale=unknowns.scale,
            clip=unknowns.clip,
            named=unknowns.named,
            index=unknowns.index,
        ),
        vector=np.array([0.0, 1.0]),
        residual=residual,
        information=np.diag([known, 1e12]),
    )
    own = SimpleNamespace(name="k", variable="k", neutral=0.0, fixed=False)
    candidate = SimpleNamespace(
        name=name,
        effect=SimpleNamespace(name=name),
        parameters=(own,),
        coefficients=(own,),
        variant=object(),
        slot=SimpleNamespace(name="motor", is_angular=True),
    )
    return SimpleNamespace(candidate=candidate, fit=fit, proposal=SimpleNamespace(shapes={}))


def find(monkeypatch: pytest.MonkeyPatch, other: Force, **changed: Any) -> Any:
    """The experiment between a rival without force and one with ``other``."""
    still: Force = lambda s: np.zeros(s.time.size)  # noqa: E731
    broken, mine, known = changed.pop("broken", ""), changed.pop("mine", still), changed.pop("known", 1e12)
    limits = changed.pop("limits", LimitsTable())

    def open_runner(_: Any, experiments: Any) -> Any:
        return Rig(experiments, {1.0: mine, 2.0: other}, broken)

    left = changed.pop("left", np.zeros(TIME.size))
    winner = scored("windage", 1.0, left, changed.pop("own", 1e12))
    rival = scored("stribeck:screw", 2.0, np.full(TIME.size, 0.5), known)
    attribution = SimpleNamespace(
        rounds=(
            SimpleNamespace(accepted=winner, scored=(winner, rival), rivals=(rival,), factors=np.ones(1)),
        ),
        accepted=(winner,),
    )
    spec = SimpleNamespace(command="v_cmd", load="F_load", limits=limits)
    given = {"found": attribution, "spec": spec, "stated": {}} | changed
    scenario = SimpleNamespace(simulation=None)
    return room.separating_experiment(
        scenario,  # type: ignore[arg-type]
        given["spec"],
        given["found"],
        [trial()],
        given["stated"],
        open_runner,
    )


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
    assert best.expected == pytest.approx(expected, rel=1e-3), (
        "the recordings know too well what could imitate it"
    )
    assert best.separates
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


def dragging(inputs: Signals) -> np.ndarray:
    """What a constant friction imitates, but at creep."""
    return 0.5 * np.sign(inputs["v_cmd"]) + slow(inputs)


def test_what_a_rival_imitates_once_it_is_fitted_does_not_count(monkeypatch: pytest.MonkeyPatch):
    sure, open_ = (find(monkeypatch, dragging, known=known) for known in (1e12, 1e-6))
    assert sure.expected == pytest.approx(sure.distance, rel=1e-3)
    assert open_.expected < 0.5 * open_.distance
    assert open_.expected > 36.0, "creep is left"
    only = find(monkeypatch, lambda s: 0.5 * np.sign(s["v_cmd"]), known=1e-6)
    assert only.expected < 1.0
    assert not only.separates


def test_the_rival_may_be_the_true_one(monkeypatch: pytest.MonkeyPatch):
    """What the accepted effect imitates once it is fitted to the rival's outputs does not count either."""
    free = find(monkeypatch, dragging, own=1e-6)
    assert free.expected < 0.5 * free.distance
    assert free.expected > 36.0, "creep is left"


def test_a_profile_that_settles_comes_before_a_larger_gap_that_does_not():
    settles, sure, large = (
        room._worth(gap, wanted) for gap, wanted in ((70.0, 30.0), (90.0, 30.0), (400.0, 900.0))
    )
    assert sure > settles > large > room._worth(300.0, 900.0)


def test_one_law_under_two_names_is_separated_by_nothing(monkeypatch: pytest.MonkeyPatch):
    judged: list[str] = []
    whole = room._Plan._judged

    def counted(plan: Any, ran: Any) -> Any:
        judged.append(ran.profile.name)
        return whole(plan, ran)

    monkeypatch.setattr(room._Plan, "_judged", counted)
    best = find(monkeypatch, loaded, mine=loaded)
    assert best.rivals == ("windage", "stribeck:screw")
    assert best.expected == 0.0
    assert not best.separates
    assert judged == [best.name], "fitted, they would only come nearer"
    find(monkeypatch, slow)
    assert len(judged) == 1 + room.JUDGED


def test_what_separates_little_of_what_the_effect_does_is_not_counted_on(monkeypatch: pytest.MonkeyPatch):
    """0.1 A at every sample is many standard deviations, but 2 % of what the effect does, whose model leaves more."""
    strong: Force = lambda s: 5.0 * np.cos(s.time)  # noqa: E731
    near = find(monkeypatch, lambda s: 4.9 * np.cos(s.time), mine=strong, left=np.sin(TIME))
    assert near.expected > 1000.0
    assert not near.separates
    assert find(monkeypatch, lambda s: 4.9 * np.cos(s.time), mine=strong).separates, (
        "noise is all that it leaves"
    )
    assert not find(monkeypatch, lambda s: 4.99 * np.cos(s.time), mine=strong).separates, "not to be seen"
    assert find(monkeypatch, lambda s: 2.0 * np.cos(s.time), mine=strong).separates


def test_it_keeps_the_rigs_limits_of_inputs_outputs_and_time(monkeypatch: pytest.MonkeyPatch):
    limits = LimitsTable(time=4.0, range={"F_load": (0.0, 2e4), "v_cmd": (-5e-3, 5e-3)}, rate={"v_cmd": 0.01})
    best = find(monkeypatch, loaded, limits=limits)
    assert best.inputs.time[-1] == pytest.approx(4.0)
    assert best.inputs["F_load"].max() <= 2e4
    assert np.abs(best.inputs["v_cmd"]).max() <= 5e-3
    assert best.reached["i_q"] == (0.0, 0.0), "of the accepted effect, which has no force"
    tight = find(monkeypatch, loaded, mine=loaded, limits=LimitsTable(range={"i_q": (-0.2, 0.2)}))
    assert max(map(abs, tight.reached["i_q"])) <= 0.2
    assert find(monkeypatch, dragging, limits=LimitsTable(range={"i_q": (-0.4, 0.4)})) is None


def test_an_output_stays_near_what_was_recorded(monkeypatch: pytest.MonkeyPatch):
    own = trial()
    (channel,) = own.case.channels
    plan = SimpleNamespace(
        fit=[
            replace(own, case=replace(own.case, channels=(replace(channel, measured=np.array([-1.0, 2.0])),)))
        ],
        spec=SimpleNamespace(limits=LimitsTable()),
    )
    assert room._Plan._limits(plan, "i_q") == pytest.approx((-1.6, 2.6))  # type: ignore[arg-type]
    plan.spec.limits = LimitsTable(range={"i_q": (-3.0, 3.0)})
    assert room._Plan._limits(plan, "i_q") == (-3.0, 3.0)  # type: ignore[arg-type]


def test_a_tie_of_a_later_effect_is_separated_rather_than_the_first_one_sharpened(
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
    assert find(monkeypatch, loaded, found=dropped).rivals == ("backlash",)


def test_a_tie_between_the_shafts_of_a_gear_is_left_for_one_that_a_profile_may_separate(
    monkeypatch: pytest.MonkeyPatch,
):
    winner, other = (
        scored("windage:motor", 1.0, np.zeros(TIME.size)),
        scored("stribeck", 2.0, np.ones(TIME.size)),
    )
    twin = scored("windage:gearbox", 1.0, np.zeros(TIME.size))
    twin.candidate.variant, twin.candidate.slot.name = winner.candidate.variant, "gearbox"
    later = scored("backlash", 1.0, np.zeros(TIME.size))

    def one(accepted: Any, *rivals: Any) -> SimpleNamespace:
        return SimpleNamespace(accepted=accepted, scored=(accepted,), rivals=rivals, factors=np.ones(1))

    both = SimpleNamespace(rounds=(one(winner, twin, other),), accepted=(winner,))
    best = find(monkeypatch, loaded, found=both)
    assert best.rivals == ("windage:motor", "stribeck")
    assert best.separates
    after = SimpleNamespace(rounds=(one(winner, twin), one(later, other)), accepted=(winner, later))
    assert find(monkeypatch, loaded, found=after).rivals == ("backlash", "stribeck")
    alone = SimpleNamespace(rounds=(one(winner, twin),), accepted=(winner,))
    best = find(monkeypatch, loaded, found=alone)
    assert best.rivals == ("windage:motor", "windage:gearbox")
    assert not best.separates


def test_without_a_tie_the_least_certain_value_is_made_surer(monkeypatch: pytest.MonkeyPatch):
    """The amplitude k of a force in proportion to the load: its error falls as the squared force adds up."""
    winner = scored("load-dependent-friction", 1.0, np.zeros(TIME.size))
    winner.fit.information = np.diag([1e12, 25.0])
    one = SimpleNamespace(accepted=winner, scored=(winner,), rivals=(), factors=np.ones(1))
    found = SimpleNamespace(rounds=(one,), accepted=(winner,))
    best = find(monkeypatch, slow, mine=loaded, found=found)
    assert best.rivals == ("load-dependent-friction",)
    assert best.sharpens.variable == "k"
    assert best.sharpens.before == pytest.approx(0.2)
    gained = np.sum((loaded(best.inputs) / NOISE) ** 2)
    assert best.sharpens.after == pytest.approx((25.0 + gained) ** -0.5, rel=1e-3)
    assert "at the highest load" in best.name
    for stated, expected in ((0.7, 0.7), (np.inf, 0.2)):
        again = find(monkeypatch, slow, mine=loaded, found=found, stated={"k": stated}).sharpens
        assert again.before == pytest.approx(expected), (
            "the error that the result states, where it states one"
        )
        assert again.ratio == pytest.approx(best.sharpens.ratio)
    winner.fit.vector = np.array([1.0, 0.0])
    assert find(monkeypatch, slow, mine=loaded, found=found).sharpens.variable == "k", "a value of zero"


def test_nothing_to_separate(monkeypatch: pytest.MonkeyPatch):
    for rounds in (
        (),
        (SimpleNamespace(accepted=None, scored=(), rivals=()),),
    ):
        accepted = tuple(r.accepted for r in rounds if r.accepted is not None)
        found = SimpleNamespace(rounds=rounds, accepted=accepted)
        assert find(monkeypatch, loaded, found=found) is None
    assert (
        find(monkeypatch, loaded, spec=SimpleNamespace(command=None, load="F_load", limits=LimitsTable()))
        is None
    )


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
