"""Several scenarios in order, each with what the earlier ones found: the benches, then the whole actuator."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from thsa_cosim.errors import InputError, StudyError
from thsa_cosim.identify import IdentifyResult, PointResult, identify
from thsa_cosim.identify.over_temperature import values_at
from thsa_cosim.identify.parameter_set import parameter_set
from thsa_cosim.identify.problem import Given
from thsa_cosim.scenario import Scenario, Stage, StagedScenario, hand_on
from thsa_cosim.simulate import SimulateResult, simulate
from thsa_cosim.ssv import ParameterSet
from thsa_cosim.study import Place, claim_folder, stages_identity
from thsa_cosim.units import conversion


@dataclass(frozen=True, eq=False)
class StagedResult:
    """Results per stage, in order, as far as they came; ``parameter_set`` is in terms of the last stage's FMU."""

    scenario: StagedScenario
    status: str
    identified: Mapping[str, IdentifyResult]
    simulated: Mapping[str, SimulateResult]
    parameter_set: ParameterSet
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class _Finished:
    """An identification that later stages build upon."""

    stage: Stage
    scenario: Scenario
    result: IdentifyResult

    def found(self, temperature: float | None) -> Mapping[str, float]:
        """Values of what is handed on at ``temperature``; StudyError if there are none."""
        try:
            return values_at(
                temperature, self.stage.give, self.result.points, self.result.laws, self.scenario.round_to
            )
        except InputError as error:
            where = "" if temperature is None else f" at {temperature:g} degC"
            raise StudyError(f"Stage {self.stage.name!r} hands nothing on{where}: {error}.") from None

    def point(self, temperature: float | None) -> PointResult | None:
        """The point at ``temperature``, if it was identified there."""
        near = 0.5 * self.scenario.round_to
        for point in self.result.points:
            own = point.temperature_degC
            if own is None or (temperature is not None and abs(own - temperature) <= near):
                return point
        return None


def run_stages(staged: StagedScenario, place: Place) -> StagedResult:
    """Run all stages, each in a folder of its own below that of ``place``; a folder that exists is continued.

    Raises
    ------
    InputError, StudyError
        As the stages' own runs, and StudyError if a stage lacks a value that a later one needs.
    """
    claim_folder(
        place.folder,
        stages_identity(staged),
        {
            "title": staged.title or staged.path.stem,
            "scenario": str(staged.path),
            "command": place.command,
            "stages": [stage.name for stage in staged.stages],
        },
    )
    finished: list[_Finished] = []
    simulated: dict[str, SimulateResult] = {}
    status = "complete"
    for number, stage in enumerate(staged.stages, start=1):
        scenario = stage.scenario
        for earlier in finished:
            scenario = hand_on(earlier.stage, earlier.found, scenario)
        label = f"stage {number} of {len(staged.stages)}, {stage.name}"
        own = place.stage(f"{number}_{stage.name}", label)
        if scenario.kind == "simulate":
            simulated[stage.name] = simulate(scenario, own)
            continue
        result = identify(
            scenario,
            own,
            given={
                p.temperature_degC: _given(finished, scenario, p.temperature_degC) for p in scenario.points
            },
        )
        finished.append(_Finished(stage, scenario, result))
        if result.status != "complete":
            status = result.status
            break
    parameters, notes = _everything(staged, finished)
    return StagedResult(
        scenario=staged,
        status=status,
        identified={f.stage.name: f.result for f in finished},
        simulated=simulated,
        parameter_set=parameters,
        notes=tuple(notes),
    )


def _given(finished: list[_Finished], target: Scenario, temperature: float | None) -> Given:
    """What the earlier stages found at ``temperature`` for the target's FMU, with its covariance."""
    values: dict[str, float] = {}
    blocks = []
    searched = {p.variable for p in target.parameters.parameters}
    for earlier in finished:
        point = earlier.point(temperature)
        space = earlier.scenario.parameters
        names = []
        for name in earlier.stage.give:
            estimate = None if point is None else point.parameters.get(name)
            variable = space[name].variable
            held = variable in target.fmu.variables and variable not in searched
            if held and estimate is not None and estimate.stderr is not None:
                names.append(name)
        if point is None or not names:
            continue
        order = [list(point.parameters).index(name) for name in names]
        correlation = np.nan_to_num(point.correlation[np.ix_(order, order)])
        sizes = []
        for name in names:
            parameter, estimate = space[name], point.parameters[name]
            unit = target.fmu.variables[parameter.variable].unit or parameter.unit
            factor, offset = conversion(parameter.unit, unit)
            values[parameter.variable] = factor * estimate.value + offset
            sizes.append(abs(factor) * (estimate.stderr or 0.0))
        blocks.append(correlation * np.outer(sizes, sizes))
    covariance = np.zeros((len(values), len(values)))
    position = 0
    for block in blocks:
        end = position + len(block)
        covariance[position:end, position:end] = block
        position = end
    return Given(values, covariance)


def _everything(staged: StagedScenario, finished: list[_Finished]) -> tuple[ParameterSet, list[str]]:
    """All that was found as start values of the last stage's FMU."""
    target = staged.stages[-1].scenario.fmu
    values: dict[str, float] = {}
    units: dict[str, str] = {}
    notes: list[str] = []
    for earlier in finished:
        found, left_out = parameter_set(
            "", earlier.scenario.parameters, earlier.result.points, earlier.result.laws, earlier.scenario.fmu
        )
        notes += left_out
        for name, value in found.values.items():
            if name in target.variables:
                values[name] = value
                units[name] = found.units.get(name, "")
    title = staged.title or staged.path.stem
    return ParameterSet(title, values, units, "identified by thsa-cosim"), notes
