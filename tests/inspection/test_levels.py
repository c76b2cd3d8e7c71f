"""Values that never occur: a stuck bit and a dead band are named, what only moves in steps or rests is not."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from thsa_cosim.inspection.channel import Channel
from thsa_cosim.inspection.levels import dead_band, stuck_bit
from thsa_cosim.signals import FloatArray

RECORDINGS = Path(__file__).parents[2] / "scenarios" / "recordings"


def signal(recording: str, column: str) -> tuple[FloatArray, FloatArray]:
    table = pd.read_parquet(RECORDINGS / f"{recording}.parquet").astype(float)
    return table["time_s"].to_numpy(), table[column].to_numpy()


def kinds(time: FloatArray, values: FloatArray) -> list[str]:
    channel = Channel("run", "x", "1", "output", time, values)
    return [f.kind for f in (*stuck_bit(channel), *dead_band(channel))]


SIGNALS = (
    ("motor_m30", "q_current_A"),
    ("driven_m30_b", "velocity_mm_s"),
    ("driven_m30_b", "q_voltage_V"),
    ("driven_m30_b", "motor_speed_rad_s"),
)


@pytest.mark.parametrize(("recording", "column"), SIGNALS)
@pytest.mark.parametrize("bit", [5, 7])
@pytest.mark.parametrize("stuck_at", [0, 1])
def test_a_bit_that_is_stuck_is_named(recording: str, column: str, bit: int, stuck_at: int) -> None:
    time, x = signal(recording, column)
    step = np.ptp(x) / 4096
    codes = np.round(x / step).astype(int)
    codes = codes | (1 << bit) if stuck_at else codes & ~(1 << bit)
    assert kinds(time, codes * step) == ["stuck-bit"]


@pytest.mark.parametrize(("recording", "column"), SIGNALS[1:])
def test_a_dead_band_is_named(recording: str, column: str) -> None:
    time, x = signal(recording, column)
    assert kinds(time, np.where(np.abs(x) < 0.06 * np.max(np.abs(x)), 0.0, x)) == ["dead-band"]


@pytest.mark.parametrize(("recording", "column"), SIGNALS)
def test_clean_signals_have_all_values(recording: str, column: str) -> None:
    assert kinds(*signal(recording, column)) == []


def test_set_points_and_a_coarse_encoder_are_no_defects_of_a_converter() -> None:
    rng = np.random.default_rng(1)
    time = np.arange(6000) * 1e-3
    steps = np.round(5.0 * np.sin(time)) * 20.0  # plateaus 20 apart, with a sensor's noise on them
    assert kinds(time, steps + rng.normal(0.0, 0.2, time.size)) == []
    assert kinds(time, np.round(40.0 * np.sin(time)) * 0.5) == []


def test_a_drive_that_stands_still_between_fast_moves_has_no_dead_band() -> None:
    time = np.arange(6000) * 1e-3
    moves = np.sign(np.sin(4.0 * time)) * (np.sin(8.0 * time) > 0.0)
    lagged = np.zeros(time.size)
    for k in range(1, time.size):
        lagged[k] = lagged[k - 1] + 0.3 * (60.0 * moves[k] - lagged[k - 1])
    noisy = lagged + np.random.default_rng(2).normal(0.0, 0.1, time.size)
    assert kinds(time, np.where(moves == 0.0, 0.0, noisy)) == []
