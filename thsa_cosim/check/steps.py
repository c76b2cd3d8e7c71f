"""The trials of the communication step: half of it, twice, its parts, and the one that the FMU declares."""

import numpy as np

from thsa_cosim.batch import Job, Outcome, TimeIsOver
from thsa_cosim.batch.handling import refined
from thsa_cosim.batch.own_step import moves_within
from thsa_cosim.check import coupling, numerics
from thsa_cosim.check.bench import Bench
from thsa_cosim.check.budget import LONGEST_RUN
from thsa_cosim.check.finding import Verdict
from thsa_cosim.fmu import probe
from thsa_cosim.signals import FloatArray, Signals
from thsa_cosim.system.description import SystemDescription

_PARTS = (4, 8, 16, 32)
"""Into how many parts a step is divided that turns out to be too long."""


class StepTrials(Bench):
    """Says how much the results depend on the communication step."""

    def _step_lines(self, halved: Outcome, doubled: Outcome) -> None:
        name = "communication step"
        if isinstance(self._description, SystemDescription):
            trial = self._experiment("trial", self._time)
            self._take(
                name,
                coupling.coupling_line(
                    self._description, trial, self._first, self._deadline, self._watch.ends_at
                ),
            )
            return
        if self._kind != "co-simulation":
            self._note(name, Verdict.NOT_TRIED, "Model Exchange: the importer's solver steps")
            return
        step = float(self._time[1] - self._time[0])
        fixed = not self._description.capabilities.get("canHandleVariableCommunicationStepSize")
        judged = numerics.judge_step(self._first, halved, step, fixed, self._moves_within(self._inputs))
        self._halves = halved.ok
        if judged[0] is not Verdict.OK and self._may_be_cut():
            self._take(name, self._declared_step(step, fixed))
            return
        if judged[0] is Verdict.FAILED:
            try:
                shorter = self._shorter_runs(step, self._time, self._inputs)
            except TimeIsOver:
                self._take(name, (judged[0], f"{judged[1]}; shorter ones were not tried", judged[2]))
                raise
            judged = numerics.judge_shorter_steps(judged, [(step / 2, halved), *shorter], self._step_is_ours)
        self._take(name, judged)
        if len(self._time) > 2 and self._given.inputs is None:  # else the step is the user's
            change = judged[2].get("change", 0.0)
            self._take("longer step", numerics.judge_longer_step(self._first, doubled, step, change))

    @property
    def _step_is_ours(self) -> bool:
        """Whether neither the FMU nor the user says how long a step is."""
        given = self._given
        return given.time is None and given.step is None and not self._description.default_experiment.step

    def _moves_within(self, inputs: Signals | None) -> bool:
        return moves_within(self._description, inputs)

    def _declared_step(self, coarse: float, fixed: bool) -> numerics.Judged:
        """Halve the step that the FMU declares, over the begin of the experiment."""
        time = self._given.communication_points(self._description, cut=True)
        step, inputs = float(time[1] - time[0]), self._excited(time=time)
        grids = {"declared": time, "declared/2": probe.halved(time)}
        with self._runner(more=[self._experiment(n, t, inputs) for n, t in grids.items()]) as runner:
            whole, halved = runner.run([Job(name) for name in grids])
        if whole.signals is None:
            text = f"{coarse:g} s is too long, and its own {step:g} s fails: {whole.status}: {whole.reason}"
            return Verdict.FAILED, text, {}
        judged = numerics.judge_step(whole.signals, halved, step, fixed, self._moves_within(inputs))
        if judged[0] is Verdict.FAILED:
            shorter = [(step / 2, halved), *self._shorter_runs(step, time, inputs)]
            judged = numerics.judge_shorter_steps(judged, shorter)
        verdict, text, values = judged
        text = f"{text}, over {np.ptp(time):g} s; {coarse:g} s, with which the stop time was reached, is too long"
        return verdict, text, values

    def _shorter_runs(
        self, step: float, time: FloatArray, inputs: Signals | None
    ) -> list[tuple[float, Outcome]]:
        """Runs with a quarter of the step and less, as far as they are affordable."""
        parts = [n for n in _PARTS if self._budget.run_s * n < LONGEST_RUN * 10]
        finer = [self._experiment(f"h/{n}", refined(time, n), inputs) for n in parts]
        if not finer:
            return []
        with self._runner(more=finer) as runner:
            outcomes = runner.run([Job(e.name) for e in finer])
        return [(step / n, outcome) for n, outcome in zip(parts, outcomes, strict=True)]
