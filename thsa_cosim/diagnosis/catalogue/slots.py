"""The effect slots of a model: which places it offers, and the units there.

A slot is a replaceable component at the top level of a Modelica class, own or inherited, named ``<place>Effect`` and
constrained by one of the partial blocks of ``THSA.Interfaces``. A model with several places of a kind marks each by a
capital letter, a word with one, or a number: ``motorAEffect``, ``motorBEffect``.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from thsa_cosim.errors import ModelicaError
from thsa_cosim.export.flatten import components, flatten, locate

#: Per interface the connector variables that an effect reads, those that it gives, and the scales' variables.
INPUTS: Mapping[str, tuple[str, ...]] = {
    "FrictionEffect": ("v", "s", "z", "N"),
    "ShaftEffect": ("phi", "w", "T"),
    "ContactEffect": ("phi", "w", "delta", "v_s"),
    "HeatingEffect": ("P",),
    "TorqueConstantEffect": ("i_q",),
    "VoltageEffect": ("i_q",),
    "SensorEffect": ("u",),
    "PhaseEffect": ("i_q", "phi"),
}
#: Further inputs that a model need not give, since they have a default: passed on as modifiers, not as equations.
OPTIONAL: Mapping[str, tuple[str, ...]] = {"VoltageEffect": ("phi",), "ContactEffect": ("t_d",)}
OUTPUTS: Mapping[str, tuple[str, ...]] = {
    "FrictionEffect": ("F",),
    "ShaftEffect": ("tau",),
    "ContactEffect": ("e", "v_e", "k_e"),
    "HeatingEffect": ("g_R", "g_psi"),
    "TorqueConstantEffect": ("g_t", "g_e"),
    "VoltageEffect": ("du",),
    "SensorEffect": ("d",),
    "PhaseEffect": ("d", "du"),
}
SCALES: Mapping[str, Mapping[str, str]] = {
    "FrictionEffect": {"V": "v", "Z": "z", "F": "N"},
    "ShaftEffect": {"F": "T"},
    "ContactEffect": {},
    "HeatingEffect": {"P": "P"},
    "TorqueConstantEffect": {"I": "i_q"},
    "VoltageEffect": {"I": "i_q"},
    "SensorEffect": {"I": "u"},
    "PhaseEffect": {"I": "i_q"},
}
#: The position over which effects may repeat, of the interfaces that have one whose residual is searched for it.
POSITION: Mapping[str, str] = {"FrictionEffect": "z", "PhaseEffect": "phi"}
#: The interface whose slots can be made to follow a measured speed: force against speed.
INJECTED = "FrictionEffect"


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

    def is_a(self, place: str) -> bool:
        """Whether this is the ``place`` of an effect, or one of several: ``motor``, ``motorA``, ``motor2``."""
        rest = self.name.removeprefix(place)
        return self.name.startswith(place) and (not rest or rest[0].isupper() or rest[0].isdigit())

    @property
    def measured(self) -> str:
        """FMU input of the superset: the measured speed that the place is to follow."""
        return f"{self.name}Measured"

    @property
    def gain(self) -> str:
        """FMU parameter of the superset: the force per speed by which it follows, 0: it does not."""
        return f"{self.component}.g_m"

    @property
    def position(self) -> str | None:
        """FMU variable of the position over which effects here may repeat, if there is one."""
        own = POSITION.get(self.interface)
        return None if own is None else f"{self.component}.{own}"

    @property
    def is_angular(self) -> bool:
        """Whether that position is an angle."""
        return self.units.get(POSITION.get(self.interface, "")) == "rad"


def find_slots(model: str, package: Path) -> tuple[Slot, ...]:
    """The free slots that a Modelica class declares or inherits; ModelicaError if it has none."""
    file, name = locate(model, package)
    declared = [
        (component.name.removesuffix("Effect"), interface)
        for component in components(model, package).values()
        if "replaceable" in component.prefixes and component.name.endswith("Effect") and component.constraint
        if (interface := component.constraint[0].rsplit(".", 1)[-1]) in INPUTS
    ]
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
