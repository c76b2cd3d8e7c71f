"""An empirical law where no effect of the catalogue explains what is left: sparse regression over the slots' signals.

Terms (powers of what a slot reads, falls over speed and distance, waves over the position, energies that fade) join
the model one by one by the same forward selection, on the simulated closed loop and with the same gate on the held-out
recordings, as effects do (S. Brunton, J. Proctor, J. N. Kutz, PNAS 113 (2016) 3932, for sparse laws from a library of
terms). A law is a description: it gets no effect's name.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from thsa_cosim.diagnosis.catalogue.candidate import candidates_of
from thsa_cosim.diagnosis.catalogue.declared import DeclaredEffect
from thsa_cosim.diagnosis.catalogue.effect import Effect, EffectParameter, Variant
from thsa_cosim.diagnosis.catalogue.effects.inverter_dead_time import PERIODS
from thsa_cosim.diagnosis.catalogue.extend import (
    EMPIRICAL_NAME,
    export_kept,
    extended_class,
    qualified,
    source_beside,
)
from thsa_cosim.diagnosis.catalogue.slots import find_slots
from thsa_cosim.diagnosis.catalogue.superset import scales_of, slot_signals
from thsa_cosim.diagnosis.choosing.attribution import Attribution, attribute
from thsa_cosim.diagnosis.choosing.findings import values_of
from thsa_cosim.diagnosis.choosing.needless import prune
from thsa_cosim.diagnosis.choosing.orders import Machine
from thsa_cosim.diagnosis.choosing.score import Scored, extended_unknowns, fixed_shapes, held_shapes
from thsa_cosim.diagnosis.choosing.selection import Say
from thsa_cosim.diagnosis.choosing.verdict import VISIBLE
from thsa_cosim.diagnosis.choosing.wave_numbers import wave_number_finder
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.fit import Fit
from thsa_cosim.diagnosis.fitting.identified import Identified
from thsa_cosim.diagnosis.fitting.means import by_search
from thsa_cosim.diagnosis.fitting.trials import Trial, for_search
from thsa_cosim.diagnosis.fitting.unknowns import Unknowns
from thsa_cosim.diagnosis.fitting.weights import ChannelWeights
from thsa_cosim.diagnosis.results import EmpiricalLaw, EmpiricalTerm, Value
from thsa_cosim.scenario import DiagnoseSpec, OpenRunner, Scenario

#: At most so many terms: a law of more says no more than a plot. One that is only described has the most telling one.
_TERMS = 3


def _k(name: str, dimension: str, term: str, typical: float = 0.02) -> EffectParameter:
    return EffectParameter(name, dimension, typical, f"coefficient of {term}")


def _shape(
    name: str, dimension: str, what: str, starts: tuple[float, ...], scanned: bool = False
) -> EffectParameter:
    low, high = (0.1, 1e3) if scanned else (1e-3, 1e3)
    return EffectParameter(
        name, dimension, 1.0, what, role="shape", lower=low, upper=high, starts=starts, scanned=scanned
    )


_FALL = _shape("v_f", "V", "speed over which it falls", (0.03, 0.1, 0.3))
_DISTANCE = _shape("d_f", "D", "distance over which it falls", (0.1, 0.5))
_WAVE = _shape("w", "W", "wave number", (1.0, 2.0), scanned=True)
_PERIODS = _shape("n", "1", "periods per revolution", (1.0, 2.0))
_TURNS = _shape("n", "W", "periods per revolution", (1.0, 2.0), scanned=True)
_PLACE = EffectParameter(
    "z_b", "Z", 0.5, "position of the rise", "shape", -1.2, 1.2, starts=(0.1, 0.3, 0.5, 0.7, 0.9)
)
_WIDTH = EffectParameter("w_b", "Z", 0.1, "width of the rise", "shape", 0.01, 0.6, starts=(0.1,))
_TAKEN_UP = EffectParameter(
    "s_0", "1", 0.5, "share taken up at the start", "shape", 0.0, 1.0, starts=(0.0, 1.0)
)
_SIGN = _shape("i_s", "I", "current over which the sign turns", (0.01, 0.05))
_ELECTRICAL = replace(PERIODS, lower=1.0)
_FADING = EffectParameter(
    "T_f", "s", 10.0, "time over which E fades", role="shape", lower=0.5, upper=1e5, starts=(5.0, 100.0)
)
_EXPONENT = EffectParameter(
    "n", "1", 2.0, "exponent of the speed", role="shape", lower=1.1, upper=4.0, starts=(2.0, 1.5, 3.0)
)
_AT = EffectParameter("v_r", "V", 1.0, "speed at which k_vv holds", role="shape", fixed=True)
#: Interface and class → the parameters of every term. A force in proportion to the load with the sign of neither is
#: none: it gives back all that it takes, so it is no friction but a gain, which is searched at the sensors.
_LIBRARY: Mapping[tuple[str, str], tuple[tuple[EffectParameter, ...], ...]] = {
    ("FrictionEffect", "Empirical"): (
        (_k("k_1", "F", "1"),),
        (_k("k_a", "F/V", "|v|"),),
        (_k("k_vv", "F/V^2", "v |v|"),),
        (_k("k_z", "F/Z", "z"),),
        (_k("k_zz", "F/Z^2", "z^2"),),
        (_k("k_zs", "F/Z", "z sgn(v)"),),
        (_k("k_zzs", "F/Z^2", "z^2 sgn(v)"),),
        (_k("k_zv", "F/Z/V", "z v"),),
        (_k("k_Ns", "1", "|N| sgn(v)"),),
        (_k("k_Nv", "1/V", "|N| v"),),
        (_k("k_NNs", "1/F", "N^2 sgn(v)"),),
        (_k("k_f", "F", "exp(-|v|/{v_f}) sgn(v)"), _FALL),
        (_k("k_g", "F", "exp(-(v/{v_f})^2) sgn(v)"), _FALL),
        (_k("k_h", "F", "sgn(v)/(1 + (v/{v_f})^2)"), _FALL),
        (_k("k_d", "F", "exp(-d/{d_f}) sgn(v)"), _DISTANCE),
        (_k("k_sin", "F", "sin({w} z)", 0.01), _k("k_cos", "F", "cos({w} z)", 0.01), _WAVE),
        (_k("k_sin2", "F", "sin(2 {w} z)", 0.005), _k("k_cos2", "F", "cos(2 {w} z)", 0.005), _WAVE),
    ),
    ("FrictionEffect", "EmpiricalRise"): (
        (_k("k_b", "F", "exp(-((z - {z_b})/{w_b})^2/2) sgn(v)"), _PLACE, _WIDTH),
    ),
    ("ShaftEffect", "EmpiricalTorque"): (
        (_k("k_sin", "F", "sin({n} phi)", 0.01), _k("k_cos", "F", "cos({n} phi)", 0.01), _TURNS),
        (_k("k_Tsin", "1", "T sin({n} phi)", 0.01), _k("k_Tcos", "1", "T cos({n} phi)", 0.01), _TURNS),
    ),
    ("ContactEffect", "EmpiricalClearance"): (
        (
            EffectParameter(
                "gap", "m", 2e-5, "coefficient of a dead zone of this width", lower=0.0, upper=0.05
            ),
            _TAKEN_UP,
        ),
    ),
    ("ContactEffect", "EmpiricalDeflection"): (
        (_k("k_sin", "m", "sin({n} phi)", 2e-6), _k("k_cos", "m", "(cos({n} phi) - 1)", 2e-6), _PERIODS),
    ),
    ("HeatingEffect", "EmpiricalHeating"): (
        (_k("k_R", "1/J", "E in the resistance", 2e-4), _FADING),
        (_k("k_psi", "1/J", "E in the flux", -5e-5), _FADING),
    ),
    ("TorqueConstantEffect", "EmpiricalTorqueConstant"): (
        (_k("k_a", "1/I", "|i_q| in the torque constant"),),
        (_k("k_ii", "1/I^2", "i_q^2 in the torque constant"),),
        (_k("e_a", "1/I", "|i_q| in the back-EMF"),),
        (_k("e_ii", "1/I^2", "i_q^2 in the back-EMF"),),
    ),
    ("VoltageEffect", "EmpiricalVoltage"): (
        (_k("k_1", "U", "1", 0.3),),
        (_k("k_s", "U", "tanh(i_q/{i_s})", 0.3), _SIGN),
        (_k("k_ii", "U/I^2", "i_q |i_q|", 0.3),),
        (
            _k("k_sin", "U", "tanh(i_q/{i_s}) sin({n} phi)", 0.05),
            _k("k_cos", "U", "tanh(i_q/{i_s}) cos({n} phi)", 0.05),
            _SIGN,
            _ELECTRICAL,
        ),
    ),
    ("SensorEffect", "EmpiricalSensor"): (
        (_k("k_1", "I", "1", 0.01),),
        (_k("k_u", "1", "u", 0.01),),
        (_k("k_uu", "1/I", "u |u|", 0.01),),
    ),
    ("SensorEffect", "EmpiricalDelay"): (
        (
            EffectParameter(
                "tau", "s", 2e-3, "coefficient of a delay by this time", lower=1e-5, upper=0.2, neutral=1e-5
            ),
        ),
    ),
}
#: Other formulas of a term: alternatives to it in its place; those with an exponent of their own are tried where one
#: of the others was accepted.
_FORMS: Mapping[tuple[str, str], tuple[tuple[EffectParameter, ...], ...]] = {
    ("Empirical", "k_vv"): (
        (_k("k_vvv", "F/V^3", "v^3"),),
        (_k("k_vv", "F/V^2", "{v_r}^2 |v/{v_r}|^{n} sgn(v)"), _EXPONENT, _AT),
    ),
}
#: Blocks that have states, or more shapes than a search can try everywhere, and the slots that they are offered in.
_ONLY: Mapping[str, tuple[str, ...]] = {
    "EmpiricalRise": ("screw", "guide"),
    "EmpiricalDelay": ("velocitySensor",),
}
#: Terms that are only offered once another one of their block is in the model, whose shape they share.
_BESIDE = {("EmpiricalVoltage", "k_sin"), ("Empirical", "k_sin2")}


def _effect(interface: str, block: str, parameters: tuple[EffectParameter, ...]) -> Effect:
    own = (block, parameters[0].name)
    forms = [
        Variant(interface, block, form, _ONLY.get(block), instead=_EXPONENT in form)
        for form in _FORMS.get(own, ())
    ]
    return Effect(
        name=f"{EMPIRICAL_NAME}/{block}.{parameters[0].name}",
        title="Term of an empirical law",
        physics=f"{parameters[0].description} in a sum of such terms",
        source="Brunton, Proctor, Kutz, PNAS 113 (2016) 3932",
        signature="whatever structure the effects with a name leave",
        variants=(Variant(interface, block, parameters, _ONLY.get(block), beside=own in _BESIDE), *forms),
    )


#: Every term is an effect of its own: several may join in one place, and none is another one's form.
EMPIRICAL = tuple(
    _effect(interface, block, parameters)
    for (interface, block), terms in _LIBRARY.items()
    for parameters in terms
)


@dataclass(frozen=True, eq=False)
class FoundLaw:
    """The terms of a law, and the ``effects`` accepted before that are still needed beside them."""

    terms: Attribution
    effects: tuple[Scored, ...]


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
    machine: Machine
    say: Say = lambda _: None

    def find(self) -> FoundLaw | None:
        """The terms that pass the gate; None if there is none, or nothing can be simulated."""
        assert self.spec.model is not None
        base = qualified(self.spec.model, self.spec.package)
        slots = find_slots(self.spec.model, self.spec.package)
        simulation = self.scenario.simulation
        own = [*(effect.candidate for effect in self.known), *(s.candidate for s in self.accepted)]
        shapes = {v: x for effect in self.known for v, x in effect.given.items()} | fixed_shapes(
            self.accepted
        )
        name = f"{base.replace('.', '_')}_empirical"
        terms = candidates_of(EMPIRICAL, slots, {})
        beside = source_beside(self.spec.model, self.spec.package)
        source = extended_class(name, base, [*own, *terms], shapes, beside=beside)
        fmu = export_kept(self.folder, name, source, self.spec.package)
        trials = for_search(self.trials, fmu)
        cases = [t.case for t in trials if t.part == "fit"]
        opening = partial(self.open_runner, simulation)
        scales = scales_of(fmu, slots, cases, opening)
        candidates = candidates_of(EMPIRICAL, slots, scales)
        with self.open_runner(simulation, [t.experiment for t in trials]) as runner:
            bench = Bench(runner, trials, held_shapes(candidates))
            unknowns = self._unknowns()
            scan = wave_number_finder(
                bench, slots, lambda values: slot_signals(slots, cases, values, opening), self.machine
            )
            found = attribute(
                bench,
                unknowns,
                candidates,
                scan,
                start=by_search(self.after.fit, self.trials, trials),
                seed=self.scenario.seed,
                most=_TERMS if self.spec.empirical else 1,
                machine=self.machine,
                deep=self.spec.empirical,
                say=self.say,
            )
            if found is None or not found.accepted:
                return None
            return self._without_needless(bench, found)

    def _without_needless(self, bench: Bench, found: Attribution) -> FoundLaw:
        """``found`` and the effects that it does not make needless: what imitated the law passed before it was there.

        A law that is only described stands beside all of them.
        """
        if not self.spec.empirical or not self.accepted:
            return FoundLaw(found, self.accepted)
        self.say("testing the effects beside the law")
        weights, factors = ChannelWeights(bench), bench.factors("validate")
        weights.base_held = found.base_validate * factors
        together = [*self.accepted, *found.accepted]
        kept, final, held, notes = prune(
            bench, self.declared, weights, together, found.final, found.final_validate * factors, VISIBLE
        )
        terms = replace(
            found,
            accepted=tuple(s for s in kept if s in found.accepted),
            final=final,
            final_validate=weights.plain(held, "validate"),
            notes=(*found.notes, *notes),
        )
        return FoundLaw(terms, tuple(s for s in kept if s in self.accepted))

    def _unknowns(self) -> Unknowns:
        """Declared parameters about the drawing, the accepted effects' from where they were identified."""
        values = self.after.fit.unknowns.named(self.after.fit.vector)
        members = extended_unknowns(self.declared, self.accepted).members
        return Unknowns(tuple(u if u.declared else replace(u, start=values[u.name]) for u in members))


def law_of(found: Attribution, fit: Fit, *, added: bool) -> EmpiricalLaw:
    """A search's accepted terms in the words of the result, with the values of ``fit``."""
    values = values_of(fit, declared=False)
    terms = tuple(term for scored in found.accepted for term in terms_of(scored, values))
    held = found.base_validate
    gain = float(held @ held - found.final_validate @ found.final_validate)
    return EmpiricalLaw(terms, gain, added)


def terms_of(scored: Scored, values: Mapping[str, Value]) -> Iterator[EmpiricalTerm]:
    """What one accepted effect adds: a term for each of its coefficients, with its shapes put in."""
    candidate = scored.candidate
    texts = {p.name: p.description.removeprefix("coefficient of ") for p in candidate.variant.parameters}
    shapes = {
        p.name: replace(
            values.get(p.variable, Value(scored.proposal.shapes.get(p.name, p.at_start), p.unit, 0.0)),
            variable=p.variable,
            role=p.role,
        )
        for p in candidate.parameters
        if p.role == "shape"
    }
    for p in candidate.coefficients:
        text = texts[p.name].format(**{name: f"{shape.value:.4g}" for name, shape in shapes.items()})
        value = replace(values[p.variable], variable=p.variable)
        yield EmpiricalTerm(candidate.slot.name, text, value, shapes)
