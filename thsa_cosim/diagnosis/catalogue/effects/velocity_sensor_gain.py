"""Gain error of the output velocity sensor."""

from thsa_cosim.diagnosis.catalogue.effect import Connectors, Effect, EffectParameter, Values, Variant
from thsa_cosim.signals import FloatArray


def error(p: Values, at: Connectors) -> FloatArray:
    """g u."""
    return p["g"] * at["u"]


EFFECT = Effect(
    name="velocity-sensor-gain",
    title="Gain error of the output velocity sensor",
    physics="reading (1 + g) v",
    source="IEC 60751-style ratio error of a sensor; kinematics v = k w/i",
    signature="velocity disagrees with the derivative of position and with motor speed by a constant ratio",
    variants=(
        Variant(
            interface="SensorEffect",
            block="SensorGain",
            parameters=(EffectParameter("g", "1", 0.01, "relative error", lower=-0.5, upper=0.5),),
            slots=("velocitySensor",),
            law=error,
        ),
    ),
)
