"""The effect slots of a model: which places it offers, and the units there.

A slot is a replaceable component at the top level of a Modelica class, named ``<place>Effect`` and constrained by one
of the partial blocks of ``THSA.Interfaces``.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from thsa_cosim.errors import ModelicaError
from thsa_cosim.export.flatten import flatten, locate

SLOT = re.compile(
    r"\breplaceable\s+[\w.]+\s+(\w+)Effect\b(?:[^;\"]|\"[^\"]*\")*?\bconstrainedby\s+(?:\w+\.)*(\w+)"
)

#: Per interface the connector variables that an effect reads, those that it gives, and the scales' variables.
INPUTS: Mapping[str, tuple[str, ...]] = {
    "FrictionEffect": ("v", "s", "z", "N"),
    "ShaftEffect": ("phi", "w", "T"),
    "ContactEffect": ("phi", "w", "delta", "v_s"),
    "HeatingEffect": ("P",),
    "TorqueConstantEffect": ("i_q",),
    "VoltageEffect": ("i_q",),
    "SensorEffect": ("u",),
}
OUTPUTS: Mapping[str, tuple[str, ...]] = {
    "FrictionEffect": ("F",),
    "ShaftEffect": ("tau",),
    "ContactEffect": ("e", "v_e", "k_e"),
    "HeatingEffect": ("g_R", "g_psi"),
    "TorqueConstantEffect": ("g_t", "g_e"),
    "VoltageEffect": ("du",),
    "SensorEffect": ("d",),
}
SCALES: Mapping[str, Mapping[str, str]] = {
    "FrictionEffect": {"V": "v", "Z": "z", "F": "N"},
    "ShaftEffect": {"F": "T"},
    "ContactEffect": {},
    "HeatingEffect": {"P": "P"},
    "TorqueConstantEffect": {"I": "i_q"},
    "VoltageEffect": {"I": "i_q"},
    "SensorEffect": {"I": "u"},
}


@dataclass(frozen=True)
class Slot:
    """A place for effects: ``name`` (without ``Effect``), its interface, and the units of its connector variables."""

    name: str
    interface: str
    units: Mapping[str, str]

    @property
    def component(self) -> str:
        """Name of the component in the model."""
        return self.name + "Effect"


def find_slots(model: str, package: Path) -> tuple[Slot, ...]:
    """The slots that a Modelica class declares itself; ModelicaError if it has none."""
    file, name = locate(model, package)
    text = re.sub(r"//.*|/\*.*?\*/", " ", file.read_text(encoding="utf-8"), flags=re.S)
    declared = [(m[1], m[2]) for m in SLOT.finditer(text) if m[2] in INPUTS]
    if not declared:
        raise ModelicaError(
            f"{file}: class {name} has no effect slot (a replaceable component <place>Effect constrained by a block of"
            " THSA.Interfaces); see docs/diagnose.md."
        )
    variables = flatten(model, package).variables
    return tuple(
        Slot(
            place,
            interface,
            {
                variable: variables[key].unit or "1"
                for variable in (*INPUTS[interface], *OUTPUTS[interface])
                if (key := f"{place}Effect.{variable}") in variables
            },
        )
        for place, interface in declared
    )
