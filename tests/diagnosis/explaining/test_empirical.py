"""The terms of an empirical law as candidates, in a model's name and in the words of the result."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.analytic import MOTOR, SCALES, bench, unknowns
from diagnosis.choosing.test_decision import STRIBECK, WINDAGE, accepted_by_hand
from thsa_cosim.diagnosis.catalogue import extend
from thsa_cosim.diagnosis.catalogue.candidate import candidates_of
from thsa_cosim.diagnosis.catalogue.effect import Connectors, Values
from thsa_cosim.diagnosis.catalogue.slots import Slot
from thsa_cosim.diagnosis.choosing.attribution import Attribution, _is_taken, attribute
from thsa_cosim.diagnosis.choosing.forms import is_form
from thsa_cosim.diagnosis.choosing.score import held_shapes
from thsa_cosim.diagnosis.choosing.screen import Proposal
from thsa_cosim.diagnosis.choosing.selection import REFINED, worth_refining
from thsa_cosim.diagnosis.explaining.empirical import EMPIRICAL, FoundLaw, LawSearch, law_of
from thsa_cosim.diagnosis.fitting.unknowns import Unknown, Unknowns

PACKAGE = Path(__file__).parents[3] / "modelica" / "THSA"
SCREW = Slot("screw", "FrictionEffect", {"v": "m/s", "z": "m", "N": "N", "F": "N"})
TERMS = candidates_of(EMPIRICAL, (SCREW,), {})
CANDIDATES = {c.coefficients[0].name: c for c in TERMS if not c.variant.instead}
POWER = next(c for c in TERMS if c.variant.instead)


def proposal(name: str, gain: float) -> Proposal:
    one = np.ones((1, 1))
    return Proposal(CANDIDATES[name], {}, one, gain, one[0], 1.0, one)


def test_a_term_neither_takes_the_place_of_another_one_nor_is_its_form():
    first, second = CANDIDATES["k_vv"], CANDIDATES["k_Ns"]
    assert _is_taken(first, first)
    assert not _is_taken(second, first)
    assert not is_form(second, first)


def test_several_terms_of_a_place_are_refined():
    found = worth_refining([proposal(n, 100.0 - k) for k, n in enumerate(CANDIDATES)], 1.0)
    assert len({p.candidate.effect.name for p in found}) == REFINED


def test_powers_of_the_speed_are_forms_of_one_term_the_free_exponent_last():
    square, cube = CANDIDATES["k_vv"], CANDIDATES["k_vvv"]
    assert is_form(POWER, square)
    assert is_form(POWER, cube)
    assert _is_taken(cube, square)
    assert POWER.coefficients == square.coefficients, "fitted on from the square's optimum"
    assert [p.at_start for p in POWER.shapes] == [2.0]


class Powers:
    """The library's powers of the speed at the motor of the analytic drive, with their laws."""

    def __init__(self, true: dict[str, float], seed: int = 0) -> None:
        def law(p: Values, at: Connectors) -> np.ndarray:
            size, v, s = p["k_vv"], at["v"], at["s"]
            return np.asarray(size * p["v_r"] ** 2 * np.abs(v / p["v_r"]) ** p["n"] * s + p["k_vvv"] * v**3)

        (powers,) = (e for e in EMPIRICAL if e.name.endswith("k_vv"))
        own = replace(powers, variants=tuple(replace(v, law=law) for v in powers.variants))
        self.offered = candidates_of([own], (MOTOR,), SCALES)
        self.bench = bench(self.offered, true, seed, held_shapes(self.offered))

    def found(self) -> Attribution:
        found = attribute(self.bench, unknowns(), self.offered, lambda _: {}, seed=1, most=3)
        assert found is not None
        return found


def power_law(exponent: float) -> dict[str, float]:
    block = "motorEffect.empirical"
    return {f"{block}.k_vv": 2e-3, f"{block}.n": exponent, f"{block}.v_r": 30.0}


@pytest.mark.parametrize("exponent", [1.5, 1.8, 2.6])
def test_a_drag_with_another_power_gets_its_exponent(exponent: float):
    found = Powers(power_law(exponent)).found()
    (term,) = law_of(found, found.final, added=True).terms
    n = term.shapes["n"].value
    assert n == pytest.approx(exponent, abs=0.06)
    assert term.term == f"30^2 |v/30|^{n:.4g} sgn(v)"
    assert term.coefficient.value == pytest.approx(2e-3, rel=0.05)
    assert (term.shapes["v_r"].value, term.shapes["v_r"].stderr) == (30.0, 0.0), "given, and said"


@pytest.mark.parametrize(
    ("true", "text"), [(power_law(2.0), "v |v|"), ({"motorEffect.empirical.k_vvv": 1e-4}, "v^3")]
)
def test_a_whole_power_stays_one(true: dict[str, float], text: str):
    found = Powers(true).found()
    assert [t.term for t in law_of(found, found.final, added=True).terms] == [text]


def test_a_model_with_several_terms_is_named_once(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.setattr(extend, "export_fmu", lambda *_, output, **__: output)
    terms = [CANDIDATES["k_vv"], CANDIDATES["k_Ns"]]
    file, fmu = extend.write_extended_model(tmp_path, "THSA.Actuator", PACKAGE, terms, {})
    assert (file.name, fmu.name) == ("THSA_with_empirical.mo", "THSA_with_empirical.fmu")
    source = file.read_text()
    assert source.count("THSA.Effects.Empirical empirical(") == 1, "one block holds both terms"
    assert "k_vv(" in source
    assert "k_Ns(" in source


def found_terms(**values: float) -> Any:
    """An attribution that accepted a fall over the speed and a wave whose order is known."""
    members = tuple(
        Unknown(
            f"screwEffect.empirical.{n}",
            f"screwEffect.empirical.{n}",
            "N",
            x,
            1.0,
            1.0,
            -1e9,
            1e9,
            None,
            False,
        )
        for n, x in values.items()
    )
    fit = SimpleNamespace(
        unknowns=Unknowns(members),
        vector=np.array([u.start for u in members]),
        inflation=1.0,
        stderr=lambda _: np.full(len(members), 0.1),
    )
    accepted = [
        SimpleNamespace(candidate=CANDIDATES[n], proposal=SimpleNamespace(shapes=shapes))
        for n, shapes in (("k_f", {"v_f": 1e-3}), ("k_sin", {"w": 628.3}))
    ]
    held = np.ones(10)
    return SimpleNamespace(final=fit, accepted=accepted, base_validate=3.0 * held, final_validate=held)


def test_a_law_has_a_term_for_each_coefficient_with_its_shapes_put_in():
    found = found_terms(k_f=300.0, v_f=1.2345e-3, k_sin=40.0, k_cos=-30.0)
    law = law_of(found, found.final, added=True)
    assert [(t.term, t.coefficient.value) for t in law.terms] == [
        ("exp(-|v|/0.001234) sgn(v)", 300.0),
        ("sin(628.3 z)", 40.0),
        ("cos(628.3 z)", -30.0),
    ]
    assert law.terms[0].coefficient.variable == "screwEffect.empirical.k_f"
    assert law.terms[0].shapes["v_f"].value == 1.2345e-3
    assert law.terms[1].shapes["w"].value == 628.3, "an order of the machine is not fitted"
    assert law.held_out_gain == pytest.approx(80.0)


@pytest.mark.parametrize(
    ("block", "first", "beside", "shared"),
    [
        # A wave of the inverter has the width of the soft sign, a second harmonic the wave number of the first.
        ("EmpiricalVoltage", "k_s", "k_sin", {"i_s"}),
        ("Empirical", "k_sin", "k_sin2", {"w"}),
    ],
)
def test_some_terms_are_offered_beside_another_one_whose_shape_they_share(
    block: str, first: str, beside: str, shared: set[str]
):
    variants = [e.variants[0] for e in EMPIRICAL if e.variants[0].block == block]
    (wave,) = [v for v in variants if v.beside]
    assert wave.parameters[0].name == beside
    (other,) = [v for v in variants if v.parameters[0].name == first]
    assert {p.name for p in wave.parameters} & {p.name for p in other.parameters} == shared
    named = {(v.block, v.parameters[0].name) for e in EMPIRICAL for v in e.variants[:1] if v.beside}
    assert named == {("EmpiricalVoltage", "k_sin"), ("Empirical", "k_sin2")}, "no other term waits for one"


def beside_a_law(true: dict[str, float], *, added: bool = True) -> tuple[FoundLaw, Attribution]:
    """What a search keeps of windage, accepted first, once friction that falls with the speed has joined as a law."""
    own, declared, weights, (effect, term), final, held = accepted_by_hand(
        true, "windage:motor", "stribeck:motor"
    )
    found = Attribution(
        term.fit, 0.0, (), (term,), final,
        weights.plain(weights.base_held, "validate"), weights.plain(held, "validate"), own.factors("fit"),
    )  # fmt: skip
    asked: Any = SimpleNamespace(empirical=added)
    none: Any = None
    search = LawSearch(none, asked, (), declared, (), (effect,), none, none, none, none)
    return search._without_needless(own, found), found


def test_an_effect_that_a_law_makes_needless_is_dropped():
    law, _ = beside_a_law(STRIBECK)
    assert law.effects == ()
    assert [s.candidate.name for s in law.terms.accepted] == ["stribeck:motor"]
    assert "motorEffect.windage.b_q" not in law.terms.final.unknowns.names
    assert law.terms.notes == ("windage:motor was dropped: the other effects explain the same",)
    np.testing.assert_allclose(np.mean(law.terms.final_validate**2), 1.0, atol=0.1)


def test_an_effect_that_is_needed_beside_a_law_stays():
    law, found = beside_a_law({**WINDAGE, **STRIBECK})
    assert [s.candidate.name for s in law.effects] == ["windage:motor"]
    assert law.terms.accepted == found.accepted
    assert law.terms.final is found.final


def test_beside_a_law_that_is_only_described_every_effect_stays():
    law, found = beside_a_law(STRIBECK, added=False)
    assert [s.candidate.name for s in law.effects] == ["windage:motor"]
    assert law.terms is found
