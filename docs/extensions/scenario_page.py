"""The reference of the scenario file, from the pydantic classes of its tables.

A key's meaning is the docstring below it; a table's introduction is the docstring of its class, which begins with the
table as it stands in the file, then a colon. Tables and keys that several kinds share are described once.
"""

import ast
import inspect
import itertools
import json
import re
import textwrap
from collections.abc import Iterator
from functools import cache
from types import NoneType
from typing import Annotated, Any, Literal, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from thsa_cosim.scenario.schema import KINDS, StagesTable
from thsa_cosim.scenario.table import Table
from thsa_cosim.scenario.tune_schema import TuneTable

HEAD = """\
<!-- Written by docs/generate.py from thsa_cosim/scenario: change the docstrings there. -->

# The scenario file

One TOML file says what to run. Paths in it are relative to it. `scenarios/motor.toml` is a commented example. A wrong
key, unit, variable or column ends the command with one sentence and exit code 2, before anything is simulated.

`required` means that a key has no default, `–` that nothing is set. `<variable>` is the name of an FMU variable; put
names with dots in quotes: `"velocityController.K_p" = 0.12`.
"""
ROOTS: dict[str, type[Table]] = {**KINDS, "stages": StagesTable, "tune": TuneTable}
WORDS = {bool: "true, false", int: "whole number", float: "number", str: "text"}
HUGE = 1e15
"""A limit beyond this keeps numbers finite and is nothing to tell."""


def scenario_page() -> str:
    """Return the page's Markdown."""
    covered: set[object] = set()
    return "\n".join([HEAD, *(part for root in ROOTS.values() for part in _section(root, "", covered))])


def tables(table: type[Table], prefix: str = "") -> Iterator[tuple[str, str]]:
    """Every key below ``table`` that holds a value, in full, with its meaning."""
    for name, field in table.model_fields.items():
        key = prefix + (field.alias or name)
        inside, between = table_inside(field.annotation)
        if inside is None:
            yield key, meaning(table, name)
        else:
            yield from tables(inside, f"{key}{between}.")


def table_inside(annotation: Any) -> tuple[type[Table] | None, str]:
    """The table class in a key's type, if any, and what stands between the key and the keys below it."""
    if isinstance(annotation, type) and issubclass(annotation, Table):
        return annotation, ""
    for argument in get_args(annotation):
        found, between = table_inside(argument)
        if found is not None:
            return found, ".<variable>" if get_origin(annotation) is dict else between
    return None, ""


def _section(table: type[Table], prefix: str, covered: set[object]) -> Iterator[str]:
    """Heading, introduction and keys of a table, then the same of the tables inside it."""
    heading, _, introduction = inspect.cleandoc(table.__doc__ or "").replace("``", "`").partition(":")
    yield f"{'###' if prefix else '##'} {heading.rstrip('.')}\n"
    if introduction:
        text = introduction.strip()
        yield f"{text[0].upper()}{text[1:]}\n"
    rows, shared, below = [], [], []
    for name, field in table.model_fields.items():
        key = prefix + (field.alias or name)
        inside, between = table_inside(field.annotation)
        known = inside or (_owner(table, name), name)
        if known in covered:
            shared.append(f"`{key}`")
            continue
        covered.add(known)
        if inside is None or _is_mixed(field.annotation):
            rows.append(_row(key, field, meaning(table, name)))
        if inside is not None:
            below.append((inside, f"{key}{between}."))
    if rows:
        yield "| key | type | default | meaning |\n|---|---|---|---|\n" + "\n".join(rows) + "\n"
    if shared:
        yield f"As above: {', '.join(shared)}.\n"
    for inside, longer in below:
        yield from _section(inside, longer, covered)


def _is_mixed(annotation: Any) -> bool:
    """Whether the members of a table are plain values or tables."""
    arguments = get_args(annotation)
    return get_origin(annotation) is dict and len(get_args(arguments[1])) > 1


def _owner(table: type[Table], name: str) -> type:
    """The class that declares a key: a subclass shares those of its bases."""
    return next(c for c in reversed(table.__mro__) if name in inspect.get_annotations(c))


def meaning(table: type[Table], name: str) -> str:
    """What stands below a key in the class that declares it."""
    return _docstrings(_owner(table, name)).get(name, "")


@cache
def _docstrings(table: type) -> dict[str, str]:
    """Docstrings of a class's attributes; pydantic would look for them whenever the package is imported."""
    body = ast.parse(textwrap.dedent(inspect.getsource(table))).body[0].body
    return {
        key.target.id: inspect.cleandoc(below.value.value)
        for key, below in itertools.pairwise(body)
        if isinstance(key, ast.AnnAssign)
        and isinstance(below, ast.Expr)
        and isinstance(below.value, ast.Constant)
    }


def _row(key: str, field: FieldInfo, text: str) -> str:
    shown = re.sub(r"\s+", " ", text.replace("``", "`")).strip().replace("|", r"\|")
    return f"| `{key}` | {_type(field.annotation, field.metadata)} | {default(field)} | {shown} |"


def default(field: FieldInfo) -> str:
    """A key's default as it stands in a file."""
    value = field.get_default(call_default_factory=True)
    if value is PydanticUndefined:
        return "required"
    return "–" if value is None else f"`{json.dumps(value)}`"


def _type(annotation: Any, metadata: list[Any]) -> str:
    """What a key may hold, in words."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        inner = [m for a in arguments[1:] for m in (a.metadata if isinstance(a, FieldInfo) else [a])]
        return _type(arguments[0], inner)
    if origin is Literal:
        return ", ".join(f"`{json.dumps(a)}`" for a in arguments)
    if origin is list:
        return f"list of {_plural(_type(arguments[0], []))}"
    if origin is dict:
        return f"table of {_plural(_type(arguments[1], []))}"
    if arguments:
        return " or ".join(_type(a, metadata) for a in arguments if a is not NoneType)
    if isinstance(annotation, type) and issubclass(annotation, Table):
        return "table"
    limits = []
    for limit in metadata:
        for kind, sign, name in ((Gt, ">", "gt"), (Ge, "≥", "ge"), (Lt, "<", "lt"), (Le, "≤", "le")):
            if isinstance(limit, kind) and abs(getattr(limit, name)) < HUGE:
                limits.append(f"{sign} {getattr(limit, name):g}")
    return " ".join([WORDS[annotation], ", ".join(limits)]).strip()


def _plural(words: str) -> str:
    return re.sub(r"^(number|text)\b", r"\1s", words)
