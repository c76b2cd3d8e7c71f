"""What every study folder says, as tables and figures."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from thsa_cosim.errors import InputError, did_you_mean, require

if TYPE_CHECKING:
    import pandas as pd

    from thsa_cosim.report.parts.content import Figure
    from thsa_cosim.report.parts.drawing import Drawing
    from thsa_cosim.report.signal_files import SignalFile

#: Columns of :attr:`Study.recordings`.
RECORDING_COLUMNS = ("rmse", "noise", "rmse / noise", "nrmse", "unit")


@dataclass(frozen=True, eq=False)
class Study:
    """A finished or interrupted study; ``result`` is the content of its result.json.

    Tables are pandas objects; units stand in a column ``unit`` or in brackets behind a name.
    """

    folder: Path
    result: Mapping[str, Any]

    @property
    def kind(self) -> str:
        """``identify``, ``tune``, ``simulate`` or ``diagnose``."""
        return str(self.result["kind"])

    @property
    def title(self) -> str:
        """The scenario's title."""
        return str(self.result.get("title") or self.folder.name)

    @property
    def status(self) -> str:
        """``complete`` or ``interrupted``; the same call continues an interrupted study."""
        return str(self.result["status"])

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader of the numbers should know."""
        return tuple(self.result.get("notes", ()))

    @property
    def failures(self) -> "pd.Series[int]":
        """Failed simulations by reason."""
        require("pandas", "A table", "notebook")
        import pandas as pd

        return pd.Series(dict(self.result.get("failures", {})), dtype="int64", name="simulations")

    @property
    def recordings(self) -> "pd.DataFrame":
        """How well each signal is met: index role, recording, signal; rmse and noise in ``unit``.

        ``rmse / noise`` is 1 where only the sensor's noise is left; ``nrmse`` is relative to the measured range.
        """

        rows = {
            (part["role"], part["name"], signal): {
                "rmse": error["rmse"],
                "noise": error["noise"],
                "rmse / noise": error["rmse"] / error["noise"] if error["noise"] else math.nan,
                "nrmse": error["nrmse"],
                "unit": error["unit"],
            }
            for part in self.parts("recordings")
            for signal, error in part["error"].items()
        }
        return frame(rows, ["role", "recording", "signal"], RECORDING_COLUMNS)

    def signals(self, recording: str) -> "pd.DataFrame":
        """Signals of a recording: index time [s], columns (signal [unit], measured or simulated).

        Raises InputError for a recording that the study does not hold.
        """
        require("pandas", "A table", "notebook")
        import pandas as pd

        found = self._file(recording)
        columns = {
            (f"{name} [{found.units.get(name, '1')}]", variant): values
            for name, variants in found.channels.items()
            for variant, values in variants.items()
        }
        frame = pd.DataFrame(columns, index=pd.Index(found.time, name="time [s]"))
        frame.columns = frame.columns.set_names(["signal", "source"])
        return frame

    @property
    def journal(self) -> "pd.DataFrame":
        """Every vector that was evaluated, in order; empty for a study without a search."""
        require("pandas", "A table", "notebook")
        import pandas as pd

        files = sorted({*self.folder.glob("journal.csv"), *self.folder.glob("*/journal.csv")})
        return pd.concat([pd.read_csv(file) for file in files]) if files else pd.DataFrame()

    @property
    def plots(self) -> tuple[str, ...]:
        """What :meth:`plot` can draw: the figures of the study's page, the most telling first."""
        return tuple(self._figures)

    def plot(self, what: str | None = None) -> "Drawing":
        """Draw one of ``plots`` (without a name the first), such as a recording; return a matplotlib figure.

        Raises InputError if there is nothing of that name.
        """
        require("matplotlib", "A plot", "notebook")
        from thsa_cosim.report.parts.drawing import draw

        known = self._figures
        if not known:
            raise InputError(f"{self.folder}: the study holds nothing to draw; let it finish first.")
        name = self.plots[0] if what is None else what
        if name not in known:
            hint = did_you_mean(name, known) or f" There are {', '.join(known)}."
            raise InputError(f"{self.folder}: there is no plot {name!r}.{hint}")
        return draw(known[name])

    @cached_property
    def _figures(self) -> "Mapping[str, Figure]":
        """The page's figures by the names of recordings and laws, else by their own, in the order of ``_rank``."""
        from thsa_cosim.report.page.pictures import pictures
        from thsa_cosim.report.signal_files import file_name

        found = pictures(self.folder)
        names = {name: name.removeprefix("law-") for name in found}
        for key, file in self.files.items():
            own = f"{file_name(file.role)}-{file_name(file.name)}"
            names |= {name: key for name in found if name == own or name.endswith(f"-{own}")}
        return {names[name]: found[name] for name in sorted(found, key=self._rank)}

    def _rank(self, name: str) -> int:
        """Where a figure stands among all: what was found, the search, recordings, the rest."""
        order = ("evidence", "laws", "law-", "schedule", "convergence", "fit-", "validate-", "response-")
        return next((k for k, start in enumerate(order) if name.startswith(start)), len(order))

    def report(self) -> Path:
        """Write the study's HTML page; return its path."""
        from thsa_cosim.report.page import write_page

        return write_page(self.folder)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.title!r}, {self.status}, in {str(self.folder)!r}>"

    def parts(self, key: str) -> list[Any]:
        """The entries of a list in result.json, of all stages."""
        stages = self.result.get("stages", {}).values()
        return [entry for part in (stages or (self.result,)) for entry in part.get(key, [])]

    @cached_property
    def files(self) -> Mapping[str, "SignalFile"]:
        """Files of signals by the recording's name; with its role where two share a name."""
        from thsa_cosim.report.signal_files import read_signals, signal_paths

        folders = [self.folder, *sorted(p.parent for p in self.folder.glob("*/signals"))]
        found = [read_signals(path) for folder in folders for path in signal_paths(folder)]
        names = [file.name for file in found]
        return {f.name if names.count(f.name) == 1 else f"{f.role}/{f.name}": f for f in found}

    def _file(self, recording: str) -> "SignalFile":
        if recording not in self.files:
            hint = did_you_mean(recording, self.files) or f" It holds {', '.join(self.files) or 'none'}."
            raise InputError(f"{self.folder}: the study holds no recording {recording!r}.{hint}")
        return self.files[recording]


def frame(
    rows: Mapping[tuple[Any, ...], Mapping[str, Any]], names: list[str], columns: Sequence[str]
) -> "pd.DataFrame":
    """A table of ``rows`` over an index of ``names``; without rows it has its columns still."""
    require("pandas", "A table", "notebook")
    import pandas as pd

    index = pd.MultiIndex.from_tuples(list(rows) or [("",) * len(names)], names=names)
    return pd.DataFrame(list(rows.values()), index=index if rows else index[:0], columns=list(columns))
