"""Events that a model makes at the wrong time: the free run is lost, the way over smoothed residuals is not."""

from collections.abc import Mapping

import numpy as np
import pytest

from diagnosis.fitting.test_fit import NOISE, TIME, Formula, trial, unknown
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.continuation import refine_from_coarse
from thsa_cosim.diagnosis.fitting.fit import refine
from thsa_cosim.diagnosis.fitting.unknowns import Unknowns


def slips(values: Mapping[str, float]) -> np.ndarray:
    """A short slip after every rest of ``r`` seconds, ``a`` high: eight in four seconds."""
    centres = values["r"] * np.arange(1.0, 9.0)
    return values["a"] * np.exp(-0.5 * ((TIME[:, None] - centres) / 0.015) ** 2).sum(axis=1)


TRUE = {"a": 1.0, "r": 0.45}
START = Unknowns((unknown("a", 0.8), unknown("r", 0.47, scale=0.02)))


@pytest.fixture
def machine(monkeypatch: pytest.MonkeyPatch) -> Bench:
    rng = np.random.default_rng(5)
    measured = {part: slips(TRUE) + NOISE * rng.standard_normal(TIME.size) for part in ("fit", "validate")}
    monkeypatch.setattr("diagnosis.fitting.test_fit.MEASURED", measured)
    return Bench(Formula(slips), [trial("fit")])  # type: ignore[arg-type]


def test_the_way_over_smoothed_residuals_keeps_step_where_the_free_run_is_lost(machine: Bench) -> None:
    """0.16 s late at the eighth slip, ten times a slip's own width."""
    lost = refine(machine, START, START.start, iterations=40)
    assert lost is not None
    assert abs(lost.vector[1] - TRUE["r"]) > 0.01
    found = refine_from_coarse(machine, START, START.start)
    assert found is not None
    np.testing.assert_allclose(found.vector, list(TRUE.values()), rtol=1e-3)
    assert found.misfit < 1.2 * found.residual.size
    assert found.residual.size == TIME.size


def test_smoothing_keeps_the_size_of_white_noise_and_ends_with_its_block(machine: Bench) -> None:
    exact = np.array([list(TRUE.values())])
    (plain,) = machine.residuals(START, exact, "fit")
    with machine.smoothed(0.1):
        (smooth,) = machine.residuals(START, exact, "fit")
    (again,) = machine.residuals(START, exact, "fit")
    assert plain is not None
    assert smooth is not None
    np.testing.assert_array_equal(plain, again)
    assert np.std(smooth) == pytest.approx(1.0, abs=0.35)
    assert np.corrcoef(smooth[1:], smooth[:-1])[0, 1] > 0.98


def test_no_smoothing_reaches_over_from_one_recording_into_the_next(machine: Bench) -> None:
    both = Bench(Formula(slips), [trial("fit"), trial("fit")])  # type: ignore[arg-type]
    with both.smoothed(0.3):
        (found,) = both.residuals(START, START.start[None, :], "fit")
    with machine.smoothed(0.3):
        (single,) = machine.residuals(START, START.start[None, :], "fit")
    assert found is not None
    np.testing.assert_allclose(found, np.concatenate([single, single]))


def test_a_start_that_cannot_be_simulated_has_no_fit(machine: Bench) -> None:
    broken = Bench(Formula(slips, fails=lambda values: True), [trial("fit")])  # type: ignore[arg-type]
    assert refine_from_coarse(broken, START, START.start) is None
