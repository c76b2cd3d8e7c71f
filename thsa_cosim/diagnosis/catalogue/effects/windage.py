"""Drag with the square of the motor's speed."""

from thsa_cosim.diagnosis.catalogue.effect import Connectors, Effect, EffectParameter, Values, Variant
from thsa_cosim.signals import FloatArray


def drag(p: Values, at: Connectors) -> FloatArray:
    """b_q v^2 sgn(v)."""
    return p["b_q"] * at["v"] ** 2 * at["s"]


EFFECT = Effect(
    name="windage",
    title="Drag with the square of the motor's speed",
    physics="tau = b_q w^2 sgn(w)",
    source="equation 5 of the article (b_q); Vrancik, NASA TN D-4849 (1968)",
    signature="current at high speed beyond the viscous part",
    variants=(
        Variant(
            interface="FrictionEffect",
            block="Windage",
            parameters=(EffectParameter("b_q", "F/V^2", 0.02, "quadratic coefficient", lower=0.0),),
            slots=("motor", "guide"),
            law=drag,
        ),
    ),
)
