"""An empirical law where no effect of the catalogue explains what is left: sparse regression over the slots' signals.

Terms of a small polynomial in speed, position and load join the model one by one by the same forward selection, on the
simulated closed loop and with the same gate on the held-out recordings, as effects do (S. Brunton, J. Proctor,
J. N. Kutz, PNAS 113 (2016) 3932, for sparse laws from a library of terms).
A law is a description: it gets no effect's name.
"""

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from thsa_cosim.diagnosis.catalogue.candidate import candidates_of
from thsa_cosim.diagnosis.catalogue.declared import DeclaredEffect
from thsa_cosim.diagnosis.catalogue.effect import Effect, EffectParameter, Variant
from thsa_cosim.diagnosis.catalogue.extend import extended_class, qualified, source_beside, write_extended
from thsa_cosim.diagnosis.catalogue.slots import find_slots
from thsa_cosim.diagnosis.catalogue.superset import scales_of
from thsa_cosim.diagnosis.choosing.attribution import Attribution, attribute
from thsa_cosim.diagnosis.choosing.findings import values_of
from thsa_cosim.diagnosis.choosing.score import Scored, extended_unknowns, fixed_shapes
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.fit import Fit
from thsa_cosim.diagnosis.fitting.identified import Identified
from thsa_cosim.diagnosis.fitting.trials import Trial, with_fmu
from thsa_cosim.diagnosis.fitting.unknowns import Unknowns
from thsa_cosim.diagnosis.results import EmpiricalLaw, EmpiricalTerm
from thsa_cosim.export import export_fmu
from thsa_cosim.export.compile import native_platform
from thsa_cosim.scenario import DiagnoseSpec, OpenRunner, Scenario

#: At most so many terms: a law of more says no more than a plot.
_TERMS = 3
#: Coefficient of ``THSA.Effects.Empirical`` → its term and the coefficient's dimension.
LIBRARY = {
    "k_1": ("1", "F"),
    "k_vv": ("v |v|", "F/V^2"),
    "k_vvv": ("v^3", "F/V^3"),
    "k_z": ("z", "F/Z"),
    "k_zz": ("z^2", "F/Z^2"),
    "k_zs": ("z sgn(v)", "F/Z"),
    "k_zzs": ("z^2 sgn(v)", "F/Z^2"),
    "k_zv": ("z v", "F/Z/V"),
    "k_N": ("N", "1"),
    "k_Ns": ("|N| sgn(v)", "1"),
    "k_Nv": ("|N| v", "1/V"),
    "k_NNs": ("N^2 sgn(v)", "1/F"),
}
EMPIRICAL = Effect(
    name="empirical",
    title="Empirical law in speed, position and load",
    physics="F = sum of k_j phi_j(v, z, N)",
    source="Brunton, Proctor, Kutz, PNAS 113 (2016) 3932",
    signature="whatever structure the effects with a name leave",
    variants=tuple(
        Variant(
            "FrictionEffect", "Empirical", (EffectParameter(name, dimension, 0.02, f"coefficient of {term}"),)
        )
        for name, (term, dimension) in LIBRARY.items()
    ),
)


@dataclass(frozen=True, eq=False)
class LawSearch:
    """Where a law is searched: beside the ``accepted`` effects, from the model ``after`` that holds them."""

    scenario: Scenario
    spec: DiagnoseSpec
    trials: tuple[Trial, ...]
    declared: Unknowns
    known: tuple[DeclaredEffect, ...]
    accepted: tuple[Scored, ...]
    after: Identified
    folder: Path
    open_runner: OpenRunner

    def find(self) -> Attribution | None:
        """The terms that pass the gate; None if there is none, or nothing can be simulated."""
        assert self.spec.model is not None
        base = qualified(self.spec.model, self.spec.package)
        slots = tuple(
            s for s in find_slots(self.spec.model, self.spec.package) if s.interface == "FrictionEffect"
        )
        simulation = self.scenario.simulation
        own = [*(effect.candidate for effect in self.known), *(s.candidate for s in self.accepted)]
        shapes = {v: x for effect in self.known for v, x in effect.given.items()} | fixed_shapes(
            self.accepted
        )
        name = f"{base.replace('.', '_')}_empirical"
        terms = candidates_of((EMPIRICAL,), slots, {})
        beside = source_beside(self.spec.model, self.spec.package)
        source = extended_class(name, base, [*own, *terms], shapes, beside=beside)
        file = write_extended(self.folder, name, source)
        fmu = export_fmu(
            str(file),
            package=self.spec.package,
            output=self.folder / f"{name}.fmu",
            platforms=(native_platform().fmi3,),
        )
        trials = with_fmu(self.trials, fmu)
        scales = scales_of(
            fmu, slots, [t.case for t in trials if t.part == "fit"], partial(self.open_runner, simulation)
        )
        candidates = candidates_of((EMPIRICAL,), slots, scales)
        with self.open_runner(simulation, [t.experiment for t in trials]) as runner:
            bench = Bench(runner, trials)
            found = attribute(
                bench, self._unknowns(), candidates, lambda _: {}, seed=self.scenario.seed, most=_TERMS
            )
        return found if found is not None and found.accepted else None

    def _unknowns(self) -> Unknowns:
        """Declared parameters about the drawing, the accepted effects' from where they were identified."""
        values = self.after.fit.unknowns.named(self.after.fit.vector)
        members = extended_unknowns(self.declared, self.accepted).members
        return Unknowns(tuple(u if u.declared else replace(u, start=values[u.name]) for u in members))


def law_of(found: Attribution, fit: Fit, *, added: bool) -> EmpiricalLaw:
    """A search's accepted terms in the words of the result, with the values of ``fit``."""
    values = values_of(fit, declared=False)
    terms = tuple(
        EmpiricalTerm(
            scored.candidate.slot.name, LIBRARY[p.name][0], replace(values[p.variable], variable=p.variable)
        )
        for scored in found.accepted
        for p in scored.candidate.coefficients
    )
    held = found.base_validate
    gain = float(held @ held - found.final_validate @ found.final_validate)
    return EmpiricalLaw(terms, gain, added)
