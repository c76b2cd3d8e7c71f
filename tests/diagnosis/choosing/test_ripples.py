"""Orders of the machine: integers that are not fitted, unless a free one explains what they leave."""

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.analytic import bench, candidates, unknowns
from thsa_cosim.diagnosis.choosing.attribution import Attribution, attribute
from thsa_cosim.diagnosis.choosing.findings import found_effects
from thsa_cosim.diagnosis.choosing.orders import Machine
from thsa_cosim.diagnosis.choosing.ripples import on_orders
from thsa_cosim.diagnosis.choosing.screen import screen
from thsa_cosim.diagnosis.fitting.fit import refine

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
