"""The use case: scenario → one search per group of conditions over one runner → gains, schedule, result."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace

import numpy as np

from thsa_cosim import __version__
from thsa_cosim.batch import Journal
from thsa_cosim.errors import StudyError
from thsa_cosim.scenario import OpenRunner, TuneScenario
from thsa_cosim.scenario.tune_model import combinations
from thsa_cosim.search import (
    EvolutionResult,
    EvolutionSettings,
    Generation,
    SimplexSettings,
    descend,
    evolve,
)
from thsa_cosim.signals import FloatArray
from thsa_cosim.study import (
    CouplingError,
    Engine,
    Place,
    Reply,
    Request,
    Study,
    Want,
    coupling_error,
    describe,
    interleave,
    study_identity,
)
from thsa_cosim.system.description import SystemDescription
from thsa_cosim.tune.combine import INFEASIBLE, equation_7
from thsa_cosim.tune.evaluate import Evaluation, evaluate, evaluate_each
from thsa_cosim.tune.pareto import front_of
from thsa_cosim.tune.population import Line, PopulationPath, line_of
from thsa_cosim.tune.problem import Group, SampledCondition, build_cases, build_groups
from thsa_cosim.tune.results import (
    GroupResult,
    Pareto,
    ScheduleCheck,
    ScheduleResult,
    Scored,
    Surface,
    TuneResult,
)
from thsa_cosim.tune.schedule import GainSchedule, smooth

JOURNAL = "journal.csv"
#: The smoothing is divided by 4 until no node breaks a hard requirement, so often at most.
WEAKER = 6
#: So near to a bound, as a share of its search range, a gain is at the bound.
NEAR = 0.005

Ask = Callable[[Request], Reply]


def tune(scenario: TuneScenario, place: Place) -> TuneResult:
    """Tune the scenario's parameters in the study folder of ``place``; continue what it holds.

    A KeyboardInterrupt ends the study early: the result then has the status "interrupted". The same call
    continues it, and ends with what an undisturbed run would have found.

    Raises
    ------
    InputError
        If the folder holds a different study.
    StudyError
        If no simulation gave a usable response.
    """
    groups = build_groups(scenario)
    checked: Sequence[SampledCondition] = ()
    if scenario.schedule is not None:
        checked = build_cases(scenario, combinations(scenario.schedule.check), sampled=False)
    check = Group(scenario, "check", {}, tuple(checked), scenario.requirements)
    names = check.term_names
    tuning = _Tuning(scenario, groups, check, names)
    with (
        Study.open(place, study_identity(scenario), describe(scenario)) as study,
        Journal.open(place.folder / JOURNAL, scenario.parameters.names, names) as journal,
    ):
        try:
            named = {case.experiment.name: case.experiment for g in (*groups, check) for case in g.cases}
            with study.open_runner(scenario.simulation, list(named.values())) as runner:
                tuning.notes += runner.notes
                engine = Engine(runner, journal, place.on_progress, "tuning")
                tuning.run(engine, journal)
            tuning.couple(study.open_runner)
            study.complete()
        except KeyboardInterrupt:
            tuning.interrupted = True
    return tuning.result()


def planned_sets(scenario: TuneScenario) -> int:
    """Sets of gains that the search of one group evaluates: at most, and as a rule for the simplex."""
    spec = scenario.search
    simplex = SimplexSettings().usual(len(scenario.parameters)) if spec.polish else 0
    return spec.population * (spec.generations + 1) + simplex


@dataclass(eq=False)
class _Tuning:
    """What has been found so far."""

    scenario: TuneScenario
    groups: Sequence[Group]
    check: Group
    names: tuple[str, ...]
    interrupted: bool = False
    found: dict[int, EvolutionResult] = field(default_factory=dict)
    paths: dict[int, PopulationPath] = field(default_factory=dict)
    scored: list[Scored] = field(default_factory=list)
    surface: Surface | None = None
    pareto: Pareto | None = None
    schedule: ScheduleResult | None = None
    notes: list[str] = field(default_factory=list)
    engine: Engine | None = None
    coupling: CouplingError | None = None

    def run(self, engine: Engine, journal: Journal) -> None:
        """Search all groups at once, then score, draw and schedule."""
        self.engine = engine
        self._search(engine)
        spec = self.scenario
        sets = {"before": spec.before, "after": self._gains(0), **spec.compare}
        found = evaluate(engine, self.groups[0], [dict(v) for v in sets.values()], keep_signals=True)
        self.scored = [self._score(name, f) for name, f in zip(sets, found, strict=True)]
        if spec.surface is not None:
            self.surface = self._surface(engine)
        if spec.pareto is not None:
            self.pareto = front_of(spec.pareto, journal)
        if spec.schedule is not None:
            self.schedule = self._schedule(engine)

    def couple(self, opening: OpenRunner) -> None:
        """Find out what the communication step of a foreign FMU costs, with the tuned gains, in one condition."""
        spec, gains = self.scenario, self._gains(0)
        after = next(s for s in self.scored if s.name == "after")
        pairs = zip(self.groups[0].cases, after.signals, strict=True)
        case, simulated = next(((c, s) for c, s in pairs if s is not None), (None, None))
        if case is None or simulated is None:
            return
        values = spec.parameters.assignments(gains)
        coupled = coupling_error(spec.fmu, spec.simulation, case.experiment, values, simulated, {}, opening)
        if isinstance(coupled, CouplingError):
            is_system = isinstance(spec.fmu, SystemDescription)
            coupled = coupled if is_system else replace(coupled, remedy="lower command.step")
            self.coupling = coupled
        if said := (coupled if isinstance(coupled, str) else coupled.note):
            self.notes.append(said)

    # -- search ---------------------------------------------------------------------------------------
    def _search(self, engine: Engine) -> None:
        spec = self.scenario.search
        settings = EvolutionSettings(
            population=spec.population,
            generations=spec.generations,
            mutation=spec.mutation,
            crossover=spec.crossover,
            strategy=spec.strategy,
            seed=self.scenario.seed,
            tolerance=spec.tolerance,
        )
        for group in self.groups:
            engine.plan(group, planned_sets(self.scenario))

        def task(index: int) -> Callable[[Ask], EvolutionResult]:
            return lambda ask: self._evolve(index, settings, engine, ask)

        tasks = [task(k) for k in range(len(self.groups))]

        def serve(requests: Sequence[tuple[int, Request]]) -> list[Reply]:
            return engine.serve([(self.groups[k], request) for k, request in requests])

        with closing(interleave(tasks, serve)) as finished:
            for index, result in finished:
                self.found[index] = result
                engine.finish(self.groups[index])

    def _evolve(self, index: int, settings: EvolutionSettings, engine: Engine, ask: Ask) -> EvolutionResult:
        space = self.scenario.parameters
        path = self.paths[index] = PopulationPath()

        def costs(vectors: FloatArray) -> FloatArray:
            values = space.physical(vectors)
            reply = ask(Request(Want.TERMS, values))
            if not path.populations and not np.isfinite(reply.costs).any():
                reason = next((r for r in reply.reasons if r), "no response reaches its command")
                raise StudyError(
                    f"{self.scenario.path}: none of the first {len(values)} sets of gains"
                    f" ({self.groups[index].label}) gave a usable response: {reason}."
                )
            path.add(values, reply.costs)
            return reply.costs

        start = space.start() if any(p.start is not None for p in space.parameters) else None

        def on_generation(generation: Generation) -> None:
            engine.note_generation(generation.index)

        found = evolve(costs, space.dimension, settings, start=start, on_generation=on_generation)
        if not self.scenario.search.polish or not np.isfinite(found.cost):
            return found
        lowest = descend(
            lambda vectors: ask(Request(Want.TERMS, space.physical(vectors))).costs,
            found.best,
            found.cost,
            SimplexSettings(),
        )
        return replace(
            found,
            best=lowest.best,
            cost=lowest.cost,
            evaluations=found.evaluations + lowest.evaluations,
            reason=f"{found.reason}; a simplex from its best: cost {found.cost:.6g} to {lowest.cost:.6g}",
        )

    def _gains(self, index: int) -> dict[str, float]:
        return self.scenario.parameters.decode(self.found[index].best)

    # -- what follows ---------------------------------------------------------------------------------
    def _score(self, name: str, found: Evaluation) -> Scored:
        if found.reason:
            self.notes.append(f"{name} could not be simulated everywhere: {found.reason}.")
        combined = found.combined
        return Scored(
            name=name,
            gains=found.values,
            cost=combined.cost,
            eq7=combined.eq7,
            worst=dict(zip(self.names, combined.worst.tolist(), strict=True)),
            terms=found.terms,
            excess={
                r.name: x for r, x in zip(self.scenario.requirements, combined.excess.tolist(), strict=True)
            },
            feasible=combined.feasible,
            signals=found.signals,
        )

    def _surface(self, engine: Engine) -> Surface:
        spec, space = self.scenario.surface, self.scenario.parameters
        assert spec is not None
        best = self.found[0].best
        i, j = (space.names.index(name) for name in spec.parameters)
        unit = np.linspace(0.0, 1.0, spec.points)
        vectors = np.repeat(best[None, :], spec.points**2, axis=0)
        vectors[:, i] = np.tile(unit, spec.points)
        vectors[:, j] = np.repeat(unit, spec.points)
        values = space.physical(vectors)
        engine.plan(self.groups[0], len(values))
        reply = engine.ask(self.groups[0], Request(Want.TERMS, values))
        shape = (spec.points, spec.points)
        eq7 = self._eq7_of_worst(reply.terms)
        feasible = reply.costs < INFEASIBLE
        return Surface(
            names=(spec.parameters[0], spec.parameters[1]),
            x=values[: spec.points, i],
            y=values[:: spec.points, j],
            cost=np.where(feasible, reply.costs, np.nan).reshape(shape),
            eq7=eq7.reshape(shape),
            populations=tuple(p[:, [i, j]] for p in self.paths[0].populations),
        )

    def _eq7_of_worst(self, worst: FloatArray) -> FloatArray:
        """Equation 7 of the worst terms (m, q): the cost itself where there is one condition."""
        return equation_7(self.scenario, self.names, worst)

    # -- schedule -------------------------------------------------------------------------------------
    def _schedule(self, engine: Engine) -> ScheduleResult:
        spec, space = self.scenario.schedule, self.scenario.parameters
        assert spec is not None
        axes = [axis for axis in self.scenario.axes if axis.name in spec.over]
        nodes = tuple(np.array(axis.values) for axis in axes)
        shape = tuple(n.size for n in nodes)
        best = np.stack([self.found[k].best for k in range(1, len(self.groups))])

        def schedule(vectors: FloatArray) -> GainSchedule:
            values = space.physical(np.clip(vectors, 0.0, 1.0))
            return GainSchedule(
                names=tuple(axis.name for axis in axes),
                units=tuple(axis.unit for axis in axes),
                nodes=nodes,
                gains={name: values[:, k].reshape(shape) for k, name in enumerate(space.names)},
                gain_units={p.name: p.unit for p in space.parameters},
            )

        strength, allowed = spec.smoothing, self._broken(engine, best)
        for _ in range(WEAKER):
            columns = [
                smooth(best[:, k].reshape(shape), nodes, strength).ravel() for k in range(space.dimension)
            ]
            drawn = np.stack(columns, axis=1)
            if strength == 0.0 or self._broken(engine, drawn) <= allowed + 1e-12:
                break
            strength /= 4.0
        else:
            strength, drawn = 0.0, best
            self.notes.append("The schedule was not smoothed: every smoothing broke a hard requirement.")
        if 0.0 < strength < spec.smoothing:
            self.notes.append(f"The smoothing was lowered to {strength:g} to keep the hard requirements.")
        final = schedule(drawn)
        return ScheduleResult(final, schedule(best), strength, self._check(engine, final))

    def _broken(self, engine: Engine, vectors: FloatArray) -> float:
        """By how much the nodes' gains (k, n) in the unit cube break hard requirements, summed."""
        space, requirements = self.scenario.parameters, self.scenario.requirements
        total = 0.0
        for group, vector in zip(self.groups[1:], vectors, strict=True):
            limits = replace(group, requirements=requirements)
            found = evaluate(engine, limits, [space.decode(np.clip(vector, 0.0, 1.0))])[0].combined
            hard = [x for r, x in zip(requirements, found.excess.tolist(), strict=True) if r.hard]
            total += sum(hard) if np.isfinite(found.eq7) else np.inf
        return total

    def _check(self, engine: Engine, schedule: GainSchedule) -> ScheduleCheck:
        spec = self.scenario
        conditions = tuple(case.condition.shown for case in self.check.cases)
        constant = {"best single set": self._gains(0), **spec.compare, "before": spec.before}
        sets = [[schedule.at(c) for c in conditions]]
        sets += [[dict(values)] * len(conditions) for values in constant.values()]
        found = evaluate_each(engine, self.check, sets)
        scored = [self._score(name, f) for name, f in zip(["schedule", *constant], found, strict=True)]
        if not scored[0].feasible:
            broken = ", ".join(name for name, x in scored[0].excess.items() if x > 0.0)
            self.notes.append(f"Between its nodes the schedule breaks a hard requirement: {broken}.")
        return ScheduleCheck(conditions, tuple(scored))

    # -- result ---------------------------------------------------------------------------------------
    def result(self) -> TuneResult:
        """Everything found so far."""
        scenario, engine = self.scenario, self.engine
        by_name = {s.name: s for s in self.scored}
        after = by_name.get("after")
        self.notes += [note for k in sorted(self.found) for note in self._at_bounds(k)]
        if after is not None and not after.feasible:
            broken = ", ".join(name for name, x in after.excess.items() if x > 0.0)
            self.notes.append(f"No gains within the bounds keep every hard requirement; broken: {broken}.")
        return TuneResult(
            scenario=scenario,
            status="interrupted" if self.interrupted else "complete",
            version=__version__,
            fmu=scenario.fmu.path,
            groups=tuple(self._group(k) for k in sorted(self.found)),
            terms=self.names,
            conditions=tuple(c.condition.shown for c in self.groups[0].cases),
            before=by_name.get("before"),
            after=after,
            compare=tuple(s for s in self.scored if s.name in scenario.compare),
            line=self._line(),
            surface=self.surface,
            pareto=self.pareto,
            schedule=self.schedule,
            evaluations=0 if engine is None else engine.evaluations.total(),
            failures={} if engine is None else engine.failures,
            notes=tuple(self.notes),
            coupling=self.coupling,
            settings={
                **scenario.search.model_dump(),
                "cost": {**scenario.cost.model_dump(exclude={"steady"}), "signed": scenario.cost.signed},
                "combine": scenario.combine,
            },
        )

    def _group(self, k: int) -> GroupResult:
        found, group = self.found[k], self.groups[k]
        gains: Mapping[str, float] = self._gains(k)
        return GroupResult(
            group.label, group.at, gains, found.cost, found.cost < INFEASIBLE, found.history, found.reason
        )

    def _at_bounds(self, k: int) -> list[str]:
        """One note for each gain that ended at a bound: there the bound decides, not the cost."""
        best, space = self.found[k].best, self.scenario.parameters
        sides = {"lower": best < NEAR, "upper": best > 1.0 - NEAR}
        return [
            f"{name} ends at its {side} bound ({self.groups[k].label}): the bound limits it, no requirement does."
            for side, at in sides.items()
            for name, near in zip(space.names, at.tolist(), strict=True)
            if near
        ]

    def _line(self) -> Line | None:
        spec, names = self.scenario.line, self.scenario.parameters.names
        if spec is None or 0 not in self.found:
            return None
        columns = [(name, names.index(name)) for name in (spec.numerator, spec.denominator)]
        return line_of(self.paths[0], columns[0], columns[1], spec.generations, spec.published)
