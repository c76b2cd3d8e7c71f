"""Forms of one effect: the one that fits takes over, and what fits as well makes the stated errors larger."""

from collections.abc import Mapping
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.analytic import DECLARED, bench, candidates, unknowns
from thsa_cosim.diagnosis.choosing.attribution import Attribution, attribute
from thsa_cosim.diagnosis.choosing.findings import found_effects, judged
from thsa_cosim.diagnosis.choosing.forms import likelihood
from thsa_cosim.diagnosis.choosing.score import held_shapes
from thsa_cosim.diagnosis.choosing.spread import between_models
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.uncertainty import standard_errors

SEEDS = 20
HESS_SOOM = {"motorEffect.hessSoom.dF": 0.6, "motorEffect.hessSoom.v_S": 4.0}


def windage(exponent: float, size: float = 2e-3) -> dict[str, float]:
    block = "motorEffect.windage"
    return {f"{block}.b_q": size, f"{block}.n": exponent, f"{block}.v_r": 30.0}


def diagnosed(
    true: Mapping[str, float], effect: str, seed: int, forms: bool = True
) -> tuple[Bench, Attribution]:
    known = candidates(effect)
    own = bench(known, true, seed, held_shapes(known))
    offered = [c for c in known if forms or not c.variant.instead]
    found = attribute(own, unknowns(), offered, lambda _: {}, seed=1, most=1)
    assert found is not None
    return own, found


@cache
def errors(exponent: float, forms: bool) -> np.ndarray:
    """Errors of the viscous friction beside a drag of this exponent, in stated standard errors."""
    found = [_error(*diagnosed(windage(exponent, 6e-4), "windage", seed, forms)) for seed in range(SEEDS)]
    return np.array(found)


def _error(own: Bench, found: Attribution) -> float:
    fit = found.accepted[0].fit
    k = fit.unknowns.names.index("b")
    trials = own.of("fit")
    stated = np.hypot(standard_errors(fit, trials), between_models(found, fit, trials))[k]
    return float((fit.vector[k] - DECLARED["b"]) / stated)


def test_a_drag_that_is_no_square_gets_its_exponent_and_leaves_the_viscous_friction_alone():
    _, found = diagnosed(windage(1.8), "windage", 0)
    (effect,) = found_effects(found, found.final)
    values = effect.parameters
    assert values["n"].value == pytest.approx(1.8, abs=0.06)
    assert values["b_q"].value == pytest.approx(2e-3, rel=0.04)
    assert (values["v_r"].value, values["v_r"].stderr) == (30.0, 0.0), "given, and said"
    assert found.final.at(["b"])[0] == pytest.approx(DECLARED["b"], rel=0.1)
    decisions = {j.variant.split(" ")[0]: (j.decision, j.reason) for j in judged(found)}
    assert decisions["windage:motor/windage1"] == ("accepted", "")
    assert decisions["windage:motor/windage0"] == ("rejected", "another form of it fits better")


def test_a_square_stays_one_and_the_free_exponent_beside_it_widens_what_it_bends():
    own, found = diagnosed(windage(2.0), "windage", 0)
    (one,) = found.rounds
    assert one.accepted is not None
    assert one.accepted.candidate.key == "windage:motor/windage0"
    assert [f.candidate.key for f in one.forms] == ["windage:motor/windage1"]
    fit = one.accepted.fit
    own_errors = standard_errors(fit, own.of("fit"))
    added = dict(zip(fit.unknowns.names, between_models(found, fit, own.of("fit")) / own_errors, strict=True))
    assert added["b"] > 0.3
    assert added["motorEffect.windage.b_q"] > 0.2
    assert added["R"] < 0.1, "what the form does not bend stays as sure as it was"


def test_the_viscous_friction_beside_a_drag_is_inside_its_interval_whatever_the_exponent():
    for exponent in (2.0, 1.8):
        assert np.mean(np.abs(errors(exponent, True)) < 1.96) >= 0.85
    assert np.mean(np.abs(errors(1.8, False)) < 1.96) < 0.6, "a square alone is too sure of what it bends"


def test_a_fraction_of_the_speed_is_known_from_an_exponential():
    _, found = diagnosed(HESS_SOOM, "stribeck", 1)
    (effect,) = found_effects(found, found.final)
    assert effect.name.startswith("stribeck")
    assert set(effect.parameters) == {"dF", "v_S"}
    assert found.accepted[0].candidate.component == "hessSoom"
    assert found.final.at(["c"])[0] == pytest.approx(DECLARED["c"], rel=0.03)


def test_a_rival_in_another_place_bends_nothing_behind_a_rigid_gear():
    """Its errors are compared as well: what is kept of it has to do for that."""
    own, found = diagnosed(HESS_SOOM, "stribeck", 1)
    (one,) = found.rounds
    assert [r.candidate.effect.name for r in one.rivals] == ["stribeck"]
    trials, fit = own.of("fit"), found.accepted[0].fit
    added = between_models(found, fit, trials)
    assert np.isfinite(added).all()
    assert one.rivals[0].fit.jacobian.shape == (fit.residual.size, len(one.rivals[0].fit.vector))


def test_a_form_that_fits_worse_counts_by_its_likelihood():
    def fitted(cost: float, inflation: float = 1.0) -> Any:
        return SimpleNamespace(fit=SimpleNamespace(cost=cost, inflation=inflation))

    assert likelihood(fitted(104.0), fitted(100.0)) == pytest.approx(np.exp(-2.0))
    assert likelihood(fitted(104.0), fitted(100.0, 2.0)) == pytest.approx(np.exp(-1.0))
    assert likelihood(fitted(90.0), fitted(100.0)) == 1.0
