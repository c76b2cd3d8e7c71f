"""Cogging torque of the motor."""

import numpy as np

from thsa_cosim.diagnosis.catalogue.effect import Connectors, Effect, EffectParameter, Values, Variant
from thsa_cosim.signals import FloatArray


def torque(p: Values, at: Connectors) -> FloatArray:
    """a_s sin(n z) + a_c cos(n z), and a_s2, a_c2 likewise with 2 n."""
    turn = p["n"] * at["z"]
    first = p["a_s"] * np.sin(turn) + p["a_c"] * np.cos(turn)
    return np.asarray(first + p["a_s2"] * np.sin(2.0 * turn) + p["a_c2"] * np.cos(2.0 * turn))


PERIODS = EffectParameter(
    "n",
    "1",
    1.0,
    "periods per revolution",
    role="shape",
    lower=0.5,
    upper=100.0,
    starts=(4.0, 6.0, 8.0, 12.0, 24.0, 36.0, 48.0),
    scanned=True,
)

EFFECT = Effect(
    name="cogging",
    title="Cogging torque of the motor",
    physics="tau = a sin(n phi + phase) and its second harmonic, without current",
    source="Hendershot and Miller, Design of Brushless Permanent-Magnet Machines (2010)",
    signature="ripple of speed and current at a multiple of the rotor's angle, at every load",
    variants=(
        Variant(
            interface="FrictionEffect",
            block="Cogging",
            parameters=(
                EffectParameter("a_s", "F", 0.01, "amplitude, sine part"),
                EffectParameter("a_c", "F", 0.01, "amplitude, cosine part"),
                PERIODS,
            ),
            slots=("motor",),
            law=torque,
        ),
        Variant(
            interface="FrictionEffect",
            block="Cogging",
            parameters=(
                EffectParameter("a_s2", "F", 0.005, "amplitude of the second harmonic, sine part"),
                EffectParameter("a_c2", "F", 0.005, "amplitude of the second harmonic, cosine part"),
                PERIODS,
            ),
            slots=("motor",),
            law=torque,
            beside=True,
        ),
    ),
)
