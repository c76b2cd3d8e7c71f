"""A point over temperature as an identification returns it, with the given estimates."""

from collections.abc import Mapping

import numpy as np

from thsa_cosim.identify.results import Estimate, PointResult


def point_of(temperature: float | None, parameters: Mapping[str, Estimate]) -> PointResult:
    return PointResult(
        label=f"{temperature} degC",
        temperature_degC=temperature,
        recordings=("r",),
        parameters=dict(parameters),
        correlation=np.eye(len(parameters)),
        cost=1.0,
        cost_per_sample=1.0,
        terms={},
        also={},
        profiles={},
        generations=(),
        evaluations=1,
        converged=True,
        stopped="",
        polished="",
    )
