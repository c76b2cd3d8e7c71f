"""Search: proposes vectors in the unit cube and is told their costs; knows no plant and no runner.

``differential_evolution``
    the global search with the article's setting.
``polish``
    bounded least squares from a good vector, whole Jacobians as one batch.
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
from thsa_cosim.search.polish import PolishResult, PolishSettings, central_jacobian, polish
from thsa_cosim.search.uncertainty import (
    Uncertainty,
    estimate_uncertainty,
    long_run_covariance,
    with_given,
)

__all__ = [
    "STRATEGIES",
    "EvolutionResult",
    "EvolutionSettings",
    "Generation",
    "PolishResult",
    "PolishSettings",
    "Uncertainty",
    "central_jacobian",
    "estimate_uncertainty",
    "evolve",
    "long_run_covariance",
    "polish",
    "with_given",
]
