"""Laws that the recordings cannot tell from the effects, in place of them."""

from dataclasses import replace

import numpy as np

from diagnosis.analytic import DECLARED, GEAR, MOTOR, SCALES, bench, candidates, unknowns
from diagnosis.choosing.test_decision import STRIBECK, WINDAGE
from thsa_cosim.diagnosis.catalogue.candidate import Candidate, candidates_of
from thsa_cosim.diagnosis.catalogue.effect import Connectors, Values
from thsa_cosim.diagnosis.choosing.attribution import Attribution, attribute
from thsa_cosim.diagnosis.choosing.score import held_shapes
from thsa_cosim.diagnosis.explaining.empirical import EMPIRICAL
from thsa_cosim.diagnosis.explaining.instead import rival_laws
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.results import RivalLaw


def _square(p: Values, at: Connectors) -> np.ndarray:
    return np.asarray(p["k_vv"] * at["v"] * np.abs(at["v"]))


def squares() -> tuple[Candidate, ...]:
    """The library's square of the speed, at the motor and behind its gear, with its law in closed form."""
    (term,) = (e for e in EMPIRICAL if e.name.endswith("k_vv"))
    own = replace(term, variants=(replace(term.variants[0], law=_square),))
    return candidates_of([own], (MOTOR, GEAR), SCALES)


def laws(true: dict[str, float]) -> tuple[RivalLaw, ...]:
    """What ties with the effects that are found on recordings with the ``true`` ones."""
    named, library = candidates("windage", "stribeck"), squares()

    def recorded() -> Bench:
        return bench((*named, *library), true, fixed=held_shapes((*named, *library)))

    def found(offered: tuple[Candidate, ...]) -> Attribution:
        result = attribute(recorded(), unknowns(), offered, lambda _: {}, seed=1)
        assert result is not None
        assert result.accepted
        return result

    return rival_laws(found(named), found(library), recorded().trials)


def test_a_law_that_explains_as_much_as_the_effect_is_its_rival_in_every_place():
    found = laws(WINDAGE)
    assert sorted((t.slot, t.term) for law in found for t in law.terms) == [
        ("gear", "v |v|"),
        ("motor", "v |v|"),
    ]
    by_place = {law.terms[0].slot: law for law in found}
    at_motor, at_gear = (by_place[slot].terms[0].coefficient.value for slot in ("motor", "gear"))
    assert np.isclose(at_gear, at_motor * 30.0**3, rtol=0.01)
    for law in found:
        for name, value in DECLARED.items():
            assert abs(law.declared[name].value - value) < 5.0 * law.declared[name].stderr


def test_a_law_that_leaves_what_the_effects_explain_is_none():
    weak = {**STRIBECK, "motorEffect.stribeck.dF": 0.1}
    assert laws({**WINDAGE, **weak}) == ()
