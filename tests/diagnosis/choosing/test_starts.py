"""Starts of shapes: where the catalogue's own lead nowhere, the promised gain is searched over the shapes' ranges."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.analytic import bench, candidates, unknowns
from thsa_cosim.diagnosis.catalogue.candidate import Candidate
from thsa_cosim.diagnosis.choosing.attribution import attribute
from thsa_cosim.diagnosis.choosing.screen import screen
from thsa_cosim.diagnosis.choosing.starts import CLOSE, WIDE, further_starts, points_around
from thsa_cosim.diagnosis.fitting.fit import refine

#: A Stribeck speed an order below the lowest start of the catalogue, sharp.
SLOW = {"motorEffect.stribeck.dF": 1.5, "motorEffect.stribeck.v_S": 0.25, "motorEffect.stribeck.n": 2.5}


def shape(name: str, lower: float, upper: float) -> Any:
    return SimpleNamespace(name=name, lower=lower, upper=upper, scanned=False)


def test_points_fill_the_range_by_its_logarithm_where_it_is_positive() -> None:
    candidate: Any = SimpleNamespace(shapes=(shape("v_S", 0.01, 100.0), shape("z", -2.0, 4.0)))
    points = points_around(candidate, {"v_S": 1.0, "z": 1.0, "n": 7.0}, 1.0, 32)
    assert len(points) == 32
    assert {p["n"] for p in points} == {7.0}, "what is no free shape stays"
    assert points == points_around(candidate, {"v_S": 1.0, "z": 1.0, "n": 7.0}, 1.0, 32), "no chance in them"
    speeds, places = np.array([p["v_S"] for p in points]), np.array([p["z"] for p in points])
    assert np.histogram(np.log10(speeds), bins=4, range=(-2.0, 2.0))[0].min() >= 7
    assert np.histogram(places, bins=4, range=(-2.0, 4.0))[0].min() >= 7


def test_a_range_that_begins_at_zero_is_searched_linearly() -> None:
    candidate: Any = SimpleNamespace(shapes=(shape("z", 0.0, 4.0),))
    found = np.array([p["z"] for p in points_around(candidate, {"z": 1.0}, 1.0, 32)])
    assert np.histogram(found, bins=4, range=(0.0, 4.0))[0].min() >= 7


@pytest.mark.parametrize(
    "shapes",
    [
        (),
        (SimpleNamespace(name="n", variable="n", lower=1.0, upper=100.0, scanned=True),),
        (
            SimpleNamespace(name="v_S", variable="v_S", lower=0.01, upper=1.0, scanned=False),
            SimpleNamespace(name="n", variable="known", lower=1.0, upper=2.0, scanned=False),
        ),
    ],
    ids=["none", "a wave number", "one that the base holds"],
)
def test_candidates_without_shapes_of_their_own_to_search_are_left_out(
    monkeypatch: pytest.MonkeyPatch, shapes: tuple[Any, ...]
) -> None:
    asked: list[Any] = []
    monkeypatch.setattr(
        "thsa_cosim.diagnosis.choosing.starts.propose", lambda bench, base, rows: asked.extend(rows) or []
    )
    candidate = SimpleNamespace(key="a", shapes=shapes)
    proposals: Any = [SimpleNamespace(candidate=candidate, shapes={"v_S": 0.1, "n": 1.5}, gain=100.0)]
    base: Any = SimpleNamespace(unknowns=SimpleNamespace(named=lambda vector: {"known": 1.5}), vector=())
    assert further_starts(None, base, proposals) == []  # type: ignore[arg-type]
    assert asked == []


@pytest.mark.parametrize("centre", [0.02, 1.0, 90.0])
def test_a_search_around_a_point_stays_within_the_range(centre: float) -> None:
    candidate: Any = SimpleNamespace(shapes=(shape("v_S", 0.01, 100.0),))
    logs = np.log10([p["v_S"] for p in points_around(candidate, {"v_S": centre}, 0.25, 16)])
    assert logs.min() >= -2.0 - 1e-9
    assert logs.max() <= 2.0 + 1e-9
    assert 0.8 < np.ptp(logs) <= 1.0
    assert logs.min() - 0.1 <= np.log10(centre) <= logs.max() + 0.1


def test_the_search_promises_more_than_the_starts_of_the_catalogue() -> None:
    offered = candidates("stribeck", "windage")
    own = bench(offered, SLOW)
    base = refine(own, unknowns(), unknowns().start, iterations=10)
    assert base is not None
    proposals = screen(own, base, offered, {})
    found = further_starts(own, base, proposals)
    assert found[0].gain > 1.5 * proposals[0].gain
    assert found[0].shapes["v_S"] < 0.5 * min(
        p.shapes.get("v_S", 9.0) for p in proposals if "motor" in p.label
    )
    assert [p.gain for p in found] == sorted((p.gain for p in found), reverse=True)
    per_candidate = WIDE + 2 * CLOSE
    assert len(found) == 2 * per_candidate, "windage has no shape"


@pytest.mark.parametrize(
    ("gains", "searched"),
    [((100.0, 60.0, 50.0, 40.0, 30.0), "abcd"), ((30.0, 9.0, 100.0), "ca"), ((100.0, 10.0), "ab"), ((), "")],
)
def test_the_most_promising_are_searched_widely_then_twice_around_their_best(
    monkeypatch: pytest.MonkeyPatch, gains: tuple[float, ...], searched: str
) -> None:
    asked: list[list[tuple[Any, Any]]] = []
    monkeypatch.setattr(
        "thsa_cosim.diagnosis.choosing.starts.propose", lambda bench, base, rows: asked.append(rows) or []
    )
    own = (SimpleNamespace(name="v_S", variable="v_S", lower=0.01, upper=100.0, scanned=False),)
    proposals: Any = [
        SimpleNamespace(candidate=SimpleNamespace(key=key, shapes=own), shapes={"v_S": 1.0}, gain=gain)
        for key, gain in zip("abcde", gains, strict=False)
    ]
    base: Any = SimpleNamespace(unknowns=SimpleNamespace(named=lambda vector: {}), vector=())
    assert further_starts(None, base, proposals) == []  # type: ignore[arg-type]
    counts = [{key: sum(c.key == key for c, _ in rows) for key in searched} for rows in asked]
    assert counts == [dict.fromkeys(searched, count) for count in (WIDE, CLOSE, CLOSE)]
    assert [len(rows) for rows in asked] == [count * len(searched) for count in (WIDE, CLOSE, CLOSE)]
    spans = [np.ptp(np.log10([s["v_S"] for _, s in rows])) for rows in asked if rows]
    assert spans == sorted(spans, reverse=True)
    assert not searched or spans[1] < 0.35 * 4.0


def test_an_effect_out_of_reach_of_its_starts_is_found_with_its_values(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The only start is a speed ten times the true one, from where Gauss-Newton leads nowhere."""
    true = {"motorEffect.stribeck.dF": 1.0, "motorEffect.stribeck.v_S": 0.9, "motorEffect.stribeck.n": 1.5}
    offered = tuple(_from_afar(c) for c in candidates("stribeck", "windage") if c.slot.name == "motor")
    found = attribute(bench(offered, true), unknowns(), offered, lambda _: {}, seed=1)
    assert found is not None
    assert [s.candidate.name for s in found.accepted] == ["stribeck:motor"]
    named = found.final.unknowns.named(found.final.vector)
    assert named["motorEffect.stribeck.v_S"] == pytest.approx(0.9, rel=0.05)
    monkeypatch.setattr("thsa_cosim.diagnosis.choosing.selection.further_starts", lambda *_: [])
    # other exponents lead there, too
    monkeypatch.setattr("thsa_cosim.diagnosis.choosing.forms.along_exponents", lambda _, one, __: one)
    without = attribute(bench(offered, true), unknowns(), offered, lambda _: {}, seed=1)
    assert without is not None
    far = without.final.unknowns.named(without.final.vector).get("motorEffect.stribeck.v_S", np.inf)
    assert not 0.8 < far < 1.0, "a test that could not fail"


def _from_afar(candidate: Candidate) -> Candidate:
    return replace(
        candidate,
        parameters=tuple(replace(p, starts=(9.0,)) if p.name == "v_S" else p for p in candidate.parameters),
    )
