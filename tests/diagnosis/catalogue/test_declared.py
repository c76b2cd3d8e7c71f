"""Effects that a scenario declares: which way of an effect is meant, its start values, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

from thsa_cosim.diagnosis.catalogue.candidate import Candidate, candidates_of
from thsa_cosim.diagnosis.catalogue.declared import declared_effects
from thsa_cosim.diagnosis.catalogue.known import known_effects
from thsa_cosim.diagnosis.catalogue.slots import find_slots
from thsa_cosim.diagnosis.fitting.unknowns import declared_unknowns_of
from thsa_cosim.errors import ScenarioError

PACKAGE = Path(__file__).parents[3] / "modelica" / "THSA"


@pytest.fixture(scope="module")
def candidates() -> tuple[Candidate, ...]:
    slots = find_slots("THSA.Actuator", PACKAGE)
    scales = {s.name: {"F": 10.0, "V": 2.0, "Z": 5.0} for s in slots}
    return candidates_of(known_effects().values(), slots, scales)


def test_without_values_the_first_way_starts_at_nothing(candidates: tuple[Candidate, ...]) -> None:
    (found,) = declared_effects(candidates, {"spring:screw": {}}, "x.toml: diagnose.known")
    assert (found.candidate.name, dict(found.starts)) == ("spring:screw", {"c": 0.0})
    (unknown,) = declared_unknowns_of([found])
    assert unknown.declared
    assert unknown.name == unknown.variable == "screwEffect.spring.c"
    assert np.isinf(unknown.spread)


def test_named_parameters_choose_the_fewest_ways_and_give_their_starts(
    candidates: tuple[Candidate, ...],
) -> None:
    """mu and mu_2 are one way; the breakaway part is another, whose shapes start where they were not given."""
    values = {"mu": 0.1, "mu_D": -0.02, "mu_S": 0.05, "v_S": 0.4}
    found = declared_effects(candidates, {"load-dependent-friction:gearbox": values}, "x.toml")
    starts = {u.name.rpartition(".")[2]: u.start for u in declared_unknowns_of(found)}
    assert starts == {**values, "n_S": 1.5}
    assert len(found) == 3


def test_an_effect_with_one_place_needs_none(candidates: tuple[Candidate, ...]) -> None:
    (found,) = declared_effects(candidates, {"backlash": {"gap": 1e-5}}, "x.toml")
    assert found.candidate.name == "backlash"


@pytest.mark.parametrize(
    ("known", "text"),
    [
        (
            {"sprung:screw": {}},
            r"x.toml: the model has no place for 'sprung:screw'. Did you mean 'spring:screw'",
        ),
        (
            {"spring": {}},
            r"'spring' has several places; write one of spring:motor, spring:gearbox, spring:screw",
        ),
        ({"spring:screw": {"k": 1.0}}, r"x.toml.spring:screw: there is no parameter 'k'. It has c, F_0"),
        ({"backlash": {"gap": -1.0}}, r"x.toml.backlash.gap is -1 m; it lies between 0 and 0.05"),
    ],
)
def test_what_the_model_does_not_offer_is_refused_in_one_sentence(
    known: dict[str, dict[str, float]], text: str, candidates: tuple[Candidate, ...]
) -> None:
    with pytest.raises(ScenarioError, match=text):
        declared_effects(candidates, known, "x.toml")
