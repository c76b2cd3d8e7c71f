"""Relations of time alone are time events: a step ends at their instant, and the value there is the one after it."""

import shutil
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("casadi", reason="the export extra is not installed")
pytest.importorskip("ziglang", reason="the export extra is not installed")

import fmpy
from courses import noted_courses

from thsa_cosim.export import export_fmu
from thsa_cosim.export.compile import native_platform
from thsa_cosim.fmu import Plant

MODELS = Path(__file__).parents[1] / "modelica"
NAMES = ("x", "w", "from", "after", "scaled", "wave", "n")
GRID = np.round(np.arange(21) * 0.05, 2)
SUMMED = np.cumsum(
    np.r_[0.0, np.full(20, 0.05)]
)  # 0.3 is 0.3 - 1e-16 or 0.3 + 1e-16 here, as importers add it up


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Path of the FMU, for this machine."""
    here = [native_platform().fmi3]
    output = tmp_path_factory.mktemp("fmu") / "TimeEvents.fmu"
    return export_fmu(str(MODELS / "TimeEvents.mo"), output=output, platforms=here)


@pytest.mark.parametrize("grid", [GRID, SUMMED], ids=["decimal", "summed"])
@pytest.mark.parametrize("stepping", ["free", "samples"])
def test_the_value_at_the_instant_is_the_one_after_the_event(built, stepping, grid):
    with Plant.open(built, stepping=stepping) as plant:
        for t0 in np.round(np.arange(1, 18) * 0.05, 2):
            run = plant.run({"t0": t0}, None, NAMES, grid)
            assert run["from"] == pytest.approx(np.where(t0 <= GRID, 1.0, 0.0)), t0
            assert run["after"] == pytest.approx(np.where(t0 < GRID, 1.0, 0.0)), t0
            assert run["scaled"] == pytest.approx(np.where(np.round(GRID - t0, 2) >= 0.1, 1.0, 0.0)), t0
            assert run["n"] == pytest.approx(np.floor(GRID * 10 + 1e-6))
            assert run["x"] == pytest.approx(np.maximum(0.0, GRID - t0), abs=1e-11)
            assert run["w"] == pytest.approx(np.where(GRID < 0.5, GRID, 1.0 - GRID), abs=1e-11)
            assert run["wave"][1:] == pytest.approx(np.where(np.sin(10 * GRID[1:]) > 0, 1.0, 0.0))


def test_steps_end_at_time_events_without_a_search(built, monkeypatch):
    runs = noted_courses(monkeypatch)
    with Plant.open(built, stepping="free") as plant:
        plant.run({"t0": 0.3}, None, ("x",), np.array([0.0, 1.0]))
    # 10 ticks, t0 from both sides, 0.1 after it, 0.5 and 1.0, four changes of sin; two steps to each at most
    assert runs[-1].steps <= 40


@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
def test_fmpy_finds_the_same(built, kind):
    result = fmpy.simulate_fmu(str(built), fmi_type=kind, stop_time=1.0, output_interval=0.05)
    last = {round(float(t), 9): row for t, row in zip(result["time"], result, strict=True)}
    assert last[0.25]["from"] == 0.0
    assert last[0.3]["from"] == 1.0
    assert last[0.35]["after"] == 1.0
    assert last[0.4]["scaled"] == 1.0


def test_events_between_the_rows_of_a_model_without_states(tmp_path):
    shutil.copy(MODELS / "Ticks.mo", tmp_path)
    here = [native_platform().fmi3]
    fmu = export_fmu(str(tmp_path / "Ticks.mo"), output=tmp_path / "Ticks.fmu", platforms=here)
    for stepping in ("free", "samples"):
        with Plant.open(fmu, stepping=stepping) as plant:
            run = plant.run({}, None, ("y", "m"), np.array([0.0, 0.25, 0.5, 0.75, 1.0]))
        assert run["y"] == pytest.approx([0.0, 2.0, 15.0, 17.0, 20.0])
        assert run["m"] == pytest.approx([1.0, 3.0, 6.0, 8.0, 11.0])


@pytest.mark.parametrize("kind", ["co-simulation", "model-exchange"])
def test_a_timer_that_an_event_within_a_step_starts_ends_at_its_instant(tmp_path, kind):
    """Its relation was 1e9 s from its change at first: a dead band in proportion to that would be 0.1 ms."""
    shutil.copy(MODELS / "Timer.mo", tmp_path)
    here = [native_platform().fmi3]
    fmu = export_fmu(str(tmp_path / "Timer.mo"), output=tmp_path / "Timer.fmu", platforms=here)
    crossed = -np.log(0.75)
    for time in (np.array([0.0, 1.0]), np.linspace(0.0, 1.0, 101)):
        with Plant.open(fmu, kind=kind) as plant:
            run = plant.run({}, None, ("x", "z", "w"), time, tolerance=1e-9)
        assert run["z"] == pytest.approx(np.maximum(0.0, time - crossed - 0.1), abs=2e-8)
        assert run["w"] == pytest.approx(np.maximum(0.0, time - crossed - 0.2), abs=2e-8)
