"""The recording of a first-order lag with noise, and the scenario that fits an FMU to it."""

from pathlib import Path

import numpy as np

from tests.fmu.test_plant import lag

TAU = 0.2
_SCENARIO = """
kind = "identify"
fmu = "{fmu}"
seed = 1

[recordings]
fit = ["run.csv"]
time = {{ column = "t", unit = "s" }}

[recordings.columns]
u = {{ column = "u", unit = "m/s" }}
y = {{ column = "y", unit = "m/s" }}

[cost]
error = "squared"

[cost.channels.y]
noise = {noise}

[[parameters]]
name = "tau"
variable = "tau"
lower = 0.05
upper = 0.5
unit = "s"
"""


def lag_scenario(folder: Path, fmu: Path, *, noise: float, further: str = "") -> Path:
    """The scenario's file in ``folder``, beside 2 s of the exact answer at ``TAU`` with white ``noise`` [m/s].

    ``further``: what else the scenario says, after its parameter tau.
    """
    time = np.linspace(0.0, 2.0, 401)
    u = np.interp(time, [0.0, 0.2, 0.5, 1.1, 1.5, 2.0], [0.0, 1.0, 1.0, -0.5, 0.2, 0.2])
    y = lag(time, u, TAU, 1.0) + noise * np.random.default_rng(0).standard_normal(401)
    table = np.column_stack([time, u, y])
    np.savetxt(folder / "run.csv", table, delimiter=",", header="t,u,y", comments="", fmt="%.9g")
    path = folder / "s.toml"
    path.write_text(_SCENARIO.format(fmu=fmu, noise=noise) + further)
    return path
