"""Friction that falls as the lubricant is worked in."""

import numpy as np

from thsa_cosim.diagnosis.catalogue.effect import Connectors, Effect, EffectParameter, Values, Variant
from thsa_cosim.signals import FloatArray


def friction(p: Values, at: Connectors) -> FloatArray:
    """dF exp(-d/d_r) sgn(v), d the distance travelled."""
    travelled = np.cumsum(np.abs(np.diff(at["z"], prepend=at["z"][0])))
    return np.asarray(p["dF"] * np.exp(-travelled / p["d_r"]) * at["s"])


def friction_over_time(p: Values, at: Connectors) -> FloatArray:
    """dF exp(-t/tau_r) sgn(v)."""
    return np.asarray(p["dF"] * np.exp(-at["time"] / p["tau_r"]) * at["s"])


EFFECT = Effect(
    name="friction-run-in",
    title="Friction that falls as the lubricant is worked in",
    physics="F = dF exp(-d/d_r) sgn(v), d the distance travelled, or dF exp(-t/tau_r) sgn(v)",
    source="Olofsson et al., Wear 270 (2011): grease at low temperature; Blau, Tribology International 38 (2005) 1007",
    signature="friction in the current that decays over the run, whatever the position",
    variants=(
        Variant(
            interface="FrictionEffect",
            block="FrictionRunIn",
            parameters=(
                EffectParameter("dF", "F", 0.02, "friction at the start above the end", lower=0.0),
                EffectParameter(
                    "d_r",
                    "D",
                    0.3,
                    "distance of the decay",
                    role="shape",
                    lower=0.01,
                    upper=10.0,
                    starts=(0.1, 0.5),
                ),
            ),
            slots=("screw", "motor", "gearbox", "guide"),
            law=friction,
        ),
        Variant(
            interface="FrictionEffect",
            block="FrictionRunInTime",
            parameters=(
                EffectParameter("dF", "F", 0.02, "friction at the start above the end", lower=0.0),
                EffectParameter(
                    "tau_r",
                    "s",
                    5.0,
                    "time of the decay",
                    role="shape",
                    lower=0.2,
                    upper=1e3,
                    starts=(4.0,),
                ),
            ),
            slots=("screw", "motor", "gearbox", "guide"),
            law=friction_over_time,
        ),
    ),
)
