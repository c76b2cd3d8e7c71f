"""Offset of the current sensor."""

from thsa_cosim.diagnosis.effect import Effect, EffectParameter, Variant

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
        ),
    ),
    injection=None,
)
