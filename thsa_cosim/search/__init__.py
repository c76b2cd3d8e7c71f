"""Search: proposes vectors in the unit cube and is told their costs; knows no plant and no runner.

``local``
    least squares from several spread starts, and whether they agree.
``differential_evolution``
    the global search with the article's setting.
``least_squares``
    bounded, with what is known beforehand and columns that are kept; ``differences``: its Jacobians, one batch each.
``polish``
    the minimum confirmed with central differences, and the Jacobian that uncertainty needs.
``profile``
    profile likelihood: intervals without the assumption of a parabola.
``simplex``
    the minimum of a cost with edges, from the end of a global search.
``uncertainty``
    standard errors under autocorrelated residuals, and which parameters the data determine.
"""

from thsa_cosim.search.differences import (
    Asking,
    Box,
    DifferenceSettings,
    Residuals,
    answer,
    difference_columns,
)
from thsa_cosim.search.differential_evolution import (
    STRATEGIES,
    EvolutionResult,
    EvolutionSettings,
    Generation,
    evolve,
)
from thsa_cosim.search.least_squares import LeastSquaresSettings, Minimum, Prior, least_squares
from thsa_cosim.search.local import (
    LocalResult,
    LocalSearch,
    LocalSettings,
    agreement,
    same_minimum,
    search_locally,
)
from thsa_cosim.search.polish import PolishResult, PolishSettings, confirm, polish
from thsa_cosim.search.profile import CHI2_95, Profile, profile
from thsa_cosim.search.simplex import SimplexResult, SimplexSettings, descend
from thsa_cosim.search.uncertainty import (
    Uncertainty,
    andrews_bandwidth,
    estimate_uncertainty,
    long_run_covariance,
    with_given,
)

__all__ = [
    "CHI2_95",
    "STRATEGIES",
    "Asking",
    "Box",
    "DifferenceSettings",
    "EvolutionResult",
    "EvolutionSettings",
    "Generation",
    "LeastSquaresSettings",
    "LocalResult",
    "LocalSearch",
    "LocalSettings",
    "Minimum",
    "PolishResult",
    "PolishSettings",
    "Prior",
    "Profile",
    "Residuals",
    "SimplexResult",
    "SimplexSettings",
    "Uncertainty",
    "agreement",
    "andrews_bandwidth",
    "answer",
    "confirm",
    "descend",
    "difference_columns",
    "estimate_uncertainty",
    "evolve",
    "least_squares",
    "long_run_covariance",
    "polish",
    "profile",
    "same_minimum",
    "search_locally",
    "with_given",
]
