"""What a unit of the blind benchmark lacks at each place of the model, as a law beside the one that was found there.

Both are evaluated over the same run of the found model: its speeds, positions and loads are the visited range. What
the declared parameters of a place can take up (a Coulomb friction, a resistance) says nothing of a law, and is removed
from both.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from blind_plant import FloatArray, Rig, Undeclared

Signals = Mapping[str, FloatArray]
#: Connectors of the slots: those that are not in the model's FMU carry nothing.
SLOTS: Mapping[str, tuple[str, ...]] = {
    "motorEffect": ("v", "s", "z", "N", "F"),
    "gearboxEffect": ("v", "s", "z", "N", "F"),
    "screwEffect": ("v", "s", "z", "N", "F"),
    "shaftEffect": ("phi", "T", "tau"),
    "contactEffect": ("phi", "delta", "e"),
    "windingEffect": ("P", "g_R"),
    "torqueEffect": ("i_q", "g_t"),
    "inverterEffect": ("i_q", "du"),
    "currentSensorEffect": ("u", "d"),
    "velocitySensorEffect": ("u", "d"),
}
#: A pair slides where the regularised sign of its speed is this near to +-1.
_SLIDES = 0.99


@dataclass(frozen=True)
class Law:
    """``true`` and ``found`` (n,) at a place in its unit; ``free`` (n, k): what its declared parameters take up."""

    true: FloatArray
    found: FloatArray
    free: FloatArray

    def deviation(self) -> tuple[float, float]:
        """Of the found law from the true one, over the size of the true one: root mean squares, largest values."""
        true, error = self._beyond(self.true), self._beyond(self.found - self.true)
        rms = float(np.sqrt(np.mean(error**2) / np.mean(true**2)))
        return rms, float(np.max(np.abs(error)) / np.max(np.abs(true)))

    def _beyond(self, law: FloatArray) -> FloatArray:
        size = np.linalg.norm(self.free, axis=0)
        columns = self.free[:, size > 0.0] / size[size > 0.0]
        return np.asarray(law - columns @ np.linalg.lstsq(columns, law, rcond=1e-9)[0])


def place_of(extra: Undeclared) -> str:
    """Where what is undeclared acts: a key of `PLACES`; ValueError where that is not one place."""
    changed = {n for n, value in extra._asdict().items() if value != Undeclared._field_defaults[n]}
    found = [place for place, (fields, _) in PLACES.items() if changed & set(fields)]
    if len(found) != 1:
        raise ValueError(f"{sorted(changed)} act at {found}")
    return found[0]


def law_at(place: str, time: FloatArray, at: Signals, rig: Rig, extra: Undeclared) -> Law:
    """The law of ``place`` over a run of the model with signals ``at``, each (n,)."""
    return PLACES[place][1](time, at, rig, extra)


def joined(laws: list[Law]) -> Law:
    """One law over several runs."""
    return Law(
        *(np.concatenate(parts) for parts in zip(*((o.true, o.found, o.free) for o in laws), strict=True))
    )


def _travelled(time: FloatArray, speed: FloatArray) -> FloatArray:
    steps = 0.5 * np.abs(speed[1:] + speed[:-1]) * np.diff(time)
    return np.concatenate([[0.0], np.cumsum(steps)])


def _stribeck(height: float, speed: FloatArray, scale: float, exponent: float) -> FloatArray:
    share = np.abs(speed) / scale
    return np.asarray(height / (1.0 + share**2) if exponent == 0.0 else height * np.exp(-(share**exponent)))


def _shaft(time: FloatArray, at: Signals, rig: Rig, extra: Undeclared) -> Law:
    """Torque in N.m at the motor that opposes positive speed: motor, gearbox and screw turn as one."""
    w, s, z = (at[f"motorEffect.{n}"] for n in "vsz")
    screw = at["gearboxEffect.N"]
    true = (
        s * _stribeck(extra.stribeck_motor, w, extra.stribeck_motor_speed, extra.stribeck_exponent)
        + s * extra.windage * (0.01 * np.abs(w)) ** extra.windage_exponent
    )
    gear = s * extra.load_gear * np.abs(screw) + extra.asymmetry_gear
    gear += s * extra.run_in_gear * np.exp(-_travelled(time, w) / rig.i / extra.run_in_gear_angle)
    turn = extra.ripple_turns * z / rig.i + extra.ripple_phase
    gear += (extra.ripple_torque + extra.ripple_share * at["shaftEffect.T"]) * np.sin(turn)
    turn = extra.cogging_order * z + extra.cogging_phase
    true += gear / rig.i + extra.cogging * (np.sin(turn) + extra.cogging_second * np.sin(2.0 * turn))
    found = at["motorEffect.F"] + (at["gearboxEffect.F"] + at["shaftEffect.tau"]) / rig.i
    free = np.stack([s, w, s * np.maximum(0.0, -s * screw)], axis=1)
    moving = np.abs(s) > _SLIDES
    return Law(true[moving], found[moving], free[moving])


def _nut(time: FloatArray, at: Signals, rig: Rig, extra: Undeclared) -> Law:
    """Force in N on the nut that opposes positive speed."""
    v, s, x, force = (at[f"screwEffect.{n}"] for n in "vszN")
    friction = _stribeck(extra.stribeck_nut, v, extra.stribeck_nut_speed, extra.stribeck_exponent)
    friction += extra.load_nut * np.abs(force) + extra.slope_nut * x
    friction += extra.rise_nut * np.exp(-(((x - extra.rise_at) / extra.rise_width) ** 2))
    friction += extra.run_in_nut * np.exp(-_travelled(time, v) / extra.run_in_nut_distance)
    true = s * friction + extra.asymmetry_nut + extra.asymmetry_nut_viscous * np.abs(v) + extra.spring * x
    moving = np.abs(s) > _SLIDES
    return Law(true[moving], at["screwEffect.F"][moving], np.stack([s, v], axis=1)[moving])


def _contact(time: FloatArray, at: Signals, rig: Rig, extra: Undeclared) -> Law:
    """Deflection in m that the contact of screw and nut has besides its own."""
    delta, half = at["contactEffect.delta"], 0.5 * extra.gap
    taken = extra.gap_closed * np.sign(delta[0]) * half
    turn = extra.ripple_turns * at["contactEffect.phi"] + extra.ripple_phase
    lead = extra.lead_error * (np.sin(turn) - np.sin(extra.ripple_phase))
    true = taken - np.clip(delta + taken, -half, half) + lead
    return Law(true, at["contactEffect.e"], np.ones((true.size, 1)))


def _torque_constant(time: FloatArray, at: Signals, rig: Rig, extra: Undeclared) -> Law:
    """Relative change of the torque constant."""
    i = np.abs(at["torqueEffect.i_q"])
    true = 1.0 / (1.0 + extra.saturation * i + extra.saturation_square * i**2) - 1.0
    return Law(true, at["torqueEffect.g_t"], np.ones((true.size, 1)))


def _winding(time: FloatArray, at: Signals, rig: Rig, extra: Undeclared) -> Law:
    """Relative change of the winding's resistance."""
    step, heat = np.diff(time), np.zeros(time.size)
    for k, power in enumerate(at["windingEffect.P"][:-1]):
        heat[k + 1] = heat[k] + step[k] * (extra.heating * power - extra.cooling * heat[k])
    return Law(extra.heat_resistance * heat, at["windingEffect.g_R"], np.ones((time.size, 1)))


def _voltage(time: FloatArray, at: Signals, rig: Rig, extra: Undeclared) -> Law:
    """Voltage in V that the inverter adds."""
    i, angle = at["inverterEffect.i_q"], at["motorEffect.z"]
    wave = 1.0 + extra.dead_sixth * np.cos(6.0 * rig.p * angle)
    true = -extra.dead_voltage * np.clip(i / extra.dead_current, -1.0, 1.0) * wave
    return Law(true, at["inverterEffect.du"], i[:, None])


def _current_sensor(time: FloatArray, at: Signals, rig: Rig, extra: Undeclared) -> Law:
    """Error in A of the current sensor."""
    i = at["currentSensorEffect.u"]
    true = (extra.current_gain - 1.0) * i + extra.current_offset
    return Law(true, at["currentSensorEffect.d"], np.zeros((i.size, 1)))


def _velocity_sensor(time: FloatArray, at: Signals, rig: Rig, extra: Undeclared) -> Law:
    """Error in m/s of the output's speed sensor; its lag is a declared parameter."""
    v = at["velocitySensorEffect.u"]
    true = extra.velocity_gain * np.interp(time - extra.velocity_delay, time, v) - v
    return Law(true, at["velocitySensorEffect.d"], np.gradient(v, time)[:, None])


LawOf = Callable[[FloatArray, Signals, Rig, Undeclared], Law]
PLACES: Mapping[str, tuple[tuple[str, ...], LawOf]] = {  # the fields whose change tells the place
    "shaft": (
        (
            "stribeck_motor", "windage", "load_gear", "asymmetry_gear", "run_in_gear", "ripple_torque", "ripple_share",
            "cogging",
        ),
        _shaft,
    ),
    "nut": (
        (
            "stribeck_nut", "load_nut", "slope_nut", "rise_nut", "run_in_nut", "asymmetry_nut",
            "asymmetry_nut_viscous", "spring",
        ),
        _nut,
    ),
    "contact": (("gap", "lead_error"), _contact),
    "torque constant": (("saturation", "saturation_square"), _torque_constant),
    "winding": (("heating",), _winding),
    "voltage": (("dead_voltage",), _voltage),
    "current sensor": (("current_gain", "current_offset"), _current_sensor),
    "velocity sensor": (("velocity_gain", "velocity_delay"), _velocity_sensor),
}  # fmt: skip
