"""Cogging torque of the motor."""

import numpy as np

from thsa_cosim.diagnosis.catalogue.effect import Connectors, Effect, EffectParameter, Values, Variant
from thsa_cosim.signals import FloatArray


def torque(p: Values, at: Connectors) -> FloatArray:
    """a_s sin(n z) + a_c cos(n z), a_s2, a_c2 likewise with 2 n, a_s3, a_c3 with n_3, and so on."""
    z = at["z"]
    waves = [("", p["n"]), ("2", 2.0 * p["n"]), *((k, p[f"n_{k}"]) for k in FURTHER)]
    parts = [p[f"a_s{k}"] * np.sin(n * z) + p[f"a_c{k}"] * np.cos(n * z) for k, n in waves]
    return np.asarray(sum(parts))


#: Names of the orders beside the first one and its second harmonic.
FURTHER = ("3", "4", "5")


def _periods(name: str, starts: tuple[float, ...]) -> EffectParameter:
    return EffectParameter(
        name,
        "1",
        1.0,
        "periods per revolution",
        role="shape",
        lower=0.5,
        upper=150.0,
        starts=starts,
        scanned=True,
    )


def _beside(number: str, periods: EffectParameter, what: str) -> Variant:
    return Variant(
        interface="FrictionEffect",
        block="Cogging",
        parameters=(
            EffectParameter(f"a_s{number}", "F", 0.005, f"amplitude of {what}, sine part"),
            EffectParameter(f"a_c{number}", "F", 0.005, f"amplitude of {what}, cosine part"),
            periods,
        ),
        slots=("motor",),
        law=torque,
        beside=True,
    )


PERIODS = _periods("n", (4.0, 6.0, 8.0, 12.0, 24.0, 36.0, 48.0))

EFFECT = Effect(
    name="cogging",
    title="Cogging torque of the motor",
    physics="tau = a sin(n phi + phase), its second harmonic and up to three further orders, without current",
    source="Hendershot and Miller, Design of Brushless Permanent-Magnet Machines (2010)",
    signature="ripple of speed and current at a multiple of the rotor's angle, at every load",
    variants=(
        Variant(
            interface="FrictionEffect",
            block="Cogging",
            parameters=(
                EffectParameter("a_s", "F", 0.01, "amplitude, sine part"),
                EffectParameter("a_c", "F", 0.01, "amplitude, cosine part"),
                PERIODS,
            ),
            slots=("motor",),
            law=torque,
        ),
        _beside("2", PERIODS, "the second harmonic"),
        *(_beside(k, _periods(f"n_{k}", (1.0,)), "a further order") for k in FURTHER),
    ),
)
