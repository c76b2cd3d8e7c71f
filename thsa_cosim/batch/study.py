"""The temporary folder of one runner: each FMU unpacked once, each experiment written once."""

import pickle
from collections.abc import Sequence
from multiprocessing import spawn
from pathlib import Path
from typing import Any

from thsa_cosim.batch.job import Experiment
from thsa_cosim.batch.outcome import Outcome, Status
from thsa_cosim.batch.runner import by_name, check_experiment
from thsa_cosim.errors import FmuError, MachineError
from thsa_cosim.fmu.description import FmuDescription
from thsa_cosim.fmu.machine import refuse_noexec, temporary_fault
from thsa_cosim.fmu.scratch import ScratchFolder
from thsa_cosim.system import read_description, unpack
from thsa_cosim.system.description import SystemDescription


class Study:
    """Experiments made ready for workers that share a file system.

    ``folder``: fmus/<sha256>/ unpacked, experiments/<index>.pickle, workers/<number>/ (made by them).
    An FMU that cannot be read is no error here: ``failures`` holds the outcome of all its jobs. MachineError if
    the temporary folder cannot be used.
    """

    def __init__(self, experiments: Sequence[Experiment]) -> None:
        self.experiments = by_name(experiments)
        self.index = {name: i for i, name in enumerate(self.experiments)}
        self.descriptions: dict[str, FmuDescription | None] = {}
        self.failures: dict[str, Outcome] = {}
        self.main: dict[str, Any] | None = None
        self._made: list[Path] = []
        self._scratch = ScratchFolder()
        self.folder = self._scratch.path
        try:
            refuse_noexec(self.folder)
            self._prepare()
        except OSError as error:
            self.remove()
            raise temporary_fault(error, self.folder.parent) from None
        except BaseException:
            self.remove()
            raise

    def _prepare(self) -> None:
        (self.folder / "experiments").mkdir()
        read: dict[Path, FmuDescription | FmuError] = {}
        for name, experiment in self.experiments.items():
            path = Path(experiment.fmu)
            if path not in read:
                read[path] = self._unpack(path)
            found = read[path]
            if isinstance(found, FmuError):
                self.descriptions[name] = None
                self.failures[name] = Outcome(Status.BAD_ARCHIVE, str(found).rstrip("."))
                continue
            check_experiment(experiment, found)
            self.descriptions[name] = found
            data = pickle.dumps((experiment, found, str(self._fmu_folder(found))), pickle.HIGHEST_PROTOCOL)
            if b"__main__" in data and self.main is None:
                data_of_main = spawn.get_preparation_data("thsa-cosim worker")
                # Only what it takes to import the main module (the rest may not, or need not, travel).
                wanted = ("sys_argv", "init_main_from_name", "init_main_from_path")
                self.main = {key: data_of_main[key] for key in wanted if key in data_of_main}
            file = self.folder / "experiments" / f"{self.index[name]}.pickle"
            file.write_bytes(data)
            self._made += [file, *(p for p in self._fmu_folder(found).iterdir() if p.is_file())]

    def component(self, experiment: int, number: int) -> str:
        """Name the component of a system that was at work, as the end of a sentence; "" where it is no system."""
        name = next(n for n, i in self.index.items() if i == experiment)
        description = self.descriptions[name]
        if not isinstance(description, SystemDescription) or not number:
            return ""
        parts = description.system.components
        return f", in component {parts[number - 1].name}" if 0 < number <= len(parts) else ""

    def trouble(self) -> MachineError | None:
        """Say what is wrong with the temporary folder: gone, in part or whole, or nothing can be written."""
        probe = self.folder / "probe"
        try:
            for file in self._made:
                file.stat()
            probe.write_bytes(bytes(1 << 16))
            probe.unlink()
        except OSError as error:
            return temporary_fault(error, self.folder.parent)
        return None

    def _fmu_folder(self, description: FmuDescription) -> Path:
        return self.folder / "fmus" / description.sha256[:16]

    def _unpack(self, path: Path) -> FmuDescription | FmuError:
        try:
            description = read_description(path)
            folder = self._fmu_folder(description)
            if not folder.exists():
                unpack(path, folder)
        except FmuError as error:
            return error
        return description

    def remove(self) -> None:
        """Remove the folder."""
        self._scratch.remove()
