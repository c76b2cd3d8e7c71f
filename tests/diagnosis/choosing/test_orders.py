"""Orders of the machine: what a ripple's wave number is per turn of which shaft, on a geometry known by hand."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from thsa_cosim.diagnosis.catalogue.candidate import candidates_of
from thsa_cosim.diagnosis.catalogue.known import known_effects
from thsa_cosim.diagnosis.catalogue.slots import Slot
from thsa_cosim.diagnosis.choosing.orders import Machine, Order, machine_of, name_by_order
from thsa_cosim.signals import Signals

LEAD, RATIO = 10e-3, 30.0
ROUND, PATH = {"z": "rad", "v": "rad/s", "N": "N.m"}, {"z": "m", "v": "m/s", "N": "N"}
SLOTS = tuple(
    Slot(name, "FrictionEffect", units)
    for name, units in (("motor", ROUND), ("gearbox", ROUND), ("screw", PATH))
)
TIME = np.linspace(0.0, 8.0, 4001)


def run(amplitude: float, windup: float = 0.0) -> Signals:
    """Positions of a stroke of ``amplitude`` m each way; the screw winds up by a share of it under load."""
    x = amplitude * np.sin(TIME)
    turn = 2.0 * np.pi / LEAD * (x + windup * amplitude * np.sin(5.0 * TIME))
    z = {"motorEffect.z": RATIO * turn + 3.0, "gearboxEffect.z": turn, "screwEffect.z": x}
    return Signals(TIME, z)


@pytest.fixture
def machine() -> Machine:
    return machine_of(SLOTS, {"a": run(8e-3), "b": run(16e-3, windup=1e-4)})


def test_the_ratios_of_the_machine_follow_from_its_motion(machine: Machine):
    per_metre = 2.0 * np.pi / LEAD
    assert machine.turns["screw"] == {
        "motor": pytest.approx(RATIO * per_metre, rel=1e-5),
        "gearbox": pytest.approx(per_metre, rel=1e-5),
    }
    assert machine.turns["gearbox"] == {"motor": pytest.approx(RATIO), "gearbox": pytest.approx(1.0)}
    assert machine.travel["screw"] == pytest.approx(32e-3, rel=1e-3)


def test_friction_with_the_period_of_the_lead_is_one_per_turn_of_the_screw(machine: Machine):
    """629.9 +- 0.3 per m, as found on a unit with friction once per turn: the lead's is 628.3."""
    assert machine.order("screw", 629.9, 0.3) == Order("gearbox", 1)
    assert str(machine.order("screw", 2 * 628.3, 0.3)) == "2 per turn of the gearbox"
    assert machine.order("screw", 757.0, 0.5) is None
    assert machine.order("screw", 300.0, 0.5) is None
    assert machine.order("screw", 629.9, 60.0) is None, "an interval that holds anything says nothing"


def test_a_ripple_of_the_motor_is_known_wherever_it_was_found(machine: Machine):
    assert machine.order("gearbox", 30.0, 1e-3) == Order("motor", 1)
    assert machine.order("gearbox", 24.0 * RATIO, 1e-2) == Order("motor", 24)
    assert machine.order("motor", 24.001, 1e-3) == Order("motor", 24)
    assert machine.order("motor", 1.0 / RATIO, 1e-5) == Order("gearbox", 1)
    assert machine.order("gearbox", 2.44, 1e-3) is None
    assert machine.order("motor", 145.0, 1e-3) is None
    assert machine.order("nowhere", 1.0, 0.0) is None


def test_a_wave_has_to_be_as_near_as_the_travel_can_tell():
    """Less than 0.125 rad over half of a travel of 1: less than 0.25 apart."""
    own = Machine(
        {"x": {"wheel": 16.0}, "y": {"wheel": 12.0}, "z": {"wheel": 1.0}}, {"x": 1.0, "y": 1.0, "z": 1.0}
    )
    assert own.order("x", 48.2, 0.0) == Order("wheel", 3)
    assert own.order("x", 48.25, 0.0) is None
    assert own.order("z", 3.0, 0.0) == Order("wheel", 3)
    assert own.order("y", 36.0, 0.95) == Order("wheel", 3), "six standard errors are less than half an order"
    assert own.order("y", 36.0, 1.0) is None


def test_where_the_travel_tells_more_than_the_fit_three_standard_errors_are_near():
    own = Machine({"x": {"wheel": 20.0}}, {"x": 100.0})
    assert own.order("x", 61.4, 0.5) == Order("wheel", 3)
    assert own.order("x", 61.5, 0.5) is None
    assert own.order("x", 60.5, 0.9) == Order("wheel", 3)
    assert own.order("x", 60.5, 1.0) is None, "too wide an interval: a twentieth of an order"


def test_of_two_shafts_the_slower_one_and_of_a_slow_one_the_first_dozen_of_orders():
    own = Machine({"x": {"cam": 2.0, "wheel": 1.0, "motor": 0.25}}, {"x": 1.0})
    assert own.order("x", 36.0, 0.0) == Order("motor", 144)
    only = Machine({"x": {"cam": 2.0, "wheel": 1.0}}, {"x": 1.0})
    assert only.order("x", 6.0, 0.0) == Order("wheel", 6)
    assert only.order("x", 12.0, 0.0) == Order("wheel", 12)
    assert only.order("x", 14.0, 0.0) == Order("cam", 7), "14 per turn of the wheel are too many"


def test_small_motions_have_ratios_too_and_no_recording_has_no_travel():
    small = {"motorEffect.z": 3e-3 * np.sin(TIME), "gearboxEffect.z": 1e-3 * np.sin(TIME)}
    assert machine_of(SLOTS, {"a": Signals(TIME, small)}).turns["motor"]["gearbox"] == pytest.approx(1 / 3)
    assert machine_of(SLOTS, {}).travel == {"motor": 0.0, "gearbox": 0.0, "screw": 0.0}


def test_what_slips_or_stands_has_no_ratio():
    slipping = Signals(
        TIME,
        {"motorEffect.z": np.sin(TIME), "gearboxEffect.z": np.sin(TIME + 0.3), "screwEffect.z": TIME * 0},
    )
    machine = machine_of(SLOTS, {"a": slipping})
    assert set(machine.turns["motor"]) == {"motor"}
    assert machine.turns["screw"] == {}
    assert machine_of(SLOTS, {}).turns == {"motor": {}, "gearbox": {}, "screw": {}}


def test_the_machines_own_waves_are_tried_along_the_stroke(machine: Machine):
    assert machine.starts("gearbox") == ()
    per_metre = 2.0 * np.pi / LEAD
    found = np.sort(machine.starts("screw"))
    np.testing.assert_allclose(found, per_metre * np.array([1, 2, 30, 60]), rtol=1e-5)


def candidate(effect: str, block: str = "x", place: str = "screw") -> Any:
    return SimpleNamespace(
        effect=SimpleNamespace(name=effect), variant=SimpleNamespace(block=block), name=f"{effect}:{place}"
    )


def test_a_ripple_is_named_by_its_order():
    assert name_by_order(candidate("position-friction"), Order("gearbox", 1)) == "screw-ripple:screw"
    assert name_by_order(candidate("screw-ripple"), Order("motor", 24)) == "cogging:screw"
    assert name_by_order(candidate("cogging"), Order("gearbox", 1)) == "screw-ripple:screw"
    assert name_by_order(candidate("cogging"), Order("motor", 8)) == "cogging:screw"
    assert name_by_order(candidate("position-friction"), None) == "position-friction:screw"
    assert name_by_order(candidate("screw-ripple", "RippleFriction"), None) == "position-friction:screw"
    assert name_by_order(candidate("screw-ripple", "Ripple"), None) == "screw-ripple:screw"


def test_a_ripple_of_a_screw_is_offered_where_there_is_one():
    ripple = [known_effects()["screw-ripple"]]
    servo = (Slot("motor", "FrictionEffect", ROUND), Slot("gearbox", "FrictionEffect", ROUND))
    assert candidates_of(ripple, servo, {}) == ()
    assert candidates_of(ripple, SLOTS, {})
    assert candidates_of(ripple, (*servo, Slot("shaft", "ShaftEffect", {})), {})
    assert candidates_of([known_effects()["cogging"]], servo, {})
