"""Samples that move a fitted value out of line with the rest: few that are far off, or a stretch of its own."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from thsa_cosim.inspection import Expected, Finding, Residual, influences, judge
from thsa_cosim.signals import FloatArray

TIME = np.arange(4000) * 1e-3
SPEED = 10.0 * np.sin(2.0 * np.pi * 1.3 * TIME) * (1.0 + 0.5 * np.sin(TIME))
NOISE = 0.2
Damage = Callable[[FloatArray, FloatArray], FloatArray]


def line(recording: str, seed: int, damage: Damage | None = None) -> tuple[str, FloatArray]:
    """A torque over speed, F_c sgn(v) + b v, as a sensor with noise gives it."""
    torque = 5.0 * np.sign(SPEED) + 2.0 * SPEED
    measured = torque + np.random.default_rng(seed).normal(0.0, NOISE, TIME.size)
    return recording, measured if damage is None else damage(TIME, measured)


def fitted(*runs: tuple[str, FloatArray]) -> tuple[list[Residual], list[Expected]]:
    columns = np.column_stack((np.sign(SPEED), SPEED))
    measured = np.concatenate([values for _, values in runs])
    design = np.tile(columns, (len(runs), 1))
    value, *_ = np.linalg.lstsq(design, measured, rcond=None)
    stderr = NOISE * np.sqrt(np.diag(np.linalg.inv(design.T @ design)))
    residuals = [
        Residual(
            name,
            "T",
            (columns @ value - own) / NOISE,
            NOISE,
            "N.m",
            {},
            TIME,
            columns @ value,
            columns / NOISE,
        )
        for name, own in runs
    ]
    known = [
        Expected(name, "", float(v), float(s), None, 1.0)
        for name, v, s in zip(("F_c", "b"), value, stderr, strict=True)
    ]
    return residuals, known


def only(findings: list[Finding]) -> Finding:
    assert len(findings) == 1, findings
    return findings[0]


@pytest.mark.parametrize("seed", range(20))
def test_white_noise_has_no_influence(seed: int) -> None:
    assert influences(*fitted(line("a", seed), line("b", seed + 100))) == []


def test_a_few_samples_far_off_are_named_with_what_they_move() -> None:
    def hit(time: FloatArray, x: FloatArray) -> FloatArray:
        return x + 9.0 * ((np.arange(time.size) % 50 == 0) & (SPEED > 8.0))

    found = only(influences(*fitted(line("a", 1, hit))))
    assert (found.channel, found.kind, found.severity) == ("T", "outlying-samples", "warning")
    damaged = TIME[(np.arange(TIME.size) % 50 == 0) & (SPEED > 8.0)]
    inside = [any(a <= t <= b for a, b in found.where) for t in damaged]
    assert np.mean(inside) > 0.9
    assert "b changes" in found.text or "F_c changes" in found.text


def test_spikes_that_move_nothing_are_not_worth_a_word() -> None:
    both_ways = np.where(np.arange(TIME.size) % 400 == 0, 1.2, 0.0) * np.where(TIME % 0.8 < 0.4, 1.0, -1.0)
    assert influences(*fitted(line("a", 2, lambda t, x: x + both_ways))) == []


def test_a_stretch_that_asks_for_another_value_is_named() -> None:
    found = only(influences(*fitted(line("a", 3, lambda t, x: np.where((t > 1.5) & (t < 2.0), 0.97 * x, x)))))
    assert (found.channel, found.kind) == ("time", "disagreement")
    (span,) = found.where
    assert span == pytest.approx((1.5, 2.0), abs=0.01)


def test_a_recording_that_asks_for_another_value_is_named() -> None:
    found = only(influences(*fitted(line("a", 4), line("odd", 5, lambda t, x: 1.02 * x), line("c", 6))))
    assert (found.recording, found.kind) == ("odd", "disagreement")


def test_a_sensor_that_is_not_linear_is_not_explained() -> None:
    bent = [line("a", 7, lambda t, x: x * (1.0 - 0.1 * (x / 35.0) ** 2))]
    clean = [line("a", 7)]
    assert judge(fitted(*clean)[0]).verdict == "explained"
    reasons = judge(fitted(*bent)[0]).reasons
    assert any("depends on its own size" in reason for reason in reasons), reasons


def test_values_that_are_not_determined_are_not_asked_for() -> None:
    residuals, known = fitted(line("a", 3, lambda t, x: np.where((t > 1.5) & (t < 2.0), 0.97 * x, x)))
    assert influences(residuals, [replace(p, stderr=None) for p in known]) == []
    (finding,) = influences(residuals, [replace(known[0], stderr=None), known[1]])
    assert "b changes" in finding.text


def test_a_misfit_in_one_part_of_a_recording_is_not_explained() -> None:
    rng = np.random.default_rng(3)
    values = rng.normal(0.0, 1.0, 4000)
    residual = Residual("run", "T", values, NOISE, "N.m", {}, TIME)
    assert judge([residual]).verdict == "explained"
    louder = np.where((TIME > 2.5) & (TIME < 3.0), 1.8, 1.0) * values
    (reason,) = judge([replace(residual, values=louder)]).reasons
    assert "from 2.5 s to" in reason
    assert reason.endswith("of run")
