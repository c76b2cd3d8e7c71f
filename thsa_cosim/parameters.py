"""Parameters to be found: bounds, scale, and the way between vectors and named values.

A search works on vectors in the unit cube; ``decode`` turns one into values in the parameters' own
units, ``assignments`` turns those into start values of the FMU in its units.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike

from thsa_cosim.errors import ParameterError, UnitError, did_you_mean
from thsa_cosim.signals import FloatArray
from thsa_cosim.units import conversion

Scale = Literal["linear", "log"]


@dataclass(frozen=True)
class Parameter:
    """One number to be found.

    Parameters
    ----------
    name
        Name in tables and results, for example ``R_s``.
    variable
        The FMU parameter that it sets, for example ``motor.R_s.a0``.
    unit
        Unit of ``lower``, ``upper``, ``start`` and of every value under this name.
    lower, upper
        Bounds; finite, ``lower < upper``, positive on a log scale.
    scale
        ``"linear"``, or ``"log"`` for a search in equal ratios.
    start
        First guess within the bounds, or None.
    variable_unit
        Unit of the FMU variable; None takes ``unit``.
    recording
        Name of the only recording that it applies to; None means all of them.

    Raises
    ------
    ParameterError
        For bounds, scale or start that contradict each other.
    UnitError
        If ``unit`` does not convert to ``variable_unit``.
    """

    name: str
    variable: str
    unit: str
    lower: float
    upper: float
    scale: Scale = "linear"
    start: float | None = None
    description: str = ""
    variable_unit: str | None = None
    recording: str | None = None

    def __post_init__(self) -> None:
        for key in ("lower", "upper", "start"):
            value = getattr(self, key)
            if value is not None and not math.isfinite(value):
                raise ParameterError(f"parameter {self.name!r}: {key} = {value} must be a finite number.")
        if not self.lower < self.upper:
            raise ParameterError(
                f"parameter {self.name!r}: lower = {self.lower:g} must be below upper = {self.upper:g};"
                f" swap or widen the bounds."
            )
        if not math.isfinite(self.upper - self.lower):
            raise ParameterError(f"parameter {self.name!r}: the bounds are too far apart; narrow them.")
        if self.scale not in ("linear", "log"):
            raise ParameterError(
                f"parameter {self.name!r}: scale {self.scale!r} must be 'linear' or 'log'."
                f"{did_you_mean(str(self.scale), ('linear', 'log'))}"
            )
        if self.scale == "log" and self.lower <= 0:
            raise ParameterError(
                f"parameter {self.name!r}: lower = {self.lower:g} must be above 0 on a log scale;"
                f" raise it or set scale = 'linear'."
            )
        if self.start is not None and not self.lower <= self.start <= self.upper:
            raise ParameterError(
                f"parameter {self.name!r}: start = {self.start:g} must lie between lower = {self.lower:g}"
                f" and upper = {self.upper:g}."
            )
        try:
            self._conversion  # noqa: B018  (fails early, with the parameter's name)
        except UnitError as error:
            raise UnitError(f"parameter {self.name!r} ({self.variable}): {error}") from None

    @cached_property
    def _conversion(self) -> tuple[float, float]:
        return conversion(self.unit, self.variable_unit or self.unit)

    def to_variable(self, value: float) -> float:
        """Return ``value`` [unit] in the FMU variable's unit."""
        factor, offset = self._conversion
        return value * factor + offset

    def from_variable(self, value: float) -> float:
        """Return ``value`` [variable_unit] in the parameter's unit."""
        factor, offset = self._conversion
        return (value - offset) / factor


class Combination(Protocol):
    """Parameters that set variables of the FMU together, such as the values of a law at several temperatures."""

    @property
    def members(self) -> tuple[str, ...]:
        """Names of the parameters."""

    def assignments(self, values: Mapping[str, float]) -> dict[str, float]:
        """Return FMU start values for named ``values``, which hold those of the members."""


@dataclass(frozen=True)
class ParameterSpace:
    """The parameters of one search, in order; those of a combination set variables together.

    Raises
    ------
    ParameterError
        For a name used twice, or a variable set twice in one recording.
    """

    parameters: tuple[Parameter, ...]
    combinations: tuple[Combination, ...] = ()

    def __post_init__(self) -> None:
        seen: set[str] = set()
        set_by: dict[tuple[str, str | None], str] = {}
        for p in self.parameters:
            if p.name in seen:
                raise ParameterError(f"parameter {p.name!r} appears twice; give each its own name.")
            seen.add(p.name)
            for (variable, recording), other in set_by.items():
                overlap = recording is None or p.recording is None or recording == p.recording
                if variable == p.variable and overlap:
                    raise ParameterError(
                        f"parameters {other!r} and {p.name!r} both set {p.variable!r}; remove one of them."
                    )
            set_by[p.variable, p.recording] = p.name

    @property
    def names(self) -> tuple[str, ...]:
        """Names in the order of the vectors."""
        return tuple(p.name for p in self.parameters)

    @property
    def dimension(self) -> int:
        """Number of parameters, n."""
        return len(self.parameters)

    def __len__(self) -> int:
        return len(self.parameters)

    def __getitem__(self, name: str) -> Parameter:
        for p in self.parameters:
            if p.name == name:
                return p
        raise ParameterError(f"unknown parameter {name!r}.{did_you_mean(name, self.names)}")

    @cached_property
    def lower(self) -> FloatArray:
        """(n,) lower bounds, each in its parameter's unit."""
        return np.array([p.lower for p in self.parameters], dtype=np.float64)

    @cached_property
    def upper(self) -> FloatArray:
        """(n,) upper bounds, each in its parameter's unit."""
        return np.array([p.upper for p in self.parameters], dtype=np.float64)

    @cached_property
    def _log(self) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        return np.array([p.scale == "log" for p in self.parameters], dtype=bool)

    @cached_property
    def _ends(self) -> tuple[FloatArray, FloatArray]:
        with np.errstate(invalid="ignore", divide="ignore"):
            low = np.where(self._log, np.log(self.lower), self.lower)
            high = np.where(self._log, np.log(self.upper), self.upper)
        return low, high

    def physical(self, unit: ArrayLike) -> FloatArray:
        """Return values in the parameters' units for (..., n) vectors in [0, 1]; the ends hit the bounds."""
        u = np.asarray(unit, dtype=np.float64)
        low, high = self._ends
        with np.errstate(over="ignore"):
            raw = low + u * (high - low)
            values = np.where(self._log, np.exp(np.where(self._log, raw, 0.0)), raw)
        # exp(log(x)) is not x: the ends are the bounds themselves.
        values = np.where(u <= 0.0, self.lower, np.where(u >= 1.0, self.upper, values))
        inside: FloatArray = np.clip(values, self.lower, self.upper)
        return inside

    def unit(self, values: ArrayLike) -> FloatArray:
        """Return vectors in [0, 1] for (..., n) values, the inverse of :meth:`physical`."""
        x = np.asarray(values, dtype=np.float64)
        low, high = self._ends
        with np.errstate(invalid="ignore", divide="ignore"):
            raw = np.where(self._log, np.log(np.where(self._log, x, 1.0)), x)
        vector: FloatArray = (raw - low) / (high - low)
        return vector

    def slope(self, unit: ArrayLike) -> FloatArray:
        """Return d value / d u at (..., n) vectors ``unit``, for carrying a covariance into the units."""
        low, high = self._ends
        slope: FloatArray = np.where(self._log, self.physical(unit) * (high - low), high - low)
        return slope

    def decode(self, unit: ArrayLike) -> dict[str, float]:
        """Return named values, in the parameters' units, for one (n,) vector in [0, 1]."""
        return dict(zip(self.names, self.physical(unit).tolist(), strict=True))

    def encode(self, values: Mapping[str, float]) -> FloatArray:
        """Return the (n,) vector in [0, 1] of named values.

        Raises
        ------
        ParameterError
            For a name that is missing or unknown, or a value outside its bounds.
        """
        for name in values:
            self[name]
        for p in self.parameters:
            if p.name not in values:
                raise ParameterError(f"no value for parameter {p.name!r}; give one.")
            if not p.lower <= values[p.name] <= p.upper:
                raise ParameterError(
                    f"parameter {p.name!r}: {values[p.name]:g} {p.unit} is outside"
                    f" [{p.lower:g}, {p.upper:g}]; widen the bounds."
                )
        return np.clip(self.unit([values[name] for name in self.names]), 0.0, 1.0)

    def start(self) -> FloatArray:
        """Return the (n,) start vector in [0, 1]; a parameter without start takes the middle."""
        middle = self.decode(np.full(self.dimension, 0.5))
        return self.encode({p.name: middle[p.name] if p.start is None else p.start for p in self.parameters})

    def assignments(self, values: Mapping[str, float], recording: str | None = None) -> dict[str, float]:
        """Return FMU start values (variable -> value in the FMU's unit) for named ``values``.

        Parameters that belong to another recording than ``recording`` are left out.
        """
        together = {name for combination in self.combinations for name in combination.members}
        found = {
            p.variable: p.to_variable(values[p.name])
            for p in self.parameters
            if p.name not in together and (p.recording is None or p.recording == recording)
        }
        for combination in self.combinations:
            found |= combination.assignments(values)
        return found

    def for_recordings(self, names: Sequence[str], per_recording: Sequence[str]) -> "ParameterSpace":
        """Return a space in which each parameter of ``per_recording`` has one copy per recording.

        The copy of ``offset`` for recording ``run_1`` is called ``offset[run_1]``.
        """
        spread: list[Parameter] = []
        for p in self.parameters:
            if p.name not in per_recording:
                spread.append(p)
                continue
            fields = {f: getattr(p, f) for f in p.__dataclass_fields__}
            spread += [Parameter(**{**fields, "name": f"{p.name}[{n}]", "recording": n}) for n in names]
        return ParameterSpace(tuple(spread), self.combinations)
