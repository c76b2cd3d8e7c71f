"""The parts of a merged system, and where their pieces lie in its common vectors."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from thsa_cosim.system.structure import System


@dataclass(frozen=True)
class Member:
    """One component's generated C and its sizes."""

    name: str
    model: str
    """Text of its ``model.c``."""
    config: Mapping[str, float]
    """The numbers of its ``model_config.h``: N_X, VR_X, …"""
    references: Mapping[str, int]
    """Value references of its variables."""
    feedthrough: Mapping[str, tuple[str, ...] | None]
    inputs: tuple[str, ...]
    """Names of its inputs in the order of its u."""
    states: tuple[str, ...]
    """Names of its states in the order of its x."""

    def size(self, what: str) -> int:
        """One of the sizes, e.g. N_X."""
        return int(self.config.get(what, 0))

    def place(self, name: str) -> tuple[str, int] | None:
        """Group ("X", "W", …) and index of a variable; None for one that has no place of its own."""
        reference = self.references[name]
        for group, size in (("X", "N_X"), ("DX", "N_X"), ("U", "N_U"), ("P", "N_P"), ("W", "N_W")):
            index = reference - self.size(f"VR_{group}")
            if 0 <= index < self.size(size):
                return group, index
        return None

    def source(self, name: str) -> tuple[str, int] | None:
        """("X", k) for what equals a state, ("W", k) for an output; None for anything else."""
        found = self.place(name)
        if found is None or found[0] == "X":
            return found
        group, index = found
        if group != "W" or index >= self.size("N_Y"):
            return None
        body = self.model.split("int model_outputs(", 1)[1].split("\n}\n", 1)[0]
        same = re.search(rf"^\s*y\[{index}\] = x\[(\d+)\];$", body, re.M)
        return ("X", int(same[1])) if same else (group, index)


@dataclass(frozen=True)
class Layout:
    """Where each component's pieces lie: first index of every group by component, and the totals."""

    first: Mapping[str, Mapping[str, int]]
    total: Mapping[str, int]


def layout(members: Sequence[Member]) -> Layout:
    """Place x, inputs v, p, d with cache, outputs y, other variables w, g one after the other."""
    sizes = {
        member.name: {
            "X": member.size("N_X"),
            "V": member.size("N_U"),
            "P": member.size("N_P"),
            "D": member.size("N_D") + member.size("N_CACHE"),
            "Y": member.size("N_Y"),
            "W": member.size("N_W") - member.size("N_Y"),
            "G": member.size("N_G"),
        }
        for member in members
    }
    first: dict[str, dict[str, int]] = {member.name: {} for member in members}
    total = dict.fromkeys("XVPDYWG", 0)
    for group in total:
        for member in members:
            first[member.name][group] = total[group]
            total[group] += sizes[member.name][group]
    return Layout(first, total)


def prefix(index: int) -> str:
    """Prefix of a component's C names."""
    return f"c{index}_"


@dataclass(frozen=True)
class Glue:
    """A merged system: its components, the connections in terms of C, and the connectors."""

    system: System
    members: tuple[Member, ...]
    places: Layout
    inputs: tuple[tuple[str, tuple[tuple[int, float, float], ...]], ...]
    """External inputs: name and ((index into v, factor, offset), …)."""
    outputs: tuple[tuple[str, tuple[str, str], float, float], ...]
    """Output connectors: name, (component, variable), factor, offset."""

    def number(self, name: str) -> int:
        """Position of a component."""
        return next(k for k, member in enumerate(self.members) if member.name == name)

    def pin(self, name: str, variable: str) -> int:
        """Index into v of a component's input."""
        member = self.members[self.number(name)]
        return self.places.first[name]["V"] + member.inputs.index(variable)


def table(member: Member, name: str) -> list[float]:
    """One of a component's tables of start values, read from its source."""
    found = re.search(rf"model_{name}\[\] = \{{([^}}]*)\}};", member.model)
    assert found is not None, name
    size = {"p_start": "N_P", "p_tunable": "N_P", "u_start": "N_U"}.get(name, "N_X")
    return [float(number.strip(" ()")) for number in found[1].split(",")][: member.size(size)]


def input_starts(glue: Glue) -> list[float]:
    """Start values of the external inputs, from those of the first input that each drives."""
    starts: list[float] = []
    inner = [value for member in glue.members for value in table(member, "u_start")]
    for component in glue.system.components:
        for variable, value in component.start.items():
            if variable in glue.members[glue.number(component.name)].inputs:
                inner[glue.pin(component.name, variable)] = float(value)
    for _, pins in glue.inputs:
        pin, factor, offset = pins[0]
        starts.append((inner[pin] - offset) / factor)
    return starts
