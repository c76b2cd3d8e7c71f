"""The documentation against the code: scenario keys and defaults, refused models, links."""

import re
from collections.abc import Iterator
from pathlib import Path
from types import NoneType
from typing import Any, get_args, get_origin

import pytest
from pydantic_core import PydanticUndefined

from thsa_cosim.scenario.schema import IdentifyTable, SimulateTable, StagesTable, Table

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = sorted(DOCS.rglob("*.md"))


def table_inside(annotation: Any) -> tuple[type[Table] | None, str]:
    """The table class of a field's type, and how the page writes the keys below it."""
    if isinstance(annotation, type) and issubclass(annotation, Table):
        return annotation, "."
    arguments = [a for a in get_args(annotation) if a is not NoneType]
    for argument in arguments:
        found, between = table_inside(argument)
        if found is not None:
            return found, ".<variable>." if get_origin(annotation) is dict else between
    return None, ""


def keys(table: type[Table], prefix: str = "") -> Iterator[tuple[str, str]]:
    """Every key below ``table`` with its default as the page writes it."""
    for name, field in table.model_fields.items():
        key = prefix + (field.alias or name)
        inside, between = table_inside(field.annotation)
        if inside is not None:
            yield from keys(inside, key + between)
        elif field.default is PydanticUndefined:
            yield key, "required"
        elif field.default is None:
            yield key, "–"
        elif isinstance(field.default, str):
            yield key, f'`"{field.default}"`'
        else:
            yield key, f"`{str(field.default).lower()}`"


def rows(page: Path) -> list[list[str]]:
    """Cells of all table rows of a page."""
    lines = page.read_text(encoding="utf-8").splitlines()
    return [[c.strip() for c in re.split(r"(?<!\\)\|", line)[1:-1]] for line in lines if line.startswith("|")]


def test_the_scenario_page_has_every_key_with_its_default() -> None:
    wanted = dict(keys(IdentifyTable)) | dict(keys(SimulateTable))
    wanted |= {key: value for key, value in keys(StagesTable) if key.startswith("stages.")}
    found = {row[0].strip("`"): row[1] for row in rows(DOCS / "scenario.md") if row[0].startswith("`")}
    assert found == wanted


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(DOCS)))
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", page.read_text(encoding="utf-8")):
        assert target.startswith("http") or (page.parent / target).exists(), target


def test_the_index_names_every_page() -> None:
    index = (DOCS / "README.md").read_text(encoding="utf-8")
    for page in DOCS.glob("*.md"):
        assert page.name == "README.md" or f"]({page.name})" in index, page.name


REFUSED = [
    (row[0].strip("`"), row[1])
    for row in rows(DOCS / "export.md")
    if row[0].startswith("`") and len(row) == 2
]


@pytest.mark.parametrize(("body", "sentence"), REFUSED, ids=[sentence[:40] for _, sentence in REFUSED])
def test_refusals_are_as_the_export_page_says(tmp_path: Path, body: str, sentence: str) -> None:
    for needed in ("rumoca", "casadi"):
        pytest.importorskip(needed, reason="the export tools are not installed")
    from thsa_cosim.errors import ModelicaError
    from thsa_cosim.export.causal import make_causal
    from thsa_cosim.export.flatten import flatten

    file = tmp_path / "M.mo"
    file.write_text(f"model M\n{body}\nend M;\n", encoding="utf-8")
    with pytest.raises(ModelicaError) as caught:
        make_causal(flatten(str(file), ROOT / "modelica" / "THSA"))
    assert str(caught.value).removeprefix(f"{file}: ") == sentence


def test_the_export_page_shows_refusals() -> None:
    assert len(REFUSED) > 5
