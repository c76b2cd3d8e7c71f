"""The words that a reader meets, against the table in CONTRIBUTING: documentation, help, messages, pages, scenarios.

The right column of that table holds what not to write. A phrase of several words may not occur at all; single words
(`log`, `drive`) have good uses, too, and are left to the author. ``RIDDLES`` are sentences that readers stumbled over.
"""

import ast
import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

HAS_GOOD_USES = {
    "look at",
    "search with",
    "all that is left",
    "what is left",
    "what came out",
    "measurement file",
}
"""Phrases of the table that are wrong only in the sense that the table gives."""

RIDDLES = (
    "units of noise apart",
    "variances of the noise apart",
    "lie within so much",
    "once more beside",
    "nothing gets below",
    "that nothing beats",
    "has something which its model lacks",
    "utilize",
    "utilise",
    "in order to",
    "please note",
    "obviously",
    "basically",
    "very simple",
)


def table_of_words() -> dict[str, str]:
    """Phrase that is not to be written → what to write, from CONTRIBUTING."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    body = text.split("| write | not |", 1)[1].split("\n\n", 1)[0]
    phrases = {}
    for line in body.splitlines()[2:]:
        write, avoid = (cell.strip() for cell in line.strip("|").split("|"))
        for phrase in re.split(r"[,;] ", re.sub(r"\(.*?\)", "", avoid).strip()):
            if " " in phrase and phrase not in HAS_GOOD_USES:
                phrases[phrase.lower()] = write
    return phrases


def texts() -> Iterator[tuple[str, str]]:
    """Name and text of all that a reader meets; of code, its strings without the docstrings of private functions."""
    for path in [ROOT / "README.md", *(ROOT / "docs").rglob("*.md"), *(ROOT / "scenarios").glob("*.toml")]:
        yield str(path.relative_to(ROOT)), path.read_text(encoding="utf-8")
    for path in (ROOT / "docs").rglob("*.ipynb"):
        cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
        yield str(path.relative_to(ROOT)), "\n".join("".join(cell["source"]) for cell in cells)
    for path in (ROOT / "thsa_cosim").rglob("*.html"):
        yield str(path.relative_to(ROOT)), path.read_text(encoding="utf-8")
    for path in (ROOT / "modelica").rglob("*.mo"):
        yield str(path.relative_to(ROOT)), path.read_text(encoding="utf-8")
    for path in (ROOT / "thsa_cosim").rglob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        strings = [
            n.value for n in ast.walk(tree) if isinstance(n, ast.Constant) and isinstance(n.value, str)
        ]
        yield str(path.relative_to(ROOT)), "\n".join(strings)


TEXTS = {name: " ".join(text.lower().split()) for name, text in texts()}
PHRASES = {**table_of_words(), **dict.fromkeys(RIDDLES, "a plain sentence")}


@pytest.mark.parametrize("phrase", PHRASES)
def test_no_text_says_it_in_words_that_readers_stumble_over(phrase: str) -> None:
    found = [
        f"{name}: …{text[max(0, m.start() - 30) : m.end() + 30]}…"
        for name, text in TEXTS.items()
        for m in re.finditer(rf"(?<!\w){re.escape(phrase)}(?!\w)", text)
    ]
    assert not found, f"write {PHRASES[phrase]!r}, not {phrase!r}:\n" + "\n".join(found)


def test_the_table_is_read() -> None:
    assert {"needs your hand", "with every loss a law over temperature"} <= set(PHRASES)
    assert len(TEXTS) > 300
