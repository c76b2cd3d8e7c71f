"""Clearance between screw and nut."""

import numpy as np

from thsa_cosim.diagnosis.catalogue.effect import Connectors, Effect, EffectParameter, Values, Variant
from thsa_cosim.signals import FloatArray


def offset(p: Values, at: Connectors) -> FloatArray:
    """-gap/2 on the flank that carries (``side``: 1 where the screw pushes forwards, else -1), less the start's."""
    side = at["side"]
    return np.asarray(-0.5 * p["gap"] * (side - p["s_0"] * side[0]))


EFFECT = Effect(
    name="backlash",
    title="Clearance between screw and nut",
    physics="F_s = 0 within +- gap/2, a flank that pushes and does not pull beyond",
    source="Nordin and Gutman, Automatica 38 (2002) 1633",
    signature="position lags by the gap after each reversal of the force, velocity spikes when the flanks meet",
    variants=(
        Variant(
            interface="ContactEffect",
            block="Backlash",
            parameters=(
                EffectParameter("gap", "m", 2e-05, "clearance, flank to flank", lower=0.0, upper=0.05),
                EffectParameter(
                    "s_0",
                    "1",
                    0.5,
                    "share of its half that the load has taken up at the start",
                    role="shape",
                    lower=0.0,
                    upper=1.0,
                    starts=(0.0,),
                ),
            ),
            law=offset,
        ),
    ),
)
