"""The opened velocity loop against the rig's equations, linearised by hand."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from thsa_cosim.errors import FmuError
from thsa_cosim.fmu import Plant, SimulationFailure, linear
from thsa_cosim.fmu.failure import Status
from thsa_cosim.fmu.linear import OpenLoop, open_loop, state_names
from thsa_cosim.signals import Signals
from thsa_cosim.tune.margins import FREQUENCIES, margins, margins_by_control, margins_of

ROOT = Path(__file__).parents[2]
THSA, FEED_FORWARD = ROOT / "fmus" / "THSA.fmu", ROOT / "fmus" / "THSA_FeedForward.fmu"
pytestmark = pytest.mark.skipif(not THSA.exists(), reason="fmus/THSA.fmu has not been exported")
GAINS = {"velocityController.K_p": 0.363, "velocityController.K_i": 2.98}


def opened(path: Path, load: float, more: dict[str, float] | None = None, **changes: object) -> OpenLoop:
    """The loop while sliding at 9 mm/s at -30 degC under ``load`` [N]."""
    time = 0.001 * np.arange(1201)
    inputs = {
        "v_cmd": np.minimum(0.03 * time, 0.009),
        "F_load": np.full(1201, load),
        "T_amb": np.full(1201, -30.0),
    }
    values = {**GAINS, **(more or {})}
    with Plant.open(path) as plant:
        description = dataclasses.replace(plant.description, **changes)
        names = state_names(description)
        run = plant.run(values, Signals(time, inputs), names, time)
        return open_loop(
            description,
            plant.folder,
            values=values,
            inputs={"v_cmd": 0.009, "F_load": load, "T_amb": -30.0},
            time=1.2,
            states=np.array([run[name][-1] for name in names]),
            signal="velocityController.y",
            gains=list(GAINS),
        )


def by_hand(omega: np.ndarray) -> np.ndarray:
    """L = (K_p + K_i/s) w_m/i_ref of RIG.md while sliding against the load: friction leaves its viscous part.

    Torque on the motor -> speed through J, b_m and, over the gear, the spring k_s, d_s to M and b_n.
    """
    t, s = -30.0, 1j * omega
    k, i = 10e-3 / (2 * np.pi), 30.0
    resistance = 1.2 + 3e-2 * t + 7e-5 * t**2 - 5e-6 * t**3
    constant = np.sqrt(1.5) * 4 * (0.1 + 6e-5 * t - 4e-6 * t**2)
    b_m = 4e-5 + 2e-8 * t + 1e-8 * t**2 + 1e-10 * t**3
    b_g, b_n = -6e-7 + 1.8e-7 * t, 4e4 - 3e3 * t + 230 * t**2
    contact = 3e8 / s + 5e5  # force per relative speed
    behind = 200.0 * s + b_n
    seen = k**2 * contact * behind / (contact + behind) + b_g  # torque per speed at the screw
    mechanics = 1.0 / (2e-3 * s + b_m + seen / i**2)
    controller = 4.0 + 1000.0 / s
    current = controller / (controller + resistance + 2e-3 * s + constant**2 * mechanics)
    return (0.363 + 2.98 / s) * current * constant * mechanics


def test_the_loop_is_that_of_the_equations() -> None:
    loop = opened(THSA, 55e3)
    omega = np.logspace(-1, 4, 60)
    assert loop.derivatives == "directional"
    assert loop.response(omega) == pytest.approx(by_hand(omega), rel=2e-4)
    found = margins(loop)
    expected = margins_of(FREQUENCIES, by_hand(FREQUENCIES))
    assert found.phase_margin == pytest.approx(expected.phase_margin, abs=0.05)
    assert found.bandwidth == pytest.approx(expected.bandwidth, rel=1e-3)
    assert found.gain_margin == expected.gain_margin == np.inf


def test_differences_serve_where_an_fmu_gives_no_derivatives() -> None:
    loop = opened(THSA, 55e3, capabilities={"providesDirectionalDerivative": False})
    omega = np.logspace(0, 3.5, 40)
    assert loop.derivatives == "differences"
    assert loop.response(omega) == pytest.approx(by_hand(omega), rel=2e-3)


def test_python_control_reads_the_same_margins() -> None:
    pytest.importorskip("control")
    loop = opened(THSA, -55e3)  # aiding: slowly unstable when opened
    response = loop.response(FREQUENCIES)
    ours, theirs = margins(loop), margins_by_control(FREQUENCIES, response)
    assert margins(loop, "python-control") == theirs
    assert ours.phase_margin == pytest.approx(theirs.phase_margin, abs=0.1)
    assert ours.gain_margin == pytest.approx(theirs.gain_margin, rel=0.02)


def test_a_loop_that_is_unstable_when_closed_has_negative_margins() -> None:
    unstable = OpenLoop(("x",), np.array([[1.0]]), np.array([1.0]), np.array([-0.5]), "directional")
    assert margins(unstable).phase_margin <= 0.0
    stable = dataclasses.replace(unstable, c=np.array([-2.0]))
    assert margins(stable).phase_margin == pytest.approx(60.0, abs=0.1)


@pytest.mark.skipif(not FEED_FORWARD.exists(), reason="fmus/THSA_FeedForward.fmu has not been exported")
def test_what_is_fed_forward_does_not_return_through_the_loop() -> None:
    omega = np.logspace(-1, 4, 40)
    assert opened(FEED_FORWARD, 55e3).response(omega) == pytest.approx(by_hand(omega), rel=2e-4)


def test_a_gain_that_does_not_move_the_signal_is_a_failure_of_the_simulation() -> None:
    with pytest.raises(SimulationFailure, match="no gain moves"):
        _with_gains(["sensor.tau_v"])


def _with_gains(gains: list[str]) -> OpenLoop:
    with Plant.open(THSA) as plant:
        n = plant.description.states
        return open_loop(
            plant.description,
            plant.folder,
            values={**GAINS, "sensor.tau_v": 0.01},
            inputs={"T_amb": -30.0},
            time=0.0,
            states=np.zeros(n),
            signal="velocityController.y",
            gains=gains,
        )


def test_an_fmu_that_hides_its_states_cannot_be_linearised() -> None:
    with Plant.open(THSA) as plant, pytest.raises(FmuError, match="which variables its states are"):
        state_names(dataclasses.replace(plant.description, state_references=()))


@pytest.mark.parametrize("load", [0.0, 55e3])
def test_derivatives_of_the_fmu_and_differences_open_the_same_loop(
    load: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    exact = opened(THSA, load)
    with Plant.open(THSA) as plant:
        monkeypatch.setattr(linear, "_refusing", {plant.description.sha256})
    by_differences = opened(THSA, load)
    assert by_differences.b is not exact.b
    omega = np.logspace(-2, 4, 60)
    assert by_differences.response(omega) == pytest.approx(exact.response(omega), rel=2e-5)
    assert by_differences.a == pytest.approx(exact.a, rel=1e-5, abs=1e-6 * abs(exact.a).max())


def test_an_fmu_that_refuses_is_linearised_by_differences(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(linear, "_refusing", set())
    exact = opened(THSA, 55e3)

    def refuse(*_: object) -> None:
        raise SimulationFailure(Status.FMI_ERROR, "cannot be a known of a derivative")

    monkeypatch.setattr(linear._Point, "sensitivities", refuse)
    omega = np.logspace(-2, 4, 60)
    assert opened(THSA, 55e3).response(omega) == pytest.approx(exact.response(omega), rel=2e-5)
    assert len(linear._refusing) == 1
