"""Voltage that the inverter's dead time takes."""

import numpy as np

from thsa_cosim.diagnosis.catalogue.effect import Connectors, Effect, EffectParameter, Values, Variant
from thsa_cosim.signals import FloatArray


def voltage(p: Values, at: Connectors) -> FloatArray:
    """-U_d sgn(i_q), a line within +-i_r."""
    return -p["U_d"] * np.clip(at["i_q"] / p["i_r"], -1.0, 1.0)


#: Of a ripple of six periods per pole pair, its starts the usual numbers of them.
PERIODS = EffectParameter(
    "n",
    "1",
    6.0,
    "periods of the ripple per revolution",
    role="shape",
    lower=3.0,
    upper=144.0,
    starts=tuple(6.0 * pairs for pairs in (1, 2, 3, 4, 5, 6, 7, 8, 10, 12)),
)
RIPPLE = (
    EffectParameter("u_s", "U", 0.1, "amplitude of the ripple, sine part"),
    EffectParameter("u_c", "U", 0.1, "amplitude of the ripple, cosine part"),
    PERIODS,
)

EFFECT = Effect(
    name="inverter-dead-time",
    title="Voltage that the inverter's dead time takes",
    physics="u = u_q - (U_d + u_6 sin(n phi + phase)) sgn(i_q), n six times the pole pairs",
    source="Jeong and Park, IEEE Trans. Ind. Electron. 38 (1991) 108",
    signature="voltage beyond R i and back-EMF that follows the current's sign and not its size",
    variants=(
        Variant(
            interface="VoltageEffect",
            block="InverterDeadTime",
            parameters=(
                EffectParameter("U_d", "U", 0.5, "voltage", lower=0.0),
                EffectParameter(
                    "i_r",
                    "I",
                    0.02,
                    "half width of the sign",
                    role="shape",
                    lower=0.001,
                    upper=1.0,
                    starts=(0.02, 0.2),
                ),
            ),
            law=voltage,
        ),
        Variant(
            interface="VoltageEffect",
            block="InverterDeadTime",
            parameters=RIPPLE,
            beside=True,
        ),
    ),
)
