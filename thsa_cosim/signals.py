"""Time series: what recordings hold, what inputs drive a plant, what a plant returns."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thsa_cosim.errors import did_you_mean, require

if TYPE_CHECKING:
    import pandas as pd

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Signals:
    """Named signals over one common time axis.

    Parameters
    ----------
    time
        (n,) s, strictly increasing, finite.
    values
        One (n,) array per name; NaN is allowed (a failed run is judged elsewhere).
    units
        Unit string per name; a name that is left out has the unit ``"1"``.
    held
        Names whose value holds from one sample to the next; the others run linearly between samples.

    Everything is kept as contiguous float64, so that compiled loops take the arrays as they are.

    Raises
    ------
    ValueError
        For lengths that differ, a time axis that does not increase, or a unit without signal.
    """

    time: FloatArray
    values: Mapping[str, FloatArray]
    units: Mapping[str, str] = field(default_factory=dict)
    held: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        time = np.ascontiguousarray(self.time, dtype=np.float64)
        if time.ndim != 1:
            raise ValueError(f"time must be one-dimensional, not of shape {time.shape}; pass (n,) seconds.")
        if not np.isfinite(time).all() or not (np.diff(time) > 0).all():
            raise ValueError("time must be finite and strictly increasing; sort it, drop repeated samples.")
        values = {
            name: np.ascontiguousarray(column, dtype=np.float64) for name, column in self.values.items()
        }
        for name, column in values.items():
            if column.shape != time.shape:
                raise ValueError(f"signal {name!r} has shape {column.shape}, but time has {time.shape}.")
        for name in (*self.units, *self.held):
            if name not in values:
                raise ValueError(f"unit or hold for unknown signal {name!r}.{did_you_mean(name, values)}")
        object.__setattr__(self, "time", time)
        object.__setattr__(self, "values", values)
        object.__setattr__(self, "held", frozenset(self.held))
        object.__setattr__(self, "units", {name: self.units.get(name, "1") for name in values})

    @property
    def names(self) -> tuple[str, ...]:
        """Names in order."""
        return tuple(self.values)

    def __len__(self) -> int:
        return int(self.time.size)

    def __contains__(self, name: object) -> bool:
        return name in self.values

    def __getitem__(self, name: str) -> FloatArray:
        try:
            return self.values[name]
        except KeyError:
            raise KeyError(f"no signal {name!r}.{did_you_mean(name, self.values)}") from None

    def select(self, names: Iterable[str]) -> "Signals":
        """Return the named signals, in that order."""
        chosen = tuple(names)
        return Signals(
            self.time,
            {n: self[n] for n in chosen},
            {n: self.units[n] for n in chosen},
            self.held & set(chosen),
        )

    def window(self, start: float | None = None, stop: float | None = None) -> "Signals":
        """Return the samples with ``start <= time <= stop`` [s]; time keeps its values."""
        inside = np.ones(self.time.shape, dtype=bool)
        if start is not None:
            inside &= self.time >= start
        if stop is not None:
            inside &= self.time <= stop
        return Signals(
            self.time[inside], {n: v[inside] for n, v in self.values.items()}, self.units, self.held
        )

    def resample(self, time: ArrayLike) -> "Signals":
        """Return the values at ``time`` ((m,) s): linear, or held for ``held``; outside the span they hold.

        A time within 1e-6 of the shortest step before a sample counts as that sample.
        """
        if len(self) == 0:
            raise ValueError("signals without samples cannot be resampled.")
        target = np.ascontiguousarray(time, dtype=np.float64)
        slack = 1e-6 * float(np.min(np.diff(self.time))) if len(self) > 1 else 0.0
        last = np.maximum(np.searchsorted(self.time, target + slack, side="right") - 1, 0)
        columns = {
            n: v[last] if n in self.held else np.interp(target, self.time, v) for n, v in self.values.items()
        }
        return Signals(target, columns, self.units, self.held)

    def with_values(
        self, values: Mapping[str, FloatArray], units: Mapping[str, str] | None = None
    ) -> "Signals":
        """Return signals on the same time axis with ``values`` added or replaced."""
        merged_units = {**self.units, **{n: (units or {}).get(n, self.units.get(n, "1")) for n in values}}
        return Signals(self.time, {**self.values, **values}, merged_units, self.held)

    def to_frame(self) -> "pd.DataFrame":
        """Return a table with index ``time [s]`` and one column ``name [unit]`` per signal."""
        require("pandas", "A table", "notebook")
        import pandas as pd  # workers use signals, too, and need no tables

        columns = {f"{n} [{self.units[n]}]": v for n, v in self.values.items()}
        return pd.DataFrame(columns, index=pd.Index(self.time, name="time [s]"))
