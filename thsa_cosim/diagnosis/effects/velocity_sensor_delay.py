"""Transport delay of the output velocity sensor."""

from thsa_cosim.diagnosis.effect import Effect, EffectParameter, Variant

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
        ),
    ),
    injection="output",
)
