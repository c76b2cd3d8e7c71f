"""Behind a rigid gear one law acts at either shaft: which other places an accepted effect may be at."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from diagnosis.analytic import DECLARED, GEAR, MOTOR, RATIO, bench, candidates, unknowns
from thsa_cosim.diagnosis.catalogue.candidate import Candidate
from thsa_cosim.diagnosis.choosing.attribution import attribute
from thsa_cosim.diagnosis.choosing.orders import NO_MACHINE, Machine
from thsa_cosim.diagnosis.choosing.places import at_shaft, shaft_scales, tied_places
from thsa_cosim.diagnosis.choosing.score import Scored, held_shapes, polish, score
from thsa_cosim.diagnosis.choosing.screen import propose
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.fit import refine

RIGID = Machine(
    {
        MOTOR.name: {MOTOR.name: 1.0, GEAR.name: 1.0 / RATIO},
        GEAR.name: {GEAR.name: 1.0, MOTOR.name: RATIO},
    },
    {MOTOR.name: 60.0, GEAR.name: 2.0},
)
CURVE = {"motorEffect.stribeck.dF": 0.6, "motorEffect.stribeck.v_S": 4.0, "motorEffect.stribeck.n": 1.0}


def found_at_motor(effect: str, true: Mapping[str, float]) -> tuple[Bench, Scored, tuple[Candidate, ...]]:
    """The effect as accepted at the motor, with all parameters fitted."""
    offered = candidates(effect)
    own = bench(offered, true, 3, held_shapes(offered))
    base = refine(own, unknowns(), unknowns().start)
    assert base is not None
    (held,) = own.residuals(base.unknowns, base.vector[None, :], "validate")
    assert held is not None
    one = next(c for c in offered if c.slot is MOTOR)
    shapes = {p.name: true[p.variable] for p in one.shapes}
    (proposal,) = propose(own, base, [(one, shapes)])
    scored = score(own, base, held, proposal)
    assert scored is not None
    return own, polish(own, scored, base, held), offered


@pytest.mark.parametrize(
    ("effect", "true"),
    [("stribeck", CURVE), ("asymmetric-friction", {"motorEffect.asymmetricFriction.dF": 0.2})],
)
def test_the_same_law_behind_a_rigid_gear_is_a_tie(effect: str, true: Mapping[str, float]):
    own, one, offered = found_at_motor(effect, true)
    (there,) = tied_places(own, one, one.fit, one.validate, offered, RIGID)
    assert there.candidate.slot is GEAR
    assert there.candidate.variant is one.candidate.variant
    here, moved = (s.fit.unknowns.named(s.fit.vector) for s in (one, there))
    assert [moved[name] for name in DECLARED] == [here[name] for name in DECLARED]
    factors = {"dF": RATIO, "db": RATIO**2, "v_S": 1.0 / RATIO, "n": 1.0}
    for p, q in zip(one.candidate.parameters, there.candidate.parameters, strict=True):
        assert moved[q.variable] == pytest.approx(factors[p.name] * here[p.variable])
    # It is the same model: outputs and errors are what they were, in the other shaft's units.
    (residual,) = own.residuals(there.fit.unknowns, there.fit.vector[None, :], "fit")
    assert residual is not None
    np.testing.assert_allclose(residual, one.fit.residual, atol=1e-6)
    theirs = dict(zip(there.fit.unknowns.names, there.fit.stderr(), strict=True))
    ours = dict(zip(one.fit.unknowns.names, one.fit.stderr(), strict=True))
    for p, q in zip(one.candidate.parameters, there.candidate.parameters, strict=True):
        assert theirs[q.variable] == pytest.approx(factors[p.name] * ours[p.variable], rel=1e-3)


def test_a_place_that_does_not_turn_along_or_sees_another_load_is_none():
    own, one, offered = found_at_motor("stribeck", CURVE)
    assert tied_places(own, one, one.fit, one.validate, offered, NO_MACHINE) == []
    far = at_shaft(one, next(c for c in offered if c.slot is GEAR), shaft_scales(1e-6), one.fit)
    assert far is None, "there its parameters would be out of their ranges"
    held_out = 0.9 * one.validate
    assert tied_places(own, one, one.fit, held_out, offered, RIGID) == [], (
        "held-out recordings tell them apart"
    )
    better = replace(one.fit, cost=one.fit.cost - 10.0 * one.fit.inflation)
    assert tied_places(own, one, better, one.validate, offered, RIGID) == [], "and so do the others"


def test_what_is_accepted_names_the_other_shaft_however_it_was_found():
    """Not deep: no rival is looked for in the rounds themselves."""
    offered = candidates("stribeck")
    own = bench(offered, CURVE, 3, held_shapes(offered))
    scan = lambda _fit: {}  # noqa: E731
    tied = attribute(own, unknowns(), offered, scan, seed=1, machine=RIGID, deep=False)
    alone = attribute(own, unknowns(), offered, scan, seed=1, deep=False)
    assert tied is not None
    assert alone is not None
    names = {s.candidate.name for s in tied.accepted}
    assert {s.candidate.name for s in tied.rounds[0].rivals} | names == {"stribeck:motor", "stribeck:gear"}
    assert alone.rounds[0].rivals == ()
