"""The use case: scenario → searches over a runner → parameters per point → laws → result."""

import logging
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import replace

import numpy as np

from thsa_cosim import __version__
from thsa_cosim.batch import Journal
from thsa_cosim.errors import InputError, StudyError
from thsa_cosim.identify.expected import expected_values
from thsa_cosim.identify.force import force_balance
from thsa_cosim.identify.off_law import off_law
from thsa_cosim.identify.off_published import Fitted, off_published
from thsa_cosim.identify.over_temperature import all_laws, values_at
from thsa_cosim.identify.parameter_set import parameter_set
from thsa_cosim.identify.point import PointSearch, search_point
from thsa_cosim.identify.problem import (
    Given,
    HeldOut,
    PointProblem,
    build_point,
    evolved_vectors,
    planned_vectors,
)
from thsa_cosim.identify.results import ForceBalance, IdentifyResult, LawResult, PointResult
from thsa_cosim.identify.silent import note_on, silent_parameters
from thsa_cosim.identify.step_shift import widened, with_shifts
from thsa_cosim.identify.unsettled import unsettled
from thsa_cosim.inspection import (
    Expected,
    Finding,
    Inspection,
    Residual,
    hidden_gains,
    influences,
    judge,
    misfits,
)
from thsa_cosim.recordings import Recording
from thsa_cosim.scenario import OpenRunner, Scenario
from thsa_cosim.search import EvolutionSettings, Generation
from thsa_cosim.study import (
    Case,
    Comparison,
    CouplingError,
    Engine,
    Place,
    Reply,
    Request,
    Study,
    Want,
    build_case,
    case_residuals,
    compare_case,
    coupling_error,
    describe,
    interleave,
    study_identity,
    summarise,
)

JOURNAL = "journal.csv"


def identify(
    scenario: Scenario,
    place: Place,
    *,
    given: Mapping[float | None, Given] | None = None,
) -> IdentifyResult:
    """Identify the scenario's parameters in the study folder of ``place``; continue what it holds.

    A KeyboardInterrupt ends the study early: the result then has the status "interrupted" and the points
    that were finished. The same call continues it, and ends with what an undisturbed run would have found.
    ``given``: per temperature, how sure the start values are that earlier stages found; it widens the errors.

    Raises
    ------
    InputError
        If the folder holds a different study, or recordings and settings do not fit together.
    StudyError
        If no point could be identified because every simulation failed.
    """
    known = given or {}
    points = [build_point(scenario, p, known.get(p.temperature_degC)) for p in scenario.points]
    held_out = _held_out_cases(scenario)
    samples = {point.label: point.samples for point in points}
    about = {**describe(scenario), "samples": samples}
    names = tuple(dict.fromkeys(name for point in points for name in point.space.names))
    channels = points[0].channel_names
    search = _Search(scenario, points, held_out)
    with (
        Study.open(place, study_identity(scenario, "identify"), about) as study,
        Journal.open(place.folder / JOURNAL, names, channels) as journal,
    ):
        try:
            experiments = [e for point in points for e in point.experiments]
            experiments += search.held_out().experiments
            with study.open_runner(scenario.simulation, experiments) as runner:
                search.note(runner.notes)
                engine = Engine(runner, journal, place.on_progress)
                search.try_parameters(engine)
                search.search(engine)
                search.validate(engine)
            search.couple(study.open_runner)
            study.complete()
        except KeyboardInterrupt:
            search.interrupted = True
    return search.result()


_log = logging.getLogger(__name__)


class _Search:
    """What has been found so far."""

    def __init__(
        self, scenario: Scenario, points: Sequence[PointProblem], held_out: Sequence[tuple[Case, Recording]]
    ) -> None:
        self.interrupted = False
        self._scenario = scenario
        self._points = points
        self._held_out = held_out
        self._found: dict[int, PointSearch] = {}
        self._comparisons: list[Comparison] = []
        self._notes: list[str] = []
        self._engine: Engine | None = None
        self._coupling: CouplingError | None = None

    def note(self, notes: Sequence[str]) -> None:
        """Take sentences for the result."""
        self._notes += notes

    def held_out(self, cases: Sequence[Case] | None = None) -> HeldOut:
        """The held-out recordings, or some of them, as a problem."""
        chosen = [case for case, _ in self._held_out] if cases is None else cases
        space = self._scenario.parameters
        return HeldOut(tuple(chosen), space, tuple(p.name for p in space.parameters))

    def try_parameters(self, engine: Engine) -> None:
        """Name the parameters that do nothing, before any search."""
        first, step = self._points[0], engine.step
        engine.step = "trying each parameter"
        silent = silent_parameters(first, lambda request: engine.ask(first, request))
        engine.step = step
        if silent:
            sentences = note_on(silent)
            self.note(sentences)
            for sentence in sentences:
                _log.warning(sentence)

    def search(self, engine: Engine) -> None:
        """Search all points at once; what is finished is kept whatever happens to the rest."""
        self._engine = engine
        spec = self._scenario.search
        settings = EvolutionSettings(
            population=spec.population,
            generations=spec.generations,
            mutation=spec.mutation,
            crossover=spec.crossover,
            strategy=spec.strategy,
            seed=self._scenario.seed,
            tolerance=spec.tolerance,
        )
        for point in self._points:
            engine.plan(point, planned_vectors(spec, point.space.dimension))
        engine.report()

        def task(index: int) -> Callable[[Callable[[Request], Reply]], PointSearch]:
            point = self._points[index]

            def on_generation(generation: Generation) -> None:
                engine.note_generation(generation.index)

            def on_evolution() -> None:
                engine.plan(point, evolved_vectors(spec))

            return lambda ask: search_point(
                point, spec.method, settings, spec.polish, ask, on_generation, on_evolution
            )

        tasks = [task(index) for index in range(len(self._points))]

        def serve(requests: Sequence[tuple[int, Request]]) -> list[Reply]:
            return engine.serve([(self._points[k], request) for k, request in requests])

        with closing(interleave(tasks, serve)) as finished:
            for index, found in finished:
                self._found[index] = found
                engine.finish(self._points[index])
        if not any(found.result for found in self._found.values()):
            reason = next(iter(self._found.values())).reason
            raise StudyError(f"{self._scenario.path}: no simulation succeeded: {reason}")

    def validate(self, engine: Engine) -> None:
        """Score the held-out recordings with what was found."""
        if not self._held_out:
            return
        results, laws = self._results(), self._laws()[0]
        shared = [p.name for p in self._scenario.parameters.parameters]
        found: list[list[float]] = []
        scored: list[tuple[Case, Recording]] = []
        for case, recording in self._held_out:
            temperature = recording.temperature_degC
            try:
                values = values_at(temperature, shared, results, laws, self._scenario.round_to)
            except InputError as error:
                self._notes.append(f"{recording.name} was not scored: {error}.")
                continue
            found.append([values[name] for name in shared])
            scored.append((case, recording))
        if not scored:
            return
        problem = self.held_out([case for case, _ in scored])
        (outcomes,) = engine.ask(problem, Request(Want.SIGNALS, np.array([found]))).outcomes
        for (case, recording), outcome in zip(scored, outcomes, strict=True):
            if outcome.signals is None:
                self._notes.append(f"{recording.name} was not scored: {outcome.reason}")
                continue
            self._comparisons.append(compare_case(case, recording, "validate", outcome.signals))

    def couple(self, opening: OpenRunner) -> None:
        """Find out what coupling by steps costs at the first point's estimate, on its first recording."""
        point, found = self._points[0], self._found.get(0)
        if found is None or found.result is None or not found.signals:
            return
        case, spec = point.cases[0], self._scenario
        values = {name: estimate.value for name, estimate in found.result.parameters.items()}
        coupled = coupling_error(
            spec.fmu,
            spec.simulation,
            case.experiment(f"fit/{case.name}", None),
            point.space.assignments(values, case.name),
            found.signals[0],
            {channel.name: channel.noise for channel in case.channels},
            opening,
        )
        if isinstance(coupled, CouplingError):
            self._coupling = coupled = with_shifts(coupled, point, found)
        if said := (coupled if isinstance(coupled, str) else coupled.sentence()):
            self.note([said])

    def result(self) -> IdentifyResult:
        """Everything found so far."""
        scenario, engine = self._scenario, self._engine
        laws, notes = self._laws()
        comparisons = [*self._fit_comparisons(), *self._comparisons]
        title = scenario.title or scenario.path.stem
        identified, left_out = parameter_set(title, scenario.parameters, self._results(), laws, scenario.fmu)
        failed = [
            f"{self._points[k].label} has no result: {found.reason}"
            for k, found in sorted(self._found.items())
            if found.result is None
        ]
        force, unsaid = self._force(comparisons, laws)
        slips = [*self._slips(), *self._labels(laws)]
        findings = [*slips, *self._off_published(slips)]
        return IdentifyResult(
            title=title,
            status="interrupted" if self.interrupted else "complete",
            seed=scenario.seed,
            version=__version__,
            fmu=scenario.fmu.path,
            fmu_sha256=scenario.fmu.sha256,
            scenario=scenario.path,
            points=tuple(self._results()),
            planned_points=len(self._points),
            laws=laws,
            comparisons=tuple(comparisons),
            errors=summarise(comparisons),
            evaluations=sum(self._evaluations(k) for k in range(len(self._points))),
            failures={} if engine is None else engine.failures,
            parameter_set=identified,
            notes=(*scenario.notes, *failed, *notes, *left_out, *self._notes, *unsaid),
            settings={**scenario.search.model_dump(), "error": scenario.cost.error},
            force=force,
            data=Inspection.of((*scenario.data.findings, *findings), scenario.data.repairs),
            trust=judge(
                self._residuals(),
                (*_reasons(slips), *unsettled(self._results(), scenario.search.polish), *self._coupled()),
            ),
            coupling=self._coupling,
        )

    def _residuals(self) -> list[Residual]:
        """What the fit leaves of every fitted signal, where it counts."""
        return [residual for k in sorted(self._found) for residual in self._point_residuals(k)]

    def _point_residuals(self, index: int) -> list[Residual]:
        point, search = self._points[index], self._found[index]
        found = []
        for case, simulated, rows in zip(point.cases, search.signals, point.groups, strict=False):
            slopes = [None if search.jacobian is None else search.jacobian[own] for own in rows]
            found += case_residuals(case, simulated, slopes)
        return found

    def _slips(self) -> list[Finding]:
        """What one slip of one signal would explain of what the fit leaves, beyond what is known of the data."""
        known = {(f.recording, f.channel, f.kind) for f in self._scenario.data.findings}
        found = []
        for k in sorted(self._found):
            residuals, expected = self._point_residuals(k), self._expected(k)
            slips = misfits(residuals, self._scenario.file_units) or influences(residuals, expected)
            doubted = {f.channel for f in slips}
            found += slips + [f for f in hidden_gains(residuals, expected) if f.channel not in doubted]
        return [f for f in found if (f.recording, f.channel, f.kind) not in known]

    def _off_published(self, slips: Sequence[Finding]) -> list[Finding]:
        """Values off their published laws at points that nothing else casts a doubt on.

        No reason against trust: what is left is noise, and a worn machine differs from its laws, too.
        """
        doubted = {f.recording for f in (*self._scenario.data.findings, *slips) if f.severity != "note"}
        points = ((self._points[k].label, self._point_residuals(k), self._expected(k)) for k in self._found)
        return off_published((Fitted(*point) for point in points), doubted)

    def _labels(self, laws: Mapping[str, LawResult]) -> list[Finding]:
        """Recordings whose temperature seems to be another one, by the laws through all points."""
        found = off_law(self._results(), laws)
        if found is None:
            return []
        text, temperatures = found
        table = self._scenario.table.temperature
        channel = "time" if table is None or table.input is None else table.input
        return [
            Finding(case.name, channel, "temperature-label", "warning", text)
            for point in self._points
            for case in point.cases
            if point.temperature_degC in temperatures
        ]

    def _expected(self, index: int) -> list[Expected]:
        """What was identified at a point beside what the drawing says; empty without a Jacobian."""
        spec, search = self._scenario, self._found[index]
        if search.result is None or search.jacobian is None:
            return []
        return expected_values(search.result, self._points[index].space, spec.laws, spec.fmu, spec.zeroed)

    def _coupled(self) -> list[str]:
        return [] if self._coupling is None or not self._coupling.reason else [self._coupling.reason]

    def _force(
        self, comparisons: Sequence[Comparison], laws: Mapping[str, LawResult]
    ) -> tuple[ForceBalance | None, list[str]]:
        """The force residual, or a sentence why there is none."""
        scenario = self._scenario
        if scenario.force is None:
            return None, []
        space, results = scenario.parameters, self._results()
        shared = [p.name for p in space.parameters]
        masses = []
        for comparison in comparisons:
            values = values_at(comparison.temperature_degC, shared, results, laws, scenario.round_to)
            found = {**scenario.fixed_for(comparison.recording), **space.assignments(values)}
            masses.append(found.get(scenario.force.mass, scenario.force.mass_at_start))
        try:
            return force_balance(scenario.force, comparisons, masses), []
        except ValueError as error:
            return None, [f"there is no force residual: {error}"]

    def _results(self) -> list[PointResult]:
        shifts = {} if self._coupling is None else self._coupling.moved
        return [
            replace(widened(found.result, shifts), evaluations=self._evaluations(k))
            for k, found in sorted(self._found.items())
            if found.result is not None
        ]

    def _evaluations(self, k: int) -> int:
        return 0 if self._engine is None else self._engine.evaluations[self._points[k].label]

    def _laws(self) -> tuple[dict[str, LawResult], list[str]]:
        return all_laws(self._results(), self._scenario.laws, self._scenario.parameters)

    def _fit_comparisons(self) -> list[Comparison]:
        comparisons = []
        for k, found in sorted(self._found.items()):
            problem, recordings = self._points[k], self._scenario.points[k].fit
            for case, recording, signals in zip(problem.cases, recordings, found.signals, strict=False):
                comparisons.append(compare_case(case, recording, "fit", signals))
        return comparisons


def _reasons(findings: Sequence[Finding]) -> list[str]:
    return [f"{f.recording}: {f.text} ({f.kind})" for f in findings if f.severity != "note"]


def _held_out_cases(scenario: Scenario) -> list[tuple[Case, Recording]]:
    cases = []
    for recording in scenario.validate:
        owner = next((p for p in scenario.points if recording in p.validate), None)
        fixed = scenario.fixed if owner is None else owner.fixed
        cases.append((build_case(scenario, recording, fixed), recording))
    return cases
