"""The tree of pages is the list of links in README.md: one index, which people can read without Sphinx.

Every section of README.md becomes a table of contents of the same caption, with the pages that it links to.
"""

import re

from sphinx.application import Sphinx

_LINK = re.compile(r"\]\(([^)#:]+)\.(?:md|ipynb)\)")


def _add_tree(app: Sphinx, name: str, source: list[str]) -> None:
    if name != app.config.root_doc:
        return
    trees = []
    for section in re.split(r"^## ", source[0], flags=re.MULTILINE)[1:]:
        pages = dict.fromkeys(_LINK.findall(section))
        if pages:
            caption = section.splitlines()[0]
            trees.append(f":::{{toctree}}\n:hidden:\n:caption: {caption}\n\n" + "\n".join(pages) + "\n:::\n")
    source[0] += "\n" + "\n".join(trees)


def setup(app: Sphinx) -> dict[str, bool]:
    """Register with Sphinx."""
    app.connect("source-read", _add_tree)
    return {"parallel_read_safe": True}
