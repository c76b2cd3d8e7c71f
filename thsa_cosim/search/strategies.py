"""The names that a scenario may ask for: the way to search, and SciPy's strategies of differential evolution."""

from typing import Literal

SearchMethod = Literal["local-first", "differential-evolution"]

Strategy = Literal[
    "rand1bin",
    "rand1exp",
    "rand2bin",
    "rand2exp",
    "best1bin",
    "best1exp",
    "best2bin",
    "best2exp",
    "randtobest1bin",
    "randtobest1exp",
    "currenttobest1bin",
    "currenttobest1exp",
]
