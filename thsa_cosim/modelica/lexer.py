"""Modelica source → tokens."""

import re
from bisect import bisect_right
from pathlib import Path
from typing import NamedTuple

from thsa_cosim.errors import ModelicaError

KEYWORDS = frozenset(
    re.findall(
        r"\w+",
        """
    algorithm and annotation block break class connect connector constant constrainedby der discrete each else
    elseif elsewhen encapsulated end enumeration equation expandable extends external false final flow for
    function if import impure in initial inner input loop model not operator or outer output package parameter
    partial protected public pure record redeclare replaceable return stream then true type when while within
        """,
    )
)
_TOKEN = re.compile(
    r"""(?P<skip>\s+|//[^\n]*|/\*.*?\*/)
    |(?P<name>[^\W\d]\w*|'(?:\\.|[^'\\])+')
    |(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)
    |(?P<string>"(?:\\.|[^"\\])*")
    |(?P<symbol>\.\*|\.\+|\.-|\./|\.\^|:=|<=|>=|<>|==|[-+*/^=<>(){}\[\],;:.])""",
    re.S | re.X,
)
_ESCAPES = {"n": "\n", "t": "\t", '"': '"', "\\": "\\", "'": "'", "?": "?", "a": "\a", "b": "\b", "f": "\f",
            "r": "\r", "v": "\v"}  # fmt: skip


class Tokens(NamedTuple):
    """Parallel lists: ``kinds`` is "name", "number", "string", "end" or the keyword or symbol itself."""

    kinds: list[str]
    texts: list[str]
    positions: list[int]
    line_starts: list[int]
    source: str

    def line(self, index: int) -> int:
        """Line number of a token, from 1."""
        return bisect_right(self.line_starts, self.positions[min(index, len(self.positions) - 1)])


def tokenize(source: str, file: Path) -> Tokens:
    """Tokens of one file; raises ModelicaError, with file and line, for what is no Modelica."""
    kinds: list[str] = []
    texts: list[str] = []
    positions: list[int] = []
    place, size = 0, len(source)
    while place < size:
        found = _TOKEN.match(source, place)
        if found is None:
            line = source.count("\n", 0, place) + 1
            what = (
                "a string without end"
                if source[place] == '"'
                else f"{source[place]!r}, which is not part of Modelica"
            )
            raise ModelicaError(f"{file}:{line}: cannot be read: {what}.")
        kind = found.lastgroup
        if kind != "skip":
            text = found.group()
            kinds.append(text if kind == "symbol" or text in KEYWORDS else str(kind))
            texts.append(text)
            positions.append(place)
        place = found.end()
    kinds.append("end-of-file")
    texts.append("the end of the file")
    positions.append(size)
    starts = [0, *(found.end() for found in re.finditer("\n", source))]
    return Tokens(kinds, texts, positions, starts, source)


def unquote(text: str) -> str:
    """Value of a string token."""
    return re.sub(
        r"\\(.)", lambda found: _ESCAPES.get(found.group(1), found.group(1)), text[1:-1], flags=re.S
    )


def read_source(file: Path) -> str:
    """Text of a Modelica file: UTF-8, with or without a byte order mark, or else Latin-1; raises ModelicaError."""
    try:
        data = file.read_bytes()
    except OSError as error:
        raise ModelicaError(f"{file}: cannot be read: {error.strerror}.") from error
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    return text.replace("\r\n", "\n")
