"""FMI 3.0 clocks that tick by time, Event Mode in Co-Simulation, Configuration Mode."""

from pathlib import Path

import numpy as np
import pytest
from fmu_sources.build import LAG3, clock3, library, write_fmu

from thsa_cosim.errors import ParameterError
from thsa_cosim.fmu import Plant, read_description
from thsa_cosim.fmu.clocks import read_clocks
from thsa_cosim.fmu.inputs import input_modes
from thsa_cosim.signals import FloatArray, Signals

TICKS = 0.1 + 0.2 * np.arange(5)
TIME = np.linspace(0.0, 0.99, 100)
U = np.interp(TIME, [0.0, 0.2, 0.6, 0.99], [2.0, 2.0, 0.5, 0.5])


def expected(time: FloatArray, sums: FloatArray) -> FloatArray:
    """x of dx/dt = s - x, x(0) = 0, where s becomes ``sums[k]`` at tick k: a sum of steps."""
    steps = np.diff(sums, prepend=0.0)
    late = time[:, None] - TICKS
    return np.where(late > 0.0, steps * (1.0 - np.exp(-late)), 0.0).sum(axis=1)


@pytest.mark.parametrize("kind", ["co-simulation", "model-exchange"])
def test_clocks_tick_when_they_are_to(kind: str) -> None:
    """The FMU refuses a step across a tick, and a tick at any other time."""
    turn = (TIME >= 0.45).astype(float)
    inputs = Signals(TIME, {"u": U, "turn": turn})
    with Plant.open(clock3(), kind=kind) as plant:  # type: ignore[arg-type]
        found = plant.run({}, inputs, ["x", "s", "n", "early"], TIME, tolerance=1e-9)
    at_ticks = np.interp(TICKS, TIME, U) * np.where(TICKS >= 0.45, -1.0, 1.0)
    if kind == "co-simulation":  # the mean over the step that ends at the tick
        before = np.interp(TICKS - 0.005, TIME, U)
        at_ticks = before * np.where(TICKS >= 0.45, -1.0, 1.0)
    sums = np.cumsum(at_ticks)
    beside = np.abs(TIME[:, None] - TICKS).min(axis=1) > 1e-6
    wanted = np.array([sums[int(np.sum(t > TICKS)) - 1] if t > TICKS[0] else 0.0 for t in TIME])
    np.testing.assert_allclose(found["s"][beside], wanted[beside], atol=1e-12)
    np.testing.assert_allclose(found["x"], expected(TIME, sums), atol=1e-6)
    assert found["n"][-1] == 5.0  # each countdown of 0.05 s ended, the last one at 0.95 s
    assert found["n"][14] == 0.0
    assert found["n"][16] == 1.0
    assert found["early"][-1] == (1.0 if kind == "co-simulation" else 0.0)  # x passed 1 within a step


def test_a_coarse_grid_meets_every_tick_too() -> None:
    time = np.array([0.0, 0.37, 0.9])
    with Plant.open(clock3()) as plant:
        found = plant.run({"u": 1.0}, None, ["s", "n"], time)
    assert found["s"].tolist() == [0.0, 2.0, 5.0]
    assert found["n"].tolist() == [0.0, 2.0, 4.0]


def test_structural_parameters_are_set_in_configuration_mode() -> None:
    for kind in ("co-simulation", "model-exchange"):
        with Plant.open(clock3(), kind=kind, reuse="reset") as plant:  # type: ignore[arg-type]
            for order in (3.0, 1.0):
                found = plant.run({"order": order, "u": 1.0, "gain": 2.0}, None, ["s"], TIME)
                assert found["s"][-1] == pytest.approx(5 * 2.0 * order)


def test_sizes_of_arrays_keep_their_start_values(tmp_path: Path) -> None:
    size = (
        '<UInt64 name="m" valueReference="14" causality="structuralParameter" variability="fixed" start="2"/>'
    )
    xml = LAG3.format(updates="false").replace('<Dimension start="2"/>', '<Dimension valueReference="14"/>')
    xml = xml.replace(" </ModelVariables>", f"  {size}\n </ModelVariables>")
    path = write_fmu(tmp_path / "sized.fmu", xml, library("lag3.c"), "lag3")
    assert "vector[2]" in read_description(path).variables
    with Plant.open(path) as plant, pytest.raises(ParameterError, match="m is the length of an array"):
        plant.run({"m": 3.0}, None, ["y"], TIME)


def test_clocks_are_read_with_their_intervals() -> None:
    clocks = read_description(clock3()).clocks
    assert [(c.name, c.variability, c.interval, c.shift) for c in clocks] == [
        ("sample", "constant", 0.2, 0.1),
        ("wait", "countdown", None, 0.0),
    ]
    counted = b"""<fmiModelDescription><ModelVariables><Clock name="c" valueReference="1" causality="input"
      intervalVariability="fixed" intervalCounter="3" shiftCounter="1" resolution="4"/>
      <Clock name="t" valueReference="2" causality="input" intervalVariability="triggered"/>
      <Clock name="o" valueReference="3" causality="output" intervalVariability="triggered"/></ModelVariables>
      </fmiModelDescription>"""
    fixed, triggered = read_clocks(counted)
    assert (fixed.interval, fixed.shift, fixed.is_timed) == (0.75, 0.25, True)
    assert not triggered.is_timed
    assert "intermediate" not in input_modes(read_description(clock3()), [])
