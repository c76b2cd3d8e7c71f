"""Several studies in a notebook: a folder's list, and what differs, as tables."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from thsa_cosim.errors import require

if TYPE_CHECKING:
    import pandas as pd


def list_studies(folder: Path | str = "studies") -> "pd.DataFrame":
    """Return the studies in ``folder`` and below, the latest first: index folder; kind, status, outcome, ….

    Raises InputError if there is no such folder.
    """
    require("pandas", "A table", "notebook")
    import pandas as pd

    from thsa_cosim.report.compare import list_studies as listed

    columns = ("kind", "status", "started", "scenario", "title", "outcome", "problem")
    entries = listed(Path(folder))
    rows = [{name: getattr(entry, name) for name in columns} for entry in entries]
    index = pd.Index([str(entry.folder) for entry in entries], name="folder")
    return pd.DataFrame(rows, index=index, columns=list(columns))


def compare(*folders: Path | str) -> "pd.DataFrame":
    """Return what differs between studies: index group, quantity, place; a study's value and stderr, and from the
    second on its difference from the first, that one's stderr, and z. ``attrs`` holds ``settings`` and ``notes``.

    Raises InputError as :func:`thsa_cosim.report.compare.compare`.
    """
    require("pandas", "A table", "notebook")
    import pandas as pd

    from thsa_cosim.report.compare import compare as compared

    found = compared([Path(folder) for folder in folders])
    rows: list[dict[tuple[str, str], Any]] = []
    for row in found.rows:
        cells: dict[tuple[str, str], Any] = {("", "unit"): row.unit}
        for k, (label, value, d) in enumerate(zip(found.labels, row.values, row.differences, strict=True)):
            cells[label, "value"] = math.nan if value is None else value.value
            cells[label, "stderr"] = math.nan if value is None else value.stderr
            if k:
                cells[label, "difference"] = math.nan if d is None else d.value
                cells[label, "stderr of the difference"] = math.nan if d is None else d.stderr
                cells[label, "z"] = math.nan if d is None else d.z
        rows.append(cells)
    index = pd.MultiIndex.from_tuples(
        [(r.group, r.name, r.at) for r in found.rows], names=["group", "quantity", "at"]
    )
    columns = pd.MultiIndex.from_tuples(list(rows[0]), names=["study", ""])
    table = pd.DataFrame([list(cells.values()) for cells in rows], index=index, columns=columns)
    table.attrs = {"settings": dict(found.settings), "notes": found.notes, "sentence": found.sentence()}
    return table
