"""Identification: measured recordings → parameters per temperature → laws, each with how sure it is.

``run``               the use case as a function
``problem``           scenario → what is searched at each point
``point``             the search at one point: evolution, polish, uncertainty
``interleave``        all points' searches over one runner
``sensitivity``       before a search: what the recordings say about each parameter
``evaluate``          vectors → simulations → costs, with the journal
``over_temperature``  points → laws
``compare``           simulated against measured
``force``             the force residual
``results``           what comes out
"""

from thsa_cosim.identify.force import force_balance
from thsa_cosim.identify.results import (
    ChannelError,
    Comparison,
    Estimate,
    ForceBalance,
    IdentifyResult,
    LawResult,
    PointResult,
)
from thsa_cosim.identify.run import identify

__all__ = [
    "ChannelError",
    "Comparison",
    "Estimate",
    "ForceBalance",
    "IdentifyResult",
    "LawResult",
    "PointResult",
    "force_balance",
    "identify",
]
