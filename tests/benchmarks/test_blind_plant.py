"""The blind benchmark's plant against the reference plant, the recordings and steady states worked out by hand."""

import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from reference.rig import rig_at
from reference.schedules import DRIVEN_A, DRIVEN_A_LOAD
from reference.stick import simulate_stick
from reference.waves import wave

sys.path.append(str(Path(__file__).parents[2] / "benchmarks"))
from blind_effects import CATALOGUE, combined
from blind_outside import OUTSIDE
from blind_plant import Undeclared, Wave, declared, simulate
from blind_schedules import PARTS, schedule
from blind_steps import advance, advance_declared
from blind_units import EFFECTS, FLOOR, NOISE, STRENGTHS, Visibility, generate_unit, overall, unit_rig

SHARED = Path(__file__).parents[3] / "shared"
COLUMNS = {
    "v": ("velocity_mm_s", 1e-3),
    "x": ("position_mm", 1e-3),
    "w_m": ("motor_speed_rad_s", 1.0),
    "i_q": ("q_current_A", 1.0),
    "u_q": ("q_voltage_V", 1.0),
}
#: There and back under a load that changes sign: breakaway, sliding through zero, aiding and opposing, a hold.
COMMAND = wave((0.05, 0.0), (0.2, 4.5e-3), (0.4, 4.5e-3), (0.7, -4.5e-3), (0.9, -4.5e-3), (1.05, 0.0))
LOAD = wave((0.0, 2e4), (0.45, 2e4), (0.6, -1e4))
STEADY = 6_000  # ms, until the velocity loop has settled


def run(temperature: float = -30.0, rows: int = 1200, **undeclared: float) -> dict[str, np.ndarray]:
    return simulate(
        declared(temperature), Wave(*_points(COMMAND)), Wave(*_points(LOAD)), rows, Undeclared(**undeclared)
    )


def _points(signal) -> tuple[np.ndarray, np.ndarray]:
    return signal.times, signal.values


@pytest.mark.parametrize("temperature", [25.0, -55.0])
def test_time_stepping_agrees_with_located_events(temperature: float) -> None:
    """Another integrator and another way to stick, a twentieth of the sensors' noise apart."""
    time = np.arange(1201) * 1e-3
    expected = simulate_stick(rig_at(temperature), COMMAND, LOAD, time)
    found = run(temperature)
    for name, noise in NOISE.items():
        assert np.sqrt(np.mean((found[name] - expected[name][1:]) ** 2)) < 0.05 * noise, name


def test_recorded_rig_is_this_plant() -> None:
    path = SHARED / "recordings" / "driven" / "m55_a.parquet"
    if not path.exists():
        pytest.skip(f"{path} is not on this machine")
    table = pytest.importorskip("pandas").read_parquet(path)
    found = simulate(declared(-55.0), Wave(*_points(DRIVEN_A)), Wave(*_points(DRIVEN_A_LOAD)), len(table))
    for name, (column, factor) in COLUMNS.items():
        residual = found[name] - table[column].to_numpy(float) * factor
        assert np.sqrt(np.mean(residual**2)) < 1.03 * FLOOR[name], name


def test_loop_without_effects_is_the_loop_with_none() -> None:
    """Where a gap of no width is closed does not matter, but asks for the loop that knows effects."""
    clean, found = run(), run(gap_closed=1.0)
    for name, noise in NOISE.items():
        assert np.abs(found[name] - clean[name]).max() < 1e-6 * noise, name


def test_compiled_loops_are_kept_for_the_next_process() -> None:
    """Each worker of the benchmark is a fresh process, and compiling costs as much as a unit or two."""
    for loop in (advance, advance_declared):
        assert loop.stats.cache_path is not None


def test_stuck_parts_do_not_move_at_all() -> None:
    """A load within the nut's friction and the no-back device is held to the last bit, at any stiffness."""
    still, pull = Wave(np.array([0.0]), np.array([0.0])), Wave(np.array([0.0]), np.array([5.5e4]))
    found = simulate(declared(-30.0), still, pull, 3000)
    assert np.ptp(found["x"]) == 0.0
    assert found["x"][0] == -5.5e4 / 3e8
    assert not found["w_m"].any()


def steady(speed: float, load: float, **undeclared: float) -> dict[str, float]:
    """Means over the last revolutions of a long run at constant speed."""
    command = Wave(np.array([0.0, 0.3]), np.array([0.0, speed]))
    force = Wave(np.array([0.0]), np.array([load]))
    found = simulate(declared(-30.0), command, force, STEADY, Undeclared(**undeclared))
    return {name: float(values[-1]) for name, values in found.items()}


@pytest.mark.parametrize(
    ("undeclared", "torque", "voltage"),
    [  # added torque at the motor and added voltage at 6 mm/s and 20 kN
        ({"windage": 0.05}, lambda s: 0.05 * (s["w_m"] / 100.0) ** 2, lambda s: 0.0),
        (
            {"windage": 0.05, "windage_exponent": 1.8},
            lambda s: 0.05 * (s["w_m"] / 100.0) ** 1.8,
            lambda s: 0.0,
        ),
        ({"load_nut": 0.02}, lambda s: 0.02 * s["F_s"] * s["ratio"], lambda s: 0.0),
        ({"load_gear": 0.03}, lambda s: 0.03 * s["F_s"] * s["ratio"], lambda s: 0.0),
        ({"asymmetry_nut": -400.0}, lambda s: -400.0 * s["ratio"], lambda s: 0.0),
        ({"asymmetry_gear": 1.5}, lambda s: 1.5 / 30.0, lambda s: 0.0),
        ({"asymmetry_nut_viscous": 5e4}, lambda s: 5e4 * 6e-3 * s["ratio"], lambda s: 0.0),
        (
            {"stribeck_nut": 500.0, "stribeck_nut_speed": 6e-3, "stribeck_exponent": 2.0},
            lambda s: 500.0 * np.exp(-1.0) * s["ratio"],
            lambda s: 0.0,
        ),
        ({"dead_voltage": 1.2, "dead_current": 0.1}, lambda s: 0.0, lambda s: 1.2),
        ({"gap": 3e-4}, lambda s: 0.0, lambda s: 0.0),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else "",
)
def test_steady_state_carries_what_the_effect_adds(undeclared, torque, voltage) -> None:
    rig = declared(-30.0)
    flux = 1.5**0.5 * rig.p * rig.psi_pm
    clean, found = steady(6e-3, 2e4), steady(6e-3, 2e4, **undeclared)
    mean = {"w_m": found["w_m"], "ratio": rig.k / rig.i}
    # the screw carries the load and the nut's friction, which it may itself enlarge
    mean["F_s"] = (rig.F_fn + rig.b_n * 6e-3 + 2e4) / (1.0 - undeclared.get("load_nut", 0.0))
    current = torque(mean) / flux
    assert found["i_q"] - clean["i_q"] == pytest.approx(current, rel=2e-3, abs=2e-4)
    assert found["u_q"] - clean["u_q"] == pytest.approx(rig.R_s * current + voltage(mean), rel=2e-3, abs=2e-3)


def test_sensors_in_the_loop_move_the_true_current() -> None:
    clean, gain, offset = (
        steady(6e-3, 2e4),
        steady(6e-3, 2e4, current_gain=1.1),
        steady(6e-3, 2e4, current_offset=0.2),
    )
    assert gain["i_q"] == pytest.approx(1.1 * clean["i_q"], rel=1e-3)
    assert gain["u_q"] == pytest.approx(
        clean["u_q"], abs=3e-3
    )  # the torque, and so the true current, is the same
    assert offset["i_q"] - clean["i_q"] == pytest.approx(0.2, rel=1e-3)
    assert offset["u_q"] == pytest.approx(clean["u_q"], abs=3e-3)


def test_output_sensors_are_late_and_scaled() -> None:
    clean = run()
    late, scaled = run(velocity_delay=3e-3), run(velocity_gain=1.02)
    assert late["v"][10:] == pytest.approx(clean["v"][7:-3], abs=1e-9)
    assert scaled["v"] == pytest.approx(1.02 * clean["v"], rel=1e-12)
    for name in ("x", "w_m", "i_q", "u_q"):
        assert np.array_equal(late[name], clean[name])


def test_backlash_is_crossed_at_a_reversal() -> None:
    """From one loaded flank to the other the nut lags the screw by the gap."""
    gap, rig = 2e-4, declared(-30.0)
    command = Wave(np.array([0.0, 0.3, 2.0, 2.6]), np.array([0.0, 9e-3, 9e-3, -9e-3]))
    none = Wave(np.array([0.0]), np.array([0.0]))
    found = simulate(rig, command, none, 4000, Undeclared(gap=gap))
    turned = np.trapezoid(found["w_m"][1900:3901], dx=1e-3) * rig.k / rig.i
    moved = found["x"][3900] - found["x"][1900]
    assert moved - turned == pytest.approx(gap + 2.0 * (rig.F_fn + rig.b_n * 9e-3) / rig.k_s, rel=5e-3)


def test_every_effect_of_the_contract_has_a_form() -> None:
    contract = SHARED / "CONTRACT.md"
    if not contract.exists():
        pytest.skip(f"{contract} is not on this machine")
    names = contract.read_text().split("## Effect names")[1].split(". More")[0]
    assert {name.strip().strip("`") for name in names.split(",")} <= set(CATALOGUE)
    assert len(OUTSIDE) >= 5


@cache
def excited_clean() -> dict[str, np.ndarray]:
    return simulate(declared(-20.0), *schedule("fit_2", np.random.default_rng(0)))


@pytest.mark.parametrize("name", EFFECTS)
def test_effects_change_the_recordings(name: str) -> None:
    """Whatever form a seed draws shows at its largest amplitude, on a schedule that excites everything."""
    rig, played = declared(-20.0), schedule("fit_2", np.random.default_rng(0))
    clean = excited_clean()
    draft = EFFECTS[name](np.random.default_rng(3), rig)
    found = simulate(rig, *played, combined(draft.fields(draft.most)))
    assert all(np.isfinite(values).all() for values in found.values())
    assert max(np.sqrt(np.mean((found[c] - clean[c]) ** 2)) / FLOOR[c] for c in FLOOR) > 0.5


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("seed", range(20))
def test_schedules_are_rich_and_stay_on_the_stroke(part: str, seed: int) -> None:
    command, load, rows = schedule(part, np.random.default_rng(seed))
    time = np.arange(rows) * 1e-3
    speed, force = (np.interp(time, *signal) for signal in (command, load))
    assert 15_000 <= rows <= 21_000
    assert np.all(np.diff(command.times) > 0.0)
    assert np.all(np.diff(load.times) > 0.0)
    assert speed.max() > 6e-3
    assert speed.min() < -6e-3
    assert np.abs(np.cumsum(speed) * 1e-3).max() < 0.04
    assert np.ptp(force) > 3e4
    assert np.abs(force).max() <= 55e3
    # every speed class both ways, some of it slow
    slow = (np.abs(speed) > 2e-4) & (np.abs(speed) < 1.6e-3)
    assert slow.mean() > 0.03


def test_units_spread_about_the_drawing() -> None:
    drawing = declared(-30.0)
    rigs = [unit_rig(-30.0, np.random.default_rng(seed)) for seed in range(200)]
    for name, spread in (("R_s", 0.03), ("F_fn", 0.05), ("M", 0.03)):
        ratios = np.array([getattr(rig, name) for rig in rigs]) / getattr(drawing, name)
        assert ratios.std() == pytest.approx(spread, rel=0.2)
    assert min(rig.k_b for rig in rigs) > 1.0


def test_clean_unit_has_the_columns_of_the_recordings_and_repeats(tmp_path: Path) -> None:
    pd = pytest.importorskip("pandas")
    label = generate_unit(tmp_path / "one", [], "none", seed=5)
    again = generate_unit(tmp_path / "two", [], "none", seed=5)
    assert label == again
    assert label["effects"] == []
    for part in PARTS:
        table = pd.read_parquet(tmp_path / "one" / f"{part}.parquet")
        pd.testing.assert_frame_equal(table, pd.read_parquet(tmp_path / "two" / f"{part}.parquet"))
        steps = table["q_current_A"].to_numpy(float) / 0.01
        assert np.abs(steps - np.round(steps)).max() < 1e-3
        assert table["temperature_degC"].mean() == pytest.approx(label["temperature_degC"], abs=0.02)
    assert not table.equals(pd.read_parquet(tmp_path / "one" / "fit_2.parquet"))
    recorded = SHARED / "recordings" / "effects" / "unit_a" / "fit_1.parquet"
    if recorded.exists():
        assert table.dtypes.to_dict() == pd.read_parquet(recorded).dtypes.to_dict()


@pytest.mark.slow
def test_strength_is_what_declared_parameters_cannot_imitate(tmp_path: Path) -> None:
    label = generate_unit(tmp_path, ["windage"], "medium", seed=2, temperature=-20.0)
    (effect,) = label["effects"]
    low, high = STRENGTHS["medium"]
    assert 0.94 * low < max(v for c, v in effect["visibility"].items() if c != "x") < 1.06 * high
    # drag in proportion to the speed is what b_m already is
    visibility = Visibility(declared(-20.0), schedule("fit_1", np.random.default_rng(1)))
    drag = combined({"windage": 0.02, "windage_exponent": 1.0})
    clean, found = (simulate(visibility.rig, *visibility.played, extra) for extra in (Undeclared(), drag))
    raw = max(np.sqrt(np.mean((found[c] - clean[c]) ** 2)) / FLOOR[c] for c in ("v", "w_m", "i_q", "u_q"))
    assert raw > 0.5
    assert overall(visibility.of(drag)) < 0.1 * raw
