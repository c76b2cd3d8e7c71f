"""Stated errors against the scatter of fits to noise that is correlated in time, beneath white noise or alone."""

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from thsa_cosim.costs.channels import Channel
from thsa_cosim.diagnosis.fitting.fit import Fit
from thsa_cosim.diagnosis.fitting.trials import Trial
from thsa_cosim.diagnosis.fitting.uncertainty import standard_errors
from thsa_cosim.diagnosis.fitting.unknowns import Unknown, Unknowns
from thsa_cosim.identify.problem import Case
from thsa_cosim.signals import Signals

TIME = np.arange(20_000) * 1e-3
#: A slope that holds over seconds, one that changes within a correlation time, one that nothing depends on.
SLOPES = np.stack([np.sin(0.9 * TIME), np.sin(2.0 * np.pi * 30.0 * TIME), np.zeros_like(TIME)], axis=1)


def trial(time: np.ndarray = TIME, names: tuple[str, ...] = ("y",)) -> Trial:
    channels = tuple(Channel(n, time, np.zeros_like(time), 1.0) for n in names)
    empty = Signals(time, {})
    case = Case("a", Path("x.fmu"), empty, time, {}, channels, empty, 20.0, None)
    return Trial(case, "fit", "20 degC")  # type: ignore[arg-type]


def fitted(noise: np.ndarray, slopes: np.ndarray = SLOPES, spread: float = np.inf, scale: float = 2.0) -> Fit:
    """The least-squares fit of unknowns that are 0 to ``noise`` (N,); the last one has a drawing's ``spread``."""
    n = slopes.shape[1]
    spreads = [np.inf] * (n - 1) + [spread]
    members = tuple(Unknown(f"p{k}", f"p{k}", "1", 0.0, s, scale, -9.0, 9.0) for k, s in enumerate(spreads))
    jacobian = slopes * scale
    vector = -np.linalg.lstsq(jacobian, noise, rcond=None)[0]
    return Fit(Unknowns(members), vector * scale, noise + jacobian @ vector, jacobian, np.ones(n), 0.0, True)


def noise(seed: int, slow: float, tau: float = 0.2) -> np.ndarray:
    """White noise of variance 1 and a part of variance ``slow`` that is forgotten after ``tau`` seconds."""
    rng = np.random.default_rng(seed)
    rho = np.exp(-1e-3 / tau)
    part = lfilter([np.sqrt(1.0 - rho**2)], [1.0, -rho], rng.standard_normal(TIME.size + 2000))[2000:]
    return rng.standard_normal(TIME.size) + np.sqrt(slow) * part


@pytest.mark.parametrize("slow", [0.0, 0.02, 1.0])
def test_the_stated_error_is_the_scatter_of_the_fits(slow: float) -> None:
    """0.02: 1 % of the rms, which no correlation of neighbours shows, trebles the error of what is slow itself."""
    fits = [fitted(noise(seed, slow), SLOPES[:, :2]) for seed in range(60)]
    scatter = np.std([f.vector for f in fits], axis=0)
    stated = np.array([standard_errors(f, [trial()]) for f in fits])
    np.testing.assert_allclose(np.sqrt(np.mean(stated**2, axis=0)), scatter, rtol=0.25)
    z = np.array([f.vector for f in fits]) / stated
    assert np.mean(np.abs(z) < 1.96) > 0.88
    white = np.array([f.stderr(f.inflation) for f in fits]).mean(axis=0)
    assert (scatter[0] > 2.0 * white[0]) == (slow > 0.0), "a test that could not fail"


def test_what_only_the_drawing_knows_is_as_sure_as_the_drawing_and_what_nothing_knows_is_open() -> None:
    bent = 10.0 * noise(1, 1.0)
    errors = standard_errors(fitted(bent, spread=0.3), [trial()])
    assert errors[2] == pytest.approx(0.3)
    assert np.isinf(standard_errors(fitted(bent), [trial()])[2])
    assert np.isfinite(errors[:2]).all()


def test_noise_common_to_two_signals_counts_once() -> None:
    """The same noise in two signals makes a fit no surer than one of them; independent noise does."""
    one, other = noise(1, 0.0), noise(2, 0.0)
    both, slopes = trial(names=("y", "z")), np.concatenate([SLOPES[:, :2]] * 2)
    single = standard_errors(fitted(one, SLOPES[:, :2]), [trial()])
    same = standard_errors(fitted(np.concatenate([one, one]), slopes), [both])
    apart = standard_errors(fitted(np.concatenate([one, other]), slopes), [both])
    np.testing.assert_allclose(same, single, rtol=0.1)
    np.testing.assert_allclose(apart, single / np.sqrt(2.0), rtol=0.25)


def test_signals_and_recordings_of_their_own_rates() -> None:
    """Two recordings make an error smaller by the root of two, whatever the rate that they are sampled at."""
    slopes, values = SLOPES[:, :2], noise(3, 0.5)
    once = standard_errors(fitted(values, slopes), [trial()])
    twice = standard_errors(
        fitted(np.concatenate([values] * 2), np.concatenate([slopes] * 2)), [trial(), trial()]
    )
    np.testing.assert_allclose(twice, once / np.sqrt(2.0), rtol=1e-6)
    half = TIME[::2]
    mixed = Trial(
        Case("a", Path("x.fmu"), Signals(TIME, {}), TIME, {},
             (Channel("y", TIME, np.zeros_like(TIME), 1.0), Channel("z", half, np.zeros_like(half), 1.0)),
             Signals(TIME, {}), 20.0, None),
        "fit", "20 degC",
    )  # fmt: skip  # type: ignore[arg-type]
    found = standard_errors(
        fitted(np.concatenate([values, values[::2]]), np.concatenate([slopes, slopes[::2]])), [mixed]
    )
    assert np.all((0.5 * once < found) & (found < 1.1 * once))
