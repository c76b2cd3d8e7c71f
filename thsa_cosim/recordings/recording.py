"""A recording: measured signals in the FMU's names and units, and where each of them comes from."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np

from thsa_cosim.recordings.outliers import Mask
from thsa_cosim.recordings.repair import Repair
from thsa_cosim.signals import FloatArray, Signals


@dataclass(frozen=True)
class Column:
    """Where one signal comes from: a column of the file, or a constant.

    Parameters
    ----------
    column
        Name in the file, in full or without its unit or group; None with ``value``.
    unit
        Unit in the file; None takes the one that the file states.
    value
        A constant [unit] instead of a column.
    scale, offset
        Applied to the file's numbers first: ``scale * x + offset`` (a sign flip is ``scale = -1``).
    unwrap
        Period of the file's numbers, where a counter or an angle starts again; taken out before ``scale``.
    shift
        s; the signal is moved to later times by this much (negative: a sensor lag is taken out).
    smooth
        ``"mean"`` replaces the signal by its mean, ``"piecewise-linear"`` by the continuous piecewise-linear
        function with as few knots as its noise warrants (``piecewise``).
    noise
        1 σ of the white noise that ``"piecewise-linear"`` removes, in the FMU variable's unit; None: estimated.
    interpolation
        ``"linear"`` between samples, or ``"hold"``: the value stays until the next sample, as a digital
        command does.
    repair
        Samples that do not count.
    time
        Name of a time column of its own; None: the recording's.
    """

    column: str | None = None
    unit: str | None = None
    value: float | None = None
    scale: float = 1.0
    offset: float = 0.0
    unwrap: float | None = None
    shift: float = 0.0
    smooth: Literal["none", "mean", "piecewise-linear"] = "none"
    noise: float | None = None
    interpolation: Literal["linear", "hold"] = "linear"
    repair: Repair = field(default_factory=Repair)
    time: str | None = None


@dataclass(frozen=True, eq=False)
class Samples:
    """A signal as the file holds it within the cut, in the FMU variable's unit: nothing smoothed, shifted, resampled.

    ``time``, ``values``: (n,); ``left_out`` (n,): what the scenario's repairs leave out. ``held``: by
    ``interpolation = "hold"``; ``averaged``: by ``smooth = "mean"``. ``written`` (n,): the file's own numbers.
    """

    time: FloatArray
    values: FloatArray
    unit: str
    left_out: Mask
    held: bool = False
    averaged: bool = False
    written: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class Recording:
    """Measured signals under the FMU's variable names, in its units."""

    name: str
    path: Path
    sha256: str
    signals: Signals
    temperature_degC: float | None = None
    noise: Mapping[str, float] = field(default_factory=dict)
    """Estimated standard deviation of the white noise, in the FMU's unit; 0 where none can be seen."""
    notes: tuple[str, ...] = ()
    """What a reader of results should know: sentences."""
    lead_in: float = 0.0
    """s at the beginning that only bring a model into the right state: they drive it and are not compared."""
    samples: Mapping[str, Samples] = field(default_factory=dict)
    """What ``signals`` were made of, by the same names; constants are not among them."""
    left_out: Mapping[str, Mask] = field(default_factory=dict)
    """Samples of ``signals`` (n,) that repairs leave out, for the signals that have any."""
    repairs: tuple[str, ...] = ()
    """What the scenario's repairs did: sentences."""
    start: Mapping[str, float] = field(default_factory=dict)
    """Start values that this recording gives the FMU's parameters, in the FMU's units: its gain, its first position."""

    def with_start(self, names: Sequence[str]) -> "Recording":
        """Return the recording with the signals ``names`` turned into start values: each one's first sample."""
        if not names:
            return self
        return replace(
            self,
            signals=self.signals.select(n for n in self.signals.names if n not in names),
            noise={n: v for n, v in self.noise.items() if n not in names},
            samples={n: s for n, s in self.samples.items() if n not in names},
            left_out={n: m for n, m in self.left_out.items() if n not in names},
            start={n: float(self.signals[n][0]) for n in names},
        )

    @property
    def duration(self) -> float:
        """Length in s."""
        return float(self.signals.time[-1] - self.signals.time[0])

    def counted(self, name: str) -> Mask:
        """Which samples of :attr:`compared` count for a signal: all but those that repairs leave out; (n,) of bool."""
        kept = np.ones(self.signals.time.shape, dtype=np.bool_)
        if name in self.left_out:
            kept = ~self.left_out[name]
        return kept[kept.size - len(self.compared) :]

    @property
    def compared(self) -> Signals:
        """The signals after the lead-in."""
        # Times are sums and differences of rounded numbers: a sample at the border belongs to what follows.
        first = self.signals.time[0] + self.lead_in * (1.0 - 1e-9) - 1e-12
        return self.signals.window(first) if self.lead_in > 0.0 else self.signals
