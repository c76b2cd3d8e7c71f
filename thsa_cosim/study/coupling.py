"""What communication steps cost, of a foreign FMU or of a system's components, next to the sensors' noise.

A run at half the steps, with the values that were found.
"""

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from thsa_cosim.batch import Experiment, Job, Outcome
from thsa_cosim.batch.handling import refined
from thsa_cosim.batch.own_step import moves_within, own_step
from thsa_cosim.fmu import FmuDescription
from thsa_cosim.fmu.inputs import is_ours
from thsa_cosim.fmu.plant import VARIABLE_STEP
from thsa_cosim.scenario import Executor, OpenRunner, SimulationTable
from thsa_cosim.scenario.handling import settle_handling
from thsa_cosim.signals import FloatArray, Signals
from thsa_cosim.system.description import SystemDescription
from thsa_cosim.system.write import write_halved

LARGE = 0.5
"""Change over noise from which on a result is said to depend on the communication step."""
LARGE_SHARE = 0.01
"""The same over the range of a signal that no sensor has measured, as in a check."""

_STANDARD_ERRORS = 3.0
"""A shift of a value, in its standard errors, that is worth a word where it is only a bound."""
LARGE_SHIFT = 1.0
"""The same from which on a projected shift is a reason against trust, and widens the stated errors."""


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
    ranges: Mapping[str, float] = field(default_factory=dict)
    """Of the signals, in the same: what counts where there is no noise, as in a tuning."""
    samples: int = 0
    """Compared; a change that looks like that of one parameter moves it by sqrt(samples) times change over noise."""
    differences: Mapping[str, FloatArray] = field(default_factory=dict, repr=False, compare=False)
    """Signals at half the steps less those at the whole ones, (n,) each, in their units."""
    shifts: Mapping[str, float] = field(default_factory=dict)
    """Where each identified value would go without steps, in its standard errors; empty where none is known."""

    @property
    def moved(self) -> Mapping[str, float]:
        """The shifts where one of them is large, the largest first; else empty."""
        large = any(abs(s) > LARGE_SHIFT for s in self.shifts.values())
        return dict(sorted(self.shifts.items(), key=lambda item: -abs(item[1]))) if large else {}

    @property
    def has_noise(self) -> bool:
        """Whether there are sensors to compare with."""
        return any(self.noise.get(n, 0.0) > 0.0 for n in self.changes)

    @property
    def worst(self) -> tuple[str, float]:
        """The signal whose change is largest over its noise (without any: its range), and that ratio."""
        size = self.noise if self.has_noise else self.ranges
        ratios = {n: c / size[n] for n, c in self.changes.items() if size.get(n, 0.0) > 0.0}
        name = max(ratios, key=ratios.__getitem__, default="")
        return name, ratios.get(name, 0.0)

    def sentence(self) -> str:
        """What a reader is told."""
        name, ratio = self.worst
        if not name:
            return (
                f"halving the communication steps: no signal of {self.recording} has a noise or a range to compare"
                " with"
            )
        over = f"{ratio:.2g} times its noise" if self.has_noise else f"{100.0 * ratio:.2g} % of its range"
        size = f"{self.changes[name]:.2g} {self.units[name]} rms, {over}"
        said = f"halving the communication steps changes {name} by {size} ({self.recording})"
        if self.shifts:
            return said + self._moved()
        at_worst = ratio * float(np.sqrt(self.samples)) if self.has_noise else 0.0
        if at_worst > _STANDARD_ERRORS:
            said += f", which may move a value by up to {at_worst:.0f} of its standard errors"
        return said

    def _moved(self) -> str:
        """The large shifts in words, which follow a sentence; "" without any."""
        if not self.moved:
            return ""
        first, *others = [f"{n} by {s:+.2g}" for n, s in self.moved.items() if abs(s) > LARGE_SHIFT]
        named = ", ".join([f"{first} standard errors", *others])
        return (
            f"; without steps it would move {named} (projected on the parameters), and the stated errors are widened by"
            " as much, in quadrature"
        )

    @property
    def reason(self) -> str:
        """Why values are not to be trusted, or ""."""
        limit = LARGE if self.has_noise else LARGE_SHARE
        large = self.worst[1] > limit or bool(self.moved)
        return f"{self.sentence()}; {self.remedy}" if large else ""

    @property
    def note(self) -> str:
        """The sentence for the notes of a result, with the remedy where one is due."""
        return f"WARNING: {self.reason}" if self.reason else self.sentence()

    def to_dict(self) -> dict[str, object]:
        """JSON types."""
        return {
            "recording": self.recording,
            **({"shifts_in_standard_errors": dict(self.shifts)} if self.shifts else {}),
            "halved": {
                name: {
                    "rms": change,
                    "noise": self.noise.get(name),
                    "range": self.ranges.get(name),
                    "unit": self.units[name],
                }
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
    opening: OpenRunner | None = None,
) -> CouplingError | str:
    """Run ``experiment`` at ``values`` once more with half the steps, and compare with ``simulated``.

    ``opening``: opens the processes, as of a study that keeps its runs; left out: one process here. What is wrapped
    around an FMU does not depend on its steps: it is left out, and the FMU alone is run at both steps.
    Returns a sentence where that run fails, and "" where nothing depends on a communication step: in Model Exchange,
    with FMUs of this toolkit, and with those that take steps of one size or step by themselves.
    """
    own = experiment.wrapper_names
    plain = replace(
        experiment,
        reduce=None,
        wrapper=None,
        outputs=tuple(n for n in experiment.outputs if n in fmu.variables),
        fixed={name: value for name, value in experiment.fixed.items() if name not in own},
    )
    values = {name: value for name, value in values.items() if name not in own}
    found = _halved(fmu, spec, plain, values, opening or Executor(workers=1).open_runner, both=bool(own))
    if found is None:
        return ""
    outcomes, stride, remedy = found
    failed = next((o for o in outcomes if o.signals is None), None)
    if failed is not None:
        return f"with half the communication steps {experiment.name} fails: {failed.reason}"
    runs = [o.signals for o in outcomes if o.signals is not None]
    finer, simulated = runs[-1], runs[0] if own else simulated
    differences = {n: finer[n][::stride] - simulated[n] for n in simulated.names if n in finer}
    changes = {n: float(np.sqrt(np.mean(d**2))) for n, d in differences.items()}
    name = experiment.name.partition("/")[2] or experiment.name
    units = {n: simulated.units[n] for n in changes}
    ranges = {n: _range(simulated[n]) for n in changes}
    samples = len(simulated.time)
    return CouplingError(name, changes, noise, units, remedy, ranges, samples, differences)


def _range(values: FloatArray) -> float:
    """Largest less smallest of (n,); 0 where that is rounding."""
    width = float(np.ptp(values))
    return width if width > 1e-9 * float(np.max(np.abs(values), initial=0.0)) else 0.0


def _halved(
    fmu: FmuDescription,
    spec: SimulationTable,
    plain: Experiment,
    values: Mapping[str, float],
    opening: OpenRunner,
    both: bool,
) -> tuple[list[Outcome], int, str] | None:
    """Run with half the steps: outcome, rows of it per row of the experiment, remedy; None if nothing is stepped.

    ``both``: with the whole steps before.
    """
    if isinstance(fmu, SystemDescription):
        if not any(c.execution == "coupled" for c in fmu.system.components):
            return None
        with tempfile.TemporaryDirectory(prefix="thsa-cosim-halved-") as folder:
            halved = write_halved(fmu, Path(folder) / "halved.ssp")
            finer = replace(plain, name=f"{plain.name} at half the steps", fmu=halved)
            outcomes = _run(spec, [plain, finer] if both else [finer], values, opening, both)
        return outcomes, 1, "lower the steps of the components"
    steps = fmu.supports_co_simulation and fmu.capabilities.get(VARIABLE_STEP, False)
    if not steps or is_ours(fmu) or spec.interface == "model-exchange":
        return None
    if settle_handling(spec, [plain]).interface == "model-exchange":
        return None
    fine = replace(plain, name=f"{plain.name} at half the step", time=refined(plain.time, 2))
    outcomes = _run(spec, [plain, fine], values, opening, both)
    fine_run, within = outcomes[-1].signals, moves_within(fmu, plain.inputs)
    if fine_run is not None and within and own_step(fine_run.time, fine_run.values) is not None:
        return None  # shorter steps than its own tell nothing
    exact = ', or set simulation.interface = "model-exchange"' if fmu.supports_model_exchange else ""
    return outcomes, 2, f"lower simulation.step{exact}"


def _run(
    spec: SimulationTable,
    experiments: Sequence[Experiment],
    values: Mapping[str, float],
    opening: OpenRunner,
    both: bool,
) -> list[Outcome]:
    """Run the last of ``experiments``, or ``both``."""
    with opening(spec, experiments) as runner:
        jobs = [Job(e.name, dict(values), keep_signals=True) for e in experiments]
        return runner.run(jobs if both else jobs[-1:])
