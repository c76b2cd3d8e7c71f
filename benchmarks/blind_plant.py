"""A second plant of the rig for the blind benchmark: written from its equations alone, stepped by Moreau and Jean.

Friction is a force in a set, not a function of speed: in every step the momentum balance of the shaft and of
the nut is solved with the speed at the end of the step as unknown, which is zero exactly while a force inside
the set can hold it (Moreau 1988, Jean 1999). All else is the implicit midpoint rule, which takes the contact
and the current loop at any stiffness. What the declared physics lacks comes as `Undeclared`, neutral by default.

SI units; angles in rad, temperatures in degC.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from blind_steps import OUTPUTS, Rig, Undeclared, advance, advance_declared
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

STEP = 2e-5  # s
RECORD_EVERY = 10  # steps: 0.2 ms, of which the sensors see every fifth
_NEUTRAL = Undeclared()
#: What acts before or after the compiled loop, which need not know of it.
_AROUND = {
    name: getattr(_NEUTRAL, name)
    for name in ("command_delay", "velocity_delay", "velocity_gain", "scale_error", "scale_pitch")
}


class Wave(NamedTuple):
    """A signal linear between `times` (n,) and constant outside."""

    times: FloatArray
    values: FloatArray

    def delayed(self, seconds: float) -> Wave:
        return Wave(self.times + seconds, self.values)


def declared(temperature: float) -> Rig:
    """The rig of the drawing at `temperature` in degC (tables II and III of the article)."""
    t = temperature
    return Rig(
        R_s=1.2 + 3e-2 * t + 7e-5 * t**2 - 5e-6 * t**3,
        psi_pm=0.1 + 6e-5 * t - 4e-6 * t**2,
        T_fm=1e-2 * math.exp(-4e-2 * t) + 3e-2 * math.exp(9e-3 * t),
        b_m=4e-5 + 2e-8 * t + 1e-8 * t**2 + 1e-10 * t**3,
        T_fg=11.0 - 0.25 * t + 2e-4 * t**2,
        b_g=-6e-7 + 1.8e-7 * t,
        F_fn=2.7e3 + 37.0 * t - 1.4 * t**2 - 0.07 * t**3,
        b_n=4e4 - 3e3 * t + 230.0 * t**2,
    )


def simulate(
    rig: Rig, command: Wave, load: Wave, rows: int, undeclared: Undeclared | None = None
) -> dict[str, FloatArray]:
    """What ideal sensors show at 1, 2, ... `rows` ms: v, x, w_m, i_q, u_q, each (rows,) in SI units."""
    extra = undeclared or Undeclared()
    driven = command.delayed(extra.command_delay)
    rest = (*driven, *load, rows, STEP, RECORD_EVERY)
    looped = Undeclared(*map(float, extra))._replace(**_AROUND)
    own = Rig(*map(float, rig))
    fine = advance_declared(own, *rest) if looped == _NEUTRAL else advance(own, looped, *rest)
    per_row = (fine.shape[0] - 1) // rows
    found = dict(zip(OUTPUTS, fine[per_row::per_row].T.copy(), strict=True))
    if extra.velocity_delay:
        seconds = np.arange(fine.shape[0]) * STEP * RECORD_EVERY
        found["v"] = np.interp(seconds[per_row::per_row] - extra.velocity_delay, seconds, fine[:, 0])
    found["v"] *= extra.velocity_gain
    if extra.scale_error:
        found["x"] += extra.scale_error * np.sin(2.0 * np.pi * found["x"] / extra.scale_pitch)
    return found
