"""Curves over the speed: the nearest one of another exponent or form, and the fits that set out from there."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from diagnosis.analytic import bench, candidates, unknowns
from thsa_cosim.diagnosis.catalogue.candidate import Candidate
from thsa_cosim.diagnosis.choosing.curves import EXPONENTS, along_exponents, falls, nearest
from thsa_cosim.diagnosis.choosing.score import Scored, held_shapes, judge, polish, score
from thsa_cosim.diagnosis.choosing.screen import propose
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.fit import Fit, refine
from thsa_cosim.signals import FloatArray

SPEED = np.linspace(0.5, 30.0, 400)
BLOCK = "motorEffect.stribeck"
CURVE = {f"{BLOCK}.dF": 0.6, f"{BLOCK}.v_S": 4.0, f"{BLOCK}.n": 1.0}


def at_motor(effect: str, component: str) -> Candidate:
    return next(c for c in candidates(effect) if c.slot.name == "motor" and c.component == component)


def over_speed(candidate: Candidate, values: dict[str, float]) -> np.ndarray:
    law = candidate.variant.law
    assert law is not None
    own = {p.name: values[p.variable] for p in candidate.parameters}
    return law(own, {"v": SPEED, "s": np.ones(SPEED.size)})


def test_the_nearest_curve_of_its_own_exponent_is_the_curve_itself():
    stribeck = at_motor("stribeck", "stribeck")
    assert nearest(stribeck, {"n": 1.0}, stribeck, CURVE) == pytest.approx(CURVE, rel=1e-6)


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_the_nearest_curve_of_another_exponent_is_nearer_than_a_change_of_the_exponent_alone(exponent: float):
    stribeck = at_motor("stribeck", "stribeck")
    found = nearest(stribeck, {"n": exponent}, stribeck, CURVE)
    assert found is not None
    aim = over_speed(stribeck, CURVE)
    off = np.linalg.norm(over_speed(stribeck, found) - aim)
    assert found[f"{BLOCK}.n"] == exponent
    alone = np.linalg.norm(over_speed(stribeck, {**CURVE, f"{BLOCK}.n": exponent}) - aim)
    assert off <= 0.7 * alone


def test_a_fraction_has_a_nearest_exponential_and_the_other_way_round():
    stribeck, fraction = at_motor("stribeck", "stribeck"), at_motor("stribeck", "hessSoom")
    there = nearest(fraction, {}, stribeck, CURVE)
    assert there is not None
    aim = over_speed(stribeck, CURVE)
    assert np.linalg.norm(over_speed(fraction, there) - aim) < 0.3 * np.linalg.norm(aim)
    back = nearest(stribeck, {"n": 1.0}, fraction, there)
    assert back is not None
    assert back[f"{BLOCK}.v_S"] == pytest.approx(4.0, rel=0.3)


def test_a_law_of_more_than_the_speed_has_no_curve():
    stribeck, drag = at_motor("stribeck", "stribeck"), at_motor("windage", "windage")
    assert nearest(drag, {}, stribeck, CURVE) is None, "its coefficient has no counterpart"
    loaded = [c for c in candidates("load-dependent-friction") if c.slot.name == "motor"]
    values = {p.variable: p.typical for c in loaded for p in c.all_parameters}
    assert all(nearest(c, {}, c, values) is None for c in loaded)


def fitted(exponent: float) -> tuple[SimpleNamespace, Scored]:
    """A Stribeck friction of an exponential with exponent 1, fitted from and with a prescribed ``exponent``."""
    stribeck = at_motor("stribeck", "stribeck")
    own: Bench = bench((stribeck,), CURVE, 3, held_shapes((stribeck,)))
    base = refine(own, unknowns(), unknowns().start)
    assert base is not None
    (held,) = own.residuals(base.unknowns, base.vector[None, :], "validate")
    assert held is not None
    (proposal,) = propose(own, base, [(stribeck, {"v_S": 4.0, "n": exponent})])
    one = score(own, base, held, replace(proposal, held=frozenset({"n"})))
    assert one is not None
    one = polish(own, one, base, held)
    return SimpleNamespace(bench=own, current=base, held=held), freed(own, one, base, held)


def freed(own: Bench, one: Scored, base: Fit, held: FloatArray) -> Scored:
    """The same where the exponent is free, not fitted any further."""
    members = tuple(
        replace(u, spread=np.inf, start=1.5) if u.name.endswith(".n") else u for u in one.fit.unknowns.members
    )
    fit = replace(one.fit, unknowns=replace(one.fit.unknowns, members=members))
    judged = judge(own, replace(one.proposal, held=frozenset()), fit, base, held)
    assert judged is not None
    return judged


def test_a_fit_that_has_stayed_at_a_wrong_exponent_is_led_to_the_right_one():
    selection, stuck = fitted(2.5)
    found = along_exponents(selection, stuck, stuck)  # type: ignore[arg-type]
    values = found.fit.unknowns.named(found.fit.vector)
    assert values[f"{BLOCK}.n"] == pytest.approx(1.0, abs=0.1)
    assert found.fit.cost < stuck.fit.cost - 10.0
    assert found.held_out_gain > stuck.held_out_gain


def test_a_fit_that_no_other_exponent_betters_is_kept():
    selection, stuck = fitted(2.5)
    found = along_exponents(selection, stuck, stuck)  # type: ignore[arg-type]
    again = along_exponents(selection, found, found)  # type: ignore[arg-type]
    assert found.fit.cost - again.fit.cost < 0.1


def test_a_stribeck_friction_falls_over_the_speed_and_a_drag_does_not():
    values = {**CURVE, "motorEffect.hessSoom.dF": 0.6, "motorEffect.hessSoom.v_S": 4.0}
    assert falls(at_motor("stribeck", "stribeck"), values)
    assert falls(at_motor("stribeck", "hessSoom"), values)
    assert not falls(at_motor("stribeck", "stribeck"), {**CURVE, f"{BLOCK}.dF": 0.0})
    for other in candidates("windage", "asymmetric-friction", "load-dependent-friction"):
        assert not falls(other, {p.variable: p.typical or 1.0 for p in other.parameters})
