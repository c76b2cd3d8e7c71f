"""Balance equations between measured signals: which of them does not close?

``left = sum of c_k terms[k]`` is formed from the recordings themselves, without simulating: both sides pass the same
low-pass without phase shift, the coefficients c_k follow by least squares per temperature, so that wrong declared
parameters do not show, and what is left is held against what the sensors' noise alone would leave
(M. Gautier, P. Poignet, Control Engineering Practice 9 (2001) 1361, for the filters). Declared parameters inside a term
are fitted as well, within what the drawing leaves open (variable projection, G. Golub, V. Pereyra, Inverse Problems 19
(2003) R1).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import least_squares

from thsa_cosim.diagnosis.fitting.drawing import declared_unknowns
from thsa_cosim.diagnosis.fitting.trials import Trial, group_of, trials_of
from thsa_cosim.diagnosis.fitting.unknowns import Unknown
from thsa_cosim.diagnosis.results import Balance
from thsa_cosim.inverse_dynamics import low_pass
from thsa_cosim.recordings import Recording
from thsa_cosim.scenario import BalanceTable, DiagnoseSpec, Scenario
from thsa_cosim.scenario.formula import Formula, parse_formula
from thsa_cosim.signals import FloatArray

#: A balance is at fault if its residual's power exceeds the noise's by this many of its standard deviations ...
SIGNIFICANT = 6.0
#: ... and if this share of it is no noise.
SIZE = 1.0 / 3.0
#: Draws of the sensors' noise.
_DRAWS = 3
#: The moving signal counts as standing below this many standard deviations of its noise.
_STANDING = 6.0
#: Periods of the band that are left out beside a standstill: how far the low-pass smears what happens there.
_REACH = 3.0

Inside = Mapping[str, float]
"""Values of the declared parameters that formulas name, in FMU units."""


def close_balances(scenario: Scenario, spec: DiagnoseSpec) -> tuple[Balance, ...]:
    """Every balance of the scenario over all fit recordings.

    A balance is at fault if what is left is both significant (more than ``SIGNIFICANT`` standard deviations above the
    noise's power, counting two independent values per period of the band) and large (a ``SIZE`` of its power is no
    noise). A balance that no recording lets form (standing throughout, too short for the band) is left out.
    """
    trials = trials_of(scenario)
    drawing = drawings_of(scenario, trials)
    found = (_close(scenario, balance, drawing) for balance in spec.balances)
    return tuple(balance for balance in found if balance is not None)


def _close(
    scenario: Scenario, spec: BalanceTable, drawing: Mapping[str, Mapping[str, Unknown]]
) -> Balance | None:
    formulas = formulas_of(scenario, spec)
    groups: dict[str, list[Record]] = {}
    for recording in scenario.fit:
        record = record_of(recording, spec, formulas)
        if record is not None:
            group = group_of(recording.temperature_degC, scenario.round_to)
            groups.setdefault(group, []).append(record)
    generator = np.random.default_rng(scenario.seed)
    closed = [Regression(spec.band, tuple(r), drawing[g]).solve(generator) for g, r in groups.items()]
    squares, noise_squares = sum(c.squares for c in closed), sum(c.noise_squares for c in closed)
    samples, independent = sum(c.samples for c in closed), sum(c.independent for c in closed)
    if noise_squares == 0.0 or independent < 1.0:
        return None
    excess = (squares / noise_squares - 1.0) / np.sqrt(2.0 / independent)
    share = float(np.clip(1.0 - noise_squares / squares, 0.0, 1.0)) if squares > 0.0 else 0.0
    return Balance(
        equation=spec.name,
        unit=spec.unit,
        rmse=float(np.sqrt(squares / samples)),
        noise=float(np.sqrt(noise_squares / samples)),
        share=share,
        at_fault=bool(excess > SIGNIFICANT and share > SIZE),
    )


def formulas_of(scenario: Scenario, spec: BalanceTable) -> tuple[Formula, ...]:
    """The left side and the terms of a balance."""
    known = (*scenario.inputs, *scenario.measured, *scenario.parameters.names)
    where = f"{scenario.path}: diagnose.balances[{spec.name}]"
    return tuple(parse_formula(text, known, where) for text in (spec.left, *spec.terms))


def drawings_of(scenario: Scenario, trials: tuple[Trial, ...]) -> dict[str, dict[str, Unknown]]:
    """The declared parameters of every group of recordings, by name."""
    names = {p.variable: p.name for p in scenario.parameters.parameters}
    drawing: dict[str, dict[str, Unknown]] = {trial.group: {} for trial in trials}
    for unknown in declared_unknowns(scenario, trials).members:
        for group, own in drawing.items():
            if unknown.group in (None, group):
                own[names[unknown.variable]] = unknown
    return drawing


@dataclass(frozen=True, eq=False)
class Record:
    """A recording on an even grid every ``step`` s: signals (n,), their noise, and the samples (n,) that count."""

    formulas: tuple[Formula, ...]
    values: Mapping[str, FloatArray]
    noise: Mapping[str, float]
    kept: np.ndarray[tuple[int], np.dtype[np.bool_]]
    step: float
    band: float

    @property
    def seconds(self) -> float:
        """How long the samples that count last."""
        return float(np.count_nonzero(self.kept)) * self.step

    @cached_property
    def _columns(self) -> dict[int, FloatArray]:
        """The columns that no declared parameter moves, by position: they need filtering only once."""
        own = [k for k, f in enumerate(self.formulas) if f.names <= self.values.keys()]
        return {k: self._filtered(self.formulas[k], self.values) for k in own}

    def sides(self, inside: Inside) -> FloatArray:
        """(m, k + 1) left side and terms below the band, the samples that count."""
        values = self._with(inside)
        columns = [
            self._columns[k] if k in self._columns else self._filtered(f, values)
            for k, f in enumerate(self.formulas)
        ]
        return np.stack(columns, axis=1)

    def shaken(self, inside: Inside, generator: np.random.Generator) -> FloatArray:
        """(m, k + 1) what a further draw of the sensors' noise adds to the sides."""
        noisy = self._with(inside) | {
            name: v + self.noise.get(name, 0.0) * generator.standard_normal(v.size)
            for name, v in self.values.items()
        }
        return np.stack([self._filtered(f, noisy) for f in self.formulas], axis=1) - self.sides(inside)

    def _with(self, inside: Inside) -> dict[str, FloatArray]:
        return {**self.values, **{name: np.full(self.kept.size, value) for name, value in inside.items()}}

    def _filtered(self, formula: Formula, values: Mapping[str, FloatArray]) -> FloatArray:
        # What is not finite (a division by a speed at standstill) lies where nothing counts.
        return low_pass(np.nan_to_num(formula(values, self.step)), self.band, self.step)[self.kept]


@dataclass(frozen=True)
class _Closed:
    """Sums over the samples of one temperature, and how many values among them are independent."""

    squares: float
    noise_squares: float
    samples: int
    independent: float


@dataclass(frozen=True, eq=False)
class Regression:
    """The recordings of one temperature, with the declared parameters that the formulas name."""

    band: float
    records: tuple[Record, ...]
    drawing: Mapping[str, Unknown]

    def solve(self, generator: np.random.Generator) -> _Closed:
        """Fit coefficients and parameters, then hold the residual against drawn noise."""
        inside, noise = self.fit(generator)
        residual, coefficients = self.project(inside)
        independent = 2.0 * self.band * sum(r.seconds for r in self.records)
        fitted = len(coefficients) + len(inside)
        return _Closed(
            float(residual @ residual), noise**2 * residual.size, residual.size, independent - fitted
        )

    def fit(self, generator: np.random.Generator) -> tuple[dict[str, float], float]:
        """The declared parameters that the formulas name, and what drawn noise makes of the residual (rms)."""
        named = frozenset().union(*(f.names for f in self.records[0].formulas))
        used = {n: u for n, u in self.drawing.items() if n in named}
        inside = {n: u.start for n, u in used.items()}
        independent = 2.0 * self.band * sum(r.seconds for r in self.records)
        residual, coefficients = self.project(inside)
        noise = self._noise(inside, coefficients, generator)
        if used and noise > 0.0:
            weight = np.sqrt(independent / residual.size) / noise  # as if only independent values counted

            def moved(moves: FloatArray) -> dict[str, float]:
                return {
                    n: float(u.start + m * u.spread) for (n, u), m in zip(used.items(), moves, strict=True)
                }

            def deviations(moves: FloatArray) -> FloatArray:
                return np.append(self.project(moved(moves))[0] * weight, moves)

            steps = np.full(len(used), 1e-2)
            found = least_squares(
                deviations, np.zeros(len(used)), bounds=(-4.0, 4.0), diff_step=steps, max_nfev=8
            )
            inside = moved(found.x)
            noise = self._noise(inside, self.project(inside)[1], generator)
        return inside, noise

    def project(self, inside: Inside) -> tuple[FloatArray, FloatArray]:
        """Residual (m,) and coefficients (k,) by least squares."""
        sides = np.concatenate([r.sides(inside) for r in self.records])
        left, terms = sides[:, 0], sides[:, 1:]
        size = np.maximum(np.linalg.norm(terms, axis=0), 1e-300)
        coefficients = np.linalg.lstsq(terms / size, left, rcond=1e-9)[0] / size
        return left - terms @ coefficients, coefficients

    def _noise(self, inside: Inside, coefficients: FloatArray, generator: np.random.Generator) -> float:
        """Root mean square of what the sensors' noise makes of the residual."""
        weights = np.array([1.0, *-coefficients])
        drawn = [r.shaken(inside, generator) @ weights for r in self.records for _ in range(_DRAWS)]
        return float(np.sqrt(np.mean(np.concatenate(drawn) ** 2)))


def record_of(recording: Recording, spec: BalanceTable, formulas: tuple[Formula, ...]) -> Record | None:
    """A recording for a balance, or None where it is too short for the band or stands throughout."""
    signals = recording.compared
    step = float(np.median(np.diff(signals.time)))
    size = int((signals.time[-1] - signals.time[0]) / step * (1.0 + 1e-9)) + 1
    reach = int(np.ceil(_REACH / (spec.band * step)))
    if size < 4 * reach or 2.0 * spec.band * step >= 0.9:
        return None
    # In an order of their own: noise is drawn signal by signal.
    names = sorted(frozenset().union(*(f.names for f in formulas), spec.moving_signals))
    even = signals.resample(signals.time[0] + step * np.arange(size))
    values = {name: even[name] for name in names if name in even}
    still = np.zeros(size, dtype=bool)
    still[[0, -1]] = True
    for name in spec.moving_signals:
        still |= _standing(values[name], recording.noise.get(name, 0.0))
    kept = np.convolve(still, np.ones(2 * reach + 1), mode="same") < 0.5
    return Record(formulas, values, recording.noise, kept, step, spec.band) if kept.any() else None


def _standing(speed: FloatArray, noise: float) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Samples (n,) of a speed that may be zero, or where it changes its direction."""
    still = np.abs(speed) <= _STANDING * noise
    still[1:] |= np.sign(speed[1:]) != np.sign(speed[:-1])
    return np.asarray(still)
