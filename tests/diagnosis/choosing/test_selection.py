"""What is refined, what counts as another place, and which rivals these recordings cannot tell from the winner."""

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from thsa_cosim.diagnosis.catalogue.candidate import candidates_of
from thsa_cosim.diagnosis.catalogue.known import known_effects
from thsa_cosim.diagnosis.catalogue.slots import Slot
from thsa_cosim.diagnosis.choosing import selection as room
from thsa_cosim.diagnosis.choosing.selection import (
    Selection,
    other_laws,
    other_places,
    other_waves,
    worth_refining,
)
from thsa_cosim.diagnosis.fitting.unknowns import Unknown, Unknowns, unknowns_of


def proposal(effect: str, gain: float, place: str = "motor", variant: str = "x") -> Any:
    candidate = SimpleNamespace(
        effect=SimpleNamespace(name=effect),
        name=f"{effect}:{place}",
        key=f"{effect}:{place}/{variant}",
        slot=SimpleNamespace(name=place),
        component=effect,
        coefficients=(None,),
        shapes=(),
    )
    return SimpleNamespace(candidate=candidate, gain=gain, label=f"{effect}:{place}", shapes={})


def test_the_best_two_starts_of_the_best_six_effects_are_refined():
    made = [proposal(f"e{k}", 1000.0 - k) for k in range(8)]
    assert worth_refining(made, 17.0) == made[:6]
    several = [proposal("a", 100.0), proposal("a", 99.0), proposal("a", 98.0), proposal("b", 97.0)]
    assert worth_refining(several, 17.0) == [several[0], several[1], several[3]]
    late = [*made[:6], proposal("e0", 900.0), proposal("e7", 900.0)]
    assert worth_refining(late, 17.0) == late[:7], "a further start of an effect that is in"
    later = [*made[:7], proposal("e0", 900.0)]
    assert worth_refining(later, 17.0) == [*made[:6], later[7]], "behind an effect that is not"


def test_variants_that_begin_as_one_law_are_one_start():
    """Else a further parameter, which does nothing yet, takes the start of the same effect in another place."""
    alike = [
        proposal("a", 100.0),
        proposal("a", 99.95, variant="y"),
        proposal("a", 60.0, "gearbox"),
        proposal("a", 59.0, "gearbox", "y"),
    ]
    assert worth_refining(alike, 17.0) == alike[:3]
    elsewhere = [proposal("a", 100.0), proposal("a", 99.95, "gearbox"), proposal("a", 99.9, "screw")]
    assert worth_refining(elsewhere, 17.0) == elsewhere[:2], "another place is another law"
    again = [proposal("a", 100.0), proposal("a", 99.99), proposal("a", 99.98)]
    assert worth_refining(again, 17.0) == again[:2], "so is another shape of one variant"


def test_what_promises_no_more_than_chance_or_little_beside_the_best_is_not_refined():
    made = [proposal("a", 1000.0), proposal("b", 30.0), proposal("c", 29.9)]
    assert worth_refining(made, 17.0) == made[:2]
    assert worth_refining(made, 30.1) == made[:1]
    assert worth_refining(made[1:], 29.9) == made[1:]
    assert worth_refining(made, 2000.0) == []
    assert worth_refining([], 17.0) == []


def test_other_places_are_those_of_the_same_effect_that_promise_nearly_as_much():
    winner = proposal("a", 100.0)
    gear, again, nut = proposal("a", 30.0, "gear"), proposal("a", 99.0, "gear"), proposal("a", 29.9, "nut")
    proposals = [winner, again, proposal("b", 99.0, "gear"), gear, nut, proposal("a", 98.0)]
    assert other_places(winner, proposals) == [again]
    assert other_places(winner, [gear, nut]) == [gear]


def test_ripples_at_other_wave_numbers_are_those_that_promise_a_tenth_of_the_best():
    def ripple(gain: float, scanned: bool = True) -> Any:
        own = proposal("cogging", gain)
        own.candidate.shapes = (SimpleNamespace(scanned=scanned, fixed=False),)
        return own

    made = [ripple(100.0), ripple(90.0), ripple(80.0, scanned=False), ripple(10.0), ripple(9.9)]
    refined: Any = [SimpleNamespace(proposal=made[1])]
    assert other_waves(made, refined) == [made[0], made[3]]
    assert other_waves([], refined) == []
    assert len(other_waves([ripple(100.0 - k) for k in range(20)], [])) == room.WAVES


def test_a_law_that_was_left_out_of_an_effect_that_was_refined_has_its_best_start():
    def law(effect: str, key: str, gain: float) -> Any:
        own = proposal(effect, gain)
        own.candidate.key = key
        return own

    wave, other, rise, ramp = (
        law("a", "w", 100.0),
        law("a", "x", 90.0),
        law("a", "r", 30.0),
        law("a", "l", 9.9),
    )
    made = [wave, law("a", "w", 95.0), other, law("b", "b", 80.0), rise, law("a", "r", 20.0), ramp]
    refined: Any = [SimpleNamespace(candidate=p.candidate) for p in (wave, other)]
    assert other_laws(made, refined) == [rise], "of no other effect, and nothing that promises little"
    assert other_laws(made, []) == []
    assert other_laws([], refined) == []
    many = [law("a", f"k{k}", 100.0 - k) for k in range(20)]
    assert len(other_laws(many, refined)) == room.LAWS


N = 4000
TIME = np.arange(N) * 5e-3
CHANNEL = SimpleNamespace(name="v", measured=np.zeros(N), time=TIME, noise=1.0, weight=1.0)
TRIALS: Any = (
    SimpleNamespace(case=SimpleNamespace(channels=(CHANNEL,), measured=SimpleNamespace(units={"v": "m/s"}))),
)
SMOOTH = 10.0 * np.sin(TIME)
NOISE = np.random.default_rng(8).standard_normal(N)
HELD = SMOOTH + NOISE


def scored(effect: str, left: float, place: str = "motor") -> Any:
    """A candidate that leaves this share of the structure on the held-out recordings."""
    validate = left * SMOOTH + NOISE
    gain = float(HELD @ HELD - validate @ validate)
    own = proposal(effect, gain, place)
    return SimpleNamespace(
        proposal=own,
        candidate=own.candidate,
        validate=validate,
        fit=SimpleNamespace(
            residual=validate,
            cost=float(validate @ validate),
            misfit=float(validate @ validate),
            vector=np.zeros(1),
            unknowns=SimpleNamespace(is_far=lambda _: False),
        ),
        held_out_gain=gain,
        fit_gain=gain,
    )


def left_in_the_fit(own: Any, residual: np.ndarray) -> Any:
    own.fit.residual, own.fit.cost, own.fit.misfit = residual, *[float(residual @ residual)] * 2
    return own


@pytest.fixture
def selection(monkeypatch: pytest.MonkeyPatch) -> Selection:
    """A round whose candidates are fitted already."""
    monkeypatch.setattr(room, "polish", lambda bench, one, *_given: one)
    monkeypatch.setattr(room, "go_on", lambda bench, one, *_given: one)
    roles = {"fit": TRIALS, "validate": TRIALS}
    bench: Any = SimpleNamespace(
        of=roles.__getitem__, factors={"fit": np.ones(N)}.__getitem__, level=lambda _: 1.0
    )
    weights: Any = SimpleNamespace(base_held=HELD, plain=lambda residual, part: residual, left=lambda _: 1.0)
    current: Any = SimpleNamespace(residual=HELD)
    return Selection(bench, weights, current, HELD)


class Fits:
    """Stands for `score`: the gain of each candidate's fit, and the structure that it leaves."""

    def __init__(
        self, monkeypatch: pytest.MonkeyPatch, selection: Selection, **made: tuple[float, float]
    ) -> None:
        self.made, self.tried, self.continued, self.left = made, [], [], {}  # type: ignore[var-annotated]
        self.selection = selection
        monkeypatch.setattr(room, "score", self.score)
        monkeypatch.setattr(room, "go_on", self.go_on)
        monkeypatch.setattr(selection.weights, "left", lambda validate: self.left[id(validate)])

    def score(self, bench: Any, current: Any, held: Any, own: Any) -> Any:
        assert (bench, current) == (self.selection.bench, self.selection.current)
        assert held is self.selection.held
        name = own.candidate.effect.name
        self.tried.append(f"{name}{own.gain:g}")
        if name not in self.made:
            return None
        gain, left = self.made[name]
        found = SimpleNamespace(
            proposal=own, candidate=own.candidate, validate=NOISE.copy(), fit_gain=gain, held_out_gain=gain
        )
        self.left[id(found.validate)] = left
        return found

    def go_on(self, bench: Any, one: Any, *_: Any) -> Any:
        self.continued.append(one.candidate.effect.name)
        return one


def names(found: tuple[Any, ...]) -> list[str]:
    return [s.candidate.name for s in found]


LEAST = room.SMALLEST_STRUCTURE**2


@pytest.mark.parametrize(
    ("gain", "left", "tried"),
    [
        (100.0, 0.99 * LEAST, ["a100", "c31", "d30"]),  # solved: 30 % of its gain, or it is no rival
        (200.0, 0.99 * LEAST, ["a100"]),  # its gain is what it is, not what was promised,
        (50.0, 0.99 * LEAST, ["a100", "c31", "d30"]),  # or what was promised, if that is more
        (100.0, LEAST, ["a100", "b29", "c31", "d30"]),
        (100.0, 0.15, ["a100", "b29", "c31", "d30"]),  # there is more to explain
    ],
)
def test_once_an_effect_leaves_nothing_only_what_promises_nearly_as_much_is_refined(
    selection: Selection, monkeypatch: pytest.MonkeyPatch, gain: float, left: float, tried: list[str]
):
    fits = Fits(monkeypatch, selection, a=(gain, left))
    promised = [proposal(name, g) for name, g in (("a", 100.0), ("b", 29.0), ("c", 31.0), ("d", 30.0))]
    selection.refined(promised, 17.0)
    assert fits.tried == tried


def test_of_two_that_leave_nothing_the_better_one_sets_the_bar(
    selection: Selection, monkeypatch: pytest.MonkeyPatch
):
    fits = Fits(monkeypatch, selection, a=(100.0, 0.0), b=(40.0, 0.0))
    selection.refined([proposal("a", 100.0), proposal("b", 40.0), proposal("c", 29.0)], 17.0)
    assert fits.tried == ["a100", "b40"]
    little = Fits(monkeypatch, selection)
    assert selection.refined([proposal("a", 0.2)], 0.1) == []
    assert little.tried == ["a0.2"]


def test_those_that_come_near_the_best_in_two_iterations_are_refined_further_and_the_best_comes_first(
    selection: Selection, monkeypatch: pytest.MonkeyPatch
):
    fits = Fits(monkeypatch, selection, a=(30.0, 1.0), b=(100.0, 1.0), c=(31.0, 1.0))
    found = selection.refined([proposal("a", 90.0), proposal("b", 80.0), proposal("c", 70.0)], 17.0)
    assert fits.continued == ["b", "c"]
    assert names(tuple(found)) == ["b:motor", "c:motor", "a:motor"]


def test_the_simpler_form_comes_first_if_it_explains_as_much(
    selection: Selection, monkeypatch: pytest.MonkeyPatch
):
    Fits(monkeypatch, selection, a=(100.0, 1.0))
    full, simple = proposal("a", 90.0), proposal("a", 80.0)
    full.candidate.coefficients = (None, None)
    assert [s.proposal for s in selection.refined([full, simple], 17.0)] == [simple, full]
    assert [s.proposal for s in selection.refined_further([], [full, simple], [], 17.0)] == []
    better = proposal("a", 100.0)
    better.candidate.key = simple.candidate.key = "a:motor/y"
    first = selection.refined([full], 17.0)
    assert [s.proposal for s in selection.refined_further(first, [full, simple], [better], 17.0)] == [
        better,
        full,
    ]


def test_further_starts_are_refined_that_promise_more_than_all_before(
    selection: Selection, monkeypatch: pytest.MonkeyPatch
):
    fits = Fits(monkeypatch, selection, a=(100.0, 1.0), c=(50.0, 1.0))
    before = [proposal("a", 100.0), proposal("a", 50.0), proposal("b", 20.0), proposal("c", 10.0)]
    further = [proposal("a", 105.0), proposal("a", 60.0), proposal("c", 19.0), proposal("b", 21.0)]
    assert selection.refined_further([], before, further, 17.0)[0].candidate.name == "c:motor"
    assert fits.tried == ["c19"]
    ripple = proposal("d", 12.0)
    ripple.candidate.shapes = (SimpleNamespace(scanned=True, fixed=False),)
    selection.refined_further([], [*before, ripple], [proposal("a", 105.1), proposal("c", 19.0)], 17.0)
    assert fits.tried[1:] == ["a105.1", "c19", "d12"]
    small = Fits(monkeypatch, selection)
    selection.refined_further([], [proposal("a", 0.5)], [proposal("a", 0.6)], 0.1)
    assert small.tried == ["a0.6"]


def test_a_start_that_a_search_came_by_twice_is_fitted_once(
    selection: Selection, monkeypatch: pytest.MonkeyPatch
):
    fits = Fits(monkeypatch, selection, a=(100.0, 1.0), b=(50.0, 1.0))
    speeds = {120.0: 2e-3, 119.0: 2e-3 * (1.0 + 1e-15), 118.0: 2.01e-3}
    further = [proposal("a", 120.0), proposal("a", 119.0), proposal("b", 118.0), proposal("b", 117.0)]
    for p in further:
        p.shapes = {"v_S": speeds.get(p.gain, 2.02e-3)}
    selection.refined_further([], [proposal("a", 100.0), proposal("b", 100.0)], further, 17.0)
    assert fits.tried == ["a120", "b118", "b117"]


def test_what_is_seen_beside_an_effect_is_part_of_its_evidence(selection: Selection):
    for left, visible in ((0.0, False), (0.5, True)):
        one = scored("a", left)
        one.consistency, one.share = 5.0, 1.0 - left**2
        found = selection.evidence(one)
        assert (found.visible, found.was_visible) == (visible, True)
        assert found.signal_share == pytest.approx(1.0 - left**2, abs=0.01)
        assert (found.left, found.consistency, found.share) == (1.0, 5.0, one.share)


def test_what_reaches_nine_tenths_of_the_gain_is_fitted_with_all_parameters_to_be_compared(
    selection: Selection, monkeypatch: pytest.MonkeyPatch
):
    polished = []
    monkeypatch.setattr(
        room, "polish", lambda bench, one, *_given: polished.append(one.candidate.name) or one
    )
    winner, just, less = scored("a", 0.0), scored("b", 0.0), scored("c", 0.0)
    winner.held_out_gain, just.held_out_gain, less.held_out_gain = 100.0, 90.0, 89.9
    assert names(selection.rivals(winner, [winner, just, less], ())) == ["b:motor"]
    assert polished == ["b:motor"]


def test_what_leaves_as_little_is_a_rival(selection: Selection):
    winner = scored("a", 0.0)
    made = [winner, scored("b", 0.01), scored("c", 0.2), scored("d", 0.5)]
    assert names(selection.rivals(winner, made, ())) == ["b:motor"]


def test_what_leaves_a_little_more_in_every_block_is_none_unless_it_hardly_matters(selection: Selection):
    winner = scored("a", 0.0)
    # The share of the gain that is left is the square: half a percent is at 0.0707.
    for left, rivals in ((0.06, ["b:motor"]), (0.09, [])):
        other = left_in_the_fit(scored("b", left), NOISE)
        assert names(selection.rivals(winner, [other], ())) == rivals


def test_a_rival_that_is_better_than_the_winner_is_a_rival(selection: Selection):
    assert names(selection.rivals(scored("a", 0.09), [scored("b", 0.0)], ())) == ["b:motor"]


def test_of_several_that_drive_a_parameter_to_its_end_the_best_one_with_all_parameters_fitted_is_kept(
    selection: Selection, monkeypatch: pytest.MonkeyPatch
):
    """Another effect is still missing; what looked best with the declared parameters held is not what is best."""
    first, second, third = scored("a", 0.3), scored("b", 0.31), scored("c", 0.32)
    whole = {"a:motor": 0.3, "b:motor": 0.05, "c:motor": 0.2}

    def polished(bench: Any, one: Any, *_: Any) -> Any:
        found = scored(one.candidate.effect.name, whole[one.candidate.name])
        found.fit = SimpleNamespace()
        return found

    monkeypatch.setattr(room, "polish", polished)
    monkeypatch.setattr(room, "objection", lambda *_: "")
    monkeypatch.setattr(room, "insignificant", lambda _: "")
    monkeypatch.setattr(room, "out_of_range", lambda _: "b_m")
    monkeypatch.setattr(Selection, "evidence", lambda *_: SimpleNamespace(signal_share=1.0, share=1.0))
    choice, objections = selection.choose([first, second, third], 17.0, first=False)
    assert choice is not None
    assert choice.candidate.name == "b:motor"
    assert [o.split(":")[0] for o in objections] == ["a", "b", "c"]


@pytest.mark.parametrize(
    ("mine", "theirs", "better"),
    [
        (0.0, 0.06, True),  # 0.4 % of the gain, but the first leaves noise alone, the other 0.42 of its size
        (0.0, 0.01, False),  # 0.07 of it: not to be seen
        (0.06, 0.08, False),  # both are to be seen, and differ little beside the gain
        (0.06, 0.3, True),  # 9 % of the gain
    ],
)
def test_what_leaves_noise_alone_fits_better_than_what_leaves_a_little_of_a_large_gain(
    selection: Selection, mine: float, theirs: float, better: bool
):
    one, other = (
        left_in_the_fit(scored(n, 0.0), s * SMOOTH + NOISE) for n, s in (("a", mine), ("b", theirs))
    )
    assert selection.fits_better(one, other) is better
    assert not selection.fits_better(other, one)
    assert bool(selection.rivals(one, [other], ())) is not better


def test_of_two_that_fit_alike_the_one_that_needs_no_machine_far_off_its_drawing_is_believed(
    selection: Selection, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(room, "insignificant", lambda _: "")
    monkeypatch.setattr(room, "out_of_range", lambda _: "")
    near, off = scored("a", 0.0), scored("b", 0.0)
    off.fit.cost += 36.0
    assert names(selection.rivals(near, [off], ())) == ["b:motor"], "6 spreads in all, none of them far"
    off.fit.unknowns = SimpleNamespace(is_far=lambda vector: vector is off.fit.vector)
    assert selection.rivals(near, [off], ()) == ()
    assert selection.overtaking(off, [off, near]) is near
    assert selection.overtaking(near, [off, near]) is None
    near.fit.misfit *= 2.5
    assert names(selection.rivals(near, [off], ())) == ["b:motor"], "what is missing bends the parameters"
    near.fit.misfit /= 2.5
    near.fit.unknowns = SimpleNamespace(is_far=lambda _: True)
    assert names(selection.rivals(near, [off], ())) == ["b:motor"], "a brake drags under either"
    assert selection.overtaking(off, [off, near]) is None


def test_what_leaves_structure_is_not_believed_for_its_drawing(selection: Selection):
    fitting, drawn = scored("a", 0.0), left_in_the_fit(scored("b", 0.0), 0.3 * SMOOTH + NOISE)
    fitting.fit.unknowns = SimpleNamespace(is_far=lambda _: True)
    fitting.fit.cost = drawn.fit.cost + 100.0
    assert not selection.is_better(drawn, fitting)
    assert selection.is_better(fitting, drawn)


def test_a_lead_that_a_few_blocks_decide_is_chance(selection: Selection):
    winner, other = scored("a", 0.0), scored("b", 0.0)
    other.validate = NOISE + np.where((TIME > 3.0) & (TIME < 4.0), 0.9, 0.0) * SMOOTH
    lead = other.validate @ other.validate - winner.validate @ winner.validate
    assert float(lead) > 0.005 * winner.held_out_gain
    assert names(selection.rivals(winner, [other], ())) == ["b:motor"]


def test_a_better_fit_of_a_few_blocks_is_chance(selection: Selection):
    bump = np.where((TIME > 3.0) & (TIME < 4.0), 0.9, 0.0) * SMOOTH
    one, other = (left_in_the_fit(scored(n, 0.0), NOISE + more) for n, more in (("a", 0.0), ("b", bump)))
    assert not selection.fits_better(one, other)


@pytest.mark.parametrize(("lead", "better"), [(8.0, False), (10.0, True)])
def test_a_better_fit_is_worth_three_standard_errors_however_even(
    selection: Selection, lead: float, better: bool
):
    selection.current.residual = 1.01 * NOISE
    more = np.sqrt(1.0 + lead / (NOISE @ NOISE))
    one, other = (left_in_the_fit(scored(n, 0.0), k * NOISE) for n, k in (("a", 1.0), ("b", more)))
    assert selection.fits_better(one, other) is better


def test_what_a_fit_shows_is_seen_beside_the_noise_as_it_was_before_weighing(
    selection: Selection, monkeypatch: pytest.MonkeyPatch
):
    weight = 0.2
    monkeypatch.setattr(selection.bench, "factors", {"fit": np.full(N, weight)}.__getitem__)
    selection.current.residual = weight * HELD
    one, other = (
        left_in_the_fit(scored(n, 0.0), weight * (left * SMOOTH + NOISE))
        for n, left in (("a", 0.0), ("b", 0.06))
    )
    assert selection.fits_better(one, other)


def test_other_places_of_the_same_effect_are_rivals_and_effects_named_before_are_not(selection: Selection):
    winner = scored("a", 0.0)
    made = [winner, scored("a", 0.0), scored("a", 0.0, "gear"), scored("b", 0.0), scored("b", 0.0, "gear")]
    assert names(selection.rivals(winner, made, ())) == ["a:gear", "b:motor"]
    assert names(selection.rivals(winner, made, {"b"})) == ["a:gear"]


def test_places_that_were_not_refined_are_fitted_for_the_comparison(
    selection: Selection, monkeypatch: pytest.MonkeyPatch
):
    tried = []

    def fitted(bench: Any, current: Any, held: Any, one: Any) -> Any:
        assert (bench, current) == (selection.bench, selection.current)
        assert held is HELD
        tried.append(one.candidate.name)
        return None if one.candidate.name == "a:nut" else scored("a", 0.0, "gear")

    monkeypatch.setattr(room, "score", fitted)
    winner = scored("a", 0.0)
    proposals = [winner.proposal, proposal("a", 1e9, "gear"), proposal("a", 1e9, "nut"), proposal("b", 1e9)]
    found = selection.elsewhere(winner, [winner], proposals)
    assert names(tuple(found)) == ["a:gear"]
    assert tried == ["a:gear", "a:nut"]
    assert selection.elsewhere(winner, [winner, *found], proposals[:2]) == []


MOTOR = Slot("motor", "FrictionEffect", {"v": "rad/s", "z": "rad", "N": "N.m", "F": "N.m"})
GEARBOX = replace(MOTOR, name="gearbox")
NUT = Slot("screw", "FrictionEffect", {"v": "m/s", "z": "m", "N": "N", "F": "N"})
SCALES = {
    "motor": {"V": 300.0, "Z": 600.0, "D": 1e3, "F": 5.0},
    "gearbox": {
        "V": 10.0,
        "Z": 20.0,
        "D": 1e3 / 30.0,
        "F": 120.0,
    },  # more than 30 times: the gear's own friction
    "screw": {"V": 0.016, "Z": 0.03, "D": 0.05, "F": 5e4},
}
J = Unknown("J", "motor.J", "kg.m2", 2e-3, 1e-4, 1e-4, 0.0, 1.0)


@dataclass(frozen=True)
class _Vector:
    unknowns: Unknowns
    vector: np.ndarray


@dataclass(frozen=True)
class _Fitted:
    candidate: Any
    fit: _Vector


def fitted_at(effect: str, slot: Slot, number: int, **values: float) -> Any:
    """An effect at a place with its parameters at ``values``, beside J; every effect may act anywhere."""
    known = known_effects()[effect]
    anywhere = tuple(replace(v, slots=None) for v in known.variants)
    made = candidates_of([replace(known, variants=anywhere)], [MOTOR, GEARBOX, NUT], SCALES)
    candidate = next(c for c in made if c.slot.name == slot.name and c.number == number)
    unknowns = Unknowns((J, *unknowns_of(candidate, {p.name: p.at_start for p in candidate.parameters})))
    named = {f"{candidate.slot.component}.{candidate.component}.{k}": v for k, v in values.items()}
    vector = np.array([named.get(u.name, u.start) for u in unknowns.members])
    vector[0] = values.get("J", J.start)
    return _Fitted(candidate, _Vector(unknowns, vector))


def test_behind_a_gear_the_same_law_has_another_speed_and_the_torque_that_makes_the_same_power():
    winner = fitted_at("stribeck", GEARBOX, 0, dF=6.0, v_S=0.2, n=2.0, J=2.1e-3)
    other = fitted_at("stribeck", MOTOR, 0, dF=0.01, v_S=60.0, n=1.5)
    found: Any = room.geared(winner, other)  # type: ignore[arg-type]
    assert found.candidate is other.candidate
    assert found.fit.unknowns.named(found.fit.vector) == pytest.approx(
        {
            "J": 2.1e-3,
            "motorEffect.stribeck.dF": 0.2,
            "motorEffect.stribeck.v_S": 6.0,
            "motorEffect.stribeck.n": 2.0,
        }
    )
    back: Any = room.geared(found, winner)  # type: ignore[arg-type]
    assert back.fit.vector == pytest.approx(winner.fit.vector)


@pytest.mark.parametrize(
    ("effect", "number", "at_gear", "at_motor"),
    [
        ("position-friction", 1, {"c2": 6.0, "z_2": 2.0, "w_2": 0.5}, {"c2": 0.2, "z_2": 60.0, "w_2": 15.0}),
        ("friction-run-in", 0, {"dF": 6.0, "d_r": 3.0}, {"dF": 0.2, "d_r": 90.0}),
    ],
)
def test_a_law_over_angle_or_distance_is_geared_as_one_over_speed(
    effect: str, number: int, at_gear: dict[str, float], at_motor: dict[str, float]
):
    winner, other = fitted_at(effect, GEARBOX, number, **at_gear), fitted_at(effect, MOTOR, number)
    found: Any = room.geared(winner, other)  # type: ignore[arg-type]
    values = found.fit.unknowns.named(found.fit.vector)
    assert {name.rpartition(".")[2]: value for name, value in values.items()} == pytest.approx(
        {"J": J.start, **at_motor}
    )


def test_only_another_shaft_with_the_same_form_of_a_law_over_speed_or_angle_is_geared():
    winner = fitted_at("stribeck", GEARBOX, 0, dF=6.0, v_S=0.2)
    for other in (
        fitted_at("stribeck", GEARBOX, 0),
        fitted_at("stribeck", MOTOR, 1),
        fitted_at("stribeck", NUT, 0),
        fitted_at("friction-run-in", MOTOR, 0),
    ):
        assert room.geared(winner, other) is None  # type: ignore[arg-type]
    linear = fitted_at("asymmetric-friction", GEARBOX, 0), fitted_at("asymmetric-friction", MOTOR, 0)
    assert room.geared(*linear) is None  # type: ignore[arg-type]


def test_another_shaft_whose_fit_did_not_find_its_way_starts_from_the_winner_to_be_compared(
    selection: Selection, monkeypatch: pytest.MonkeyPatch
):
    winner, lost, foreign = scored("a", 0.0), scored("a", 0.5, "gear"), scored("b", 0.5)
    monkeypatch.setattr(room, "geared", lambda one, other: other if other is lost else None)
    monkeypatch.setattr(
        room, "polish", lambda bench, one, *_given: scored("a", 0.0, "gear") if one is lost else one
    )
    assert names(selection.rivals(winner, [winner, lost, foreign], ())) == ["a:gear"]
    assert names(selection.rivals(winner, [foreign, winner, lost], ())) == ["a:gear"], "in whatever order"


def test_effects_of_larger_sizes_join_what_was_refined_where_that_leads_astray(
    selection: Selection, monkeypatch: pytest.MonkeyPatch
):
    refined, larger = [scored("a", 0.3), scored("b", 0.4)], scored("c", 0.1)
    own = (selection.bench, selection.current, selection.held, ["offered"])
    monkeypatch.setattr(room, "at_sizes", lambda *given: [larger] if given == own else [])
    for astray, expected in ((True, ["c:motor", "a:motor", "b:motor"]), (False, ["a:motor", "b:motor"])):
        monkeypatch.setattr(room, "is_led_astray", lambda current, found, astray=astray: astray)
        offered: Any = ["offered"]
        assert names(tuple(selection.at_sizes(refined, offered))) == expected


@pytest.mark.parametrize(
    ("left", "is_open"), [(0.99 * LEAST, False), (LEAST, True), (2.0 * LEAST, True), (0.1, True), (1.0, True)]
)
def test_a_round_is_open_while_the_model_and_every_fit_leave_structure(
    selection: Selection, monkeypatch: pytest.MonkeyPatch, left: float, is_open: bool
):
    lefts = {id(HELD): 1.0}
    monkeypatch.setattr(selection.weights, "left", lambda held: lefts[id(held)])
    more, one = scored("a", 0.3), scored("b", 0.1)
    lefts[id(more.validate)], lefts[id(one.validate)] = 1.0, left
    assert selection.is_open([])
    assert selection.is_open([more, one]) is is_open
    assert selection.is_open([one, more]) is is_open
    lefts[id(HELD)] = left
    assert selection.is_open([more]) is is_open, "the model itself leaves nothing"


def test_the_drawing_decides_by_three_standard_errors_and_against_no_recording(
    selection: Selection, monkeypatch: pytest.MonkeyPatch
):
    near, off = scored("a", 0.0), scored("b", 0.0)
    off.fit.unknowns = SimpleNamespace(is_far=lambda _: True)
    least = room.SIGMAS**2
    for lead, better in ((least + 0.5, True), (least - 0.5, False), (0.0, False), (-1.0, False)):
        off.fit.cost = near.fit.cost + lead
        assert selection.is_better(near, off) is better
        assert not selection.is_better(off, near)
    off.fit.cost = near.fit.cost + least + 0.5
    monkeypatch.setattr(Selection, "fits_better", lambda self, one, other: one is off)
    assert not selection.is_better(near, off), "a recording says otherwise"
    monkeypatch.setattr(Selection, "fits_better", lambda self, one, other: False)
    for bad in (near, off):
        misfit, bad.fit.misfit = bad.fit.misfit, 2.5 * N
        assert not selection.is_better(near, off), "either may be bent by what is missing"
        bad.fit.misfit = misfit
    assert selection.is_better(near, off)
