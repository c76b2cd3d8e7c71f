"""The tables of a scenario file: which keys there are, their types and ranges.

A further kind of scenario is one more class in ``KINDS``.
"""

import math
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator
from pydantic_core import PydanticCustomError

from thsa_cosim.errors import did_you_mean
from thsa_cosim.laws import FORMS
from thsa_cosim.search.strategies import Strategy

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Moderate = Annotated[float, Field(ge=-1e30, le=1e30)]
Share = Annotated[float, Field(ge=0, le=1)]
Name = Annotated[str, Field(min_length=1, pattern=r"^[^\x00-\x1f\x7f]+$")]


class Table(BaseModel):
    """A table of the file: no other keys, no silent conversion of types, no NaN."""

    model_config = ConfigDict(
        extra="forbid", strict=True, frozen=True, allow_inf_nan=False, regex_engine="python-re"
    )

    @model_validator(mode="before")
    @classmethod
    def _known_keys(cls, data: Any) -> Any:
        if isinstance(data, dict):
            known = cls.keys()
            for key in data:
                if key not in known:
                    raise PydanticCustomError(
                        "unknown_key",
                        "unknown key {key}; remove it or use one of: {known}.{hint}",
                        {"key": repr(key), "known": ", ".join(known), "hint": did_you_mean(key, known)},
                    )
        return data

    @classmethod
    def keys(cls) -> tuple[str, ...]:
        """Names of the keys as they stand in the file."""
        return tuple(field.alias or name for name, field in cls.model_fields.items())


def _check_order(start: float | None, stop: float | None) -> None:
    if start is not None and stop is not None and not start < stop:
        raise PydanticCustomError("order", "start must lie before stop")


class TimeTable(Table):
    """``[recordings.time]``."""

    column: Name | None = None
    unit: str | None = None
    start: float | None = None
    stop: float | None = None
    step: Positive | None = None
    from_zero: bool = True
    lead_in: NotNegative = 0.0

    @model_validator(mode="after")
    def _order(self) -> "TimeTable":
        _check_order(self.start, self.stop)
        return self


class ColumnTable(Table):
    """``[recordings.columns.<FMU variable>]``."""

    column: Name | None = None
    value: Moderate | None = None
    unit: str | None = None
    scale: Moderate = 1.0
    offset: Moderate = 0.0
    shift: Moderate = 0.0
    smooth: Literal["none", "mean", "piecewise-linear"] = "none"
    noise: Positive | None = None
    interpolation: Literal["linear", "hold"] = "linear"

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


class PartTable(Table):
    """``[[recordings.parts]]``: a piece of every fit file, in s of the file's time."""

    name: Name
    use: Literal["fit", "validate"]
    start: float | None = None
    stop: float | None = None

    @model_validator(mode="after")
    def _order(self) -> "PartTable":
        _check_order(self.start, self.stop)
        return self

    def overlaps(self, other: "PartTable") -> bool:
        """Whether the two pieces share samples."""
        begin = max(-math.inf if p.start is None else p.start for p in (self, other))
        return begin < min(math.inf if p.stop is None else p.stop for p in (self, other))


class RecordingsTable(Table):
    """``[recordings]``."""

    fit: list[Name] = []
    validate_: list[Name] = Field(default=[], alias="validate")
    time: TimeTable = TimeTable()
    parts: list[PartTable] = []
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
    """``[temperature]``: where a recording's temperature is, and what is identified together."""

    input: Name | None = None
    column: Name | None = None
    unit: str | None = None
    round_to: Annotated[float, Field(ge=1e-3, le=1e3)] = 1.0
    group: Literal["point", "joint"] = "point"

    @model_validator(mode="after")
    def _one_source(self) -> "TemperatureTable":
        if (self.input is None) == (self.column is None):
            raise PydanticCustomError(
                "source", "needs either 'input' (an FMU variable) or 'column' (of the file)"
            )
        if self.unit is not None and self.column is None:
            raise PydanticCustomError("unit", "'unit' goes with 'column'; an input's unit is the FMU's")
        return self


class LawTable(Table):
    """``[parameters.law]``: the form over temperature, and a published curve to compare with."""

    form: str | None = None
    published: list[float] | None = None
    published_form: str | None = None

    @field_validator("form", "published_form")
    @classmethod
    def _form(cls, form: str | None) -> str | None:
        if form is not None and form not in FORMS:
            hint = did_you_mean(form, FORMS)
            raise PydanticCustomError(
                "form",
                "must be one of {forms}, not {form}.{hint}",
                {"forms": ", ".join(FORMS), "form": repr(form), "hint": hint},
            )
        return form

    @model_validator(mode="after")
    def _coefficients(self) -> "LawTable":
        form = self.published_form or self.form
        if self.published is None:
            return self
        if form is None or form == "spline":
            raise PydanticCustomError("published", "published needs a form with coefficients; set form")
        if len(self.published) != FORMS[form]:
            raise PydanticCustomError(
                "published",
                "published holds {found} coefficients, but {form} has {wanted}",
                {"found": len(self.published), "form": form, "wanted": FORMS[form]},
            )
        return self


class ParameterTable(Table):
    """``[[parameters]]``."""

    name: Name
    variable: Name
    unit: str
    lower: float
    upper: float
    scale: Literal["linear", "log"] = "linear"
    start: float | None = None
    description: str = ""
    per: Literal["point", "recording"] = "point"
    zero: list[Name] = []
    law_block: Name | None = None
    law: LawTable | None = None


class ChannelTable(Table):
    """``[cost.channels.<FMU output>]``."""

    weight: Positive = 1.0
    noise: float | str = "estimate"

    @field_validator("noise")
    @classmethod
    def _noise(cls, noise: float | str) -> float | str:
        if noise == "estimate" or (isinstance(noise, float | int) and noise > 0):
            return noise
        raise PydanticCustomError("noise", "must be 'estimate' or a number above 0 in the variable's unit")


class WindowTable(Table):
    """``[cost.window]``, in s after the first sample."""

    start: float | None = None
    stop: float | None = None

    @model_validator(mode="after")
    def _order(self) -> "WindowTable":
        _check_order(self.start, self.stop)
        return self


ErrorName = Literal["squared", "absolute", "huber"]


class CostTable(Table):
    """``[cost]`` (eq. 6)."""

    error: ErrorName = "squared"
    also: list[ErrorName] = []
    channels: dict[Name, ChannelTable] = {}
    window: WindowTable = WindowTable()
    mask: list[list[float]] = []

    @field_validator("mask")
    @classmethod
    def _mask(cls, mask: list[list[float]]) -> list[list[float]]:
        for pair in mask:
            if len(pair) != 2 or not pair[0] < pair[1]:
                raise PydanticCustomError("mask", "must hold pairs [from, to] in s with from below to")
        return mask


class SearchTable(Table):
    """``[search]``: the article's setting by default."""

    population: Annotated[int, Field(ge=5, le=100_000)] = 45
    generations: Annotated[int, Field(ge=1, le=1_000_000)] = 30
    mutation: Annotated[float, Field(gt=0, lt=2)] = 0.16
    crossover: Share = 0.5
    strategy: Strategy = "rand1bin"
    tolerance: NotNegative = 1e-3
    polish: bool = True
    profile: list[Name] = []


class SimulationTable(Table):
    """``[simulation]``."""

    interface: Literal["co-simulation", "model-exchange"] | None = None
    tolerance: Annotated[float, Field(gt=0, lt=1)] | None = None
    step: Positive | None = None
    deadline: Positive = 60.0
    memory: Positive | None = None
    reuse: Literal["fresh", "reset"] = "fresh"


class CommonTable(Table):
    """Keys of every kind that runs an FMU against recordings."""

    kind: str
    title: str = ""
    fmu: Name
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = 1
    recordings: RecordingsTable
    temperature: TemperatureTable | None = None
    parameter_set: Name | None = None
    fixed: dict[Name, float | bool] = {}
    cost: CostTable = CostTable()
    simulation: SimulationTable = SimulationTable()


class SimulateTable(CommonTable):
    """``kind = "simulate"``: run once, compare with the recordings."""

    outputs: list[Name] = []


class IdentifyTable(CommonTable):
    """``kind = "identify"``: find parameters, per temperature or jointly."""

    parameters: list[ParameterTable] = Field(min_length=1)
    search: SearchTable = SearchTable()


class StageTable(Table):
    """``[[stages]]``: a scenario of its own; ``give`` names results that later stages get (default: all)."""

    scenario: Name
    give: list[Name] | None = None


class StagesTable(Table):
    """A scenario that runs others in order, each with what the earlier ones found."""

    kind: str
    title: str = ""
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = 1
    stages: list[StageTable] = Field(min_length=1)


KINDS: dict[str, type[CommonTable]] = {"identify": IdentifyTable, "simulate": SimulateTable}
"""Table class per ``kind``."""
