"""Identification: measured recordings → parameters per temperature → laws, each with how sure it is.

``run``               the use case as a function
``problem``           scenario → what is searched at each point
``point``             the search at one point: evolution, polish, uncertainty
``sensitivity``       before a search: what the recordings say about each parameter
``over_temperature``  points → laws
``force``             the force residual
``results``           what comes out
"""

from thsa_cosim.identify.force import force_balance
from thsa_cosim.identify.results import (
    Estimate,
    ForceBalance,
    IdentifyResult,
    LawResult,
    PointResult,
)
from thsa_cosim.identify.run import identify

__all__ = [
    "Estimate",
    "ForceBalance",
    "IdentifyResult",
    "LawResult",
    "PointResult",
    "force_balance",
    "identify",
]
