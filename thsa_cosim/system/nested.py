"""A system of systems as it stands in an SSP: components, signal dictionaries, connections, before it is flattened."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from thsa_cosim.fmu.description import FmuDescription
from thsa_cosim.system.parameters import Binding


@dataclass(frozen=True)
class Link:
    """A connection as it stands in the file; an empty element is the system itself.

    Start and end say nothing of the direction (SSP 1.0, section 5.3.3.1): the kinds of the connectors do.
    """

    start_element: str
    start: str
    end_element: str
    end: str
    factor: float = 1.0
    offset: float = 0.0
    """target = factor * source + offset, after units are converted."""
    suppress_units: bool = False
    disturbance: str = ""

    def __str__(self) -> str:
        start = f"{self.start_element}.{self.start}" if self.start_element else self.start
        end = f"{self.end_element}.{self.end}" if self.end_element else self.end
        return f"{start} -> {end}"

    def turned(self) -> "Link":
        """The same connection with its ends exchanged."""
        return replace(
            self,
            start_element=self.end_element,
            start=self.end,
            end_element=self.start_element,
            end=self.start,
        )


@dataclass(frozen=True)
class Element:
    """A component as it stands in the file."""

    name: str
    fmu: FmuDescription
    source: str
    bindings: tuple[Binding, ...] = ()
    execution: str = ""
    step: float | None = None
    delay: float = 0.0
    jitter: float = 0.0
    process: Literal["shared", "own"] = "shared"


@dataclass(frozen=True)
class Bus:
    """A reference to a signal dictionary: all references to one dictionary are the same set of signals."""

    name: str
    dictionary: str


@dataclass(frozen=True)
class Nested:
    """A system as it stands in the file."""

    name: str
    elements: "tuple[Element | Nested | Bus, ...]"
    links: tuple[Link, ...]
    connectors: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    """Kind ("input", "output", "parameter", …) and unit by name."""
    bindings: tuple[Binding, ...] = ()
    dictionaries: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    """Signal dictionaries that it defines: units of their signals."""
    coupling_tolerance: float | None = None
