"""Where an effect can act on an FMU without source, and the way it takes there."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal

from thsa_cosim.diagnosis.catalogue.effect import Effect, Variant
from thsa_cosim.diagnosis.catalogue.slots import Slot
from thsa_cosim.fmu import FmuDescription
from thsa_cosim.scenario import BlackBoxSpec

Way = Literal["load", "command", "reading", "output"]
"""``load``: a force added to the load input. ``command``: a torque at the motor, as the current that it costs.
``reading``: the same without a voltage, since only the reading of the current is off. ``output``: added to
an output."""


@dataclass(frozen=True)
class Place:
    """A slot of the wrapper: what of the name map it ``needs``, and the ``output`` that it changes, if it does."""

    name: str
    interface: str
    way: Way
    needs: tuple[str, ...]
    output: str | None = None


_TORQUE = ("command", "current", "motor_speed")
PLACES = (
    Place("motor", "FrictionEffect", "command", _TORQUE),
    Place("load", "FrictionEffect", "load", ("load", "position")),
    Place("torque", "TorqueConstantEffect", "command", _TORQUE),
    Place("currentSensor", "SensorEffect", "reading", _TORQUE),
    Place("velocitySensor", "SensorEffect", "output", ("speed",), "speed"),
    Place("inverter", "VoltageEffect", "output", ("voltage", "current"), "voltage"),
    Place("contact", "ContactEffect", "output", ("position", "load"), "position"),
)


@dataclass(frozen=True)
class WrapperSlot(Slot):
    """A place as a slot; its parameters are the wrapper's."""

    @property
    def component(self) -> str:
        """Prefix of the parameters' names."""
        return f"wrapper.{self.name}"


def find_places(spec: BlackBoxSpec, has_torque: bool) -> tuple[Place, ...]:
    """The places that the name map allows; those at the motor only if torques can be put on (``has_torque``)."""
    return tuple(
        place
        for place in PLACES
        if all(getattr(spec, key) is not None for key in place.needs)
        and (has_torque or place.way not in ("command", "reading"))
    )


def slot_of(place: Place, spec: BlackBoxSpec, fmu: FmuDescription) -> WrapperSlot:
    """The slot of a place, with units from the FMU."""

    def unit(key: str) -> str:
        name = getattr(spec, key)
        return (fmu.variables[name].unit or "1") if name is not None else "1"

    force = unit("load") if spec.load is not None else unit("current")
    if place.name == "motor":
        speed = unit("motor_speed")
        units = {"v": speed, "z": speed.removesuffix("/s"), "N": force, "F": force}
    elif place.name == "load":
        units = {"v": f"{unit('position')}/s", "z": unit("position"), "N": force, "F": force}
    elif place.name == "velocitySensor":
        units = {"u": unit("speed"), "d": unit("speed")}
    else:
        units = {"u": unit("current"), "d": unit("current"), "i_q": unit("current"), "du": unit("voltage")}
    return WrapperSlot(place.name, place.interface, units)


def fitted_to(effects: Iterable[Effect]) -> tuple[Effect, ...]:
    """The effects that have a law; what acts on a guide or a screw acts at the load here."""
    found = []
    for effect in effects:
        variants = tuple(_at_load(v) for v in effect.variants if v.law is not None)
        if variants:
            found.append(replace(effect, variants=variants))
    return tuple(found)


def _at_load(variant: Variant) -> Variant:
    if variant.slots is None or not {"guide", "screw"} & set(variant.slots):
        return variant
    return replace(variant, slots=(*variant.slots, "load"))
