"""What does a model lack? From the residual to an effect, from the effect to a better model.

``superset`` exports the declared model with every effect of the catalogue (``effects``, one a file), ``screen``
asks for linear responses of all of them, ``attribution`` refines and judges them on held-out recordings with
thresholds by ``threshold``, ``closure`` writes the class that holds what was accepted and identifies both models.
``structure`` says what is left, ``balance`` which equation does not close.
"""

from thsa_cosim.diagnosis.catalogue import catalogue
from thsa_cosim.diagnosis.effect import Effect, EffectParameter, Variant
from thsa_cosim.diagnosis.results import DiagnosisResult
from thsa_cosim.diagnosis.run import diagnose

__all__ = ["DiagnosisResult", "Effect", "EffectParameter", "Variant", "catalogue", "diagnose"]
