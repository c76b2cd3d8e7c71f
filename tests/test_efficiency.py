"""Efficiency against powers added up by hand, and where it does not exist."""

import numpy as np
import pytest

from thsa_cosim.efficiency import motor_efficiency

MOTOR = {"resistance": 0.5, "torque_constant": 0.46, "coulomb": 0.056, "viscous": 4e-5}


def test_shaft_power_over_what_goes_in() -> None:
    """4 N.m at 170 rad/s: shaft, friction and copper add up to the electrical power."""
    current = (4.0 + 0.056 + 4e-5 * 170.0) / 0.46
    electrical = (0.5 * current + 0.46 * 170.0) * current
    assert float(motor_efficiency(4.0, 170.0, **MOTOR)) == pytest.approx(4.0 * 170.0 / electrical)
    losses = 0.5 * current**2 + 0.056 * 170.0 + 4e-5 * 170.0**2
    assert electrical == pytest.approx(4.0 * 170.0 + losses)


def test_both_directions_are_alike_and_braking_has_none() -> None:
    both = motor_efficiency([4.0, -4.0], [170.0, -170.0], **MOTOR)
    assert both[0] == both[1]
    assert np.isnan(motor_efficiency([[4.0], [0.0]], [-170.0, 0.0], **MOTOR)).all()


def test_without_losses_it_is_one() -> None:
    ideal = motor_efficiency(4.0, 170.0, resistance=0.0, torque_constant=0.46, coulomb=0.0, viscous=0.0)
    assert float(ideal) == pytest.approx(1.0)
