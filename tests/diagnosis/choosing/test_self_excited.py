"""A friction that falls over the speed: when it is fitted in step, and what has to come of it."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.analytic import bench, candidates, unknowns
from thsa_cosim.diagnosis.catalogue.candidate import Candidate
from thsa_cosim.diagnosis.choosing import self_excited as room
from thsa_cosim.diagnosis.choosing.attribution import (
    IS_ALL,
    NO_MORE,
    Continued,
    Judged,
    Round,
    _of_one_effect,
    attribute,
)
from thsa_cosim.diagnosis.choosing.orders import NO_MACHINE
from thsa_cosim.diagnosis.choosing.score import held_shapes, polish, score
from thsa_cosim.diagnosis.choosing.screen import propose
from thsa_cosim.diagnosis.choosing.self_excited import TOLERANCE, SelfExcited
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.fit import Fit, refine
from thsa_cosim.diagnosis.fitting.weights import ChannelWeights

BLOCK = "motorEffect.stribeck"
CURVE = {f"{BLOCK}.dF": 0.6, f"{BLOCK}.v_S": 4.0, f"{BLOCK}.n": 1.0}


FORMS = tuple(c for c in candidates("stribeck") if c.slot.name == "motor" and not c.variant.beside)
FRACTION = {
    f"{FORMS[1].slot.component}.{FORMS[1].component}.{name}": x for name, x in (("dF", 0.6), ("v_S", 4.0))
}


class Following:
    """Follows with any gain: the same recordings; notes what was asked for."""

    def __init__(self, own: Bench, gain: float | None = 10.0) -> None:
        self.own, self._gain = own, gain
        self.asked: list[float] = []
        self.fine: list[Bench] = []

    def of(self, _slot: object) -> "Following":
        return self

    def gain(self, *_given: object) -> float | None:
        return self._gain

    def followed(self, *_given: object) -> SimpleNamespace:
        return SimpleNamespace(channel="i")

    def beside_signal(self, gain: float) -> Bench:
        self.asked.append(gain)
        return self._copy()

    def at(self, gain: float) -> Bench:
        return self._copy()

    def finer(self, tolerance: float) -> Bench:
        assert tolerance == TOLERANCE
        self.fine.append(self._copy())
        return self.fine[-1]

    def _copy(self) -> Bench:
        return self.own.beside(self.own._engine._runner, self.own.trials, {})


def stuck(
    effect: str = "stribeck", off: float = 1.5, true: Mapping[str, float] = CURVE
) -> tuple[Bench, ChannelWeights, Judged]:
    """A Stribeck friction whose accepted fit is ``off`` by a factor in its shape, as one that is out of phase is."""
    one = next(c for c in candidates(effect) if c.slot.name == "motor" and not c.variant.beside)
    offered = (one, *FORMS[1:]) if effect == "stribeck" else (one,)
    own = bench(offered, true if effect == "stribeck" else {}, 3, held_shapes(offered))
    base = refine(own, unknowns(), unknowns().start)
    assert base is not None
    (held,) = own.residuals(base.unknowns, base.vector[None, :], "validate")
    assert held is not None
    shapes = {p.name: CURVE[p.variable] for p in one.shapes if p.variable in CURVE}
    (proposal,) = propose(own, base, [(one, shapes)])
    scored = score(own, base, held, proposal)
    assert scored is not None
    scored = polish(own, scored, base, held)
    vector = scored.fit.vector.copy()
    vector[-len(one.parameters) :] *= off
    found = at(own, scored.fit, vector)
    (left,) = own.residuals(found.unknowns, vector[None, :], "validate")
    assert left is not None
    weights = ChannelWeights(own)
    weights.base_held = held
    return own, weights, (replace(scored, fit=found), found, left)


def at(own: Bench, fit: Fit, vector: np.ndarray) -> Fit:
    (residual,) = own.residuals(fit.unknowns, vector[None, :], "fit")
    assert residual is not None
    prior = fit.unknowns.prior(vector)
    return replace(fit, vector=vector, residual=residual, cost=float(residual @ residual + prior @ prior))


def way(own: Bench, following: Following, offered: Sequence[Candidate] = ()) -> SelfExcited:
    return SelfExcited(own, following, unknowns(), offered, lambda _: {}, NO_MACHINE, 1, lambda _: None)  # type: ignore[arg-type]


def continued(
    own: Bench,
    weights: ChannelWeights,
    found: Judged,
    following: Following,
    offered: Sequence[Candidate] = (),
) -> Any:
    return way(own, following, offered).continued(weights, found)


def test_a_better_fit_comes_from_step_by_spectra_and_is_gone_on_with_at_a_finer_tolerance():
    own, weights, found = stuck()
    following = Following(own)
    before = own.evaluations
    made = continued(own, weights, found, following)
    assert made is not None
    (choice, fit, held), ways = made.found, made.ways
    assert fit.cost < 0.9 * found[1].cost
    assert choice.fit is fit
    assert choice.validate is held
    values = fit.unknowns.named(fit.vector)
    assert values[f"{BLOCK}.v_S"] == pytest.approx(4.0, rel=0.15)
    assert choice.proposal is not found[0].proposal, "a round takes it for a new one"
    assert [w.fit.unknowns.names for w in ways] == [fit.unknowns.names]
    assert following.asked == [10.0], "in step the followed signal does not count"
    (fine,) = following.fine
    assert own._engine is fine._engine
    assert own.evaluations > before + fine.evaluations - 1, "what ran before counts, and nothing twice"


@pytest.mark.parametrize(
    ("lost", "led"), [((0.0, 9, 9), False), ((99, 0.0, 9), False), ((99, 9, 0.0), False), ((99, 9, 9), True)]
)
def test_the_way_is_given_up_where_spectra_stay_far_from_noise(
    monkeypatch: pytest.MonkeyPatch, lost: tuple[float, float, float], led: bool
):
    own, weights, found = stuck()
    monkeypatch.setattr(room, "LOST", lost)
    made = continued(own, weights, found, Following(own))
    assert (made.found[1] is not found[1]) == led


def test_what_leaves_only_noise_rises_with_the_speed_or_cannot_follow_stays():
    own, weights, found = stuck(off=1.0)
    following = Following(own)
    assert continued(own, weights, found, following) is None
    own, weights, found = stuck("windage", off=30.0)
    assert continued(own, weights, found, following) is None
    own, weights, found = stuck()
    assert continued(own, weights, found, Following(own, gain=None)) is None
    assert not following.asked, "nothing was simulated for it"


def test_what_cannot_be_fitted_in_step_counts_for_nothing(monkeypatch: pytest.MonkeyPatch):
    own, weights, found = stuck()
    following = Following(own)
    monkeypatch.setattr(room, "refine", lambda *_given, **_more: None)
    assert continued(own, weights, found, following) is None
    assert not following.fine


@pytest.mark.parametrize("freed", ["nothing runs", "no better", "insignificant", "no held-out run"])
def test_where_no_free_run_is_better_the_fit_stays_and_its_errors_hold_what_was_found_in_step(
    monkeypatch: pytest.MonkeyPatch, freed: str
):
    own, weights, found = stuck()
    engine, before = own._engine, own.weights
    better = replace(found[1], cost=0.0)
    monkeypatch.setattr(
        SelfExcited,
        "_freed",
        lambda _self, _fine, stepped: {
            "nothing runs": None,
            "no better": replace(stepped, fit=found[1]),
        }.get(freed, replace(stepped, fit=better)),
    )
    if freed == "insignificant":
        monkeypatch.setattr(room, "insignificant", lambda _one: "its interval includes zero")
    if freed == "no held-out run":
        run = Bench.residuals
        monkeypatch.setattr(
            Bench,
            "residuals",
            lambda self, u, v, part: [None] if part == "validate" else run(self, u, v, part),
        )
    made = continued(own, weights, found, Following(own))
    assert made is not None
    (choice, fit, held), ways = made.found, made.ways
    assert (fit, held) == (found[1], found[2])
    assert (choice.candidate, choice.fit) == (found[0].candidate, found[1])
    assert choice.proposal is not found[0].proposal, "a round takes it for a new one"
    (way,) = ways
    values = way.fit.unknowns.named(way.fit.vector)
    assert values[f"{BLOCK}.v_S"] == pytest.approx(4.0, rel=0.15)
    assert own.weights is before
    assert own._engine is engine


def test_where_the_new_weights_lead_it_astray_the_fit_stays_as_it_was_found(monkeypatch: pytest.MonkeyPatch):
    own, weights, found = stuck()
    before = own.weights
    astray: list[Fit] = []
    weigh = ChannelWeights.weigh

    def led(self: ChannelWeights, fit: Fit) -> Any:
        astray.append(fit)
        again, held = weigh(self, fit)
        return replace(again, vector=again.vector * 0.0), held

    monkeypatch.setattr(ChannelWeights, "weigh", led)
    made = continued(own, weights, found, Following(own))
    assert made is not None
    (choice, fit, held), _ways = made.found, made.ways
    assert fit is choice.fit is astray[0]
    assert held is choice.validate
    assert own.weights == before


DRAG = {f"motorEffect.windage.{name}": x for name, x in (("b_q", 1.5e-3), ("n", 2.0), ("v_r", 30.0))}


def with_drag() -> tuple[Bench, ChannelWeights, Judged, tuple[Candidate, ...]]:
    """A Stribeck friction that was accepted alone, of a machine with a drag beside it."""
    offered = tuple(c for c in candidates("stribeck", "windage") if c.slot.name == "motor")
    own = bench(offered, {**CURVE, **DRAG}, 3, held_shapes(offered))
    _own, _weights, (one, _, _) = stuck()
    base = refine(own, unknowns(), unknowns().start)
    assert base is not None
    fit = refine(own, one.fit.unknowns, one.fit.vector)
    assert fit is not None
    held, alone = (own.residuals(f.unknowns, f.vector[None, :], "validate")[0] for f in (base, fit))
    assert held is not None
    assert alone is not None
    weights = ChannelWeights(own)
    weights.base_held = held
    fit, again = weights.weigh(fit)
    assert again is not None
    return own, weights, (replace(one, fit=fit), fit, again), offered


def test_what_else_is_missing_is_found_in_step_and_runs_freely_with_it():
    own, weights, found, offered = with_drag()
    made = way(own, Following(own), offered).continued(weights, found)
    assert made is not None
    (beside,) = made.beside
    assert beside.candidate.name == "windage:motor"
    assert [r.accepted for r in made.rounds] == [beside]
    _choice, fit, _held = made.found
    values = fit.unknowns.named(fit.vector)
    assert values["motorEffect.windage.b_q"] == pytest.approx(1.5e-3, rel=0.2)
    assert values[f"{BLOCK}.dF"] == pytest.approx(0.6, rel=0.1)
    assert (made.left, made.note) == ((), IS_ALL), "then nothing but noise is left in step"


def test_what_was_found_in_step_counts_only_if_the_free_run_is_better_with_it_which_is_asked_for_it(
    monkeypatch: pytest.MonkeyPatch,
):
    own, weights, found, offered = with_drag()
    monkeypatch.setattr(SelfExcited, "_freed", lambda *_given: None)
    made = way(own, Following(own), offered).continued(weights, found)
    assert made is not None
    assert (made.found[1], made.beside, made.rounds) == (found[1], (), ())
    assert made.left is not None
    assert ([c.effect.name for c in made.left], made.note) == (["windage"], NO_MORE)


def test_nothing_further_is_asked_of_a_free_run_that_does_not_show_in_step():
    own, weights, found, _offered = with_drag()
    made = continued(own, weights, found, Following(own))
    assert made is not None
    assert (made.beside, made.left, made.note) == ((), [], NO_MORE)


def test_what_explains_the_held_out_recordings_as_well_in_step_is_a_tie():
    own, weights, found, _offered = with_drag()
    drags = [c for c in candidates("windage") if c.slot.name == "motor" and not c.variant.instead]
    (drag,) = drags
    twin = replace(drag, effect=replace(drag.effect, name="twin"))
    made = way(own, Following(own), (drag, twin)).continued(weights, found)
    assert made is not None
    (one,) = made.rounds
    assert one.accepted is not None
    named = {one.accepted.candidate.effect.name, *(r.candidate.effect.name for r in one.rivals)}
    assert named == {"windage", "twin"}


def test_the_same_friction_is_no_second_one():
    own, weights, found, _offered = with_drag()
    elsewhere = [c for c in candidates("stribeck") if c.slot.name == "gear"]
    made = way(own, Following(own), elsewhere).continued(weights, found)
    assert made is not None
    assert (made.rounds, made.beside, made.left) == ((), (), [])


def test_what_hardly_counted_counts_again_beside_what_else_is_missing():
    _own, _weights, found = stuck()
    fit = found[1]
    factors = np.linspace(0.5, 2.0, fit.residual.size)
    made = room._weighed(room._weighed(fit, 1e-3 * factors), 1e3 / factors)
    np.testing.assert_allclose(made.residual, fit.residual)
    np.testing.assert_allclose(made.jacobian, fit.jacobian)
    assert made.cost == pytest.approx(fit.cost)
    light = room._weighed(fit, np.full(fit.residual.size, 1e-3))
    prior = fit.unknowns.prior(fit.vector)
    assert light.cost == pytest.approx(1e-6 * (fit.residual @ fit.residual) + prior @ prior)
    np.testing.assert_allclose(light.jacobian, 1e-3 * fit.jacobian)


def test_what_does_nothing_to_any_other_signal_hides_in_step():
    own, _weights, _found, offered = with_drag()
    (one, *_), size = offered, sum(c.measured.size for c in own.of("fit")[0].case.channels)
    other = next(c for c in candidates("stribeck") if c.slot.name == "gear")
    first = own.of("fit")[0].case.channels[0]
    names = np.concatenate([np.full(c.measured.size, c.name) for c in own.of("fit")[0].case.channels])
    hides = np.where(names == first.name, 1.0, 0.0)[:, None]
    shows = np.where(names == first.name, 1.0, 0.1)[:, None]
    assert hides.shape == (size, 1)
    proposals: Any = [SimpleNamespace(candidate=c, response=r) for c, r in ((one, hides), (other, shows))]
    assert room._hidden(proposals, own, first.name) == [one]
    proposals.append(SimpleNamespace(candidate=one, response=shows))
    assert room._hidden(proposals, own, first.name) == [], "another start of it shows"


def test_a_candidate_that_is_continued_and_one_that_hides_are_fitted_roughly(monkeypatch: pytest.MonkeyPatch):
    own, _weights, _found, offered = with_drag()
    asked: list[tuple[int, ...]] = []
    weigh = ChannelWeights.weigh

    def counted(self: ChannelWeights, fit: Fit, *iterations: int) -> Any:
        asked.append(iterations)
        return weigh(self, fit, *iterations)

    monkeypatch.setattr(ChannelWeights, "weigh", counted)
    drags = [c for c in offered if c.effect.name == "windage"]
    attribute(
        own,
        unknowns(),
        [c for c in offered if c.effect.name == "stribeck"],
        lambda _: {},
        seed=1,
        rough=lambda one: one.candidate.effect.name == "stribeck",
        continued=lambda _weights, one: (
            Continued(one, (), drags, NO_MORE) if one[0].candidate.effect.name == "stribeck" else None
        ),
    )
    assert asked == [(), (0,), (0,)], "the declared model, the friction, and the drag"


def test_beside_what_was_found_with_it_only_other_places_are_rivals_of_an_effect():
    def one(effect: str) -> Any:
        return SimpleNamespace(candidate=SimpleNamespace(effect=SimpleNamespace(name=effect)))

    place, other = one("stribeck"), one("windage")
    own: Any = Round(0.0, (), (), None, (), (other, place), np.zeros(0), np.zeros(0))
    assert _of_one_effect(own, one("stribeck")).rivals == (place,)


def test_it_is_for_what_falls_leaves_much_and_can_follow():
    own, _weights, (one, _, _) = stuck(off=3.0)
    assert way(own, Following(own)).is_for(one)
    assert not way(own, Following(own, gain=None)).is_for(one)
    own, _weights, (one, _, _) = stuck(off=1.0)
    assert not way(own, Following(own)).is_for(one)
    own, _weights, (one, _, _) = stuck("windage", off=30.0)
    assert not way(own, Following(own)).is_for(one)


def test_what_was_found_beside_an_effect_is_accepted_with_it_and_its_rounds_count():
    own, _weights, _found, offered = with_drag()

    def led(given: ChannelWeights, judged: Judged) -> Continued | None:
        return way(own, Following(own), offered).continued(given, judged)

    stribeck = [c for c in offered if c.effect.name == "stribeck"]
    drags = [c for c in offered if c.effect.name == "windage"]
    made = attribute(own, unknowns(), stribeck, lambda _: {}, seed=1, continued=led)
    assert made is not None
    assert drags
    assert [s.candidate.name for s in made.accepted] == ["stribeck:motor", "windage:motor"]
    assert [r.accepted.candidate.name for r in made.rounds if r.accepted] == [
        "stribeck:motor",
        "windage:motor",
    ]


@pytest.mark.parametrize("is_all", [True, False])
def test_nothing_further_is_looked_for_where_nothing_else_is_missing_in_step(is_all: bool):
    offered = tuple(c for c in candidates("stribeck", "windage") if c.slot.name == "motor")
    own = bench(offered, {**CURVE, **DRAG}, 3, held_shapes(offered))
    found = attribute(
        own,
        unknowns(),
        offered,
        lambda _: {},
        seed=1,
        continued=lambda _weights, one: Continued(one, (), () if is_all else None, IS_ALL if is_all else ""),
    )
    assert found is not None
    assert len(found.accepted) == (1 if is_all else 2)
    assert (IS_ALL in found.notes) == is_all


def test_in_step_nothing_else_is_missing_if_only_noise_is_left_in_every_signal():
    own, _weights, found = stuck(off=1.0)
    assert room._leaves_noise(own, found[1])
    off = found[1].vector.copy()
    off[found[1].unknowns.names.index("R")] *= 1.02
    assert not room._leaves_noise(own, replace(found[1], vector=off))


def test_what_moves_in_the_ensemble_is_neither_known_nor_unknowable():
    _own, _weights, found = stuck()
    fit = found[1]
    members = fit.unknowns.members
    errors = {"R": 0.001, "K": 0.02, "c": 0.95, "b": 0.5}
    stderr = np.array([errors.get(u.name, 0.1) * u.scale for u in members])
    stepped = SimpleNamespace(unknowns=fit.unknowns, stderr=lambda: stderr)
    spreads = room._spreads(fit.unknowns, fit.vector, stepped)  # type: ignore[arg-type]
    for u, x, spread in zip(members, fit.vector, spreads, strict=True):
        wanted = {"R": 0.0, "K": 0.5 * u.spread, "c": 0.0, "b": 0.5 * u.spread}
        assert spread == pytest.approx(wanted.get(u.name, 0.1 * abs(x)))


def test_forms_are_compared_by_spectra_and_the_best_one_is_gone_on_with():
    """A free run that is out of phase does not tell them apart; ``off`` 1 is the best fit of the wrong form."""
    own, weights, found = stuck(off=1.0, true=FRACTION)
    assert found[0].candidate.component != FORMS[1].component
    alone = continued(own, weights, found, Following(own))
    assert alone is None or alone.found[0].candidate is found[0].candidate
    made = continued(own, weights, found, Following(own), FORMS)
    assert made is not None
    (choice, fit, _held), ways = made.found, made.ways
    assert choice.candidate is FORMS[1]
    values = fit.unknowns.named(fit.vector)
    assert values[FORMS[1].parameters[0].variable] == pytest.approx(0.6, rel=0.1)
    assert choice.proposal.shapes.keys() == {"v_S"}
    assert not any(p.variable in values for p in FORMS[0].parameters if p.variable not in FRACTION)
    assert [w.candidate for w in ways] == [found[0].candidate], (
        "only the form that was found is fitted in step"
    )
    assert fit.cost < found[1].cost
    own, weights, found = stuck()
    made = continued(own, weights, found, Following(own), FORMS)
    assert made is not None
    assert made.found[0].candidate is found[0].candidate, "the form that is true stays"


def test_the_recording_that_leaves_most_is_looked_at_alone():
    own, _weights, found, _offered = with_drag()
    trial = next(t for t in own.trials if t.part == "fit")
    channels = [replace(c, measured=c.measured + 5.0 * c.noise) for c in trial.case.channels]
    worse = replace(trial, case=replace(trial.case, channels=tuple(channels)))
    own.trials = (*own.trials, worse)
    size, fit = found[1].residual.size, found[1]
    both = replace(
        fit,
        residual=np.concatenate([fit.residual, fit.residual - 5.0]),
        own=np.concatenate([fit.jacobian, 2.0 * fit.jacobian]),
        shared=None,
    )
    alone, part = room._worst(own, both)
    assert alone.trials == (worse,)
    np.testing.assert_array_equal(part.residual, both.residual[size:])
    np.testing.assert_array_equal(part.jacobian, 2.0 * fit.jacobian)
    prior = fit.unknowns.prior(fit.vector)
    assert part.cost == pytest.approx(part.misfit + prior @ prior)
    before = own.evaluations
    (residual,) = alone.residuals(fit.unknowns, fit.vector[None, :], "fit")
    assert residual is not None
    assert residual.size == size
    assert own.evaluations == before + 1, "its runs count"


def test_what_promises_little_in_that_recording_is_not_looked_at_in_the_others(
    monkeypatch: pytest.MonkeyPatch,
):
    own, weights, found, offered = with_drag()
    monkeypatch.setattr(room, "GLANCE", np.inf)
    made = way(own, Following(own), offered).continued(weights, found)
    assert made is not None
    assert (made.beside, made.rounds, made.left) == ((), (), [])


@pytest.mark.parametrize(("n", "others"), [(2.5, [1.0, 2.0]), (2.2, [1.0]), (1.1, [2.0]), (1.5, [1.0, 2.0])])
def test_every_form_sets_out_from_the_exponents_of_the_literature_with_the_curve_nearest_in_step(
    n: float, others: list[float]
):
    own, _weights, (one, fit, _) = stuck()
    vector = fit.vector.copy()
    vector[fit.unknowns.names.index(f"{BLOCK}.n")] = n
    ways = list(way(own, Following(own), FORMS)._starts(one, at(own, fit, vector)))
    keys = [w.candidate.key for w, *_ in ways]
    assert keys == [FORMS[0].key] * (1 + len(others)) + [FORMS[1].key]
    (_, _, first, _), *rest = ways
    np.testing.assert_array_equal(first, vector)
    speeds = {"v": np.linspace(0.3, 30.0, 50), "s": np.ones(50)}

    def force(scored: Any, unknowns: Any, x: np.ndarray) -> np.ndarray:
        values = unknowns.named(x)
        law = scored.candidate.variant.law
        return np.asarray(law({p.name: values[p.variable] for p in scored.candidate.parameters}, speeds))

    declared = fit.unknowns.names[: -len(one.candidate.parameters)]
    for scored, members, x, steps in rest:
        assert steps.shape == x.shape == (len(members.names),)
        values = members.named(x)
        assert [values[name] for name in declared] == [fit.unknowns.named(vector)[name] for name in declared]
        aim = force(ways[0][0], fit.unknowns, vector)
        assert np.max(np.abs(force(scored, members, x) - aim)) < 0.35 * np.max(np.abs(aim))
    exponents = [u.named(x)[f"{BLOCK}.n"] for s, u, x, _ in rest if s.candidate.key == FORMS[0].key]
    assert exponents == pytest.approx(others)


def test_beside_a_form_without_an_exponent_the_other_one_sets_out_from_those_of_the_literature():
    assert room._exponents(FORMS[1], FORMS[1], {}) == []
    assert room._exponents(FORMS[0], FORMS[1], {}) == [{"n": 1.0}, {"n": 2.0}]
    assert room._exponents(FORMS[1], FORMS[0], {f"{BLOCK}.n": 1.0}) == [{}]
