"""Orders of the machine: integers that are not fitted, unless a free one explains what they leave."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.analytic import bench, candidates, unknowns
from thsa_cosim.diagnosis.choosing import ripples as room
from thsa_cosim.diagnosis.choosing.attribution import Attribution, attribute
from thsa_cosim.diagnosis.choosing.findings import found_effects
from thsa_cosim.diagnosis.choosing.orders import Machine
from thsa_cosim.diagnosis.choosing.ripples import first_free_orders, freed, on_orders
from thsa_cosim.diagnosis.choosing.score import Scored
from thsa_cosim.diagnosis.choosing.screen import Proposal, screen
from thsa_cosim.diagnosis.fitting.fit import Fit, refine
from thsa_cosim.diagnosis.fitting.unknowns import Unknowns, unknowns_of

#: A motor that turns by 60 rad, and the shaft behind its gear, to which that is 2 rad.
MACHINE = Machine(
    {"motor": {"motor": 1.0}, "gear": {"gear": 1.0, "motor": 30.0}}, {"motor": 60.0, "gear": 2.0}
)


def cogging(order: float) -> dict[str, float]:
    block = "motorEffect.cogging"
    return {f"{block}.a_s": 0.25, f"{block}.a_c": -0.1, f"{block}.n": order}


def diagnosed(order: float, machine: Machine) -> Attribution:
    offered = candidates("cogging", "stribeck")
    own = bench(offered, cogging(order))
    waves = {"motor": (11.0, 12.0, 13.0)}
    found = attribute(own, unknowns(), offered, lambda _: waves, seed=1, most=1, machine=machine)
    assert found is not None
    return found


def test_an_integer_order_is_given_and_not_fitted():
    found = diagnosed(12.0, MACHINE)
    (effect,) = found_effects(found, found.final, MACHINE)
    assert (effect.parameters["n"].value, effect.parameters["n"].stderr) == (12.0, 0.0)
    assert effect.order == "12 per turn of the motor"
    assert effect.parameters["a_s"].value == pytest.approx(0.25, abs=0.01)
    free = diagnosed(12.0, Machine({}, {}))
    (alone,) = found_effects(free, free.final)
    assert alone.parameters["n"].stderr > 0.0, "of a machine of which nothing is known the order is fitted"


def test_of_further_orders_which_are_alike_the_first_free_one_is_offered():
    offered = [c for c in candidates("cogging", "stribeck") if c.slot.name == "motor"]
    (first, second, third) = (c for c in offered if any(p.name.startswith("n_") for p in c.shapes))
    main = next(c for c in offered if not c.variant.beside and any(p.scanned for p in c.shapes))

    def left_out(*known: Any) -> list[Any]:
        names = tuple(p.variable for c in (main, *known) for p in c.parameters)
        model: Any = SimpleNamespace(unknowns=SimpleNamespace(names=names))
        found = first_free_orders(offered, model)
        return [c for c in offered if c not in found]

    assert left_out() == [second, third], "the second harmonic of the order that is there is none of them"
    assert left_out(first) == [third]
    assert left_out(first, second, third) == []


def test_an_order_that_is_no_integer_is_fitted_where_the_integer_leaves_structure():
    """Such as a part behind a gear that is not in the model: at 12 the ripple would be out of phase at the ends."""
    found = diagnosed(12.015, MACHINE)
    (scored,) = found.accepted
    assert scored.proposal.held == frozenset()
    (effect,) = found_effects(found, found.final, MACHINE)
    assert effect.parameters["n"].value == pytest.approx(12.015, abs=0.002)
    assert effect.parameters["n"].stderr > 0.0
    np.testing.assert_allclose(np.mean(found.final_validate**2), 1.0, atol=0.1)


def test_only_waves_at_an_order_are_held_and_only_until_they_are_in_the_model():
    offered = [c for c in candidates("cogging") if c.number == 0]
    own = bench(offered, {})
    base = refine(own, unknowns(), unknowns().start)
    assert base is not None
    proposals = screen(own, base, offered, {"motor": (12.001, 12.4)})
    held = {p.shapes["n"]: p.held for p in on_orders(proposals, MACHINE, base)}
    assert held[12.4] == frozenset()
    assert held[12.0] == {"n"}, "12.001 is 12, as near as 60 rad can tell"
    assert 12.001 not in held
    known = replace(
        base,
        unknowns=base.unknowns.with_members(
            [replace(base.unknowns.members[0], name="motorEffect.cogging.n")]
        ),
    )
    assert not any(p.held for p in on_orders(proposals, MACHINE, known))


N = 4000
TIME = np.arange(N) * 5e-3
CHANNEL = SimpleNamespace(name="v", measured=np.zeros(N), time=TIME, noise=1.0, weight=1.0)
TRIALS: Any = (
    SimpleNamespace(case=SimpleNamespace(channels=(CHANNEL,), measured=SimpleNamespace(units={"v": "m/s"}))),
)
SMOOTH = 10.0 * np.sin(TIME)
NOISE = np.random.default_rng(8).standard_normal(N)


@pytest.mark.parametrize(
    ("left", "after", "fails", "is_free"),
    [
        (0.5, 0.0, "", True),
        (0.5, 0.45, "", False),  # explains a fifth of what was left
        (0.0, 0.0, "", False),  # nothing is left that a free order could explain
        (0.5, 0.0, "refine", False),
        (0.5, 0.0, "residuals", False),
        (0.5, 0.0, "end", False),
        (0.5, 0.0, "held", False),  # it is free already
    ],
)
def test_a_free_order_counts_with_its_fit_where_it_explains_what_the_integer_leaves(
    monkeypatch: pytest.MonkeyPatch, left: float, after: float, fails: str, is_free: bool
):
    candidate = next(c for c in candidates("cogging") if c.number == 0)
    held = frozenset() if fails == "held" else frozenset({"n"})
    nothing = np.zeros(1)
    proposal = Proposal(candidate, {"n": 12.0}, nothing, 1.0, nothing, 1.0, nothing, held=held)
    members = Unknowns((*unknowns().members, *unknowns_of(candidate, {"n": 12.0}, {"n"})))
    fit = Fit(members, members.start, NOISE, np.zeros((N, 1)), np.full(1, 0.5), 1.0, True)
    residuals = [left * SMOOTH + NOISE, after * SMOOTH + NOISE]
    choice = Scored(proposal, fit, residuals[0], 1.0, 1.0, 9.0, 1.0)
    asked: list[Any] = []

    def refined(
        bench: Any, unknowns: Unknowns, vector: np.ndarray, jacobian: np.ndarray, steps: np.ndarray
    ) -> Fit | None:
        assert jacobian is fit.jacobian
        asked.append((unknowns, vector, steps))
        return None if fails == "refine" else replace(fit, unknowns=unknowns, vector=vector + 0.01)

    def simulated(unknowns: Unknowns, vectors: np.ndarray, part: str) -> list[np.ndarray | None]:
        np.testing.assert_array_equal(vectors, fit.vector[None, :] + 0.01)
        assert (unknowns, part) == (asked[0][0], "validate")
        return [None if fails == "residuals" else residuals[1]]

    monkeypatch.setattr(room, "refine", refined)
    monkeypatch.setattr(room, "out_of_range", lambda _: "n" if fails == "end" else "")
    own: Any = SimpleNamespace(of=lambda part: TRIALS, residuals=simulated)
    weights: Any = SimpleNamespace(plain=lambda residual, part: residual)
    said: list[str] = []
    one, found, validate = freed(own, weights, choice, (fit, residuals[0]), said.append)
    if not is_free:
        assert one is choice
        assert found is fit
        assert validate is residuals[0]
        return
    ((free, vector, steps),) = asked
    assert np.isinf(free.members[-1].spread), "the order"
    assert [u.spread for u in free.members[:-1]] == [u.spread for u in members.members[:-1]]
    assert vector is fit.vector
    assert steps is fit.steps
    assert found.unknowns is free
    assert one.fit is found, "the effect is told with the order of the free fit"
    assert one.validate is validate
    assert validate is residuals[1]
    assert (one.proposal.held, one.proposal.shapes) == (frozenset(), proposal.shapes)
    assert said == ["fitting cogging:motor with a free order"]
