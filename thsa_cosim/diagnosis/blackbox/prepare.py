"""An FMU without source made ready for the search: its drive measured, its places offered to the effects."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from thsa_cosim.batch import Experiment, Job, Status
from thsa_cosim.diagnosis.blackbox.drive import Drive, integral_of, measure_drive
from thsa_cosim.diagnosis.blackbox.places import WrapperSlot, find_places, fitted_to, slot_of
from thsa_cosim.diagnosis.blackbox.wrapper import EffectWrapper, Term
from thsa_cosim.diagnosis.catalogue.candidate import Candidate, candidates_of
from thsa_cosim.diagnosis.catalogue.effect import Effect
from thsa_cosim.errors import StudyError
from thsa_cosim.fmu import FmuDescription
from thsa_cosim.scenario import BlackBoxSpec, Opening, Scenario
from thsa_cosim.signals import FloatArray, Signals
from thsa_cosim.study import Case

#: The step of the load that shows what a load costs, in the largest load of the recordings.
STEP = 0.01


@dataclass(frozen=True, eq=False)
class BlackBox:
    """The FMU's wrapper, the candidates, and what could not be offered, in sentences."""

    wrapper: EffectWrapper
    slots: tuple[WrapperSlot, ...]
    candidates: tuple[Candidate, ...]
    notes: tuple[str, ...]
    signals_at: Callable[[Mapping[str, Mapping[str, float]]], Mapping[str, Signals]]


def wrap_black_box(
    scenario: Scenario, cases: Sequence[Case], effects: Iterable[Effect], open_: Opening
) -> BlackBox:
    """Wrap the scenario's FMU so that every effect that fits can be put on; all are neutral.

    The drive is measured along the fit recordings ``cases``.

    ScenarioError if the load does nothing; StudyError if no recording can be simulated.
    """
    assert scenario.diagnose is not None
    spec, effects = scenario.diagnose.blackbox, tuple(effects)
    assert spec is not None
    observed = _outputs(spec)
    runs = _simulate(scenario.fmu, cases, observed, open_)
    first = next(case for case in cases if case.name in runs)
    drive = _measured(spec, scenario.fmu, first, runs[first.name], open_)
    places = find_places(spec, drive.has_torque)
    slots = tuple(slot_of(place, spec, scenario.fmu) for place in places)
    scales = {
        slot.name: _scales(slot, spec, drive, [(c, runs[c.name]) for c in cases if c.name in runs])
        for slot in slots
    }
    candidates = candidates_of(fitted_to(effects), slots, scales)
    wrapper = EffectWrapper(spec, drive, terms_of(candidates), scenario.diagnose.catalogue)

    def signals_at(values: Mapping[str, Mapping[str, float]]) -> Mapping[str, Signals]:
        """Positions at the places, of the FMU in its wrapper."""
        wrapped = [replace(c, wrapper=wrapper, fixed={**c.fixed, **values[c.name]}) for c in cases]
        return {
            name: Signals(run.time, _positions(spec, run))
            for name, run in _simulate(scenario.fmu, wrapped, observed, open_).items()
        }

    return BlackBox(wrapper, slots, candidates, _notes(spec, drive, effects, candidates), signals_at)


def terms_of(candidates: Iterable[Candidate]) -> tuple[Term, ...]:
    """One term per block and place."""
    terms = {}
    for c in candidates:
        prefix = f"{c.slot.component}.{c.component}"
        parameters = c.all_parameters
        terms[prefix] = Term(
            place=c.slot.name,
            effect=c.effect.name,
            block=c.variant.block,
            prefix=prefix,
            starts={p.name: p.at_start for p in parameters},
            neutral={p.name: p.neutral for p in parameters if p.role == "coefficient"},
        )
    return tuple(terms.values())


def _outputs(spec: BlackBoxSpec) -> tuple[str, ...]:
    names = (spec.speed, spec.position, spec.motor_speed, spec.current, spec.voltage)
    return tuple(dict.fromkeys(n for n in names if n is not None))


def _simulate(
    fmu: FmuDescription, cases: Sequence[Case], outputs: tuple[str, ...], open_: Opening
) -> dict[str, Signals]:
    """The outputs of every case that can be simulated, by name; StudyError if none can."""
    experiments: list[Experiment] = [replace(c.experiment(c.name, None), outputs=outputs) for c in cases]
    with open_(experiments) as runner:
        outcomes = runner.run([Job(e.name) for e in experiments])
    found = {
        e.name: o.signals
        for e, o in zip(experiments, outcomes, strict=True)
        if o.status == Status.OK and o.signals is not None
    }
    if not found:
        raise StudyError(
            f"{fmu.path.name}: no recording can be simulated with the declared parameters: {outcomes[0].reason}"
        )
    return found


def _measured(spec: BlackBoxSpec, fmu: FmuDescription, case: Case, base: Signals, open_: Opening) -> Drive:
    step, stepped = 0.0, None
    if spec.load is not None:
        load = case.inputs[spec.load]
        step = STEP * (float(np.max(np.abs(load))) or 1.0)
        moved = replace(case, inputs=case.inputs.with_values({spec.load: load + step}))
        stepped = _simulate(fmu, [moved], base.names, open_)[case.name]
    return measure_drive(spec, case.inputs, base, stepped, step)


def _positions(spec: BlackBoxSpec, run: Signals) -> dict[str, FloatArray]:
    """Position at each friction place, as the scan for wave numbers names them."""
    found = {}
    if spec.motor_speed is not None:
        found["wrapper.motor.z"] = integral_of(run.time, run[spec.motor_speed])
    if spec.position is not None:
        found["wrapper.load.z"] = run[spec.position]
    return found


def _scales(
    slot: WrapperSlot, spec: BlackBoxSpec, drive: Drive, runs: Sequence[tuple[Case, Signals]]
) -> dict[str, float]:
    """How large speed V, position Z, distance D, force F and current I are at a place, in its units."""
    scales = {"I": 1.0, "W": 1.0}
    if spec.current is not None:
        scales["I"] = _rms([run[spec.current] for _, run in runs])
    if slot.interface == "SensorEffect" and slot.name == "velocitySensor" and spec.speed is not None:
        scales["I"] = _rms([run[spec.speed] for _, run in runs])
    if slot.interface != "FrictionEffect":
        return scales
    positions = [_positions(spec, run)[f"{slot.component}.z"] for _, run in runs]
    speeds = [np.gradient(z, run.time) for z, (_, run) in zip(positions, runs, strict=True)]
    scales["V"] = max(float(np.max(np.abs(v))) for v in speeds) or 1.0
    scales["Z"] = max(float(np.max(np.abs(z))) for z in positions) or 1.0
    scales["D"] = max(float(np.sum(np.abs(np.diff(z)))) for z in positions) or 1.0
    scales["W"] = 1.0 if slot.units["z"] == "rad" else 2.0 * np.pi / scales["Z"]
    if spec.load is not None:
        scales["F"] = _rms([case.inputs.resample(run.time)[spec.load] for case, run in runs])
    else:
        scales["F"] = scales["I"] / abs(drive.current_per_force)
    return scales


def _rms(values: Sequence[FloatArray]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(values) ** 2))) or 1.0


def _notes(
    spec: BlackBoxSpec, drive: Drive, effects: Sequence[Effect], candidates: Sequence[Candidate]
) -> tuple[str, ...]:
    notes = []
    if None not in (spec.command, spec.current, spec.motor_speed) and not drive.has_torque:
        notes.append(
            "effects at the motor were not tried: command, motor speed and current of the FMU do not follow a"
            f" proportional-integral law (R² = {drive.fidelity:.3g})"
        )
    missing = [e.name for e in effects if e.name not in {c.effect.name for c in candidates}]
    if missing:
        notes.append(f"not tried, since this FMU gives no place to put them: {', '.join(missing)}")
    return tuple(notes)
