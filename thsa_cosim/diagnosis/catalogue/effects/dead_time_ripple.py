"""The part of the inverter's dead time that turns with the rotor: the sixth order of the electrical angle."""

from thsa_cosim.diagnosis.catalogue.effect import Effect, EffectParameter, Variant

EFFECT = Effect(
    name="dead-time-ripple",
    title="Ripple of the voltage that the inverter's dead time takes",
    physics="u = u_q - sgn(i_q) u_6 sin(n phi + phase), n six times the pole pairs",
    source="Jeong and Park, IEEE Trans. Ind. Electron. 38 (1991) 108",
    signature="ripple of the current six times per electrical period, whose size does not depend on the current",
    variants=(
        Variant(
            interface="PhaseEffect",
            block="DeadTimeRipple",
            parameters=(
                EffectParameter("u_s", "U", 0.1, "amplitude, sine part"),
                EffectParameter("u_c", "U", 0.1, "amplitude, cosine part"),
                EffectParameter(
                    "n",
                    "1",
                    6.0,
                    "periods per revolution",
                    role="shape",
                    lower=3.0,
                    upper=144.0,
                    starts=(12.0, 24.0, 42.0, 72.0),
                    scanned=True,
                ),
            ),
        ),
    ),
)
