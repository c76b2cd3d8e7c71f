"""A candidate: one effect in one slot, its parameters resolved to FMU variables with units and scales."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from thsa_cosim.diagnosis.catalogue.effect import Effect, EffectParameter, Variant
from thsa_cosim.diagnosis.catalogue.slots import SCALES, Slot


@dataclass(frozen=True)
class CandidateParameter:
    """A parameter of a candidate: ``variable`` of the FMU, in ``unit``; ``starts`` for shapes."""

    name: str
    variable: str
    unit: str
    role: str
    typical: float
    lower: float
    upper: float
    neutral: float
    starts: tuple[float, ...]
    fixed: bool
    scanned: bool

    @property
    def at_start(self) -> float:
        """Value in a model where the effect does not act: neutral, or a shape's first start."""
        return self.neutral if self.role == "coefficient" else self.starts[0]


@dataclass(frozen=True)
class Candidate:
    """One effect in one slot: ``parameters`` are those that a fit may change.

    ``all_parameters`` holds besides those that the other variants of the same block use. ``is_one_of_several``: the
    model has further slots that take the effect, so that its name says the place.
    """

    effect: Effect
    variant: Variant
    slot: Slot
    number: int
    parameters: tuple[CandidateParameter, ...]
    all_parameters: tuple[CandidateParameter, ...]
    is_one_of_several: bool = False

    @property
    def component(self) -> str:
        """Name of the effect's component in the slot."""
        return self.variant.component

    @property
    def qualified_block(self) -> str:
        """Qualified Modelica class."""
        return self.variant.block if "." in self.variant.block else f"THSA.Effects.{self.variant.block}"

    @property
    def name(self) -> str:
        """``effect`` or, for a friction pair and where there are several such places, ``effect:place``."""
        placed = self.slot.interface == "FrictionEffect" or self.is_one_of_several
        return f"{self.effect.name}:{self.slot.name}" if placed else self.effect.name

    @property
    def key(self) -> str:
        """Unique label: name, block and number of the variant."""
        return f"{self.name}/{self.component}{self.number}"

    @property
    def coefficients(self) -> tuple[CandidateParameter, ...]:
        """The parameters that vanish with the effect."""
        return tuple(p for p in self.parameters if p.role == "coefficient")

    @property
    def shapes(self) -> tuple[CandidateParameter, ...]:
        """The parameters that only matter beside a coefficient."""
        return tuple(p for p in self.parameters if p.role == "shape" and not p.fixed)


def candidates_of(
    effects: Iterable[Effect], slots: Iterable[Slot], scales: Mapping[str, Mapping[str, float]]
) -> tuple[Candidate, ...]:
    """Every variant of every effect in every slot that takes it; ``scales`` by slot name."""
    slots = tuple(slots)
    found = []
    for effect in effects:
        if effect.part == "screw" and not has_screw(slots):
            continue
        for slot in slots:
            fitting = [v for v in effect.variants if _takes(slot, v)]
            resolved = {id(v): _resolve(v, slot, scales.get(slot.name, {})) for v in fitting}
            for number, variant in enumerate(fitting):
                same = [p for v in fitting if v.block == variant.block for p in resolved[id(v)]]
                unique = tuple({p.name: p for p in same}.values())
                several = sum(_takes(s, variant) for s in slots) > 1
                found.append(Candidate(effect, variant, slot, number, resolved[id(variant)], unique, several))
    return tuple(found)


def _takes(slot: Slot, variant: Variant) -> bool:
    """Whether a way in which an effect acts has its place in ``slot``."""
    named = variant.slots is None or any(slot.is_a(place) for place in variant.slots)
    return variant.interface == slot.interface and named


def has_screw(slots: Iterable[Slot]) -> bool:
    """Whether something turns a shaft's angle into a path: a place moves along a length, or is the screw's own."""
    return any(
        slot.interface in ("ShaftEffect", "ContactEffect")
        or slot.units.get("z", "rad") not in ("rad", "deg", "1")
        for slot in slots
    )


def _resolve(variant: Variant, slot: Slot, scales: Mapping[str, float]) -> tuple[CandidateParameter, ...]:
    units = slot_units(slot)
    return tuple(_parameter(p, variant, slot, scales, units) for p in variant.parameters)


def slot_units(slot: Slot) -> dict[str, str]:
    """Units of the slot's scales by symbol: V, Z, D (distance), W (wave number), F, I, U, P."""
    units = {symbol: slot.units.get(variable, "1") for symbol, variable in SCALES[slot.interface].items()}
    if "F" in units:
        units["F"] = slot.units.get("F", units["F"])
    position = units.get("Z", "1")
    units |= {"D": position, "W": "1" if position in ("rad", "1") else f"rad/{position}", "U": "V"}
    return units


def _parameter(
    p: EffectParameter, variant: Variant, slot: Slot, scales: Mapping[str, float], units: Mapping[str, str]
) -> CandidateParameter:
    scale = p.scale(scales)
    return CandidateParameter(
        name=p.name,
        variable=f"{slot.component}.{variant.component}.{p.name}",
        unit=p.unit(units),
        role=p.role,
        typical=p.typical * scale,
        lower=p.lower * scale,
        upper=p.upper * scale,
        neutral=p.neutral * scale,
        starts=tuple(s * scale for s in (p.starts or (p.typical,))),
        fixed=p.fixed,
        scanned=p.scanned,
    )
