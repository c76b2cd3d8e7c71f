"""Studies by their kind: what was identified, tuned, simulated or diagnosed."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from thsa_cosim.api.study import RECORDING_COLUMNS, Study, frame
from thsa_cosim.errors import InputError, did_you_mean, require

if TYPE_CHECKING:
    import pandas as pd

    from thsa_cosim.laws import Law


class IdentifyStudy(Study):
    """What an identification found."""

    @property
    def parameters(self) -> "pd.DataFrame":
        """Index temperature [degC] (or the point's label) and parameter; value and stderr in ``unit``.

        ``identifiable`` is False, with a ``reason``, where the recordings do not determine the value.
        """

        wanted = ("value", "stderr", "unit", "identifiable", "reason", "lower", "upper")
        rows = {
            (_where(point), name): {key: estimate.get(key, "") for key in wanted}
            for point in self.result["points"]
            for name, estimate in point["parameters"].items()
        }
        return frame(rows, ["point", "parameter"], wanted)

    @property
    def laws(self) -> "pd.DataFrame":
        """Index parameter; form, coefficients (from α0 up, or α1, β1, α2, β2), published ones, deviation."""
        require("pandas", "A table", "notebook")
        import pandas as pd

        rows = {
            name: {
                "unit": law["unit"],
                "form": law["form"],
                "coefficients": tuple(law["coefficients"]),
                "published": tuple((law.get("published") or {}).get("coefficients", ())),
                "largest deviation": (law.get("largest_deviation") or {}).get("law", math.nan),
                "identifiable": law["identifiable"],
            }
            for name, law in self.result["laws"].items()
        }
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("parameter")

    def law(self, parameter: str) -> "Law":
        """Return the fitted law: call it with degC; InputError if the parameter has none."""
        import numpy as np

        from thsa_cosim.laws import Law

        laws = self.result["laws"]
        if parameter not in laws:
            why = next((f" {note}" for note in self.notes if note.startswith(f"{parameter} has no ")), "")
            raise InputError(
                f"{self.folder}: {parameter!r} has no law.{why or did_you_mean(parameter, laws)}"
            )
        content = laws[parameter]
        covariance = content.get("covariance")
        return Law(
            content["form"],
            tuple(content["coefficients"]),
            tuple(content.get("knots", ())),
            None if covariance is None else np.array(covariance, dtype=np.float64),
        )


class TuneStudy(Study):
    """What a tuning found."""

    @property
    def feasible(self) -> bool:
        """Whether the gains keep every hard requirement."""
        return bool(self.result["feasible"])

    @property
    def parameters(self) -> "pd.DataFrame":
        """The gains: index parameter; value after and before, unit."""
        require("pandas", "A table", "notebook")
        import pandas as pd

        before = (self.result["before"] or {}).get("gains", {})
        rows = {
            name: {"value": value, "before": before.get(name, math.nan), "unit": self.result["units"][name]}
            for name, value in self.result["gains"].items()
        }
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("parameter")

    @property
    def terms(self) -> "pd.DataFrame":
        """Terms of cost and requirements: one row a term, one column a set of gains, then its unit."""
        require("pandas", "A table", "notebook")
        import pandas as pd

        sets = {"before": self.result["before"], **self.result["compare"], "after": self.result["after"]}
        units = {"cost": "1", **self.result["term_units"]}
        columns: dict[str, Any] = {
            name: {term: found.get(term, math.nan) for term in units} for name, found in sets.items() if found
        }
        return pd.DataFrame({**columns, "unit": units}).rename_axis("term")

    @property
    def schedule(self) -> "pd.DataFrame":
        """Gains over the conditions, one row a node; empty if none was asked for."""
        require("pandas", "A table", "notebook")
        import pandas as pd

        return pd.DataFrame(self.result.get("schedule") or [])

    def _rank(self, name: str) -> int:
        """The search comes last: a tuning is about the responses."""
        return 99 if name == "convergence" else super()._rank(name)


class SimulateStudy(Study):
    """How well an FMU follows recordings as it is."""


class DiagnoseStudy(Study):
    """Which effect a recording shows that the model does not have."""

    @property
    def verdict(self) -> str:
        """``missing-effect``, ``no-missing-effect``, ``unexplained-structure`` or ``not-tested``."""
        return str(self.result["verdict"])

    @property
    def recordings(self) -> "pd.DataFrame":
        """As of every study, of the extended model; of the declared one where no effect was added."""
        from thsa_cosim.costs import signal_range

        after, before = (self.result[key].get("recordings", {}) for key in ("after", "before"))
        errors, rows = after or before, {}
        for file in self.files.values():
            own = errors.get(file.name) or errors.get(f"{file.role}/{file.name}", {})
            for signal, error in own.items():
                span = signal_range(file.channels[signal]["measured"])
                rows[file.role, file.name, signal] = {
                    "rmse": error["rmse"],
                    "noise": error["noise"],
                    "rmse / noise": error["rmse"] / error["noise"] if error["noise"] else math.nan,
                    "nrmse": error["rmse"] / span if span else math.nan,
                    "unit": file.units.get(signal, "1"),
                }
        return frame(rows, ["role", "recording", "signal"], RECORDING_COLUMNS)

    @property
    def effects(self) -> "pd.DataFrame":
        """Index effect and parameter; value and stderr in ``unit``, whether the data determine it, the probability."""

        rows = {
            (effect["name"], name): {
                "value": estimate["value"],
                "stderr": estimate.get("stderr"),
                "unit": estimate["unit"],
                "identifiable": estimate.get("identifiable", True),
                "probability": effect.get("probability"),
            }
            for effect in self.result["effects"]
            for name, estimate in effect["parameters"].items()
        }
        return frame(
            rows, ["effect", "parameter"], ("value", "stderr", "unit", "identifiable", "probability")
        )

    @property
    def held_out(self) -> "pd.DataFrame":
        """Errors of the recordings that no fit touched: index signal; rmse before and after, noise."""
        require("pandas", "A table", "notebook")
        import pandas as pd

        before, after = ((self.result[key] or {}).get("validate", {}) for key in ("before", "after"))
        rows = {
            signal: {
                "before": error["rmse"],
                "after": after.get(signal, {}).get("rmse", math.nan),
                "noise": error["noise"],
            }
            for signal, error in before.items()
        }
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("signal")


def open_study(folder: Path | str) -> Study:
    """Open the study in ``folder``; its class follows from its kind.

    Raises
    ------
    InputError
        If the folder holds no result (yet), or one that cannot be read.
    """
    from thsa_cosim.api.conduct import KINDS

    path = Path(folder) / "result.json"
    try:
        result = json.loads(path.read_text(encoding="utf-8"))
        kind = KINDS[result["kind"]].study
    except OSError as error:
        raise InputError(
            f"{folder} holds no result of a study ({error.strerror}); run its command first."
        ) from None
    except (ValueError, KeyError, TypeError):
        raise InputError(f"{path} is no result of this version; repeat the study's command.") from None
    return kind(Path(folder), result)


def _where(point: Mapping[str, Any]) -> Any:
    temperature = point["temperature_degC"]
    return point.get("label", "all") if temperature is None else temperature
