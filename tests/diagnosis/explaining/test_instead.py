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
from thsa_cosim.diagnosis.explaining.instead import rival_laws, tied_laws
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.results import RivalLaw


def _square(p: Values, at: Connectors) -> np.ndarray:
    return np.asarray(p["k_vv"] * at["v"] * np.abs(at["v"]))


def squares() -> tuple[Candidate, ...]:
    """The library's square of the speed, at the motor and behind its gear, with its law in closed form."""
    (term,) = (e for e in EMPIRICAL if e.name.endswith("k_vv"))
    own = replace(term, variants=(replace(term.variants[0], law=_square),))
    return candidates_of([own], (MOTOR, GEAR), SCALES)


def recorded(true: dict[str, float]) -> Bench:
    offered = (*candidates("windage", "stribeck"), *squares())
    return bench(offered, true, fixed=held_shapes(offered))


def found(true: dict[str, float], offered: tuple[Candidate, ...]) -> Attribution:
    """What is found among ``offered`` on recordings with the ``true`` effects."""
    result = attribute(recorded(true), unknowns(), offered, lambda _: {}, seed=1)
    assert result is not None
    assert result.accepted
    return result


def laws(true: dict[str, float]) -> tuple[RivalLaw, ...]:
    """What ties with the effects that are found on recordings with the ``true`` ones."""
    named = candidates("windage", "stribeck")
    return rival_laws(found(true, named), found(true, squares()), recorded(true).trials)


def test_a_law_that_explains_as_much_as_the_effect_is_its_rival_in_every_place():
    rivals = laws(WINDAGE)
    assert sorted((t.slot, t.term) for law in rivals for t in law.terms) == [
        ("gear", "v |v|"),
        ("motor", "v |v|"),
    ]
    by_place = {law.terms[0].slot: law for law in rivals}
    at_motor, at_gear = (by_place[slot].terms[0].coefficient.value for slot in ("motor", "gear"))
    assert np.isclose(at_gear, at_motor * 30.0**3, rtol=0.01)
    for law in rivals:
        for name, value in DECLARED.items():
            assert abs(law.declared[name].value - value) < 5.0 * law.declared[name].stderr


def test_a_law_that_leaves_what_the_effects_explain_is_none():
    weak = {**STRIBECK, "motorEffect.stribeck.dF": 0.1}
    assert laws({**WINDAGE, **weak}) == ()


def test_a_law_of_one_term_has_the_other_places_of_it_as_rivals_but_not_itself():
    law = found(WINDAGE, squares())
    (own,) = law.accepted
    (rival,) = tied_laws(law)
    (term,) = rival.terms
    assert {term.slot, own.candidate.slot.name} == {"motor", "gear"}
    assert term.term == "v |v|"


def test_of_several_terms_no_other_law_is_told():
    law = found(WINDAGE, squares())
    assert tied_laws(replace(law, accepted=law.accepted * 2)) == ()


def test_the_rivals_are_those_of_the_round_in_which_the_law_was_accepted():
    """Not of a term that was dropped since."""
    law = found(WINDAGE, squares())
    (own,) = law.accepted
    dropped = replace(law.rounds[0], accepted=replace(own, proposal=replace(own.proposal)), rivals=())
    assert len(tied_laws(replace(law, rounds=(dropped, *law.rounds)))) == 1
