"""What communication steps cost, of a foreign FMU or of a system's components, next to the sensors' noise.

A run at half the steps, with the values that were found.
"""

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from thsa_cosim.batch import Experiment, Job, Outcome
from thsa_cosim.batch.handling import refined
from thsa_cosim.batch.own_step import moves_within, own_step
from thsa_cosim.fmu import FmuDescription
from thsa_cosim.fmu.inputs import is_ours
from thsa_cosim.fmu.plant import VARIABLE_STEP
from thsa_cosim.scenario import Executor, SimulationTable
from thsa_cosim.scenario.handling import settle_handling
from thsa_cosim.signals import Signals
from thsa_cosim.system.description import SystemDescription
from thsa_cosim.system.write import write_halved

LARGE = 0.5
"""Change over noise from which on a result is said to depend on the communication step."""


@dataclass(frozen=True)
class CouplingError:
    """How far signals of ``recording`` move when the FMU, or all coupled components of a system, steps half as far.

    ``changes``: root mean square by signal, in its unit; ``noise``: 1 σ of its sensor in the same. The method is of
    second order, so the error that is left at the full step is about four thirds of the change.
    """

    recording: str
    changes: Mapping[str, float]
    noise: Mapping[str, float]
    units: Mapping[str, str]
    remedy: str = "lower the steps of the components"

    @property
    def worst(self) -> tuple[str, float]:
        """The signal whose change is largest over its noise, and that ratio."""
        ratios = {n: c / self.noise[n] for n, c in self.changes.items() if self.noise.get(n, 0.0) > 0.0}
        name = max(ratios, key=ratios.__getitem__, default="")
        return name, ratios.get(name, 0.0)

    def sentence(self) -> str:
        """What a reader is told."""
        name, ratio = self.worst
        if not name:
            return (
                f"halving the communication steps: no signal of {self.recording} has a noise to compare with"
            )
        size = f"{self.changes[name]:.2g} {self.units[name]} rms, {ratio:.2g} times its noise"
        return f"halving the communication steps changes {name} by {size} ({self.recording})"

    @property
    def reason(self) -> str:
        """Why values are not to be trusted, or ""."""
        return f"{self.sentence()}; {self.remedy}" if self.worst[1] > LARGE else ""

    def to_dict(self) -> dict[str, object]:
        """JSON types."""
        return {
            "recording": self.recording,
            "halved": {
                name: {"rms": change, "noise": self.noise.get(name), "unit": self.units[name]}
                for name, change in self.changes.items()
            },
        }


def coupling_error(
    fmu: FmuDescription,
    spec: SimulationTable,
    experiment: Experiment,
    values: Mapping[str, float],
    simulated: Signals,
    noise: Mapping[str, float],
) -> CouplingError | str:
    """Run ``experiment`` at ``values`` once more with half the steps, and compare with ``simulated``.

    Returns a sentence where that run fails, and "" where nothing depends on a communication step: in Model Exchange,
    with FMUs of this toolkit, and with those that take steps of one size or step by themselves.
    """
    found = _halved(fmu, spec, experiment, values)
    if found is None:
        return ""
    outcome, stride, remedy = found
    if outcome.signals is None:
        return f"with half the communication steps {experiment.name} fails: {outcome.reason}"
    finer = outcome.signals
    changes = {
        n: float(np.sqrt(np.mean((finer[n][::stride] - simulated[n]) ** 2)))
        for n in simulated.names
        if n in finer
    }
    name = experiment.name.partition("/")[2] or experiment.name
    return CouplingError(name, changes, noise, {n: simulated.units[n] for n in changes}, remedy)


def _halved(
    fmu: FmuDescription, spec: SimulationTable, experiment: Experiment, values: Mapping[str, float]
) -> tuple[Outcome, int, str] | None:
    """Run with half the steps: outcome, rows of it per row of the experiment, remedy; None if nothing is stepped."""
    plain = replace(experiment, reduce=None)
    if isinstance(fmu, SystemDescription):
        if not any(c.execution == "coupled" for c in fmu.system.components):
            return None
        with tempfile.TemporaryDirectory(prefix="thsa-cosim-halved-") as folder:
            halved = write_halved(fmu, Path(folder) / "halved.ssp")
            outcome = _run(spec, [replace(plain, fmu=halved)], values)
        return outcome, 1, "lower the steps of the components"
    steps = fmu.supports_co_simulation and fmu.capabilities.get(VARIABLE_STEP, False)
    if not steps or is_ours(fmu) or experiment.wrapper is not None or spec.interface == "model-exchange":
        return None
    if settle_handling(spec, [plain]).interface == "model-exchange":
        return None
    fine = replace(plain, name=f"{plain.name} at half the step", time=refined(plain.time, 2))
    outcome = _run(spec, [plain, fine], values)
    fine_run, within = outcome.signals, moves_within(fmu, plain.inputs)
    if fine_run is not None and within and own_step(fine_run.time, fine_run.values) is not None:
        return None  # shorter steps than its own tell nothing
    return outcome, 2, "lower simulation.step"


def _run(spec: SimulationTable, experiments: Sequence[Experiment], values: Mapping[str, float]) -> Outcome:
    """Run the last of ``experiments`` here, wherever the study runs: the archive is a file of this machine."""
    with Executor(workers=1).open_runner(spec, experiments) as runner:
        (outcome,) = runner.run([Job(experiments[-1].name, dict(values), keep_signals=True)])
    return outcome
