"""Two frictions that act as one: what noise of the differences tells apart is not taken for information."""

from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.diagnosis.fitting.test_fit import TIME, Formula, bench, trial, unknown
from thsa_cosim.diagnosis.choosing.findings import values_of
from thsa_cosim.diagnosis.fitting import identified
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.fit import Fit, refine
from thsa_cosim.diagnosis.fitting.identified import identify_model
from thsa_cosim.diagnosis.fitting.noise import close, confirmed, without_noise
from thsa_cosim.diagnosis.fitting.unknowns import Unknowns
from thsa_cosim.scenario import SimulationTable

#: Friction of a motor, that of a gearbox, half of which acts at the motor, and a load that differs in form.
UNKNOWNS = Unknowns(
    (
        unknown("motor", 1.5, 0.1, scale=0.1),
        unknown("gearbox", 0.9, 0.9, scale=0.06),
        unknown("load", 0.4, scale=0.1),
    )
)
#: What a solver errs by, in the outputs' unit: a hundredth of the sensor's noise.
SOLVER = 1e-4


def friction(values: Mapping[str, float], *, apart: float = 0.0, solver: float = SOLVER) -> np.ndarray:
    """Both frictions and the load; the gearbox' differs by ``apart``, and the solver errs anew at every vector."""
    noise = np.random.default_rng(abs(hash(tuple(values.values())))).standard_normal(TIME.size)
    shape = np.exp(-0.7 * TIME)
    own = shape + apart * np.sin(9.0 * TIME)
    return values["motor"] * shape + 0.5 * values["gearbox"] * own + values["load"] + solver * noise


def fitted(apart: float, solver: float) -> tuple[Bench, Fit]:
    own = bench(lambda values: friction(values, apart=apart, solver=solver))
    fit = refine(own, UNKNOWNS, UNKNOWNS.start, steps=np.array([0.5, 0.2, 0.5]))
    assert fit is not None
    return own, fit


def test_what_only_noise_tells_apart_is_not_determined():
    own, fit = fitted(0.0, SOLVER)
    claimed = values_of(fit, declared=True)
    assert claimed["motor"].identifiable, "the noise of the differences passes for information"
    mended = without_noise(own, fit)
    values = values_of(mended, declared=True)
    assert not values["motor"].identifiable
    # Between the two the recordings know nothing: the ratio of the departures from the drawing is that of the spreads.
    motor, gearbox, _ = UNKNOWNS.prior(mended.vector)
    assert gearbox / motor == pytest.approx(0.5 * 0.9 / 0.1, rel=0.1)
    assert mended.cost < fit.cost + 1.0, "but for what the solver errs by"
    # The sum of both is known as before.
    both = np.array([0.1, 0.5 * 0.06, 0.0])  # per scale
    for one in (fit, mended):
        assert np.sqrt(both @ one.covariance() @ both) < 0.005
    assert mended.stderr()[2] == pytest.approx(fit.stderr()[2], rel=0.05)


def test_an_identification_ends_without_noise():
    trials = (trial("fit"), trial("validate"))
    found = identify_model(
        Path("x.fmu"),
        trials,
        UNKNOWNS,
        [UNKNOWNS.start],
        SimulationTable(),
        lambda simulation, experiments: nullcontext(Formula(friction)),  # type: ignore[arg-type, return-value]
    )
    assert not values_of(found.fit, declared=True)["motor"].identifiable


@pytest.mark.parametrize(("starts", "iterations"), [(1, [4]), (2, [12, 4])])
def test_from_where_a_search_ended_a_few_iterations_are_enough(
    monkeypatch: pytest.MonkeyPatch, starts: int, iterations: list[int]
):
    _own, near = fitted(0.03, 0.0)
    asked: list[int] = []

    def counted(*given: object, iterations: int, **more: object) -> Fit | None:
        asked.append(iterations)
        return None if len(asked) < starts else refine(*given, iterations=iterations, **more)  # type: ignore[arg-type]

    monkeypatch.setattr(identified, "refine", counted)
    identify_model(
        Path("x.fmu"),
        (trial("fit"), trial("validate")),
        UNKNOWNS,
        [UNKNOWNS.start, near.vector][-starts:],
        SimulationTable(),
        lambda simulation, experiments: nullcontext(Formula(friction)),  # type: ignore[arg-type, return-value]
        near,
    )
    assert asked == iterations


def test_what_tells_them_apart_beside_the_noise_stays():
    own, fit = fitted(0.03, 0.02 * SOLVER)
    assert values_of(fit, declared=True)["motor"].identifiable
    before = own.evaluations
    assert without_noise(own, fit) is fit
    assert own.evaluations > before, "the two are close"


def test_nothing_is_simulated_where_columns_differ_or_nothing_is_claimed():
    for own, fit in (fitted(0.8, SOLVER), fitted(0.0, 0.0)):
        before = own.evaluations
        assert without_noise(own, fit) is fit
        assert own.evaluations == before


def test_columns_to_which_nothing_responds_are_passed_over():
    _, fit = fitted(0.0, SOLVER)
    idle = replace(fit, own=fit.jacobian * [1.0, 1.0, 0.0])
    assert close(idle) == close(fit) == [0, 1]
    assert close(replace(fit, own=np.zeros_like(fit.own))) == []


def test_what_is_known_exactly_beside_them_hides_nothing():
    _, fit = fitted(0.0, SOLVER)
    members = (*UNKNOWNS.members[:2], replace(UNKNOWNS.members[2], spread=1e-12))
    assert close(replace(fit, unknowns=Unknowns(members))) == [0, 1]


def test_a_column_that_cannot_be_taken_again_says_nothing():
    own, fit = fitted(0.0, SOLVER)
    broken = Bench(Formula(friction, fails=lambda values: True), own.trials)  # type: ignore[arg-type]
    assert without_noise(broken, fit) is fit


def test_an_error_that_grows_with_the_step_is_noise_and_one_of_a_third_is_not():
    column, error = np.random.default_rng(3).standard_normal((2, 500))
    first = np.stack([column, 2.0 * (column + 0.01 * error)], axis=1)
    halved = np.stack([column, 2.0 * (column + 0.005 * error)], axis=1)
    found = confirmed(first, halved)
    assert found is not None
    assert np.linalg.svd(found, compute_uv=False)[1] < 1e-10
    assert confirmed(first, np.stack([column, 2.0 * (column + 0.0075 * error)], axis=1)) is None
