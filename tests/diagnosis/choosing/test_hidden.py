"""What an untestable part of an effect leaves open of the parameters that imitate it, against least squares."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from thsa_cosim.diagnosis.catalogue.candidate import Candidate, CandidateParameter
from thsa_cosim.diagnosis.choosing.hidden import (
    HiddenPart,
    _hidden,
    hidden_parts,
    notes_on_hidden,
    widening,
)
from thsa_cosim.diagnosis.choosing.screen import propose
from thsa_cosim.diagnosis.fitting.fit import Fit
from thsa_cosim.diagnosis.fitting.unknowns import Unknown, Unknowns

N, SPREAD, K_T = 4000, 0.015, 0.3
SEED = 3
RNG = np.random.default_rng(SEED)
#: What a torque constant, per 0.01 of it, and a friction do to a current; a part of the friction that scales the load
#: does what the torque constant does, but for one in a thousand.
TORQUE, FRICTION, OTHER = RNG.standard_normal((3, N))
PARTS = {"scales": -TORQUE / 0.01 * K_T + 1e-3 * OTHER, "differs": OTHER / 0.01}


@pytest.fixture(autouse=True)
def own_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each test draws the same numbers whatever runs before it."""
    monkeypatch.setitem(globals(), "RNG", np.random.default_rng(SEED + 1))


def candidate(name: str) -> Candidate:
    own = CandidateParameter(
        name, f"screwEffect.loss.{name}", "1", "coefficient", 0.01, -20.0, 20.0, 0.0, (0.01,), False, False
    )
    described: Any = SimpleNamespace(description=f"what {name}")
    variant: Any = SimpleNamespace(
        block="Loss", beside=True, instead=False, component="loss", parameters=(described,)
    )
    slot: Any = SimpleNamespace(name="screw", interface="FrictionEffect")
    effect: Any = SimpleNamespace(name="loss")
    return Candidate(effect, variant, slot, 0, (own,), (own,), True)


def fitted(spread: float) -> Fit:
    unknowns = Unknowns(
        (
            Unknown("K_t", "K_t", "N.m/A", K_T, spread, 0.01, 0.01, 9.0),
            Unknown("T_c", "T_c", "N.m", 0.1, np.inf, 1.0, 0.0, 9.0),
        )
    )
    jacobian = np.column_stack([TORQUE, FRICTION])
    return Fit(unknowns, np.array([0.307, 0.1]), RNG.standard_normal(N), jacobian, np.ones(2), 0.0, True)


def found(fit: Fit, name: str) -> Any:
    def residual(values: Any) -> np.ndarray:
        return fit.residual + values[f"screwEffect.loss.{name}"] * PARTS[name]

    bench: Any = SimpleNamespace(
        residuals=lambda unknowns, vectors, _: [residual(unknowns.named(v)) for v in vectors]
    )
    part = candidate(name)
    one = SimpleNamespace(proposals=propose(bench, fit, [(part, {})]), threshold=17.0)
    return SimpleNamespace(rounds=(one,), accepted=(SimpleNamespace(candidate=part),), final=fit, base=fit)


@pytest.mark.parametrize("spread", [SPREAD, 0.1])
def test_with_the_part_open_the_errors_are_those_of_the_fit_with_it(spread: float) -> None:
    """Covariance of all three unknowns together, by the inverse of their information."""
    fit = fitted(spread)
    parts = hidden_parts(found(fit, "scales"))
    whole = np.column_stack([fit.jacobian, PARTS["scales"]])
    prior = np.diag([(0.01 / spread) ** 2, 0.0, 0.0])
    known = whole.T @ whole / fit.inflation + prior
    expected = np.sqrt(np.diag(np.linalg.inv(known))) * [0.01, 1.0, 1.0]
    own = np.sqrt(np.diag(np.linalg.inv(known[:2, :2]))) * [0.01, 1.0]
    assert abs(parts[0].size) == pytest.approx(expected[2], rel=0.02)
    np.testing.assert_allclose(np.hypot(own, widening(parts, fit)), expected[:2], rtol=0.02)


def test_of_a_part_that_nothing_bounds_its_range_is_all_that_is_known() -> None:
    """Neither recordings nor drawing say how large it is: a uniform distribution over its range, (b - a) / sqrt(12)."""
    (part,) = hidden_parts(found(fitted(np.inf), "scales"))
    assert abs(part.size) == pytest.approx(40.0 / np.sqrt(12.0))


def test_a_note_says_what_the_parameter_would_be_and_that_it_is_to_be_measured_apart() -> None:
    fit = fitted(SPREAD)
    (part,) = hidden_parts(found(fit, "scales"))
    assert part.moves["K_t"] == pytest.approx(K_T * part.size, rel=0.01)
    (note,) = notes_on_hidden([part], fit, np.array([7e-4, 1e-2]))
    assert note.startswith(
        "loss:screw: scales, what scales, acts on these recordings as a change of K_t does"
    )
    assert f"K_t would be {0.307 + part.moves['K_t']:.4g} in place of 0.307 N.m/A" in note


def test_a_part_that_would_be_seen_leaves_nothing_open() -> None:
    fit = fitted(SPREAD)
    assert hidden_parts(found(fit, "differs")) == ()
    assert not widening((), fit).any()


def test_what_is_in_the_model_and_what_has_several_parameters_is_no_hidden_part() -> None:
    fit = fitted(SPREAD)
    one = found(fit, "scales")
    assert len(hidden_parts(one)) == 1
    inside = Unknown(
        "screwEffect.loss.scales", "screwEffect.loss.scales", "1", 0.0, np.inf, 1.0, -9.0, 9.0, declared=False
    )
    one.final = replace(fit, unknowns=fit.unknowns.with_members([inside]))
    assert hidden_parts(one) == ()
    one.final = fit
    (proposal,) = one.rounds[0].proposals
    several = replace(proposal.candidate, parameters=proposal.candidate.parameters * 2)
    one.rounds[0].proposals = [replace(proposal, candidate=several)]
    assert hidden_parts(one) == ()


def test_a_part_of_another_effect_or_in_another_place_is_not_hidden_and_the_last_screening_counts() -> None:
    one = found(fitted(SPREAD), "scales")
    (proposal,) = one.rounds[0].proposals
    own = proposal.candidate
    for other in (
        replace(own, variant=SimpleNamespace(**{**vars(own.variant), "block": "Other"})),
        replace(own, variant=SimpleNamespace(**{**vars(own.variant), "beside": False})),
        replace(own, slot=SimpleNamespace(name="motor", interface="FrictionEffect")),
    ):
        one.rounds[0].proposals = [replace(proposal, candidate=other)]
        assert hidden_parts(one) == ()
    seen = SimpleNamespace(proposals=[replace(proposal, remaining=0.5)], threshold=17.0)
    unseen = SimpleNamespace(proposals=[proposal], threshold=17.0)
    one.rounds = (unseen, seen)  # beside a further effect the part would be seen
    assert hidden_parts(one) == ()
    one.rounds = (seen, unseen)
    assert len(hidden_parts(one)) == 1


def part(moves: dict[str, float], unit: str = "1") -> HiddenPart:
    own = replace(candidate("d").parameters[0], unit=unit)
    return HiddenPart("loss:screw", own, "half a difference", -0.25, moves)


def test_a_part_leaves_alone_what_it_does_not_move_and_several_add_in_quadrature() -> None:
    fit = fitted(SPREAD)
    np.testing.assert_allclose(widening([part({"K_t": -3.0})], fit), [3.0, 0.0])
    np.testing.assert_allclose(
        widening([part({"K_t": 3.0}), part({"K_t": 4.0, "T_c": 1.0})], fit), [5.0, 1.0]
    )


@pytest.mark.parametrize(("unit", "shown"), [("1", "-0.25"), ("N.m", "-0.25 N.m")])
def test_the_note_in_full(unit: str, shown: str) -> None:
    """Of several parameters it gives the one that would change by the largest share: T_c by half, K_t by a third."""
    moves, errors = {"K_t": 0.1, "T_c": 0.05}, np.array([0.01, 0.01])
    (note,) = notes_on_hidden([part(moves, unit)], fitted(SPREAD), errors)
    assert note == (
        "loss:screw: d, half a difference, acts on these recordings as a change of K_t and T_c does;"
        f" with d = {shown}, T_c would be 0.15 in place of 0.1 N.m, which its standard error covers."
        " Measure one of them apart from the machine (a torque constant by the back-EMF),"
        " and give it that value with a small spread"
    )
    (note,) = notes_on_hidden([part({"T_c": 0.05}, unit)], fitted(SPREAD), errors)
    assert "a change of T_c does" in note
    assert "Measure T_c apart from the machine" in note


def test_a_note_takes_more_than_a_standard_error_of_a_declared_parameter() -> None:
    fit = fitted(SPREAD)
    errors = np.array([0.1, 0.05])
    assert notes_on_hidden([part({"K_t": 0.1, "T_c": 0.05})], fit, errors) == ()
    assert notes_on_hidden([part({})], fit, errors) == ()
    free = replace(fit, unknowns=Unknowns(tuple(replace(u, declared=False) for u in fit.unknowns.members)))
    assert notes_on_hidden([part({"K_t": 0.2})], free, errors) == ()
    # A part without a note does not end the list.
    assert len(notes_on_hidden([part({}), part({"K_t": -0.2})], fit, errors)) == 1


def test_a_parameter_that_is_zero_is_told_of_where_nothing_else_moves_only() -> None:
    fit = replace(fitted(SPREAD), vector=np.array([0.307, 0.0]))
    errors = np.array([0.01, 0.01])
    (note,) = notes_on_hidden([part({"T_c": 0.05})], fit, errors)
    assert "T_c would be 0.05 in place of 0 N.m" in note
    (note,) = notes_on_hidden([part({"K_t": 0.02, "T_c": 0.05})], fit, errors)
    assert "K_t would be 0.327 in place of 0.307 N.m/A" in note


def test_three_parameters_are_listed() -> None:
    fit = fitted(SPREAD)
    third = replace(fit.unknowns.members[1], name="T_d", variable="T_d")
    wider = replace(fit, unknowns=fit.unknowns.with_members([third]), vector=np.array([0.307, 0.1, 0.1]))
    moves = {"K_t": 0.1, "T_c": 0.05, "T_d": 0.01}
    (note,) = notes_on_hidden([part(moves)], wider, np.full(3, 1e-3))
    assert "a change of K_t, T_c and T_d does" in note


def test_what_the_recordings_ask_for_counts_as_far_as_they_know_it() -> None:
    """A Gaussian of 5 with the precision 2 beside the drawing's of 0 with 9: mean 10 / 11, variance 1 / 11."""
    proposal: Any = SimpleNamespace(
        candidate=candidate("scales"),
        moves={"K_t": np.array([3.0])},
        precision=np.array([[4.0]]),
        amplitudes=np.array([5.0]),
    )
    fit: Any = SimpleNamespace(
        unknowns=SimpleNamespace(names=("K_t",), precision=np.array([1.0])), inflation=2.0
    )
    size = np.hypot(10.0 / 11.0, np.sqrt(1.0 / 11.0))
    part = _hidden(proposal, fit)
    assert part.size == pytest.approx(size)
    assert part.moves == pytest.approx({"K_t": -3.0 * size})
