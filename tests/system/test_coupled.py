"""Two first-order lags in a ring, and what hangs on them, against closed forms."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from fmu_sources import build
from scipy.linalg import expm

from thsa_cosim.fmu import SimulationFailure
from thsa_cosim.fmu.description import DefaultExperiment
from thsa_cosim.fmu.scratch import ScratchFolder
from thsa_cosim.signals import FloatArray, Signals
from thsa_cosim.system import SystemPlant, open_plant, read_description, unpack
from thsa_cosim.system.assemble import Part, Wire, assemble
from thsa_cosim.system.structure import checked
from thsa_cosim.system.write import write_ssp

TIME = np.linspace(0.0, 1.0, 101)
FAST, SLOW, GAIN = 0.05, 0.2, -2.0
VALUES = {"fast.tau": FAST, "slow.tau": SLOW, "slow.k": GAIN}
RING = (Wire("fast.y", "slow.u"), Wire("slow.y", "fast.u", 1.0, 1.0))


def ring(times: FloatArray) -> FloatArray:
    """Exact states (n, 2): fast' = (slow + 1 - fast)/FAST, slow' = (GAIN fast - slow)/SLOW, from zero."""
    a = np.array([[-1.0 / FAST, 1.0 / FAST], [GAIN / SLOW, -1.0 / SLOW]])
    rest = np.linalg.solve(a, np.array([-1.0 / FAST, 0.0]))
    return np.array([rest - expm(a * t) @ rest for t in times])


def run(
    folder: Path,
    parts: Sequence[Part],
    wires: Sequence[Wire],
    outputs: Sequence[str],
    *,
    values: Mapping[str, float] = VALUES,
    inputs: Signals | None = None,
    connectors: Mapping[str, Sequence[str]] | None = None,
    tolerance: float = 1e-9,
    time: FloatArray = TIME,
) -> Signals:
    system, archives = assemble("ring", parts, wires, connectors or {})
    path = write_ssp(system, archives, folder / "ring.ssp", DefaultExperiment(0.0, 1.0))
    with SystemPlant.open(path) as plant:
        return plant.run(values, inputs, outputs, time, tolerance=tolerance)


@pytest.fixture(scope="module")
def fmi2() -> Path:
    return build.lag2()


@pytest.fixture(scope="module")
def fmi3() -> Path:
    return build.lag3()


def test_model_exchange_components_are_integrated_as_one(tmp_path: Path, fmi2: Path, fmi3: Path) -> None:
    found = run(tmp_path, [Part("fast", fmi2), Part("slow", fmi3)], RING, ["fast.y", "slow.y"])
    exact = ring(TIME)
    assert np.max(np.abs(found["fast.y"] - exact[:, 0])) < 1e-7
    assert np.max(np.abs(found["slow.y"] - exact[:, 1])) < 1e-7


def test_two_instances_of_one_fmu_do_not_share_anything(tmp_path: Path, fmi2: Path) -> None:
    found = run(tmp_path, [Part("fast", fmi2), Part("slow", fmi2)], RING, ["slow.y"])
    assert np.max(np.abs(found["slow.y"] - ring(TIME)[:, 1])) < 1e-7


def test_co_simulation_is_of_second_order_in_its_step(tmp_path: Path, fmi2: Path, fmi3: Path) -> None:
    errors = []
    for step in (0.01, 0.005, 0.0025):
        parts = [Part("fast", fmi2, "coupled", step), Part("slow", fmi3, "coupled", step)]
        found = run(tmp_path, parts, RING, ["slow.y"])
        errors.append(np.max(np.abs(found["slow.y"] - ring(TIME)[:, 1])))
    assert errors[0] < 1e-3
    for coarse, fine in pairwise(errors):
        assert 3.0 < coarse / fine < 5.5


def test_co_simulation_beside_model_exchange(tmp_path: Path, fmi2: Path, fmi3: Path) -> None:
    errors = []
    for step in (0.01, 0.005):
        found = run(tmp_path, [Part("fast", fmi2), Part("slow", fmi3, "coupled", step)], RING, ["slow.y"])
        errors.append(np.max(np.abs(found["slow.y"] - ring(TIME)[:, 1])))
    assert errors[0] < 1e-3
    assert 3.0 < errors[0] / errors[1] < 5.5


@pytest.mark.parametrize("delay", [0.0, 0.02, 0.05])
def test_a_sampled_controller_acts_at_its_ticks(tmp_path: Path, fmi2: Path, fmi3: Path, delay: float) -> None:
    """``feed`` of the controller is its input: the plant gets 1 - x(t_k) from t_k + delay on, and 1 before."""
    period, tau = 0.05, 0.2
    parts = [Part("plant", fmi2), Part("controller", fmi3, "sampled", period, delay)]
    wires = [Wire("controller.feed", "plant.u"), Wire("plant.y", "controller.u", -1.0, 1.0)]
    found = run(tmp_path, parts, wires, ["plant.y"], values={"plant.tau": tau}, tolerance=1e-10)
    x, held = 0.0, 1.0
    exact, now, waiting = {0.0: 0.0}, 0.0, []
    ticks = [(k * period, "tick") for k in range(21)]
    rows = [(round(t, 9), "row") for t in TIME]
    changes = [(t + delay, "change") for t, _ in ticks] if delay else []
    order = {"tick": 0, "change": 1, "row": 2}
    for time, kind in sorted([*ticks, *rows, *changes], key=lambda e: (round(e[0], 9), order[e[1]])):
        x = held + (x - held) * np.exp(-(time - now) / tau)
        now = time
        if kind == "tick":
            waiting.append(1.0 - x)
            if not delay:
                held = waiting.pop(0)
        elif kind == "change" and waiting:
            held = waiting.pop(0)
        elif kind == "row":
            exact[time] = x
    expected = np.array([exact[round(t, 9)] for t in TIME])
    assert np.max(np.abs(found["plant.y"] - expected)) < 1e-6


def test_an_algebraic_loop_is_solved(tmp_path: Path, fmi2: Path, fmi3: Path) -> None:
    """a = b, b = a/2 + 1: both are 2."""
    wires = [Wire("a.feed", "b.u", 0.5, 1.0), Wire("b.feed", "a.u")]
    found = run(
        tmp_path,
        [Part("a", fmi2), Part("b", fmi3)],
        wires,
        ["a.feed", "b.feed", "b.y"],
        values={"b.tau": 0.1},
    )
    assert np.max(np.abs(found["a.feed"] - 2.0)) < 1e-9
    assert np.max(np.abs(found["b.feed"] - 2.0)) < 1e-9
    assert np.max(np.abs(found["b.y"] - 2.0 * (1.0 - np.exp(-TIME / 0.1)))) < 1e-7


def test_a_loop_without_solution_is_named(tmp_path: Path, fmi2: Path, fmi3: Path) -> None:
    wires = [Wire("a.feed", "b.u", 1.0, 1.0), Wire("b.feed", "a.u")]
    with pytest.raises(
        SimulationFailure, match=r"algebraic loop through .*a\.feed.* has no solution at t = 0 s"
    ):
        run(tmp_path, [Part("a", fmi2), Part("b", fmi3)], wires, ["a.y"], values={})


def test_units_are_converted_and_connectors_drive_several_inputs(tmp_path: Path, fmi2: Path) -> None:
    inputs = Signals(TIME, {"command": TIME}, {"command": "m/s"})
    found = run(
        tmp_path,
        [Part("a", fmi2), Part("b", fmi2, start={"k": 3.0})],
        [],
        ["a.feed", "b.feed", "speed", "b.y"],
        values={"b.tau": 0.1},
        inputs=inputs,
        connectors={"command": ["a.u", "b.u"], "speed": ["b.feed"]},
    )
    for name in ("a.feed", "b.feed", "speed"):
        assert np.max(np.abs(found[name] - TIME)) < 1e-12
    lag = 3.0 * (TIME - 0.1 * (1.0 - np.exp(-TIME / 0.1)))
    assert np.max(np.abs(found["b.y"] - lag)) < 1e-7


def test_a_component_that_fails_is_named(tmp_path: Path, fmi2: Path) -> None:
    faulty = Part("slow", fmi2, "coupled", 0.01, start={"fault": float(build.FAULTS["error"]), "at": 0.5})
    with pytest.raises(SimulationFailure, match=r"component slow: .*t = 0\.\d+ s"):
        run(tmp_path, [Part("fast", fmi2), faulty], RING, ["slow.y"])


def test_units_of_a_connection_are_converted_once(tmp_path: Path) -> None:
    """A drive in rad/s behind a command in m/s: 1000 times in mm, and the archive says the same when read again."""
    parts = [Part("a", build.lag2()), Part("b", build.lag2())]
    system, archives = assemble(
        "s", parts, [Wire("a.feed", "b.u", 2.0, 0.5)], {"out": ["b.feed"], "in": ["a.u"]}
    )
    scaled = replace(
        system, connectors=tuple(replace(c, unit="mm/s", convert=True) for c in system.connectors)
    )
    path = write_ssp(checked(scaled), archives, tmp_path / "units.ssp", DefaultExperiment(0.0, 1.0))
    scratch = ScratchFolder()
    try:
        unpack(path, scratch.path / "system")
        inputs = Signals(TIME, {"in": 1000.0 * TIME}, {"in": "mm/s"})
        with open_plant(read_description(path), scratch.path / "system") as plant:
            found = plant.run({}, inputs, ["a.feed", "b.feed", "out"], TIME)
    finally:
        scratch.remove()
    assert np.max(np.abs(found["a.feed"] - TIME)) < 1e-12
    assert np.max(np.abs(found["b.feed"] - (2.0 * TIME + 0.5))) < 1e-12
    assert np.max(np.abs(found["out"] - 1000.0 * (2.0 * TIME + 0.5))) < 1e-9


def test_a_disturbance_is_added_to_its_connection(tmp_path: Path, fmi2: Path, fmi3: Path) -> None:
    """A constant 0.5 on the way to ``fast`` is what a larger offset of the connection is."""
    wires = (RING[0], replace(RING[1], offset=0.5, disturbance="d"))
    steady = Signals(np.array([0.0, 1.0]), {"d": np.full(2, 0.5)}, {"d": "1"})
    for parts in (
        [Part("fast", fmi2), Part("slow", fmi3)],
        [Part("fast", fmi2), Part("slow", fmi3, "coupled", 1e-3)],
    ):
        found = run(tmp_path, parts, wires, ["slow.y"], inputs=steady)
        assert np.max(np.abs(found["slow.y"] - ring(TIME)[:, 1])) < 1e-4


def test_jitter_makes_ticks_late_and_is_the_same_in_every_run(tmp_path: Path, fmi2: Path, fmi3: Path) -> None:
    """The plant's input steps at the ticks; with jitter none comes early, none later than it says."""
    period, most = 0.05, 0.02
    wires = [Wire("controller.feed", "plant.u"), Wire("plant.y", "controller.u", -1.0, 1.0)]

    def response(jitter: float) -> FloatArray:
        parts = [Part("plant", fmi2), Part("controller", fmi3, "sampled", period, jitter=jitter)]
        return run(tmp_path, parts, wires, ["controller.feed"], values={"plant.tau": 0.2}, time=fine)[
            "controller.feed"
        ]

    fine = np.linspace(0.0, 1.0, 2001)
    found = response(most)
    ticks = fine[1:][np.diff(found) != 0.0]
    late = np.mod(ticks + 1e-9, period)
    assert len(ticks) >= 18
    assert late.max() <= most + 1e-3  # two rows of the grid
    assert np.ptp(late) > 0.5 * most
    assert np.array_equal(found, response(most))
