"""The recordings of a scenario as trials: simulations that a model has to match, to fit or to judge."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from thsa_cosim.batch import Experiment, Wrapper
from thsa_cosim.costs.channels import Channel, ResidualReducer
from thsa_cosim.errors import ScenarioError
from thsa_cosim.scenario import DiagnoseSpec, Scenario
from thsa_cosim.signals import FloatArray
from thsa_cosim.study import Case, build_case

Part = Literal["fit", "validate"]

#: Fit recordings of more residuals than this are compared by means of neighbouring samples: a diagnosis holds some
#: hundred vectors of that length. A minute of five signals at 1 kHz.
ROWS = 300_000
#: A search's run may take so many attempts at a step a sample, and at least so many. A machine that a wrong effect of a
#: large size makes chatter took two millions; set while looking at six simulated units, of which a dead time's ripple
#: took most, 1.3 a sample of 1 ms, and plain friction 0.05.
STEPS_A_SAMPLE, LEAST_STEPS = 5, 100_000
#: A search compares so many residuals, by means of more neighbours: what is found is identified and judged by all.
SEARCHED_ROWS = 100_000
#: Relative tolerance of a search's runs, where the scenario asks for a smaller one; what is found is identified and
#: judged at its own. With a ripple of 24 periods a turn it errs by 0.001 standard deviations of the noise (rms).
SEARCHED = 1e-4


@dataclass(frozen=True, eq=False)
class Trial:
    """A recording as a simulation, the part that it plays, and its temperature's label."""

    case: Case
    part: Part
    group: str

    @property
    def experiment(self) -> Experiment:
        """The simulation that returns residuals in standard deviations of the noise."""
        return self.case.experiment(self.name, ResidualReducer(self.case.channels, single=True))

    @property
    def name(self) -> str:
        """Name of the experiment."""
        return f"{self.part}/{self.case.name}"


def spec_of(scenario: Scenario) -> DiagnoseSpec:
    """The scenario's ``[diagnose]``; ScenarioError for a scenario of another kind or without held-out recordings."""
    if scenario.diagnose is None:
        raise ScenarioError(
            f"{scenario.path} is a scenario of kind {scenario.kind!r}; a diagnosis needs kind = 'diagnose'."
        )
    if not scenario.validate:
        raise ScenarioError(
            f"{scenario.path}: recordings.validate names no recording; a diagnosis is judged by recordings that no fit"
            " touched, so add one (or --validate FILE)."
        )
    return scenario.diagnose


def group_of(temperature: float | None, round_to: float) -> str:
    """Label of the recordings that share a temperature."""
    return "all" if temperature is None else f"{round(temperature / round_to) * round_to + 0.0:.6g} degC"


def trials_of(scenario: Scenario, rows: int = ROWS) -> tuple[Trial, ...]:
    """Every recording as a simulation of the scenario's own FMU; at most ``rows`` residuals of the fit ones."""
    trials = []
    for part, recordings in (("fit", scenario.fit), ("validate", scenario.validate)):
        for recording in recordings:
            case = build_case(scenario, recording, scenario.fixed_for(recording.name))
            group = group_of(recording.temperature_degC, scenario.round_to)
            trials.append(Trial(case, "fit" if part == "fit" else "validate", group))
    known = {t.group for t in trials if t.part == "fit"}
    for trial in trials:
        if trial.group not in known:
            raise ScenarioError(
                f"{trial.case.name} was recorded at {trial.group}, where there is no fit recording; add one, or"
                " leave it out."
            )
    return by_means(trials, rows)


def by_means(trials: Sequence[Trial], rows: int) -> tuple[Trial, ...]:
    """``trials`` by means of so many neighbouring samples that the fit recordings have at most ``rows`` of them."""
    samples = sum(c.measured.size for t in trials if t.part == "fit" for c in t.case.channels)
    of = -(-samples // rows)
    if of < 2:
        return tuple(trials)
    return tuple(replace(t, case=replace(t.case, channels=_means(t.case.channels, of))) for t in trials)


def _means(channels: Sequence[Channel], of: int) -> tuple[Channel, ...]:
    """The channels by means; those that were sampled together share their times."""
    found: list[Channel] = []
    for channel in channels:
        own = channel.means(of)
        for other in found:
            if np.array_equal(own.time, other.time) and _same(own.fine, other.fine):
                own = replace(own, time=other.time, fine=other.fine)
                break
        found.append(own)
    return tuple(found)


def _same(times: FloatArray | None, others: FloatArray | None) -> bool:
    return times is not None and others is not None and np.array_equal(times, others)


def note_on_means(trials: Sequence[Trial]) -> list[str]:
    """What to say of the means that ``trials`` are compared by, if they are."""
    of = max(c.mean_of for t in trials for c in t.case.channels)
    if of < 2:
        return []
    return [
        f"the recordings are long: the model is compared with them by means of {of} neighbouring samples; errors and"
        " noise are of these means"
    ]


def with_fmu(
    trials: tuple[Trial, ...], fmu: Path, fixed: Mapping[str, float] | None = None
) -> tuple[Trial, ...]:
    """The same recordings driving another FMU, with further fixed start values."""
    return tuple(
        replace(t, case=replace(t.case, fmu=fmu, fixed={**t.case.fixed, **(fixed or {})})) for t in trials
    )


def for_search(trials: tuple[Trial, ...], fmu: Path) -> tuple[Trial, ...]:
    """The same recordings driving a model of all effects, which is ours, at a search's tolerance, by its means.

    What takes far more steps than a machine that moves is no candidate, and ends.
    """
    driven = (
        replace(
            t,
            case=replace(
                t.case,
                tolerance=max(SEARCHED, t.case.tolerance or 0.0),
                most_steps=max(LEAST_STEPS, STEPS_A_SAMPLE * t.case.time.size),
            ),
        )
        for t in with_fmu(trials, fmu)
    )
    return by_means(tuple(driven), SEARCHED_ROWS)


def finer(trials: Sequence[Trial], tolerance: float) -> tuple[Trial, ...]:
    """The same recordings simulated at a relative ``tolerance``, where they have a larger one."""
    return tuple(
        replace(t, case=replace(t.case, tolerance=tolerance))
        if t.case.tolerance is not None and t.case.tolerance > tolerance
        else t
        for t in trials
    )


def note_on_tolerance(trials: Sequence[Trial], declared: float | None) -> list[str]:
    """What to say of ``trials`` that are simulated at a finer relative tolerance than the ``declared`` one, if so."""
    own = min((t.case.tolerance for t in trials if t.case.tolerance is not None), default=declared)
    if own is None or declared is None or own >= declared:
        return []
    return [
        "every cycle of sticking and slipping adds to the solver's errors: the extended model is simulated at a"
        f" relative tolerance of {own:g}, not at simulation.tolerance = {declared:g}; set it to {own:g} where the model"
        " is used"
    ]


def with_wrapper(
    trials: tuple[Trial, ...], wrapper: Wrapper, fixed: Mapping[str, float] | None = None
) -> tuple[Trial, ...]:
    """The same recordings with effects around the FMU, with further fixed start values."""
    return tuple(
        replace(t, case=replace(t.case, wrapper=wrapper, fixed={**t.case.fixed, **(fixed or {})}))
        for t in trials
    )
