"""Torque constant that falls with the current."""

import numpy as np

from thsa_cosim.diagnosis.catalogue.effect import Connectors, Effect, EffectParameter, Values, Variant
from thsa_cosim.signals import FloatArray


def fall(p: Values, at: Connectors) -> FloatArray:
    """-a i^2 - b |i|, relative."""
    return -p["a"] * at["i_q"] ** 2 - p["b"] * np.abs(at["i_q"])


def fraction(p: Values, at: Connectors) -> FloatArray:
    """1/(1 + a i^2 + b |i|) - 1, relative."""
    return np.asarray(1.0 / (1.0 + p["a"] * at["i_q"] ** 2 + p["b"] * np.abs(at["i_q"])) - 1.0)


BY_SQUARE = EffectParameter("a", "1/I^2", 0.02, "fall per square of the current", lower=0.0)
BY_AMOUNT = EffectParameter("b", "1/I", 0.02, "fall per current", lower=0.0)
BACK_EMF = EffectParameter(
    "r_e", "1", 1.0, "share of the fall in the back-EMF", role="shape", lower=0.0, upper=1.0, starts=(0.0,)
)

EFFECT = Effect(
    name="torque-constant-saturation",
    title="Torque constant that falls with the current",
    physics="K_t (1 - a i^2), or K_t (1 - b |i|); where it saturates strongly K_t/(1 + a i^2), or K_t/(1 + b |i|)",
    source="Bianchi and Bolognani, IET Electr. Power Appl. 1 (2007): saturation of PM machines;"
    " Froelich, Elektrotechnische Zeitschrift 2 (1881): magnetization as a fraction",
    signature="current beyond proportion at high torque, with or against the load alike",
    variants=(
        Variant("TorqueConstantEffect", "TorqueConstantSaturation", (BY_SQUARE, BACK_EMF), law=fall),
        Variant("TorqueConstantEffect", "TorqueConstantSaturation", (BY_AMOUNT, BACK_EMF), law=fall),
        Variant(
            "TorqueConstantEffect", "FroelichSaturation", (BY_SQUARE, BACK_EMF), law=fraction, instead=True
        ),
        Variant(
            "TorqueConstantEffect", "FroelichSaturation", (BY_AMOUNT, BACK_EMF), law=fraction, instead=True
        ),
    ),
)
