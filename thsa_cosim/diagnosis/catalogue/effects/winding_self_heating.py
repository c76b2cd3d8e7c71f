"""Winding and magnets that the copper loss warms."""

from thsa_cosim.diagnosis.catalogue.effect import Effect, EffectParameter, Variant

EFFECT = Effect(
    name="winding-self-heating",
    title="Winding and magnets that the copper loss warms",
    physics="C dtheta/dt = R_s i^2 - theta/R_th; R_s (1 + alpha_R theta), psi_pm (1 + alpha_psi theta)",
    source="Pyrhonen, Jokinen, Hrabovcova, Design of Rotating Electrical Machines (2013), chapter 9",
    signature="voltage per current grows and back-EMF falls over the run, with the energy lost",
    variants=(
        Variant(
            interface="HeatingEffect",
            block="WindingSelfHeating",
            parameters=(
                EffectParameter("h", "K/J", 0.05, "warming per energy, 1/C", lower=0.0, upper=50.0),
                EffectParameter(
                    "tau",
                    "s",
                    100.0,
                    "time constant of cooling",
                    role="shape",
                    lower=0.5,
                    upper=1e5,
                    starts=(5.0, 100.0),
                ),
                EffectParameter(
                    "alpha_psi",
                    "1/K",
                    -1.2e-3,
                    "temperature coefficient of the flux",
                    role="shape",
                    lower=-5e-3,
                    upper=1e-3,
                    starts=(-1.2e-3, 0.0),
                ),
            ),
        ),
    ),
)
