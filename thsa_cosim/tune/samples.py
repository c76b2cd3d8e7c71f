"""Parameter samples from an identification's covariance: how the plant may differ from its model."""

import numpy as np

from thsa_cosim.scenario import TuneScenario
from thsa_cosim.scenario.tune_model import Condition, CovariancePoint, UncertaintySpec
from thsa_cosim.signals import FloatArray
from thsa_cosim.units import convert


def samples_at(scenario: TuneScenario, condition: Condition) -> tuple[dict[str, float], ...]:
    """FMU start values of every sample at a condition: the scenario's (or the FMU's) plus a random deviation.

    The deviations follow the normal distribution of the point nearest in temperature. Sample k uses the same
    random numbers everywhere, so that neighbouring conditions see the same kind of plant. Values stay within
    the FMU's limits.
    """
    spec = scenario.uncertainty
    if spec is None:
        return ()
    point = nearest(spec, scenario, condition)
    random = np.random.default_rng([scenario.seed, 2]).standard_normal((spec.samples, len(spec.variables)))
    samples = []
    for deviation in deviations(point, random) * np.array(spec.factors):
        values = {}
        for name, shift in zip(spec.variables.values(), deviation.tolist(), strict=True):
            variable = scenario.fmu.variables[name]
            value = scenario.fixed.get(name, variable.start or 0.0) + shift
            low = -np.inf if variable.minimum is None else variable.minimum
            high = np.inf if variable.maximum is None else variable.maximum
            values[name] = float(np.clip(value, low, high))
        samples.append(values)
    return tuple(samples)


def nearest(spec: UncertaintySpec, scenario: TuneScenario, condition: Condition) -> CovariancePoint:
    """The identification's point nearest in temperature; the first where there is no temperature."""
    if spec.temperature is None:
        return spec.points[0]
    axis = next(a for a in scenario.axes if a.name == spec.temperature)
    temperature = convert(condition.shown[spec.temperature], axis.unit, "degC")
    known = [p for p in spec.points if p.temperature_degC is not None] or list(spec.points)
    return min(known, key=lambda p: abs((p.temperature_degC or 0.0) - temperature))


def deviations(point: CovariancePoint, random: FloatArray) -> FloatArray:
    """Deviations (m, n) with the point's covariance from standard normal numbers (m, n)."""
    covariance = point.correlation * np.outer(point.stderr, point.stderr)
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    return np.asarray(random @ root.T)
