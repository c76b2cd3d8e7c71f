"""The superset: the declared model with every effect of the catalogue, each neutral, as one FMU.

One FMU serves the whole search: a candidate is a few start values. At neutral it is the declared model.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from thsa_cosim.batch import Experiment, Job, Runner, Status
from thsa_cosim.costs.sizes import SizesReducer
from thsa_cosim.diagnosis.catalogue.candidate import Candidate, candidates_of
from thsa_cosim.diagnosis.catalogue.effect import Effect
from thsa_cosim.diagnosis.catalogue.extend import export_kept, extended_class, qualified, source_beside
from thsa_cosim.diagnosis.catalogue.slots import SCALES, Slot, find_slots
from thsa_cosim.errors import StudyError
from thsa_cosim.fmu import read_description
from thsa_cosim.scenario import Opening, Scenario
from thsa_cosim.signals import Signals
from thsa_cosim.study import Case


@dataclass(frozen=True, eq=False)
class Superset:
    """The FMU with all effects, its slots, and the candidates with the scales of this drive.

    ``signals_at``: a runner of ``watched`` and start values by case → the inputs of every slot with a position, and
    the outputs that are compared, by case.
    """

    fmu: Path
    slots: tuple[Slot, ...]
    candidates: tuple[Candidate, ...]
    watched: tuple[Experiment, ...]
    signals_at: Callable[[Runner, Mapping[str, Mapping[str, float]]], Mapping[str, Signals]]

    @property
    def filled(self) -> tuple[Slot, ...]:
        """The slots that an effect is offered in: of the others the FMU has no component that could follow a speed."""
        names = {candidate.slot.name for candidate in self.candidates}
        return tuple(slot for slot in self.slots if slot.name in names)


def open_superset(
    scenario: Scenario,
    model: str,
    cases: Sequence[Case],
    effects: Iterable[Effect],
    folder: Path,
    open_: Opening,
) -> Superset:
    """Export the superset of ``model`` and measure its scales on the fit recordings ``cases``.

    StudyError if no recording can be simulated.
    """
    assert scenario.diagnose is not None
    fmu, slots, chosen = build_superset(model, scenario.diagnose.package, effects, folder)
    own = [replace(case, fmu=fmu) for case in cases]
    candidates = candidates_of(chosen, slots, scales_of(fmu, slots, own, open_))
    watched = slot_experiments(slots, own)
    return Superset(fmu, slots, candidates, watched, lambda runner, values: run_slots(runner, own, values))


def build_superset(
    model: str, package: Path, effects: Iterable[Effect], folder: Path
) -> tuple[Path, tuple[Slot, ...], tuple[Effect, ...]]:
    """Export the superset into ``folder``, where it is kept until anything that it is made from changes."""
    slots, effects = find_slots(model, package), tuple(effects)
    candidates = candidates_of(effects, slots, {})
    base = qualified(model, package)
    name = base.replace(".", "_") + "_superset"
    beside = source_beside(model, package)
    description = "All effects, neutral"
    source = extended_class(name, base, candidates, description=description, beside=beside, injection=True)
    return export_kept(folder, name, source, package), slots, effects


def scales_of(
    fmu: Path, slots: Sequence[Slot], cases: Sequence[Case], open_: Opening
) -> dict[str, dict[str, float]]:
    """How large speed, position, load … are in each slot over the recordings, in the slot's units.

    V, Z: largest magnitude; F, I, P: root mean square; D: distance travelled; W: 1 for an angle, else 2π/Z.
    Raises StudyError if no recording can be simulated.
    """
    wanted = {
        (slot.name, s): f"{slot.component}.{v}" for slot in slots for s, v in SCALES[slot.interface].items()
    }
    known = read_description(fmu).variables
    outputs = tuple(dict.fromkeys(v for v in wanted.values() if v in known))
    experiments = [replace(_with_outputs(case, outputs), reduce=SizesReducer(outputs)) for case in cases]
    with open_(experiments) as runner:
        outcomes = runner.run([Job(e.name) for e in experiments])
    runs = [o.reduced.reshape(-1, 4) for o in outcomes if o.status == Status.OK and o.reduced is not None]
    if not runs:
        raise StudyError(
            f"{fmu.name}: no recording can be simulated with the declared parameters: {outcomes[0].reason}"
        )
    found = np.array(runs)
    sizes = {name: found[:, k] for k, name in enumerate(outputs)}
    scales: dict[str, dict[str, float]] = {}
    for slot in slots:
        own: dict[str, float] = {}
        for symbol, variable in SCALES[slot.interface].items():
            name = f"{slot.component}.{variable}"
            if name in outputs:
                largest, squares, count, travel = sizes[name].T
                size = largest.max() if symbol in "VZ" else np.sqrt(squares.sum() / count.sum())
                own[symbol] = float(size) or 1.0
                if symbol == "Z":
                    own["D"] = float(travel.max()) or 1.0
        angular = slot.units.get("z", "rad") == "rad"
        own["W"] = 1.0 if angular else 2.0 * np.pi / own.get("Z", 1.0)
        scales[slot.name] = own
    return scales


def _slots_of(case: Case) -> str:
    return f"slots/{case.name}"


def _with_outputs(case: Case, outputs: tuple[str, ...]) -> Experiment:
    return replace(case.experiment(case.name, None), outputs=outputs)


def slot_signals(
    slots: Sequence[Slot],
    cases: Sequence[Case],
    values: Mapping[str, Mapping[str, float]],
    open_: Opening,
) -> dict[str, Signals]:
    """What effects read in every slot with a position, by case name, at the given start values per case."""
    with open_(slot_experiments(slots, cases)) as runner:
        return run_slots(runner, cases, values)


def slot_experiments(slots: Sequence[Slot], cases: Sequence[Case]) -> tuple[Experiment, ...]:
    """What ``run_slots`` runs: the cases with the position in every slot, and of a friction slot speed and load.

    What is compared comes along: an output may be the speed in a slot.
    """
    friction = (s for s in slots if s.interface == "FrictionEffect")
    outputs = tuple(
        dict.fromkeys(
            [
                *(f"{s.component}.{v}" for s in friction for v in ("v", "z", "N")),
                *(s.position for s in slots if s.position),
            ]
        )
    )
    return tuple(
        replace(
            _with_outputs(case, tuple(dict.fromkeys((*outputs, *case.measured.names)))), name=_slots_of(case)
        )
        for case in cases
    )


def run_slots(
    runner: Runner, cases: Sequence[Case], values: Mapping[str, Mapping[str, float]]
) -> dict[str, Signals]:
    """The signals of `slot_experiments`, by case name, at the given start values per case."""
    outcomes = runner.run([Job(_slots_of(c), values[c.name]) for c in cases])
    return {c.name: o.signals for c, o in zip(cases, outcomes, strict=True) if o.signals is not None}
