"""Offset of the current sensor."""

import numpy as np

from thsa_cosim.diagnosis.catalogue.effect import Connectors, Effect, EffectParameter, Values, Variant
from thsa_cosim.signals import FloatArray


def error(p: Values, at: Connectors) -> FloatArray:
    """o."""
    return np.full_like(at["u"], p["o"])


EFFECT = Effect(
    name="current-sensor-offset",
    title="Offset of the current sensor",
    physics="reading i + o, also in the current loop",
    source="Chung and Sul, IEEE Trans. Ind. Appl. 34 (1998) 1262",
    signature="the same current error in both directions and at rest, voltage without it",
    variants=(
        Variant(
            interface="SensorEffect",
            block="SensorOffset",
            parameters=(EffectParameter("o", "I", 0.02, "offset"),),
            slots=("currentSensor",),
            law=error,
        ),
    ),
)
