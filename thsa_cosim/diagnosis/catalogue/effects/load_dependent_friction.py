"""Friction in proportion to the load that the pair carries, its breakaway part and its growth with the load."""

import numpy as np

from thsa_cosim.diagnosis.catalogue.effect import Connectors, Effect, EffectParameter, Values, Variant
from thsa_cosim.signals import FloatArray


def friction(p: Values, at: Connectors) -> FloatArray:
    """(mu + mu_S exp(-(v/v_S)^2) + mu_2 |N|) |N| sgn(v)."""
    load = np.abs(at["N"])
    breakaway = p["mu_S"] * np.exp(-((at["v"] / p["v_S"]) ** 2))
    return np.asarray((p["mu"] + breakaway + p["mu_2"] * load) * load * at["s"])


def _variant(*parameters: EffectParameter, beside: bool) -> Variant:
    return Variant("FrictionEffect", "LoadDependentFriction", parameters, law=friction, beside=beside)


MU = EffectParameter("mu", "1", 0.01, "friction per load", lower=0.0, upper=0.9)
GROWTH = EffectParameter("mu_2", "1/F", 0.01, "growth of the friction per load with the load", lower=0.0)

EFFECT = Effect(
    name="load-dependent-friction",
    title="Friction in proportion to the load that the pair carries",
    physics="F = (mu + mu_S exp(-(v/v_S)^2) + mu_2 |N|) |N| sgn(v)",
    source="Coulomb; Lemor, SNAME 1996 (roller screws); Duclusaud et al., ICRA 2025 (gears, models m3 to m6)",
    signature="current grows with the load beyond the declared lossless transmission",
    variants=(
        _variant(MU, beside=False),
        # Where losses grow faster than the load, a share of the load alone may explain less than what is no friction.
        _variant(MU, GROWTH, beside=False),
        _variant(
            EffectParameter(
                "mu_S", "1", 0.01, "breakaway part of the friction per load", lower=0.0, upper=0.9
            ),
            EffectParameter(
                "v_S",
                "V",
                0.1,
                "Stribeck speed",
                role="shape",
                lower=0.003,
                upper=0.5,
                starts=(0.03, 0.1, 0.3),
            ),
            beside=True,
        ),
        _variant(GROWTH, beside=True),
    ),
)
