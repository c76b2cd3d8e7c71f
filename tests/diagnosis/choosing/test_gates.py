"""Every gate by itself, on numbers made up by hand: just passed, just missed."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from thsa_cosim.diagnosis.choosing.gates import (
    MOST_TRIED,
    Evidence,
    insignificant,
    near_best,
    objection,
    objection_beside,
    out_of_range,
    signal_share,
)
from thsa_cosim.diagnosis.fitting.fit import Fit
from thsa_cosim.diagnosis.fitting.unknowns import Unknown, Unknowns

LIMIT = 17.0
#: Just passes every gate as a first effect.
PASSES = Evidence("windage:motor", LIMIT, LIMIT, 3.0, 0.08**2, 0.15, 0.1)
MISSES = {
    "fit_gain": (16.9, "gains no more than chance on the held-out recordings"),
    "held_out_gain": (16.9, "gains no more than chance on the held-out recordings"),
    "consistency": (2.99, "its held-out gain is within 3 standard errors of chance"),
    "left": (0.0799**2, "what is left is too small against the noise to be worth an effect"),
    "share": (0.114, "explains 11 % of what is left, less than 15 %"),
    "signal_share": (0.0999, "explains less than 10 % of what the declared model left in any signal"),
}


def test_what_passes_every_gate_has_no_objection():
    assert objection(PASSES, LIMIT, True) == ""


@pytest.mark.parametrize("name", MISSES)
def test_each_gate_refuses_and_says_why(name: str):
    value, says = MISSES[name]
    found = objection(replace(PASSES, **{name: value}), LIMIT, True)
    between = {"left": "", "consistency": "windage:motor: "}.get(name, "windage:motor ")
    assert found == between + says


def test_what_is_small_beside_the_first_effect_must_leave_nothing_to_be_seen():
    """A wrong effect may take up part of another one's misfit; it does not take up all of it."""
    small = replace(PASSES, signal_share=0.001, share=0.9, visible=False)
    says = "windage:motor explains less than 10 % of what the declared model left in any signal"
    assert objection(small, LIMIT, False) == ""
    assert objection(replace(small, share=0.899), LIMIT, False) == says
    assert objection(replace(small, visible=True), LIMIT, False) == says
    assert objection(replace(small, was_visible=False), LIMIT, False) == says


def test_a_further_effect_has_to_explain_more():
    assert "explains 19 % of what is left, less than 20 %" in objection(
        replace(PASSES, share=0.19), LIMIT, False
    )
    assert objection(replace(PASSES, share=0.19), LIMIT, True) == ""
    assert objection(replace(PASSES, share=0.2), LIMIT, False) == ""


def test_a_further_part_of_an_effect_is_judged_by_its_gain_and_not_by_its_share():
    """The seventh order of a ripple explains little of what the declared model left, and is there all the same."""
    part = replace(PASSES, share=0.0, signal_share=0.0, visible=True)
    assert objection_beside(part, LIMIT) == ""
    for name in ("fit_gain", "held_out_gain", "consistency", "left"):
        value, says = MISSES[name]
        assert says in objection_beside(replace(part, **{name: value}), LIMIT)


def test_the_share_of_a_signal_is_that_of_the_one_that_gains_most():
    samples = 20000
    channels = [SimpleNamespace(name=n, measured=np.zeros(samples)) for n in ("v", "i")]
    trials: Any = [SimpleNamespace(case=SimpleNamespace(channels=channels))]
    smooth = np.sin(np.arange(samples) * 0.01) * np.sqrt(2.0)

    def residual(v: float, i: float) -> np.ndarray:
        return np.concatenate([v * smooth, i * smooth])

    base = residual(10.0, 2.0)
    assert signal_share(trials, base, residual(10.0, 2.0), residual(9.0, 2.0)) == pytest.approx(
        0.19, abs=0.01
    )
    assert signal_share(trials, base, residual(1.0, 2.0), residual(0.0, 1.0)) == pytest.approx(0.75, abs=0.01)
    # Where the declared model left nothing, the smallest structure that is worth an effect counts.
    nothing = residual(10.0, 0.0)
    found = signal_share(trials, nothing, residual(10.0, 0.08), residual(10.0, 0.0))
    assert found == pytest.approx(1.0, abs=0.01)


def fit(vector: Any, information: Any, *, spread: float = np.inf, left: float = 1.0, **more: Any) -> Fit:
    """A fit of one declared parameter ``p`` and coefficients a, b with the given Fisher information."""
    n = len(vector)
    rows = np.linalg.cholesky(np.asarray(information, dtype=float)).T
    samples = 4000
    jacobian = np.zeros((samples, n))
    jacobian[:n] = rows
    members = tuple(
        Unknown(name, name, "1", 0.0, spread if name == "p" else np.inf, 1.0, -9.0, 9.0, declared=name == "p")
        for name in "pab"[:n]
    )
    residual = np.full(samples, np.sqrt(left))
    return Fit(Unknowns(members), np.array(vector, dtype=float), residual, jacobian, np.ones(n), 0.0, True)


def choice(own: Fit, names: str = "ab", neutral: float = 0.0) -> Any:
    coefficients = tuple(SimpleNamespace(variable=n, neutral=neutral) for n in names)
    return SimpleNamespace(
        fit=own, candidate=SimpleNamespace(name="cogging:motor", coefficients=coefficients)
    )


SAYS = "cogging:motor: its coefficients cannot be distinguished from zero"


def test_existence_is_three_standard_errors():
    clear, vague = fit([0.0, 3.01], np.eye(2)), fit([0.0, 2.99], np.eye(2))
    assert insignificant(choice(clear, "a")) == ""
    assert insignificant(choice(vague, "a")) == SAYS
    assert insignificant(choice(fit([0.0, 4.0], np.eye(2)), "a", neutral=1.5)) == SAYS
    assert insignificant(choice(fit([0.0, -3.01], np.eye(2)), "a")) == ""


def test_existence_is_a_joint_test():
    """Sine and cosine part: neither alone is far from zero, together they are; and the other way round."""
    limit = np.sqrt(stats.chi2.isf(2.0 * stats.norm.sf(3.0), 2))  # 3.44: the radius of three standard errors
    each = limit / np.sqrt(2.0)
    assert insignificant(choice(fit([0.0, 1.01 * each, 1.01 * each], np.eye(3)))) == ""
    assert insignificant(choice(fit([0.0, 0.99 * each, 0.99 * each], np.eye(3)))) == SAYS
    assert insignificant(choice(fit([0.0, 3.1, 0.0], np.eye(3)))) == SAYS
    # Two coefficients that only their sum is known of: each has a wide interval, the sum does not.
    alike = np.array([[1.0, 0.0, 0.0], [0.0, 100.0, 99.99], [0.0, 99.99, 100.0]])
    own = fit([0.0, 0.5, 0.5], alike)
    assert np.all(own.stderr()[1:] > 0.5)
    assert insignificant(choice(own)) == ""


def test_existence_takes_the_drawing_as_it_is_however_much_is_left():
    """A coefficient that the declared parameter could imitate, had the drawing not fixed that."""
    information = np.array([[1e4, 1e4], [1e4, 1.01e4]])
    own = fit([0.0, 0.5], information, spread=0.1, left=100.0)
    assert own.inflation == pytest.approx(100.0)
    assert insignificant(choice(own, "a")) == ""
    assert insignificant(choice(fit([0.0, 0.5], information, left=100.0), "a")) == SAYS
    assert insignificant(choice(fit([0.0, 0.5], information, spread=0.1, left=1e4), "a")) == SAYS


def test_what_nothing_depends_on_does_not_exist():
    own = fit([0.0, 5.0], np.eye(2))
    own.jacobian[:, 1] = 0.0
    assert insignificant(choice(own, "a")) == SAYS
    for value, found in ((3.1, ""), (2.9, SAYS)):
        beside = fit([0.0, 5.0, value], np.eye(3))
        beside.jacobian[:, 1] = 0.0
        assert insignificant(choice(beside)) == found, "the other coefficient counts by itself"


def test_a_declared_parameter_at_the_end_of_its_range_is_named():
    for value, name in ((9.0, "p"), (-9.0, "p"), (9.5, "p"), (8.99, ""), (-8.99, "")):
        assert out_of_range(fit([value, 0.0], np.eye(2))) == name
    assert out_of_range(fit([0.0, 9.0], np.eye(2))) == "", "an effect's own coefficient may end there"


@pytest.mark.parametrize(
    ("start", "spread", "lower", "value", "name"),
    [
        (0.01, 0.02, 0.0, 0.0, ""),  # friction of unknown size: there may be none
        (0.02, 0.02, 0.0, 0.0, ""),  # just as well
        (0.03, 0.02, 0.0, 0.0, "p"),  # the drawing says that there is some
        (0.01, 0.02, 0.0, 1.0, "p"),  # the other end
        (0.01, 0.02, 0.005, 0.005, "p"),  # an end that is not nothing
        (0.01, np.inf, 0.0, 0.0, "p"),  # no drawing
    ],
)
def test_a_friction_of_unknown_size_may_vanish_behind_an_effect(start, spread, lower, value, name):
    own = fit([value, 1.0], np.eye(2))
    p = replace(own.unknowns.members[0], start=start, spread=spread, lower=lower, upper=1.0)
    assert out_of_range(replace(own, unknowns=Unknowns((p, *own.unknowns.members[1:])))) == name


def test_those_are_tried_that_come_near_the_best():
    def scored(*gains: float) -> Any:
        return [SimpleNamespace(held_out_gain=g) for g in gains]

    made = scored(100.0, 50.0, 49.9, 60.0)
    assert near_best(made) == [made[0], made[1], made[3]]
    assert near_best(scored()) == []
    many = scored(*[100.0] * 9)
    assert near_best(many) == many[:MOST_TRIED]
