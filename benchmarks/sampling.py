"""What sampling costs the velocity loop: margins measured on the running system, continuous and sampled at 1 kHz.

    python benchmarks/sampling.py

The loop is opened at the controller's measured speed, at steady motion (9 mm/s, -30 degC, 55 kN), with the gains that
`scenarios/system.toml` finds. One line each: gain margin, phase margin, bandwidth, distortion of the measurement.
"""

from pathlib import Path

import numpy as np

from thsa_cosim.signals import Signals
from thsa_cosim.system import SystemPlant
from thsa_cosim.system.assemble import Part, Wire, assembled
from thsa_cosim.system.frequency_response import FrequencyResponse, loop_response
from thsa_cosim.tune.margins import margins_of

FMUS = Path(__file__).parents[1] / "fmus"
WIRES = (
    Wire("controller.i_ref", "plant.i_ref"),
    Wire("plant.w_m", "controller.w_m", disturbance="w_disturbance"),
)
CONNECTORS = {"v_cmd": ["controller.v_cmd"], "F_load": ["plant.F_load"], "T_amb": ["plant.T_amb"]}
GAINS = {"controller.velocityController.K_p": 1.227, "controller.velocityController.K_i": 5.909}
STEADY = Signals(
    np.array([0.0, 0.3, 6.0]),
    {"v_cmd": np.array([0.0, 9e-3, 9e-3]), "F_load": np.full(3, 55e3), "T_amb": np.full(3, -30.0)},
    {"v_cmd": "m/s", "F_load": "N", "T_amb": "degC"},
)
MS = 1e-3
CASES = {
    "continuous": (None, 0.0, None),
    "1 kHz": (MS, 0.0, 0.5 * MS),
    "1 kHz, half a sample of delay": (MS, 0.5 * MS, 0.5 * MS),
    "1 kHz, a sample of delay": (MS, MS, MS),
}


def measured(sampling: float | None, delay: float, step: float | None) -> FrequencyResponse:
    """The loop at the controller's speed input; ``step``: communication step of the plant, s."""
    how = "continuous" if sampling is None else "sampled"
    controller = Part("controller", FMUS / "Controller.fmu", how, sampling, delay)
    plant = Part("plant", FMUS / "Plant.fmu", "continuous" if step is None else "coupled", step)
    path = assembled("sampling", [controller, plant], WIRES, CONNECTORS).path
    with SystemPlant.open(path) as opened:
        return loop_response(
            opened,
            GAINS,
            STEADY,
            target="controller.w_m",
            disturbance="w_disturbance",
            at=1.0,
            interval=MS,
            amplitude=1.0,
            tolerance=1e-7,
        )


def main() -> None:
    print(f"{'controller':32s} gain margin  phase margin  bandwidth  distortion")
    for name, case in CASES.items():
        found = measured(*case)
        read = margins_of(found.omega, found.response)
        print(
            f"{name:32s} {read.gain_margin:8.1f} dB {read.phase_margin:9.1f} deg {read.bandwidth:8.1f} Hz"
            f" {found.distortion:11.1e}"
        )


if __name__ == "__main__":
    main()
