"""Stribeck friction: breakaway friction that decays as sliding begins."""

import numpy as np

from thsa_cosim.diagnosis.catalogue.effect import Connectors, Effect, EffectParameter, Values, Variant
from thsa_cosim.signals import FloatArray


def breakaway(p: Values, at: Connectors) -> FloatArray:
    """dF exp(-(|v|/v_S)^n) sgn(v)."""
    return np.asarray(p["dF"] * np.exp(-((np.abs(at["v"]) / p["v_S"]) ** p["n"])) * at["s"])


def fraction(p: Values, at: Connectors) -> FloatArray:
    """dF / (1 + (v/v_S)^2) sgn(v)."""
    return np.asarray(p["dF"] / (1.0 + (at["v"] / p["v_S"]) ** 2) * at["s"])


BREAKAWAY = EffectParameter("dF", "F", 0.02, "breakaway above Coulomb friction", lower=0.0)
SPEED = EffectParameter(
    "v_S", "V", 0.1, "Stribeck speed", role="shape", lower=0.003, upper=0.3, starts=(0.02, 0.06, 0.2)
)

EFFECT = Effect(
    name="stribeck",
    title="Stribeck friction: breakaway friction that decays as sliding begins",
    physics="F = (F_b - F_C) exp(-(|v|/v_S)^n) sgn(v), or (F_b - F_C)/(1 + (v/v_S)^2) sgn(v)",
    source="equation 5 of the article; Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30 (1994) 1083;"
    " Hess, Soom, ASME Journal of Tribology 112 (1990) 147",
    signature="current rises at low speed and at each start, in both directions",
    variants=(
        Variant(
            interface="FrictionEffect",
            block="Stribeck",
            parameters=(
                BREAKAWAY,
                SPEED,
                EffectParameter("n", "1", 1.5, "exponent", role="shape", lower=0.5, upper=3.0, starts=(1.5,)),
            ),
            law=breakaway,
        ),
        Variant("FrictionEffect", "HessSoom", (BREAKAWAY, SPEED), law=fraction, instead=True),
    ),
)
