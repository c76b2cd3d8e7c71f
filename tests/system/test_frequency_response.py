"""Loop transfer functions measured on running systems, against those of discrete and continuous closed forms."""

from pathlib import Path

import numpy as np
import pytest
from fmu_sources import build

from thsa_cosim.fmu import SimulationFailure
from thsa_cosim.fmu.description import DefaultExperiment
from thsa_cosim.signals import Signals
from thsa_cosim.system import SystemPlant
from thsa_cosim.system.assemble import Part, Wire, assemble
from thsa_cosim.system.frequency_response import FrequencyResponse, loop_response
from thsa_cosim.system.write import write_ssp
from thsa_cosim.tune.margins import margins_of

TAU, INTERVAL = 0.05, 0.01
STEADY = Signals(np.array([0.0, 1.0]), {}, {})


def measured(folder: Path, controller: Part, gain: float, interval: float = INTERVAL) -> FrequencyResponse:
    """A lag of time constant TAU under a proportional controller, whose ``feed`` is its input."""
    wires = [
        Wire("controller.feed", "plant.u"),
        Wire("plant.y", "controller.u", -gain, gain, disturbance="d"),
    ]
    plant = Part("plant", build.lag2())
    system, archives = assemble("loop", [controller, plant], wires, {})
    path = write_ssp(system, archives, folder / "loop.ssp", DefaultExperiment(0.0, 1.0))
    with SystemPlant.open(path) as opened:
        assert "d" in [v.name for v in opened.description.inputs]
        return loop_response(
            opened,
            {"plant.tau": TAU},
            STEADY,
            target="controller.u",
            disturbance="d",
            at=0.5,
            interval=interval,
            amplitude=0.1,
            tolerance=1e-9,
        )


@pytest.mark.parametrize("late", [0.0, 0.5, 1.0])
def test_a_sampled_loop_has_the_margins_of_its_pulse_transfer_function(tmp_path: Path, late: float) -> None:
    """Zero-order hold, delay of ``late`` samples: modified z-transform of the lag (Jury, 1964)."""
    gain = 3.0  # far enough from the stability limit of one sample more that transients end within a period
    controller = Part("controller", build.lag3(), "sampled", INTERVAL, late * INTERVAL)
    found = measured(tmp_path, controller, gain)
    z = np.exp(1j * found.omega * INTERVAL)
    pole, part = np.exp(-INTERVAL / TAU), np.exp(-(1.0 - late) * INTERVAL / TAU)
    exact = gain * ((1.0 - part) * z + part - pole) / (z * (z - pole))
    assert np.max(np.abs(found.response - exact) / np.abs(exact)) < 1e-4
    assert found.distortion < 1e-6
    own, closed = margins_of(found.omega, found.response), margins_of(found.omega, exact)
    assert own.phase_margin == pytest.approx(closed.phase_margin, abs=0.1)
    assert own.bandwidth == pytest.approx(closed.bandwidth, rel=1e-3)


def test_a_loop_integrated_as_one_has_the_continuous_transfer_function(tmp_path: Path) -> None:
    interval = 2.5e-3  # up to 126 rad/s are compared; the corner is at 20
    found = measured(tmp_path, Part("controller", build.lag2()), 5.0, interval)
    slow = found.omega < 0.05 * 2.0 * np.pi / interval
    exact = 5.0 / (1.0 + 1j * found.omega * TAU)
    assert np.max(np.abs(found.response[slow] - exact[slow])) < 0.02


def test_an_unstable_loop_is_said_to_be_so(tmp_path: Path) -> None:
    controller = Part("controller", build.lag3(), "sampled", INTERVAL, INTERVAL)
    with pytest.raises(SimulationFailure, match="unstable, or has not settled"):
        measured(tmp_path, controller, 12.0)
