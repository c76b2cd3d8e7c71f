"""What a scenario simulates, opened: an FMU, an SSP archive, or the system of its own tables."""

import zipfile
from pathlib import Path

from thsa_cosim.errors import ScenarioError
from thsa_cosim.fmu import FmuDescription
from thsa_cosim.scenario.system_schema import ModelTable
from thsa_cosim.system import read_description
from thsa_cosim.system.assemble import Part, Wire, assembled, system_folder
from thsa_cosim.system.description import SystemDescription


def open_model(
    path: Path, table: ModelTable, replaced_by: FmuDescription | Path | str | None = None
) -> FmuDescription:
    """Return the description of what the scenario ``path`` runs; ``replaced_by``: an FMU or system instead.

    Raises ScenarioError or FmuError in one sentence.
    """
    if isinstance(replaced_by, FmuDescription):
        return replaced_by
    if replaced_by is not None:
        return _compiled(read_description(replaced_by), table)
    if table.fmu:
        return _compiled(read_description(path.parent / table.fmu), table)
    return _compiled(assemble_tables(path, table), table)


def assemble_tables(path: Path, table: ModelTable) -> SystemDescription:
    """Return the system that the tables of the scenario ``path`` describe, kept as an archive."""
    parts = [
        Part(
            name=c.name,
            fmu=path.parent / c.fmu,
            execution=c.execution,
            step=c.step,
            delay=c.delay,
            jitter=c.jitter,
            process=c.process,
            start={k: float(v) for k, v in c.start.items()},
        )
        for c in table.components
    ]
    names = [part.name for part in parts]
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise ScenarioError(f"components: two are named {twice!r}; give each its own name.")
    wires = [
        Wire(c.source, c.target, c.factor, c.offset, c.convert, c.disturbance or "")
        for c in table.connections
    ]
    pins = {name: [given] if isinstance(given, str) else given for name, given in table.connectors.items()}
    return assembled(path.stem, parts, wires, pins, table.coupling_tolerance)


def _compiled(description: FmuDescription, table: ModelTable) -> FmuDescription:
    """An FMU or a system as it is run: a system that can be merged into one FMU as that FMU."""
    if not isinstance(description, SystemDescription) or not table.merge:
        return description
    from thsa_cosim.export.merge import NotMergeable, merge

    with zipfile.ZipFile(description.path) as archive:
        parts = {c.source: archive.read(c.source) for c in description.system.components}
    try:
        return read_description(merge(description, parts, system_folder() / "merged"))
    except NotMergeable:
        return description
