"""What does a model lack? From the residual to an effect, from the effect to a better model.

Four rooms, each of which knows only those before it, and ``run`` on top:

``catalogue``: what could be missing, and where. Effects, the model's slots, candidates, the superset of all of them.
``fitting``: a model's unknowns fitted to recordings; what is left beside noise.
``choosing``: which candidates the recordings ask for: screened, scored on held-out recordings, gated, judged.
``explaining``: what else the recordings say: balances, dependence, empirical laws, the next experiment.
``conclusion``: the extended model identified as the declared one was, and the verdict. ``run`` goes through all.

``blackbox`` offers the catalogue's effects to an FMU without source; ``results`` is what all of it comes to.
"""

from thsa_cosim.diagnosis.catalogue.effect import Effect, EffectParameter, Variant
from thsa_cosim.diagnosis.catalogue.known import known_effects
from thsa_cosim.diagnosis.results import DiagnosisResult
from thsa_cosim.diagnosis.run import diagnose

__all__ = ["DiagnosisResult", "Effect", "EffectParameter", "Variant", "diagnose", "known_effects"]
