"""What the trials of an FMU share: its excitation, the worker processes, a first run that succeeds."""

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from thsa_cosim.batch import Experiment, Job, LocalRunner, Outcome, Status, TimeIsOver
from thsa_cosim.batch.handling import HandlingTrial, try_input_handling
from thsa_cosim.batch.repetition import try_repetition
from thsa_cosim.check import numerics
from thsa_cosim.check.budget import LEAST, LONGEST_RUN, SLOW_SHARES, TOTAL, Budget, Watch, is_slow
from thsa_cosim.check.excitation import Excitation
from thsa_cosim.check.finding import Finding, Verdict
from thsa_cosim.fmu import FmuDescription, probe
from thsa_cosim.fmu.inputs import is_ours
from thsa_cosim.fmu.plant import Backend, Kind, Reuse
from thsa_cosim.signals import FloatArray, Signals

_WARM_UP = 10
"""Cycles before memory is watched: interpreter and allocator settle."""
_SHORT = 200
"""Communication points of a run that is repeated to watch memory."""
_CYCLES = 50
_LONG = 3000
_FEWEST = 10
"""Communication points before an FMU ends the simulation itself, below which nothing can be tried."""
_ENDED = re.compile(r"ended the simulation at t = (\S+) s")
_KILLED = re.compile(r"while stepping at t = (\S+) s")
_BEFORE = 0.9
"""Share of the time at which a run was killed, up to which it is run again."""
_BY_INPUTS = (Status.NOT_FINITE, Status.FMI_ERROR, Status.FMI_DISCARD, Status.INCOMPLETE)
"""How a run may fail because its inputs ask too much."""


class Bench:
    """Runs an FMU as a check does; ``first_outcome`` settles how."""

    def __init__(
        self,
        description: FmuDescription,
        excitation: Excitation,
        deadline_s: float,
        on_finding: Callable[[Finding], None] | None,
        limit_s: float = TOTAL,
    ) -> None:
        self._watch = Watch(limit_s)
        self._description = description
        self._given = excitation
        self._values = dict(excitation.values)
        self._time = excitation.communication_points(description)
        self._whole = self._time  # the run whose inputs are given, of which ``_time`` may be the begin
        self._seen: tuple[Outcome, FloatArray] | None = (
            None  # the last run that told something, and its points
        )
        self._inputs = self._excited()
        self._deadline = deadline_s
        self._on_finding = on_finding
        self._outputs = probe.observed(description)
        self._kind: Kind = excitation.kind or (
            "co-simulation" if description.supports_co_simulation else "model-exchange"
        )
        self._mode = excitation.input_mode
        self._handling: HandlingTrial | None = None
        self._first = Signals(self._time, {})
        self._halves = True
        self._fault, self._limits = "", dict[str, Any]()
        self._budget = Budget()
        self._rests = False
        self._runs_changed = False
        self._slowness = ""
        self._cut = False
        self._is_unsettled = False
        self._changed = {
            name: value
            for name, value in probe.changed_parameters(description).items()
            if name not in self._values
        }
        self.findings: list[Finding] = []

    def _excited(
        self, *, times: float = 1.0, only: str | None = None, time: FloatArray | None = None
    ) -> Signals | None:
        if self._given.inputs is not None:
            return self._given.inputs
        return probe.kinked_inputs(
            self._description,
            self._time if time is None else time,
            ends=self._given.ends,
            times=times,
            only=only,
            whole=self._whole if time is None else None,
        )

    def _note(self, name: str, verdict: Verdict, text: str, **values: float) -> None:
        finding = Finding(name, verdict, text, values)
        self.findings.append(finding)
        if self._on_finding is not None:
            self._on_finding(finding)

    def _take(self, name: str, judged: numerics.Judged) -> None:
        verdict, text, values = judged
        self._note(name, verdict, text, **values)

    def _experiment(self, name: str, time: FloatArray, inputs: Signals | None = None) -> Experiment:
        return Experiment(
            name,
            self._description.path,
            inputs or self._inputs,
            self._outputs,
            time,
            self._values,
            tolerance=self._given.tolerance,
            input_mode=self._mode if self._kind == "co-simulation" else None,
            texts=self._given.texts,
        )

    def _runner(
        self,
        reuse: Reuse = "fresh",
        kind: Kind | None = None,
        more: Sequence[Experiment] = (),
        backend: Backend | Literal["auto"] | None = "auto",
        *,
        in_time: bool = True,
    ) -> LocalRunner:
        """Open one worker process with "trial", "halved" and "doubled" (step), "short" (footprint) and ``more``."""
        experiments = [
            self._experiment("trial", self._time),
            self._experiment("halved", probe.halved(self._time)),
            self._experiment("doubled", self._time[::2] if len(self._time) > 2 else self._time),
            replace(
                self._experiment("short", self._time[: self._short_points()]),
                reduce=probe.footprint,
            ),
            *more,
        ]
        return LocalRunner(
            experiments,
            deadline_s=self._deadline,
            ends_at=self._watch.ends_at if in_time else None,
            reuse=reuse,
            kind=kind or self._kind,
            backend=self._backend if backend == "auto" else backend,
            recycle_growth_mb=1e6,
            **self._limits,
        )

    def _many(
        self, runner: LocalRunner, jobs: Sequence[Job], *, stop_at_failure: bool = False, least: int = LEAST
    ) -> list[Outcome]:
        """Outcomes of ``jobs`` one after the other; fewer where they take longer than a line may.

        TimeIsOver where the time for the check is over before there are ``least``.
        """
        outcomes: list[Outcome] = []
        for k in self._watch.while_affordable(len(jobs)):
            try:
                outcomes += runner.run([jobs[k]])
            except TimeIsOver:
                if len(outcomes) < least:
                    raise
                break
            if stop_at_failure and not outcomes[-1].ok:
                break
        return outcomes

    def _short_runs(self, cycles: int) -> int:
        return self._budget.runs(_WARM_UP + cycles, self._short_points())

    def _short_points(self) -> int:
        return self._budget.points_for(_WARM_UP + _CYCLES, min(len(self._time), _SHORT))

    @property
    def _is_free(self) -> bool:
        """Whether nobody said how long to simulate."""
        return self._given.time is None and self._given.duration is None

    def first_outcome(self) -> tuple[Outcome, str]:
        """The first run that succeeds, whole if possible, and what is to be said where it is not."""
        whole = self._time
        try:
            return self._settled()
        except TimeIsOver:
            return self._when_time_is_over(whole)

    def _when_time_is_over(self, whole: FloatArray) -> tuple[Outcome, str]:
        """What is known of the first run where the time is over before it is settled how to run."""
        if self._seen is None:
            self._run_once(in_time=False)
        assert self._seen is not None
        outcome, self._time = self._seen
        if outcome.ok and len(self._time) < len(whole):
            return outcome, f"; tried to {np.ptp(self._time):.3g} s of {np.ptp(whole):g} s"
        found = _KILLED.search(outcome.reason) if outcome.status is Status.TIMEOUT else None
        if found and np.count_nonzero(whole <= float(found[1])) >= _FEWEST:
            self._is_unsettled = True
            reason = f"{outcome.reason} of {whole[-1]:g} s: whether it is slow or hangs there was not tried"
            return replace(outcome, reason=f"{reason} (see --time-limit and --deadline)"), ""
        return outcome, ""

    def _settled(self) -> tuple[Outcome, str]:
        whole = self._time
        outcome = self._try()
        reason, doubt = outcome.reason, ""
        if outcome.status is Status.TIMEOUT and self._is_free:
            outcome, doubt = self._cut_to_what_is_fast(outcome)
        elif not outcome.ok and self._may_be_cut():
            self._shorten(self._given.communication_points(self._description, cut=True))
            outcome = self._try()
            done = f"{np.ptp(self._time):g} s of {np.ptp(whole):g} s"
            doubt = f"; only {done}, as it fails in longer steps ({reason})"
        if not outcome.ok and self._given.kind is None and self._kind == "co-simulation":
            self._shorten(whole)
            outcome, doubt = self._fall_back(outcome)
        if not outcome.ok and outcome.status in _BY_INPUTS:
            outcome, doubt = self._at_rest(outcome)
        if outcome.status is Status.INCOMPLETE:
            outcome, doubt = self._until_it_ends(outcome)
        return outcome, doubt

    def _until_it_ends(self, failed: Outcome) -> tuple[Outcome, str]:
        """Try an FMU that ends the simulation itself (terminateSimulation, fmi2Terminated) up to that time."""
        found = _ENDED.search(failed.reason)
        before = self._time[self._time <= float(found[1])] if found else self._time[:0]
        if len(before) < _FEWEST:
            return failed, ""
        whole = self._time
        self._cut_at(before)
        outcome = self._try()
        if not outcome.ok:
            self._shorten(whole)
            return failed, ""
        return outcome, f"; it ends the simulation itself at t = {before[-1]:g} s of {whole[-1]:g} s"

    def _at_rest(self, failed: Outcome) -> tuple[Outcome, str]:
        """Hold inputs of which nobody said where they run: does it fail because of them?"""
        if self._given.inputs is not None or self._inputs is None or self._given.ends:
            return failed, ""
        moving, self._inputs = self._inputs, self._still()
        outcome = self._try()
        if outcome.ok:
            self._rests = True
            doubt = f"; with inputs that move it fails ({failed.reason}): say how far they run (--input NAME=VALUE)"
            return outcome, doubt
        self._inputs = moving
        return replace(failed, reason=f"{failed.reason}; with its inputs at rest it fails, too"), ""

    @property
    def _moving(self) -> tuple[str, ...]:
        """Inputs that move, or are the user's; in the begin of a run some are still at rest."""
        if self._inputs is None:
            return ()
        given = self._given.inputs is not None or len(self._time) == len(self._whole)
        return tuple(n for n, v in self._inputs.values.items() if given or np.ptp(v[: len(self._time)]) > 0.0)

    def _still(self) -> Signals:
        assert self._inputs is not None
        held = {n: np.full(len(self._time), v[0]) for n, v in self._inputs.values.items()}
        return Signals(self._time, held)

    def _shorten(self, time: FloatArray) -> None:
        self._time = self._whole = time
        self._inputs = self._excited()

    def _cut_at(self, begin: FloatArray) -> None:
        """Run the begin of an experiment, with its inputs as they are."""
        self._time = begin
        self._inputs = self._excited()

    def _cut_to_what_is_fast(self, killed: Outcome) -> tuple[Outcome, str]:
        """Run the begin of an experiment that outlasts the deadline, unless it hangs there."""
        whole = self._time
        for share in SLOW_SHARES:
            points = max(int(share * len(whole)), 2)
            self._cut_at(whole[:points])
            outcome = self._run_once()
            if outcome.status is Status.TIMEOUT:
                continue
            slow = outcome.ok and is_slow(outcome.duration_s, share, self._deadline)
            if not outcome.ok or not (slow or self._is_slow_later(killed, whole)):
                break
            fast = int(np.clip(points * LONGEST_RUN / max(outcome.duration_s, 1e-9), 2, points))
            pace = outcome.duration_s / np.ptp(self._time)
            self._cut_at(whole[:fast])
            self._cut = True
            slow_text = (
                f"; slow: 1 s of it takes {pace:.2g} s, all of it more than {self._deadline:g} s (see --deadline);"
                f" tried to {np.ptp(self._time):.3g} s of {np.ptp(whole):g} s"
            )
            return self._try(), slow_text
        if outcome.ok or outcome.status is Status.TIMEOUT:
            return killed, ""
        tried = f"over its first {np.ptp(self._time):g} s it fails ({outcome.reason})"
        return replace(killed, reason=f"{killed.reason}; {tried}: see --deadline, --duration and --input"), ""

    def _is_slow_later(self, killed: Outcome, whole: FloatArray) -> bool:
        """Whether a run that was killed had got there slowly; else it was quick and hangs there."""
        found = _KILLED.search(killed.reason)
        before = whole[whole <= _BEFORE * float(found[1])] if found else whole[:0]
        if len(before) < _FEWEST:
            return False
        self._cut_at(before)
        outcome = self._run_once()
        return outcome.status is Status.TIMEOUT or is_slow(outcome.duration_s, 1.0, self._deadline)

    def _try(self) -> Outcome:
        """Run once; find out how inputs are to be given, and run so."""
        outcome = self._first_once()
        if outcome.ok and outcome.duration_s > LONGEST_RUN and self._is_free and not self._cut:
            seconds, points = np.ptp(self._time), len(self._time)
            self._cut_at(self._time[: int(np.clip(points * LONGEST_RUN / outcome.duration_s, 2, points))])
            self._slowness = (
                f"; it took {outcome.duration_s:.3g} s, so what follows is tried over"
                f" {np.ptp(self._time):.3g} s of {seconds:g} s"
            )
            outcome = self._run_once()
        told = self._given.input_mode is not None or is_ours(self._description)
        if told or not outcome.ok or self._kind != "co-simulation":
            return outcome
        self._handling = try_input_handling(
            self._experiment("handling", self._time), deadline_s=self._deadline, **self._options
        )
        best = self._handling.best
        self._mode = None if best is None else best.mode
        return self._run_once()

    def _first_once(self) -> Outcome:
        """Run once; see whether a second run of a foreign FMU may share the process."""
        if is_ours(self._description) or self._fault:
            return self._run_once()
        try:
            repetition = try_repetition(
                self._experiment("trial", self._time),
                kind=self._kind,
                deadline_s=self._deadline,
                backend=self._backend,
                ends_at=self._watch.ends_at,
            )
        except TimeIsOver as over:
            if not over.outcomes:
                raise
            self._remember(over.outcomes[0])
            raise
        self._remember(repetition.first)
        self._fault, self._limits = repetition.fault, repetition.limits
        return repetition.first

    @property
    def _backend(self) -> Backend | None:
        """The same bits, and a process starts a second earlier than with machine code."""
        return "python" if len(self._time) < _LONG else None

    @property
    def _options(self) -> dict[str, Any]:
        return {**self._limits, "ends_at": self._watch.ends_at}

    def _run_once(self, *, in_time: bool = True) -> Outcome:
        with self._runner(in_time=in_time) as runner:
            (outcome,) = runner.run([Job("trial")])
        self._remember(outcome)
        return outcome

    def _remember(self, outcome: Outcome) -> None:
        """Keep what is to be said of the FMU where the time is over before more is known."""
        if outcome.ok or self._seen is None or not self._seen[0].ok:
            self._seen = outcome, self._time

    def _may_be_cut(self) -> bool:
        given = self._given
        return given.time is None and given.step is None and given.duration is None and self._was_coarsened()

    def _was_coarsened(self) -> bool:
        """Whether the steps are longer than what the FMU declares, so that the stop time is reached."""
        declared = self._given.communication_points(self._description, cut=True)
        return bool(self._time[1] - self._time[0] > 1.001 * (declared[1] - declared[0]))

    def _fall_back(self, failed: Outcome) -> tuple[Outcome, str]:
        """Try Model Exchange where Co-Simulation does not run."""
        if not self._description.supports_model_exchange or self._description.fmi_version == "1.0":
            return failed, ""
        self._kind = "model-exchange"
        outcome = self._try()
        if not outcome.ok:
            self._kind = "co-simulation"
            return failed, ""
        return outcome, f'; Co-Simulation fails ({failed.reason}): set interface = "model-exchange"'
