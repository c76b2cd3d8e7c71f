"""A force in proportion to the position: a spring, a cable carrier, a bellows."""

import numpy as np

from thsa_cosim.diagnosis.catalogue.effect import Connectors, Effect, EffectParameter, Values, Variant
from thsa_cosim.signals import FloatArray


def force(p: Values, at: Connectors) -> FloatArray:
    """c z + F_0."""
    return np.asarray(p["c"] * at["z"] + p["F_0"])


def _variant(parameter: EffectParameter, beside: bool) -> Variant:
    return Variant("FrictionEffect", "Spring", (parameter,), law=force, beside=beside)


EFFECT = Effect(
    name="spring",
    title="Spring: force in proportion to the position",
    physics="F = c z + F_0, whatever the speed and its direction",
    source="Hooke; Altintas, Verl, Brecher, Uriarte, Pritschow, CIRP Annals 60 (2011) 779: feed drives",
    signature="current that depends on the position and not on the direction, at rest too",
    variants=(
        _variant(EffectParameter("c", "F/Z", 0.02, "stiffness"), beside=False),
        _variant(EffectParameter("F_0", "F", 0.02, "force at position zero"), beside=True),
    ),
)
