"""Sphinx configuration: ``python -m sphinx -W -b html docs build/docs`` (extra ``docs``). Needs no network."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "extensions"))

project = "thsa-cosim"
author = "The thsa-cosim developers"
copyright = "2026, the thsa-cosim developers"

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "docstrings",
    "index_of_readme",
    "mathml",
]
root_doc = "README"
html_theme = "furo"
html_title = "thsa-cosim"
html_math_renderer = "mathml"
html_show_sphinx = False

myst_enable_extensions = ["colon_fence", "dollarmath"]
myst_heading_anchors = 3
# Notebooks are executed by tests/docs/test_notebooks.py; the pages show the outputs that they hold.
nb_execution_mode = "off"

autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True, "show-inheritance": True}
napoleon_google_docstring = False
