"""What of a closed-loop drive must be known to put a torque at its motor, measured on the FMU itself.

A torque that costs the current c(t) is the same as an undisturbed motor whose command is lower by C⁻¹ c, C the
velocity controller, and whose current reads c more: exact for any friction, stiction or no-back device between
motor and load, as long as the current loop is fast and nothing saturates.
A proportional-integral C is found from command, motor speed and current of one simulation; the current that a force
at the load costs from a second one, with a step of the load.
"""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.signal import lfilter

from thsa_cosim.errors import ScenarioError
from thsa_cosim.scenario import BlackBoxSpec
from thsa_cosim.signals import FloatArray, Signals

#: Below this coefficient of determination the controller is no proportional-integral one.
UNDERSTOOD = 0.99
#: Speeds below this share of the largest one count as rest.
REST = 2e-4


@dataclass(frozen=True)
class Drive:
    """Signs and gains of a drive, in the units of the FMU's variables.

    ``load_sense``: 1 if a positive load opposes positive motion, else -1. ``current_per_force``: current that a
    force at the load costs (current per current where there is no load input). Current = ``proportional`` e +
    ``integral`` ∫e dt, e = command - motor speed/``ratio``, late by ``lag`` [s]; ``fidelity`` is R².
    Voltage = ``resistance`` i + ``inductance`` di/dt + ``back_emf`` motor speed. ``coulomb``: friction of the whole
    drive, as a force at the load. ``rest``, ``motor_rest``: speeds below which the load and the motor stand.
    """

    load_sense: float = 1.0
    current_per_force: float = 1.0
    ratio: float = 1.0
    proportional: float = 0.0
    integral: float = 0.0
    lag: float = 0.0
    fidelity: float = 0.0
    resistance: float = 0.0
    inductance: float = 0.0
    back_emf: float = 0.0
    coulomb: float = 0.0
    rest: float = 0.0
    motor_rest: float = 0.0

    @property
    def has_torque(self) -> bool:
        """Whether torques at the motor can be put on."""
        return self.fidelity >= UNDERSTOOD

    def command_shift(self, time: FloatArray, current: FloatArray) -> FloatArray:
        """C⁻¹ c: what the command is to be lowered by, (n,), where a torque costs ``current`` (n,)."""
        ahead = current + self.lag * np.gradient(current, time)
        # trapezoidal rule on equally spaced times: proportional d + integral ∫d dt = current
        even = np.linspace(time[0], time[-1], time.size)
        half = 0.5 * self.integral * (even[1] - even[0])
        feed, back = [1.0, -1.0], [self.proportional + half, half - self.proportional]
        shift = lfilter(feed, back, np.interp(even, time, ahead))
        return np.asarray(np.interp(time, even, shift))

    def voltage(self, time: FloatArray, current: FloatArray) -> FloatArray:
        """Voltage (n,) that the current (n,) takes beside the back-EMF."""
        return np.asarray(self.resistance * current + self.inductance * np.gradient(current, time))

    def to_dict(self) -> dict[str, float]:
        """For JSON."""
        return asdict(self)


def integral_of(time: FloatArray, values: FloatArray) -> FloatArray:
    """∫ values dt from the first sample, (n,)."""
    steps = 0.5 * np.diff(time) * (values[1:] + values[:-1])
    return np.concatenate([[0.0], np.cumsum(steps)])


def measure_drive(
    spec: BlackBoxSpec, inputs: Signals, base: Signals, stepped: Signals | None, step: float
) -> Drive:
    """The drive from a simulation ``base`` under ``inputs`` and one with the load higher by ``step`` all along.

    ScenarioError if the drive hardly moves, or does not respond to the load.
    """
    given = inputs.resample(base.time)
    found: dict[str, float] = {}
    if spec.position is not None:
        found["rest"] = REST * float(np.max(np.abs(np.gradient(base[spec.position], base.time))))
    if spec.motor_speed is not None:
        found["motor_rest"] = REST * float(np.max(np.abs(base[spec.motor_speed])))
    if spec.command is not None and spec.current is not None and spec.motor_speed is not None:
        found |= _controller(base.time, given[spec.command], base[spec.motor_speed], base[spec.current])
        if spec.voltage is not None:
            i, w = base[spec.current], base[spec.motor_speed]
            terms = np.stack([i, np.gradient(i, base.time), w], axis=1)
            gains = np.linalg.lstsq(terms, base[spec.voltage], rcond=None)[0]
            found |= dict(zip(("resistance", "inductance", "back_emf"), gains, strict=True))
    if spec.load is not None and stepped is not None:
        found |= _load(
            spec, given[spec.load], base, stepped, step, np.sign(found.get("proportional", 1.0)) or 1.0
        )
    return Drive(**{name: float(value) for name, value in found.items()})


def _controller(
    time: FloatArray, command: FloatArray, speed: FloatArray, current: FloatArray
) -> dict[str, float]:
    """Ratio and gains of a proportional-integral controller by least squares, without what saturates."""
    ratio = float(speed @ command) / (float(command @ command) or 1.0)
    if ratio == 0.0:
        return {}
    kept = np.ones(time.size, dtype=bool)
    # The current loop is late, and lets the back-EMF pull the current off while the speed changes.
    acceleration, rise = np.gradient(speed, time), np.gradient(current, time)

    def regress(r: float) -> tuple[float, FloatArray, FloatArray]:
        error = command - speed / r
        terms = np.stack([error, integral_of(time, error), np.ones_like(error), acceleration, rise], axis=1)
        gains = np.asarray(np.linalg.lstsq(terms[kept], current[kept], rcond=None)[0], dtype=np.float64)
        left = current - terms @ gains
        return float(left[kept] @ left[kept]), gains, left

    for _ in range(3):
        around = ratio
        search: Any = minimize_scalar(
            lambda share: regress(share * around)[0],  # noqa: B023 (used at once)
            bounds=(0.9, 1.1),
            method="bounded",
            options={"xatol": 1e-9},
        )
        ratio = float(search.x) * around
        _, gains, left = regress(ratio)
        kept = np.abs(left) <= 4.0 * max(float(np.median(np.abs(left[kept]))), 1e-12)
    fidelity = 1.0 - float(np.var(left)) / (float(np.var(current)) or 1.0)
    return {
        "ratio": ratio,
        "proportional": gains[0],
        "integral": gains[1],
        "lag": max(-gains[4], 0.0),
        "fidelity": fidelity,
    }


def _load(
    spec: BlackBoxSpec, load: FloatArray, base: Signals, stepped: Signals, step: float, sense: float
) -> dict[str, float]:
    """Sense of the load, the current that it costs where it opposes the motion, and friction as a load."""
    name = spec.motor_speed or spec.speed or spec.position
    if name is None:
        return {}
    speed = np.gradient(base[name], base.time) if name == spec.position else base[name]
    moving = np.abs(speed) > 0.05 * float(np.max(np.abs(speed)))
    if spec.current is None:
        slower = float(np.sum((base[name] - stepped[name])[moving])) * np.sign(step)
        return {"load_sense": 1.0 if slower >= 0.0 else -1.0}
    gain = sense * (stepped[spec.current] - base[spec.current]) / step
    typical = float(np.median(gain[moving])) if moving.any() else 0.0
    opposing = moving & (load * speed * (np.sign(typical) or 1.0) > 0.1 * float(np.max(np.abs(load * speed))))
    if np.count_nonzero(opposing) >= 100:  # a no-back device hides the load from the motor while it aids
        typical = float(np.median(gain[opposing]))
    if typical == 0.0:
        raise ScenarioError(
            f"diagnose.load: a step of {spec.load!r} by {step:g} moves no {spec.current!r}; name the load of the drive."
        )
    sign = np.sign(speed[moving])
    terms = np.stack([sign, np.maximum(load[moving] * sign, 0.0) * sign, load[moving], speed[moving]], axis=1)
    size = np.linalg.norm(terms, axis=0) + 1e-300
    gains = np.linalg.lstsq(terms / size, base[spec.current][moving], rcond=1e-6)[0] / size
    coulomb = sense * gains[0] / abs(typical)
    return {
        "load_sense": float(np.sign(typical)),
        "current_per_force": sense * abs(typical),
        "coulomb": max(float(coulomb), 0.0),
    }
