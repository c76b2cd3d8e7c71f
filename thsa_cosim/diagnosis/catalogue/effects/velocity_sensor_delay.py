"""Transport delay of the output velocity sensor."""

import numpy as np

from thsa_cosim.diagnosis.catalogue.effect import Connectors, Effect, EffectParameter, Values, Variant
from thsa_cosim.signals import FloatArray


def error(p: Values, at: Connectors) -> FloatArray:
    """u(t - tau) - u(t)."""
    return np.asarray(np.interp(at["time"] - p["tau"], at["time"], at["u"]) - at["u"])


EFFECT = Effect(
    name="velocity-sensor-delay",
    title="Transport delay of the output velocity sensor",
    physics="reading v(t - tau)",
    source="Pade approximation: Golub and Van Loan, Matrix Computations, section 9.3",
    signature="velocity lags position's derivative at every change of speed, by a fixed time",
    variants=(
        Variant(
            interface="SensorEffect",
            block="SensorDelay",
            parameters=(EffectParameter("tau", "s", 0.002, "delay", lower=1e-05, upper=0.2, neutral=1e-05),),
            slots=("velocitySensor",),
            law=error,
        ),
    ),
)
