"""Unknowns, Gauss-Newton and scoring on problems in closed form, through a runner that simulates nothing."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import least_squares

from thsa_cosim.batch import Job, Outcome, Status
from thsa_cosim.batch.runner import OnOutcome
from thsa_cosim.costs.channels import Channel
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.fit import Fit, columns, refine
from thsa_cosim.diagnosis.fitting.trials import (
    LEAST_STEPS,
    SEARCHED,
    Trial,
    by_means,
    finer,
    for_search,
    note_on_means,
    note_on_tolerance,
)
from thsa_cosim.diagnosis.fitting.unknowns import Unknown, Unknowns
from thsa_cosim.diagnosis.fitting.weights import ChannelWeights
from thsa_cosim.signals import Signals
from thsa_cosim.study import Case

TIME = np.linspace(0.0, 4.0, 401)
NOISE = 0.01
Model = Callable[[Mapping[str, float]], np.ndarray]


def decay(values: Mapping[str, float]) -> np.ndarray:
    """An exponential decay with an amplitude, a rate and an offset."""
    return values["a"] * np.exp(-values["r"] * TIME) + values.get("o", 0.0)


TRUE = {"a": 2.0, "r": 0.7, "o": 0.3}
RNG = np.random.default_rng(11)
MEASURED = {part: decay(TRUE) + NOISE * RNG.standard_normal(TIME.size) for part in ("fit", "validate")}


@dataclass
class Formula:
    """Runs jobs by a formula; some fail."""

    model: Model
    fails: Callable[[Mapping[str, float]], bool] = lambda values: False
    jobs: list[Job] = field(default_factory=list)
    notes: tuple[str, ...] = ()

    def run(self, jobs: Sequence[Job], on_outcome: OnOutcome | None = None) -> list[Outcome]:
        self.jobs += jobs
        outcomes = []
        for job in jobs:
            part = job.experiment.split("/")[0]
            if self.fails(job.values):
                outcomes.append(Outcome(Status.CRASH, "out of range", None, None, 0.0, ""))
            else:
                residual = (self.model(job.values) - MEASURED[part]) / NOISE
                outcomes.append(Outcome(Status.OK, "", None, residual, 0.0, ""))
        for index, outcome in enumerate(outcomes):
            if on_outcome is not None:
                on_outcome(index, outcome)
        return outcomes

    def close(self) -> None:
        pass


def trial(part: str, group: str = "20 degC") -> Trial:
    channel = Channel("y", TIME, MEASURED[part], NOISE)
    empty = Signals(TIME, {})
    case = Case("a", Path("x.fmu"), empty, TIME, {}, (channel,), empty, 20.0, None)
    return Trial(case, part, group)  # type: ignore[arg-type]


def bench(model: Model = decay, **more: object) -> Bench:
    runner = Formula(model, **more)  # type: ignore[arg-type]
    return Bench(runner, [trial("fit"), trial("validate")])  # type: ignore[arg-type]


def unknown(name: str, start: float, spread: float = np.inf, **more: object) -> Unknown:
    given = {"scale": abs(start) or 1.0, "lower": -10.0, "upper": 10.0} | more
    return Unknown(name, name, "1", start, spread, **given)  # type: ignore[arg-type]


FREE = Unknowns((unknown("a", 1.0), unknown("r", 0.4), unknown("o", 0.0)))


def expected() -> tuple[np.ndarray, np.ndarray]:
    """Least squares by Newton's method on the analytic Jacobian: vector and standard errors."""
    x = np.array([TRUE[n] for n in FREE.names])
    for _ in range(20):
        e = np.exp(-x[1] * TIME)
        jacobian = np.stack([e, -x[0] * TIME * e, np.ones_like(e)], axis=1) / NOISE
        residual = (decay(dict(zip(FREE.names, x, strict=True))) - MEASURED["fit"]) / NOISE
        x = x - np.linalg.lstsq(jacobian, residual, rcond=None)[0]
    return x, np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))


def test_a_batch_returns_no_more_residuals_than_memory_should_hold(monkeypatch: pytest.MonkeyPatch):
    own = bench()
    vectors = np.array([FREE.start + 0.1 * k for k in range(5)])
    at_once = own.residuals(FREE, vectors, "fit")
    batches: list[int] = []
    run = Formula.run

    def counted(self: Formula, jobs: Sequence[Job], on_outcome: OnOutcome | None = None) -> list[Outcome]:
        batches.append(len(jobs))
        return run(self, jobs, on_outcome)

    monkeypatch.setattr(Formula, "run", counted)
    monkeypatch.setattr("thsa_cosim.diagnosis.fitting.bench.AT_ONCE", 2 * 8 * TIME.size + 7)
    np.testing.assert_array_equal(own.residuals(FREE, vectors, "fit"), at_once)  # type: ignore[arg-type]
    assert batches == [2, 2, 1]


def test_long_recordings_are_compared_by_means_which_the_diagnosis_says():
    short = by_means([trial("fit"), trial("validate")], TIME.size)
    assert note_on_means(short) == []
    assert all(t.case.channels[0].fine is None for t in short)
    long = by_means([trial("fit"), trial("validate")], TIME.size // 2)
    assert {c.mean_of for t in long for c in t.case.channels} == {2 + TIME.size % 2}
    (note,) = note_on_means(long)
    assert f"means of {2 + TIME.size % 2} neighbouring samples" in note


def test_a_finer_tolerance_than_the_declared_one_is_kept_and_said():
    given = [trial("fit"), trial("validate")]
    declared = [replace(t, case=replace(t.case, tolerance=1e-5)) for t in given]
    assert note_on_tolerance(declared, 1e-5) == note_on_tolerance(given, None) == []
    assert {t.case.tolerance for t in finer(declared, 1e-4)} == {1e-5}
    made = finer(declared, 1e-6)
    assert {t.case.tolerance for t in made} == {1e-6}
    (note,) = note_on_tolerance(made, 1e-5)
    assert "simulation.tolerance = 1e-05" in note
    assert "set it to 1e-06" in note


def test_it_finds_the_least_squares_and_its_standard_errors():
    fit = refine(bench(), FREE, FREE.start)
    assert fit is not None
    assert fit.converged
    vector, stderr = expected()
    np.testing.assert_allclose(fit.vector, vector, atol=0.05 * stderr.min())
    fresh, _ = columns(bench(), FREE, fit.vector, fit.residual, [0, 1, 2], np.full(3, 1e-4))
    information = fresh.T @ fresh
    found = np.sqrt(np.diag(np.linalg.inv(information))) * FREE.scale
    np.testing.assert_allclose(found, stderr, rtol=0.05)
    np.testing.assert_allclose(fit.stderr(), stderr, rtol=0.3)  # its steps are wide, for solvers with events
    np.testing.assert_allclose(fit.stderr(4.0), 2.0 * fit.stderr(1.0))


def test_what_the_drawing_says_counts_as_one_more_measurement():
    tight = Unknowns((unknown("a", 1.9, spread=1e-5), unknown("r", 0.4), unknown("o", 0.0)))
    fit = refine(bench(), tight, tight.start)
    assert fit is not None
    assert fit.vector[0] == pytest.approx(1.9, abs=1e-4)
    assert fit.cost == pytest.approx(fit.misfit + float(np.sum(tight.prior(fit.vector) ** 2)))
    # Between a drawing and a measurement of equal weight the middle is found.
    vector, stderr = expected()
    even = Unknowns((unknown("a", vector[0] + 0.01, spread=stderr[0]), *FREE.members[1:]))
    middle = refine(bench(), even, even.start)
    assert middle is not None
    assert middle.vector[0] == pytest.approx(vector[0] + 0.005, abs=0.0015)


def test_bounds_hold():
    bounded = Unknowns((unknown("a", 1.0, upper=1.5), *FREE.members[1:]))
    fit = refine(bench(), bounded, bounded.start, iterations=20)
    assert fit is not None
    assert fit.vector[0] == pytest.approx(1.5)


def test_runs_that_fail_are_stepped_around_and_counted():
    broken = bench(fails=lambda values: values["r"] > 0.75)
    fit = refine(broken, FREE, FREE.start, iterations=15)
    assert fit is not None
    assert fit.vector[1] == pytest.approx(expected()[0][1], rel=1e-3)
    assert refine(bench(fails=lambda values: True), FREE, FREE.start) is None
    never = bench(fails=lambda values: True)
    assert never.residuals(FREE, FREE.start[None, :], "fit") == [None]
    assert never.failures == {"out of range": 1}


def test_columns_that_are_kept_are_not_simulated_again():
    first = refine(bench(), FREE, FREE.start)
    assert first is not None
    again = bench()
    fit = refine(
        again,
        FREE,
        first.vector,
        residual=first.residual,
        jacobian=first.jacobian,
        steps=first.steps,
        fresh=[2],
    )
    assert fit is not None
    assert again.evaluations < 20
    np.testing.assert_allclose(fit.vector, first.vector, atol=1e-3)


def test_columns_anew_are_taken_before_the_first_step_and_the_given_ones_are_left_alone(
    monkeypatch: pytest.MonkeyPatch,
):
    first = refine(bench(), FREE, FREE.start)
    assert first is not None
    given = first.jacobian.copy()
    given[:, 2] = 0.0
    asked: list[list[int]] = []

    def counted(own: Bench, unknowns: Unknowns, vector: np.ndarray, *more: Any) -> Any:
        asked.append(more[1])
        return columns(own, unknowns, vector, *more)

    monkeypatch.setattr("thsa_cosim.diagnosis.fitting.fit.columns", counted)
    for anew in (True, False):
        fit = refine(
            bench(),
            FREE,
            first.vector,
            residual=first.residual,
            jacobian=given,
            steps=first.steps,
            fresh=[2],
            anew=anew,
            iterations=1,
        )
        assert fit is not None
        assert fit.jacobian[:, 2].any() == anew
    assert asked == [[2]]
    assert not given[:, 2].any()


def test_unknowns_of_a_temperature_reach_only_its_recordings():
    members = (
        unknown("R at 20", 1.2, group="20 degC", offset=-0.2),
        unknown("R at -30", 0.5, group="-30 degC"),
        unknown("L", 2e-3),
    )
    unknowns = Unknowns(members)
    assert unknowns.assignments(unknowns.start, "20 degC") == {"R at 20": pytest.approx(1.0), "L": 2e-3}
    assert unknowns.assignments(unknowns.start, "-30 degC") == {"R at -30": 0.5, "L": 2e-3}
    assert unknowns.index(["L", "R at 20"]) == [2, 0]
    assert unknowns.named(unknowns.start)["L"] == 2e-3
    np.testing.assert_array_equal(unknowns.clip(np.array([99.0, -99.0, 1.0])), [10.0, -10.0, 1.0])
    assert unknowns.precision.tolist() == [0.0, 0.0, 0.0]


def test_channel_is_weighed_by_what_the_model_leaves_in_it():
    lacking = Unknowns(FREE.members[:2])  # no offset
    own = bench()
    fit = refine(own, lacking, lacking.start)
    assert fit is not None
    rms = float(np.sqrt(np.mean(fit.residual**2)))
    assert rms > 2.0
    levels = ChannelWeights(own)
    weighed, held = levels.weigh(fit)
    assert own.weights["y"] == pytest.approx(1.0 / rms)
    assert np.sqrt(np.mean(weighed.residual**2)) == pytest.approx(1.0, rel=1e-3)
    assert held is not None
    plain = own.residuals(lacking, weighed.vector[None, :], "validate")[0] * rms
    np.testing.assert_allclose(levels.plain(held, "validate"), plain)
    assert levels.left(held) == pytest.approx(rms**2, rel=0.3)


def test_weights_return_to_one_with_the_right_model_and_rescale_what_they_are_compared_with():
    own = bench()
    wrong = refine(own, Unknowns(FREE.members[:2]), FREE.start[:2])
    assert wrong is not None
    levels = ChannelWeights(own)
    _, held = levels.weigh(wrong)
    assert held is not None
    levels.base_held = held
    plain = levels.plain(held, "validate")
    right = refine(own, FREE, FREE.start)
    assert right is not None
    fit, _ = levels.weigh(right)
    assert own.weights["y"] == pytest.approx(1.0, abs=0.1)
    np.testing.assert_allclose(levels.plain(levels.base_held, "validate"), plain)
    again, _ = levels.weigh(fit)
    assert again is fit, "nothing changed, so nothing is fitted"


def test_weights_stay_where_the_fit_under_new_ones_cannot_be_simulated(monkeypatch: pytest.MonkeyPatch):
    own = bench()
    fit = refine(own, Unknowns(FREE.members[:2]), FREE.start[:2])
    assert fit is not None
    levels = ChannelWeights(own)
    asked = own.residuals

    def failing(unknowns: Unknowns, vectors: np.ndarray, part: str) -> list[np.ndarray | None]:
        return [None] * len(vectors) if part == "validate" and own.weights else asked(unknowns, vectors, part)

    monkeypatch.setattr(own, "residuals", failing)
    same, held = levels.weigh(fit)
    assert same is fit
    assert held is not None
    assert own.weights == {}


def test_what_is_held_at_its_bound_does_not_keep_the_others_from_their_optimum():
    """An amplitude that may not fall as far as it wants: rate and offset make up for it, as a bounded solver says."""
    bounded = Unknowns((unknown("a", 2.5, lower=2.3), unknown("r", 0.4), unknown("o", 0.0)))
    fit = refine(bench(), bounded, bounded.start, iterations=20)
    assert fit is not None

    def residual(x: np.ndarray) -> np.ndarray:
        return (decay({"a": x[0], "r": x[1], "o": x[2]}) - MEASURED["fit"]) / NOISE

    best = least_squares(residual, bounded.start, bounds=([2.3, -10.0, -10.0], 10.0))
    assert fit.vector[0] == 2.3
    assert fit.misfit == pytest.approx(2.0 * best.cost, rel=1e-3)


def test_the_drawing_is_not_widened_by_what_the_recordings_leave_unexplained():
    """Two unknowns that only act together, one known from the drawing: the other is as sure as that."""
    jacobian = np.ones((100, 2)) * 1e3
    members = (unknown("J", 1.0, spread=0.01, scale=1.0), unknown("a", 0.0, scale=1.0))
    fit = Fit(Unknowns(members), np.ones(2), np.full(100, 30.0), jacobian, np.ones(2), 0.0, True)
    assert fit.inflation == 900.0
    np.testing.assert_allclose(fit.stderr(fit.inflation), 0.01, rtol=0.1)
    free = Unknowns((unknown("J", 1.0), unknown("a", 0.0), unknown("b", 0.0)))
    none = Fit(free, np.ones(3), np.ones(100), np.ones((100, 3)) * [1e3, 1e3, 0.0], np.ones(3), 0.0, True)
    assert np.isinf(none.stderr()).all(), "two act only together, the third not at all"
    assert none.inflation == 1.0


def test_a_folded_fit_keeps_its_covariance_and_no_row_a_sample():
    jacobian = np.random.default_rng(3).standard_normal((5000, 3)) * [1.0, 1e3, 1e-3]
    members = tuple(Unknown(n, n, "1", 1.0, np.inf, 1.0, 0.0, 9.0) for n in "abc")
    fit = Fit(Unknowns(members), np.ones(3), np.ones(5000), jacobian, np.ones(3), 1.0, True)
    assert fit.folded.jacobian.shape == (3, 3)
    assert fit.folded.covariance(2.0) == pytest.approx(fit.covariance(2.0), rel=1e-10)
    assert fit.folded.stderr() == pytest.approx(fit.stderr(), rel=1e-10)


def test_a_step_that_falls_short_is_taken_further(monkeypatch: pytest.MonkeyPatch):
    """A wave whose phase is 2.5 rad off: half a turn away its slope promises a fraction of what a longer step gains."""

    def wave(values: Mapping[str, float]) -> np.ndarray:
        return np.sin(3.0 * TIME + values["p"])

    start = Unknowns((unknown("p", 2.5, scale=1.0),))
    monkeypatch.setitem(MEASURED, "fit", np.sin(3.0 * TIME))
    fit = refine(bench(wave), start, start.start, iterations=1)
    assert fit is not None
    assert abs(fit.vector[0]) < 0.5
    monkeypatch.setattr("thsa_cosim.diagnosis.fitting.fit.FURTHER", ())
    short = refine(bench(wave), start, start.start, iterations=1)
    assert short is not None
    assert 1.5 < short.vector[0] < 2.5


def test_a_step_that_gains_what_it_promised_is_the_only_one_that_is_tried(monkeypatch: pytest.MonkeyPatch):
    """Two more, damped more, run only where the first one disappoints."""
    asked: list[int] = []
    residuals = Bench.residuals

    def counted(self: Bench, unknowns: Unknowns, vectors: np.ndarray, part: str) -> list[np.ndarray | None]:
        asked.append(len(vectors))
        return residuals(self, unknowns, vectors, part)

    monkeypatch.setattr(Bench, "residuals", counted)

    def parabola(values: Mapping[str, float]) -> np.ndarray:
        return values["a"] + values["o"] * TIME + values["r"] * TIME**2

    refine(bench(parabola), FREE, FREE.start)
    assert (1, 2) not in pairwise(asked), "linear: the step is right"
    del asked[:]

    def cliff(values: Mapping[str, float]) -> np.ndarray:
        return decay(values) + 100.0 * (values["a"] > 1.2)

    refine(bench(cliff), FREE, FREE.start, iterations=1)
    assert (1, 2) in pairwise(asked), "the whole step falls off the cliff"


def test_a_jacobian_is_kept_while_its_steps_bring_what_they_promise(monkeypatch: pytest.MonkeyPatch):
    """Near an optimum all Jacobians are alike; the last one is taken at the optimum all the same."""
    line = lambda values: values["a"] * TIME + values["r"] * TIME**2 + values["o"] + 0.1 * values["r"] ** 2  # noqa: E731
    kept, renewed = bench(line), bench(line)
    one = refine(kept, FREE, FREE.start, enough=1e-6)
    monkeypatch.setattr("thsa_cosim.diagnosis.fitting.fit.SERVED", np.inf)
    other = refine(renewed, FREE, FREE.start, enough=1e-6)
    assert one is not None
    assert other is not None
    assert one.converged
    np.testing.assert_allclose(one.vector, other.vector, atol=0.1 * other.stderr().min())
    assert kept.evaluations < renewed.evaluations
    at_end, _ = columns(bench(line), FREE, one.vector, one.residual, [0, 1, 2], one.steps)
    np.testing.assert_allclose(one.jacobian, at_end, rtol=1e-3, atol=1e-3 * np.abs(at_end).max())


def test_a_jacobian_of_another_vector_leads_the_way_but_no_fit_ends_by_it():
    wrong = np.zeros((TIME.size, 3))
    wrong[:, 0] = 1e-9
    given_up = refine(bench(), FREE, FREE.start, jacobian=wrong)
    assert given_up is not None
    np.testing.assert_array_equal(given_up.vector, FREE.start)
    fit = refine(bench(), FREE, FREE.start, jacobian=wrong, near=True)
    assert fit is not None
    assert fit.converged
    np.testing.assert_allclose(fit.vector, expected()[0], rtol=1e-2)
    good, plain = bench(), bench()
    again = refine(good, FREE, 1.05 * fit.vector, jacobian=fit.jacobian, steps=fit.steps, near=True)
    refine(plain, FREE, 1.05 * fit.vector, steps=fit.steps)
    assert again is not None
    np.testing.assert_allclose(again.vector, fit.vector, atol=0.1 * expected()[1].min())
    assert good.evaluations < plain.evaluations


def test_a_jacobian_serves_unknowns_of_other_scales_in_another_order():
    fit = refine(bench(), FREE, FREE.start)
    assert fit is not None
    other = Unknowns((unknown("o", 0.0, scale=3.0), unknown("a", 1.0, scale=0.5)))
    factors = np.linspace(1.0, 2.0, TIME.size)
    found = fit.jacobian_of(other, factors)
    np.testing.assert_allclose(found[:, 0], 3.0 * factors * fit.jacobian[:, 2])
    np.testing.assert_allclose(found[:, 1], 0.5 * factors * fit.jacobian[:, 0])
    np.testing.assert_allclose(fit.steps_of(other) * other.scale, fit.steps[[2, 0]] * FREE.scale[[2, 0]])


def test_the_runs_of_a_search_are_no_more_accurate_than_a_search_needs():
    own = (trial("fit"), trial("validate"))
    asked = tuple(
        replace(t, case=replace(t.case, tolerance=x)) for t, x in zip(own, (1e-6, 1e-3), strict=True)
    )
    found = for_search(asked, Path("all.fmu"))
    assert [t.case.tolerance for t in found] == [SEARCHED, 1e-3]
    assert {t.experiment.fmu for t in found} == {Path("all.fmu")}
    assert [t.experiment.tolerance for t in for_search(own, Path("y.fmu"))] == [SEARCHED, SEARCHED]
    assert [t.experiment.most_steps for t in found] == [LEAST_STEPS, LEAST_STEPS]
    assert [t.experiment.most_steps for t in own] == [None, None]


def test_only_coarser_runs_become_finer():
    own = tuple(
        replace(t, case=replace(t.case, tolerance=x))
        for t, x in zip(3 * (trial("fit"),), (1e-4, 1e-7, None), strict=True)
    )
    found = finer(own, 1e-6)
    assert [t.experiment.tolerance for t in found] == [1e-6, 1e-7, None]
    assert found[1:] == own[1:]


def test_a_fit_that_what_is_reached_elsewhere_is_too_far_from_is_given_up():
    far = np.array([9.0, 5.0, -9.0])
    whole = refine(bench(), FREE, far, iterations=30)
    assert whole is not None
    assert whole.converged
    np.testing.assert_allclose(whole.vector, expected()[0], rtol=1e-2)
    jump = lambda values: decay(values) + np.sin(150.0 * values["r"]) + 5.0  # noqa: E731  a rough landscape
    crawling = bench(jump)
    refine(crawling, FREE, far, iterations=12, enough=1e-3)
    given_up = bench(jump)
    fit = refine(given_up, FREE, far, iterations=12, enough=1e-3, to_beat=whole.cost)
    assert fit is not None
    assert not fit.converged
    assert given_up.evaluations < crawling.evaluations
    same = refine(bench(), FREE, far, iterations=30, to_beat=whole.cost)
    assert same is not None
    np.testing.assert_array_equal(same.vector, whole.vector, err_msg="one that gets there is not given up")


def test_the_drawing_is_that_of_the_declared_parameters_alone():
    mixed = Unknowns((unknown("a", 1.0, declared=True), unknown("e", 4.0, declared=False)))
    np.testing.assert_array_equal(mixed.at_drawing(np.array([2.0, 3.0])), [1.0, 3.0])


def test_a_fit_that_leaves_much_is_not_followed_to_the_last_mean_square_of_noise():
    """What 1 is beside a misfit of the noise's size, the mean square left is beside a larger one."""

    def bent(values: Mapping[str, float]) -> np.ndarray:
        return decay(values) + 0.5 * np.sin(30.0 * TIME) * values["r"] ** 2

    loose, tight = bench(bent), bench(bent)
    first, last = refine(loose, FREE, FREE.start), refine(tight, FREE, FREE.start, enough=1e-6)
    assert first is not None
    assert last is not None
    assert first.inflation > 50.0
    assert first.converged
    assert loose.evaluations < tight.evaluations
    assert abs(first.cost - last.cost) < first.inflation
