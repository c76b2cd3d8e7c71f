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
from thsa_cosim.diagnosis.choosing.attribution import Judged
from thsa_cosim.diagnosis.choosing.score import held_shapes, polish, score
from thsa_cosim.diagnosis.choosing.screen import propose
from thsa_cosim.diagnosis.choosing.self_excited import SHARES, SelfExcited
from thsa_cosim.diagnosis.fitting import continuation
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
    """Follows with any gain: the same recordings; notes the gains and which signals counted."""

    def __init__(self, own: Bench, gain: float | None = 10.0) -> None:
        self.own, self._gain = own, gain
        self.asked: list[tuple[float, bool]] = []

    def of(self, _slot: object) -> "Following":
        return self

    def gain(self, *_given: object) -> float | None:
        return self._gain

    def followed(self, *_given: object) -> SimpleNamespace:
        return SimpleNamespace(channel="i")

    def at(self, gain: float) -> Bench:
        self.asked.append((gain, True))
        return self.own

    def beside_signal(self, gain: float) -> Bench:
        self.asked.append((gain, False))
        return self.own


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


def continued(
    own: Bench,
    weights: ChannelWeights,
    found: Judged,
    following: Following,
    offered: Sequence[Candidate] = (),
) -> Any:
    return SelfExcited(own, following, offered, lambda _: None).continued(weights, found)  # type: ignore[arg-type]


def test_a_better_fit_comes_from_step_by_falling_gains_and_says_by_which_ways():
    own, weights, found = stuck()
    following = Following(own)
    made = continued(own, weights, found, following)
    assert made is not None
    (choice, fit, held), ways = made
    assert fit.cost < 0.9 * found[1].cost
    assert choice.fit is fit
    assert choice.validate is held
    values = fit.unknowns.named(fit.vector)
    assert values[f"{BLOCK}.v_S"] == pytest.approx(4.0, rel=0.15)
    assert choice.proposal is not found[0].proposal, "a round takes it for a new one"
    assert [w.fit.unknowns.names for w in ways] == [fit.unknowns.names] * len(SHARES)
    blind = [gain for gain, counts in following.asked if not counts]
    counted = [gain for gain, counts in following.asked if counts]
    assert blind == [share * 10.0 for share in SHARES], "there the followed signal does not count"
    assert counted == sorted(counted, reverse=True)
    assert max(counted) < min(blind)


def test_what_leaves_only_noise_rises_with_the_speed_or_cannot_follow_stays():
    own, weights, found = stuck(off=1.0)
    following = Following(own)
    assert continued(own, weights, found, following) is None
    own, weights, found = stuck("windage", off=30.0)
    assert continued(own, weights, found, following) is None
    own, weights, found = stuck()
    assert continued(own, weights, found, Following(own, gain=None)) is None
    assert not following.asked, "nothing was simulated for it"


def test_a_fit_in_step_that_promises_too_little_counts_for_nothing(monkeypatch: pytest.MonkeyPatch):
    own, weights, found = stuck()
    following = Following(own)
    monkeypatch.setattr(room, "PROMISE", 1.0)
    assert continued(own, weights, found, following) is None
    assert len(following.asked) == 1


def test_where_no_free_run_is_better_the_fit_stays_and_its_errors_hold_what_was_found_in_step(
    monkeypatch: pytest.MonkeyPatch,
):
    own, weights, found = stuck()
    before = own.weights
    for free in (None, found[1]):
        monkeypatch.setattr(room, "released", lambda *_given, free=free: free)
        made = continued(own, weights, found, Following(own))
        assert made is not None
        (choice, fit, held), ways = made
        assert (fit, held) == (found[1], found[2])
        assert (choice.candidate, choice.fit) == (found[0].candidate, found[1])
        assert choice.proposal is not found[0].proposal, "a round takes it for a new one"
        assert len(ways) == len(SHARES)
        for way in ways:
            values = way.fit.unknowns.named(way.fit.vector)
            assert values[f"{BLOCK}.v_S"] == pytest.approx(4.0, rel=0.15)
    assert own.weights is before


def test_no_gain_is_put_in_on_the_way_to_the_free_run(monkeypatch: pytest.MonkeyPatch):
    own, weights, found = stuck()
    following = Following(own)
    refined: list[float] = []  # misfits on the way

    def growing(_bench: Bench, *_given: object, **_more: object) -> SimpleNamespace:
        refined.append(1e-9 * 1.15 ** len(refined))
        return SimpleNamespace(**vars(found[1]), misfit=refined[-1], jacobian=found[1].jacobian)

    monkeypatch.setattr(continuation, "refine", growing)
    assert continued(own, weights, found, following) is not None
    assert len(refined) == len(continuation.SHARES) + 1


def test_forms_are_compared_in_step_and_the_best_one_is_gone_on_with():
    """A free run that is out of phase does not tell them apart; ``off`` 1 is the best fit of the wrong form."""
    own, weights, found = stuck(off=1.0, true=FRACTION)
    assert found[0].candidate.component != FORMS[1].component
    alone = continued(own, weights, found, Following(own))
    assert alone is None or alone[0][0].candidate is found[0].candidate
    made = continued(own, weights, found, Following(own), FORMS)
    assert made is not None
    (choice, fit, _held), ways = made
    assert choice.candidate is FORMS[1]
    values = fit.unknowns.named(fit.vector)
    assert values[FORMS[1].parameters[0].variable] == pytest.approx(0.6, rel=0.1)
    assert choice.proposal.shapes.keys() == {"v_S"}
    assert not any(p.variable in values for p in FORMS[0].parameters if p.variable not in FRACTION)
    assert all(w.fit.unknowns.names == fit.unknowns.names for w in ways)
    assert fit.cost < found[1].cost
    own, weights, found = stuck()
    made = continued(own, weights, found, Following(own), FORMS)
    assert made is not None
    assert made[0][0].candidate is found[0].candidate, "the form that is true stays"
