"""What all tables of a scenario file have in common."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

from thsa_cosim.errors import did_you_mean

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Moderate = Annotated[float, Field(ge=-1e30, le=1e30)]
Share = Annotated[float, Field(ge=0, le=1)]
Name = Annotated[str, Field(min_length=1, pattern=r"^[^\x00-\x1f\x7f]+$")]


class Table(BaseModel):
    """A table of the file: no other keys, no silent conversion of types, no NaN."""

    model_config = ConfigDict(
        extra="forbid",
        strict=True,
        frozen=True,
        allow_inf_nan=False,
        regex_engine="python-re",
        defer_build=True,  # one kind of study needs the tables of one kind
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
    def resolved(cls, table: "Table", **values: Any) -> Self:
        """``table`` as it is used: ``values`` that were found (a path, a default of the FMU) win over its own.

        Nothing is checked again; a subclass of a table declares only what it adds or narrows.
        """
        own = {name: getattr(table, name) for name in type(table).model_fields}
        return cls.model_construct(**{**own, **values})

    @classmethod
    def keys(cls) -> tuple[str, ...]:
        """Names of the keys as they stand in the file."""
        return tuple(field.alias or name for name, field in cls.model_fields.items())


class FileTable(Table):
    """``fixed.<variable> = { file = "table.txt" }``: a text that is the path of a file, which the FMU is to read."""

    file: Name
    """Relative to the scenario; the FMU gets the absolute path."""

    def path(self, home: Path) -> Path:
        """The file of a scenario in the folder ``home``."""
        return (home / self.file).absolute()


StartValue = float | bool | str | FileTable
"""A number, a Boolean, or for a String variable a text."""


def start_texts(home: Path, fixed: Mapping[str, StartValue]) -> dict[str, str]:
    """Return the texts among start values; paths of files as an FMU gets them, of a scenario in the folder ``home``."""
    return {
        name: str(value.path(home)) if isinstance(value, FileTable) else value
        for name, value in fixed.items()
        if isinstance(value, str | FileTable)
    }


def check_order(start: float | None, stop: float | None) -> None:
    """Raise for a start that does not lie before its stop."""
    if start is not None and stop is not None and not start < stop:
        raise PydanticCustomError("order", "start must lie before stop")


def check_pairs(pairs: list[list[float]]) -> list[list[float]]:
    """Return ``pairs``; raise for one that is not [from, to] in order."""
    for pair in pairs:
        if len(pair) != 2 or not pair[0] < pair[1]:
            raise PydanticCustomError("mask", "must hold pairs [from, to] in s with from below to")
    return pairs
