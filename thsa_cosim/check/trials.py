"""The trials of a check. Every one runs through ``batch``: an FMU that crashes, hangs or floods costs lines only."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from thsa_cosim.batch import Experiment, Job, LocalRunner, Outcome
from thsa_cosim.check.finding import Finding, Verdict
from thsa_cosim.fmu import FmuDescription, probe
from thsa_cosim.fmu.plant import Kind, Reuse
from thsa_cosim.signals import FloatArray, Signals

_STEP_OK, _STEP_WARNING = 1e-4, 1e-2
"""Change of an output, relative to its range, when the communication step is halved."""
_WARM_UP = 10
"""Cycles before memory is watched: interpreter and allocator settle."""
_LEAK_BYTES = 2048
"""Growth per cycle that counts as a leak; an interpreter alone stays well below."""
_SHORT = 200
"""Communication points of a run that is repeated to watch memory."""


class Trials:
    """Runs the trials one after the other and collects their lines."""

    def __init__(
        self,
        description: FmuDescription,
        values: dict[str, float],
        inputs: Signals | None,
        time: FloatArray | None,
        deadline_s: float,
        on_finding: Callable[[Finding], None] | None,
    ) -> None:
        self._description = description
        self._values = values
        self._inputs = inputs
        self._time = probe.trial_time(description) if time is None else time
        self._deadline = deadline_s
        self._on_finding = on_finding
        self._outputs = probe.observed(description)
        self._kind: Kind = "co-simulation" if description.supports_co_simulation else "model-exchange"
        self._first = Signals(self._time, {})
        self._changed = {
            name: value for name, value in probe.changed_parameters(description).items() if name not in values
        }
        self.findings: list[Finding] = []

    def _note(self, name: str, verdict: Verdict, text: str, **values: float) -> None:
        finding = Finding(name, verdict, text, values)
        self.findings.append(finding)
        if self._on_finding is not None:
            self._on_finding(finding)

    def _runner(self, reuse: Reuse = "fresh", kind: Kind | None = None) -> LocalRunner:
        """Open one worker process with three experiments: "trial", "halved" (step) and "short" (footprint)."""
        times = {
            "trial": self._time,
            "halved": probe.halved(self._time),
            "short": self._time[: max(2, min(len(self._time), _SHORT))],
        }
        experiments = [
            Experiment(
                name,
                self._description.path,
                self._inputs,
                self._outputs,
                time,
                self._values,
                reduce=probe.footprint if name == "short" else None,
            )
            for name, time in times.items()
        ]
        return LocalRunner(
            experiments,
            deadline_s=self._deadline,
            reuse=reuse,
            kind=kind or self._kind,
            backend="python",  # the same bits as machine code, and each process starts a second earlier
            recycle_growth_mb=1e6,
        )

    # -- lines ------------------------------------------------------------------------------------------
    def description_lines(self) -> None:
        """Say what the description alone shows."""
        problems = probe.validation_messages(self._description.path)
        more = f" (and {len(problems) - 3} more)" if len(problems) > 3 else ""
        text = "; ".join(problems[:3]) + more if problems else "fmpy's validation finds no problem"
        self._note("description", Verdict.WARNING if problems else Verdict.OK, text, problems=len(problems))
        missing = probe.missing_binary(self._description)
        self._note("platform", Verdict.FAILED if missing else Verdict.OK, missing or "has a binary for here")
        capabilities = self._description.capabilities
        wants = [
            sentence
            for flag, sentence in (
                ("needsExecutionTool", "needs its tool installed"),
                ("canBeInstantiatedOnlyOncePerProcess", "can be instantiated only once per process"),
            )
            if capabilities.get(flag)
        ]
        self._note("demands", Verdict.WARNING if wants else Verdict.OK, "; ".join(wants) or "none")
        if self._kind == "co-simulation":
            mode = probe.input_handling(self._description)
            text = {
                "derivative": "linear within a step, exactly (input derivatives)",
                "intermediate": "linear within a step, exactly (intermediate update)",
                "mean": "held over a step at the mean of its ends (second order in the step)",
            }[mode]
            self._note("inputs", Verdict.OK, text)

    def first_run(self) -> bool:
        """Run the default experiment; False if there is nothing to compare later."""
        later = ("fresh instance", "new process", "reset", "communication step", "memory", "file handles")
        if not self._outputs:
            self._note(
                "runs", Verdict.NOT_TRIED, "it has no floating-point output or local variable to watch"
            )
            return False
        with self._runner() as runner:
            outcome = runner.run([Job("trial")])[0]
        moved = "inputs at their start values" if self._inputs is None else "the given inputs"
        if outcome.ok and self._inputs is None and not _moves(outcome):
            self._inputs = probe.raised_inputs(self._description, self._time)
            raised = outcome
            if self._inputs is not None:
                with self._runner() as runner:
                    raised = runner.run([Job("trial")])[0]
            if self._inputs is not None and raised.ok:
                outcome, moved = raised, "inputs ramping away from their start values"
            else:
                self._inputs = None
        if not outcome.ok or outcome.signals is None:
            self._note("runs", Verdict.FAILED, f"{outcome.status}: {outcome.reason}")
            for name in later:
                self._note(name, Verdict.NOT_TRIED, "the first run failed")
            return False
        self._first = outcome.signals
        span = self._time[-1] - self._time[0]
        steps = len(self._time) - 1
        self._note(
            "runs",
            Verdict.OK if _moves(outcome) else Verdict.WARNING,
            f"{self._kind}, {span:g} s in {steps} steps, {moved}"
            + ("" if _moves(outcome) else "; no output moves, so what follows shows little"),
            duration_s=outcome.duration_s,
            steps=steps,
        )
        return True

    def fresh_lines(self, cycles: int) -> bool:
        """Use a new instance per run; return whether the FMU runs with other start values."""
        with self._runner() as runner:
            first, second, halved = runner.run([Job("trial"), Job("trial"), Job("halved")])
            self._compare("new process", first, "the first run in another process")
            self._compare("fresh instance", second, "a second instance in one process")
            self._step_line(halved)
            self._leak_lines("instances", runner.run([Job("short")] * (_WARM_UP + cycles)))
            return runner.run([Job("trial", self._changed)])[0].ok

    def reset_lines(self, cycles: int, runs_changed: bool) -> None:
        """Use one instance, reset before each run."""
        if self._description.fmi_version == "1.0":
            self._note("reset", Verdict.NOT_TRIED, "FMI 1.0 instances are not reset")
            return
        with self._runner("reset") as runner:
            second = runner.run([Job("trial"), Job("trial")])[1]
            self._compare("reset", second, "a second run after reset")
            name = "reset of start values"
            if self._changed and runs_changed:
                after = runner.run([Job("trial", self._changed), Job("trial")])[1]
                self._compare(name, after, "a run after one with other start values and reset")
            else:
                why = "it does not run with other start values" if self._changed else "it has none to change"
                self._note(name, Verdict.NOT_TRIED, why)
            self._leak_lines("resets", runner.run([Job("short")] * (_WARM_UP + cycles)))

    def _step_line(self, outcome: Outcome) -> None:
        name = "communication step"
        if self._kind != "co-simulation":
            self._note(name, Verdict.NOT_TRIED, "Model Exchange only: the importer's solver steps")
            return
        if not outcome.ok or outcome.signals is None:
            self._note(name, Verdict.WARNING, f"halved, it fails: {outcome.status}: {outcome.reason}")
            return
        coarse = {n: outcome.signals[n][::2] for n in self._outputs}
        change, worst = _largest_change(self._first, coarse)
        verdict = (
            Verdict.OK
            if change <= _STEP_OK
            else Verdict.WARNING
            if change <= _STEP_WARNING
            else Verdict.FAILED
        )
        text = f"halving {self._time[1] - self._time[0]:g} s changes {worst} by {change:.1e} of its range"
        self._note(name, verdict, text if change else "halving it changes nothing", change=change)

    def exchange_line(self) -> None:
        """Compare Co-Simulation with Model Exchange, integrated by the importer at a tight tolerance."""
        name = "model exchange"
        if self._kind != "co-simulation" or not self._description.supports_model_exchange:
            self._note(name, Verdict.NOT_TRIED, "it has one interface only")
            return
        with self._runner(kind="model-exchange") as runner:
            outcome = runner.run([Job("trial")])[0]
        if not outcome.ok or outcome.signals is None:
            self._note(name, Verdict.FAILED, f"{outcome.status}: {outcome.reason}")
            return
        change, worst = _largest_change(self._first, dict(outcome.signals.values))
        verdict = Verdict.OK if change <= 1e-3 else Verdict.WARNING
        text = f"{worst} differs from Co-Simulation by {change:.1e} of its range"
        self._note(name, verdict, text, change=change)

    def _leak_lines(self, way: str, outcomes: Sequence[Outcome]) -> None:
        memory, files = f"memory over {way}", f"file handles over {way}"
        failed = next((outcome for outcome in outcomes if not outcome.ok), None)
        if failed is not None:
            self._note(memory, Verdict.FAILED, f"{failed.status}: {failed.reason}")
            self._note(files, Verdict.NOT_TRIED, "a run failed")
            return
        prints = np.array([outcome.reduced for outcome in outcomes])[_WARM_UP:]
        if not np.isfinite(prints).all():
            for name in (memory, files):
                self._note(name, Verdict.NOT_TRIED, "this platform does not tell")
            return
        # Medians of both halves: a single step of the allocator is no leak.
        half = len(prints) // 2
        growth = float(np.median(prints[-half:, 1]) - np.median(prints[:half, 1])) / (len(prints) - half)
        leaks = growth > _LEAK_BYTES
        text = f"grows by {growth / 1024:.1f} KiB per run" if leaks else f"steady over {len(prints)} runs"
        verdict = Verdict.WARNING if leaks else Verdict.OK
        self._note(memory, verdict, text, growth_bytes_per_run=growth)
        left = float(prints[-1, 2] - prints[0, 2])
        text = f"{left:g} left open after {len(prints)} runs" if left > 0 else "none left open"
        self._note(files, Verdict.WARNING if left > 0 else Verdict.OK, text, left_open=left)

    def _compare(self, name: str, outcome: Outcome, what: str) -> None:
        if not outcome.ok or outcome.signals is None:
            self._note(name, Verdict.FAILED, f"{what}: {outcome.status}: {outcome.reason}")
            return
        found = dict(outcome.signals.values)
        if all(np.array_equal(self._first[n], found[n]) for n in self._outputs):
            self._note(name, Verdict.OK, f"{what} is bit-identical", change=0.0)
            return
        change, worst = _largest_change(self._first, found)
        verdict = Verdict.WARNING if change < 1e-9 else Verdict.FAILED
        self._note(name, verdict, f"{what} changes {worst} by {change:.1e} of its range", change=change)


def _moves(outcome: Outcome) -> bool:
    return outcome.signals is not None and any(np.ptp(v) > 0.0 for v in outcome.signals.values.values())


def _largest_change(first: Signals, found: Mapping[str, FloatArray]) -> tuple[float, str]:
    """Return the largest deviation relative to each signal's range (or size, if constant), and whose it is."""
    changes = {}
    for name in first.names:
        difference = float(np.max(np.abs(found[name] - first[name])))
        scale = max(float(np.ptp(first[name])), 1e-6 * float(np.max(np.abs(first[name]))))
        changes[name] = 0.0 if difference == 0.0 else difference / scale if scale > 0.0 else np.inf
    worst = max(changes, key=lambda name: changes[name])
    return changes[worst], worst
