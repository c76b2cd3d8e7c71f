"""Search: proposes vectors in the unit cube and is told their costs; knows no plant and no runner.

``differential_evolution``
    the global search with the article's setting.
``polish``
    bounded least squares from a good vector, whole Jacobians as one batch.
``profile``
    profile likelihood: intervals without the assumption of a parabola.
``uncertainty``
    standard errors under autocorrelated residuals, and which parameters the data determine.
"""

from thsa_cosim.search.differential_evolution import (
    STRATEGIES,
    EvolutionResult,
    EvolutionSettings,
    Generation,
    evolve,
)
from thsa_cosim.search.polish import PolishResult, PolishSettings, polish
from thsa_cosim.search.profile import CHI2_95, Profile, profile
from thsa_cosim.search.uncertainty import (
    Uncertainty,
    estimate_uncertainty,
    long_run_covariance,
    with_given,
)

__all__ = [
    "CHI2_95",
    "STRATEGIES",
    "EvolutionResult",
    "EvolutionSettings",
    "Generation",
    "PolishResult",
    "PolishSettings",
    "Profile",
    "Uncertainty",
    "estimate_uncertainty",
    "evolve",
    "long_run_covariance",
    "polish",
    "profile",
    "with_given",
]
