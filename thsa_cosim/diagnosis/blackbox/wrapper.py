"""Runs an FMU with effects around it; lives in the worker processes.

The force of an effect depends on the motion, which depends on the force: waveform relaxation (Lelarasmee, Ruehli,
Sangiovanni-Vincentelli, IEEE Trans. CAD 1 (1982) 131). The whole run is repeated with the force computed along
the run before. A closed loop hardly lets a force change the motion, so that it converges in two or three passes.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from thsa_cosim.batch import PlantRun
from thsa_cosim.diagnosis.blackbox.drive import Drive, integral_of
from thsa_cosim.diagnosis.blackbox.places import PLACES, Place
from thsa_cosim.diagnosis.catalogue.effect import Law
from thsa_cosim.diagnosis.catalogue.known import known_effects
from thsa_cosim.scenario import BlackBoxSpec
from thsa_cosim.signals import FloatArray, Signals

#: Runs after the first one. At the load, where a force decides when stiction gives way, more are needed, and damping.
PASSES, LOAD_PASSES, DAMPING = 2, 3, 0.7
#: A change of the force below this share of its size (rms) is no reason to run again.
CONVERGED = 1e-3

_PLACES = {place.name: place for place in PLACES}
#: Friction asks for torque, the torque constant turns it into current, the sensor reads that.
_ORDER = {
    "FrictionEffect": 0,
    "TorqueConstantEffect": 1,
    "SensorEffect": 2,
    "VoltageEffect": 3,
    "ContactEffect": 3,
}
_IMPLICIT = 12


@dataclass(frozen=True)
class Term:
    """An effect's block in a place: ``starts`` of all its parameters; it does not act at ``neutral``."""

    place: str
    effect: str
    block: str
    prefix: str
    starts: Mapping[str, float]
    neutral: Mapping[str, float]

    def values(self, values: Mapping[str, float]) -> dict[str, float]:
        """The block's parameters by name."""
        return {name: values.get(f"{self.prefix}.{name}", start) for name, start in self.starts.items()}

    def acts(self, values: Mapping[str, float]) -> bool:
        """Whether some coefficient is not neutral."""
        own = self.values(values)
        return any(own[name] != neutral for name, neutral in self.neutral.items())


@dataclass(frozen=True, eq=False)
class _Shifts:
    """What is put on the load input, currents that torques and false readings cost, a change of the back-EMF."""

    load: FloatArray
    torque: FloatArray
    reading: FloatArray
    emf: FloatArray

    def is_near(self, other: "_Shifts", share: float) -> bool:
        """Whether no part differs (rms) by more than ``share`` of another's."""
        pairs = zip(vars(self).values(), vars(other).values(), strict=True)
        return all(np.linalg.norm(mine - theirs) <= share * np.linalg.norm(theirs) for mine, theirs in pairs)

    def towards(self, other: "_Shifts", share: float) -> "_Shifts":
        """These and ``share`` of the way to another."""
        pairs = zip(vars(self).values(), vars(other).values(), strict=True)
        return _Shifts(*(mine + share * (theirs - mine) for mine, theirs in pairs))


@dataclass(frozen=True, eq=False)
class EffectWrapper:
    """Effects around an FMU's inputs and outputs (`batch.Wrapper`); with all of them neutral it is the FMU itself.

    ``catalogue``: a user's folder of effects, which the worker must be able to read.
    """

    signals: BlackBoxSpec
    drive: Drive
    terms: tuple[Term, ...]
    catalogue: Path | None = None

    @property
    def parameters(self) -> Mapping[str, float]:
        """Start values of all effects' parameters."""
        return {f"{t.prefix}.{name}": start for t in self.terms for name, start in t.starts.items()}

    def run(
        self,
        plant_run: PlantRun,
        values: Mapping[str, float],
        inputs: Signals | None,
        outputs: Sequence[str],
        time: FloatArray,
        tolerance: float | None,
    ) -> Signals:
        """Simulate the FMU with the effects whose coefficients ``values`` sets."""
        own = self.parameters
        inside = {name: value for name, value in values.items() if name not in own}
        active = [t for t in self.terms if t.acts(values)]
        if not active:
            return plant_run(inside, inputs, outputs, time, tolerance=tolerance)
        observed = tuple(dict.fromkeys((*outputs, *self._observed())))
        given = self._given(inputs, values, time)
        run = plant_run(inside, inputs, observed, time, tolerance=tolerance)
        shifts = _Shifts(*np.zeros((4, time.size)))
        ways = {_PLACES[t.place].way for t in active}
        passes = LOAD_PASSES if "load" in ways else PASSES if ways & {"command", "reading"} else 0
        for number in range(passes):
            wanted = self._shifts(active, values, given, run, self._read(run, shifts))
            if shifts.is_near(wanted, CONVERGED):
                break
            shifts = shifts.towards(wanted, DAMPING if number and "load" in ways else 1.0)
            run = plant_run(
                inside, self._drive(given, shifts), observed, time, tolerance=tolerance, once=True
            )
        return self._put_on_outputs(active, values, given, self._read(run, shifts)).select(outputs)

    def _given(self, inputs: Signals | None, values: Mapping[str, float], time: FloatArray) -> Signals:
        """Inputs at the communication points; command and load that are no signals are constant."""
        given = Signals(time, {}) if inputs is None else inputs.resample(time)
        names = [n for n in (self.signals.command, self.signals.load) if n is not None and n not in given]
        return given.with_values({n: np.full(time.size, values.get(n, 0.0)) for n in names})

    def _observed(self) -> tuple[str, ...]:
        s = self.signals
        return tuple(n for n in (s.speed, s.position, s.motor_speed, s.current, s.voltage) if n is not None)

    def _drive(self, given: Signals, shifts: _Shifts) -> Signals:
        """The FMU's inputs with the shifts."""
        changed: dict[str, FloatArray] = {}
        if self.signals.load is not None and shifts.load.any():
            changed[self.signals.load] = given[self.signals.load] + shifts.load
        current = shifts.torque + shifts.reading
        if self.signals.command is not None and current.any():
            lower = self.drive.command_shift(given.time, current)
            changed[self.signals.command] = given[self.signals.command] - lower
        return given.with_values(changed)

    def _read(self, run: Signals, shifts: _Shifts) -> Signals:
        """The outputs of the drive with the effects: the FMU itself does not carry the currents of torques."""
        changed: dict[str, FloatArray] = {}
        current = shifts.torque + shifts.reading
        if self.signals.current is not None and current.any():
            changed[self.signals.current] = run[self.signals.current] + current
            if self.signals.voltage is not None:
                more = self.drive.voltage(run.time, shifts.torque) + shifts.emf
                changed[self.signals.voltage] = run[self.signals.voltage] + more
        return run.with_values(changed)

    def _shifts(
        self, active: Sequence[Term], values: Mapping[str, float], given: Signals, run: Signals, seen: Signals
    ) -> _Shifts:
        """What the effects ask for along the FMU's own ``run``, which was ``seen`` with the shifts before."""
        load, torque, reading, emf = np.zeros((4, run.time.size))
        for term in sorted(active, key=lambda t: _ORDER[_PLACES[t.place].interface]):
            place, law, own = _PLACES[term.place], self._law(term), term.values(values)
            if place.way == "output":
                continue
            at = self._connectors(place, given, seen)
            if place.interface == "FrictionEffect":
                if place.way == "load":
                    load += self.drive.load_sense * law(own, at)
                else:
                    torque += self.drive.current_per_force * law(own, at)
                continue
            assert self.signals.current is not None
            needed = run[self.signals.current] + torque
            if place.way == "reading":
                reading += law(own, {**at, "u": needed})
                continue
            # the torque constant falls by a share that depends on the current, which grows for it
            current = needed
            for _ in range(_IMPLICIT):
                current = needed - law(own, {**at, "i_q": current}) * current
            torque += current - needed
            fall = law(own, {**at, "i_q": current})
            emf += own.get("r_e", 0.0) * fall * self.drive.back_emf * at["w_m"]
        return _Shifts(load, torque, reading, emf)

    def _put_on_outputs(
        self, active: Sequence[Term], values: Mapping[str, float], given: Signals, seen: Signals
    ) -> Signals:
        added: dict[str, FloatArray] = {}
        for term in active:
            place = _PLACES[term.place]
            name = getattr(self.signals, place.output) if place.output is not None else None
            if name is None:
                continue
            at = self._connectors(place, given, seen)
            found = self._law(term)(term.values(values), at)
            if place.interface == "VoltageEffect":  # the current loop makes up for what is lost
                found = -found
            if place.interface == "ContactEffect":
                found = _follow(found, seen[name])
                if self.signals.speed is not None:
                    also = np.gradient(found, seen.time)
                    added[self.signals.speed] = added.get(self.signals.speed, 0.0) + also
            added[name] = added.get(name, 0.0) + found
        return seen.with_values({name: seen[name] + more for name, more in added.items()})

    def _connectors(self, place: Place, given: Signals, seen: Signals) -> dict[str, FloatArray]:
        """What a block reads in ``place``."""
        time, s, drive = seen.time, self.signals, self.drive
        load = given[s.load] * drive.load_sense if s.load is not None else np.zeros(time.size)
        if place.name == "motor":
            assert s.motor_speed is not None
            assert s.current is not None
            speed = seen[s.motor_speed]
            force = seen[s.current] / drive.current_per_force
            return _friction(time, speed, integral_of(time, speed), force, drive.motor_rest)
        if place.interface in ("FrictionEffect", "ContactEffect"):
            assert s.position is not None
            z = seen[s.position]
            # not the speed output: a sensor's lag would move the moment at which stiction gives way
            at = _friction(time, np.gradient(z, time), z, load, drive.rest)
            return at | {"side": np.sign(load + drive.coulomb * at["s"])}
        source = s.speed if place.name == "velocitySensor" else s.current
        assert source is not None
        at = {"time": time, "u": seen[source], "i_q": seen[source]}
        return at if s.motor_speed is None else at | {"w_m": seen[s.motor_speed]}

    def _law(self, term: Term) -> Law:
        return laws(self.catalogue)[term.effect, term.block]


@cache
def laws(folder: Path | None) -> dict[tuple[str, str], Law]:
    """The laws of all effects by name and block."""
    return {
        (effect.name, variant.block): variant.law
        for effect in known_effects(folder).values()
        for variant in effect.variants
        if variant.law is not None
    }


def sign_of(speed: FloatArray, rest: float) -> FloatArray:
    """Sign of the speed (n,); at rest a line from that of the last motion to that of the next.

    Friction at rest is whatever holds; this gives it its full size at the moment of breaking away, so that an effect
    decides how much force that takes.
    """
    moving = np.flatnonzero(np.abs(speed) > rest)
    if moving.size == 0:
        return np.zeros(speed.size)
    return np.asarray(np.interp(np.arange(speed.size), moving, np.sign(speed[moving])))


def _friction(
    time: FloatArray, speed: FloatArray, position: FloatArray, force: FloatArray, rest: float
) -> dict[str, FloatArray]:
    return {"time": time, "v": speed, "s": sign_of(speed, rest), "z": position, "N": force}


def _follow(wanted: FloatArray, position: FloatArray) -> FloatArray:
    """An offset (n,) on its way to ``wanted``, not faster than the position moves: the gap is crossed by the motor."""
    travel = np.abs(np.diff(position, prepend=position[0]))
    if not np.diff(wanted).any():
        return wanted
    offset = np.empty_like(wanted)
    now = offset[0] = wanted[0]
    for k in range(1, wanted.size):
        now += min(max(wanted[k] - now, -travel[k]), travel[k])
        offset[k] = now
    return offset
