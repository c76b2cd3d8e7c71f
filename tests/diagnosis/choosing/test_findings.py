"""An attribution in the words of the result: decisions, reasons, probabilities, and what is not determined."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from thsa_cosim.diagnosis.catalogue.known import known_effects
from thsa_cosim.diagnosis.choosing.chance import probability
from thsa_cosim.diagnosis.choosing.findings import (
    NO_MORE,
    found_effects,
    judged,
    known_values,
    off_the_drawing,
    order_of,
    undetermined,
    vague,
    values_of,
)
from thsa_cosim.diagnosis.choosing.orders import Machine, Order
from thsa_cosim.diagnosis.choosing.rounds import Round
from thsa_cosim.diagnosis.choosing.screen import Proposal
from thsa_cosim.diagnosis.fitting.fit import Fit
from thsa_cosim.diagnosis.fitting.unknowns import Unknown, Unknowns
from thsa_cosim.diagnosis.results import Value

GAINS = np.random.default_rng(3).gumbel(5.0, 1.5, 1000)


def parameter(variable: str, role: str = "coefficient", **more: Any) -> Any:
    given = {
        "unit": "N",
        "typical": 1.0,
        "neutral": 0.0,
        "fixed": False,
        "name": variable.rpartition(".")[2],
    } | more
    return SimpleNamespace(variable=variable, role=role, **given)


def proposal(
    effect: str,
    gain: float,
    place: str = "motor",
    information: float = 1.0,
    start: float = 0.0,
    typical: float = 1.0,
) -> Any:
    own = parameter(f"{place}.{effect}.k", scanned=False, typical=typical)
    candidate: Any = SimpleNamespace(
        effect=SimpleNamespace(name=effect, title=f"Title of {effect}"),
        name=f"{effect}:{place}",
        key=f"{effect}:{place}/x0",
        component=effect,
        slot=SimpleNamespace(name=place, interface="FrictionEffect"),
        parameters=(own,),
        coefficients=(own,),
    )
    response = np.full((10, 1), np.sqrt(information / 10.0))
    return Proposal(candidate, {"v_S": start}, response, gain, np.array([2.0]), 1.0, response.T @ response)


def unknown(name: str, **more: Any) -> Unknown:
    given = {
        "start": 0.0,
        "spread": np.inf,
        "scale": 1.0,
        "lower": -9.0,
        "upper": 9.0,
        "declared": False,
    } | more
    return Unknown(name, name, "N", **given)


def scored(own: Proposal, held_out: float = 90.0) -> Any:
    unknowns = Unknowns(
        (unknown("p", declared=True, start=1.0), unknown(own.candidate.parameters[0].variable))
    )
    fit = Fit(unknowns, np.array([1.0, 4.0]), np.ones(50), np.eye(50, 2), np.ones(2), 0.0, True)
    return SimpleNamespace(
        proposal=own, candidate=own.candidate, fit=fit, fit_gain=own.gain, held_out_gain=held_out
    )


def one_round(
    proposals: list[Any], refined: list[Any], accepted: Any, objections: tuple, rivals: tuple = ()
) -> Round:
    return Round(17.0, tuple(proposals), tuple(refined), accepted, objections, rivals, GAINS, np.ones(1))


def attribution(*rounds: Round, accepted: tuple = ()) -> Any:
    return SimpleNamespace(rounds=rounds, accepted=accepted)


@pytest.fixture
def found() -> Any:
    winner, rival, worse = proposal("a", 100.0), proposal("b", 95.0), proposal("c", 60.0)
    less, chance = proposal("d", 18.0), proposal("e", 3.0)
    blind, deaf = proposal("f", 2.0, information=0.01), proposal("g", 0.0, information=0.0)
    refined = [scored(winner), scored(rival), scored(worse)]
    own = one_round(
        [winner, rival, worse, proposal("a", 50.0, start=1.0), less, chance, blind, deaf],
        refined, refined[0], ("",), (scored(rival, 95.0),),
    )  # fmt: skip
    return attribution(own, accepted=(refined[0],))


def test_every_candidate_is_judged_once_the_accepted_one_first_then_what_was_refined(found: Any):
    made = judged(found)
    assert [j.name[0] for j in made] == list("abcdefg")
    assert [j.decision for j in made] == [
        "accepted", "rival", "rejected", "not refined", "not refined", "not testable", "not testable",
    ]  # fmt: skip
    assert [j.reason for j in made] == [
        "",
        "explains the held-out recordings as well, within the uncertainty",
        "explains the held-out recordings less well than a:motor",
        "promises less than those that were refined",
        "promises no more than chance",
        "too little excitation beside the declared parameters",
        "nothing in the fit recordings depends on it",
    ]
    assert {j.round for j in made} == {1}
    assert [j.held_out_gain for j in made] == [90.0, 95.0, 90.0, None, None, None, None]
    assert made[0].variant == "a:motor/x0 (v_S = 0)"


def test_a_candidate_is_not_testable_if_ten_times_its_ordinary_size_would_drown_in_chance():
    limit = 17.0 / 100.0  # of its information: sqrt(17/information) against 10
    for information, decision in ((1.01 * limit, "not refined"), (0.99 * limit, "not testable")):
        own = one_round([proposal("a", 1.0, information=information)], [], None, ())
        assert judged(attribution(own))[0].decision == decision
        large = one_round([proposal("a", 1.0, information=information / 9.0, typical=3.0)], [], None, ())
        assert judged(attribution(large))[0].decision == decision, "what is usual is three times as large"


def test_the_accepted_one_comes_first_though_others_gain_more_and_what_was_refined_before_the_rest():
    accepted, more, promised = proposal("a", 60.0), proposal("b", 95.0), proposal("c", 99.0)
    one, two = scored(accepted), scored(more)
    two.fit_gain = 77.0
    own = one_round([promised, more, accepted], [two, one], one, ("b is chance", ""))
    made = judged(attribution(own, accepted=(one,)))
    assert [(j.name[0], j.fit_gain) for j in made] == [("a", 60.0), ("b", 77.0), ("c", 99.0)]
    assert made[1].reason == "b is chance"


def test_what_promises_just_as_much_as_chance_was_left_to_those_that_promise_more():
    own = one_round([proposal("a", 17.0)], [], None, ())
    assert judged(attribution(own))[0].reason == "promises less than those that were refined"


def test_gains_and_values_are_those_of_the_fit_where_there_is_one_else_what_was_promised(found: Any):
    made = {j.name[0]: j for j in judged(found)}
    assert made["a"].parameters["k"].value == 4.0
    assert made["d"].parameters["k"].value == 2.0
    assert made["d"].parameters["k"].stderr == pytest.approx(1.0)
    assert made["d"].parameters["k"].unit == "N"
    assert made["e"].p_value == pytest.approx(probability(3.0, GAINS))
    assert 0.5 < made["e"].p_value < 1.0
    assert made["a"].p_value < 1e-9
    assert made["a"].fit_gain == 100.0


def test_a_refusal_is_said_in_the_words_of_its_gate():
    first, second, third = proposal("a", 90.0), proposal("b", 80.0), proposal("c", 70.0)
    refined = [scored(p) for p in (first, second, third)]
    own = one_round([first, second, third], refined, None, ("a is chance", "b is chance"))
    made = judged(attribution(own))
    assert [j.reason for j in made] == ["a is chance", "b is chance", "a is chance"]
    assert {j.decision for j in made} == {"rejected"}


def test_what_was_accepted_and_dropped_again_or_accepted_later_is_said_to_be():
    first, second = proposal("a", 90.0), proposal("b", 80.0)
    one, two = scored(first), scored(second)
    own = one_round([first, second], [one, two], one, ("",), (two,))
    dropped = judged(attribution(own))
    assert dropped[0].decision == "rejected"
    assert dropped[0].reason == "was accepted and dropped again, see the notes"
    assert dropped[1].decision == "rejected", "a rival of what was dropped is none"

    again = scored(proposal("b", 60.0))
    later = one_round([again.proposal], [again], again, ("",))
    both = judged(attribution(own, later, accepted=(one, again)))
    assert [(j.name[0], j.round, j.decision) for j in both if j.round == 2] == [("b", 2, "accepted")]
    plain = one_round([first, second], [one, two], one, ("",))
    made = {(j.name[0], j.round): j for j in judged(attribution(plain, later, accepted=(one, again)))}
    assert made["b", 1].reason == "explains the held-out recordings less well; accepted in round 2"
    alone = {(j.name[0], j.round): j for j in judged(attribution(plain, later, accepted=(again,)))}
    assert alone["b", 1].reason == "explains the held-out recordings less well; accepted in round 2"
    dropped = {(j.name[0], j.round): j for j in judged(attribution(plain, later, accepted=(one,)))}
    assert dropped["b", 1].reason == "explains the held-out recordings less well than a:motor", (
        "not accepted after all"
    )


def test_an_effect_is_as_probable_as_chance_and_its_rivals_leave_it(found: Any):
    (effect,) = found_effects(found, found.accepted[0].fit)
    assert (effect.name, effect.title, effect.equivalent) == ("a:motor", "Title of a", ("b:motor",))
    assert effect.probability == pytest.approx(0.5)
    assert effect.parameters["k"].value == 4.0
    assert (effect.parameters["k"].variable, effect.parameters["k"].role) == ("motor.a.k", "coefficient")
    (sure,) = found_effects(found, found.accepted[0].fit, stderr=np.array([0.5, 0.7]))
    assert sure.parameters["k"].stderr == 0.7
    weak = scored(replace(found.accepted[0].proposal, gain=8.0))
    alone = attribution(one_round([weak.proposal], [weak], weak, ("",)), accepted=(weak,))
    (effect,) = found_effects(alone, weak.fit)
    assert effect.probability == pytest.approx(1.0 - probability(8.0, GAINS))
    assert 0.5 < effect.probability < 0.95


def test_ways_of_one_effect_are_one_with_its_places_spelt_out():
    members = [scored(proposal("a", 90.0)), scored(proposal("a", 80.0, "gear")), scored(proposal("b", 70.0))]
    rivals = [(scored(proposal("b", 69.0)),), (), (scored(proposal("c", 69.0)),)]
    rounds = [one_round([m.proposal], [m], m, ("",), r) for m, r in zip(members, rivals, strict=True)]
    unknowns = Unknowns(tuple(unknown(m.candidate.parameters[0].variable) for m in members))
    fit = Fit(unknowns, np.array([1.0, 2.0, 3.0]), np.ones(50), np.eye(50, 3) * 9, np.ones(3), 0.0, True)
    effects = found_effects(attribution(*rounds, accepted=tuple(members)), fit)
    assert [e.name for e in effects] == ["a:motor", "b:motor"]
    assert [e.equivalent for e in effects] == [(), ("c:motor",)], (
        "each has the rivals of its own round, but for what is in the model as well"
    )
    assert {n: v.value for n, v in effects[0].parameters.items()} == {"motor.a.k": 1.0, "gear.a.k": 2.0}
    assert {n: v.value for n, v in effects[1].parameters.items()} == {"k": 3.0}


def test_another_form_takes_the_place_of_the_accepted_one_wherever_it_stood(found: Any):
    before = found.rounds[0]
    old, (_, rival, worse) = before.accepted, before.scored
    form = scored(proposal("a", 98.0, start=2.0))
    after = before.with_accepted(form)
    assert after.accepted is form
    assert after.proposals == (form.proposal, *before.proposals[1:])
    assert after.scored == (form, rival, worse)
    assert (after.rivals, after.objections, after.gains is before.gains) == (before.rivals, ("",), True)
    assert before.with_accepted(old) is before
    nothing = replace(before, accepted=None)
    assert nothing.with_accepted(form) is nothing


def test_a_declared_effect_has_the_fitted_values_and_keeps_the_others_as_they_were_given():
    fit = scored(proposal("a", 1.0)).fit  # p, which is declared, is 1.0
    ways = [
        SimpleNamespace(
            candidate=SimpleNamespace(
                name="drag:motor", parameters=(parameter("p"), parameter("n", "shape"))
            ),
            starts={"p": 7.0, "n": 2.5},
        )
    ]
    (known,) = known_values(ways, fit, np.array([0.3, 0.1]))  # type: ignore[arg-type]
    assert known.name == "drag:motor"
    assert known.parameters == {
        "p": Value(1.0, "N", 0.3, variable="p"),
        "n": Value(2.5, "N", 0.0, variable="n", role="shape"),
    }


def test_values_are_widened_by_what_is_left_and_split_into_declared_and_effects():
    fit = scored(proposal("a", 1.0)).fit
    wide = replace(fit, residual=np.full(50, 2.0))
    assert values_of(fit, declared=True)["p"].stderr == pytest.approx(1.0)
    assert values_of(wide, declared=True)["p"].stderr == pytest.approx(2.0)
    assert list(values_of(fit, declared=False)) == ["motor.a.k"]
    assert values_of(fit, declared=True)["p"] == Value(1.0, "N", pytest.approx(1.0))
    assert values_of(fit, declared=True, stderr=np.array([0.3, 0.1]))["p"].stderr == 0.3
    ended = replace(fit, vector=np.array([9.0, 4.0]))
    assert values_of(ended, declared=True)["p"].reason == "it ended at the end of its range, 9 N"


def test_a_value_at_its_bound_unseen_or_only_known_from_the_drawing_is_not_determined():
    own = unknown("p", declared=True, spread=0.5, upper=2.0)
    assert undetermined(own, 1.0, 0.1) == ""
    assert undetermined(own, 2.0, 7e-7) == "it ended at the end of its range, 2 N"
    assert undetermined(own, -9.0, 7e-7) == "it ended at the end of its range, -9 N"
    assert undetermined(replace(own, unit="1"), 2.0, 7e-7) == "it ended at the end of its range, 2"
    assert undetermined(own, 1.0, np.inf) == "nothing in the recordings determines it"
    assert undetermined(own, 1.0, 0.47) == ""
    assert undetermined(own, 1.0, NO_MORE * 0.5) == ""
    assert undetermined(own, 1.0, 0.48) == "the recordings say no more of it than the drawing"
    assert undetermined(unknown("k"), 1.0, 42.0) == "", "an effect's own: see vague"


def test_a_coefficient_of_an_effect_that_its_error_covers_is_not_determined():
    friction = parameter("dF")
    members: Any = [SimpleNamespace(candidate=SimpleNamespace(parameters=(friction,)))]
    one = vague(members, {"dF": Value(1.5, "N", 42.0)})["dF"]
    assert not one.identifiable
    assert one.reason == "it is not determined: one standard error is 42 N"
    assert vague(members, {"dF": Value(1.5, "N", 0.49)})["dF"].identifiable
    assert not vague(members, {"dF": Value(1.5, "N", 0.51)})["dF"].identifiable
    assert vague(members, {"dF": Value(1.5, "N", 42.0, "other")})["dF"].reason == "other"
    assert vague(members, {"dF": Value(3.0, "N", 1.0)})["dF"].identifiable, "just a third"
    gain: Any = [SimpleNamespace(candidate=SimpleNamespace(parameters=(parameter("g", neutral=1.0),)))]
    assert not vague(gain, {"g": Value(1.2, "N", 0.1)})["g"].identifiable, "0.2 from doing nothing"
    assert vague(gain, {"g": Value(1.4, "N", 0.1)})["g"].identifiable


def test_a_ripples_sine_may_be_zero_beside_its_cosine_and_a_shape_counts_by_itself():
    parameters = (
        parameter("s"),
        parameter("c"),
        parameter("n", "shape", typical=0.0),
        parameter("other", unit="m"),
    )
    members: Any = [SimpleNamespace(candidate=SimpleNamespace(parameters=parameters))]
    values = {
        "s": Value(1e-4, "N", 1e-3), "c": Value(-5e-2, "N", 1e-3), "n": Value(12.0, "1", 0.1),
        "other": Value(1e-4, "m", 1e-3),
    }  # fmt: skip
    found = vague(members, values)
    assert {n for n, v in found.items() if not v.identifiable} == {"other"}
    assert not vague(members, {**values, "n": Value(12.0, "1", 4.1)})["n"].identifiable
    turned = {**values, "s": values["c"], "c": values["s"]}
    assert {n for n, v in vague(members, turned).items() if not v.identifiable} == {"other"}


#: A nut on a screw with a lead of 10 mm, behind a gear of 30.
LEAD = 2.0 * np.pi / 10e-3
MACHINE = Machine(
    {"nut": {"motor": 30.0 * LEAD, "gearbox": LEAD}, "gearbox": {"motor": 30.0, "gearbox": 1.0}},
    {"nut": 0.03, "gearbox": 19.0},
)


def ripple(effect: str, place: str, wave: float, fitted: bool = True, block: str = "RippleFriction") -> Any:
    """An effect that repeats with ``wave`` at a place, with its amplitude and wave number as unknowns of its fit."""
    own = (
        parameter(f"{place}.{effect}.a", scanned=False),
        parameter(f"{place}.{effect}.n", "shape", scanned=True, unit="rad/m"),
    )
    made = replace(proposal(effect, 90.0, place), shapes={} if fitted else {"n": wave})
    made.candidate.parameters, made.candidate.coefficients = own, own[:1]
    made.candidate.variant = SimpleNamespace(block=block)
    names = own if fitted else own[:1]
    unknowns = Unknowns(tuple(unknown(p.variable, upper=1e5) for p in names))
    vector = np.array([2.0, wave])[: len(names)]
    fit = Fit(unknowns, vector, np.zeros(50), 1e4 * np.eye(50, len(names)), np.ones(len(names)), 0.0, True)
    one = scored(made)
    one.fit = fit
    return one


def test_a_ripple_and_its_rivals_go_by_the_shaft_that_they_repeat_over():
    accepted = ripple("cogging", "nut", 1.0001 * LEAD)
    rivals = (
        ripple("position-friction", "nut", LEAD),  # the same once it is named
        ripple("screw-ripple", "gearbox", 2.0),
        ripple("screw-ripple", "gearbox", 24.0 * 30.0),
        ripple("screw-ripple", "nut", 1.37 * LEAD),
    )
    own = one_round([accepted.proposal], [accepted], accepted, ("",), rivals)
    (effect,) = found_effects(attribution(own, accepted=(accepted,)), accepted.fit, MACHINE)
    assert effect.name == "screw-ripple:nut"
    assert effect.title == known_effects()["screw-ripple"].title
    assert effect.order == "1 per turn of the gearbox"
    assert effect.equivalent == ("screw-ripple:gearbox", "cogging:gearbox", "position-friction:nut")
    assert effect.probability == pytest.approx(0.25)
    assert effect.parameters["n"].role == "shape"
    (plain,) = found_effects(attribution(own, accepted=(accepted,)), accepted.fit)
    assert (plain.name, plain.order) == ("position-friction:nut", ""), "of no machine no ratio is known"


def test_orders_of_several_shafts_are_said_each_with_its_own():
    members = [ripple("cogging", "gearbox", wave) for wave in (12.0 * 30.0, 2.0, 18.0 * 30.0)]
    for number, member in enumerate(members):
        for p in member.candidate.parameters:
            p.variable += str(number)
        names = (unknown(p.variable, upper=1e5) for p in member.candidate.parameters)
        member.fit = replace(member.fit, unknowns=Unknowns(tuple(names)))
    rounds = [one_round([m.proposal], [m], m, ("",)) for m in members]
    unknowns = Unknowns(tuple(u for m in members for u in m.fit.unknowns.members))
    vector = np.concatenate([m.fit.vector for m in members])
    fit = Fit(unknowns, vector, np.zeros(50), 1e4 * np.eye(50, 6), np.ones(6), 0.0, True)
    (effect,) = found_effects(attribution(*rounds, accepted=tuple(members)), fit, MACHINE)
    assert effect.order == "12, 18 per turn of the motor; 2 per turn of the gearbox"


def test_the_order_of_a_wave_that_no_fit_changes_is_that_of_its_start():
    fixed = ripple("cogging", "gearbox", 12.0 * 30.0, fitted=False)
    assert order_of(fixed, {}, MACHINE) == Order("motor", 12)
    fitted = {"gearbox.cogging.n": Value(18.0 * 30.0, "1", 1e-3)}
    assert order_of(fixed, fitted, MACHINE) == Order("motor", 18), "a fitted value counts more"
    assert order_of(ripple("cogging", "gearbox", 1.0), {}, MACHINE) is None, (
        "of an unknown wave there is none"
    )
    assert order_of(scored(proposal("a", 90.0, "gearbox")), {}, MACHINE) is None


def test_a_declared_parameter_far_from_the_drawing_is_noted_with_both_values():
    """Spreads of 0.1: 1.4 is four of them away, 0.3 seven; an effect's parameter has no drawing."""
    members = (
        Unknown("near", "near", "N", 1.0, 0.1, 0.1, 0.0, 9.0),
        Unknown("far", "far", "N.m", 1.0, 0.1, 0.1, 0.0, 9.0),
        Unknown("free", "free", "1", 0.0, np.inf, 0.1, 0.0, 9.0, declared=False),
    )
    fit = Fit(
        Unknowns(members), np.array([1.4, 0.3, 5.0]), np.zeros(4), np.zeros((4, 3)), np.ones(3), 1.0, True
    )
    assert off_the_drawing(fit) == ("far: 0.3 N.m is 7 times its spread from the drawing's 1 N.m",)
