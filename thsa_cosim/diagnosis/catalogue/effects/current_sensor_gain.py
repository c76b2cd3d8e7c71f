"""Gain error of the current sensor."""

from thsa_cosim.diagnosis.catalogue.effect import Connectors, Effect, EffectParameter, Values, Variant
from thsa_cosim.signals import FloatArray


def error(p: Values, at: Connectors) -> FloatArray:
    """g u."""
    return p["g"] * at["u"]


EFFECT = Effect(
    name="current-sensor-gain",
    title="Gain error of the current sensor",
    physics="reading (1 + g) i, also in the current loop",
    source="IEC 61869-2 (ratio error); Harke, Guerrero, Degner, Briz, Lorenz, IEEE Trans. Ind. Appl. 44 (2008)",
    signature="torque and back-EMF disagree on the torque constant",
    variants=(
        Variant(
            interface="SensorEffect",
            block="SensorGain",
            parameters=(EffectParameter("g", "1", 0.02, "relative error", lower=-0.5, upper=0.5),),
            slots=("currentSensor",),
            law=error,
        ),
    ),
)
