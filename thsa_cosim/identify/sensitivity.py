"""Before a search: which parameter moves which signal, which are confounded, and what errors to expect.

The Jacobian of the residuals at the start values, by central differences, over the recordings of each point. Expected
standard errors are those of a least-squares estimate at that place if white noise of the stated size is all that
remains (Ljung, *System Identification*, 1999, section 9.4): (JᵀJ)⁻¹ with J per standard deviation of the noise.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from thsa_cosim.identify.problem import PointProblem, build_point
from thsa_cosim.scenario import Executor, Scenario
from thsa_cosim.search import Box, DifferenceSettings, answer, difference_columns, estimate_uncertainty
from thsa_cosim.search.differences import Residual
from thsa_cosim.signals import FloatArray
from thsa_cosim.study import Engine, Request, Want

CONFOUNDED = 0.95
"""Correlation of two estimates from which on they are reported as confounded."""
SHARE = 0.1
"""A response is stated for a change of this share of the way between the bounds."""


@dataclass(frozen=True)
class ParameterSensitivity:
    """What the recordings of a point say about one parameter, at its start ``value`` [unit].

    ``responses``: signal → root mean square of its change, in standard deviations of its noise, for a change of the
    parameter by a tenth of the way between its bounds. ``stderr`` [unit] is expected; None with the ``reason`` where
    the recordings do not determine the parameter.
    """

    name: str
    unit: str
    value: float
    responses: dict[str, float]
    stderr: float | None
    reason: str

    @property
    def signal(self) -> str:
        """The signal that it moves most; "" if none."""
        found = max(self.responses, key=self.responses.__getitem__, default="")
        return found if found and self.responses[found] > 0.0 else ""


@dataclass(frozen=True)
class PointSensitivity:
    """Sensitivities at one point; ``confounded``: pairs of parameters, with the correlation of their estimates.

    ``failure``: why the start values could not be simulated, or "".
    """

    label: str
    recordings: tuple[str, ...]
    parameters: tuple[ParameterSensitivity, ...]
    confounded: tuple[tuple[str, str, float], ...]
    runs: int
    failure: str = ""


def sensitivity(scenario: Scenario, executor: Executor) -> tuple[PointSensitivity, ...]:
    """Sensitivities at every point of ``scenario``, at the start values (the middle of the bounds without one).

    Six simulations per parameter and recording, or a few more; nothing is written.
    """
    points = [build_point(scenario, point) for point in scenario.points]
    experiments = [experiment for point in points for experiment in point.experiments]
    with executor.open_runner(scenario.simulation, experiments) as runner:
        return tuple(_at(point, Engine(runner)) for point in points)


def _at(point: PointProblem, engine: Engine) -> PointSensitivity:
    space, reasons = point.space, [""]

    def evaluate(vectors: FloatArray) -> Sequence[Residual]:
        reply = engine.ask(point, Request(Want.RESIDUALS, vectors))
        reasons.extend(reason for reason in reply.reasons if reason)
        return reply.residuals

    start, names = space.start(), tuple(case.name for case in point.cases)
    centre = evaluate(start[None, :])[0]
    if centre is None:
        return PointSensitivity(point.label, names, (), (), engine.runs, reasons[-1])
    settings = DifferenceSettings(central=True, share=0.0, repeats=2)
    box, steps = Box.unit(space.dimension), np.full(space.dimension, 1e-3)
    jacobian, steps = answer(difference_columns(start, centre, steps, box, settings), evaluate)
    half, _ = answer(difference_columns(start, centre, 0.5 * steps, box, settings), evaluate)
    # Before a search the residuals are no noise; those of a perfect model would be.
    noise = np.random.default_rng(0).standard_normal(centre.size)
    expected = estimate_uncertainty(
        np.clip(start, 1e-3, 1.0 - 1e-3), noise, jacobian, half - jacobian, point.groups, space.names
    )
    slopes, values = np.abs(space.slope(start)), space.physical(start)
    parameters = []
    for i, parameter in enumerate(space.parameters):
        stderr = float(expected.stderr[i] * slopes[i])
        reason = expected.reasons[i]
        parameters.append(
            ParameterSensitivity(
                parameter.name,
                parameter.unit,
                float(values[i]),
                _responses(point, SHARE * jacobian[:, i]),
                stderr if np.isfinite(stderr) and not reason else None,
                reason,
            )
        )
    pairs = _confounded(space.names, expected.correlation)
    return PointSensitivity(point.label, names, tuple(parameters), pairs, engine.runs)


def _responses(point: PointProblem, change: FloatArray) -> dict[str, float]:
    """Root mean square of a change of the residuals (N,) per signal, over all recordings."""
    squares = dict.fromkeys(point.channel_names, 0.0)
    counts = dict.fromkeys(point.channel_names, 0)
    for slices in point.groups:
        for name, part in zip(point.channel_names, slices, strict=True):
            squares[name] += float(np.sum(change[part] ** 2))
            counts[name] += part.stop - part.start
    return {name: float(np.sqrt(squares[name] / max(1, counts[name]))) for name in squares}


def _confounded(names: Sequence[str], correlation: FloatArray) -> tuple[tuple[str, str, float], ...]:
    return tuple(
        (names[i], names[j], float(correlation[i, j]))
        for i in range(len(names))
        for j in range(i)
        if abs(correlation[i, j]) >= CONFOUNDED
    )
