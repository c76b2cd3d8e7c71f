"""The use case: scenario → superset → attribution → conclusion."""

from collections.abc import Iterable
from functools import partial

from threadpoolctl import threadpool_limits

from thsa_cosim.batch.memory import give_back, kept
from thsa_cosim.diagnosis.blackbox.prepare import BlackBox, wrap_black_box
from thsa_cosim.diagnosis.catalogue.declared import DeclaredEffect, declared_effects
from thsa_cosim.diagnosis.catalogue.effect import Effect
from thsa_cosim.diagnosis.catalogue.extend import write_extended_model
from thsa_cosim.diagnosis.catalogue.known import choose, known_effects
from thsa_cosim.diagnosis.catalogue.superset import Superset, open_superset
from thsa_cosim.diagnosis.choosing.attribution import attribute
from thsa_cosim.diagnosis.choosing.in_step import InStep
from thsa_cosim.diagnosis.choosing.orders import machine_of
from thsa_cosim.diagnosis.choosing.score import held_shapes
from thsa_cosim.diagnosis.choosing.self_excited import SelfExcited
from thsa_cosim.diagnosis.choosing.wave_numbers import wave_number_finder
from thsa_cosim.diagnosis.conclusion import WORK, Conclusion, known_candidates
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.drawing import declared_unknowns
from thsa_cosim.diagnosis.fitting.following import Following
from thsa_cosim.diagnosis.fitting.identified import identify_model
from thsa_cosim.diagnosis.fitting.means import by_search
from thsa_cosim.diagnosis.fitting.trials import (
    Trial,
    finer,
    for_search,
    spec_of,
    trials_of,
    with_wrapper,
)
from thsa_cosim.diagnosis.fitting.unknowns import Unknowns, declared_unknowns_of
from thsa_cosim.diagnosis.results import DiagnosisResult
from thsa_cosim.errors import StudyError
from thsa_cosim.scenario import DiagnoseSpec, Scenario
from thsa_cosim.study import Place, Study, describe, study_identity


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
    with one_thread, kept(), Study.open(place, study_identity(scenario), describe(scenario)) as study:
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
        declared, driven = trials, for_search(trials, tested.fmu)
        if spec.known:
            known = declared_effects(tested.candidates, spec.known, f"{scenario.path}: diagnose.known")
            unknowns = unknowns.with_members(declared_unknowns_of(known))
            say(f"exporting the declared model with {', '.join(spec.known)}")
            _, fmu = write_extended_model(
                study.folder / WORK, spec.model, spec.package, *known_candidates(known)
            )
    say("identifying the declared model from the drawing")
    before = identify_model(
        fmu,
        declared,
        unknowns,
        [unknowns.start],
        scenario.simulation,
        study.open_runner,
    )
    watched = () if isinstance(tested, BlackBox) else tested.watched
    with study.open_runner(scenario.simulation, [*(t.experiment for t in driven), *watched]) as runner:
        signals_at = tested.signals_at if isinstance(tested, BlackBox) else partial(tested.signals_at, runner)
        given = {variable: value for effect in known for variable, value in effect.given.items()}
        bench = Bench(runner, driven, {**held_shapes(tested.candidates), **given})
        at_start = {
            t.case.name: unknowns.assignments(before.fit.vector, t.group) for t in driven if t.part == "fit"
        }
        machine = machine_of(tested.slots, signals_at(at_start))
        scan = wave_number_finder(bench, tested.slots, signals_at, machine)
        slots = () if isinstance(tested, BlackBox) else tested.filled
        with Following(bench, slots, signals_at, opening) as following:
            ways = (bench, following, unknowns, tested.candidates, scan, machine, scenario.seed, say)
            self_excited = SelfExcited(*ways)
            found = attribute(
                bench,
                unknowns,
                tested.candidates,
                scan,
                start=by_search(before.fit, declared, driven),
                seed=scenario.seed,
                most=spec.most,
                machine=machine,
                stuck=InStep(*ways).found,
                continued=self_excited.continued,
                rough=self_excited.is_for,
                say=say,
            )
    # What the search found at a finer tolerance is judged at no coarser one.
    trials = finer(trials, min(t.case.tolerance or 1.0 for t in bench.trials))
    give_back()  # what the search took
    if found is None:
        reason = next(iter(bench.failures), "no run succeeded")
        raise StudyError(f"{scenario.path}: the model with all effects cannot be simulated: {reason}")
    names = tuple(effect.name for effect in effects)
    return Conclusion(
        scenario, spec, study, trials, unknowns, before, found, bench, names, machine, known, box
    ).result()
