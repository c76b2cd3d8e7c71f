"""The whole decision on a drive in closed form: proposals in; accepted effects, objections, rivals, pruning out."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from diagnosis.analytic import bench, candidates, unknowns
from thsa_cosim.diagnosis.choosing import attribution
from thsa_cosim.diagnosis.choosing import needless as room
from thsa_cosim.diagnosis.choosing.attribution import Attribution, Begun, attribute
from thsa_cosim.diagnosis.choosing.findings import found_effects, judged
from thsa_cosim.diagnosis.choosing.gates import out_of_range
from thsa_cosim.diagnosis.choosing.needless import prune, within_range
from thsa_cosim.diagnosis.choosing.orders import Machine
from thsa_cosim.diagnosis.choosing.score import Scored, extended_unknowns, score
from thsa_cosim.diagnosis.choosing.screen import screen
from thsa_cosim.diagnosis.choosing.verdict import VISIBLE_BESIDE
from thsa_cosim.diagnosis.fitting.fit import Fit, cost_of, refine
from thsa_cosim.diagnosis.fitting.weights import ChannelWeights

NAMES = ("windage", "stribeck", "asymmetric-friction", "load-dependent-friction", "cogging")
WINDAGE = {"motorEffect.windage.b_q": 6e-4}
STRIBECK = {"motorEffect.stribeck.dF": 0.5, "motorEffect.stribeck.v_S": 2.0, "motorEffect.stribeck.n": 1.5}


def diagnosed(
    true: Mapping[str, float], *names: str, most: int = 3, **declared: Mapping[str, float]
) -> Attribution:
    offered = candidates(*(names or NAMES))
    own = bench(offered, true)
    found = attribute(own, unknowns(**declared), offered, lambda _: {}, seed=1, most=most)
    assert found is not None
    return found


@pytest.fixture
def windage() -> Attribution:
    return diagnosed(WINDAGE)


def test_the_effect_that_is_there_is_accepted_with_its_value(windage: Attribution):
    assert [s.candidate.effect.name for s in windage.accepted] == ["windage"]
    (effect,) = found_effects(windage, windage.final)
    value = effect.parameters["b_q"]
    assert effect.name == "windage:motor"
    assert value.value == pytest.approx(6e-4, rel=0.02)
    assert value.stderr < 0.02 * value.value
    assert value.identifiable
    assert windage.rounds[0].objections == ("",)
    assert len(windage.rounds) == 1, "what is left is noise, so nothing more is looked for"
    np.testing.assert_allclose(np.mean(windage.final_validate**2), 1.0, atol=0.1)


def test_what_the_declared_model_leaves_is_given_in_standard_deviations_of_the_noise(windage: Attribution):
    """The search weighs signals by what the model leaves in them; its result does not."""
    own = bench(candidates(*NAMES), WINDAGE)
    vector = windage.base.vector[None, :]
    (fit,) = own.residuals(unknowns(), vector, "fit")
    (held,) = own.residuals(unknowns(), vector, "validate")
    assert fit is not None
    assert windage.base_cost == pytest.approx(cost_of(unknowns(), windage.base.vector, fit))
    assert windage.base_cost > 2.0 * fit.size, "or there would be nothing to weigh"
    np.testing.assert_allclose(windage.base_validate, held)
    assert windage.rounds[0].factors.shape == fit.shape
    np.testing.assert_allclose(windage.base.residual, fit * windage.rounds[0].factors)


def test_the_final_fit_without_weights_is_that_of_a_bench_without_weights(windage: Attribution):
    plain = windage.plain_final
    own = bench(candidates(*NAMES), WINDAGE)
    (residual,) = own.residuals(plain.unknowns, plain.vector[None, :], "fit")
    np.testing.assert_allclose(plain.residual, residual)
    np.testing.assert_allclose(plain.jacobian * windage.factors[:, None], windage.final.jacobian)


def test_a_search_that_only_describes_is_no_deep_one(monkeypatch: pytest.MonkeyPatch):
    offered = candidates(*NAMES)

    def never(*given: object) -> None:
        raise AssertionError("no further starts, sizes, forms, places or rivals")

    for name in ("further", "at_sizes", "elsewhere", "overtaking", "rivals"):
        monkeypatch.setattr(f"thsa_cosim.diagnosis.choosing.selection.Selection.{name}", never)
    found = attribute(bench(offered, WINDAGE), unknowns(), offered, lambda _: {}, seed=1, most=1, deep=False)
    assert found is not None
    assert [s.candidate.effect.name for s in found.accepted] == ["windage"]
    assert found.rounds[0].rivals == found.rounds[0].forms == ()


def test_what_is_found_in_another_way_first_counts_and_is_gone_on_from():
    offered = candidates(*NAMES)
    first = diagnosed({**WINDAGE, **STRIBECK}, most=1)

    def begin(weights: ChannelWeights, base: Fit, held: np.ndarray) -> Begun:
        np.testing.assert_allclose(weights.base_held, held)
        np.testing.assert_allclose(base.vector, first.base.vector)
        return Begun(
            first.rounds,
            first.accepted,
            first.final,
            first.final_validate,
            notes=("a note",),
        )

    own = bench(offered, {**WINDAGE, **STRIBECK})
    found = attribute(own, unknowns(), offered, lambda _: {}, seed=1, begin=begin)
    assert found is not None
    names = [s.candidate.effect.name for s in found.accepted]
    assert names[0] == first.accepted[0].candidate.effect.name
    assert sorted(names) == ["stribeck", "windage"]
    assert len(found.rounds) == 2
    assert "a note" in found.notes


def test_what_is_fitted_beforehand_stands_beside_what_the_screening_finds():
    """A candidate that the screening is not offered is chosen where it is the better one, and only there."""
    offered = candidates(*NAMES)
    asked: list[str] = []
    for true, name in ((STRIBECK, "stribeck"), (WINDAGE, "windage")):
        other = tuple(c for c in offered if c.effect.name != "stribeck")

        def stuck(weights: ChannelWeights, base: Fit, held: np.ndarray) -> Begun:
            asked.append(name)  # noqa: B023
            alone = [c for c in offered if c.name == "stribeck:motor" and not c.variant.instead]
            proposal = max(screen(own, base, alone, {}), key=lambda p: p.gain)  # noqa: B023
            one = score(own, base, held, proposal)  # noqa: B023
            assert one is not None
            return Begun((), (), base, held, tried=(one,))

        own = bench(offered, true)
        found = attribute(own, unknowns(), other, lambda _: {}, seed=1, stuck=stuck, most=1, deep=False)
        assert found is not None
        assert [s.candidate.effect.name for s in found.accepted] == [name]
    assert asked == ["stribeck"], (
        "where the screening leads to what leaves nothing, no other way is asked for"
    )


def test_effects_that_are_found_in_another_way_where_the_search_is_stuck_are_all_that_count():
    first = diagnosed(STRIBECK, most=1)

    def stuck(weights: ChannelWeights, base: Fit, held: np.ndarray) -> Begun:
        return Begun(first.rounds, first.accepted, first.final, first.final_validate, notes=("a note",))

    other = candidates("windage")
    own = bench(candidates(*NAMES), STRIBECK)
    found = attribute(own, unknowns(), other, lambda _: {}, seed=1, stuck=stuck)
    assert found is not None
    assert found.accepted == first.accepted
    assert len(found.rounds) == 1
    assert "a note" in found.notes


@pytest.mark.parametrize("in_step", [True, False])
def test_a_free_run_that_is_out_of_step_drops_nothing_that_was_judged_in_step(in_step: bool):
    """Of two effects that were found one is needless: a free run that is lost cannot know."""
    true = {**WINDAGE, **STRIBECK}
    both = diagnosed(true, most=2)
    assert len(both.accepted) == 2
    # Of a machine without the first of them.
    own = bench(
        candidates(*NAMES), STRIBECK if both.accepted[0].candidate.effect.name == "windage" else WINDAGE
    )
    (held,) = own.residuals(both.final.unknowns, both.final.vector[None, :], "validate")
    fit = refine(own, both.final.unknowns, both.final.vector)
    assert held is not None
    assert fit is not None

    def stuck(_weights: ChannelWeights, _base: Fit, _held: np.ndarray) -> Begun:
        return Begun(both.rounds, both.accepted, fit, held, in_step=in_step)

    found = attribute(own, unknowns(), candidates("cogging"), lambda _: {}, seed=1, stuck=stuck)
    assert found is not None
    assert len(found.accepted) == (2 if in_step else 1)
    assert found.sticking == tuple(s.candidate.name for s in both.accepted)


def test_what_promises_less_than_the_least_share_of_what_is_left_is_not_fitted():
    offered = candidates(*NAMES)
    for least, count in ((0.0, 1), (0.5, 1), (0.999, 0)):
        found = attribute(
            bench(offered, WINDAGE), unknowns(), offered, lambda _: {}, seed=1, most=1, least=least
        )
        assert found is not None
        assert len(found.accepted) == count


def test_less_than_what_is_settled_is_not_looked_into():
    offered = candidates(*NAMES)
    own = bench(offered, {**WINDAGE, **STRIBECK})
    found = attribute(own, unknowns(), offered, lambda _: {}, seed=1, settled=1e6)
    assert found is not None
    assert len(found.accepted) == len(found.rounds) == 1


def test_the_search_starts_where_it_is_told_to_and_repeats_itself():
    offered = candidates("windage")
    own = bench(offered, WINDAGE)
    vector = 1.02 * np.array([1.5, 0.2, 0.4, 0.01])
    start = refine(bench(offered, WINDAGE), unknowns(), vector, iterations=1)
    assert start is not None
    found = attribute(own, unknowns(), offered, lambda _: {}, start=start, seed=1)
    first = own._engine._runner.ran[0].values  # type: ignore[attr-defined]
    assert [first[name] for name in unknowns().names] == pytest.approx(start.vector)
    again = [
        attribute(bench(offered, WINDAGE), unknowns(), offered, lambda _: {}, start=start, seed=seed)
        for seed in (1, 2)
    ]
    assert found is not None
    limits = [a.rounds[0].threshold for a in again if a is not None]
    assert found.rounds[0].threshold == limits[0] != limits[1]


@pytest.fixture
def stribeck() -> Attribution:
    return diagnosed(STRIBECK)


def test_places_behind_a_rigid_gear_are_one_law_and_said_to_be(stribeck: Attribution):
    (effect,) = found_effects(stribeck, stribeck.final)
    assert {effect.name, *effect.equivalent} == {"stribeck:motor", "stribeck:gear"}
    chance = stribeck.rounds[0].probability(stribeck.accepted[0].fit_gain)
    assert effect.probability == pytest.approx((1.0 - chance) / 2.0)
    decisions = {j.name: j.decision for j in judged(stribeck) if j.name.startswith("stribeck")}
    assert sorted(decisions.values()) == ["accepted", "rival"]


def test_a_drive_that_lacks_nothing_gets_nothing():
    found = diagnosed({})
    assert found.accepted == ()
    assert found.final is found.base
    assert len(found.rounds) == 1
    assert found.rounds[0].rivals == ()
    assert {j.decision for j in judged(found)} <= {"not refined", "rejected"}
    assert all(found.rounds[0].objections), "whatever was refined was refused with a reason"


def test_two_effects_are_found_one_after_the_other():
    both = {**STRIBECK, "motorEffect.windage.b_q": 2e-3}
    found = diagnosed(both)
    assert {s.candidate.effect.name for s in found.accepted} == {"windage", "stribeck"}
    assert len(found.rounds) == 2
    for number, one in enumerate(found.rounds):
        gains = [p.gain for p in one.proposals]
        assert gains == sorted(gains, reverse=True)
        refined = {id(r.proposal) for r in (*one.scored, *one.rivals)}
        assert all((p.response.size > 0) is (number == 0 or id(p) in refined) for p in one.proposals), (
            "the first ones are compared"
        )
    second = [j for j in judged(found) if j.round == 2]
    assert second[0].name == found.accepted[1].candidate.name
    assert second[0].decision == "accepted"
    assert {p.candidate.name for p in found.rounds[1].proposals} < {
        p.candidate.name for p in found.rounds[0].proposals
    }
    assert diagnosed(both, most=1).accepted[1:] == ()


def test_forms_of_one_effect_in_one_place_are_not_mixed():
    """Friction that runs in over distance or over time: one of them is the answer, and the other no second effect."""
    true = {"motorEffect.frictionRunIn.dF": 1.0, "motorEffect.frictionRunIn.d_r": 60.0, **WINDAGE}
    found = diagnosed(true, "friction-run-in", "windage")
    assert sorted(s.candidate.name for s in found.accepted) == ["friction-run-in:motor", "windage:motor"]
    run_in = next(s for s in found.accepted if s.candidate.effect.name == "friction-run-in")
    assert run_in.candidate.variant.block == "FrictionRunIn"
    offered = [{p.candidate.variant.block for p in r.proposals} for r in found.rounds]
    assert offered[0] == {"FrictionRunIn", "FrictionRunInTime", "Windage"}
    accepted = [r.accepted for r in found.rounds]
    for later in offered[accepted.index(run_in) + 1 :]:
        assert later <= {"Windage"}


def test_a_second_effect_that_is_small_beside_the_first_is_found_where_it_explains_all_that_is_left():
    found = diagnosed({**WINDAGE, **STRIBECK, "motorEffect.stribeck.dF": 0.3})
    assert [s.candidate.effect.name for s in found.accepted] == ["stribeck", "windage"]
    alone, fitted = found.rounds[1].scored[0].share, found.accepted[1].share
    assert alone < 0.9 < fitted, "what the first one had taken up of it counts for it"
    np.testing.assert_allclose(np.mean(found.final_validate**2), 1.0, atol=0.1)


def test_a_second_effect_that_may_be_the_misfit_of_the_first_one_is_refused():
    """Of two effects the catalogue lacks one: another place of the first takes up a part of it, and is not named."""
    strong = {**STRIBECK, "motorEffect.stribeck.dF": 1.5}
    known = candidates(*(n for n in NAMES if n != "windage"))
    own = bench(candidates(*NAMES), {**WINDAGE, **strong})
    found = attribute(own, unknowns(), known, lambda _: {}, seed=1)
    assert found is not None
    assert [s.candidate.effect.name for s in found.accepted] == ["stribeck"]
    refused = found.rounds[1].objections[0]
    assert refused.startswith("stribeck:")
    assert refused.endswith("explains less than 10 % of what the declared model left in any signal")


def test_a_candidate_whose_response_is_exactly_zero_is_not_testable():
    """A coefficient that nothing depends on: friction in proportion to a load that is never there."""
    offered = candidates("windage", "load-dependent-friction")
    own = bench(offered, WINDAGE)
    real = own._engine._runner.run  # type: ignore[attr-defined]

    def deaf(jobs, on_outcome=None):  # type: ignore[no-untyped-def]
        kept = [
            type(j)(j.experiment, {k: v for k, v in j.values.items() if "loadDependentFriction" not in k})
            for j in jobs
        ]
        return real(kept, on_outcome)

    own._engine._runner.run = deaf  # type: ignore[attr-defined, method-assign]
    found = attribute(own, unknowns(), offered, lambda _: {}, seed=1)
    assert found is not None
    assert [s.candidate.effect.name for s in found.accepted] == ["windage"]
    untestable = {j.name: j.reason for j in judged(found) if j.decision == "not testable"}
    assert set(untestable) == {"load-dependent-friction:motor", "load-dependent-friction:gear"}
    assert set(untestable.values()) == {"nothing in the fit recordings depends on it"}


def test_an_effect_that_drives_a_declared_parameter_to_its_end_is_dropped():
    """The drawing's range leaves out the friction that the machine has: only its end comes near."""
    found = diagnosed(WINDAGE, "windage", c={"start": 0.5, "lower": 0.45, "spread": np.inf})
    assert out_of_range(found.rounds[0].scored[0].fit) == "c"
    assert any(
        "drives the declared parameter c to the end of its range" in o for o in found.rounds[0].objections
    )
    assert found.accepted == ()
    assert any("was dropped: it drives c to the end of its range" in note for note in found.notes)
    assert found.final is found.base


def test_of_several_effects_the_last_one_is_dropped_if_they_drive_a_parameter_to_its_end(
    monkeypatch: pytest.MonkeyPatch,
):
    """What is left is the model with the one before it, and what that leaves on the held-out recordings."""
    second, both = "motorEffect.windage.b_q", {**STRIBECK, **WINDAGE}
    monkeypatch.setattr(room, "out_of_range", lambda fit: "c" if second in fit.unknowns.names else "")
    found = diagnosed(both, "windage", "stribeck")
    assert [s.candidate.effect.name for s in found.accepted] == ["stribeck"]
    assert found.notes == ("windage:motor was dropped: it drives c to the end of its range",)
    assert found.final is found.accepted[0].fit
    own = bench(candidates("windage", "stribeck"), both)
    (held,) = own.residuals(found.final.unknowns, found.final.vector[None, :], "validate")
    np.testing.assert_allclose(found.final_validate, held)
    monkeypatch.setattr(room, "out_of_range", lambda fit: "c" if len(fit.vector) > 4 else "")
    none = diagnosed(both, "windage", "stribeck")
    assert none.accepted == ()
    assert none.final is none.base
    assert len(none.notes) == 2


def test_what_cannot_be_simulated_without_the_dropped_effect_is_no_diagnosis(monkeypatch: pytest.MonkeyPatch):
    offered = candidates("windage")
    own = bench(offered, WINDAGE)
    real = own.residuals
    dropped: list[str] = []

    def ends(fit: Fit) -> str:
        dropped.append("c")
        return "c"

    def residuals(*given: Any) -> Any:
        return [None] if dropped else real(*given)

    monkeypatch.setattr(room, "out_of_range", ends)
    own.residuals = residuals  # type: ignore[method-assign]
    assert attribute(own, unknowns(), offered, lambda _: {}, seed=1) is None


def accepted_by_hand(true: Mapping[str, float], *names: str) -> tuple:
    """A bench with the ``true`` effects, and the best proposal of each of ``names`` taken for accepted in turn."""
    offered = candidates(*NAMES)
    own, declared = bench(offered, true), unknowns()
    base = refine(own, declared, declared.start, iterations=10)
    assert base is not None
    weights = ChannelWeights(own)
    base, held = weights.weigh(base)
    assert held is not None
    weights.base_held = held
    accepted: list[Scored] = []
    current = base
    for name in names:
        proposals = [p for p in screen(own, current, offered, {}) if p.candidate.name == name]
        one = score(own, current, held, proposals[0], iterations=6)
        assert one is not None
        accepted.append(one)
        current = one.fit
    wider = extended_unknowns(declared, accepted)
    final = refine(own, wider, current.at(wider.names), iterations=8)
    assert final is not None
    held = own.residuals(wider, final.vector[None, :], "validate")[0]
    return own, declared, weights, accepted, final, held


def test_an_earlier_effect_that_a_later_one_makes_needless_is_dropped():
    own, declared, weights, accepted, final, held = accepted_by_hand(
        STRIBECK, "windage:motor", "stribeck:motor"
    )
    kept, fit, _, notes = prune(own, declared, weights, accepted, final, held)
    assert [s.candidate.name for s in kept] == ["stribeck:motor"]
    assert "motorEffect.windage.b_q" not in fit.unknowns.names
    assert notes == ["windage:motor was dropped: the other effects explain the same"]


def test_all_that_became_needless_is_dropped_and_the_last_one_stays():
    own, declared, weights, accepted, final, held = accepted_by_hand(
        STRIBECK, "asymmetric-friction:motor", "windage:motor", "stribeck:motor"
    )
    kept, fit, _, notes = prune(own, declared, weights, accepted, final, held)
    assert [s.candidate.name for s in kept] == ["stribeck:motor"]
    assert set(fit.unknowns.names) == {*declared.names, *STRIBECK}
    assert len(notes) == 2


def test_a_needless_one_behind_a_needed_one_is_dropped_alone():
    own, declared, weights, accepted, final, held = accepted_by_hand(
        {**WINDAGE, **STRIBECK}, "windage:motor", "asymmetric-friction:motor", "stribeck:motor"
    )
    kept, _, _, notes = prune(own, declared, weights, accepted, final, held)
    assert [s.candidate.name for s in kept] == ["windage:motor", "stribeck:motor"]
    assert notes == ["asymmetric-friction:motor was dropped: the other effects explain the same"]


def test_what_cannot_be_fitted_without_an_effect_keeps_it():
    own, declared, weights, accepted, final, held = accepted_by_hand(
        STRIBECK, "windage:motor", "stribeck:motor"
    )
    own.residuals = lambda *_: [None]  # type: ignore[method-assign]
    kept, fit, _, notes = prune(own, declared, weights, accepted, final, held)
    assert (kept, notes) == (accepted, [])
    assert fit is final


def test_effects_that_are_both_needed_stay():
    own, declared, weights, accepted, final, held = accepted_by_hand(
        {**WINDAGE, **STRIBECK}, "windage:motor", "stribeck:motor"
    )
    kept, fit, _, notes = prune(own, declared, weights, accepted, final, held)
    assert kept == accepted
    assert fit is final
    assert notes == []


def test_an_effect_without_which_a_declared_parameter_ends_at_its_range_stays(
    monkeypatch: pytest.MonkeyPatch,
):
    """Else the later one, which then drives that parameter, would be dropped as well, and nothing be left of both."""
    own, declared, weights, accepted, final, held = accepted_by_hand(
        STRIBECK, "windage:motor", "stribeck:motor"
    )
    needed = "motorEffect.windage.b_q"
    monkeypatch.setattr(room, "out_of_range", lambda fit: "" if needed in fit.unknowns.names else "c")
    kept, fit, _, notes = prune(own, declared, weights, accepted, final, held)
    assert (kept, notes) == (accepted, [])
    assert fit is final


def test_what_was_fitted_beside_an_effect_that_was_dropped_since_is_fitted_again(
    monkeypatch: pytest.MonkeyPatch,
):
    """An effect's own fit holds those before it: it is no model of the ones that are left."""
    own, declared, _, accepted, final, held = accepted_by_hand(
        STRIBECK, "windage:motor", "asymmetric-friction:motor", "stribeck:motor"
    )
    last = "motorEffect.stribeck.dF"
    monkeypatch.setattr(room, "out_of_range", lambda fit: "c" if last in fit.unknowns.names else "")
    kept = within_range(own, declared, accepted[1:], final, final, held)
    assert kept is not None
    assert [s.candidate.name for s in kept[0]] == ["asymmetric-friction:motor"]
    assert set(kept[1].unknowns.names) == set(extended_unknowns(declared, kept[0]).names)
    (left,) = own.residuals(kept[1].unknowns, kept[1].vector[None, :], "validate")
    np.testing.assert_allclose(kept[2], left)


@pytest.mark.parametrize(("share", "stays"), [(0.009, False), (0.011, True)])
def test_an_effect_that_explains_less_than_a_hundredth_of_all_is_dropped(
    share: float, stays: bool, monkeypatch: pytest.MonkeyPatch
):
    own, declared, weights, accepted, final, held = accepted_by_hand(
        {**WINDAGE, **STRIBECK}, "windage:motor", "stribeck:motor"
    )
    explained = float(weights.base_held @ weights.base_held - held @ held)
    assert explained > 100.0
    monkeypatch.setattr(room, "block_gains", lambda *_: np.full(10, 0.1 * share * explained))
    kept, _, _, notes = prune(own, declared, weights, accepted, final, held)
    assert (len(kept) == 2) is stays
    assert bool(notes) is not stays


@pytest.mark.parametrize(("visible", "stays"), [(0.15, True), (100.0, False)])
def test_an_effect_whose_loss_would_be_visible_stays_however_little_it_is_beside_all(
    visible: float, stays: bool, monkeypatch: pytest.MonkeyPatch
):
    own, declared, weights, accepted, final, held = accepted_by_hand(
        {**WINDAGE, **STRIBECK}, "windage:motor", "stribeck:motor"
    )
    monkeypatch.setattr(room, "block_gains", lambda *_: np.full(10, 1.0))
    kept, *_ = prune(own, declared, weights, accepted, final, held, visible)
    assert (len(kept) == 2) is stays


def test_an_attribution_keeps_what_the_verdict_would_see(monkeypatch: pytest.MonkeyPatch):
    asked: list[float] = []
    monkeypatch.setattr(
        attribution,
        "prune",
        lambda *given: asked.append(given[6]) or (*given[3:6], []),  # type: ignore[func-returns-value]
    )
    assert len(diagnosed({**STRIBECK, **WINDAGE}, "windage", "stribeck").accepted) == 2
    assert asked == [VISIBLE_BESIDE]


RIPPLE = {
    "motorEffect.cogging.a_s": 0.25, "motorEffect.cogging.a_c": -0.1, "motorEffect.cogging.n": 12.0,
    "motorEffect.cogging.a_s3": 0.1, "motorEffect.cogging.n_3": 18.0,
    "motorEffect.cogging.a_c4": 0.07, "motorEffect.cogging.n_4": 7.0,
}  # fmt: skip


def test_a_ripple_of_several_orders_is_one_effect_with_all_of_them():
    """Orders that are no multiples of each other, each smaller than the last: one effect of ``most``."""
    offered = candidates(*NAMES)
    own = bench(offered, RIPPLE)
    waves = {"motor": (7.0, 12.0, 18.0, 31.0)}
    seen: list[Fit] = []

    def scan(fit: Fit) -> Mapping[str, tuple[float, ...]]:
        seen.append(fit)
        return waves

    found = attribute(own, unknowns(), offered, scan, seed=1, most=1)
    assert found is not None
    assert seen[0] is found.base
    assert [s.misfit for s in seen] == sorted((s.misfit for s in seen), reverse=True), (
        "each round its residual"
    )
    assert [s.candidate.name for s in found.accepted] == ["cogging:motor"] * 3
    machine = Machine({"motor": {"motor": 1.0}}, {"motor": 60.0})
    (effect,) = found_effects(found, found.final, machine)
    assert effect.order == "12, 18, 7 per turn of the motor"
    values = {name: value.value for name, value in effect.parameters.items()}
    assert values["a_s"] == pytest.approx(0.25, abs=0.01)
    assert {round(values["n_3"]), round(values["n_4"])} == {18, 7}
    assert "n_5" not in values, "no more orders than there are"
    np.testing.assert_allclose(np.mean(found.final_validate**2), 1.0, atol=0.1)


def test_a_further_order_is_offered_only_beside_the_first():
    offered = candidates("cogging")
    own = bench(offered, {})
    base = refine(own, unknowns(), unknowns().start)
    assert base is not None
    assert {p.candidate.variant.beside for p in screen(own, base, offered, {})} == {False}
