"""The redundant actuator: healthy, through every failure, its energy balance and its events."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from courses import noted_courses

from thsa_cosim.fmu import Plant
from thsa_cosim.signals import Signals

FMUS = Path(__file__).parents[2] / "fmus"
TIME = np.arange(3001) * 1e-3
COMMAND = np.interp(TIME, [0.0, 0.3, 2.4, 2.7], [0.0, 9e-3, 9e-3, 0.0])
GAINS = {"velocityController.K_p": 0.363, "velocityController.K_i": 2.98}
NAMES = ("v", "x", "w_A", "w_B", "i_A", "i_B", "F_1", "F_2", "active", "P_el", "E_res")
FINDINGS = ("failed_A", "failed_B", "slip_A", "slip_B", "sensor")
CONDITIONS = [(25.0, 0.0), (-30.0, 55e3), (-55.0, 55e3), (-55.0, -55e3)]
#: mm that the surface may stay behind a healthy one until the other lane has it: confirmation, brake, start-up.
TAKE_OVER = 3.0


def run(
    name: str, names: tuple[str, ...], values: dict[str, float], temperature: float, load: float
) -> Signals:
    columns = {"v_cmd": COMMAND, "F_load": np.full_like(TIME, load), "T_amb": np.full_like(TIME, temperature)}
    with Plant.open(FMUS / f"{name}.fmu") as opened:
        return opened.run(values, Signals(TIME, columns), names, TIME, tolerance=1e-6)


def redundant(values: dict[str, float], temperature: float, load: float) -> Signals:
    return run("THSA_Redundant", (*NAMES, *(f"monitor.{n}.y" for n in FINDINGS)), values, temperature, load)


@dataclass(frozen=True)
class Failure:
    """``ends`` with lane 1, 2 or 0 (none) driving; ``found`` by the monitor."""

    values: dict[str, float]
    ends: int
    found: tuple[str, ...] = ()
    behind: float = 0.0
    """mm that the surface is at most off the healthy one at the end, where a lane drives."""
    extra: dict[str, float] = field(default_factory=dict)


FAILURES = {
    "lane A lost": Failure({"laneA.t_loss": 1.0}, 2, ("failed_A",), TAKE_OVER),
    "lane B lost while it stands by": Failure({"laneB.t_loss": 1.0}, 1),
    "both lanes lost": Failure({"laneA.t_loss": 1.0, "laneB.t_loss": 1.0}, 0, ("failed_A", "failed_B")),
    "resolver of lane A lost": Failure({"laneA.t_sensor": 1.0}, 2, ("failed_A",), TAKE_OVER),
    "resolver of lane B lost": Failure({"laneB.t_sensor": 1.0}, 1),
    "output sensor lost": Failure({"t_sensor": 1.0}, 1, ("sensor",)),
    "brake A does not release": Failure({"laneA.brake.t_stuck": 0.0}, 2, ("failed_A",), TAKE_OVER),
    "brake A closes by itself": Failure({"laneA.brake.t_stuck": 1.0}, 2, ("failed_A",), TAKE_OVER),
    "brake B does not release": Failure(
        {"laneA.t_loss": 1.0, "laneB.brake.t_stuck": 0.0}, 0, ("failed_A", "failed_B")
    ),
    "brake B does not hold": Failure({"laneB.brake.t_slip": 1.0}, 1, ("slip_B",), TAKE_OVER),
    "brake A does not hold while open": Failure({"laneA.brake.t_slip": 1.0}, 1),
    "motor A jammed": Failure({"laneA.t_jam": 1.0}, 2, ("failed_A",), TAKE_OVER),
    "motor B jammed": Failure({"laneB.t_jam": 1.0}, 1),
    "screw jammed": Failure({"t_jam": 1.0}, 0, ("failed_A", "failed_B")),
    "primary path broken": Failure({"primary.t_rupture": 1.0}, 0),
    "secondary path broken": Failure({"secondary.t_rupture": 1.0}, 1),
}


def energy_error(found: Signals) -> float:
    """Largest residual of the balance over the electrical energy that was turned over."""
    return float(np.abs(found["E_res"]).max() / np.trapezoid(np.abs(found["P_el"]), TIME))


@pytest.mark.parametrize(("temperature", "load"), CONDITIONS)
def test_a_healthy_one_moves_as_the_single_actuator(temperature: float, load: float) -> None:
    single = run("THSA", ("v", "x", "w_m", "i_q"), GAINS, temperature, load)
    found = redundant({}, temperature, load)
    for one, other in (("v", "v"), ("x", "x"), ("w_m", "w_A"), ("i_q", "i_A")):
        assert np.abs(found[other] - single[one]).max() < 1e-4 * np.ptp(single[one]), one
    assert np.abs(found["w_B"]).max() < 1e-2  # creep of the closed brake


@pytest.mark.parametrize(("temperature", "load"), CONDITIONS)
@pytest.mark.parametrize("name", FAILURES)
def test_every_failure_is_survived(name: str, temperature: float, load: float) -> None:
    """The surface goes on behind the healthy one, or is held within what the path's play lets it move."""
    failure = FAILURES[name]
    if name == "primary path broken" and load == 0.0:
        pytest.skip("a path that carries nothing breaks unnoticed: see the test below")
    found, healthy = redundant(failure.values, temperature, load), redundant({}, temperature, load)
    assert energy_error(found) < 1e-6
    assert found["active"][-1] == failure.ends
    assert {n for n in FINDINGS if found[f"monitor.{n}.y"][-1]} == set(failure.found)
    x = found["x"] * 1e3
    if failure.ends:
        off = healthy["x"] * 1e3 - x
        assert np.abs(off).max() <= failure.behind + 1e-3
        late = (TIME > 2.0) & (TIME < 2.3)
        assert np.abs(found["v"] - healthy["v"])[late].max() < 2e-4 or name == "output sensor lost"
        return
    stopped = TIME > 2.0
    assert np.ptp(x[stopped]) < 1e-2  # mm: held, whatever is commanded
    at_failure = x[1000]
    # what a lane runs on until it is found out, or half the play with the deflections under the load
    assert abs(x[-1] - at_failure) < (1.0 if name == "primary path broken" else 9.0 * 0.4)


def test_secondary_path_takes_the_load_within_its_play_and_locks_the_screw() -> None:
    found = redundant({"primary.t_rupture": 1.0}, -30.0, 55e3)
    after = TIME > 1.2
    assert np.abs(found["F_1"][after]).max() == 0.0
    assert found["F_2"][after] == pytest.approx(55e3, rel=1e-3)
    drop = found["x"][1000] - found["x"][-1]
    # half the play, and what the softer path yields more than the stiff one
    assert 0.5e-3 < drop < 0.5e-3 + 55e3 / 1.5e8
    assert np.abs(found["F_2"]).max() < 2.2 * 55e3  # the blow


def test_a_path_that_breaks_without_load_shows_once_it_is_loaded() -> None:
    columns = {
        "v_cmd": COMMAND,
        "F_load": np.interp(TIME, [1.5, 1.6], [0.0, 30e3]),
        "T_amb": np.full_like(TIME, 25.0),
    }
    with Plant.open(FMUS / "THSA_Redundant.fmu") as opened:
        found = opened.run({"primary.t_rupture": 1.0}, Signals(TIME, columns), NAMES, TIME)
    assert found["active"][1450] == 1
    assert found["active"][-1] == 0
    assert energy_error(found) < 1e-6


@pytest.mark.parametrize("name", [None, *FAILURES])
def test_events_do_not_chatter(name: str | None, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run has as many events as a healthy one, and a few dozen for the failure and the start of the other lane."""
    courses = noted_courses(monkeypatch)
    redundant({} if name is None else FAILURES[name].values, -30.0, 55e3)
    assert 0 < courses[-1].events < (25 if name is None else 80)
    assert courses[-1].steps < 600


def test_model_exchange_gives_the_same_take_over() -> None:
    columns = {"v_cmd": COMMAND, "F_load": np.full_like(TIME, 55e3), "T_amb": np.full_like(TIME, -30.0)}
    values = {"laneA.t_loss": 1.0}
    with Plant.open(FMUS / "THSA_Redundant.fmu", kind="model-exchange") as opened:
        found = opened.run(values, Signals(TIME, columns), ("x", "active"), TIME, tolerance=1e-8)
    expected = redundant(values, -30.0, 55e3)
    assert np.array_equal(found["active"], expected["active"])
    assert np.abs(found["x"] - expected["x"]).max() < 1e-5 * np.ptp(expected["x"])
