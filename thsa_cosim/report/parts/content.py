"""What a page is made of: sections with texts, facts, tables and figures. The templates turn them into HTML.

Everything here is plain text and numbers; escaping is the templates' and ``chart``'s business alone.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar


@dataclass(frozen=True)
class Cell:
    """A table's cell: ``text`` is shown, ``sort`` orders the rows; ``mark`` is "", good, bad or muted."""

    text: str
    sort: float | str | None = None
    mark: str = ""

    @property
    def key(self) -> str:
        """What the sorting script compares; empty (always last) where there is nothing to compare."""
        if self.sort is None or self.sort != self.sort:
            return ""
        return repr(self.sort) if isinstance(self.sort, float | int) else self.sort


@dataclass(frozen=True)
class Column:
    """A table's column; ``unit`` is shown in brackets after ``heading``."""

    heading: str
    unit: str = ""
    numeric: bool = True

    @property
    def text(self) -> str:
        """Heading with unit."""
        return f"{self.heading} [{self.unit}]" if self.unit else self.heading


@dataclass(frozen=True)
class Table:
    """Rows of cells under columns."""

    template: ClassVar[str] = "table"
    caption: str
    columns: Sequence[Column]
    rows: Sequence[Sequence[Cell]]
    note: str = ""


@dataclass(frozen=True)
class Figure:
    """A plotly figure: ``data`` and ``layout`` as its JSON wants them, ``height`` in CSS pixels.

    ``name`` is unique on the page. Colours are written ``var(--name)``: the page's script looks them up in its
    style sheet, so that one figure serves light, dark and print.
    """

    template: ClassVar[str] = "figure"
    name: str
    data: Sequence[Mapping[str, Any]]
    layout: Mapping[str, Any]
    height: int
    caption: str


@dataclass(frozen=True)
class Text:
    """A paragraph; ``mark`` is "", good or bad."""

    template: ClassVar[str] = "text"
    text: str
    mark: str = ""


@dataclass(frozen=True)
class Facts:
    """Names with their values, one below the other; ``code`` shows the values in a fixed-width font."""

    template: ClassVar[str] = "facts"
    items: Sequence[tuple[str, str]]
    code: bool = False


@dataclass(frozen=True)
class Fold:
    """Blocks that are hidden under a ``title`` until it is opened; printed in any case.

    ``details``: another figure shows the most of it; no file is drawn of it unasked.
    """

    template: ClassVar[str] = "fold"
    title: str
    blocks: Sequence["Block"]
    is_open: bool = False
    details: bool = False


Block = Table | Figure | Text | Facts | Fold


@dataclass(frozen=True)
class Section:
    """A heading with blocks; ``name`` is its anchor.

    ``is_part`` opens a stage of a study in stages; ``group`` is the stage that a section belongs to.
    """

    name: str
    title: str
    blocks: Sequence[Block] = field(default_factory=tuple)
    is_part: bool = False
    group: str = ""
