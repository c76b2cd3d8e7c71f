"""Docstrings as this code writes them, for autodoc: lists of names in modules, colons in one-line attributes."""

import re
from typing import Any

from sphinx.application import Sphinx

_ITEM = re.compile(r"^(``[\w.*, `]+``)\s{2,}(\S.*)$")
_kept: dict[str, list[str]] = {}


def _before(_app: Sphinx, what: str, name: str, _obj: Any, _options: Any, lines: list[str]) -> None:
    if what == "module":
        lines[:] = _as_lists(lines)
    elif what in ("attribute", "data", "property"):
        # Napoleon would take what stands before a colon for the attribute's type.
        _kept[name] = lines.copy()
        lines.clear()


def _after(_app: Sphinx, _what: str, name: str, _obj: Any, _options: Any, lines: list[str]) -> None:
    if name in _kept:
        lines[:] = _kept.pop(name)


def _as_lists(lines: list[str]) -> list[str]:
    """Turn rows of names and their meanings, ``name``  meaning, into lists."""
    found: list[str] = []
    inside = False
    for line in lines:
        item = _ITEM.sub(r"* \1: \2", line)
        if item != line and not inside:
            found.append("")
        if inside and item == line and line.strip():
            if line.startswith(" "):
                found.append(f"  {line.strip()}")
                continue
            found.append("")
        inside = item != line
        found.append(item)
    return found


def setup(app: Sphinx) -> dict[str, bool]:
    """Register with Sphinx, ahead of napoleon and behind it."""
    app.connect("autodoc-process-docstring", _before, priority=100)
    app.connect("autodoc-process-docstring", _after, priority=900)
    return {"parallel_read_safe": True}
