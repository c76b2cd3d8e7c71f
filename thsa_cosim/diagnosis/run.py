"""The use case: scenario → superset → attribution → closure → verdict."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from thsa_cosim import __version__
from thsa_cosim.batch.memory import give_back
from thsa_cosim.diagnosis.blackbox.prepare import BlackBox, wrap_black_box
from thsa_cosim.diagnosis.blackbox.saved import write_wrapper
from thsa_cosim.diagnosis.catalogue.candidate import Candidate
from thsa_cosim.diagnosis.catalogue.declared import DeclaredEffect, declared_effects
from thsa_cosim.diagnosis.catalogue.effect import Effect
from thsa_cosim.diagnosis.catalogue.extend import write_extended_model
from thsa_cosim.diagnosis.catalogue.known import choose, known_effects
from thsa_cosim.diagnosis.catalogue.superset import Superset, open_superset
from thsa_cosim.diagnosis.choosing.attribution import Attribution, attribute
from thsa_cosim.diagnosis.choosing.equivalence import equivalence
from thsa_cosim.diagnosis.choosing.findings import (
    found_effects,
    judged,
    known_values,
    off_the_drawing,
    values_of,
)
from thsa_cosim.diagnosis.choosing.orders import Machine, machine_of
from thsa_cosim.diagnosis.choosing.score import Scored, extended_unknowns, fixed_shapes, held_shapes
from thsa_cosim.diagnosis.choosing.spread import between_models
from thsa_cosim.diagnosis.choosing.verdict import left_over, verdict_on
from thsa_cosim.diagnosis.choosing.wave_numbers import wave_number_finder
from thsa_cosim.diagnosis.explaining.balance import close_balances
from thsa_cosim.diagnosis.explaining.dependence import dependence
from thsa_cosim.diagnosis.explaining.empirical import LawSearch, law_of
from thsa_cosim.diagnosis.explaining.evidence import evidence
from thsa_cosim.diagnosis.explaining.experiment import separating_experiment
from thsa_cosim.diagnosis.explaining.slips import with_slips
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.drawing import declared_unknowns
from thsa_cosim.diagnosis.fitting.fit import Fit
from thsa_cosim.diagnosis.fitting.identified import Identified, identify_model
from thsa_cosim.diagnosis.fitting.structure import errors, errors_by_recording
from thsa_cosim.diagnosis.fitting.trials import (
    Trial,
    note_on_means,
    spec_of,
    trials_of,
    with_fmu,
    with_wrapper,
)
from thsa_cosim.diagnosis.fitting.uncertainty import standard_errors
from thsa_cosim.diagnosis.fitting.unknowns import Unknowns, declared_unknowns_of
from thsa_cosim.diagnosis.results import DiagnosisResult, EmpiricalLaw, StructuredError
from thsa_cosim.errors import StudyError
from thsa_cosim.export.compile import native_platform
from thsa_cosim.identify import ForceBalance, force_balance
from thsa_cosim.scenario import DiagnoseSpec, Scenario
from thsa_cosim.study import Comparison, Place, Study, describe, reached, study_identity

#: The folder of the superset inside a study.
WORK = "superset"


def diagnose(scenario: Scenario, place: Place) -> DiagnosisResult:
    """Find what the scenario's model lacks, add it, and report held-out errors before and after.

    What the folder of ``place`` holds of the same study is continued, run by run.

    Raises
    ------
    InputError
        If the scenario is no diagnosis, the model has no effect slots, or the folder holds another study.
    MissingExtraError
        If exporting (``thsa-cosim[export]``) is not installed.
    StudyError
        If the declared model cannot be simulated.
    """
    spec = spec_of(scenario)
    trials = trials_of(scenario)
    unknowns = declared_unknowns(scenario, trials)
    effects = choose(known_effects(spec.catalogue), spec.effects, f"{scenario.path}: diagnose.effects")
    # One thread: the matrices are tall and narrow, and the simulations have the other cores.
    one_thread = threadpool_limits(limits=1, user_api="blas")
    with one_thread, Study.open(place, study_identity(scenario), describe(scenario)) as study:
        result = _diagnose(scenario, spec, study, trials, unknowns, effects.values())
        study.complete()
    return result


def _diagnose(
    scenario: Scenario,
    spec: DiagnoseSpec,
    study: Study,
    trials: tuple[Trial, ...],
    unknowns: Unknowns,
    effects: Iterable[Effect],
) -> DiagnosisResult:
    """Everything after the folder was claimed."""
    say = study.place.say
    give_back()  # what the inspection of the recordings took
    cases = [t.case for t in trials if t.part == "fit"]
    opening = partial(study.open_runner, scenario.simulation)
    tested: Superset | BlackBox
    known: tuple[DeclaredEffect, ...] = ()
    fmu = scenario.fmu.path
    if spec.model is None:
        say("measuring the drive of the black box")
        box = tested = wrap_black_box(scenario, cases, effects, opening)
        declared = driven = with_wrapper(trials, tested.wrapper)
    else:
        say("exporting the superset of all effects")
        box, tested = None, open_superset(scenario, spec.model, cases, effects, study.folder / WORK, opening)
        declared, driven = trials, with_fmu(trials, tested.fmu)
        if spec.known:
            known = declared_effects(tested.candidates, spec.known, f"{scenario.path}: diagnose.known")
            unknowns = unknowns.with_members(declared_unknowns_of(known))
            say(f"exporting the declared model with {', '.join(spec.known)}")
            _, fmu = write_extended_model(study.folder / WORK, spec.model, spec.package, *_known(known))
    say("identifying the declared model from the drawing")
    before = identify_model(
        fmu,
        declared,
        unknowns,
        [unknowns.start],
        scenario.simulation,
        study.open_runner,
    )
    with study.open_runner(scenario.simulation, [t.experiment for t in driven]) as runner:
        given = {variable: value for effect in known for variable, value in effect.given.items()}
        bench = Bench(runner, driven, {**held_shapes(tested.candidates), **given})
        start = before.fit.vector
        at_start = {t.case.name: unknowns.assignments(start, t.group) for t in driven if t.part == "fit"}
        machine = machine_of(tested.slots, tested.signals_at(at_start))
        scan = wave_number_finder(bench, tested.slots, tested.signals_at, machine)
        found = attribute(
            bench,
            unknowns,
            tested.candidates,
            scan,
            start=start,
            seed=scenario.seed,
            most=spec.most,
            machine=machine,
            say=say,
        )
    give_back()  # what the search took
    if found is None:
        reason = next(iter(bench.failures), "no run succeeded")
        raise StudyError(f"{scenario.path}: the model with all effects cannot be simulated: {reason}")
    names = tuple(effect.name for effect in effects)
    return _Closing(
        scenario, spec, study, trials, unknowns, before, found, bench, names, machine, known, box
    ).result()


@dataclass(frozen=True, eq=False)
class _Closing:
    """From an attribution to the result."""

    scenario: Scenario
    spec: DiagnoseSpec
    study: Study
    trials: tuple[Trial, ...]
    unknowns: Unknowns
    before: Identified
    found: Attribution
    bench: Bench
    effects: tuple[str, ...]
    machine: Machine
    known: tuple[DeclaredEffect, ...]
    box: BlackBox | None = None

    def result(self) -> DiagnosisResult:
        """Identify the extended model on its own FMU as the declared one was, and judge both."""
        scenario, found, before = self.scenario, self.found, self._declared()
        accepted, after = found.accepted, before
        notes = [*self.bench.notes, *note_on_means(self.trials), *found.notes]
        model: Path | None = None
        extended: Path | None = None
        wrapper: Path | None = None
        if self.box is not None:
            notes += self.box.notes
        if not _tested(found):
            notes.append(_untested(found, self.effects))
        if accepted:
            wider = extended_unknowns(self.unknowns, accepted)
            hint = found.final.at(wider.names)
            if self.box is None:
                self.study.place.say(
                    f"exporting the model with {', '.join(s.candidate.name for s in accepted)}"
                )
                assert self.spec.model is not None
                model, extended = write_extended_model(
                    self.study.folder,
                    self.spec.model,
                    self.spec.package,
                    *_built(self.known, accepted, found.final),
                )
            self.study.place.say("identifying the extended model from the drawing")
            after = self._identify(extended or before.fmu, wider, [wider.start, hint], accepted)
            if self.box is not None:
                values = {**after.trials[0].case.fixed, **after.fit.unknowns.named(after.fit.vector)}
                wrapper = write_wrapper(self.study.folder, scenario.fmu.path, self.box.wrapper, values)
        held_out = tuple(t for t in self.trials if t.part == "validate")
        share = left_over(held_out, before.validate, after.validate)
        verdict = verdict_on(errors(held_out, after.validate), len(accepted), _tested(found))
        law: EmpiricalLaw | None = None
        if verdict == "unexplained-structure" and self.box is None:
            self.study.place.say("looking for an empirical law")
            give_back()
            search = LawSearch(
                scenario, self.spec, self.trials, self.unknowns, self.known, accepted, after,
                self.study.folder / WORK, self.study.open_runner,
            )  # fmt: skip
            terms = search.find()
            law = None if terms is None else law_of(terms, added=self.spec.empirical)
            if terms is not None and self.spec.empirical:
                # The share stays that of the effects: a law describes and explains nothing.
                model, extended, after = self._with_law(terms)
        notes += off_the_drawing(after.fit)
        if model is not None and extended is not None:
            notes.append(
                f"{extended.name} is for {native_platform().fmi3} only; thsa-cosim export {model}"
                f" --package {self.spec.package} -o {extended} compiles it for all platforms"
            )
        counts = dict(self.bench.failures)
        changed = after is not before
        between = between_models(found, after.fit, self.bench.of("fit"))
        sure_before, sure_after = _sure(before), np.hypot(_sure(after), between)
        for identified in (before, after) if changed else (before,):
            for reason, count in identified.failures.items():
                counts[reason] = counts.get(reason, 0) + count
        balances = close_balances(scenario, self.spec)
        return DiagnosisResult(
            title=scenario.title or scenario.path.stem,
            status="complete",
            seed=scenario.seed,
            version=__version__,
            scenario=scenario.path,
            fmu=scenario.fmu.path,
            fmu_sha256=scenario.fmu.sha256,
            verdict=verdict,
            effects=found_effects(found, after.fit, self.machine, sure_after),
            known=known_values(self.known, after.fit, sure_after),
            before=_errors(before),
            after=_errors(after) if changed else {"fit": {}, "validate": {}},
            recordings_before=_errors_by_recording(before),
            recordings_after=_errors_by_recording(after) if changed else {},
            declared_before=values_of(before.fit, declared=True, stderr=sure_before),
            declared_after=values_of(after.fit, declared=True, stderr=sure_after),
            unexplained=share,
            model=model,
            extended_fmu=extended,
            wrapper=wrapper,
            judged=judged(found),
            balances=balances,
            evidence=evidence(scenario, balances, self.trials, before, after if changed else None),
            dependence=dependence(scenario, self.trials, before, after),
            empirical=law,
            equivalence=equivalence(found),
            experiment=separating_experiment(
                scenario,
                self.spec,
                found,
                self.bench.trials,
                dict(zip(after.fit.unknowns.names, map(float, sure_after), strict=True)),
                self.study.open_runner,
            ),
            comparisons_before=_comparisons(before),
            comparisons_after=_comparisons(after) if changed else (),
            force_before=_force(scenario, before),
            force_after=_force(scenario, after) if changed else None,
            threshold=found.rounds[0].threshold if found.rounds else 0.0,
            evaluations=self.bench.evaluations + before.evaluations + (after.evaluations if changed else 0),
            failures=counts,
            notes=tuple(notes),
            data=with_slips(scenario.data, after, scenario.file_units),
            asked=scenario.table.model_dump(mode="json", by_alias=True, exclude_unset=True),
        )

    def _declared(self) -> Identified:
        """The declared model, identified once more if the search came to a better optimum than the drawing led to."""
        base = self.found.base
        if self.found.base_cost > self.before.fit.cost - 1.0:
            return self.before
        self.study.place.say("identifying the declared model, starting from the result of the search")
        return self._identify(self.before.fmu, self.unknowns, [self.before.fit.vector, base.vector], ())

    def _with_law(self, terms: Attribution) -> tuple[Path, Path, Identified]:
        """The model with its effects and an empirical law: class, FMU, identified."""
        assert self.spec.model is not None
        added = (*self.found.accepted, *terms.accepted)
        model, extended = write_extended_model(
            self.study.folder, self.spec.model, self.spec.package, *_built(self.known, added, terms.final)
        )
        wider = extended_unknowns(self.unknowns, added)
        hint = terms.final.at(wider.names)
        return model, extended, self._identify(extended, wider, [wider.start, hint], added)

    def _identify(
        self, fmu: Path, unknowns: Unknowns, starts: Sequence[np.ndarray], accepted: Sequence[Scored]
    ) -> Identified:
        trials = self.trials
        if self.box is not None:
            trials = with_wrapper(trials, self.box.wrapper, fixed_shapes(accepted))
        return identify_model(fmu, trials, unknowns, starts, self.scenario.simulation, self.study.open_runner)


def _built(
    known: Sequence[DeclaredEffect], accepted: Sequence[Scored], final: Fit
) -> tuple[list[Candidate], dict[str, float]]:
    """The candidates of an extended model and the values that it starts with."""
    candidates, values = _known(known)
    values |= {**final.unknowns.named(final.vector), **fixed_shapes(accepted)}
    return [*candidates, *(s.candidate for s in accepted)], values


def _known(known: Sequence[DeclaredEffect]) -> tuple[list[Candidate], dict[str, float]]:
    """The candidates of a declared model's effects and their start values."""
    values = {p.variable: effect.starts[p.name] for effect in known for p in effect.candidate.parameters}
    return [effect.candidate for effect in known], values


def _sure(identified: Identified) -> np.ndarray:
    """(n,) standard errors of an identified model's unknowns, with how well the fit and its starts agree on them."""
    own = standard_errors(identified.fit, [t for t in identified.trials if t.part == "fit"])
    return np.asarray(np.sqrt(own**2 + identified.apart**2 + identified.fit.remaining_step**2))


def _errors(identified: Identified) -> dict[str, Mapping[str, StructuredError]]:
    parts = {"fit": identified.fit.residual, "validate": identified.validate}
    return {
        part: errors(tuple(t for t in identified.trials if t.part == part), residual)
        for part, residual in parts.items()
    }


def _errors_by_recording(identified: Identified) -> dict[str, Mapping[str, StructuredError]]:
    found: dict[str, Mapping[str, StructuredError]] = {}
    for part, residual in (("fit", identified.fit.residual), ("validate", identified.validate)):
        trials = tuple(t for t in identified.trials if t.part == part)
        for name, channels in errors_by_recording(trials, residual).items():
            found[f"{part}/{name}" if name in found else name] = channels
    return found


def _tested(found: Attribution) -> int:
    """How many proposals the recordings could have told from nothing."""
    return sum(p.is_testable for r in found.rounds[:1] for p in r.proposals)


def _untested(found: Attribution, effects: Iterable[str]) -> str:
    """Why no effect could be tried."""
    names = ", ".join(effects)
    if not any(r.proposals for r in found.rounds):
        return f"no effect could be tried: the model has no place for {names}"
    return f"no effect could be tried: nothing in the fit recordings depends on {names}"


def _comparisons(identified: Identified) -> tuple[Comparison, ...]:
    """Every recording beside the model."""
    found = []
    for part, residual in (("fit", identified.fit.residual), ("validate", identified.validate)):
        trials = [t for t in identified.trials if t.part == part]
        own = errors_by_recording(trials, residual)
        for t in trials:
            simulated = identified.signals.get(t.name)
            if simulated is not None:
                measured = reached(t.case.measured, simulated)
                beside = simulated.select(measured.names).resample(measured.time)
                found.append(
                    Comparison(t.case.name, part, t.case.temperature_degC, measured, beside, own[t.case.name])
                )
    return tuple(found)


def _force(scenario: Scenario, identified: Identified) -> ForceBalance | None:
    """The force residual of a model on all recordings, if the scenario asks for it."""
    spec = scenario.force
    if spec is None:
        return None
    fit, compared = identified.fit, _comparisons(identified)
    masses: dict[tuple[str, str], float] = {}
    for trial in identified.trials:
        values = {**trial.case.fixed, **fit.unknowns.assignments(fit.vector, trial.group)}
        masses[trial.part, trial.case.name] = values.get(spec.mass, spec.mass_at_start)
    try:
        return force_balance(spec, compared, [masses[c.role, c.recording] for c in compared])
    except ValueError:
        return None  # a recording too short for the band has no force residual
