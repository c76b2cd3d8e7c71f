"""The loop closed: the effects in a class of their own, its FMU, and both models identified and scored alike."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from thsa_cosim.diagnosis.bench import Bench, Trial
from thsa_cosim.diagnosis.extend import extended_class, write_extended
from thsa_cosim.diagnosis.fit import Fit, cost_of, refine
from thsa_cosim.diagnosis.problem import with_fmu
from thsa_cosim.diagnosis.score import Scored
from thsa_cosim.diagnosis.screen import unknowns_of
from thsa_cosim.diagnosis.superset import qualified
from thsa_cosim.diagnosis.unknowns import Unknowns
from thsa_cosim.errors import StudyError
from thsa_cosim.export import export_fmu
from thsa_cosim.scenario import SimulationSpec, open_runner
from thsa_cosim.signals import FloatArray, Signals


@dataclass(frozen=True, eq=False)
class Identified:
    """A model identified on the fit recordings: its FMU, the fit, the held-out residuals (N,), and all its signals."""

    fmu: Path
    fit: Fit
    validate: FloatArray
    trials: tuple[Trial, ...]
    signals: dict[str, Signals | None]
    evaluations: int
    failures: dict[str, int]


def identify_model(
    fmu: Path,
    trials: tuple[Trial, ...],
    unknowns: Unknowns,
    starts: Sequence[FloatArray],
    simulation: SimulationSpec,
    workers: int,
    cluster: str | None,
) -> Identified:
    """Identify ``unknowns`` of an FMU on the fit recordings from every one of ``starts``; the best fit counts.

    StudyError if the FMU cannot be simulated at any start.
    """
    own = with_fmu(trials, fmu)
    with open_runner(simulation, [t.experiment for t in own], workers, cluster) as runner:
        bench = Bench(runner, own)
        found = bench.residuals(unknowns, np.array(starts), "fit")
        fits: list[Fit] = []
        for residual, vector in zip(found, starts, strict=True):
            known = min((f.cost for f in fits), default=np.inf)
            if residual is None or (fits and known <= cost_of(unknowns, vector, residual) + 1.0):
                continue  # the fit so far is better than this start
            fit = refine(bench, unknowns, vector, residual=residual, iterations=12)
            fits += [] if fit is None else [fit]
        best = min(fits, key=lambda f: f.cost, default=None)
        validate = None if best is None else bench.residuals(unknowns, best.vector[None, :], "validate")[0]
        if best is None or validate is None:
            reason = next(iter(bench.failures), "no run succeeded")
            raise StudyError(f"{fmu.name} cannot be identified: {reason}")
        return Identified(
            fmu, best, validate, own, bench.signals(unknowns, best.vector), bench.evaluations, bench.failures
        )


def write_extended_model(
    folder: Path, model: str, package: Path, accepted: Sequence[Scored], final: Fit
) -> tuple[Path, Path]:
    """Write the class that holds the accepted effects, with their values, and export it; (.mo, .fmu) in ``folder``."""
    base = qualified(model, package)
    effects = list(dict.fromkeys(s.candidate.effect.name for s in accepted))
    name = "_and_".join([f"{base.split('.')[0]}_with_{effects[0]}", *effects[1:]]).replace("-", "_")
    values = dict(zip(final.unknowns.names, final.vector.tolist(), strict=True))
    for scored in accepted:
        for parameter in scored.candidate.parameters:
            if parameter.fixed:
                values[parameter.variable] = scored.proposal.shapes[parameter.name]
    titles = ", ".join(dict.fromkeys(s.candidate.effect.title for s in accepted))
    source = extended_class(name, base, [s.candidate for s in accepted], values, f"{base} with: {titles}")
    file = write_extended(folder, name, source)
    fmu = export_fmu(str(file), package=package, output=folder / f"{name}.fmu")
    return file, fmu


def extended_unknowns(declared: Unknowns, accepted: Sequence[Scored]) -> Unknowns:
    """The declared parameters and those of the accepted effects, the latter from their own starts."""
    members = [u for s in accepted for u in unknowns_of(s.candidate, s.proposal.shapes)]
    return declared.with_members(list({u.name: u for u in members}.values()))
