"""One signal of a recording as detectors see it, with the facts that several of them need."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.inspection.finding import Finding, Severity, Span
from thsa_cosim.recordings.independence import Independence, independence
from thsa_cosim.recordings.noise import noise_estimate, quantum
from thsa_cosim.recordings.outliers import Mask, far_values, running_median
from thsa_cosim.recordings.outliers import spikes as find_spikes
from thsa_cosim.signals import FloatArray

Role = Literal["input", "output", "other"]

_SILENT = 1e-5
"""Noise, in shares of the range, that no sensor reaches: a command, or a simulation."""
_WINDOW, _LEAST_WINDOWS = 64, 6
_DITHERED = 0.7
"""Noise, in quantisation steps, that no moving signal on a lattice makes up by itself."""
_TURNING = 0.5
"""Share of bends that turn the one before back, from which on they are noise."""
_MOST_SPANS = 40
_STRAIGHT, _DRAWN = 1e-6, 0.95
"""Bend in shares of the range that is rounding, and share of such samples that make a signal a schedule."""
_JUMP, _OFTEN = 0.02, 0.05
"""Change of a command from sample to sample, in shares of its range, that is a jump; share of samples that are none."""
_ANSWER = 4.5
"""Samples after a jump of a command that may stand out: a voltage at a step of the speed."""
_OWN_FACTS = (
    "jumps",
    "step",
    "coded",
    "plain",
    "independence",
    "noise",
    "quantum",
    "silent",
    "drawn",
    "profile",
    "_alternates",
    "steady",
    "range",
    "fresh_index",
    "runs",
)
"""Facts that follow from the samples alone, whatever else happens in the recording."""


@dataclass(frozen=True, eq=False)
class Channel:
    """``values`` (n,) in ``unit`` at ``time`` (n,) s, as measured: nothing smoothed, shifted or resampled.

    ``held``: the scenario says that the value stays until the next sample. ``averaged``: only its mean is used.
    ``written`` (n,): the numbers of the file, which a scenario's ``missing`` names; None: ``values``.
    ``commanded`` (m,): times in s at which a command jumps, or something is hit; what a signal does right after is the
    machine's answer. ``shared`` (m,): times in s at which this signal jumps with another quantity, and no motion does.
    """

    recording: str
    name: str
    unit: str
    role: Role
    time: FloatArray
    values: FloatArray
    held: bool = False
    averaged: bool = False
    written: FloatArray | None = None
    commanded: FloatArray | None = None
    shared: FloatArray | None = None

    @cached_property
    def jumps(self) -> FloatArray:
        """Times in s at which a command jumps; none for a sensor's signal, or one that jumps all the time.

        One that is not zero when the recording begins jumps there: what it drives may have been at rest.
        """
        change = np.abs(np.diff(self.plain))
        large = change > _JUMP * self.range
        # The noise, which takes longest to find, comes last.
        if not 0 < np.count_nonzero(large) < _OFTEN * change.size or not (self.drawn or self.silent):
            return np.empty(0)
        begins = abs(float(self.plain[0])) > _JUMP * self.range
        return np.concatenate((self.time[: int(begins)], self.time[1:][large]))

    @cached_property
    def step(self) -> float:
        """Usual distance of samples, s."""
        return float(np.median(np.diff(self.time))) if self.time.size > 1 else 0.0

    @cached_property
    def coded(self) -> Mask:
        """Which samples are codes for a missing value."""
        return far_values(self.values)

    @cached_property
    def plain(self) -> FloatArray:
        """The samples with codes replaced by what comes before and after."""
        if not self.coded.any():
            return self.values
        return np.asarray(np.interp(self.time, self.time[~self.coded], self.values[~self.coded]))

    @cached_property
    def independence(self) -> Independence:
        """Which samples are measurements of their own."""
        return independence(self.plain)

    @cached_property
    def noise(self) -> float:
        """1 σ of the white noise, in ``unit``; 0 if none can be seen."""
        return noise_estimate(self.plain, known=self.independence)

    @cached_property
    def quantum(self) -> float:
        """Quantisation step, in ``unit``; 0 if there is none."""
        return quantum(self.plain)

    @cached_property
    def silent(self) -> bool:
        """Whether nothing but the quantisation can be seen of its noise: a command, a coarse encoder, a simulation."""
        return bool(self.noise <= max(1.01 * self.quantum / np.sqrt(12.0), _SILENT * self.range))

    @cached_property
    def drawn(self) -> bool:
        """Whether it consists of straight lines: a schedule of set points and ramps, which no sensor measures."""
        bends = np.abs(np.diff(self.plain, 2))
        return bool(bends.size and np.mean(bends <= _STRAIGHT * self.range) > _DRAWN)

    @cached_property
    def profile(self) -> FloatArray:
        """Roughness (m,) from window to window of the independent samples, in ``unit``; rest is left out."""
        values = self.plain[self.fresh_index]
        bends = np.abs(np.diff(values, 2))
        windows = bends[: bends.size // _WINDOW * _WINDOW].reshape(-1, _WINDOW)
        moving = np.mean(windows > 0.0, axis=1) > 0.2
        return np.asarray(np.median(windows[moving], axis=1) / (0.67449 * np.sqrt(6.0)))

    @cached_property
    def _alternates(self) -> bool:
        """Whether it bends to and fro, as white noise does (73 % of the bends turn back), and no smooth schedule."""
        bends = np.diff(self.plain[self.fresh_index], 2)
        turns = bends[1:] * bends[:-1]
        return bool(np.sum(turns < 0.0) > _TURNING * np.sum(turns != 0.0))

    @cached_property
    def steady(self) -> bool:
        """Whether the noise is a sensor's: there in every window, whatever the signal does, and dithers the levels."""
        profile = self.profile
        if self.silent or profile.size < _LEAST_WINDOWS or not self._alternates:
            return False
        middle = float(np.median(profile))
        low, high = np.quantile(profile, (0.2, 0.8))
        return bool(self.noise >= _DITHERED * self.quantum and 0.5 * middle < low and high < 2.0 * middle)

    @cached_property
    def range(self) -> float:
        """Largest less smallest value, codes and rare outliers left out."""
        low, high = np.quantile(self.plain, (0.001, 0.999))
        return float(high - low)

    @cached_property
    def fresh_index(self) -> NDArray[np.intp]:
        """Indices of the independent samples."""
        return self.independence.fresh if self.independence.kind else np.arange(self.values.size)

    @cached_property
    def spikes(self) -> Mask:
        """Which samples are spikes of one or two independent samples; codes are not among them."""
        mask = np.zeros(self.values.shape, dtype=np.bool_)
        if not self.silent:
            fresh = self.fresh_index
            mask[fresh] = find_spikes(self.plain[fresh], self.noise)
        return mask & ~self.answers if mask.any() else mask

    @cached_property
    def answers(self) -> Mask:
        """Which samples come right after a jump of a command."""
        if self.commanded is None or not self.commanded.size:
            return np.zeros(self.values.shape, dtype=np.bool_)
        last = self.commanded[np.maximum(np.searchsorted(self.commanded, self.time, "right") - 1, 0)]
        return np.asarray((self.time >= last) & (self.time - last < _ANSWER * self.step))

    @cached_property
    def clean(self) -> FloatArray:
        """The samples without codes, spikes replaced by the median of their neighbours."""
        if not self.spikes.any():
            return self.plain
        fresh = self.fresh_index
        own = np.where(self.spikes[fresh], running_median(self.plain[fresh], 7), self.plain[fresh])
        groups = np.diff(np.concatenate((fresh, [self.values.size])))
        return (
            np.repeat(own, groups)
            if self.independence.kind == "held"
            else np.interp(np.arange(self.values.size), fresh, own)
        )

    @cached_property
    def runs(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """First index and length of every run of one value."""
        changes = np.flatnonzero(np.diff(self.plain) != 0.0) + 1
        starts = np.concatenate(([0], changes))
        return starts, np.diff(np.concatenate((starts, [self.values.size])))

    def with_events(self, commanded: FloatArray, shared: FloatArray) -> "Channel":
        """Return the channel with these times; what does not depend on them is not found anew."""
        found = replace(self, commanded=commanded, shared=shared)
        facts = vars(self)
        vars(found).update({name: facts[name] for name in _OWN_FACTS if name in facts})
        return found

    def finding(
        self, kind: str, severity: Severity, text: str, where: Sequence[Span] = (), remedy: str = ""
    ) -> Finding:
        """Return a finding about this channel."""
        return Finding(self.recording, self.name, kind, severity, text, tuple(where), remedy)

    def number(self, value: float) -> str:
        """``value`` with the channel's unit."""
        return f"{value:.4g} {self.unit}" if self.unit not in ("", "1") else f"{value:.4g}"

    def spans(self, mask: Mask, bridge: int = 10) -> tuple[Span, ...]:
        """The stretches of ``mask`` (n,) in s, those closer than ``bridge`` samples as one."""
        return spans(self.time, mask, bridge)


def spans(time: FloatArray, mask: Mask, bridge: int = 10) -> tuple[Span, ...]:
    """The stretches of ``mask`` (n,) in s of ``time`` (n,), those closer than ``bridge`` samples, or more, as one."""
    marked = np.flatnonzero(mask)
    if marked.size == 0:
        return ()
    while True:
        cuts = np.flatnonzero(np.diff(marked) > bridge)
        if cuts.size < _MOST_SPANS or bridge > mask.size:
            break
        bridge *= 2
    firsts = marked[np.concatenate(([0], cuts + 1))]
    lasts = marked[np.concatenate((cuts, [marked.size - 1]))]
    return tuple((float(time[a]), float(time[b])) for a, b in zip(firsts, lasts, strict=True))


def share(part: float) -> str:
    """A share in words: ``5.1 %``."""
    return f"{100.0 * part:.2g} %"


def correlation(a: FloatArray, b: FloatArray) -> float:
    """Pearson's correlation of two signals (n,); 0 where one of them does not vary beyond its rounding."""
    if a.size < 2:
        return 0.0
    with np.errstate(over="ignore", invalid="ignore"):
        a, b = a - a.mean(), b - b.mean()
        size = float(np.linalg.norm(a) * np.linalg.norm(b))
        return float(a @ b) / size if size > 0.0 and np.isfinite(size) else 0.0
