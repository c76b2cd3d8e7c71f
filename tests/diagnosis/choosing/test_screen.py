"""The screening against least squares: what a candidate would do, less what the declared parameters can imitate."""

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from thsa_cosim.diagnosis.catalogue.candidate import Candidate, CandidateParameter
from thsa_cosim.diagnosis.choosing import screen as room
from thsa_cosim.diagnosis.choosing.screen import TESTABLE, Orthogonal, Proposal, propose, screen, shape_starts
from thsa_cosim.diagnosis.fitting.fit import RESPONSE, Fit
from thsa_cosim.diagnosis.fitting.unknowns import Unknown, Unknowns

N = 400
RNG = np.random.default_rng(6)
#: What the declared parameters p and q, and the coefficients a and b, do to the residuals; and what is left.
COLUMNS = {name: RNG.standard_normal(N) for name in ("p", "q", "a", "b")}
COLUMNS["b"] += 2.0 * COLUMNS["p"]
LEFT = RNG.standard_normal(N) - 0.4 * COLUMNS["a"] + 0.2 * COLUMNS["b"]
MARK = 40.0 * RNG.standard_normal(N)


def unknown(name: str, **more: Any) -> Unknown:
    return Unknown(name, name, "1", more.get("start", 0.0), more.get("spread", np.inf), 1.0, -99.0, 99.0)


def parameter(name: str, role: str = "coefficient", **more: Any) -> CandidateParameter:
    given = {
        "variable": f"effect.{name}", "unit": "1", "typical": 100.0, "lower": -1e9, "upper": 1e9, "neutral": 0.0,
        "starts": (1.0,), "fixed": False, "scanned": False,
    }  # fmt: skip
    return CandidateParameter(name=name, role=role, **(given | more))


def candidate(*parameters: CandidateParameter, key: str = "x", **variant: bool) -> Candidate:
    kind = SimpleNamespace(instead=False, beside=False, component=key)
    kind.__dict__.update(variant)
    slot: Any = SimpleNamespace(name="motor", interface="ShaftEffect")
    every = tuple(parameters)
    return Candidate(SimpleNamespace(name=key), kind, slot, 0, every, every)  # type: ignore[arg-type]


def base(spread: float = np.inf) -> Fit:
    """A fit of p and q, at 3 and 5, with LEFT left."""
    unknowns = Unknowns((unknown("p", spread=spread), unknown("q")))
    jacobian = np.column_stack([COLUMNS["p"], COLUMNS["q"]])
    return Fit(unknowns, np.array([3.0, 5.0]), LEFT, jacobian, np.ones(2), 0.0, True)


class Linear:
    """Simulates: residuals that are linear in the coefficients, shape n adds MARK; ``fails`` gives none."""

    def __init__(
        self, fails: Callable[[dict[str, float]], bool] = lambda _: False, size: float = 1e-2
    ) -> None:
        self.fails, self.size = fails, size
        self.asked: list[dict[str, float]] = []
        self.batches: list[int] = []

    def residuals(self, unknowns: Unknowns, vectors: np.ndarray, part: str) -> list[Any]:
        assert part == "fit"
        self.batches.append(len(vectors))
        return [self.one(unknowns.named(vector)) for vector in vectors]

    def one(self, values: Any) -> Any:
        self.asked.append(dict(values))
        assert (values["p"], values["q"]) == (3.0, 5.0), "around the fit"
        if self.fails(values):
            return None
        moved = sum(self.size * values.get(f"effect.{n}", 0.0) * COLUMNS[n] for n in ("a", "b"))
        return LEFT + moved + (MARK if values.get("effect.n", 1.0) == 2.0 else 0.0)


def proposed(*candidates: Candidate, bench: Any = None, fit: Fit | None = None) -> list[Proposal]:
    rows = [(c, shapes) for c in candidates for shapes in shape_starts(c, {}, {})]
    return propose(bench or Linear(), fit or base(), rows)


def without_declared(response: np.ndarray) -> np.ndarray:
    jacobian = np.column_stack([COLUMNS["p"], COLUMNS["q"]])
    return response - jacobian @ np.linalg.lstsq(jacobian, response, rcond=None)[0]


def test_a_proposal_is_the_least_squares_step_beside_the_declared_parameters():
    (found,) = proposed(candidate(parameter("a"), parameter("b")))
    response = 1e-2 * np.column_stack([COLUMNS["a"], COLUMNS["b"]])
    np.testing.assert_allclose(found.response, response, rtol=1e-4, atol=1e-6)
    left = without_declared(response)
    best, (rest,), *_ = np.linalg.lstsq(left, -LEFT, rcond=None)
    np.testing.assert_allclose(found.amplitudes, best, rtol=1e-4)
    assert found.gain == pytest.approx(LEFT @ LEFT - rest, rel=1e-4)
    np.testing.assert_allclose(found.precision, left.T @ left, rtol=1e-4)
    np.testing.assert_allclose(found.stderr, np.sqrt(np.diag(np.linalg.inv(left.T @ left))), rtol=1e-4)
    assert found.remaining == pytest.approx(
        np.mean(np.sum(left**2, axis=0) / np.sum(response**2, axis=0)), rel=1e-4
    )
    assert 0.1 < found.remaining < 0.9, "b is imitated in part"
    assert found.is_testable


def test_the_best_proposal_comes_first_and_each_has_its_own_shapes():
    weak, strong = candidate(parameter("b"), key="b"), candidate(parameter("a"), key="a")
    found = proposed(weak, strong)
    assert [p.candidate for p in found] == [strong, weak]
    shaped = candidate(parameter("a"), parameter("n", "shape", starts=(1.0, 2.0)))
    bench = Linear()
    first, second = (p for p in proposed(shaped, weak, bench=bench) if p.candidate is shaped)
    assert {first.shapes["n"], second.shapes["n"]} == {1.0, 2.0}
    assert {v["effect.n"] for v in bench.asked if v["effect.b"] == 0.0} == {1.0, 2.0}
    assert {v["effect.n"] for v in bench.asked if v["effect.b"] != 0.0} == {1.0}, "others rest at their start"
    marked = next(p for p in (first, second) if p.shapes["n"] == 2.0)
    np.testing.assert_allclose(
        marked.response[:, 0], (1.0 * COLUMNS["a"] + MARK) / 100.0, rtol=1e-4, atol=1e-4
    )
    assert marked.label == "x/x0 (n = 2)"
    assert found[0].label == "a/a0"


def test_a_coefficient_that_cannot_be_negative_gains_nothing_where_it_would_have_to():
    """LEFT asks for a of about +0.4 and for b of -0.2, in units of a column of 0.01."""
    up, down = proposed(
        candidate(parameter("a", lower=0.0), key="a"), candidate(parameter("b", lower=0.0), key="b")
    )
    assert up.amplitudes[0] == pytest.approx(40.0, rel=0.2)
    assert up.gain > 10.0
    assert (down.amplitudes[0], down.gain) == (0.0, 0.0)
    (moved,) = proposed(candidate(parameter("b", lower=-5.0, neutral=0.0)))
    assert moved.amplitudes[0] == pytest.approx(-5.0), "as far as its bound"
    assert 0.0 < moved.gain < proposed(candidate(parameter("b")))[0].gain
    (neutral,) = proposed(candidate(parameter("b", lower=1.0, neutral=6.0)), bench=Linear())
    assert neutral.amplitudes[0] == pytest.approx(-5.0), "from where it does nothing"
    two = candidate(parameter("a", lower=0.0), parameter("b", lower=0.0))
    assert proposed(two)[0].amplitudes[1] < 0.0, "of several, the fit finds out"


@pytest.mark.parametrize("size", [1e-7, 1e-4, 10.0, 1e3])
def test_a_step_that_does_far_too_little_or_too_much_is_taken_again_once(size: float):
    bench = Linear(size=size)
    (found,) = proposed(candidate(parameter("a")), bench=bench)
    steps = [v["effect.a"] for v in bench.asked]
    norm = 100.0 * size * np.linalg.norm(COLUMNS["a"])
    factor = np.clip(3.0 * RESPONSE / norm, 1e-3, 30.0)
    assert steps == pytest.approx([100.0, 100.0 * factor])
    np.testing.assert_allclose(found.response[:, 0], size * COLUMNS["a"], rtol=1e-2, atol=1e-3 * size)


@pytest.mark.parametrize(("share", "again"), [(1.01, False), (0.99, True)])
@pytest.mark.parametrize("side", [-1, 1])
def test_a_step_within_a_factor_of_thirty_of_what_is_wanted_serves(share: float, again: bool, side: int):
    wanted = 3.0 * RESPONSE * (30.0 / share) ** side
    bench = Linear(size=wanted / (100.0 * float(np.linalg.norm(COLUMNS["a"]))))
    proposed(candidate(parameter("a")), bench=bench)
    assert len(bench.asked) == 1 + again


def test_a_step_that_cannot_be_simulated_is_tried_at_a_tenth_and_then_left_out():
    bench = Linear(fails=lambda v: v["effect.a"] > 50.0)
    found = proposed(candidate(parameter("a"), key="a"), candidate(parameter("b"), key="b"), bench=bench)
    assert [v["effect.a"] for v in bench.asked if v["effect.a"] != 0.0] == [100.0, 10.0]
    assert [p.candidate.name for p in found] == ["a", "b"]
    np.testing.assert_allclose(found[0].response[:, 0], 1e-2 * COLUMNS["a"], rtol=1e-3, atol=1e-5)
    never = Linear(fails=lambda v: v["effect.a"] > 0.0)
    found = proposed(candidate(parameter("a"), key="a"), candidate(parameter("b"), key="b"), bench=never)
    assert [p.candidate.name for p in found] == ["b"]
    assert sum(v["effect.a"] > 0.0 for v in never.asked) == 2
    one_of_two = proposed(candidate(parameter("a"), parameter("b")), bench=never)
    assert one_of_two == []


def test_a_better_step_that_cannot_be_simulated_leaves_the_first_response():
    bench = Linear(size=1e-7, fails=lambda v: v["effect.a"] > 100.0)
    (found,) = proposed(candidate(parameter("a")), bench=bench)
    assert len(bench.asked) == 2
    np.testing.assert_allclose(found.response[:, 0], 1e-7 * COLUMNS["a"], rtol=1e-2, atol=1e-11)


def test_nothing_offered_asks_for_nothing():
    bench = Linear()
    assert propose(bench, base(), []) == []  # type: ignore[arg-type]
    assert screen(bench, base(), [], {}) == []  # type: ignore[arg-type]
    assert bench.asked == []


def test_what_nothing_depends_on_promises_nothing_and_is_not_testable():
    (found,) = proposed(candidate(parameter("c")))
    assert (found.gain, found.amplitudes.tolist(), found.is_testable) == (0.0, [0.0], False)
    assert found.stderr.tolist() == [np.inf]
    (half,) = proposed(candidate(parameter("a"), parameter("c")))
    assert half.is_testable
    assert np.isfinite(half.stderr[0])
    assert half.stderr[1] == np.inf
    half.response[0, 0] = np.nan
    assert not half.is_testable


def test_what_the_declared_parameters_imitate_wholly_promises_nothing(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(COLUMNS, "a", COLUMNS["p"] - 0.5 * COLUMNS["q"])
    (found,) = proposed(candidate(parameter("a")))
    assert found.remaining < TESTABLE
    assert (found.gain, found.amplitudes[0]) == (0.0, 0.0)
    (held,) = proposed(candidate(parameter("a")), fit=base(spread=1e-3))
    assert held.remaining > 0.5, "unless the drawing holds one of them"


def test_responses_that_are_alike_have_standard_errors_whatever_rounding_makes_of_their_products():
    (found,) = proposed(candidate(parameter("a"), parameter("b")))
    alike = 2.0 * (1.0 + 1e-5)  # as products of single precision come out: indefinite
    found = replace(found, precision=np.array([[4.0, alike], [alike, 1.0]]))
    np.testing.assert_allclose(found.stderr, [0.25, 0.5], rtol=1e-4)


def test_a_summary_keeps_all_but_the_response():
    (found,) = proposed(candidate(parameter("a"), parameter("b")))
    assert found.summary.response.shape == (0, 2)
    assert found.summary.gain == found.gain


def test_what_is_tried_is_the_whole_effect_and_its_further_parts_only_beside_it():
    whole = candidate(parameter("a"), key="whole")
    instead = candidate(parameter("a"), key="instead", instead=True)
    beside = candidate(parameter("b"), key="beside", beside=True)
    found = screen(Linear(), base(), [whole, instead, beside], {})  # type: ignore[arg-type]
    assert [p.candidate for p in found] == [whole]
    wider = base()
    members = (*wider.unknowns.members, unknown("effect.b"))
    jacobian = np.column_stack([wider.jacobian, COLUMNS["b"]])
    wider = Fit(Unknowns(members), np.array([3.0, 5.0, 0.0]), LEFT, jacobian, np.ones(3), 0.0, True)
    found = screen(Linear(), wider, [whole, instead, beside], {})  # type: ignore[arg-type]
    assert {p.candidate.name for p in found} == {"whole", "beside"}


def test_wave_numbers_that_were_found_are_starts_and_a_shape_of_the_model_stays():
    ripple = candidate(
        parameter("a"),
        parameter("n", "shape", starts=(6.0, 12.0), lower=1.0, upper=100.0, scanned=True),
        parameter("m", "shape", starts=(1.0, 3.0)),
    )
    found = shape_starts(ripple, {"motor": (12.0, 1.0, 0.9, 100.0, 101.0), "gear": (7.0,)}, {})
    assert [tuple(s.values()) for s in found] == [(n, m) for n in (6.0, 12.0, 1.0, 100.0) for m in (1.0, 3.0)]
    assert list(found[0]) == ["n", "m"]
    assert shape_starts(ripple, {}, {"effect.n": 8.0}) == [{"n": 8.0, "m": 1.0}, {"n": 8.0, "m": 3.0}]
    assert len(screen(Linear(), base(), [ripple], {"motor": (7.0,)})) == 6  # type: ignore[arg-type]
    assert shape_starts(candidate(parameter("a")), {"motor": (7.0,)}, {}) == [{}]


def test_long_recordings_are_simulated_a_few_at_a_time(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(room, "AT_ONCE", 2 * 8 * N + 7)
    bench = Linear()
    many = [candidate(parameter(n), key=f"{n}{k}") for k in range(2) for n in ("a", "b")] + [
        candidate(parameter("a"))
    ]
    assert len(proposed(*many, bench=bench)) == 5
    assert bench.batches == [2, 2, 1]
    monkeypatch.setattr(room, "AT_ONCE", 1)
    bench = Linear()
    proposed(*many[:2], bench=bench)
    assert bench.batches == [1, 1]


@pytest.mark.parametrize("rows", [1, 7, N, 1000])
def test_products_are_those_of_what_remains_however_many_rows_at_a_time(
    rows: int, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(room, "_ROWS", rows)
    responses = [np.column_stack([COLUMNS["a"], COLUMNS["b"]]), MARK[:, None]]
    orthogonal = Orthogonal(base())
    left = without_declared(np.concatenate(responses, axis=1))
    np.testing.assert_allclose(orthogonal.products(responses), left.T @ left, rtol=1e-4, atol=0.3)
    np.testing.assert_allclose(orthogonal.remaining(responses[0]), left[:, :2], atol=1e-4)


def orthogonal(p: np.ndarray, q: np.ndarray) -> Orthogonal:
    unknowns = Unknowns((unknown("p"), unknown("q")))
    return Orthogonal(Fit(unknowns, np.zeros(2), LEFT, np.column_stack([p, q]), np.ones(2), 0.0, True))


def test_an_unknown_on_which_nothing_depends_imitates_nothing_however_little_the_others_do():
    response = (COLUMNS["p"] + COLUMNS["a"])[:, None]
    alone = float(COLUMNS["p"] @ response[:, 0] / (COLUMNS["p"] @ COLUMNS["p"]))
    for size in (1.0, 1e-6):
        moved = orthogonal(size * COLUMNS["p"], np.zeros(N)).project(response)
        np.testing.assert_allclose(moved[:, 0], [alone / size, 0.0], rtol=1e-5)


def test_two_unknowns_that_do_the_same_share_what_they_imitate():
    both = orthogonal(COLUMNS["p"], COLUMNS["p"])
    response = 2.0 * COLUMNS["p"][:, None]
    np.testing.assert_allclose(both.project(response)[:, 0], [1.0, 1.0], rtol=1e-4)
    np.testing.assert_allclose(both.remaining(response), 0.0, atol=1e-4)


@pytest.mark.parametrize(("below", "share"), [(-1e-3, 1e-9), (1e-8, 1e-7), (1e-6, 1e-5)])
def test_the_ridge_is_the_smallest_that_leaves_the_information_definite(below: float, share: float):
    """Eigenvalues -below and 2 + below, about, times the sizes of the unknowns."""
    sizes = np.diag([1e-4, 30.0])
    information = sizes @ np.array([[1.0, 1.0 + below], [1.0 + below, 1.0]]) @ sizes
    triangle, lower = room._factor(information)
    upper = np.triu(triangle)
    assert not lower
    whole = information + share * np.diag(np.diag(information))
    np.testing.assert_allclose(upper.T @ upper, whole, rtol=1e-11)


def test_of_an_information_that_no_small_ridge_mends_the_sizes_count():
    triangle, _ = room._factor(np.array([[4.0, 12.0, 0.0], [12.0, 9.0, 0.0], [0.0, 0.0, 0.0]]))
    np.testing.assert_allclose(np.triu(triangle), np.diag([2.0, 3.0, 1.0]), atol=1e-12)
