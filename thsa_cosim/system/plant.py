"""One way in for FMUs and systems of FMUs."""

import shutil
import tempfile
import zipfile
from pathlib import Path
from typing import Any

from thsa_cosim.fmu.archive import sha256_of
from thsa_cosim.fmu.archive import unpack as unpack_fmu
from thsa_cosim.fmu.description import FmuDescription
from thsa_cosim.fmu.description import read_description as read_fmu
from thsa_cosim.fmu.instance import Instance
from thsa_cosim.fmu.plant import Plant
from thsa_cosim.system.description import SystemDescription, describe_system
from thsa_cosim.system.instance import SystemInstance
from thsa_cosim.system.ssp import ROOT, component_fmus, is_ssp, read_ssp


def read_description(path: Path | str) -> FmuDescription:
    """Read what an FMU, or an SSP as a whole, says about itself; FmuError in one sentence if it is neither."""
    path = Path(path)
    if not is_ssp(path):
        return read_fmu(path)
    with tempfile.TemporaryDirectory(prefix="thsa-cosim-system-") as folder:
        fmus = component_fmus(path, Path(folder))
    archive = read_ssp(path, fmus)
    return describe_system(archive.system, path, sha256_of(path), archive.experiment)


def unpack(path: Path, folder: Path) -> Path:
    """Unpack an FMU, or every component of an SSP into ``components/<name>`` of its own, and return ``folder``."""
    if not is_ssp(path):
        return unpack_fmu(path, folder)
    archives = folder / "archives"
    fmus = component_fmus(path, archives)
    for component in read_ssp(path, fmus).system.components:
        # A copy each: two instances of one FMU get a library, and so global variables, of their own.
        unpack_fmu(archives / component.source, folder / "components" / component.name)
    shutil.rmtree(archives)
    with zipfile.ZipFile(path) as archive:
        archive.extract(ROOT, folder)
    return folder


class SystemPlant(Plant):
    """An opened system of FMUs; used like a :class:`Plant`."""

    _read = staticmethod(read_description)
    _unpack = staticmethod(unpack)

    def _new_instance(self) -> Instance:
        assert isinstance(self.description, SystemDescription)
        return SystemInstance(self.folder, self.description, self.kind, self._on_message, self.progress)


def open_plant(description: FmuDescription, folder: Path, **options: Any) -> Plant:
    """Open what ``unpack`` has put into ``folder``; options as of :class:`Plant`."""
    cls = SystemPlant if isinstance(description, SystemDescription) else Plant
    if cls is SystemPlant:
        options["kind"] = None
    return cls(description, folder, **options)
