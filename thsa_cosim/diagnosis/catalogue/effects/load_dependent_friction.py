"""Friction in proportion to the load that the pair carries."""

import numpy as np

from thsa_cosim.diagnosis.catalogue.effect import Connectors, Effect, EffectParameter, Values, Variant
from thsa_cosim.signals import FloatArray


def friction(p: Values, at: Connectors) -> FloatArray:
    """mu |N| sgn(v)."""
    return p["mu"] * np.abs(at["N"]) * at["s"]


EFFECT = Effect(
    name="load-dependent-friction",
    title="Friction in proportion to the load that the pair carries",
    physics="F = mu |N| sgn(v)",
    source="Coulomb; roller-screw efficiency, e.g. Lemor, SNAME 1996",
    signature="current grows with the load beyond the declared lossless transmission",
    variants=(
        Variant(
            interface="FrictionEffect",
            block="LoadDependentFriction",
            parameters=(EffectParameter("mu", "1", 0.01, "friction per load", lower=0.0, upper=0.9),),
            law=friction,
        ),
    ),
)
