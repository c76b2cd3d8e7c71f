"""Friction in proportion to the load that a gear or a thread carries, and the ways in which the share can vary."""

import numpy as np

from thsa_cosim.diagnosis.catalogue.effect import Connectors, Effect, EffectParameter, Values, Variant
from thsa_cosim.signals import FloatArray


def friction(p: Values, at: Connectors) -> FloatArray:
    """(mu + mu_S exp(-(|v|/v_S)^n_S) + mu_v |v| + mu_2 |N|) |N| sgn(v) + mu_A N sgn(v) + mu_D N |sgn(v)|."""
    load, speed, s = np.abs(at["N"]), np.abs(at["v"]), at["s"]
    share = p["mu"] + p["mu_S"] * np.exp(-((speed / p["v_S"]) ** p["n_S"])) + p["mu_v"] * speed
    return np.asarray(
        ((share + p["mu_2"] * load) * load + p["mu_A"] * at["N"]) * s + p["mu_D"] * at["N"] * np.abs(s)
    )


def _variant(*parameters: EffectParameter, beside: bool) -> Variant:
    return Variant("FrictionEffect", "LoadDependentFriction", parameters, law=friction, beside=beside)


def _share(name: str, description: str, lower: float) -> EffectParameter:
    # Of a thread's axial force the share is tan(friction angle)/tan(lead angle): above one where it locks itself.
    return EffectParameter(name, "1", 0.01, description, lower=lower, upper=20.0)


MU = _share("mu", "friction per load", 0.0)
GROWTH = EffectParameter("mu_2", "1/F", 0.01, "growth of the friction per load with the load", lower=0.0)

EFFECT = Effect(
    name="load-dependent-friction",
    title="Friction in proportion to the load that the pair carries",
    physics="F = (mu + mu_S exp(-(|v|/v_S)^n_S) + mu_v |v| + mu_2 |N|) |N| sgn(v) + mu_A N sgn(v) + mu_D N |sgn(v)|",
    source="Coulomb; Lemor, SNAME 1996 (roller screws); Vahid-Araghi and Golnaraghi, Friction-Induced Vibration in"
    " Lead Screw Drives (2011); Duclusaud et al., ICRA 2025 (gears, models m3 to m6)",
    signature="current grows with the load beyond the declared lossless transmission",
    variants=(
        _variant(MU, beside=False),
        # Where losses grow faster than the load, a share of the load alone may explain less than what is no friction.
        _variant(MU, GROWTH, beside=False),
        _variant(
            _share("mu_S", "breakaway part of the friction per load", 0.0),
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
            EffectParameter("n_S", "1", 1.5, "exponent", role="shape", lower=0.5, upper=3.0, starts=(1.5,)),
            beside=True,
        ),
        _variant(
            EffectParameter("mu_v", "1/V", 0.01, "growth of the friction per load with the speed"),
            beside=True,
        ),
        _variant(GROWTH, beside=True),
        _variant(_share("mu_D", "half the difference of driving and driven", -20.0), beside=True),
        _variant(_share("mu_A", "half the difference of positive and negative load", -20.0), beside=True),
    ),
)
