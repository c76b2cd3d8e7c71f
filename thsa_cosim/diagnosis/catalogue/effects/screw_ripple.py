"""Ripple of the screw with its angle."""

import numpy as np

from thsa_cosim.diagnosis.catalogue.effect import Connectors, Effect, EffectParameter, Values, Variant
from thsa_cosim.signals import FloatArray


def ripple(p: Values, at: Connectors) -> FloatArray:
    """a_s sin(n z) + a_c cos(n z)."""
    return np.asarray(p["a_s"] * np.sin(p["n"] * at["z"]) + p["a_c"] * np.cos(p["n"] * at["z"]))


def ripple_friction(p: Values, at: Connectors) -> FloatArray:
    """The same in the direction of motion."""
    return ripple(p, at) * at["s"]


def _parameters(s: str, c: str, dimension: str, typical: float) -> tuple[EffectParameter, ...]:
    return (
        EffectParameter(s, dimension, typical, "amplitude, sine part"),
        EffectParameter(c, dimension, typical, "amplitude, cosine part"),
        EffectParameter(
            "n",
            "W",
            1.0,
            "periods per revolution",
            role="shape",
            lower=0.1,
            upper=1000.0,
            starts=(1.0, 2.0),
            scanned=True,
        ),
    )


_PLACES = ("gearbox", "guide")
EFFECT = Effect(
    part="screw",
    name="screw-ripple",
    title="Ripple of the screw with its angle",
    physics="torque, share of the load's torque or friction a sin(n phi_g + phase), or a lead error of the same form",
    source="Mei, Tsutsumi, Tao, Sun, Mechanism and Machine Theory 38 (2003); ISO 3408-3 (lead deviation)",
    signature="periodic in the screw's angle: in the current (torque, friction) or in position (lead)",
    variants=(
        Variant("FrictionEffect", "Ripple", _parameters("a_s", "a_c", "F", 0.01), _PLACES, ripple),
        Variant(
            "FrictionEffect", "RippleFriction", _parameters("a_s", "a_c", "F", 0.01), _PLACES, ripple_friction
        ),
        Variant("ShaftEffect", "TorqueRipple", _parameters("a_s", "a_c", "F", 0.01)),
        Variant("ShaftEffect", "TorqueRipple", _parameters("c_s", "c_c", "1", 0.01)),
        Variant("ContactEffect", "LeadError", _parameters("a_s", "a_c", "m", 2e-06)),
    ),
)
