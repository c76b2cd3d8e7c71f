"""The documentation against the code: generated pages, refused models, links."""

import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(DOCS.rglob("*.md"))

sys.path[:0] = [str(DOCS), str(DOCS / "extensions")]

from generate import PAGES as PAGES_OF_CODE
from scenario_page import ROOTS, tables


def rows(page: Path) -> list[list[str]]:
    """Cells of all table rows of a page."""
    lines = page.read_text(encoding="utf-8").splitlines()
    return [[c.strip() for c in re.split(r"(?<!\\)\|", line)[1:-1]] for line in lines if line.startswith("|")]


@pytest.mark.parametrize("name", PAGES_OF_CODE)
def test_pages_that_follow_from_the_code_are_up_to_date(name: str) -> None:
    written = (DOCS / name).read_text(encoding="utf-8")
    assert written == PAGES_OF_CODE[name](), "run 'python docs/generate.py'"


@pytest.mark.parametrize("root", ROOTS)
def test_every_key_of_a_scenario_says_what_it_means(root: str) -> None:
    page = (DOCS / "scenario.md").read_text(encoding="utf-8")
    for key, meaning in tables(ROOTS[root]):
        assert meaning, f"{key} has no docstring in thsa_cosim/scenario"
        parts = key.split(".")  # of a table that was described before, the table is named
        assert any(f"`{'.'.join(parts[:k])}`" in page for k in range(len(parts), 0, -1)), key


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(DOCS)))
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", page.read_text(encoding="utf-8")):
        assert target.startswith("http") or (page.parent / target).exists(), target


def test_the_index_names_every_page() -> None:
    index = (DOCS / "README.md").read_text(encoding="utf-8")
    for page in [*PAGES, *DOCS.rglob("*.ipynb")]:
        name = page.relative_to(DOCS).as_posix()
        assert name == "README.md" or f"]({name})" in index, name


REFUSED = [
    (row[0].strip("`"), row[1])
    for row in rows(DOCS / "export.md")
    if row[0].startswith("`") and len(row) == 2
]


@pytest.mark.parametrize(("body", "sentence"), REFUSED, ids=[sentence[:40] for _, sentence in REFUSED])
def test_refusals_are_as_the_export_page_says(tmp_path: Path, body: str, sentence: str) -> None:
    pytest.importorskip("casadi", reason="the export tools are not installed")
    from thsa_cosim.errors import ModelicaError
    from thsa_cosim.export.causal import make_causal
    from thsa_cosim.export.flatten import flatten

    file = tmp_path / "M.mo"
    file.write_text(f"model M {body} end M;\n", encoding="utf-8")
    with pytest.raises(ModelicaError) as caught:
        make_causal(flatten(str(file), ROOT / "modelica" / "THSA"))
    assert str(caught.value).replace(str(file), "M.mo") == sentence


def test_the_export_page_shows_refusals() -> None:
    assert len(REFUSED) > 5
