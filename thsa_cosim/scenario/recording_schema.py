"""The tables of a scenario file that say what was measured: files, time, signals, temperature."""

import math
from dataclasses import fields
from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator
from pydantic_core import PydanticCustomError

from thsa_cosim.recordings import Column, Repair
from thsa_cosim.scenario.table import (
    Moderate,
    Name,
    NotNegative,
    Positive,
    Table,
    check_order,
    check_pairs,
)


class TimeTable(Table):
    """``[recordings.time]``: the time axis of the files.

    A recording that begins in the middle of a movement does not begin where the FMU does. A closed loop forgets where
    it began within a few of its time constants: give it that long as ``lead_in``.
    """

    column: Name | None = None
    """The time column; leave it out where channels carry their own time (TDMS waveforms, MF4)."""
    unit: str | None = None
    """Its unit; left out: the one that the file states."""
    start: float | None = None
    """s in the file's time; earlier samples are cut off."""
    stop: float | None = None
    """s in the file's time; later samples are cut off."""
    step: Positive | None = None
    """s; resample to this step."""
    from_zero: bool = True
    """The first kept sample becomes time 0."""
    repeated: Literal["refuse", "drop"] = "refuse"
    """``"drop"`` leaves out rows whose stamp repeats an earlier one, or goes back."""
    lead_in: NotNegative = 0.0
    """s at the beginning of every recording that drive the FMU and are not compared; a cut begins that much
    earlier, as far as the file goes."""

    @model_validator(mode="after")
    def _order(self) -> "TimeTable":
        check_order(self.start, self.stop)
        return self


class ColumnTable(Table):
    """``[recordings.columns.<variable>]``: where a signal comes from.

    One table per FMU input and per measured output; every input of the FMU needs one. Whether a signal is driven or
    compared follows from the FMU. A parameter of the FMU takes the column's first value in each recording as its start
    value: a gain that differs from run to run, the position in which a recording begins.
    """

    column: Name | None = None
    """Column of the file; either this or ``value``."""
    value: Moderate | None = None
    """A constant instead of a column, in ``unit``; inputs only."""
    unit: str | None = None
    """Unit of the file's numbers, which are converted to the FMU's; left out: the one that the file states.
    """
    scale: Moderate = 1.0
    """The file's numbers are multiplied by this first (-1 flips a sign)."""
    offset: Moderate = 0.0
    """Then this is added, in the file's unit."""
    unwrap: Positive | None = None
    """Period, in the file's numbers, of a counter or an angle that starts again: 65536, 360, 6.283185307."""
    shift: Moderate = 0.0
    """s; moves the signal to later times (negative: removes the lag of a sensor)."""
    smooth: Literal["none", "mean", "piecewise-linear"] = "none"
    """``"mean"`` replaces the signal by its mean, ``"piecewise-linear"`` (inputs) by plateaus and ramps."""
    noise: Positive | None = None
    """1 σ of the noise that ``smooth = "piecewise-linear"`` removes, in the FMU variable's unit; left out:
    estimated."""
    interpolation: Literal["linear", "hold"] = "linear"
    """``"hold"``: the value stays until the next sample, as a digital command does."""
    time: Name | None = None
    """Time column of this column, in the unit of ``[recordings.time]``; left out: the common one."""
    missing: list[Moderate] | None = None
    """Numbers of the file that mean "no value", such as ``[-9999.0]``; with any list, also ``[]``, blank cells mean it,
    too. Such samples are left out: an output is not compared there, an input runs straight over them."""
    below: Moderate | None = None
    """Samples at or below this, in the FMU variable's unit, are left out: where a sensor clips, it gives a bound."""
    above: Moderate | None = None
    """The same at or above."""
    mask: list[list[float]] = Field(default_factory=list)
    """Pairs ``[from, to]`` in s of the file's time that are left out of this signal."""
    despike: bool = False
    """Leave out spikes of one or two samples (Hampel's test against their neighbours)."""
    independent: bool = False
    """Of a slow channel in a fast table, leave out the samples that are held or interpolated."""
    fill: NotNegative = 0.1
    """s; the longest stretch without value that an input may run straight over."""

    @model_validator(mode="after")
    def _one_source(self) -> "ColumnTable":
        if (self.column is None) == (self.value is None):
            raise PydanticCustomError("source", "needs either 'column' (of the file) or 'value' (a constant)")
        if self.scale == 0.0:
            raise PydanticCustomError("scale", "scale = 0 would erase the signal; use another number")
        if self.smooth == "piecewise-linear" and self.interpolation == "hold":
            raise PydanticCustomError(
                "smooth", "smooth = 'piecewise-linear' runs between samples; leave out interpolation = 'hold'"
            )
        if self.noise is not None and self.smooth != "piecewise-linear":
            raise PydanticCustomError(
                "noise",
                "'noise' goes with smooth = 'piecewise-linear'; a compared output's is [cost.channels]'s",
            )
        return self

    @field_validator("mask")
    @classmethod
    def _mask(cls, mask: list[list[float]]) -> list[list[float]]:
        return check_pairs(mask)

    def source(self) -> Column:
        """Return it as the reader of recordings wants it."""
        given = self.model_dump()
        names = [f.name for f in fields(Repair)]
        repair = {name: given.pop(name) for name in names}
        repair["mask"] = tuple((a, b) for a, b in repair["mask"])
        repair["missing"] = None if repair["missing"] is None else tuple(repair["missing"])
        return Column(**given, repair=Repair(**repair))


class PartTable(Table):
    """``[[recordings.parts]]``: pieces of every fit file.

    Some to fit, some only to score; a piece is named after the file and its own name. ``--fit`` replaces the files
    and keeps the cuts; ``--validate`` takes the place of the pieces with ``use = "validate"``. Files under
    ``validate`` stay whole.
    """

    name: Name
    """Its name in results."""
    use: Literal["fit", "validate"]
    """What becomes of it."""
    start: float | None = None
    """s in the file's time; left out: from the beginning."""
    stop: float | None = None
    """s in the file's time; left out: to the end."""

    @model_validator(mode="after")
    def _order(self) -> "PartTable":
        check_order(self.start, self.stop)
        return self

    def overlaps(self, other: "PartTable") -> bool:
        """Whether the two pieces share samples."""
        begin = max(-math.inf if p.start is None else p.start for p in (self, other))
        return begin < min(math.inf if p.stop is None else p.stop for p in (self, other))


class RecordingsTable(Table):
    """``[recordings]``: which files."""

    fit: list[Name] = Field(default_factory=list)
    """Files or globs to fit; an identification needs at least one. ``--fit`` replaces them."""
    validate_: list[Name] = Field(default_factory=list, alias="validate")
    """Files or globs that are only scored. ``--validate`` replaces them."""
    time: TimeTable = TimeTable()
    parts: list[PartTable] = Field(default_factory=list)
    columns: dict[Name, ColumnTable] = Field(min_length=1)

    @model_validator(mode="after")
    def _apart(self) -> "RecordingsTable":
        if self.parts and not (self.time.start is None and self.time.stop is None):
            raise PydanticCustomError(
                "parts", "time.start and time.stop cut whole files; cut in parts or there"
            )
        if self.parts and all(p.use == "validate" for p in self.parts):
            raise PydanticCustomError("parts", "no entry of parts has use = 'fit'; add one")
        for k, part in enumerate(self.parts):
            for other in self.parts[:k]:
                names = {"one": repr(other.name), "other": repr(part.name)}
                if part.name == other.name:
                    raise PydanticCustomError(
                        "parts", "two entries of parts are named {one}; rename one", names
                    )
                if part.use != other.use and part.overlaps(other):
                    raise PydanticCustomError(
                        "parts",
                        "parts {one} and {other} overlap, but only one is fitted; move a bound",
                        names,
                    )
        return self


class TemperatureTable(Table):
    """``[temperature]``: where a recording's temperature is, and what is identified together.

    Without this table all recordings are one point without a temperature.
    """

    input: Name | None = None
    """The FMU input whose mean is a recording's temperature; either this or ``column``."""
    column: Name | None = None
    """A column of the file that is not an FMU signal."""
    unit: str | None = None
    """Unit of that column."""
    round_to: Annotated[float, Field(ge=1e-3, le=1e3)] = 1.0
    """K; recordings whose rounded temperatures agree are fitted together."""
    group: Literal["point", "joint", "law"] = "point"
    """``"joint"``: one fit over all recordings. ``"law"``: the same, and every parameter with a ``law`` of a stated
    form is identified as that law: for recordings whose temperature moves."""

    @model_validator(mode="after")
    def _one_source(self) -> "TemperatureTable":
        if (self.input is None) == (self.column is None):
            raise PydanticCustomError(
                "source", "needs either 'input' (an FMU variable) or 'column' (of the file)"
            )
        if self.unit is not None and self.column is None:
            raise PydanticCustomError("unit", "'unit' goes with 'column'; an input's unit is the FMU's")
        return self
