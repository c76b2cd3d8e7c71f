"""Laws as what is searched: their unknowns, the way back to coefficients, and what a scenario must say."""

import numpy as np
import pytest

from thsa_cosim.laws import FORMS, SEARCHABLE, Law, SearchedLaw
from thsa_cosim.parameters import Parameter, ParameterSpace

COLD, WARM = -55.0, 25.0
RNG = np.random.default_rng(3)


def searched(form: str, **changed) -> SearchedLaw:
    given = {
        "name": "T_fm",
        "variable": "motor.T_fm.a0",
        "unit": "N.m",
        "lower": 0.01,
        "upper": 1.0,
        "scale": "log",
    }
    return SearchedLaw(Parameter(**{**given, **changed}), form, "motor.T_fm", COLD, WARM)


@pytest.mark.parametrize("form", SEARCHABLE)
def test_unknowns_are_as_many_as_coefficients_and_give_the_law_back(form: str) -> None:
    """Values of the unknowns read off a law give that law: at every temperature, not only at the nodes."""
    law = searched(form)
    assert len(law.unknowns) == FORMS[form]
    if form in ("exponential", "double-exponential"):
        true = Law(form, (1e-2, -4e-2, 3e-2, 9e-3)[: FORMS[form]])
        ends = true(np.array([COLD, WARM])).tolist()
        values = [ends[0], -4e-2] if form == "exponential" else [*ends, -4e-2, 4.9e-2]
    else:
        true = Law(form, tuple(RNG.uniform(0.5, 1.0, FORMS[form]) * 80.0 ** -np.arange(FORMS[form])))
        values = true(law.nodes).tolist()
    t = np.linspace(-60.0, 40.0, 51)
    assert law.law(values)(t) == pytest.approx(true(t), rel=1e-9)
    block = law.assignments(dict(zip(law.members, values, strict=True)))
    assert block == pytest.approx(true.block_values("motor.T_fm"), rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("form", SEARCHABLE)
def test_covariance_of_the_law_is_that_of_its_unknowns(form: str) -> None:
    """By the law's own standard error at a temperature, against differences of the law by its unknowns."""
    law = searched(form)
    values = np.array(
        [0.3 if p.unit == "N.m" else (-0.02 if "beta1" in p.name else 0.01) for p in law.unknowns]
    )
    root = 1e-3 * RNG.standard_normal((values.size, values.size)) * np.abs(values)[:, None]
    covariance = root @ root.T
    t = np.array([-55.0, -20.0, 10.0, 25.0])
    slopes = []
    for k, value in enumerate(values):
        up, down = values.copy(), values.copy()
        up[k], down[k] = value + 1e-6, value - 1e-6
        slopes.append((law.law(up)(t) - law.law(down)(t)) / 2e-6)
    expected = np.sqrt(np.einsum("in,ij,jn->n", slopes, covariance, slopes))
    assert law.law(values, covariance).stderr(t) == pytest.approx(expected, rel=1e-5)


def test_terms_of_a_double_exponential_come_in_order() -> None:
    """Within the bounds of the unknowns the second rate is never below the first."""
    law = searched("double-exponential")
    lower, upper = ParameterSpace(law.unknowns).lower, ParameterSpace(law.unknowns).upper
    for values in RNG.uniform(lower, upper, (50, 4)):
        assert law.law(values).coefficients[1] <= law.law(values).coefficients[3]


def test_a_space_with_laws_sets_whole_blocks_and_the_parameters_beside_them() -> None:
    law = searched("quadratic", unit="mN.m", variable_unit="N.m", lower=10.0, upper=1000.0)
    other = Parameter("J", "motor.J", "kg.m2", 1e-4, 1e-2)
    space = ParameterSpace((*law.unknowns, other), (law,))
    values = {**dict.fromkeys(law.members, 300.0), "J": 2e-3}
    found = space.assignments(values)
    assert found["motor.J"] == 2e-3
    assert found["motor.T_fm.a0"] == pytest.approx(0.3)
    assert {n for n, v in found.items() if abs(v) > 1e-12} == {"motor.J", "motor.T_fm.a0"}
    assert len(found) == 9
