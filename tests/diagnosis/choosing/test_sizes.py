"""Sizes of an effect: where declared parameters are bent to make up for a large one, it is tried over decades."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.analytic import bench, candidates, unknowns
from thsa_cosim.diagnosis.choosing import sizes
from thsa_cosim.diagnosis.choosing.needless import prune
from thsa_cosim.diagnosis.choosing.screen import Proposal, screen
from thsa_cosim.diagnosis.choosing.sizes import FITTED, SIZES, _rows, _tried, at_sizes, is_led_astray
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.fit import Fit, refine
from thsa_cosim.diagnosis.fitting.identified import _runs
from thsa_cosim.diagnosis.fitting.unknowns import Unknowns, unknowns_of

MU = "motorEffect.loadDependentFriction.mu"
#: Coulomb friction that ends at the end of its range where the load's friction is missing.
NARROW = {"lower": 0.2, "upper": 0.8}


def astray(mu: float) -> tuple[Bench, Fit, list[Proposal], np.ndarray]:
    """A drive that loses ``mu`` times its load, the declared model's fit, what is proposed, the held-out residuals."""
    offered = candidates("load-dependent-friction", "windage", "stribeck")
    own = bench(offered, {MU: mu})
    declared = unknowns(c=NARROW)
    base = refine(own, declared, declared.start, iterations=10)
    assert base is not None
    held = own.residuals(declared, base.vector[None, :], "validate")[0]
    assert held is not None
    plain = [c for c in offered if not c.variant.beside]
    return own, base, screen(own, base, plain, {}), held


@pytest.mark.parametrize("mu", [0.7, 4.0])
def test_a_load_that_is_lost_several_times_over_is_found_from_its_size(mu: float) -> None:
    own, base, proposals, held = astray(mu)
    assert is_led_astray(base, [])
    found = at_sizes(own, base, held, proposals)
    best = max(found, key=lambda s: s.held_out_gain)
    assert len(found) <= FITTED
    assert not {id(s.proposal) for s in found} & {id(p) for p in proposals}, (
        "a fit of its own beside the usual one"
    )
    assert best.candidate.effect.name == "load-dependent-friction"
    value = best.fit.unknowns.named(best.fit.vector)
    assert value[MU if MU in value else MU.replace("motor", "gear")] == pytest.approx(mu, rel=0.05)
    assert best.share > 0.95


def test_sizes_go_over_decades_from_the_fit_and_from_the_drawing(monkeypatch: pytest.MonkeyPatch) -> None:
    own, base, proposals, held = astray(0.7)
    asked: list[np.ndarray] = []
    whole = own.residuals
    monkeypatch.setattr(
        own, "residuals", lambda u, vectors, part: asked.append(vectors) or whole(u, vectors, part)
    )
    first = next(
        p for p in proposals if p.candidate.coefficients[0].variable == MU and len(p.amplitudes) == 1
    )
    monkeypatch.setattr(sizes, "RISEN", np.inf)
    at_sizes(own, base, held, [first])
    tried = np.vstack(asked[: len(SIZES)])
    typical, upper = first.candidate.coefficients[0].typical, first.candidate.coefficients[0].upper
    assert set(np.round(tried[:, -1], 9)) == {round(min(size * typical, upper), 9) for size in SIZES}
    assert {tuple(row) for row in tried[:, :-1]} == {tuple(base.vector), tuple(base.unknowns.start)}


def test_a_fit_at_the_drawing_is_tried_from_there_once() -> None:
    _, base, proposals, _ = astray(0.7)
    first = next(p for p in proposals if [c.variable for c in p.candidate.coefficients] == [MU])
    own = base.unknowns.with_members(unknowns_of(first.candidate, first.shapes, first.held))
    assert len(_rows(base, own, first)) == 2
    assert len(_rows(replace(base, vector=base.unknowns.start), own, first)) == 1


def test_sizes_end_where_more_of_it_only_does_harm() -> None:
    squares = {10.0: 8.0, 30.0: 1.0, 100.0: 4.0}  # a KeyError at any larger size

    class Numbered:
        def residuals(self, u: Any, vectors: np.ndarray, part: Any) -> list[np.ndarray | None]:
            return [None if v[-1] < 0.0 else np.array([squares[v[-1]] ** 0.5]) for v in vectors]

    plain: Any = SimpleNamespace(prior=lambda v: np.zeros(1))
    growing = [np.array([size]) for size in SIZES]
    failing = [np.array([-size]) for size in SIZES]  # a machine that runs away at all of them: all are tried
    vectors, costs = _tried(Numbered(), plain, [growing, failing])  # type: ignore[arg-type]
    assert [c for c in costs if np.isfinite(c)] == pytest.approx([8.0, 1.0, 4.0])
    assert sorted(-float(v[0]) for v in vectors if v[0] < 0.0) == list(SIZES)


def test_a_model_is_not_astray_whose_parameters_stay_or_where_an_effect_explains_half() -> None:
    _, base, _, _ = astray(0.7)
    explains: Any = SimpleNamespace(share=0.6)
    hardly: Any = SimpleNamespace(share=0.4)
    assert is_led_astray(base, [hardly])
    assert not is_led_astray(base, [hardly, explains])
    sound = refine(bench(candidates("windage"), {}), unknowns(), unknowns().start)
    assert sound is not None
    assert not is_led_astray(sound, [])


def test_a_start_at_which_a_solver_fails_is_moved_a_little() -> None:
    own, declared = bench(candidates("windage"), {}), unknowns()

    class Failing:
        def residuals(self, u: Any, vectors: np.ndarray, part: Any) -> list[np.ndarray | None]:
            found = own.residuals(u, vectors, part)
            return [None if np.array_equal(v, u.start) else r for v, r in zip(vectors, found, strict=True)]

    vector, residual = _runs(Failing(), declared, declared.start)  # type: ignore[arg-type]
    assert residual is not None
    assert 0.0 < np.max(np.abs(vector - declared.start) / declared.scale) <= 1e-3
    nothing: Any = SimpleNamespace(residuals=lambda u, vectors, part: [None] * len(vectors))
    assert _runs(nothing, declared, declared.start)[1] is None


def test_what_further_parts_stand_beside_is_not_pruned() -> None:
    """A breakaway part may be wide enough to stand for the whole friction per load; it is no part without it."""
    offered = {c.key: c for c in candidates("load-dependent-friction")}
    whole, part = (offered[f"load-dependent-friction:motor/loadDependentFriction{k}"] for k in (0, 2))
    accepted: Any = [SimpleNamespace(candidate=whole), SimpleNamespace(candidate=part)]
    held = np.zeros(3)
    kept, *_, notes = prune(None, None, None, accepted, None, held)  # type: ignore[arg-type]
    assert kept == accepted
    assert notes == []


def test_a_shape_that_is_held_is_held_at_every_size(monkeypatch: pytest.MonkeyPatch) -> None:
    own, base, proposals, held = astray(0.7)
    shaped = next(p for p in proposals if p.candidate.shapes and len(p.candidate.coefficients) == 1)
    shape = next(p for p in shaped.candidate.shapes if not p.fixed)
    asked: list[float] = []

    def spreads(unknowns: Unknowns, vectors: np.ndarray, part: str) -> list[None]:
        asked.append(next(u.spread for u in unknowns.members if u.name == shape.variable))
        return [None] * len(vectors)

    monkeypatch.setattr(own, "residuals", spreads)
    for names in (frozenset(), frozenset({shape.name})):
        at_sizes(own, base, held, [replace(shaped, held=names)])
    free, fixed = dict.fromkeys(asked)  # each the same at every size
    assert np.isinf(free)
    assert 0.0 < fixed < 1e-3 * abs(shaped.shapes[shape.name])
