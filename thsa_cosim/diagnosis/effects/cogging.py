"""Cogging torque of the motor."""

import numpy as np

from thsa_cosim.diagnosis.effect import Connectors, Effect, EffectParameter, Values, Variant
from thsa_cosim.signals import FloatArray


def torque(p: Values, at: Connectors) -> FloatArray:
    """a_s sin(n z) + a_c cos(n z)."""
    return np.asarray(p["a_s"] * np.sin(p["n"] * at["z"]) + p["a_c"] * np.cos(p["n"] * at["z"]))


EFFECT = Effect(
    name="cogging",
    title="Cogging torque of the motor",
    physics="tau = a sin(n phi + phase), without current",
    source="Hendershot and Miller, Design of Brushless Permanent-Magnet Machines (2010)",
    signature="ripple of speed and current at a multiple of the rotor's angle, at every load",
    variants=(
        Variant(
            interface="FrictionEffect",
            block="Cogging",
            parameters=(
                EffectParameter("a_s", "F", 0.01, "amplitude, sine part"),
                EffectParameter("a_c", "F", 0.01, "amplitude, cosine part"),
                EffectParameter(
                    "n",
                    "1",
                    1.0,
                    "periods per revolution",
                    role="shape",
                    lower=0.5,
                    upper=100.0,
                    starts=(4.0, 6.0, 8.0, 12.0, 24.0, 36.0, 48.0),
                    scanned=True,
                ),
            ),
            slots=("motor",),
            law=torque,
        ),
    ),
)
