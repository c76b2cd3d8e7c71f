"""Viscous friction that levels off with speed."""

import numpy as np

from thsa_cosim.diagnosis.catalogue.effect import Connectors, Effect, EffectParameter, Values, Variant
from thsa_cosim.signals import FloatArray


def friction(p: Values, at: Connectors) -> FloatArray:
    """dF (1 - exp(-(v/v_0)^2)) sgn(v)."""
    return np.asarray(-p["dF"] * np.expm1(-((at["v"] / p["v_0"]) ** 2)) * at["s"])


EFFECT = Effect(
    name="shear-thinning",
    title="Viscous friction that levels off with speed",
    physics="F = dF (1 - exp(-(v/v_0)^2)) sgn(v): grease that gives way as it is sheared faster",
    source="Cousseau, Bjorling, Graca, Campos, Seabra, Larsson, Tribology International 53 (2012) 53: film in grease",
    signature="friction grows at low speed and hardly at high speed, in both directions",
    variants=(
        Variant(
            interface="FrictionEffect",
            block="ShearThinning",
            parameters=(
                EffectParameter("dF", "F", 0.02, "friction at high speed above that at low speed", lower=0.0),
                EffectParameter(
                    "v_0",
                    "V",
                    0.15,
                    "speed at which it levels off",
                    role="shape",
                    lower=0.01,
                    upper=0.7,
                    starts=(0.05, 0.15, 0.4),
                ),
            ),
            law=friction,
        ),
    ),
)
