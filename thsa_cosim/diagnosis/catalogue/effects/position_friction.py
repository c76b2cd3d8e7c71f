"""Friction that varies along the stroke."""

import numpy as np

from thsa_cosim.diagnosis.catalogue.effect import Connectors, Effect, EffectParameter, Values, Variant
from thsa_cosim.signals import FloatArray


def friction(p: Values, at: Connectors) -> FloatArray:
    """(c1 z + c2 exp(-((z - z_2)/w_2)^2 / 2) + c_s sin(kappa z) + c_c cos(kappa z)) sgn(v)."""
    z = at["z"]
    rise = p["c2"] * np.exp(-0.5 * ((z - p["z_2"]) / p["w_2"]) ** 2)
    wave = p["c_s"] * np.sin(p["kappa"] * z) + p["c_c"] * np.cos(p["kappa"] * z)
    return np.asarray((p["c1"] * z + rise + wave) * at["s"])


EFFECT = Effect(
    name="position-friction",
    title="Friction that varies along the stroke",
    physics="F = (c_1 x + local rise + wave over x) sgn(v)",
    source="Armstrong-Helouvry et al., Automatica 30 (1994) 1083, section 2",
    signature="friction in the current that depends on where the nut is, in both directions",
    variants=(
        Variant(
            interface="FrictionEffect",
            block="PositionFriction",
            parameters=(EffectParameter("c1", "F/Z", 0.02, "change per length"),),
            slots=("screw", "guide"),
            law=friction,
        ),
        Variant(
            interface="FrictionEffect",
            block="PositionFriction",
            parameters=(
                EffectParameter("c2", "F", 0.02, "height of a local rise"),
                EffectParameter(
                    "z_2",
                    "Z",
                    0.5,
                    "position of the rise",
                    role="shape",
                    lower=-1.2,
                    upper=1.2,
                    starts=(0.1, 0.3, 0.5, 0.7, 0.9),
                ),
                EffectParameter(
                    "w_2", "Z", 0.1, "width of the rise", role="shape", lower=0.01, upper=0.6, starts=(0.1,)
                ),
            ),
            slots=("screw", "guide"),
            law=friction,
        ),
        Variant(
            interface="FrictionEffect",
            block="PositionFriction",
            parameters=(
                EffectParameter("c_s", "F", 0.02, "amplitude of a wave, sine part"),
                EffectParameter("c_c", "F", 0.02, "amplitude of a wave, cosine part"),
                EffectParameter(
                    "kappa",
                    "1/Z",
                    6.0,
                    "wave number",
                    role="shape",
                    lower=1.0,
                    upper=60.0,
                    starts=(3.0, 6.0, 9.0, 13.0, 18.0, 25.0),
                    scanned=True,
                ),
            ),
            slots=("screw", "guide"),
            law=friction,
        ),
    ),
)
