"""Unequal gains of the phase currents' sensors, which make a ripple of twice the electrical frequency."""

from thsa_cosim.diagnosis.catalogue.effect import Effect, EffectParameter, Variant

EFFECT = Effect(
    name="phase-current-gain",
    title="Unequal gains of the phase currents' sensors",
    physics="reading i_q (1 + g sin(n phi + phase)), n twice the pole pairs, also in the current loop",
    source="Chung and Sul, IEEE Trans. Ind. Appl. 34 (1998) 1262",
    signature="ripple of the current twice per electrical period, in proportion to the current",
    variants=(
        Variant(
            interface="PhaseEffect",
            block="PhaseCurrentGain",
            parameters=(
                EffectParameter("g_s", "1", 0.01, "relative error, sine part"),
                EffectParameter("g_c", "1", 0.01, "relative error, cosine part"),
                EffectParameter(
                    "n",
                    "1",
                    2.0,
                    "periods per revolution",
                    role="shape",
                    lower=1.0,
                    upper=120.0,
                    starts=(4.0, 8.0, 14.0, 24.0),
                    scanned=True,
                ),
            ),
        ),
    ),
)
