"""Units of the blind benchmark: a rig off its drawing, its effects at a strength, and four recordings of it.

A strength is what the effect leaves in the data, not a value: the largest rms, over the channels and in units of
the sensor's noise, of what re-tuning the declared parameters cannot explain. Position counts a fifth: it sums up
speed errors, so that an effect too small for any other channel still moves it by many times its 1 um.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from blind_effects import CATALOGUE, Draft, Random, combined
from blind_outside import OUTSIDE
from blind_plant import FloatArray, Rig, Undeclared, declared, simulate
from blind_schedules import PARTS, Schedule, schedule

EFFECTS = {**CATALOGUE, **OUTSIDE}
TEMPERATURES = (25.0, 0.0, -10.0, -20.0, -30.0, -40.0, -50.0, -55.0)
#: Visibility of each strength: 0.5 adds 12 % to the rms of the noise, 1.1 adds 49 %.
STRENGTHS = {"weak": (0.5, 1.1), "medium": (1.2, 2.4), "strong": (2.6, 5.0)}
NOISE = {"v": 2e-5, "x": 1e-6, "w_m": 0.2, "i_q": 0.05, "u_q": 0.3}  # 1 sigma, SI
QUANTUM = {"v": 5e-6, "x": 1e-6, "w_m": 0.05, "i_q": 0.01, "u_q": 0.1}
FLOOR = {name: float(np.hypot(NOISE[name], QUANTUM[name] / 12**0.5)) for name in NOISE}
_COLUMNS = {  # column of the file -> (channel, factor to the file's unit)
    "velocity_mm_s": ("v", 1e3),
    "position_mm": ("x", 1e3),
    "motor_speed_rad_s": ("w_m", 1.0),
    "q_current_A": ("i_q", 1.0),
    "q_voltage_V": ("u_q", 1.0),
}
_SPREAD = dict.fromkeys(("R_s", "psi_pm", "L", "J", "k_b", "k_s", "d_s", "M", "tau_v"), 0.03)
_SPREAD |= dict.fromkeys(("T_fm", "b_m", "T_fg", "F_fn", "b_n"), 0.05)
_COUNTS = {"v": 1.0, "x": 0.2, "w_m": 1.0, "i_q": 1.0, "u_q": 1.0}  # in the visibility
_THINNING = 7  # every seventh sample is plenty for the projection on 14 directions


@dataclass(frozen=True)
class Present:
    """An effect as it is in a unit."""

    draft: Draft
    amplitude: float
    visibility: Mapping[str, float]  # rms over noise, per channel, beyond the declared parameters

    def label(self) -> dict[str, object]:
        fields = self.draft.fields(self.amplitude)
        return {
            "name": self.draft.name,
            "form": self.draft.form,
            "fields": dict(fields),
            "visibility": {name: round(value, 3) for name, value in self.visibility.items()},
            "coefficients": [
                {"value": c.value, "unit": c.unit, "words": list(c.words)}
                for c in self.draft.coefficients(fields)
            ],
        }


def unit_rig(temperature: float, random: Random) -> Rig:
    """The drawing with 3 % (friction 5 %) of spread, cut at 2.5 sigma; a no-back device always holds."""
    drawing = declared(temperature)
    factors = {
        name: 1.0 + spread * float(np.clip(random.normal(), -2.5, 2.5)) for name, spread in _SPREAD.items()
    }
    values = {name: getattr(drawing, name) * factor for name, factor in factors.items()}
    values["k_b"] = max(1.02, values["k_b"])
    return drawing._replace(**values)


class Visibility:
    """Measures effects on one rig and schedule against what the declared parameters can imitate."""

    def __init__(self, rig: Rig, played: Schedule) -> None:
        self.rig, self.played = rig, played
        self.clean = self._residuals(rig, Undeclared())
        steps = [rig._replace(**{name: getattr(rig, name) * 1.005}) for name in _SPREAD]
        directions = [(self._residuals(other, Undeclared()) - self.clean).ravel() for other in steps]
        self.basis, _ = np.linalg.qr(np.stack([d / np.linalg.norm(d) for d in directions], axis=-1))

    def _residuals(self, rig: Rig, extra: Undeclared) -> FloatArray:
        found = simulate(rig, *self.played, extra)
        return np.stack([found[name][::_THINNING] / FLOOR[name] for name in FLOOR])

    def of(self, extra: Undeclared) -> dict[str, float]:
        """rms over noise of what `extra` adds and the declared parameters do not explain, per channel."""
        added = (self._residuals(self.rig, extra) - self.clean).ravel()
        left = (added - self.basis @ (self.basis.T @ added)).reshape(self.clean.shape)
        return dict(zip(FLOOR, np.sqrt(np.mean(left**2, axis=1)).tolist(), strict=True))


def overall(visibility: Mapping[str, float]) -> float:
    """The most telling channel."""
    return max(_COUNTS[name] * value for name, value in visibility.items())


def strength_of(visibility: float) -> str:
    """The strength that an effect reached, which its largest plausible amplitude may keep below the one asked for."""
    return [name for name, (low, _) in STRENGTHS.items() if name == "weak" or visibility > 0.95 * low][-1]


def fitted(draft: Draft, target: float, visibility: Visibility, tries: int = 12) -> Present:
    """The amplitude at which `draft` reaches `target`, to 5 %, or its largest plausible one."""
    low, high, amplitude = 0.0, 2.0 * draft.most, 1.0
    for _ in range(tries):
        seen = visibility.of(combined(draft.fields(amplitude)))
        ratio = overall(seen) / target
        if abs(ratio - 1.0) < 0.05 or (ratio < 1.0 and amplitude == draft.most):
            break
        low, high = (amplitude, high) if ratio < 1.0 else (low, amplitude)
        guess = amplitude / max(
            ratio, 0.05
        )  # most effects are nearly proportional, those with a threshold are not
        amplitude = min(draft.most, guess if low < guess < high else 0.5 * (low + high))
    return Present(draft, amplitude, seen)


def _visible(name: str, target: float, visibility: Visibility, random: Random) -> Present:
    """An effect at `target`; drawn again where the form drawn first cannot be seen on this rig at all."""
    for _ in range(4):
        present = fitted(EFFECTS[name](random, visibility.rig), target, visibility)
        if overall(present.visibility) > 0.9 * STRENGTHS["weak"][0]:
            break
    return present


def generate_unit(
    folder: Path, names: Sequence[str], strength: str, seed: int, temperature: float | None = None
) -> dict[str, object]:
    """Write fit_1, fit_2, validate_1 and validate_2 .parquet into `folder`; the truth comes back as a label.

    Each of `names` (keys of EFFECTS; none: a clean unit) gets `strength` (a key of STRENGTHS) where it can; the
    label's is the one reached. Equal arguments give equal files; `temperature` in degC is drawn unless given.
    """
    random = np.random.default_rng(
        [seed, zlib.crc32("+".join(names).encode()), zlib.crc32(strength.encode())]
    )
    drawn = float(random.choice(TEMPERATURES))
    temperature = drawn if temperature is None else temperature
    rig = unit_rig(temperature, random)
    schedules = {part: schedule(part, random) for part in PARTS}
    present: list[Present] = []
    if names:
        visibility = Visibility(rig, schedules["fit_1"])
        for name in names:
            target = float(np.exp(random.uniform(*np.log(STRENGTHS[strength]))))
            present.append(_visible(name, target, visibility, random))
    extra = combined(*(effect.draft.fields(effect.amplitude) for effect in present))
    folder.mkdir(parents=True, exist_ok=True)
    for part, played in schedules.items():
        recording(simulate(rig, *played, extra), played, temperature, random).to_parquet(
            folder / f"{part}.parquet"
        )
    return {
        "effects": [effect.label() for effect in present],
        "strength": strength_of(min(overall(e.visibility) for e in present)) if present else "none",
        "seed": seed,
        "temperature_degC": temperature,
        "rig": rig._asdict(),
    }


def recording(
    true: Mapping[str, FloatArray], played: Schedule, temperature: float, random: Random
) -> pd.DataFrame:
    """The rig's table: row k at (k + 1) ms, channels with noise and quantised, load and temperature as measured."""
    time = np.arange(played.rows) * 1e-3
    command, load = (np.interp(time + 1e-3, *wave) for wave in (played.command, played.load))
    table = {"time_s": time, "velocity_command_mm_s": np.round(command * 1e3, 6)}
    for column, (name, factor) in _COLUMNS.items():
        table[column] = _sensed(true[name], NOISE[name], QUANTUM[name], random) * factor
    table["load_kN"] = _sensed(load, 60.0, 10.0, random) * 1e-3
    table["temperature_degC"] = _sensed(np.full(played.rows, temperature), 0.2, 0.1, random)
    frame = pd.DataFrame(table)
    return frame.astype({name: np.float32 for name in frame.columns if name != "time_s"})


def _sensed(true: FloatArray, noise: float, quantum: float, random: Random) -> FloatArray:
    return np.asarray(
        np.round((true + random.normal(0.0, noise, true.shape)) / quantum) * quantum, dtype=np.float64
    )
