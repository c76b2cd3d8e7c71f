"""From pydantic's errors to one sentence with the file, the key, what is wrong and the remedy."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from thsa_cosim.errors import ScenarioError, did_you_mean


def one_line(text: str) -> str:
    """Return ``text`` on one line, without control characters, at most 600 characters long."""
    flat = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    return flat if len(flat) <= 600 else flat[:590] + " ..."


def from_validation(path: Path, data: Mapping[str, Any], error: ValidationError) -> ScenarioError:
    """Return the first of pydantic's errors as a sentence, unknown keys before missing ones."""
    found = error.errors(include_url=False)
    first = min(found, key=lambda e: _RANK.get(e["type"], 1))
    key = dotted(data, first["loc"])
    prefix = f"{path}: {key}" if key else f"{path}"
    return ScenarioError(one_line(f"{prefix}: {_what(first)}"))


_RANK = {"unknown_key": 0, "missing": 2}


def dotted(data: Mapping[str, Any], location: Sequence[int | str]) -> str:
    """Return ``parameters[R_s].lower`` for ``("parameters", 0, "lower")``: an entry by its name if it has one."""
    here: Any = data
    text = ""
    for part in location:
        if isinstance(part, int):
            here = here[part] if isinstance(here, list) and part < len(here) else None
            name = here.get("name") if isinstance(here, dict) else None
            text += f"[{name if isinstance(name, str) else part + 1}]"
            continue
        if not isinstance(here, dict):
            break  # a union's tag, not a key
        here = here.get(part)
        shown = part if re.fullmatch(r"[\w-]+", part) else f'"{part}"'
        text += f".{shown}" if text else shown
    return text


def _what(error: Any) -> str:
    kind, context, given = error["type"], error.get("ctx", {}), error.get("input")
    shown = repr(given) if len(repr(given)) <= 40 else repr(given)[:37] + "..."
    if kind == "missing":
        return "is missing; add it."
    if kind == "literal_error":
        choices = re.findall(r"'([^']*)'", str(context.get("expected", "")))
        hint = did_you_mean(given, choices) if isinstance(given, str) else ""
        return f"must be {context.get('expected')}, not {shown}.{hint}"
    if kind == "too_short":
        return f"needs at least {context.get('min_length')} entry; add one."
    message = str(error["msg"])
    if message.startswith("Input should be "):
        wanted = (
            message.removeprefix("Input should be ").replace("dictionary", "table").replace("list", "array")
        )
        return f"must be {_PLAIN.get(kind, wanted)}, not {shown}."
    if kind in ("string_too_short", "string_pattern_mismatch"):
        return f"must be a text of printable characters, not {shown}."
    return message if message.endswith(("?", ".")) else f"{message}."


_PLAIN = {
    "float_type": "a number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "bool_type": "true or false",
    "string_type": "a text in quotes",
    "model_type": "a table",
    "model_attributes_type": "a table",
    "dict_type": "a table",
    "list_type": "an array",
    "finite_number": "a finite number",
}
