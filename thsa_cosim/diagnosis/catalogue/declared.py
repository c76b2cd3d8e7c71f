"""Effects that the machine is known to have: parts of the declared model, fitted with its parameters."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from thsa_cosim.diagnosis.catalogue.candidate import Candidate, CandidateParameter
from thsa_cosim.errors import ScenarioError, did_you_mean


@dataclass(frozen=True)
class DeclaredEffect:
    """One way in which a known effect acts, and the start values (in the FMU's units) of its parameters, by name."""

    candidate: Candidate
    starts: Mapping[str, float]

    @property
    def given(self) -> Mapping[str, float]:
        """Shapes that no fit changes, by FMU variable."""
        return {p.variable: self.starts[p.name] for p in self.candidate.parameters if p.fixed}


def declared_effects(
    candidates: Sequence[Candidate], known: Mapping[str, Mapping[str, float]], where: str
) -> tuple[DeclaredEffect, ...]:
    """The candidates that ``known`` (effect → parameter → start value) asks for, such as ``"spring:guide"``.

    Of an effect that acts in several ways, the simplest that has a named parameter; without a name the first.
    ScenarioError names ``where`` for an effect or a parameter that the model does not offer, or a value outside its
    range.
    """
    found = []
    for name, values in known.items():
        own = [c for c in candidates if name in (c.name, c.effect.name)]
        places = dict.fromkeys(c.name for c in own)
        if not own:
            offered = tuple(dict.fromkeys(c.name for c in candidates))
            hint = did_you_mean(name, offered) or f" It has {', '.join(offered)}."
            raise ScenarioError(f"{where}: the model has no place for {name!r}.{hint}")
        if len(places) > 1:
            raise ScenarioError(f"{where}: {name!r} has several places; write one of {', '.join(places)}.")
        for candidate in _ways(own, tuple(values), f"{where}.{name}"):
            starts = {p.name: _start(p, values, f"{where}.{name}") for p in candidate.parameters}
            found.append(DeclaredEffect(candidate, starts))
    return tuple(found)


def _ways(candidates: Sequence[Candidate], names: Sequence[str], where: str) -> list[Candidate]:
    """The fewest ways that have all the parameters ``names``: for each name the simplest, once."""
    chosen: dict[str, Candidate] = {} if names else {candidates[0].key: candidates[0]}
    for name in names:
        having = [c for c in candidates if any(p.name == name for p in c.parameters)]
        if not having:
            offered = tuple(dict.fromkeys(p.name for c in candidates for p in c.parameters))
            hint = did_you_mean(name, offered) or f" It has {', '.join(offered)}."
            raise ScenarioError(f"{where}: there is no parameter {name!r}.{hint}")
        if not any(c.key in chosen for c in having):
            simplest = min(having, key=lambda c: len(c.parameters))
            chosen[simplest.key] = simplest
    return list(chosen.values())


def _start(p: CandidateParameter, values: Mapping[str, float], where: str) -> float:
    value = values.get(p.name, p.at_start)
    if not p.lower <= value <= p.upper:
        raise ScenarioError(
            f"{where}.{p.name} is {value:g} {p.unit}; it lies between {p.lower:g} and {p.upper:g}."
        )
    return value
