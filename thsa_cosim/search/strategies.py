"""The names of SciPy's differential-evolution strategies that a scenario may ask for."""

from typing import Literal

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
