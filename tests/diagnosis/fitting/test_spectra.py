"""Magnitudes of spectra: what noise does to them, and that they tell how often and how much, not when."""

import numpy as np
import pytest

from diagnosis.analytic import DECLARED, TIME, bench, unknowns
from thsa_cosim.diagnosis.fitting.spectra import SECONDS, Spectra, spectra_of

STEP = 2e-3
LONG = np.arange(0.0, 8.0, STEP)


def test_white_noise_of_variance_one_has_parts_of_variance_one():
    noise = np.random.default_rng(5).standard_normal(400_000)
    inner = spectra_of(noise, 500)[:, 1:-1]  # the first and the last have no imaginary part
    assert np.mean(inner**2) == pytest.approx(2.0, rel=0.01)


def test_a_cycle_that_comes_later_is_the_same_and_one_that_comes_more_often_is_not():
    def cycle(frequency: float, phase: float) -> np.ndarray:
        return spectra_of(5.0 * np.sin(2.0 * np.pi * frequency * LONG + phase), 500)

    at = cycle(60.0, 0.0)
    energy = float(np.sum(at**2))
    assert float(np.sum((cycle(60.0, 2.0) - at) ** 2)) < 1e-6 * energy
    apart = [float(np.sum((cycle(60.0 + off, 2.0) - at) ** 2)) for off in (0.1, 0.2, 0.4, 0.8)]
    assert apart == sorted(apart)
    assert apart[0] > 1e-4 * energy
    assert apart[-1] > 0.1 * energy


def test_the_truth_leaves_what_noise_does_however_the_signals_are_weighed():
    own = bench((), {}, 3)
    at = np.array([list(DECLARED.values()), [1.3 * x for x in DECLARED.values()]])
    spectra = Spectra(own)
    for part in ("fit", "validate"):
        truth, off = spectra.residuals(unknowns(), at, part)
        assert truth is not None
        assert off is not None
        # The radial part of the noise; where the signal is smaller than it, what both parts leave.
        assert 0.9 < float(np.sqrt(np.mean(truth**2))) < 1.6
        assert float(np.mean(off**2)) > 20.0 * float(np.mean(truth**2))
    own.weights = {"i": 0.1, "u": 0.5}
    (weighed,) = spectra.residuals(unknowns(), at[:1], "validate")
    assert weighed == pytest.approx(truth)
    assert spectra.level("fit") == 1.0


def test_there_is_a_window_for_each_half_of_its_length_and_signal():
    own = bench((), {}, 3)
    compared = Spectra(own)
    (found,) = compared.residuals(unknowns(), unknowns().start[None, :], "fit")
    assert found is not None
    length = round(SECONDS / (TIME[1] - TIME[0]))
    windows = 1 + (TIME.size - length) // (length // 2)
    assert found.size == 2 * windows * (length // 2 + 1)
    assert compared.size("fit") == found.size


def test_a_signal_shorter_than_a_window_is_one_window():
    assert spectra_of(np.ones(7), 7).shape == (1, 4)


def test_a_run_that_fails_has_none(monkeypatch: pytest.MonkeyPatch):
    own = bench((), {}, 3)
    monkeypatch.setattr(own, "residuals", lambda *_given: [None, np.zeros(2 * TIME.size)])
    found = Spectra(own).residuals(unknowns(), np.zeros((2, 4)), "fit")
    assert found[0] is None
    assert found[1] == pytest.approx(0.0, abs=1e-9)
