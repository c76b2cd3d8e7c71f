"""Drag that grows with a power of the motor's speed."""

import numpy as np

from thsa_cosim.diagnosis.catalogue.effect import Connectors, Effect, EffectParameter, Values, Variant
from thsa_cosim.signals import FloatArray


def drag(p: Values, at: Connectors) -> FloatArray:
    """b_q v^2 (|v|/v_r)^(n-2) sgn(v); the square where no exponent is given."""
    n, v_r = p.get("n", 2.0), p.get("v_r", 1.0)
    return np.asarray(p["b_q"] * np.abs(at["v"]) ** n * v_r ** (2.0 - n) * at["s"])


def _variant(*further: EffectParameter) -> Variant:
    """The square, or with ``further`` shapes another power instead."""
    return Variant(
        interface="FrictionEffect",
        block="Windage",
        parameters=(
            EffectParameter("b_q", "F/V^2", 0.02, "quadratic coefficient, at v_r if n is not 2", lower=0.0),
            *further,
        ),
        slots=("motor", "guide"),
        law=drag,
        instead=bool(further),
    )


EFFECT = Effect(
    name="windage",
    title="Drag with the square of the motor's speed",
    physics="tau = b_q w^2 sgn(w), or b_q w^2 (|w|/v_r)^(n-2) sgn(w)",
    source="equation 5 of the article (b_q); Vrancik, NASA TN D-4849 (1968): the exponent of a gap is 1 to 2",
    signature="current at high speed beyond the viscous part",
    variants=(
        _variant(),
        _variant(
            EffectParameter("n", "1", 2.0, "exponent", role="shape", lower=1.2, upper=3.0, starts=(2.0,)),
            EffectParameter("v_r", "V", 1.0, "speed at which b_q holds", role="shape", fixed=True),
        ),
    ),
)
