"""A candidate's fit: where it starts, which columns it keeps, which of two fits counts, and what it scores."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.analytic import DECLARED, bench, candidates, unknowns
from thsa_cosim.diagnosis.choosing import score as room
from thsa_cosim.diagnosis.choosing.score import (
    ENOUGH,
    ROUGH,
    Scored,
    extended_unknowns,
    fixed_shapes,
    go_on,
    polish,
    refit,
    score,
)
from thsa_cosim.diagnosis.choosing.screen import Proposal
from thsa_cosim.diagnosis.fitting.fit import Fit, refine
from thsa_cosim.diagnosis.fitting.structure import structure
from thsa_cosim.diagnosis.fitting.unknowns import Unknown, Unknowns

MEMBERS = (
    Unknown("p", "p", "1", 1.0, 0.5, 1.0, 0.0, 9.0),
    Unknown("a", "a", "1", 0.0, np.inf, 1.0, -9.0, 9.0, declared=False),
)
SAMPLES = 100


def fit(p: float, misfit: float, cost: float, *, converged: bool = False) -> Fit:
    """A fit with a mean squared residual of ``misfit``."""
    residual = np.full(SAMPLES, np.sqrt(misfit))
    vector, jacobian, steps = np.array([p, 4.0]), np.ones((SAMPLES, 2)), np.array([0.1, 0.2])
    return Fit(Unknowns(MEMBERS), vector, residual, jacobian, steps, cost, converged)


def scored(own: Fit) -> Scored:
    nothing: Any = SimpleNamespace()
    return Scored(nothing, own, own.residual, 1.0, 1.0, 1.0, 1.0)


@pytest.fixture
def fits(monkeypatch: pytest.MonkeyPatch) -> Any:
    """``refine`` gives what is in ``queue``, one after the other, and keeps what it was ``asked``."""
    own = SimpleNamespace(queue=[], asked=[])

    def refined(*given: Any, **more: Any) -> Fit | None:
        own.asked.append((given, more))
        return own.queue.pop(0)

    monkeypatch.setattr(room, "refine", refined)
    monkeypatch.setattr(
        room,
        "judge",
        lambda bench, proposal, found, current, held: replace(scored(found), proposal=proposal),
    )
    return own


HELD = np.zeros(SAMPLES)


def test_a_fit_down_to_the_noise_is_polished_once_from_where_it_is(fits: Any):
    choice, current = scored(fit(2.0, 3.0, 300.0)), fit(1.0, 9.0, 900.0)
    bench: Any = object()
    fits.queue = [fit(2.1, 0.999 * ENOUGH, 100.0)]
    found = polish(bench, choice, current, HELD)
    assert found.fit.vector[0] == 2.1
    assert found.proposal is choice.proposal
    ((given, more),) = fits.asked
    assert given[0] is bench
    assert given[1] is choice.fit.unknowns
    assert given[2] is choice.fit.vector
    assert more == {"steps": choice.fit.steps, "iterations": 8}


def test_what_is_gone_on_from_in_another_way_is_fitted_roughly_whatever_it_leaves(fits: Any):
    choice = scored(fit(2.0, 3.0, 300.0))
    bench: Any = object()
    fits.queue = [fit(2.1, 9.0 * ENOUGH, 100.0)]
    assert polish(bench, choice, choice.fit, HELD, rough=True).fit.vector[0] == 2.1
    ((_given, more),) = fits.asked
    assert more == {"steps": choice.fit.steps, "iterations": ROUGH}


@pytest.mark.parametrize(("costs", "expected"), [((150.0, 120.0), 1.5), ((120.0, 150.0), 2.1)])
def test_a_fit_that_leaves_more_is_tried_from_the_drawing_too_and_the_better_one_counts(
    fits: Any, costs: tuple[float, float], expected: float
):
    choice = scored(fit(2.0, 3.0, 300.0))
    bench: Any = object()
    fits.queue = [fit(2.1, 1.001 * ENOUGH, costs[0]), fit(1.5, 1.2, costs[1])]
    assert polish(bench, choice, choice.fit, HELD).fit.vector[0] == expected
    given, more = fits.asked[1]
    assert given[0] is bench
    assert given[1] is choice.fit.unknowns
    np.testing.assert_array_equal(
        given[2], [1.0, 4.0]
    )  # the declared one from the drawing, the effect's as found
    assert (more["to_beat"], more["near"]) == (costs[0], True)
    assert more["steps"] is choice.fit.steps
    np.testing.assert_array_equal(more["jacobian"], choice.fit.jacobian)  # which is that of the first, too


def test_a_polish_that_fails_leaves_what_there_was(fits: Any, monkeypatch: pytest.MonkeyPatch):
    choice = scored(fit(2.0, 3.0, 300.0))
    nothing: Any = None
    fits.queue = [None, fit(1.5, 1.2, 120.0)]
    assert polish(nothing, choice, choice.fit, HELD).fit.vector[0] == 1.5
    fits.queue = [None, None]
    assert polish(nothing, choice, choice.fit, HELD) is choice
    monkeypatch.setattr(room, "judge", lambda *given: None)
    fits.queue = [fit(2.1, 1.0, 100.0)]
    assert polish(nothing, choice, choice.fit, HELD) is choice, (
        "the held-out recordings cannot be simulated there"
    )


def test_going_on_keeps_the_declared_columns_and_stops_where_it_converged(
    fits: Any, monkeypatch: pytest.MonkeyPatch
):
    choice = scored(fit(2.0, 3.0, 300.0))
    declared = Fit(Unknowns(MEMBERS[:1]), np.ones(1), HELD, np.ones((SAMPLES, 1)), np.ones(1), 0.0, True)
    bench: Any = object()
    fits.queue = [fit(2.2, 1.0, 100.0)]
    assert go_on(bench, choice, declared, HELD).fit.vector[0] == 2.2
    ((given, more),) = fits.asked
    assert given[0] is bench
    assert given[2] is choice.fit.vector
    assert more["residual"] is choice.fit.residual
    assert more["jacobian"] is choice.fit.jacobian
    assert more["steps"] is choice.fit.steps
    assert (more["fresh"], more["iterations"], more["enough"]) == ([1], 4, 3.0)
    columns = np.ones((SAMPLES, 1))
    shared = replace(choice, fit=choice.fit.sharing(columns))
    fits.queue = [fit(2.2, 1.0, 100.0)]
    again = go_on(bench, shared, declared, HELD).fit
    assert again.shared is columns, "one copy for all fits"
    np.testing.assert_array_equal(again.jacobian, np.ones((SAMPLES, 2)))
    done = scored(fit(2.0, 3.0, 300.0, converged=True))
    assert go_on(bench, done, declared, HELD) is done
    fits.queue = [None]
    assert go_on(bench, choice, declared, HELD) is choice
    monkeypatch.setattr(room, "judge", lambda *given: None)
    fits.queue = [fit(2.2, 1.0, 100.0)]
    assert go_on(bench, choice, declared, HELD) is choice


def test_a_fit_from_another_start_has_every_column_fresh_and_no_score_if_it_fails(fits: Any):
    choice, bench = scored(fit(2.0, 3.0, 300.0)), object()
    start = np.array([1.5, 8.0])
    given: Any = (bench, choice.proposal, choice.fit, HELD, choice.fit.unknowns, start)
    fits.queue = [fit(2.2, 1.0, 100.0), None]
    steps = np.array([0.1, 0.2])
    found = refit(*given, steps)
    assert found is not None
    assert (found.fit.vector[0], found.proposal) == (2.2, choice.proposal)
    assert refit(*given) is None
    asked = (bench, choice.fit.unknowns, start)
    assert fits.asked == [(asked, {"steps": known, "enough": 3.0}) for known in (steps, None)]


def test_what_is_known_of_an_accepted_effects_shapes_stays_known_in_the_next_round():
    candidate = next(c for c in candidates("stribeck") if c.shapes)
    starts = {p.name: p.at_start for p in candidate.shapes}
    held, free = (p for p in candidate.shapes[:2])
    one = replace(proposed(0.1), candidate=candidate, shapes=starts, held=frozenset({held.name}))
    accepted: Any = [SimpleNamespace(candidate=candidate, proposal=one)]
    spreads = {u.name: u.spread for u in extended_unknowns(unknowns(), accepted).members}
    assert 0.0 < spreads[held.variable] < 1e-3 * starts[held.name]
    assert np.isinf(spreads[free.variable])


WINDAGE = {"motorEffect.windage.b_q": 2e-3}


def proposed(amplitude: float) -> Proposal:
    candidate = candidates("windage")[0]
    one = np.ones((1, 1))
    return Proposal(candidate, {}, one, 1.0, np.array([amplitude]), 1.0, one)


def test_a_candidate_is_scored_by_what_it_gains_on_both_parts():
    own, declared = bench(candidates("windage"), WINDAGE), unknowns()
    base = refine(own, declared, declared.start, iterations=10)
    assert base is not None
    held = own.residuals(declared, base.vector[None, :], "validate")[0]
    assert held is not None
    found = score(own, base, held, proposed(2e-3))
    assert found is not None
    assert found.fit.unknowns.names == (*declared.names, "motorEffect.windage.b_q")
    assert found.fit.vector[-1] == pytest.approx(2e-3, rel=0.02)
    assert found.fit_gain == pytest.approx(base.misfit - found.fit.misfit)
    assert found.held_out_gain == pytest.approx(held @ held - found.validate @ found.validate)
    assert found.consistency > 3.0
    trials = own.of("validate")
    left = structure(trials, found.validate) / structure(trials, held)
    assert found.share == pytest.approx(1.0 - left)
    assert found.share > 0.95
    assert found.candidate is found.proposal.candidate
    again = score(own, found.fit, found.validate, proposed(0.0))
    assert again is not None
    assert again.fit.unknowns.names == found.fit.unknowns.names, "what is in the model is not added again"


def test_it_starts_from_the_share_of_the_promise_that_serves_best(monkeypatch: pytest.MonkeyPatch):
    own, declared = bench(candidates("windage"), WINDAGE), unknowns()
    base = refine(own, declared, declared.start, iterations=10)
    assert base is not None
    held = own.residuals(declared, base.vector[None, :], "validate")[0]
    assert held is not None
    started = []

    def refined(bench: Any, unknowns: Any, vector: np.ndarray, **more: Any) -> None:
        started.append(float(vector[-1]))
        assert (more["fresh"], more["iterations"], more["enough"]) == ([4], 2, 3.0)

    monkeypatch.setattr(room, "refine", refined)
    base = replace(base, vector=np.array(list(DECLARED.values())))
    for promise, start in ((2e-3, 2e-3), (2e-3 / 0.3, 2e-3), (2e-2, 2e-3), (5e-4, 5e-4)):
        assert score(own, base, held, proposed(promise)) is None
        assert started.pop() == pytest.approx(start, rel=1e-6)


@pytest.mark.parametrize(("gained", "asked"), [(0.5, 1), (0.49, 3), (None, 3)])
def test_smaller_shares_are_tried_where_the_whole_promise_gains_less_than_half_of_itself(
    monkeypatch: pytest.MonkeyPatch, gained: float | None, asked: int
):
    current = fit(2.0, 9.0, 900.0)
    promised = replace(proposed(2e-3), gain=0.1 * current.misfit)
    left = None if gained is None else np.sqrt((current.misfit - gained * promised.gain) / SAMPLES)
    tried: list[np.ndarray] = []

    def simulated(unknowns: Unknowns, vectors: np.ndarray, part: str) -> Any:
        begun = not tried
        tried.extend(vectors)
        return [None if begun and left is None else np.full(SAMPLES, left or 3.0)] * len(vectors)

    monkeypatch.setattr(room, "refine", lambda *_given, **_more: None)
    bench: Any = SimpleNamespace(residuals=simulated)
    assert score(bench, current, HELD, promised) is None
    assert len(tried) == asked


def test_the_best_start_s_residuals_are_kept_and_only_the_new_column_is_taken(
    monkeypatch: pytest.MonkeyPatch,
):
    """The promise is added to what the effect's coefficient is, in full, in three tenths and in one."""
    candidate = candidates("windage")[0]
    (variable,) = (p.variable for p in candidate.coefficients)
    residuals = [np.full(SAMPLES, 3.0), np.full(SAMPLES, 2.0), None]
    tried: list[np.ndarray] = []

    def simulated(unknowns: Unknowns, vectors: np.ndarray, part: str) -> Any:
        first = len(tried)
        tried.extend(vectors)
        return residuals[first : len(tried)]

    bench: Any = SimpleNamespace(residuals=simulated)
    asked: dict[str, Any] = {}

    monkeypatch.setattr(room, "refine", lambda *given, **more: asked.update(given=given, more=more))
    current = fit(2.0, 9.0, 900.0)
    assert score(bench, current, HELD, proposed(2e-3), iterations=5) is None
    (coefficient,) = candidate.coefficients
    starts = [coefficient.neutral + share * 2e-3 for share in (1.0, 0.3, 0.1)]
    assert [v[2] for v in tried] == pytest.approx(starts)
    assert all(v[:2].tolist() == [2.0, 4.0] for v in tried)
    own, unknowns, vector = asked["given"]
    assert (own, unknowns.names, vector.tolist()) == (bench, ("p", "a", variable), tried[1].tolist())
    more = asked["more"]
    assert more["residual"] is residuals[1]
    np.testing.assert_array_equal(more["jacobian"], np.column_stack([current.jacobian, np.zeros(SAMPLES)]))
    assert more["steps"].tolist() == [0.1, 0.2, 1e-2]
    assert (more["fresh"], more["anew"], more["iterations"], more["enough"]) == ([2], True, 5, 3.0)
    with_it = replace(MEMBERS[1], name=variable, variable=variable)
    again = replace(current, unknowns=Unknowns((MEMBERS[0], with_it)))
    tried.clear()
    assert score(bench, again, HELD, proposed(2e-3)) is None
    assert [v[1] for v in tried] == pytest.approx([4.002, 4.0006, 4.0002]), "from where it is"


def test_what_cannot_be_simulated_has_no_score():
    own, declared = bench(candidates("windage"), WINDAGE), unknowns()
    base = refine(own, declared, declared.start, iterations=10)
    assert base is not None
    never: Any = SimpleNamespace(residuals=lambda unknowns, vectors, part: [None] * len(vectors))
    assert score(never, base, HELD, proposed(2e-3)) is None


def test_fixed_shapes_are_those_of_the_accepted_proposals():
    parameters = (
        SimpleNamespace(name="n", variable="x.n", fixed=True),
        SimpleNamespace(name="k", variable="x.k", fixed=False),
    )
    proposal = SimpleNamespace(shapes={"n": 7.0, "k": 1.0})
    made: Any = [SimpleNamespace(candidate=SimpleNamespace(parameters=parameters), proposal=proposal)]
    assert fixed_shapes(made) == {"x.n": 7.0}
    assert fixed_shapes([]) == {}


CHANNEL = SimpleNamespace(
    name="v", measured=np.zeros(4000), time=np.arange(4000) * 5e-3, noise=1.0, weight=1.0
)
TRIALS: Any = (
    SimpleNamespace(case=SimpleNamespace(channels=(CHANNEL,), measured=SimpleNamespace(units={"v": "m/s"}))),
)
SMOOTH, NOISE = 3.0 * np.sin(CHANNEL.time), np.random.default_rng(8).standard_normal(4000)


def scored_on(held: np.ndarray, validate: np.ndarray | None) -> Scored | None:
    """The score of a fit that leaves ``validate`` of what was ``held``."""
    bench: Any = SimpleNamespace(of=lambda part: TRIALS, residuals=lambda unknowns, vectors, part: [validate])
    nothing: Any = SimpleNamespace()
    return room.judge(bench, nothing, fit(2.0, 1.0, 100.0), fit(1.0, 4.0, 400.0), held)


def test_a_score_is_what_the_held_out_recordings_lose():
    found = scored_on(SMOOTH + NOISE, 0.5 * SMOOTH + NOISE)
    assert found is not None
    assert found.fit_gain == pytest.approx(300.0)
    before, after = np.sum((SMOOTH + NOISE) ** 2), np.sum((0.5 * SMOOTH + NOISE) ** 2)
    assert found.held_out_gain == pytest.approx(before - after, rel=1e-3)
    assert found.share == pytest.approx(0.75, abs=0.01)
    assert found.consistency > 5.0
    worse = scored_on(0.5 * SMOOTH + NOISE, SMOOTH + NOISE)
    assert worse is not None
    assert worse.held_out_gain < 0.0
    assert worse.share == pytest.approx(-3.0, abs=0.2)
    assert worse.consistency < -3.0, "what grows in every block is no gain"
    assert scored_on(SMOOTH + NOISE, None) is None


def test_of_small_structure_the_share_is_one_of_it_and_of_none_nothing():
    small = scored_on(0.1 * SMOOTH + NOISE, NOISE)
    assert small is not None
    assert small.share > 0.7
    none = scored_on(np.zeros(4000), np.zeros(4000))
    assert none is not None
    assert (none.share, none.held_out_gain) == (0.0, 0.0)


def test_fits_share_the_columns_of_the_declared_parameters():
    """A long recording's fits hold what is their own; a Jacobian beside it is put together when it is asked for."""
    rng = np.random.default_rng(1)
    columns = rng.normal(size=(SAMPLES, 1))
    whole = replace(
        fit(1.0, 1.0, 100.0), own=np.concatenate([columns, rng.normal(size=(SAMPLES, 1))], axis=1)
    )
    shared = whole.sharing(columns)
    assert shared.shared is columns
    assert shared.own.base is None
    assert shared.own.shape == (SAMPLES, 1)
    np.testing.assert_array_equal(shared.jacobian, whole.own)
    np.testing.assert_array_equal(shared.information, whole.information)
    np.testing.assert_allclose(shared.folded.information, whole.information)
    assert shared.folded.shared is None


@pytest.mark.parametrize(
    ("p", "misfit", "level", "tries"),
    [
        (3.4, 1.0, 1.0, 1),  # 4.8 spreads from the drawing
        (3.6, 1.0, 1.0, 2),  # 5.2: it may have crept there
        (-1.6, 1.0, 1.0, 2),
        (3.6, 0.3, 0.5, 2),  # less than twice the weighed noise, 0.25
        (3.6, 0.6, 0.5, 1),  # what is missing bends it
        (3.6, 0.5, 0.5, 1),
    ],
)
def test_a_fit_to_the_noise_far_off_the_drawing_is_tried_from_the_drawing_too(
    fits: Any, p: float, misfit: float, level: float, tries: int
):
    choice, own = scored(fit(2.0, 3.0, 300.0)), Levels(level)
    fits.queue = [fit(p, misfit, 130.0), fit(1.2, misfit, 110.0)]
    assert polish(own, choice, choice.fit, HELD).fit.vector[0] == (1.2 if tries == 2 else p)  # type: ignore[arg-type]
    assert len(fits.asked) == tries
    if tries == 2:
        np.testing.assert_array_equal(fits.asked[1][0][2], [1.0, 4.0])


class Levels:
    """Stands for a bench that says how its noise is weighed."""

    def __init__(self, level: float) -> None:
        self.of_fit = level

    def level(self, part: str) -> float:
        return {"fit": self.of_fit}[part]


@pytest.mark.parametrize(("misfit", "little"), [(1.99, True), (2.01, False)])
def test_little_is_less_than_twice_the_noise_as_it_is_weighed(misfit: float, little: bool):
    for level in (0.5, 1.0, 3.0):
        own: Any = Levels(level)
        assert room.leaves_little(own, fit(1.0, misfit * level**2, 1.0)) is little
