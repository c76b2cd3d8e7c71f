"""What is found in step: who joins where the free run is lost without it."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.analytic import bench, candidates, unknowns
from thsa_cosim.diagnosis.choosing import in_step as room
from thsa_cosim.diagnosis.choosing.attribution import Begun
from thsa_cosim.diagnosis.choosing.in_step import FURTHER, LEAST, LOST, SHARE, InStep
from thsa_cosim.diagnosis.choosing.orders import NO_MACHINE
from thsa_cosim.diagnosis.choosing.score import held_shapes
from thsa_cosim.diagnosis.choosing.screen import screen
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.fit import refine
from thsa_cosim.diagnosis.fitting.weights import ChannelWeights


def screened() -> tuple[Bench, Begun, Any]:
    """A drive that lacks a drag, what is found of it so far (nothing), and the last screening, with no choice."""
    offered = candidates("windage", "stribeck")
    own = bench(offered, {"motorEffect.windage.b_q": 2e-3}, 3, held_shapes(offered))
    base = refine(own, unknowns(), unknowns().start)
    assert base is not None
    (held,) = own.residuals(base.unknowns, base.vector[None, :], "validate")
    assert held is not None
    last = SimpleNamespace(accepted=None, proposals=screen(own, base, offered, {}), gains=np.zeros(3))
    return own, Begun((), (), base, held), SimpleNamespace(rounds=[last], final=base)


def further(own: Bench, found: Any, whole: Begun) -> Begun | None:
    asks: Any = SimpleNamespace(seed=1, say=lambda _: None)
    return InStep._further(asks, own, found, whole)


def test_what_promised_most_but_too_little_joins_in_front_with_its_fit():
    own, whole, found = screened()
    made = further(own, found, whole)
    assert made is not None
    (one,) = made.accepted
    assert one.candidate.key == found.rounds[-1].proposals[0].candidate.key
    assert one.candidate.name == "windage:motor"
    assert made.rounds[0].accepted is one
    assert made.fit is one.fit
    assert made.fit.misfit < 0.5 * whole.fit.misfit
    assert further(own, found, made) is None, "it is in the model already"


def test_nothing_joins_that_promises_too_little_or_where_the_last_screening_had_its_choice():
    own, whole, found = screened()
    gain = found.rounds[-1].proposals[0].gain
    much = SimpleNamespace(rounds=found.rounds, final=SimpleNamespace(misfit=1.01 * gain / FURTHER))
    assert further(own, much, whole) is None
    less = SimpleNamespace(rounds=found.rounds, final=SimpleNamespace(misfit=0.99 * gain / FURTHER))
    assert further(own, less, whole) is not None
    found.rounds[-1].accepted = object()
    assert further(own, found, whole) is None
    assert FURTHER < LEAST


@pytest.mark.parametrize(("before", "after"), [(12.0, 17.0), (17.0, 12.0)])
def test_the_order_that_showed_before_the_declared_parameters_were_fitted_in_step_is_tried_too(
    monkeypatch: pytest.MonkeyPatch, before: float, after: float
):
    """What they have taken up of a ripple leaves another order of it in the force."""
    offered = candidates("cogging")
    true = {"motorEffect.cogging.a_s": 0.25, "motorEffect.cogging.n": 12.0}
    own = bench(offered, true, 3, held_shapes(offered))
    base = refine(own, unknowns(), unknowns().start)
    assert base is not None
    weights = ChannelWeights(own)
    base, held = weights.weigh(base)
    assert held is not None
    asks: Any = InStep(own, None, unknowns(), offered, None, NO_MACHINE, 1, lambda _: None)  # type: ignore[arg-type]
    monkeypatch.setattr(InStep, "_order", lambda *_given: (after, 0.5))
    followed: Any = SimpleNamespace(slot=offered[0].slot)
    made = asks._ripple(own, followed, 1.0, before, weights, base, held)
    assert made is not None
    assert made.accepted[0].proposal.shapes["n"] == 12.0


def found_with(monkeypatch: pytest.MonkeyPatch, whole: Any, order: float) -> Any:
    """What is found where an ``order`` shows and ``whole`` is all that is found in step."""
    monkeypatch.setattr(room, "leaves_structure", lambda *_given: True)
    monkeypatch.setattr(room, "attribute", lambda *_given, **_more: object())
    monkeypatch.setattr(InStep, "_order", lambda *_given: (order, 2.0 * SHARE))
    monkeypatch.setattr(InStep, "_added", lambda *_given: None)
    monkeypatch.setattr(InStep, "_whole", lambda *_given: whole)
    following = SimpleNamespace(
        followed=lambda *_given: SimpleNamespace(slot=SimpleNamespace(is_angular=True), channel="w_m"),
        gain=lambda *_given: 10.0,
        at=lambda _gain: SimpleNamespace(weights={}),
    )
    asks: Any = InStep(None, following, None, (), None, None, 1, lambda _: None)  # type: ignore[arg-type]
    weights, base, held = SimpleNamespace(left=lambda _held: 1.0), SimpleNamespace(vector=None), np.zeros(1)
    return asks.found(weights, base, held)


@pytest.mark.parametrize("locks", [0, 1, None])
def test_the_free_run_is_tried_again_with_what_joined(monkeypatch: pytest.MonkeyPatch, locks: int | None):
    """``locks``: how many effects have to join before the free run does."""
    ripple = SimpleNamespace(candidate=candidates("cogging")[0])
    ways: list[Any] = [SimpleNamespace(accepted=(ripple,)) for _ in range(2)]
    freed = object()
    tried: list[object] = []

    def let_free(
        _self: InStep, _stepped: Bench, _gain: float, _weights: Any, whole: object, _left: float
    ) -> Any:
        tried.append(whole)
        return freed if locks is not None and whole is ways[locks] else None

    monkeypatch.setattr(InStep, "_further", lambda *_given: ways[1])
    monkeypatch.setattr(InStep, "_freed", let_free)
    made = found_with(monkeypatch, ways[0], order=12.0)
    assert tried == ways[: 2 if locks is None else locks + 1]
    if locks is None:
        assert made.accepted == (), "the search goes on from the declared model"
    else:
        assert made is freed


def test_where_nothing_repeats_with_the_position_the_model_is_not_let_free(monkeypatch: pytest.MonkeyPatch):
    other = SimpleNamespace(candidate=candidates("windage")[0])
    whole = SimpleNamespace(accepted=(other,))
    made = found_with(monkeypatch, whole, order=87.0)
    assert (made.accepted, made.rounds) == ((), ())


def test_what_was_found_beside_a_ripple_is_judged_in_step_where_the_free_run_is_lost():
    own, nothing, found = screened()
    whole = further(own, found, nothing)
    assert whole is not None
    asks: Any = SimpleNamespace(bench=own)
    made = InStep._judged_in_step(asks, whole)
    assert made is not None
    assert (made.in_step, made.accepted, made.rounds, made.notes) == (
        True,
        whole.accepted,
        whole.rounds,
        (LOST,),
    )
    assert made.fit.unknowns.names == whole.fit.unknowns.names
    (held,) = own.residuals(made.fit.unknowns, made.fit.vector[None, :], "validate")
    np.testing.assert_array_equal(made.held, held)
    ripple: Any = SimpleNamespace(candidate=candidates("cogging")[0])
    assert InStep._judged_in_step(asks, replace(whole, accepted=(ripple,))) is None, (
        "the free run finds that itself"
    )
    assert InStep._judged_in_step(asks, replace(whole, accepted=(ripple, *whole.accepted))) is not None
    own.residuals = lambda _u, vectors, _part: [None] * len(vectors)  # type: ignore[method-assign]
    assert InStep._judged_in_step(asks, whole) is None


@pytest.mark.parametrize(
    ("share", "before", "others", "found"),
    [
        (SHARE, 12.0, False, True),
        (0.9 * SHARE, 12.0, False, False),
        (SHARE, 13.0, False, True),
        (SHARE, 2.0, False, False),
        (SHARE, 2.0, True, True),
    ],
)
def test_a_ripple_that_was_outweighed_joins_what_was_found_if_its_order_still_shows(
    monkeypatch: pytest.MonkeyPatch, share: float, before: float, others: bool, found: bool
):
    """``before``: the order that showed in the beginning; an effect that was found since may have hidden the other."""
    offered = candidates("cogging")
    true = {"motorEffect.cogging.a_s": 0.25, "motorEffect.cogging.n": 12.0}
    own = bench(offered, true, 3, held_shapes(offered))
    base = refine(own, unknowns(), unknowns().start)
    assert base is not None
    (held,) = own.residuals(base.unknowns, base.vector[None, :], "validate")
    assert held is not None
    asks: Any = InStep(own, None, unknowns(), offered, None, NO_MACHINE, 1, lambda _: None)  # type: ignore[arg-type]
    monkeypatch.setattr(InStep, "_order", lambda *_given: (12.0, share))
    followed: Any = SimpleNamespace(slot=offered[0].slot)
    other = SimpleNamespace(candidate=candidates("windage")[0])
    so_far: Any = SimpleNamespace(
        rounds=(),
        accepted=(other,) if others else (),
        final=base,
        final_validate=held / own.factors("validate"),
    )
    made = asks._whole(own, followed, 1.0, so_far, before)
    joined = [s for s in made.accepted if s is not other]
    assert [s.candidate.variant.beside for s in joined] == ([False, True] if found else [])
    assert all(s.candidate.effect.name == "cogging" for s in joined)
