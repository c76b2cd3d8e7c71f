"""What is refined, what counts as another place, and which rivals these recordings cannot tell from the winner."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from thsa_cosim.diagnosis.choosing import selection as room
from thsa_cosim.diagnosis.choosing.selection import Selection, other_places, other_waves, worth_refining


def proposal(effect: str, gain: float, place: str = "motor") -> Any:
    candidate = SimpleNamespace(effect=SimpleNamespace(name=effect), name=f"{effect}:{place}")
    return SimpleNamespace(candidate=candidate, gain=gain, label=f"{effect}:{place}")


def test_the_best_two_starts_of_the_best_six_effects_are_refined():
    made = [proposal(f"e{k}", 1000.0 - k) for k in range(8)]
    assert worth_refining(made, 17.0) == made[:6]
    several = [proposal("a", 100.0), proposal("a", 99.0), proposal("a", 98.0), proposal("b", 97.0)]
    assert worth_refining(several, 17.0) == [several[0], several[1], several[3]]
    late = [*made[:6], proposal("e0", 900.0), proposal("e7", 900.0)]
    assert worth_refining(late, 17.0) == late[:7], "a further start of an effect that is in"


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


N = 4000
TIME = np.arange(N) * 5e-3
CHANNEL = SimpleNamespace(name="v", measured=np.zeros(N), time=TIME, noise=1.0, weight=1.0)
TRIALS: Any = (SimpleNamespace(case=SimpleNamespace(channels=(CHANNEL,))),)
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
        fit=SimpleNamespace(residual=validate, cost=float(validate @ validate)),
        held_out_gain=gain,
        fit_gain=gain,
    )


@pytest.fixture
def selection(monkeypatch: pytest.MonkeyPatch) -> Selection:
    """A round whose candidates are fitted already."""
    monkeypatch.setattr(room, "polish", lambda bench, one, current, held: one)
    monkeypatch.setattr(room, "go_on", lambda bench, one, current, held: one)
    bench: Any = SimpleNamespace(of=lambda part: TRIALS)
    weights: Any = None
    current: Any = SimpleNamespace(residual=HELD)
    return Selection(bench, weights, current, HELD)


def names(found: tuple[Any, ...]) -> list[str]:
    return [s.candidate.name for s in found]


def test_what_leaves_as_little_is_a_rival(selection: Selection):
    winner = scored("a", 0.0)
    made = [winner, scored("b", 0.01), scored("c", 0.2), scored("d", 0.5)]
    assert names(selection.rivals(winner, made, ())) == ["b:motor"]


def test_what_leaves_a_little_more_in_every_block_is_none_unless_it_hardly_matters(selection: Selection):
    winner = scored("a", 0.0)
    # The share of the gain that is left is the square: half a percent is at 0.0707.
    assert names(selection.rivals(winner, [scored("b", 0.06)], ())) == ["b:motor"]
    assert names(selection.rivals(winner, [scored("b", 0.09)], ())) == []


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


def test_a_lead_that_a_few_blocks_decide_is_chance(selection: Selection):
    winner, other = scored("a", 0.0), scored("b", 0.0)
    other.validate = NOISE + np.where((TIME > 3.0) & (TIME < 4.0), 0.9, 0.0) * SMOOTH
    lead = other.validate @ other.validate - winner.validate @ winner.validate
    assert float(lead) > 0.005 * winner.held_out_gain
    assert names(selection.rivals(winner, [other], ())) == ["b:motor"]


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
        tried.append(one.candidate.name)
        return None if one.candidate.name == "a:nut" else scored("a", 0.0, "gear")

    monkeypatch.setattr(room, "score", fitted)
    winner = scored("a", 0.0)
    proposals = [winner.proposal, proposal("a", 1e9, "gear"), proposal("a", 1e9, "nut"), proposal("b", 1e9)]
    found = selection.elsewhere(winner, [winner], proposals)
    assert names(tuple(found)) == ["a:gear"]
    assert tried == ["a:gear", "a:nut"]
    assert selection.elsewhere(winner, [winner, *found], proposals[:2]) == []
