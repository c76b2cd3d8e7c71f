"""The notebooks run, and hold the outputs that running them gives."""

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

NOTEBOOKS = sorted((Path(__file__).parents[2] / "docs" / "notebooks").glob("*.ipynb"))
EXECUTE = """
import sys
import nbformat
from nbclient import NotebookClient
notebook = nbformat.read(sys.argv[1], as_version=4)
NotebookClient(notebook, timeout=120, resources={"metadata": {"path": sys.argv[3]}}).execute()
nbformat.write(notebook, sys.argv[2])
"""


def outputs(path: Path) -> list[list[str]]:
    """Kinds of the outputs of each code cell."""
    cells: list[dict[str, Any]] = json.loads(path.read_text(encoding="utf-8"))["cells"]
    return [[o["output_type"] for o in cell["outputs"]] for cell in cells if cell["cell_type"] == "code"]


@pytest.mark.slow
@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(notebook: Path, tmp_path: Path) -> None:
    executed = tmp_path / notebook.name
    done = subprocess.run(
        [sys.executable, "-c", EXECUTE, str(notebook), str(executed), str(notebook.parent)],
        capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    assert outputs(executed) == outputs(notebook), "run it again and keep its outputs"


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_names_no_machine(notebook: Path) -> None:
    cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    said = json.dumps([{k: v for k, v in cell.items() if k != "id"} for cell in cells])
    said = re.sub(r'"image/png": "[^"]*"', "", said)
    assert not re.search(r"(/home|/tmp|/root|/work|C:)[/\\]", said)


def test_there_are_notebooks() -> None:
    assert NOTEBOOKS
