"""Offsets of the phase currents' sensors, which turn with the electrical angle in the q axis."""

from thsa_cosim.diagnosis.catalogue.effect import Effect, EffectParameter, Variant

EFFECT = Effect(
    name="phase-current-offset",
    title="Offsets of the phase currents' sensors",
    physics="reading i_q + o sin(n phi + phase), n the pole pairs, also in the current loop",
    source="Chung and Sul, IEEE Trans. Ind. Appl. 34 (1998) 1262",
    signature="ripple of the current once per electrical period, whose size depends on neither current nor speed",
    variants=(
        Variant(
            interface="PhaseEffect",
            block="PhaseCurrentOffset",
            parameters=(
                EffectParameter("o_s", "I", 0.01, "amplitude, sine part"),
                EffectParameter("o_c", "I", 0.01, "amplitude, cosine part"),
                EffectParameter(
                    "n",
                    "1",
                    1.0,
                    "periods per revolution",
                    role="shape",
                    lower=0.5,
                    upper=60.0,
                    starts=(2.0, 4.0, 7.0, 12.0),
                    scanned=True,
                ),
            ),
        ),
    ),
)
