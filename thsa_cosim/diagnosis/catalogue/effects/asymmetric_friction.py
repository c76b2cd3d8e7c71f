"""Friction that differs with the direction of motion."""

import numpy as np

from thsa_cosim.diagnosis.catalogue.effect import Connectors, Effect, EffectParameter, Values, Variant
from thsa_cosim.signals import FloatArray


def asymmetry(p: Values, at: Connectors) -> FloatArray:
    """dF |sgn(v)| + db |v|."""
    return p["dF"] * np.abs(at["s"]) + p["db"] * at["v"] * at["s"]


EFFECT = Effect(
    name="asymmetric-friction",
    title="Friction that differs with the direction of motion",
    physics="F = dF |sgn(v)| + db |v|: Coulomb friction F_C +- dF and viscous b +- db",
    source="Janot, Gautier, Brunot, EMPS reference models (2019)",
    signature="offset of the current that vanishes at rest and changes with the direction",
    variants=(
        Variant(
            interface="FrictionEffect",
            block="AsymmetricFriction",
            parameters=(
                EffectParameter("dF", "F", 0.01, "half the difference of Coulomb friction"),
                EffectParameter("db", "F/V", 0.01, "half the difference of the viscous coefficient"),
            ),
            law=asymmetry,
        ),
    ),
)
