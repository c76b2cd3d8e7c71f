"""Orders of the machine: how often a ripple repeats per turn of one of its shafts, wherever it was found.

An engineer's first question. The ratios between the places follow from a simulation, so that a wave along the stroke
with the period of the screw's lead is recognised as one per turn of the screw.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from thsa_cosim.diagnosis.catalogue.candidate import Candidate
from thsa_cosim.diagnosis.catalogue.slots import Slot
from thsa_cosim.signals import Signals

#: Two waves are one if they part by less than this phase over half the travel [rad].
PHASE = 0.125
#: Orders of a shaft that are looked for: of one that turns slowly (a screw, a gear), and of the motor (poles, slots).
SLOW, FAST = 12, 144
#: A shaft is coupled rigidly to a place if it explains this share of the place's motion.
RIGID = 0.9999


@dataclass(frozen=True)
class Order:
    """A ripple that repeats ``number`` times per turn of the shaft ``part``."""

    part: str
    number: int

    @property
    def effect(self) -> str:
        """The name that a ripple of this order goes by."""
        return "cogging" if is_motor(self.part) else "screw-ripple"

    def __str__(self) -> str:
        return f"{self.number} per turn of the {self.part}"


def is_motor(shaft: str) -> bool:
    """Whether a shaft is a motor's: ``motor``, or one of several, ``motorA``."""
    return Slot(shaft, "FrictionEffect", {}).is_a("motor")


@dataclass(frozen=True)
class Machine:
    """How places move with each other.

    ``turns``: slot → shaft → rad of the shaft per unit of the slot's position; ``travel``: how far each slot moves.
    """

    turns: Mapping[str, Mapping[str, float]]
    travel: Mapping[str, float]

    def order(self, slot: str, wave: float, stderr: float) -> Order | None:
        """The order of a ripple with the wave number ``wave`` +- ``stderr`` (rad per unit) at a slot, if it has one.

        Of two that fit, that of the slower shaft: its few low orders are the likelier.
        """
        shafts = sorted(self.turns.get(slot, {}).items(), key=lambda item: item[1])
        for shaft, ratio in shafts:
            number = round(wave / ratio)
            apart = abs(wave - number * ratio)
            # As near as the travel can tell, and six standard errors do not reach half the way to the next order;
            # a wave that is only as near as its error has to be sharper, or any would be near.
            close = apart * 0.5 * self.travel[slot] < PHASE and max(stderr, 0.0) < ratio / 12.0
            near = apart < 3.0 * stderr and max(stderr, 0.0) < 0.05 * ratio
            if 1 <= number <= (FAST if is_motor(shaft) else SLOW) and (close or near):
                return Order(shaft, number)
        return None

    def starts(self, slot: str) -> tuple[float, ...]:
        """Wave numbers at a slot that is no shaft: once and twice per turn of each shaft."""
        if slot in self.turns.get(slot, {}):
            return ()
        return tuple(n * ratio for ratio in self.turns.get(slot, {}).values() for n in (1, 2))


#: A machine of which no ratio is known.
NO_MACHINE = Machine({}, {})


def machine_of(slots: Sequence[Slot], signals: Mapping[str, Signals]) -> Machine:
    """The ratios between the slots with a position, from every simulated recording; shafts are friction slots."""
    placed = [s for s in slots if s.position is not None]
    friction = [s for s in placed if s.interface == "FrictionEffect"]
    positions = {
        s.name: np.concatenate([own - own.mean() for own in _positions(s, signals)] or [np.zeros(1)])
        for s in placed
    }
    turns: dict[str, dict[str, float]] = {}
    for place in placed:
        z, own = positions[place.name], turns.setdefault(place.name, {})
        for shaft in friction:
            turn = positions[shaft.name]
            if shaft.is_angular and z @ z > 0.0 and turn @ turn > 0.0:
                ratio = float(turn @ z / (z @ z))
                left = turn - ratio * z
                if left @ left <= (1.0 - RIGID) * (turn @ turn):
                    own[shaft.name] = abs(ratio)
    travel = {
        s.name: max((float(np.ptp(own)) for own in _positions(s, signals)), default=0.0) for s in placed
    }
    return Machine(turns, travel)


def _positions(slot: Slot, signals: Mapping[str, Signals]) -> list[np.ndarray]:
    name = slot.position
    return [run[name] for run in signals.values() if name is not None and name in run]


def name_by_order(candidate: Candidate, order: Order | None) -> str:
    """The name that a candidate goes by once its order is known.

    A ripple of a shaft is that shaft's, and friction that repeats over no shaft's turn is tied to the stroke.
    """
    effect = candidate.effect.name
    if order is not None:
        effect = order.effect
    elif candidate.variant.block == "RippleFriction":
        effect = "position-friction"
    return candidate.name.replace(candidate.effect.name, effect, 1)
