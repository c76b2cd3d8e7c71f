"""Plants that step freely: the shipped FMUs against themselves, stepped from sample to sample."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from fmu_sources import build

from thsa_cosim.fmu import Plant, SimulationFailure, Status
from thsa_cosim.fmu.trajectory import FUNCTION, LOOSEST, SAFETY, is_offered
from thsa_cosim.signals import FloatArray, Signals

FMUS = Path(__file__).parents[2] / "fmus"
OUTPUTS = ("w_m", "i_q", "u_q")
TIME = np.arange(2001) * 1e-3


def command(held: bool) -> Signals:
    """Ramps to 120 rad/s and back through zero, sampled every 4 ms and held, or linear between samples."""
    shape = np.interp(TIME, [0.1, 0.3, 0.9, 1.3, 1.8], [0.0, 120.0, 120.0, -80.0, 0.0])
    if held:
        shape = np.repeat(shape[::4], 4)[: len(TIME)]
    return Signals(
        TIME, {"w_cmd": shape, "T_amb": np.full_like(TIME, -30.0)}, {}, frozenset({"w_cmd"} if held else ())
    )


@pytest.fixture(scope="module", params=["", "fmi3"], ids=["fmi2", "fmi3"])
def pair(request: pytest.FixtureRequest) -> Iterator[tuple[Plant, Plant]]:
    fmu = FMUS / request.param / "Motor.fmu"
    with Plant.open(fmu) as free, Plant.open(fmu, stepping="samples") as stepped:
        yield free, stepped


def off(found: Signals, expected: Signals) -> float:
    """Largest deviation over all signals, each relative to its range."""
    return max(float(np.abs(found[n] - expected[n]).max() / np.ptp(expected[n])) for n in found.names)


@pytest.mark.parametrize("held", [False, True], ids=["linear", "held"])
def test_free_steps_give_what_steps_from_sample_to_sample_give(pair: tuple[Plant, Plant], held: bool) -> None:
    free, stepped = pair
    inputs = command(held)
    expected = stepped.run({}, inputs, OUTPUTS, TIME, tolerance=1e-9)
    assert off(free.run({}, inputs, OUTPUTS, TIME, tolerance=1e-8), expected) < 1e-6
    assert off(free.run({}, inputs, OUTPUTS, TIME), expected) < 1e-4
    loose = free.run({}, inputs, OUTPUTS, TIME, tolerance=1e-2)
    tightest = free.run({}, inputs, OUTPUTS, TIME, tolerance=LOOSEST / SAFETY)
    assert all(np.array_equal(loose[n], tightest[n]) for n in OUTPUTS)


def test_other_output_times_give_the_same_signals(pair: tuple[Plant, Plant]) -> None:
    """Coarse, uneven and single output times: rows of one and the same solution."""
    free, _ = pair
    inputs = command(held=True)
    whole = free.run({}, inputs, OUTPUTS, TIME)
    picked = np.array([0, 1, 17, 500, 501, 1999, 2000])
    for rows in (picked, np.arange(0, 2001, 100), np.array([0])):
        part = free.run({}, inputs, OUTPUTS, TIME[rows])
        for name in OUTPUTS:
            np.testing.assert_allclose(part[name], whole[name][rows], rtol=0, atol=1e-4 * np.ptp(whole[name]))


def test_runs_repeat_bit_for_bit_and_keep_their_signals(pair: tuple[Plant, Plant]) -> None:
    free, _ = pair
    inputs = command(held=True)
    first = free.run({}, inputs, OUTPUTS, TIME)
    kept = first["w_m"].copy()
    free.run({"motor.J": 0.003}, inputs, OUTPUTS, TIME)
    again = free.run({}, inputs, OUTPUTS, TIME)
    np.testing.assert_array_equal(first["w_m"], kept)
    np.testing.assert_array_equal(again["w_m"], kept)
    assert first.units == {"w_m": "rad/s", "i_q": "A", "u_q": "V"}


def test_inputs_and_parameters_can_be_recorded(pair: tuple[Plant, Plant]) -> None:
    free, _ = pair
    inputs = command(held=True)
    found = free.run({"motor.J": 0.003}, inputs, ["w_cmd", "T_amb", "motor.J"], TIME)
    np.testing.assert_array_equal(found["w_cmd"], inputs["w_cmd"])
    assert (found["motor.J"] == 0.003).all()


def test_a_failure_is_a_discard_with_time_and_reason(pair: tuple[Plant, Plant]) -> None:
    free, stepped = pair
    wild = Signals(TIME, {"w_cmd": np.where(TIME < 1.0, 0.0, 1e300), "T_amb": np.full_like(TIME, -30.0)})
    for plant in (free, stepped):
        with pytest.raises(
            SimulationFailure, match=r"returned fmi\dDiscard at t = .* s: .* at time"
        ) as caught:
            plant.run({}, wild, OUTPUTS, TIME)
        assert caught.value.status is Status.FMI_DISCARD
        assert np.isfinite(
            plant.run({}, command(held=True), OUTPUTS, TIME)["w_m"]
        ).all()  # the plant lives on


def test_how_inputs_are_given_is_respected(pair: tuple[Plant, Plant]) -> None:
    """Who asks for inputs that are held over a communication step gets communication steps."""
    free, stepped = pair
    inputs = command(held=False)
    free.input_mode = stepped.input_mode = "hold"
    try:
        a, b = (plant.run({}, inputs, OUTPUTS, TIME) for plant in pair)
    finally:
        free.input_mode = stepped.input_mode = None
    np.testing.assert_array_equal(a["w_m"], b["w_m"])


def test_the_progress_says_how_far_a_run_has_come(pair: tuple[Plant, Plant]) -> None:
    free, _ = pair
    free.run({}, command(held=False), OUTPUTS, TIME)
    assert free.progress[1] == pytest.approx(2.0)


@pytest.mark.parametrize("fmu", [build.lag2, build.lag3])
def test_other_fmus_are_stepped_through_their_samples(fmu: object) -> None:
    time = np.linspace(0.0, 1.0, 101)
    inputs = Signals(time, {"u": np.sin(7.0 * time)}, {"u": "m/s"})
    results: list[FloatArray] = []
    for stepping in ("free", "samples"):
        with Plant.open(fmu(), stepping=stepping) as plant:
            results.append(plant.run({}, inputs, ["y"], time)["y"])
            assert plant._instance is not None
            assert not is_offered(plant._instance)
            assert not plant._instance.library.exports(FUNCTION)
    np.testing.assert_array_equal(*results)


def test_a_run_ends_that_takes_more_steps_than_it_may(pair: tuple[Plant, Plant]) -> None:
    free, _ = pair
    inputs = command(held=False)
    whole = free.run({}, inputs, OUTPUTS, TIME)
    enough = free.run({}, inputs, OUTPUTS, TIME, most_steps=2000)
    assert all(np.array_equal(enough[n], whole[n]) for n in OUTPUTS)
    with pytest.raises(SimulationFailure, match="more internal steps than the run may take"):
        free.run({}, inputs, OUTPUTS, TIME, most_steps=40)
    again = free.run({}, inputs, OUTPUTS, TIME)
    assert all(np.array_equal(again[n], whole[n]) for n in OUTPUTS), "the limit was that of one run"
