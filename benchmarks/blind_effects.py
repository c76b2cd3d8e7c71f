"""What the units of the blind benchmark do beyond their drawing: forms drawn at random, one amplitude each.

The forms come from the literature on drives and friction, not from the catalogue of `thsa-cosim diagnose`: this
benchmark asks whether the catalogue recognises an effect whose form it does not share. Amplitude 1 is a typical
value; `blind_strength` finds the amplitude at which an effect is as visible as a strength demands.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from blind_plant import Rig, Undeclared

Random = np.random.Generator
Fields = Mapping[str, float]


@dataclass(frozen=True)
class Coefficient:
    """A true value whose definition leaves no choice; `words` occur in the names that it may go by."""

    value: float
    unit: str
    words: tuple[str, ...]


@dataclass(frozen=True)
class Draft:
    """An effect with everything drawn but its amplitude."""

    name: str  # as in the contract, or the name of an effect that no catalogue has
    form: str
    fields: Callable[[float], Fields]  # amplitude -> fields of `Undeclared`
    most: float  # largest plausible amplitude
    coefficients: Callable[[Fields], tuple[Coefficient, ...]] = lambda fields: ()


def combined(*settings: Fields) -> Undeclared:
    """All effects of a unit; raises ValueError where two want the same field."""
    together: dict[str, float] = {}
    for fields in settings:
        if shared := together.keys() & fields.keys():
            raise ValueError(f"two effects set {sorted(shared)}")
        together.update(fields)
    return Undeclared(**together)


def _one(field: str, unit: str, *words: str) -> Callable[[Fields], tuple[Coefficient, ...]]:
    return lambda fields: (Coefficient(abs(fields[field]), unit, words),)


def _signed(field: str, unit: str, *words: str) -> Callable[[Fields], tuple[Coefficient, ...]]:
    return lambda fields: (Coefficient(fields[field], unit, words),)


def log_uniform(random: Random, low: float, high: float) -> float:
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def either_way(random: Random) -> float:
    return float(random.choice([-1.0, 1.0]))


def stribeck(random: Random, rig: Rig) -> Draft:
    """Breakaway above Coulomb friction: exp(-(v/v_S)^n) (Bo and Pavelescu), or Hess and Soom's fraction."""
    exponent = float(random.choice([1.0, 2.0, 0.0]))
    form = {1.0: "exponential", 2.0: "gaussian", 0.0: "hess-soom"}[exponent]
    if random.random() < 0.5:
        speed = log_uniform(random, 3e-4, 2e-3)
        return Draft(
            "stribeck",
            f"nut, {form}",
            lambda a: {
                "stribeck_nut": 0.3 * a * rig.F_fn,
                "stribeck_nut_speed": speed,
                "stribeck_exponent": exponent,
            },
            most=4.0,
            coefficients=_one("stribeck_nut_speed", "m/s") if exponent else lambda fields: (),
        )
    speed = log_uniform(random, 5.0, 30.0)
    return Draft(
        "stribeck",
        f"motor, {form}",
        lambda a: {
            "stribeck_motor": 0.5 * a * rig.T_fm,
            "stribeck_motor_speed": speed,
            "stribeck_exponent": exponent,
        },
        most=8.0,
        coefficients=_one("stribeck_motor_speed", "rad/s") if exponent else lambda fields: (),
    )


def asymmetric_friction(random: Random, rig: Rig) -> Draft:
    """More friction one way than the other, as wear of one flank or a preloaded seal gives."""
    way = either_way(random)
    field, unit = [
        ("asymmetry_nut", 0.1 * rig.F_fn),
        ("asymmetry_gear", 0.05 * rig.T_fg),
        ("asymmetry_nut_viscous", 0.1 * rig.b_n),
    ][int(random.integers(3))]
    return Draft(
        "asymmetric-friction", field.removeprefix("asymmetry_"), lambda a: {field: way * a * unit}, 8.0
    )


def load_dependent_friction(random: Random, rig: Rig) -> Draft:
    """Friction that grows with the force it carries: of the rolling contact, or of the gear mesh."""
    if random.random() < 0.5:
        return Draft(
            "load-dependent-friction",
            "nut",
            lambda a: {"load_nut": 0.01 * a},
            15.0,
            _one("load_nut", "1", "mu", "factor", "load"),
        )
    return Draft("load-dependent-friction", "gear mesh", lambda a: {"load_gear": 0.01 * a}, 15.0)


def backlash(random: Random, rig: Rig) -> Draft:
    """Play between screw and nut; as on the labelled units, or at rest on the loaded flank from the start."""
    closed = float(random.random() < 1.0 / 3.0)
    return Draft(
        "backlash",
        "flank closed at the start" if closed else "released in the middle",
        lambda a: {"gap": 1e-4 * a, "gap_closed": closed},
        8.0,
        _one("gap", "m", "gap", "play", "backlash", "width"),
    )


def cogging(random: Random, rig: Rig) -> Draft:
    """Torque of magnets against slots: 8 poles with 12 or 9 slots, and what an eccentric rotor makes of it."""
    order = float(random.choice([24.0, 24.0, 8.0, 12.0, 36.0]))
    phase, second = random.uniform(0.0, 2.0 * np.pi), float(random.choice([0.0, random.uniform(0.1, 0.3)]))
    return Draft(
        "cogging",
        f"{order:.0f} a revolution" + (", with its second harmonic" if second else ""),
        lambda a: {
            "cogging": 0.05 * a,
            "cogging_order": order,
            "cogging_phase": phase,
            "cogging_second": second,
        },
        12.0,
        _one("cogging", "N.m", "amplitude", "torque", "cogging"),
    )


def screw_ripple(random: Random, rig: Rig) -> Draft:
    """Once or twice a screw revolution: a torque of its own, a share of the load's torque, or an error of lead."""
    turns, phase = float(random.choice([1.0, 2.0])), random.uniform(0.0, 2.0 * np.pi)
    field, unit = [("ripple_torque", 2.0), ("ripple_share", 0.03), ("lead_error", 1e-5)][
        int(random.integers(3))
    ]
    dimension = {"ripple_torque": "N.m", "lead_error": "m"}.get(field)
    return Draft(
        "screw-ripple",
        f"{field.replace('_', ' ')}, {turns:.0f} a revolution",
        lambda a: {field: a * unit, "ripple_turns": turns, "ripple_phase": phase},
        10.0,
        _one(field, dimension, "amplitude", "torque", "ripple") if dimension else lambda fields: (),
    )


def position_friction(random: Random, rig: Rig) -> Draft:
    """Friction along the stroke: a slope (taper, misalignment) or a local rise (a worn or dirty spot)."""
    if random.random() < 0.5:
        way = either_way(random)
        return Draft(
            "position-friction",
            "slope",
            lambda a: {"slope_nut": way * 20.0 * a * rig.F_fn},
            3.0,
            _signed("slope_nut", "N/m"),
        )
    place, width = random.uniform(2e-3, 8e-3), random.uniform(1e-3, 3e-3)
    return Draft(
        "position-friction",
        "local rise",
        lambda a: {"rise_nut": 0.3 * a * rig.F_fn, "rise_at": place, "rise_width": width},
        8.0,
    )


def winding_self_heating(random: Random, rig: Rig) -> Draft:
    """Copper loss into one heat capacity that cools to the box: copper's coefficient, magnets warmed or not."""
    constant, flux = log_uniform(random, 8.0, 40.0), float(random.choice([0.0, 0.0, 1e-3]))
    return Draft(
        "winding-self-heating",
        "copper and magnets" if flux else "copper",
        lambda a: {"heating": 0.3 * a, "cooling": 1.0 / constant, "heat_flux": flux},
        4.0,
        lambda fields: (Coefficient(constant, "s", ("tau", "time", "constant")),),
    )


def torque_constant_saturation(random: Random, rig: Rig) -> Draft:
    """Iron that saturates with |i_q|, by its first or its second power; the back-EMF may lose likewise."""
    emf = float(random.random() < 0.5)
    field, unit = [("saturation", 0.005), ("saturation_square", 6e-4)][int(random.integers(2))]
    return Draft(
        "torque-constant-saturation",
        ("|i_q|" if field == "saturation" else "i_q squared") + (", back-EMF too" if emf else ""),
        lambda a: {field: a * unit, "saturation_emf": emf},
        10.0,
    )


def windage(random: Random, rig: Rig) -> Draft:
    """Drag of the rotor in its gas or oil: quadratic, or |w|^1.8 as for a turbulent gap (Bilgen and Boulos)."""
    exponent = float(random.choice([2.0, 2.0, 1.8]))
    return Draft(
        "windage",
        f"|w|^{exponent:g}",
        lambda a: {"windage": 0.02 * a, "windage_exponent": exponent},
        20.0,
        (lambda fields: (Coefficient(fields["windage"] * 1e-4, "N.m.s2/rad2", ()),))
        if exponent == 2.0
        else lambda fields: (),
    )


def friction_run_in(random: Random, rig: Rig) -> Draft:
    """Friction that fades over the distance since the start, as grease is pushed out of the way."""
    if random.random() < 0.5:
        distance = log_uniform(random, 8e-3, 5e-2)
        return Draft(
            "friction-run-in",
            "nut",
            lambda a: {"run_in_nut": 0.3 * a * rig.F_fn, "run_in_nut_distance": distance},
            4.0,
            _one("run_in_nut_distance", "m", "distance", "length"),
        )
    angle = log_uniform(random, 5.0, 30.0)
    return Draft(
        "friction-run-in",
        "gearbox",
        lambda a: {"run_in_gear": 0.1 * a * rig.T_fg, "run_in_gear_angle": angle},
        5.0,
    )


def current_sensor_gain(random: Random, rig: Rig) -> Draft:
    """The drive controls a current that it measures by a wrong factor."""
    way = either_way(random)
    return Draft(
        "current-sensor-gain",
        "in the loop",
        lambda a: {"current_gain": 1.0 + 0.03 * way * a},
        5.0,
        _signed("current_gain", "1", "gain"),
    )


def current_sensor_offset(random: Random, rig: Rig) -> Draft:
    """The drive controls a current that it measures with an offset."""
    way = either_way(random)
    return Draft(
        "current-sensor-offset",
        "in the loop",
        lambda a: {"current_offset": 0.1 * way * a},
        15.0,
        _signed("current_offset", "A", "offset"),
    )


def velocity_sensor_gain(random: Random, rig: Rig) -> Draft:
    """The sensor of the output velocity is off by a factor."""
    way = either_way(random)
    return Draft(
        "velocity-sensor-gain",
        "output",
        lambda a: {"velocity_gain": 1.0 + 0.005 * way * a},
        20.0,
        _signed("velocity_gain", "1", "gain"),
    )


def velocity_sensor_delay(random: Random, rig: Rig) -> Draft:
    """The sensor of the output velocity is late by a transport time."""
    return Draft(
        "velocity-sensor-delay",
        "pure transport",
        lambda a: {"velocity_delay": 5e-3 * a},
        10.0,
        _one("velocity_delay", "s", "delay"),
    )


def inverter_dead_time(random: Random, rig: Rig) -> Draft:
    """Voltage lost against the current's sign, softened near zero; phase currents add a sixth harmonic."""
    current, sixth = log_uniform(random, 0.05, 0.4), float(random.choice([0.0, 0.15]))
    return Draft(
        "inverter-dead-time",
        "with a sixth harmonic" if sixth else "soft sign",
        lambda a: {"dead_voltage": 1.5 * a, "dead_current": current, "dead_sixth": sixth},
        10.0,
        _one("dead_voltage", "V", "voltage", "drop", "dead", "u_d"),
    )


def spring(random: Random, rig: Rig) -> Draft:
    """A cable, a bellows or a seal that pulls the nut back to where it started, or pushes it away."""
    way = either_way(random)
    return Draft(
        "spring",
        "linear",
        lambda a: {"spring": 1e5 * way * a},
        20.0,
        _signed("spring", "N/m", "stiffness", "c"),
    )


CATALOGUE: Mapping[str, Callable[[Random, Rig], Draft]] = {
    maker.__name__.replace("_", "-"): maker
    for maker in (
        stribeck,
        asymmetric_friction,
        load_dependent_friction,
        backlash,
        cogging,
        screw_ripple,
        position_friction,
        winding_self_heating,
        torque_constant_saturation,
        windage,
        friction_run_in,
        current_sensor_gain,
        current_sensor_offset,
        velocity_sensor_gain,
        velocity_sensor_delay,
        inverter_dead_time,
        spring,
    )
}
