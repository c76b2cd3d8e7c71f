"""A fit between all samples and the means of neighbours that a search compares."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from diagnosis.analytic import TIME, bench, candidates, unknowns
from thsa_cosim.diagnosis.fitting import trials as room
from thsa_cosim.diagnosis.fitting.fit import Fit, cost_of
from thsa_cosim.diagnosis.fitting.means import by_samples, by_search
from thsa_cosim.diagnosis.fitting.trials import Trial, by_means, for_search

TRIALS = bench(candidates("windage"), {}).trials
#: Three samples in a mean; of 1601 samples two are left over.
MEANS = by_means(TRIALS, 2 * TIME.size // 3 + 1)


def fit() -> Fit:
    random, names = np.random.default_rng(5), unknowns()
    residual = random.normal(size=2 * TIME.size)
    rows = random.normal(size=(residual.size, len(names.members)))
    steps = np.full(len(names.members), 1e-2)
    return Fit(names, names.start, residual, rows, steps, cost_of(names, names.start, residual), True)


def rows_of(trials: tuple[Trial, ...]) -> int:
    return sum(c.measured.size for t in trials if t.part == "fit" for c in t.case.channels)


def test_residuals_of_means_are_those_of_the_channels_by_means():
    (whole, *_), (pooled, *_) = TRIALS, MEANS
    assert {c.mean_of for c in pooled.case.channels} == {3}
    simulated = replace(
        bench(candidates("windage"), {}).trials[0].case.measured,
        time=TIME,
        values={c.name: c.measured + np.sin(TIME) for c in whole.case.channels},
    )
    own = np.concatenate([c.residual(simulated) for c in whole.case.channels])
    found = by_search(replace(fit(), residual=own), TRIALS, MEANS)
    wanted = np.concatenate([c.residual(simulated) for c in pooled.case.channels])
    np.testing.assert_allclose(found.residual, wanted, atol=1e-9)
    assert found.jacobian.shape == (rows_of(MEANS), 4)
    assert found.cost == pytest.approx(cost_of(found.unknowns, found.vector, found.residual))


def test_a_fit_of_means_is_spread_over_the_samples_and_back():
    pooled = by_search(fit(), TRIALS, MEANS)
    spread = by_samples(pooled, TRIALS, MEANS)
    assert spread.residual.size == rows_of(TRIALS)
    again = by_search(spread, TRIALS, MEANS)
    np.testing.assert_allclose(again.residual, pooled.residual)
    np.testing.assert_allclose(again.jacobian, pooled.jacobian)
    # The samples that no mean has, two a recording, are given the last one's row.
    lost = np.abs(spread.information - pooled.information)
    assert lost.max() < 0.01 * np.diag(pooled.information).min()


def test_without_means_a_fit_is_itself():
    one = fit()
    assert by_search(one, TRIALS, TRIALS) is one
    assert by_samples(one, TRIALS, TRIALS) is one


def test_a_search_compares_fewer_residuals_of_long_recordings(monkeypatch: pytest.MonkeyPatch):
    assert rows_of(for_search(TRIALS, Path("x.fmu"))) == rows_of(TRIALS)
    monkeypatch.setattr(room, "SEARCHED_ROWS", TIME.size)
    assert rows_of(for_search(TRIALS, Path("x.fmu"))) == 2 * (TIME.size // 2)
    assert rows_of(for_search(by_means(TRIALS, TIME.size), Path("x.fmu"))) == 2 * (TIME.size // 2)
