"""Balance equations between measured signals: which of them does not close?

``left = sum of c_k terms[k]`` is formed from the recordings themselves, without simulating: both sides pass the same
low-pass without phase shift, the coefficients c_k follow by least squares per temperature, so that wrong declared
parameters do not show, and what is left is held against what the sensors' noise alone would leave
(M. Gautier, P. Poignet, Control Engineering Practice 9 (2001) 1361, for the filters).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from thsa_cosim.diagnosis.problem import group_of
from thsa_cosim.diagnosis.results import Balance
from thsa_cosim.inverse_dynamics import low_pass
from thsa_cosim.recordings import Recording
from thsa_cosim.scenario import BalanceSpec, DiagnoseSpec, Scenario
from thsa_cosim.scenario.formula import Formula, parse_formula
from thsa_cosim.signals import FloatArray

#: A balance is at fault if its residual's power exceeds the noise's by this many of its standard deviations ...
SIGNIFICANT = 6.0
#: ... and if this share of it is no noise.
SIZE = 0.3
#: Draws of the sensors' noise.
_DRAWS = 3
#: The moving signal counts as standing below this many standard deviations of its noise.
_STANDING = 6.0
_REACH = 1.0


def close_balances(scenario: Scenario, spec: DiagnoseSpec) -> tuple[Balance, ...]:
    """Every balance of the scenario over all fit recordings.

    A balance is at fault if what is left is both significant (more than ``SIGNIFICANT`` standard deviations above the
    noise's power, counting two independent values per period of the band) and large (a ``SIZE`` of its power is no
    noise). Numbers that a recording does not hold (standing throughout, too short for the band) leave a balance out.
    """
    found = (_close(scenario, balance) for balance in spec.balances)
    return tuple(balance for balance in found if balance is not None)


@dataclass(frozen=True, eq=False)
class _Sides:
    """One recording's filtered left side (n,) and terms (n, k), and what noise does to them: (draws, n, k + 1)."""

    left: FloatArray
    terms: FloatArray
    noise: FloatArray
    seconds: float


def _close(scenario: Scenario, spec: BalanceSpec) -> Balance | None:
    known = (*scenario.inputs, *scenario.measured)
    where = f"{scenario.path}: diagnose.balances[{spec.name}]"
    formulas = [parse_formula(text, known, where) for text in (spec.left, *spec.terms)]
    generator = np.random.default_rng(scenario.seed)
    groups: dict[str, list[_Sides]] = {}
    for recording in scenario.fit:
        sides = _sides(scenario, recording, spec, formulas, generator)
        if sides is not None:
            groups.setdefault(group_of(recording.temperature_degC, scenario.round_to), []).append(sides)
    squares = noise_squares = 0.0
    samples, independent = 0, 0.0
    for members in groups.values():
        terms = np.concatenate([s.terms for s in members])
        left = np.concatenate([s.left for s in members])
        if left.size <= terms.shape[1]:
            continue
        size = np.maximum(np.linalg.norm(terms, axis=0), 1e-300)
        coefficients = np.linalg.lstsq(terms / size, left, rcond=1e-9)[0] / size
        residual = left - terms @ coefficients
        drawn = np.concatenate([s.noise for s in members], axis=1) @ np.array([1.0, *-coefficients])
        squares += float(residual @ residual)
        noise_squares += float(np.mean(np.sum(drawn**2, axis=1)))
        samples += left.size
        independent += 2.0 * spec.band * sum(s.seconds for s in members) - len(coefficients)
    if samples == 0 or noise_squares == 0.0 or independent < 1.0:
        return None
    share = float(np.clip(1.0 - noise_squares / squares, 0.0, 1.0)) if squares > 0.0 else 0.0
    excess = (squares / noise_squares - 1.0) / np.sqrt(2.0 / independent)
    return Balance(
        equation=f"{spec.name}: {spec.left} = {' + '.join(f'c{k} {t}' for k, t in enumerate(spec.terms, 1))}",
        unit=spec.unit,
        rmse=float(np.sqrt(squares / samples)),
        noise=float(np.sqrt(noise_squares / samples)),
        share=share,
        at_fault=bool(excess > SIGNIFICANT and share > SIZE),
    )


def _sides(
    scenario: Scenario,
    recording: Recording,
    spec: BalanceSpec,
    formulas: Sequence[Formula],
    generator: np.random.Generator,
) -> _Sides | None:
    """A recording's balance, or None where it is too short for the band or stands throughout."""
    signals = recording.compared
    step = float(np.median(np.diff(signals.time)))
    size = int((signals.time[-1] - signals.time[0]) / step * (1.0 + 1e-9)) + 1
    reach = int(np.ceil(_REACH / (spec.band * step)))
    if size < 10 * reach or 2.0 * spec.band * step >= 0.9:
        return None
    even = signals.resample(signals.time[0] + step * np.arange(size))
    names = frozenset().union(*(f.names for f in formulas), {spec.moving} if spec.moving else ())
    values = {name: even[name] for name in names}
    noise = {name: recording.noise.get(name, 0.0) for name in names & set(scenario.measured)}
    kept = _moving(values, noise, spec.moving, reach, size)
    plain = _filtered(formulas, values, step, spec.band)
    kept &= np.isfinite(plain).all(axis=1)
    if not kept.any():
        return None
    drawn = []
    for _ in range(_DRAWS):
        noisy = {
            name: v + noise.get(name, 0.0) * generator.standard_normal(size) for name, v in values.items()
        }
        drawn.append((_filtered(formulas, noisy, step, spec.band) - plain)[kept])
    return _Sides(plain[kept, 0], plain[kept, 1:], np.nan_to_num(np.array(drawn)), float(kept.sum()) * step)


def _filtered(
    formulas: Sequence[Formula], values: Mapping[str, FloatArray], step: float, band: float
) -> FloatArray:
    """Left side and terms (n, k + 1) below ``band`` Hz; what is not finite stays so."""
    return np.stack([low_pass(formula(values, step), band, step) for formula in formulas], axis=1)


def _moving(
    values: Mapping[str, FloatArray],
    noise: Mapping[str, float],
    moving: str | None,
    reach: int,
    size: int,
) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Samples (n,) further than ``reach`` from the ends and from any standstill or change of direction."""
    still = np.zeros(size, dtype=bool)
    still[[0, -1]] = True
    if moving is not None:
        speed = values[moving]
        still |= np.abs(speed) <= _STANDING * noise.get(moving, 0.0)
        still[1:] |= np.sign(speed[1:]) != np.sign(speed[:-1])
    near = np.convolve(still, np.ones(2 * reach + 1), mode="same") > 0.5
    return ~near
