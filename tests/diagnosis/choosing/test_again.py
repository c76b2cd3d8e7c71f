"""Rivals of an accepted effect, asked again once what was found after it is in the model."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from diagnosis.analytic import GEAR, bench, candidates, unknowns
from thsa_cosim.diagnosis.choosing import again as room
from thsa_cosim.diagnosis.choosing.again import Model, asked_again
from thsa_cosim.diagnosis.choosing.rounds import APART, Round
from thsa_cosim.diagnosis.choosing.score import Scored, extended_unknowns, score
from thsa_cosim.diagnosis.choosing.screen import screen
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.fit import Fit, refine

TRUE = {
    "motorEffect.windage.b_q": 2e-3,
    "motorEffect.stribeck.dF": 0.5,
    "motorEffect.stribeck.v_S": 2.0,
    "motorEffect.stribeck.n": 1.5,
}


def fitted(own: Bench, current: Fit, held: np.ndarray, name: str) -> Scored:
    offered = own_candidates()
    proposal = next(p for p in screen(own, current, offered, {}) if p.candidate.name == name)
    one = score(own, current, held, proposal, iterations=6)
    assert one is not None
    return one


def own_candidates() -> tuple[Any, ...]:
    return candidates("windage", "stribeck", "load-dependent-friction", "asymmetric-friction")


def round_with(one: Scored, scored: tuple[Scored, ...], rivals: tuple[Scored, ...]) -> Round:
    objections = ("", *(APART for _ in scored[1:]))
    return Round(
        0.0, tuple(s.proposal for s in scored), scored, one, objections, rivals, np.zeros(0), np.ones(1)
    )


def model(
    first: str, *, true: Mapping[str, float] = TRUE, rivals: tuple[str, ...] = (), lost: tuple[str, ...] = ()
):
    """The bench, and a model with ``first`` and then the Stribeck friction; what tied with the first, or lost to it."""
    own, declared = bench(own_candidates(), true), unknowns()
    base = refine(own, declared, declared.start, iterations=10)
    assert base is not None
    (held,) = own.residuals(declared, base.vector[None, :], "validate")
    assert held is not None
    one = fitted(own, base, held, first)
    near, apart = ([fitted(own, base, held, name) for name in names] for names in (rivals, lost))
    two = fitted(own, one.fit, one.validate, "stribeck:motor")
    wider = extended_unknowns(declared, [one, two])
    fit = refine(own, wider, two.fit.at(wider.names), iterations=8)
    assert fit is not None
    (left,) = own.residuals(wider, fit.vector[None, :], "validate")
    assert left is not None
    rounds = (round_with(one, (one, *apart), tuple(near)), round_with(two, (two,), ()))
    return own, Model(rounds, (one, two), fit, left)


def renamed(one: Scored, **changes: Any) -> Scored:
    """The same with another candidate."""
    return replace(one, proposal=replace(one.proposal, candidate=replace(one.candidate, **changes)))


def names(found: Model) -> list[str]:
    return [s.candidate.name for s in found.accepted]


@pytest.mark.parametrize("kind", ["rivals", "lost"])
def test_what_fits_better_with_all_that_was_found_later_takes_the_place(kind: Any):
    own, before = model("load-dependent-friction:motor", **{kind: ("windage:motor",)})
    made = asked_again(own, unknowns(), before, lambda _: None)
    assert names(made) == ["windage:motor", "stribeck:motor"]
    assert made.fit.cost < before.fit.cost - 9.0
    values = made.fit.unknowns.named(made.fit.vector)
    assert values["motorEffect.windage.b_q"] == pytest.approx(2e-3, rel=0.05)
    first, second = made.rounds
    assert first.accepted is made.accepted[0]
    assert first.scored[0] is first.accepted
    assert [s.candidate.name for s in first.rivals] == []
    assert first.objections[:2] == ("", APART)
    assert second is before.rounds[1]
    (held,) = own.residuals(made.fit.unknowns, made.fit.vector[None, :], "validate")
    np.testing.assert_array_equal(made.held, held)


def test_what_fits_as_well_stays_a_tie_and_both_are_compared_as_they_are_now():
    own, before = model("windage:motor", rivals=("windage:motor",))
    (same,) = before.rounds[0].rivals
    twin = renamed(same, effect=replace(same.candidate.effect, name="twin"))
    before = replace(before, rounds=(replace(before.rounds[0], rivals=(twin,)), before.rounds[1]))
    made = asked_again(own, unknowns(), before, lambda _: None)
    assert names(made) == names(before)
    (tie,) = made.rounds[0].rivals
    assert tie.candidate.effect.name == "twin"
    assert tie.fit.cost == pytest.approx(before.fit.cost, abs=9.0)
    assert made.rounds[0].accepted is made.accepted[0]
    assert made.accepted[0].fit is made.fit is before.fit
    assert "motorEffect.stribeck.dF" in tie.fit.unknowns.names, "with what was found later"


def test_what_is_told_apart_now_is_no_tie_and_another_place_of_the_effect_is_not_asked():
    own, before = model("windage:motor", rivals=("load-dependent-friction:motor", "windage:motor"))
    other, same = before.rounds[0].rivals
    place = renamed(same, slot=GEAR)
    before = replace(before, rounds=(replace(before.rounds[0], rivals=(other, place)), before.rounds[1]))
    made = asked_again(own, unknowns(), before, lambda _: None)
    assert names(made) == names(before)
    assert [s.candidate.name for s in made.rounds[0].rivals] == ["windage:gear"]
    assert made.fit is before.fit


@pytest.mark.parametrize("why", ["held out", "out of range", "insignificant", "no run"])
def test_nothing_takes_a_place_that_cannot_be_believed(monkeypatch: pytest.MonkeyPatch, why: str):
    own, before = model("load-dependent-friction:motor", lost=("windage:motor",))
    if why == "held out":
        before = replace(before, held=np.zeros_like(before.held))
    if why == "out of range":
        monkeypatch.setattr(room, "out_of_range", lambda _fit: "c")
    if why == "insignificant":
        monkeypatch.setattr(room, "insignificant", lambda _one: "includes zero")
    if why == "no run":
        own.residuals = lambda _u, vectors, _part: [None] * len(vectors)  # type: ignore[method-assign]
    made = asked_again(own, unknowns(), before, lambda _: None)
    assert names(made) == names(before)
    assert made.fit is before.fit


def test_of_many_rivals_the_most_telling_two_are_asked_of_other_effects_only():
    others = ("windage:motor", "load-dependent-friction:motor", "load-dependent-friction:gear")
    rivals = (*others, "asymmetric-friction:gear", "stribeck:gear")
    _own, before = model("asymmetric-friction:motor", rivals=rivals)
    one, two = before.accepted
    near = room._near(before.rounds[0], one, [two])
    assert len(near) == room.ASKED == 2
    assert {s.candidate.effect.name for s in near} <= {"windage", "load-dependent-friction"}
    assert [s.held_out_gain for s in near] == sorted((s.held_out_gain for s in near), reverse=True)


def test_the_last_effect_and_one_with_a_further_part_of_its_own_are_not_asked_again():
    own, before = model("load-dependent-friction:motor", lost=("windage:motor",))
    one, two = before.accepted
    said: list[str] = []
    alone = Model(before.rounds[:1], (one,), one.fit, one.validate)
    assert asked_again(own, unknowns(), alone, said.append) is alone
    variant = replace(two.candidate.variant, beside=True, block=one.candidate.variant.block)
    part = replace(two, proposal=replace(two.proposal, candidate=replace(two.candidate, variant=variant)))
    rounds = (before.rounds[0], replace(before.rounds[1], accepted=part))
    with_part = replace(before, accepted=(one, part), rounds=rounds)
    assert asked_again(own, unknowns(), with_part, said.append) is with_part
    assert not said
