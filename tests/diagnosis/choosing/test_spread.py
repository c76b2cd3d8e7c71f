"""What rivals and forms add to the standard errors: distances and wider errors, by name, by likelihood."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from thsa_cosim.diagnosis.choosing import spread as room
from thsa_cosim.diagnosis.choosing.spread import between_models
from thsa_cosim.diagnosis.fitting.fit import Fit
from thsa_cosim.diagnosis.fitting.unknowns import Unknown, Unknowns

PROPOSAL = object()


def model(vector: list[float], *, block: str = "x", effect: str = "a:motor", cost: float = 0.0) -> Any:
    """A declared parameter p and an effect's coefficient k and shape n; both errors 1 unless ``errors`` says else."""
    own = f"motor.{block}"
    names = ("p", f"{own}.k", f"{own}.n")
    members = tuple(Unknown(n, n, "1", 0.0, np.inf, 1.0, -99.0, 99.0, declared=n == "p") for n in names)
    parameters = [
        SimpleNamespace(name="k", variable=f"{own}.k", role="coefficient"),
        SimpleNamespace(name="n", variable=f"{own}.n", role="shape"),
    ]
    fit = Fit(Unknowns(members), np.array(vector), np.ones(9), np.eye(9, 3), np.ones(3), cost, True)
    return SimpleNamespace(
        candidate=SimpleNamespace(name=effect, parameters=parameters), fit=fit, proposal=PROPOSAL
    )


@pytest.fixture
def errors(monkeypatch: pytest.MonkeyPatch) -> dict[int, list[float]]:
    """Stated errors by model, 1 where none is given."""
    given: dict[int, list[float]] = {}
    monkeypatch.setattr(room, "standard_errors", lambda fit, _: np.array(given.get(id(fit), [1.0] * 3)))
    return given


def added(winner: Any, rivals: tuple = (), forms: tuple = ()) -> np.ndarray:
    one = SimpleNamespace(accepted=winner, rivals=rivals, forms=forms)
    found: Any = SimpleNamespace(accepted=(winner,), rounds=(SimpleNamespace(accepted=None), one))
    return between_models(found, winner.fit, ())


def test_a_rival_widens_what_both_have_and_not_an_effect_that_it_has_not(errors: dict[int, list[float]]):
    winner = model([1.0, 4.0, 2.0])
    rival = model([1.6, 9.0, 9.0], block="y", effect="b:motor")
    np.testing.assert_allclose(added(winner, (rival,)), [0.6, 0.0, 0.0], atol=1e-12)
    farther = model([-1.0, 9.0, 9.0], block="y", effect="c:motor")
    np.testing.assert_allclose(added(winner, (rival, farther)), [2.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(added(winner), 0.0)


def test_a_form_widens_coefficients_of_its_name_in_another_block_and_shapes_in_the_same(
    errors: dict[int, list[float]],
):
    winner = model([1.0, 4.0, 2.0])
    np.testing.assert_allclose(added(winner, forms=(model([1.0, 4.5, 3.0], block="y"),)), [0.0, 0.5, 0.0])
    np.testing.assert_allclose(added(winner, forms=(model([1.0, 4.5, 3.0]),)), [0.0, 0.5, 1.0])


def test_an_unknown_of_the_final_model_that_the_round_had_not_is_passed_over(errors: dict[int, list[float]]):
    winner, rival = model([1.0, 4.0, 2.0]), model([1.6, 9.0, 9.0], block="y", effect="b:motor")
    one = SimpleNamespace(accepted=winner, rivals=(rival,), forms=())
    found: Any = SimpleNamespace(accepted=(winner,), rounds=(one,))
    members = winner.fit.unknowns.members
    later = replace(
        winner.fit, unknowns=Unknowns((*members[1:], members[0])), vector=np.array([4.0, 2.0, 1.0])
    )
    np.testing.assert_allclose(between_models(found, later, ()), [0.0, 0.0, 0.6], atol=1e-12)


def test_what_a_form_is_less_sure_of_counts_and_what_it_is_surer_of_does_not(errors: dict[int, list[float]]):
    winner, wide = model([1.0, 4.0, 2.0]), model([1.0, 4.0, 2.0])
    errors[id(wide.fit)] = [3.0, 0.5, np.inf]
    np.testing.assert_allclose(added(winner, forms=(wide,)), [8.0**0.5, 0.0, 0.0])


def test_a_model_that_fits_worse_counts_less(errors: dict[int, list[float]]):
    winner, worse = model([1.0, 4.0, 2.0]), model([2.0, 4.0, 2.0], cost=6.0)
    np.testing.assert_allclose(added(winner, forms=(worse,))[0], np.exp(-1.5))
    worse.fit = replace(worse.fit, cost=600.0)
    assert added(winner, forms=(worse,))[0] < 1e-9


def test_what_rivals_of_several_effects_bend_adds_up(errors: dict[int, list[float]]):
    first, second = model([1.0, 4.0, 2.0]), model([1.0, 4.0, 2.0], block="z")
    second.proposal = object()
    bent = (model([1.3, 4.0, 2.0], effect="c:motor"), model([1.4, 4.0, 2.0], effect="d:motor"))
    rounds = [
        SimpleNamespace(accepted=one, rivals=(rival,), forms=())
        for one, rival in zip((first, second), bent, strict=True)
    ]
    found: Any = SimpleNamespace(accepted=(first, second), rounds=rounds)
    np.testing.assert_allclose(between_models(found, second.fit, ())[0], 0.5)
