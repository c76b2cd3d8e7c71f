"""The trials of a check. Every one runs through ``batch``: an FMU that crashes, hangs or floods costs lines only."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from thsa_cosim.batch import Job, LocalRunner, Outcome, TimeIsOver
from thsa_cosim.batch.handling import HandlingTrial, largest_change, refined, said
from thsa_cosim.check import coupling, numerics
from thsa_cosim.check.budget import Budget
from thsa_cosim.check.finding import Verdict
from thsa_cosim.check.steps import StepTrials
from thsa_cosim.fmu import probe
from thsa_cosim.fmu.inputs import input_modes, is_ours
from thsa_cosim.fmu.plant import Kind
from thsa_cosim.signals import Signals
from thsa_cosim.system.description import SystemDescription

_WARM_UP = 10
"""Cycles before memory is watched: interpreter and allocator settle."""
_LEAK_BYTES = 2048
"""Growth per cycle that counts as a leak; an interpreter alone stays well below."""
_ONE_BY_ONE = 60
"""Parameters, and inputs, that are tried one by one at most."""
_MANY_STEPS = 20_000
_LARGER = (10.0, 100.0)
_TOLERANCE, _TIGHTER = 1e-6, 0.01


class Trials(StepTrials):
    """Runs the trials one after the other and collects their lines."""

    # -- lines ------------------------------------------------------------------------------------------
    def description_lines(self) -> None:
        """Say what the description alone shows."""
        if isinstance(self._description, SystemDescription):
            for name, judged in coupling.system_lines(self._description):
                self._take(name, judged)
            return
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

    def first_run(self) -> bool:
        """Run once, excited, to the stop time; False if there is nothing to compare later."""
        later = ("fresh instance", "new process", "reset", "communication step", "memory", "file handles")
        if not self._outputs:
            self._note(
                "runs",
                Verdict.NOT_TRIED,
                "it has no number among its outputs, states and local variables to watch",
            )
            return False
        whole = self._time
        outcome, doubt = self.first_outcome()
        if not outcome.ok or outcome.signals is None:
            failed = Verdict.WARNING if self._is_unsettled else Verdict.FAILED
            self._note("runs", failed, f"{outcome.status}: {outcome.reason}")
            for name in later:
                self._note(name, Verdict.NOT_TRIED, "the first run failed")
            return False
        self._budget = Budget(outcome.duration_s, len(self._time))
        self._first = outcome.signals
        if (judged := numerics.judge_first_values(self._first)) is not None:
            self._take("first values", judged)
        does = numerics.moves(outcome.signals)
        reached = whole if self._slowness else self._time
        steps, doubt = len(reached) - 1, doubt + self._slowness
        self._note(
            "runs",
            Verdict.OK if does and not doubt else Verdict.WARNING,
            f"{self._kind}, {np.ptp(reached):g} s in {steps} steps{self._whose_duration()}, {self._moved()}{doubt}"
            + ("" if does else "; no output moves, so what follows shows little"),
            duration_s=outcome.duration_s,
            steps=steps,
        )
        return True

    def lines(self, cycles: int) -> None:
        """Try one line after the other, until the time for the whole check is over."""
        left: dict[str, Callable[[], object]] = {
            "inputs": self.inputs_lines,
            "fresh instance and communication step": lambda: self.fresh_lines(cycles),
            "start values": self.start_value_line,
            "larger inputs": self.larger_inputs_line,
            "reset": lambda: self.reset_lines(cycles),
            "model exchange": self.exchange_line,
        }
        for name in tuple(left):
            if self._watch.is_over:
                self._say_time_is_over(f"not tried are {', '.join(left)}")
                return
            try:
                left.pop(name)()
            except TimeIsOver:
                untried = f"; not tried are {', '.join(left)}" if left else ""
                self._say_time_is_over(f"not finished is {name}{untried}")
                return

    def _say_time_is_over(self, what: str) -> None:
        self._note("time", Verdict.WARNING, f"{self._watch.limit_s:g} s are over (--time-limit): {what}")

    def _whose_duration(self) -> str:
        stop = self._description.default_experiment.stop
        given = self._given.duration is not None or self._given.time is not None
        return "" if given or stop is not None else " (it declares no stop time: see --duration)"

    def _moved(self) -> str:
        if self._given.inputs is not None:
            return "the given inputs"
        if self._inputs is None:
            return "no floating-point inputs to move"
        if self._rests or not self._moving:
            return "inputs at their start values"
        return "inputs ramping away from their start values, with kinks"

    def inputs_lines(self) -> None:
        """Say how inputs are given, and which of them do something."""
        if self._inputs is None:
            self._note("inputs", Verdict.OK, "it has none that are floating-point numbers")
            return
        if is_ours(self._description):
            mode = input_modes(self._description, probe.excitable(self._description))[-1]
            self._note(
                "inputs", Verdict.OK, f"linear within a step, exactly ({mode}; an FMU of this toolkit)"
            )
        elif not self._moving:
            text = f"they do not move yet in the first {np.ptp(self._time):.3g} s, which were tried: see --duration"
            self._note("inputs", Verdict.NOT_TRIED, text)
            return
        elif self._kind == "model-exchange" or self._handling is not None:
            trial = self._handling or HandlingTrial("", (), True)
            self._take("inputs", numerics.judge_handling(trial, self._kind))
        every = [v.name for v in probe.excitable(self._description)]
        names = [n for n in every if n in self._moving][: self._budget.runs(_ONE_BY_ONE)]
        if self._given.inputs is not None or self._rests or len(names) < 2:
            return
        alone = [self._experiment("none", self._time, self._still())]
        alone += [self._experiment(f"input {n}", self._time, self._excited(only=n)) for n in names]
        with self._runner(more=alone) as runner:
            outcomes = self._many(runner, [Job(e.name) for e in alone])
        if outcomes[0].signals is not None:
            changed = dict(zip(names, outcomes[1:], strict=False))
            untried = len(every) - len(changed)
            judged = numerics.judge_changes(outcomes[0].signals, changed, "inputs", untried)
            self._take("each input", judged)

    def start_value_line(self) -> None:
        """Change one start value after the other: each must change something, compared with a fresh instance."""
        name = "start values"
        usual = probe.changed_parameters(self._description, zeros=True)
        changed: dict[str, tuple[float, ...]] = {n: (v,) for n, v in usual.items()}
        changed.update(self._given.alternatives)
        named = self._given.parameters or tuple(n for n in changed if n not in self._values)
        most = self._budget.runs(_ONE_BY_ONE)
        tried = {n: changed[n] for n in named[:most] if n in changed}
        if not tried:
            self._note(name, Verdict.NOT_TRIED, "it has no parameter to change")
            return
        # Machine code takes a second to load, and pays where there are many steps.
        many = len(tried) * len(self._time) > _MANY_STEPS
        # What the scenario gives a value of its own differs from what is declared, and rightly.
        own = tried.keys() - self._values.keys()
        declared = {
            v.name: v.start for v in self._description.parameters if v.name in own and v.start is not None
        }
        with self._runner(backend=None if many else "python") as runner:
            jobs = [Job("trial", declared), *(Job("trial", {n: v[0]}) for n, v in tried.items())]
            # The first in its process, as the one it is compared with.
            as_declared, *outcomes = self._many(runner, jobs)
            found = dict(zip(tried, outcomes, strict=False))
            # A failure that would come after the end of the run shows with another time only.
            again = [Job("trial", {n: v}) for n in self._silent(found) for v in tried[n][1:]]
            for job, outcome in zip(again, self._many(runner, again, least=0), strict=False):
                (parameter,) = job.values
                if outcome.ok and self._silent({parameter: found[parameter]}):
                    found[parameter] = outcome
        if (
            self._is_ok("new process")
            and (judged := numerics.judge_declared(self._first, as_declared)) is not None
        ):
            self._take("declared values", judged)
        untried = sum(n in changed for n in named[most:]) + len(tried) - len(found)
        self._take(name, numerics.judge_changes(self._first, found, "start values", untried))

    def _silent(self, outcomes: Mapping[str, Outcome]) -> list[str]:
        return numerics.silent(self._first, outcomes)

    def fresh_lines(self, cycles: int) -> None:
        """Use a new instance per run; find out whether the FMU runs with other start values."""
        with self._runner() as runner:
            first, second, halved, doubled = runner.run(
                [Job("trial"), Job("trial"), Job("halved"), Job("doubled")]
            )
            self._compare("new process", first, "the first run in another process")
            refused = runner.one_run_per_process
            if self._fault:
                text = (
                    f"{self._fault}, a new process nothing: the library keeps something (static variables, random"
                    f" numbers); each run gets a separate process"
                )
                self._note("fresh instance", Verdict.WARNING, text)
            elif refused:
                text = f"a second one in a process is refused ({refused}): each run gets a separate process, or a reset"
                self._note("fresh instance", Verdict.WARNING, text)
            else:
                self._compare("fresh instance", second, "a second instance in one process")
            self._step_lines(halved, doubled)
            if refused or self._fault:
                for name in ("memory over instances", "file handles over instances"):
                    self._note(name, Verdict.NOT_TRIED, "there is one instance per process")
            else:
                self._leak_lines("instances", runner, cycles)
            self._runs_changed = runner.run([Job("trial", self._changed)])[0].ok

    def reset_lines(self, cycles: int) -> None:
        """Use one instance, reset before each run."""
        if self._description.fmi_version == "1.0":
            self._note("reset", Verdict.NOT_TRIED, "FMI 1.0 instances are not reset")
            return
        with self._runner("reset") as runner:
            second = runner.run([Job("trial"), Job("trial")])[1]
            self._compare("reset", second, "a second run after reset")
            name = "reset of start values"
            if self._changed and self._runs_changed:
                after = runner.run([Job("trial", self._changed), Job("trial")])[1]
                self._compare(name, after, "a run after one with other start values and reset")
            else:
                why = "it does not run with other start values" if self._changed else "it has none to change"
                self._note(name, Verdict.NOT_TRIED, why)
            self._leak_lines("resets", runner, cycles)

    def larger_inputs_line(self) -> None:
        """Inputs of which nobody says how large they are: try larger ones, too."""
        unknown = [v for v in probe.excitable(self._description) if probe.is_undeclared(v)]
        unknown = [v for v in unknown if v.name not in self._given.ends]
        if (
            self._given.inputs is not None
            or self._rests
            or not self._moving
            or not unknown
            or self._kind != "co-simulation"
            or not self._halves
        ):
            return
        if is_ours(self._description):  # it controls its own step
            return
        larger = {times: self._excited(times=times) for times in _LARGER}
        grids = {"h": self._time, "h/2": refined(self._time, 2)}
        more = [
            self._experiment(f"{times:g} {grid}", time, inputs)
            for times, inputs in larger.items()
            for grid, time in grids.items()
        ]
        with self._runner(more=more) as runner:
            outcomes = runner.run([Job(e.name) for e in more])
        pairs = [(times, outcomes[2 * i], outcomes[2 * i + 1]) for i, times in enumerate(larger)]
        largest = {
            times: ", ".join(f"{v.name} to {np.max(np.abs(s[v.name])):g}" for v in unknown[:3])
            for times, s in larger.items()
            if s is not None
        }
        self._take("larger inputs", numerics.judge_larger_inputs(pairs, largest))

    def exchange_line(self) -> None:
        """Compare Co-Simulation with Model Exchange, integrated by the importer at a tight tolerance."""
        name = "model exchange"
        if self._kind != "co-simulation" or not self._description.supports_model_exchange:
            self._note(name, Verdict.NOT_TRIED, "it has one interface only, or was tried with one")
            return
        with self._runner(kind="model-exchange") as runner:
            outcome = runner.run([Job("trial")])[0]
        judged = numerics.judge_exchange(self._first, outcome)
        if judged[0] is not Verdict.OK and outcome.signals is not None:
            zeros = self._zero_but_for_errors(outcome.signals)
            judged = numerics.judge_exchange(self._first, outcome, zeros)
        self._take(name, judged)

    def _zero_but_for_errors(self, exchange: Signals) -> tuple[str, ...]:
        """Outputs that shrink with the solver's tolerance, in both interfaces, or are less than it allows.

        Balances, which ought to be zero, and parts that stick beside others that move.
        """
        usual = self._given.tolerance or self._description.default_experiment.tolerance or _TOLERANCE
        tight = replace(self._experiment("tight", self._time), tolerance=_TIGHTER * usual)
        names = set(self._outputs)
        kinds: tuple[tuple[Kind, Signals], ...] = (
            ("co-simulation", self._first),
            ("model-exchange", exchange),
        )
        for kind, loose in kinds:
            with self._runner(kind=kind, more=[tight]) as runner:
                outcome = runner.run([Job("tight")])[0]
            if outcome.signals is None:
                return ()
            names &= numerics.shrinking(loose, outcome.signals)
        names |= numerics.below(self._first, usual)
        return tuple(n for n in self._outputs if n in names)

    def _leak_lines(self, way: str, runner: LocalRunner, cycles: int) -> None:
        outcomes = self._many(runner, [Job("short")] * self._short_runs(cycles), stop_at_failure=True)
        memory, files = f"memory over {way}", f"file handles over {way}"
        failed = next((outcome for outcome in outcomes if not outcome.ok), None)
        if failed is not None:
            self._note(memory, Verdict.FAILED, f"{failed.status}: {failed.reason}")
            self._note(files, Verdict.NOT_TRIED, "a run failed")
            return
        prints = np.array([outcome.reduced for outcome in outcomes])[min(_WARM_UP, len(outcomes) // 2) :]
        if not np.isfinite(prints).all():
            for name in (memory, files):
                self._note(name, Verdict.NOT_TRIED, "this platform does not tell")
            return
        # Medians of both halves: a single step of the allocator is no leak.
        half = len(prints) // 2
        growth = float(np.median(prints[-half:, 1]) - np.median(prints[:half, 1])) / (len(prints) - half)
        self._take(memory, numerics.judge_memory(growth, _LEAK_BYTES, len(prints)))
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
        change, worst = largest_change(self._first.values, found)
        verdict = Verdict.WARNING if change < 1e-9 else Verdict.FAILED
        text = f"{what} {said(change, worst)}"
        if name == "fresh instance" and self._is_ok("new process"):
            text += ", a new process nothing: the library keeps something (static variables, random numbers)"
        elif name == "new process":
            text += ": it does not repeat itself (random numbers, or memory that is not set)"
        self._note(name, verdict, text, change=change)

    def _is_ok(self, name: str) -> bool:
        return any(f.name == name and f.verdict is Verdict.OK for f in self.findings)
