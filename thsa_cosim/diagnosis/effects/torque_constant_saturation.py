"""Torque constant that falls with the current."""

from thsa_cosim.diagnosis.effect import Effect, EffectParameter, Variant

EFFECT = Effect(
    name="torque-constant-saturation",
    title="Torque constant that falls with the current",
    physics="K_t (1 - a i^2), or K_t (1 - b |i|)",
    source="Bianchi and Bolognani, IET Electr. Power Appl. 1 (2007): saturation of PM machines",
    signature="current beyond proportion at high torque, with or against the load alike",
    variants=(
        Variant(
            interface="TorqueConstantEffect",
            block="TorqueConstantSaturation",
            parameters=(EffectParameter("a", "1/I^2", 0.02, "fall per square of the current", lower=0.0),),
        ),
        Variant(
            interface="TorqueConstantEffect",
            block="TorqueConstantSaturation",
            parameters=(EffectParameter("b", "1/I", 0.02, "fall per current", lower=0.0),),
        ),
    ),
    injection="load",
)
