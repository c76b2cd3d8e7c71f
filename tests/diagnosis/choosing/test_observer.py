"""The order of what a place lacks, from the force that keeps it in step."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from thsa_cosim.diagnosis.choosing import in_step
from thsa_cosim.diagnosis.choosing.observer import FEWEST, ORDERS, order_shares

TIME = np.arange(40_000) * 1e-3
#: Up to 40 rad/s and back, at several speeds, twenty seconds long, then four times as fast.
SPEED = np.where(TIME < 20.0, 1.0, 4.0) * (25.0 * np.sin(0.9 * TIME) + 15.0 * np.sin(2.3 * TIME))
ANGLE = np.concatenate([[0.0], np.cumsum(0.5 * (SPEED[1:] + SPEED[:-1]) * np.diff(TIME))])


def noise(size: float, seed: int = 1) -> np.ndarray:
    return size * np.random.default_rng(seed).standard_normal(TIME.size)


@pytest.mark.parametrize("order", [4, 12, 36])
def test_what_repeats_per_turn_is_found_beside_noise_and_a_slow_force(order: int):
    force = 0.3 * np.sin(order * ANGLE + 1.1) + noise(0.1) + 2.0 * np.sin(0.5 * TIME)
    shares = order_shares([TIME], [SPEED], [force])
    best = int(np.argmax(shares))
    assert ORDERS[best] == order
    assert shares[best] > 0.5
    assert np.delete(shares, best).max() < 0.25


def test_each_recording_has_a_phase_of_its_own():
    forces = [0.3 * np.sin(12 * ANGLE + phase) + noise(0.1) for phase in (0.0, np.pi)]
    apart = order_shares([TIME, TIME], [SPEED, SPEED], forces)
    alike = order_shares([TIME, TIME], [SPEED, SPEED], [forces[0], forces[0]])
    many = ORDERS <= 40  # of which there are many samples
    np.testing.assert_allclose(apart[many], alike[many], atol=0.02)
    assert int(ORDERS[np.argmax(apart)]) == 12


def test_nothing_that_repeats_makes_up_little_of_every_order():
    force = noise(0.1) + 0.3 * np.sign(SPEED) + 0.01 * SPEED
    assert order_shares([TIME], [SPEED], [force]).max() < 0.1


def test_an_error_of_the_speed_sensor_is_no_torque():
    """An eccentric resolver errs in proportion to the speed: a torque that makes a shaft stick acts at creep."""
    force = 0.03 * SPEED * np.sin(2 * ANGLE) + noise(0.1)
    assert order_shares([TIME], [SPEED], [force]).max() < 0.15
    torque = 0.3 * np.sin(2 * ANGLE) + noise(0.1)
    assert order_shares([TIME], [SPEED], [torque])[1] > 0.3


def test_a_wave_that_is_not_resolved_or_hardly_passed_says_nothing():
    fast = order_shares([TIME], [100.0 * SPEED], [noise(1.0)])
    assert fast[ORDERS > 20].max() == 0.0, "more than a quarter of a wave between two means"
    few = FEWEST - 1
    assert order_shares([TIME[:few]], [SPEED[:few]], [noise(1.0)[:few]]).max() == 0.0
    assert order_shares([TIME], [np.zeros(TIME.size)], [noise(1.0)]).max() == 0.0
    assert order_shares([], [], []).max() == 0.0


def test_a_looser_model_shows_more_of_a_ripple_and_less_of_the_noise_of_what_it_follows(
    monkeypatch: pytest.MonkeyPatch,
):
    """A shaft of inertia 1 with a ripple, and a model without, in step by a gain; that of ``InStep`` is looser."""
    step, order, off = float(TIME[1]), 24, noise(2e-3)

    def share(gain: float) -> tuple[float, float]:
        pull = gain * step
        error = lfilter([1.0], [1.0, pull - 1.0], pull * off - 0.3 * step * np.sin(order * ANGLE))
        shares = order_shares([TIME], [SPEED], [gain * (error - off)])
        return float(ORDERS[np.argmax(shares)]), float(shares.max())

    asked: list[float] = []

    class Follower:
        def at(self, gain: float) -> float:
            asked.append(gain)
            return gain

    monkeypatch.setattr(in_step, "order_in_step", lambda bench, _followed, gain, _fit: share(gain))
    found, loose = in_step.InStep._order(SimpleNamespace(following=Follower()), None, 600.0, None)  # type: ignore[arg-type]
    assert asked == [in_step.LOOSER * 600.0]
    assert found == order
    assert loose > 1.5 * share(600.0)[1]
