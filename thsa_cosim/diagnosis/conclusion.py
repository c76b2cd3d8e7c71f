"""From an attribution to the result: the extended model, identified as the declared one was, and the verdict."""

import shlex
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from thsa_cosim import __version__
from thsa_cosim.diagnosis.blackbox.prepare import BlackBox
from thsa_cosim.diagnosis.blackbox.saved import write_wrapper
from thsa_cosim.diagnosis.catalogue.candidate import Candidate
from thsa_cosim.diagnosis.catalogue.declared import DeclaredEffect
from thsa_cosim.diagnosis.catalogue.extend import write_extended_model
from thsa_cosim.diagnosis.choosing.attribution import Attribution
from thsa_cosim.diagnosis.choosing.curves import falls
from thsa_cosim.diagnosis.choosing.equivalence import equivalence
from thsa_cosim.diagnosis.choosing.findings import (
    found_effects,
    judged,
    known_values,
    off_the_drawing,
    values_of,
)
from thsa_cosim.diagnosis.choosing.hidden import hidden_parts, notes_on_hidden, widening
from thsa_cosim.diagnosis.choosing.orders import Machine
from thsa_cosim.diagnosis.choosing.score import Scored, extended_unknowns, fixed_shapes
from thsa_cosim.diagnosis.choosing.spread import between_models
from thsa_cosim.diagnosis.choosing.verdict import left_over, note_on_standard_errors, verdict_on
from thsa_cosim.diagnosis.explaining.balance import close_balances
from thsa_cosim.diagnosis.explaining.dependence import dependence
from thsa_cosim.diagnosis.explaining.empirical import FoundLaw, LawSearch, law_of
from thsa_cosim.diagnosis.explaining.evidence import evidence
from thsa_cosim.diagnosis.explaining.experiment import separating_experiment
from thsa_cosim.diagnosis.explaining.instead import rival_laws, tied_laws
from thsa_cosim.diagnosis.explaining.slips import with_slips
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.fit import Fit
from thsa_cosim.diagnosis.fitting.identified import Identified, identify_model
from thsa_cosim.diagnosis.fitting.means import by_samples, by_search
from thsa_cosim.diagnosis.fitting.structure import errors, errors_by_recording
from thsa_cosim.diagnosis.fitting.trials import (
    Trial,
    note_on_means,
    note_on_tolerance,
    with_wrapper,
)
from thsa_cosim.diagnosis.fitting.uncertainty import standard_errors
from thsa_cosim.diagnosis.fitting.unknowns import Unknowns
from thsa_cosim.diagnosis.results import DiagnosisResult, EmpiricalLaw, RivalLaw, StructuredError
from thsa_cosim.export.compile import native_platform
from thsa_cosim.identify import ForceBalance, force_balance
from thsa_cosim.scenario import DiagnoseSpec, Scenario
from thsa_cosim.study import Comparison, CouplingError, Study, coupling_error, reached

#: The folder of the superset inside a study.
WORK = "superset"
#: A search's fit of the declared model is a better optimum if its cost is less by this: three standard errors, squared.
BETTER = 9.0
#: A law is described where effects leave this share of the declared model's structure. Set while looking at two units
#: whose effects leave less: the search took a quarter of their time.
WORTH = 0.2


@dataclass(frozen=True, eq=False)
class _Model:
    """A model of the result: identified, with its Modelica class and FMU, or the wrapper of a black box."""

    identified: Identified
    model: Path | None = None
    fmu: Path | None = None
    wrapper: Path | None = None


@dataclass(frozen=True, eq=False)
class Conclusion:
    """What follows from an attribution: the models before and after it, and what is said of them."""

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
        extended = self._extended(before)
        held_out = tuple(t for t in self.trials if t.part == "validate")
        share = left_over(held_out, before.validate, extended.identified.validate)
        found_errors = errors(held_out, extended.identified.validate)
        verdict = verdict_on(found_errors, len(found.accepted), _tested(found))
        law: EmpiricalLaw | None = None
        instead: tuple[RivalLaw, ...] = ()
        unexplained = verdict == "unexplained-structure" and self.box is None
        if unexplained and (why := note_on_no_law(share, self._sticking(), empirical=self.spec.empirical)):
            found = replace(found, notes=(*found.notes, why))
        elif unexplained:
            searched = self._law_search(extended.identified)
            if searched is not None and self.spec.empirical:
                # The share stays that of the effects: a law describes and explains nothing.
                extended = self._with_law(searched)
                found = replace(found, accepted=searched.effects, notes=(*found.notes, *searched.terms.notes))
                if not found.accepted:
                    share = left_over(held_out, before.validate, before.validate)
                    # Beside effects that the law made needless its rivals were not tried alone.
                    instead = () if self.found.accepted else tied_laws(searched.terms)
            if searched is not None:
                fit = extended.identified.fit if self.spec.empirical else searched.terms.final
                law = law_of(searched.terms, fit, added=self.spec.empirical)
        if verdict == "missing-effect" and self.spec.empirical and self.box is None:
            instead = self._instead()
        after = extended.identified
        changed = after is not before
        errors_before = _errors(before)
        errors_after = _errors(after) if changed else errors_before
        between = between_models(found, after.fit, self.bench.of("fit"))
        hidden = hidden_parts(found)
        sure_before, sure_after = _sure(before), np.hypot(_sure(after), between)
        told = notes_on_hidden(hidden, after.fit, sure_after)
        sure_after = np.hypot(sure_after, widening(hidden, after.fit))
        balances = close_balances(scenario, self.spec)
        coupled = self._coupled(after)
        said = coupled.note if isinstance(coupled, CouplingError) else coupled
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
            before=errors_before,
            after=errors_after if changed else {"fit": {}, "validate": {}},
            recordings_before=_errors_by_recording(before),
            recordings_after=_errors_by_recording(after) if changed else {},
            declared_before=values_of(before.fit, declared=True, stderr=sure_before),
            declared_after=values_of(after.fit, declared=True, stderr=sure_after),
            unexplained=share,
            model=extended.model,
            extended_fmu=extended.fmu,
            wrapper=extended.wrapper,
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
            failures=_failures(self.bench, *([before, after] if changed else [before])),
            notes=(*self._notes(extended, found, errors_after["validate"]), *told, *([said] if said else [])),
            data=with_slips(scenario.data, after, scenario.file_units),
            asked=scenario.table.model_dump(mode="json", by_alias=True, exclude_unset=True),
            coupling=coupled if isinstance(coupled, CouplingError) else None,
            instead=instead,
        )

    def _sticking(self) -> str:
        """The name of an effect that makes the machine stick and slip, "" if there is none.

        It was found in step, be it dropped since, or its law falls over the speed.
        """
        values = self.found.final.unknowns.named(self.found.final.vector)
        falling = (s.candidate.name for s in self.found.accepted if falls(s.candidate, values))
        return next(iter((*self.found.sticking, *falling)), "")

    def _coupled(self, model: Identified) -> CouplingError | str:
        """What the communication step of a foreign FMU costs at the fit, on the first fit recording."""
        trial = next(t for t in model.trials if t.part == "fit")
        simulated = model.signals.get(trial.name)
        if simulated is None:
            return ""
        return coupling_error(
            self.scenario.fmu,
            self.scenario.simulation,
            trial.case.experiment(trial.name, None),
            model.fit.unknowns.assignments(model.fit.vector, trial.group),
            simulated,
            {channel.name: channel.noise for channel in trial.case.channels},
            self.study.open_runner,
        )

    def _declared(self) -> Identified:
        """The declared model, identified once more if the search came to a better optimum than the drawing led to."""
        base = self.found.base
        before = by_search(self.before.fit, self.trials, self.bench.trials)
        if self.found.base_cost > before.cost - BETTER * before.inflation:
            return self.before
        self.study.place.say("identifying the declared model, starting from the result of the search")
        return self._identify(self.before.fmu, self.unknowns, [self.before.fit.vector, base.vector], ())

    def _extended(self, declared: Identified) -> _Model:
        """The model with the accepted effects on its own FMU; the declared one where none was accepted."""
        accepted, final = self.found.accepted, self.found.plain_final
        if not accepted:
            return _Model(declared)
        model = fmu = wrapper = None
        wider = extended_unknowns(self.unknowns, accepted)
        if self.box is None:
            self.study.place.say(f"exporting the model with {', '.join(s.candidate.name for s in accepted)}")
            model, fmu = self._written(accepted, final)
        self.study.place.say("identifying the extended model from the drawing")
        after = self._identify_near(final, fmu or declared.fmu, wider, accepted)
        if self.box is not None:
            values = {**after.trials[0].case.fixed, **after.fit.unknowns.named(after.fit.vector)}
            wrapper = write_wrapper(self.study.folder, self.scenario.fmu.path, self.box.wrapper, values)
        return _Model(after, model, fmu, wrapper)

    def _law_search(self, after: Identified) -> FoundLaw | None:
        """An empirical law in what the extended model leaves."""
        self.study.place.say("looking for an empirical law")
        return self._search(self.found.accepted, after).find()

    def _instead(self) -> tuple[RivalLaw, ...]:
        """Empirical laws that explain the held-out recordings as well as the effects do, without them."""
        self.study.place.say("looking for an empirical law in place of the effects")
        searched = self._search((), self.before).find()
        if searched is None:
            return ()
        return rival_laws(self.found, searched.terms, self.bench.trials)

    def _search(self, accepted: tuple[Scored, ...], after: Identified) -> LawSearch:
        return LawSearch(
            self.scenario, self.spec, self.trials, self.unknowns, self.known, accepted, after,
            self.study.folder / WORK, self.study.open_runner, self.machine, self.study.place.say,
        )  # fmt: skip

    def _with_law(self, law: FoundLaw) -> _Model:
        """The model with an empirical law and the effects that are still needed."""
        added, final = (*law.effects, *law.terms.accepted), law.terms.plain_final
        model, fmu = self._written(added, final)
        wider = extended_unknowns(self.unknowns, added)
        return _Model(self._identify_near(final, fmu, wider, added), model, fmu)

    def _written(self, accepted: Sequence[Scored], final: Fit) -> tuple[Path, Path]:
        """Class and FMU of the model with the effects ``accepted``."""
        assert self.spec.model is not None
        built = _built(self.known, accepted, final)
        return write_extended_model(self.study.folder, self.spec.model, self.spec.package, *built)

    def _identify_near(
        self, final: Fit, fmu: Path, unknowns: Unknowns, accepted: Sequence[Scored]
    ) -> Identified:
        """``unknowns`` from the drawing, where that can be in step with the machine, and where the search ended."""
        hint = final.at(unknowns.names)
        near = by_samples(final, self.trials, self.bench.trials)
        starts = [hint] if self.found.sticking else [unknowns.at_drawing(hint), hint]
        return self._identify(fmu, unknowns, starts, accepted, near)

    def _identify(
        self,
        fmu: Path,
        unknowns: Unknowns,
        starts: Sequence[np.ndarray],
        accepted: Sequence[Scored],
        near: Fit | None = None,
    ) -> Identified:
        trials = self.trials
        if self.box is not None:
            trials = with_wrapper(trials, self.box.wrapper, fixed_shapes(accepted))
        return identify_model(
            fmu, trials, unknowns, starts, self.scenario.simulation, self.study.open_runner, near
        )

    def _notes(
        self, extended: _Model, found: Attribution, left: Mapping[str, StructuredError]
    ) -> Iterator[str]:
        """What a reader of the result should know, whose model has ``left`` held-out errors: sentences."""
        yield from self.bench.notes
        yield from note_on_means(self.trials)
        yield from found.notes
        yield from note_on_tolerance(self.trials, self.scenario.simulation.tolerance)
        if self.box is not None:
            yield from self.box.notes
        if not _tested(found):
            yield _untested(found, self.effects)
        yield from off_the_drawing(extended.identified.fit)
        if said := note_on_standard_errors(left, len(found.accepted)):
            yield said
        if extended.model is not None and extended.fmu is not None:
            again = export_command(extended.model, self.spec.package, extended.fmu)
            yield f"{extended.fmu.name} is for {native_platform().fmi3} only; {again} compiles it for all platforms"


def note_on_no_law(share: float, sticking: str, *, empirical: bool) -> str:
    """Why no law is searched in the ``share`` of the declared model's structure that effects leave; "" if one is.

    ``sticking``: an effect that makes the machine stick and slip, "" for none.
    """
    if empirical or (share >= WORTH and not sticking):
        return ""
    what = f"in the {share:.0%} of the repeatable residual that the effects leave"
    if sticking:
        what = f"beside {sticking}: a model that sticks and slips at other times than the machine says little of that"
    return f"no empirical law was searched {what}; empirical = true in [diagnose] searches one"


def export_command(model: object, package: object, fmu: object) -> str:
    """The command that exports ``model`` to ``fmu``, as a shell takes it, whatever is in its paths."""
    return shlex.join(map(str, ("thsa-cosim", "export", model, "--package", package, "-o", fmu)))


def _built(
    known: Sequence[DeclaredEffect], accepted: Sequence[Scored], final: Fit
) -> tuple[list[Candidate], dict[str, float]]:
    """The candidates of an extended model and the values that it starts with."""
    candidates, values = known_candidates(known)
    values |= {**final.unknowns.named(final.vector), **fixed_shapes(accepted)}
    return [*candidates, *(s.candidate for s in accepted)], values


def known_candidates(known: Sequence[DeclaredEffect]) -> tuple[list[Candidate], dict[str, float]]:
    """The candidates of a declared model's effects and their start values."""
    values = {p.variable: effect.starts[p.name] for effect in known for p in effect.candidate.parameters}
    return [effect.candidate for effect in known], values


def _sure(identified: Identified) -> np.ndarray:
    """(n,) standard errors of an identified model's unknowns, with how well the fit and its starts agree on them.

    What the noise of smoothed inputs adds is among them.
    """
    own = standard_errors(identified.fit, [t for t in identified.trials if t.part == "fit"])
    further = (identified.apart, identified.fit.remaining_step, identified.of_inputs)
    return np.asarray(np.sqrt(own**2 + sum(np.square(one) for one in further)))


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


def _failures(bench: Bench, *models: Identified) -> dict[str, int]:
    """How often runs failed, by reason."""
    counts = Counter(bench.failures)
    for identified in models:
        counts.update(identified.failures)
    return dict(counts)
