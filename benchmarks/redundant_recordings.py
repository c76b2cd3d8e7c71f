"""Recordings of redundant actuators of which one lane or one load path is not as its drawing says.

    python benchmarks/redundant_recordings.py FOLDER [UNIT]...

writes six recordings of each unit (default: all of `UNITS`) into a folder of its name: three to fit (lane A drives;
lane A is switched off, so that lane B drives; the primary load path is disconnected on the bench, so that the secondary
one carries), and three with other commands and loads to score. They are simulated at -30 degC with
``THSA.RedundantActuator`` and the effects' Modelica classes in its slots. Four declared parameters of every unit are a
few per cent off the drawing.
"""

import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from blind_schedules import ACCELERATION, LOAD_RATE, ramped

from thsa_cosim.export import export_fmu
from thsa_cosim.export.compile import native_platform
from thsa_cosim.fmu import Plant
from thsa_cosim.recordings.parquet_file import write_columns
from thsa_cosim.signals import FloatArray, Signals

PACKAGE = Path(__file__).parents[1] / "modelica" / "THSA"
NEVER, STEP = 1e9, 2e-3
SOURCE = """within ;
model Unit "Redundant actuator with effects that are neutral until a value says otherwise"
  extends THSA.RedundantActuator(
    redeclare THSA.Effects.Windage motorAEffect,
    redeclare THSA.Effects.Stribeck motorBEffect(v_S=10, n=2),
    redeclare THSA.Effects.TorqueConstantSaturation torqueBEffect,
    redeclare THSA.Effects.Backlash contactPrimaryEffect,
    redeclare THSA.Effects.LoadDependentFriction screwSecondaryEffect);
end Unit;
"""
#: What is off the drawing in every unit.
SCATTER = {
    "laneA.motor.psi_pm.a0": 0.102,
    "laneB.motor.R_s.a0": 1.21,
    "nut.F_fn.a0": 2.6e3,
    "primary.k_s": 3.1e8,
}
#: Start values of each unit.
UNITS: Mapping[str, Mapping[str, float]] = {
    "as_drawn": {},
    "lane_A_windage": {"motorAEffect.b_q": 6e-6},
    "lane_B_breakaway": {"motorBEffect.dF": 0.06},
    "lane_B_saturation": {"torqueBEffect.a": 6e-5},
    "lane_B_brake_drags": {"laneB.motor.T_fm.a0": 0.2},
    "primary_play": {"contactPrimaryEffect.gap": 6e-5},
    "secondary_friction": {"screwSecondaryEffect.mu": 0.03},
}
#: Columns of a file: output, factor to the column's unit, standard deviation of the noise and resolution in it.
SENSORS = {
    "velocity_mm_s": ("v", 1e3, 0.02, 5e-3),
    "position_mm": ("x", 1e3, 1e-3, 1e-3),
    "speed_A_rad_s": ("w_A", 1.0, 0.2, 0.05),
    "speed_B_rad_s": ("w_B", 1.0, 0.2, 0.05),
    "current_A_A": ("i_A", 1.0, 0.05, 0.01),
    "current_B_A": ("i_B", 1.0, 0.05, 0.01),
    "voltage_A_V": ("u_A", 1.0, 0.3, 0.1),
    "voltage_B_V": ("u_B", 1.0, 0.3, 0.1),
    "force_secondary_kN": ("F_2", 1e-3, 0.06, 5e-3),
}
#: Settings of a recording, constants of its file: from when lane A is off, the primary path open; the lock's force.
CONSTANTS = {
    "lane_A_off_s": "laneA.t_loss",
    "primary_open_s": "primary.t_rupture",
    "lock_N": "monitor.F_lock",
}
SETTINGS = {
    "lane_A": (NEVER, NEVER, 2e3),
    "lane_B": (-1.0, NEVER, 2e3),
    "secondary": (NEVER, 0.01, 1e6),
}


def schedule(part: str, setting: str) -> tuple[FloatArray, Signals]:
    """Times (n,) [s] and inputs of a recording: speeds from creep to full both ways, with and against loads."""
    random = np.random.default_rng([len(part), *setting.encode()])
    moves, loads = [], []
    time = 0.3
    for fast, load in zip((1.5, 7.0, 4.0), random.permutation([12e3, 45e3, -20e3]), strict=True):
        speed = 1e-3 * fast * random.uniform(0.85, 1.15)
        loads.append((time, float(load * random.uniform(0.8, 1.2))))
        for level, duration in ((speed, 1.0), (-speed, 1.0), (0.0, 0.4)):
            moves.append((time + 0.4, level))
            time += duration
    rows = round((time + 0.5) / STEP)
    times = np.arange(rows) * STEP
    inputs = {
        "v_cmd": np.interp(times, *ramped(ACCELERATION, 0.0, moves)),
        "F_load": np.interp(times, *ramped(LOAD_RATE, 0.0, loads)),
        "T_amb": np.full(rows, -30.0),
    }
    return times, Signals(times, inputs)


def record(plant: Plant, unit: str, part: str, setting: str, file: Path) -> None:
    """Simulate one recording and write it."""
    times, inputs = schedule(part, setting)
    constants = dict(zip(CONSTANTS, SETTINGS[setting], strict=True))
    values = {**SCATTER, **UNITS[unit], **{CONSTANTS[name]: value for name, value in constants.items()}}
    run = plant.run(values, inputs, tuple(name for name, *_ in SENSORS.values()), times, tolerance=1e-7)
    random = np.random.default_rng([len(unit), *f"{part}{setting}".encode()])
    columns = {
        "time_s": times,
        "velocity_command_mm_s": inputs["v_cmd"] * 1e3,
        "load_kN": inputs["F_load"] * 1e-3,
        "temperature_degC": inputs["T_amb"],
    }
    for column, (name, factor, noise, count) in SENSORS.items():
        reading = run[name] * factor + random.normal(0.0, noise, times.size)
        columns[column] = np.round(reading / count) * count
    columns |= {name: np.full_like(times, value) for name, value in constants.items()}
    write_columns(file, columns, {})


def main(arguments: list[str]) -> int:
    """Command line of this module."""
    folder, *units = arguments
    source = Path(folder) / "Unit.mo"
    source.parent.mkdir(parents=True, exist_ok=True)
    source.write_text(SOURCE, encoding="utf-8")
    fmu = export_fmu(
        str(source), package=PACKAGE, output=source.with_suffix(".fmu"), platforms=(native_platform().fmi3,)
    )
    with Plant.open(fmu) as plant:
        for unit in units or UNITS:
            own = Path(folder) / unit
            own.mkdir(exist_ok=True)
            for part in ("fit", "validate"):
                for setting in SETTINGS:
                    record(plant, unit, part, setting, own / f"{part}_{setting}.parquet")
            print(own)
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
