"""Coulomb and viscous friction of the load, where an FMU without source has none, or one that cannot be set."""

import numpy as np

from thsa_cosim.diagnosis.catalogue.effect import Connectors, Effect, EffectParameter, Values, Variant
from thsa_cosim.signals import FloatArray


def friction(p: Values, at: Connectors) -> FloatArray:
    """F_C sgn(v) + b v."""
    return np.asarray(p["F_C"] * at["s"] + p["b"] * at["v"])


def _variant(parameter: EffectParameter, *, beside: bool) -> Variant:
    # Models with source declare these two at every place; at the load of a black box nobody does.
    return Variant(
        "FrictionEffect", "PlainFriction", (parameter,), slots=("load",), law=friction, beside=beside
    )


COULOMB = EffectParameter("F_C", "F", 0.02, "Coulomb friction", lower=0.0)
VISCOUS = EffectParameter("b", "F/V", 0.02, "viscous coefficient", lower=0.0)

EFFECT = Effect(
    name="plain-friction",
    title="Coulomb and viscous friction of the load",
    physics="F = F_C sgn(v) + b v",
    source="equation 5 of the article; Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30 (1994) 1083",
    signature="current with the sign of the motion, and in proportion to its speed, at every load",
    variants=(
        _variant(COULOMB, beside=False),
        _variant(VISCOUS, beside=False),
        _variant(VISCOUS, beside=True),
        _variant(COULOMB, beside=True),
    ),
)
