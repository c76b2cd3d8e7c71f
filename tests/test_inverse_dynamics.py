"""Inverse dynamics on motions whose forces are known."""

import numpy as np
import pytest
from reference.idim_ls import asymmetric_law, decimate, fit_force, symmetric_law

from thsa_cosim.inverse_dynamics import differentiate, force_residual, low_pass, motion, repeatability
from thsa_cosim.signals import Signals

STEP = 1e-3
TIME = np.arange(0.0, 8.0, STEP)
INNER = slice(100, -100)
MASS, VISCOUS, COULOMB, OFFSET = 95.0, 200.0, 20.0, -3.0


WAVES = ((0.05, 2 * np.pi / 4.0), (0.002, 2 * np.pi * 1.5))
"""Amplitude [m] and angular frequency [1/s]: a speed that keeps away from zero but for its reversals."""


def there_and_back(time: np.ndarray) -> np.ndarray:
    return np.sum([a * np.sin(w * time) for a, w in WAVES], axis=0)


def needed_force(viscous_back: float = VISCOUS) -> np.ndarray:
    velocity = np.sum([a * w * np.cos(w * TIME) for a, w in WAVES], axis=0)
    acceleration = np.sum([-a * w**2 * np.sin(w * TIME) for a, w in WAVES], axis=0)
    viscous = np.where(velocity > 0, VISCOUS, viscous_back)
    return MASS * acceleration + viscous * velocity + COULOMB * np.sign(velocity) + OFFSET


def test_low_pass_has_no_phase_and_differences_are_second_order():
    slow = np.sin(2 * np.pi * 2.0 * TIME)
    assert np.abs(low_pass(slow, 20.0, STEP) - slow)[INNER].max() < 1e-3
    hum = np.sin(2 * np.pi * 100.0 * TIME)
    assert np.abs(low_pass(hum, 20.0, STEP))[INNER].max() < 2e-3
    slope = 2 * np.pi * 2.0 * np.cos(2 * np.pi * 2.0 * TIME)
    assert np.abs(differentiate(slow, STEP) - slope)[INNER].max() < (2 * np.pi * 2.0) ** 3 * STEP**2 / 5.9


def test_decimation_keeps_the_last_sample_and_what_is_slow():
    slow = np.sin(2 * np.pi * 2.0 * TIME[:-3])
    kept = decimate(slow, 10)
    assert kept.size == -(-slow.size // 10)
    assert np.abs(kept - slow[(slow.size - 1) % 10 :: 10])[50:-50].max() < 0.01  # the filter's 0.05 dB, twice
    assert np.abs(decimate(np.sin(2 * np.pi * 120.0 * TIME), 10))[50:-50].max() < 1e-3
    assert decimate(slow, 1) is slow


def test_the_parameters_of_a_symmetric_law_come_back():
    law = symmetric_law(motion(there_and_back(TIME), STEP, 100.0))
    fit = fit_force(needed_force(), law, samples=INNER, factor=10)
    wanted = {"M": MASS, "F_v": VISCOUS, "F_c": COULOMB, "F_0": OFFSET}
    assert dict(fit.coefficients) == pytest.approx(wanted, rel=1e-3)
    assert fit.relative_error < 1e-3


def test_noise_moves_the_parameters_by_their_standard_errors():
    rng = np.random.default_rng(3)
    law = symmetric_law(motion(there_and_back(TIME), STEP, 100.0))
    clean = needed_force()
    fits = [fit_force(clean + rng.normal(0.0, 2.0, TIME.size), law, samples=INNER) for _ in range(60)]
    for name, wanted in {"M": MASS, "F_v": VISCOUS, "F_c": COULOMB, "F_0": OFFSET}.items():
        found = np.array([f.coefficients[name] for f in fits])
        stated = fits[0].stderr[name]
        assert abs(found.mean() - wanted) < 4 * stated / np.sqrt(len(fits))
        assert 0.7 < found.std() / stated < 1.4


def test_only_the_asymmetric_law_explains_friction_with_a_direction():
    force, body = needed_force(viscous_back=260.0), motion(there_and_back(TIME), STEP, 100.0)
    one, two = (fit_force(force, law(body), samples=INNER) for law in (symmetric_law, asymmetric_law))
    wanted = {"M": MASS, "F_v+": 200.0, "F_v-": 260.0, "F_c+": COULOMB + OFFSET, "F_c-": COULOMB - OFFSET}
    assert dict(two.coefficients) == pytest.approx(wanted, rel=2e-3)
    assert one.relative_error > 0.01 > 10 * two.relative_error
    assert np.sqrt(np.mean((two.force(asymmetric_law(body)) - force)[INNER] ** 2)) < 0.1  # N


def test_regressors_that_cannot_be_told_apart_are_refused():
    body = motion(there_and_back(TIME), STEP, 100.0)
    both = {**symmetric_law(body), "bias": np.ones_like(TIME)}
    with pytest.raises(ValueError, match="do not tell M, F_v, F_c, F_0, bias apart"):
        fit_force(TIME, both)
    with pytest.raises(ValueError, match="4 samples are too few for 4 regressors"):
        fit_force(TIME[:4], {name: column[:4] for name, column in symmetric_law(body).items()})


def closed_loop(ripple: float) -> Signals:
    """A mass under a stiff position loop; ``ripple`` [N] is a force over position that only the real one has."""
    step = 1e-4
    time = np.arange(0.0, 8.0, step)
    reference = there_and_back(time)
    x, v, rows = reference[0], 0.11, []
    for target in reference:
        force = 1.4e6 * (target - x) - 8.6e3 * v
        rows.append((x, force))
        v += step * (force - ripple * np.sin(2 * np.pi * x / 0.02) - VISCOUS * v) / MASS
        x += step * v
    columns = np.array(rows)[::10]
    return Signals(time[::10], {"q": columns[:, 0], "F": columns[:, 1]}, {"q": "m", "F": "N"})


def test_the_force_residual_is_the_force_that_the_model_lacks():
    real, model = closed_loop(ripple=2.0), closed_loop(ripple=0.0)
    found = force_residual(real, model, position="q", force="F", mass=MASS, band=20.0)
    lacking = 2.0 * np.sin(2 * np.pi * real.resample(found.time)["q"] / 0.02)
    assert np.sqrt(np.mean((found["F"] - lacking) ** 2)) < 0.05
    # The loop itself shows less clearly what is lacking: at 5 Hz it answers with more than the force.
    assert np.sqrt(np.mean((real["F"] - model["F"]) ** 2)) > 1.02 * np.sqrt(np.mean(lacking**2))
    assert (found.time[0], found.units["F"]) == (pytest.approx(0.1), "N")


def test_a_band_that_the_record_cannot_show_is_refused():
    short = Signals(TIME[:200], {"q": TIME[:200], "F": TIME[:200]})
    with pytest.raises(ValueError, match=r"0\.199 s every 0\.001 s shows no residual below 20 Hz"):
        force_residual(short, short, position="q", force="F", mass=1.0, band=20.0)


def test_repeatability_is_what_laps_differ_by():
    rng = np.random.default_rng(1)
    lap = np.sin(np.linspace(0.0, 2 * np.pi, 1000, endpoint=False))
    laps = np.tile(lap, 5)[:4600] + rng.normal(0.0, 0.3, 4600)
    assert repeatability(laps, 1000) == pytest.approx(0.3, rel=0.05)
    assert np.isnan(repeatability(laps[:1999], 1000))
