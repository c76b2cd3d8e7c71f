"""The periodogram over position, and its use slot by slot."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from thsa_cosim.diagnosis.catalogue.slots import Slot
from thsa_cosim.diagnosis.choosing.orders import Machine
from thsa_cosim.diagnosis.choosing.wave_numbers import wave_number_finder, wave_numbers
from thsa_cosim.signals import Signals

TIME = np.arange(12000) * 1e-3
POSITION = 8.0 * np.sin(2 * np.pi * 0.25 * TIME) + 1.3 * np.sin(2 * np.pi * 0.11 * TIME)
NOISE = np.random.default_rng(4).standard_normal(TIME.size)
GRID = np.arange(1.0, 61.0)


def ripple(wave: float, size: float, position: np.ndarray = POSITION) -> np.ndarray:
    return size * np.sin(wave * position + 0.4)


def test_the_strongest_come_first_and_no_more_than_asked_for():
    residual = ripple(24.0, 0.6) + ripple(11.0, 1.2) + ripple(41.0, 0.3) + 0.3 * NOISE
    assert wave_numbers([POSITION], [[residual]], GRID) == (11.0, 24.0, 41.0)
    assert wave_numbers([POSITION], [[residual]], GRID, peaks=1) == (11.0,)


def test_channels_and_recordings_add_up():
    strong, weak = 0.5 * NOISE + ripple(24.0, 0.5), 0.5 * NOISE[::-1] + ripple(37.0, 0.15)
    assert wave_numbers([POSITION, POSITION], [[weak], [strong]], GRID, peaks=1) == (24.0,)
    assert wave_numbers([POSITION, POSITION], [[strong], [weak]], GRID, peaks=1) == (24.0,)
    assert wave_numbers([POSITION], [[weak, strong]], GRID, peaks=1) == (24.0,)
    assert wave_numbers([POSITION], [[strong, weak]], GRID, peaks=1) == (24.0,)
    assert wave_numbers([0.0 * POSITION, POSITION], [[strong], [strong]], GRID, peaks=1) == (24.0,)


def test_a_drift_along_the_position_is_no_wave():
    residual = 30.0 * POSITION + 100.0 + ripple(24.0, 0.7) + 0.3 * NOISE
    assert wave_numbers([POSITION + 50.0], [[residual]], GRID, peaks=1) == (24.0,)


def test_what_is_not_resolved_is_not_said():
    residual = ripple(24.0, 5.0)
    assert wave_numbers([POSITION[:511]], [[residual[:511]]], GRID) == ()
    assert wave_numbers([POSITION[:1024]], [[residual[:1024]]], GRID) == (), "two blocks say little"
    assert wave_numbers([1e-3 * POSITION], [[residual]], GRID) == (), "it hardly moves"
    assert wave_numbers([1e3 * POSITION], [[residual]], GRID) == (), "it moves too fast for its samples"
    assert wave_numbers([POSITION], [[0.0 * residual]], GRID) == ()


def test_five_whole_blocks_are_the_least_that_say_something():
    residual = ripple(24.0, 5.0) + 0.3 * NOISE
    assert wave_numbers([POSITION[:2560]], [[residual[:2560]]], GRID, peaks=1) == (24.0,)
    assert wave_numbers([POSITION[:2559]], [[residual[:2559]]], GRID, peaks=1) == ()
    several = np.split(np.arange(2048), 4)
    assert wave_numbers([POSITION[p] for p in several], [[residual[p]] for p in several], GRID) == ()


def test_a_wave_is_resolved_by_two_periods_of_it_in_a_block():
    """Each block goes once over the same way, a few periods of a pure wave: only what is resolved has a power."""
    way = np.tile(np.linspace(0.0, 2.0 * np.pi, 512), 12)

    def seen(periods: float, *grid: float) -> tuple[float, ...]:
        waves = tuple(periods * g for g in grid)
        found = wave_numbers([way], [[0.01 * np.sin(periods * way)]], np.array(waves))
        return tuple(wave / periods for wave in found)

    assert seen(2.2, 0.9, 1.0, 1.1) == pytest.approx((1.0,)), "and small as it is, it is one"
    assert seen(1.5, 0.9, 1.0, 1.1) == ()
    assert seen(2.05, 0.9, 0.95, 1.0) == pytest.approx((1.0,))


def test_a_rest_in_between_hides_nothing():
    position = np.concatenate([np.zeros(1024), POSITION])
    residual = np.concatenate([np.zeros(1024), ripple(24.0, 0.6)]) + 0.3 * np.random.default_rng(
        1
    ).standard_normal(13024)
    assert wave_numbers([position], [[residual]], GRID, peaks=1) == (24.0,)


def test_power_counts_and_not_amplitude():
    now_and_then = np.where(np.arange(TIME.size) // 512 % 4 == 0, ripple(24.0, 4.0), 0.0)
    assert wave_numbers([POSITION], [[now_and_then + ripple(37.0, 1.5) + 0.3 * NOISE]], GRID, 1) == (24.0,)


@pytest.fixture
def found() -> Any:
    """A motor and a nut 0.01 times as far, a ripple of the motor in the current and one along the path in the speed."""
    path = 1e-2 * POSITION
    reach = float(np.abs(path).max())
    along = 2.0 * np.pi * 25.0 / reach
    residual = np.concatenate([ripple(24.0, 0.9) + 0.3 * NOISE, ripple(along, 0.5, path) + 0.3 * NOISE])
    residual = np.concatenate([residual, np.zeros(7)])
    channels = [SimpleNamespace(name=n, measured=np.zeros(TIME.size), time=TIME) for n in ("i", "v")]
    channels.append(SimpleNamespace(name="slow", measured=np.zeros(7), time=TIME[:7]))
    trials: Any = (SimpleNamespace(case=SimpleNamespace(name="a", channels=channels), group="g"),)
    slots = (
        Slot("motor", "FrictionEffect", {"z": "rad"}), Slot("screw", "FrictionEffect", {"z": "m"}),
        Slot("sensor", "SensorEffect", {}),
    )  # fmt: skip
    asked: list[Any] = []
    moves = [True]

    def signals_at(values: Any) -> dict[str, Signals]:
        asked.append(values)
        if not moves:
            return {}
        coarse = TIME[::2]
        return {"a": Signals(coarse, {"motorEffect.z": POSITION[::2], "screwEffect.z": path[::2]})}

    bench: Any = SimpleNamespace(of=lambda part: trials if part == "fit" else ())
    unknowns = SimpleNamespace(assignments=lambda vector, group: {"p": float(vector[0]), "g": group})
    fit: Any = SimpleNamespace(unknowns=unknowns, vector=np.array([3.0]), residual=residual)
    machine = Machine({"screw": {"motor": 100.0}}, {})
    find = wave_number_finder(bench, slots, signals_at, machine)
    waves = find(fit)
    moves.clear()
    return SimpleNamespace(waves=waves, asked=asked[:1], along=along, reach=reach, at_rest=find(fit))


def test_every_friction_slot_gets_its_waves_at_the_fitted_values(found: Any):
    assert found.asked == [{"a": {"p": 3.0, "g": "g"}}]
    assert set(found.waves) == {"motor", "screw"}
    assert found.waves["motor"][0] == 24.0
    assert all(wave == int(wave) for wave in found.waves["motor"])


def test_along_a_path_the_grid_is_in_periods_per_reach_and_the_machines_own_follow(found: Any):
    assert any(wave == pytest.approx(found.along, rel=0.02) for wave in found.waves["screw"][:3])
    periods = np.array(found.waves["screw"][:3]) * found.reach / (2.0 * np.pi)
    np.testing.assert_allclose(4.0 * periods, np.round(4.0 * periods), atol=1e-6)
    assert found.waves["screw"][-2:] == (100.0, 200.0)


def test_without_a_run_there_are_the_machines_own_alone(found: Any):
    assert found.at_rest == {"motor": (), "screw": (100.0, 200.0)}
