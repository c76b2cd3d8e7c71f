"""The part of the inverter's dead time that turns with the rotor: the sixth order of the electrical angle."""

from dataclasses import replace

from thsa_cosim.diagnosis.catalogue.effect import Effect, Variant
from thsa_cosim.diagnosis.catalogue.effects.inverter_dead_time import PERIODS, RIPPLE

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
            parameters=(*RIPPLE[:2], replace(PERIODS, starts=(12.0, 24.0, 42.0, 72.0), scanned=True)),
        ),
    ),
)
