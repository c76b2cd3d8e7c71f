"""The actuator as a diagram: where in the drive an effect sits."""

from collections.abc import Sequence
from dataclasses import dataclass

BLOCKS = ("Controller", "Inverter", "Motor", "Gearbox", "No-back", "Screw, nut", "Load")
"""The chain from the command to the load."""
SENSORS = ("Sensors",)

_OF_PLACE = {
    "inverter": "Inverter",
    "motor": "Motor",
    "winding": "Motor",
    "torque": "Motor",
    "shaft": "Screw, nut",
    "gearbox": "Gearbox",
    "input": "Gearbox",
    "noback": "No-back",
    "screw": "Screw, nut",
    "nut": "Screw, nut",
    "contact": "Screw, nut",
    "guide": "Load",
    "currentsensor": "Sensors",
    "velocitysensor": "Sensors",
}
"""Block by the place that a name gives behind its colon."""
_OF_EFFECT = {
    "backlash": "Screw, nut",
    "screw-ripple": "Screw, nut",
    "load-dependent-friction": "Screw, nut",
    "cogging": "Motor",
    "windage": "Motor",
    "winding-self-heating": "Motor",
    "torque-constant-saturation": "Motor",
    "inverter-dead-time": "Inverter",
    "dead-time-ripple": "Inverter",
    "phase-current-offset": "Sensors",
    "phase-current-gain": "Sensors",
    "current-sensor-gain": "Sensors",
    "current-sensor-offset": "Sensors",
    "velocity-sensor-gain": "Sensors",
    "velocity-sensor-delay": "Sensors",
}
"""Block of an effect that can sit in one place only."""


@dataclass(frozen=True)
class Box:
    """A block of the drawing, in its units; ``effects`` are those that sit in it."""

    name: str
    x: int
    y: int
    effects: tuple[str, ...]


def block_of(effect: str) -> str | None:
    """The block that an effect such as ``stribeck:gearbox`` sits in; None where it is not known."""
    name, _, place = effect.partition(":")
    return _OF_PLACE.get(place.lower()) or _OF_EFFECT.get(name)


def boxes(effects: Sequence[str]) -> list[Box]:
    """The diagram's boxes, 104 wide and 44 high, with the effects in them; four to a row."""
    found = []
    for k, name in enumerate((*BLOCKS, *SENSORS)):
        row, column = divmod(k, 4)
        # The second row runs back, so that neighbours of the chain stay neighbours.
        at = column if row == 0 else 3 - column
        own = tuple(e for e in effects if block_of(e) == name)
        found.append(Box(name, 8 + 132 * at, 10 + 92 * row, own))
    return found
