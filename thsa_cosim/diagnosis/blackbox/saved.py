"""A wrapper with its values as a file, and an FMU run with it."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from thsa_cosim.closing import Closing
from thsa_cosim.diagnosis.blackbox.drive import Drive
from thsa_cosim.diagnosis.blackbox.wrapper import EffectWrapper, Term
from thsa_cosim.errors import ScenarioError
from thsa_cosim.fmu import Plant
from thsa_cosim.scenario import BlackBoxSpec
from thsa_cosim.signals import FloatArray, Signals

WRAPPER = "wrapper.json"


def write_wrapper(folder: Path, fmu: Path, wrapper: EffectWrapper, values: Mapping[str, float]) -> Path:
    """Write ``wrapper.json``: the FMU, and of the wrapper what acts at ``values`` (by name), with these values."""
    terms = [t for t in wrapper.terms if t.acts(values)]
    content = {
        "fmu": str(fmu),
        "signals": wrapper.signals.model_dump(),
        "drive": wrapper.drive.to_dict(),
        "effects": [
            {**{k: v for k, v in asdict(t).items() if k != "starts"}, "parameters": t.values(values)}
            for t in terms
        ],
        "catalogue": None if wrapper.catalogue is None else str(wrapper.catalogue),
    }
    path = folder / WRAPPER
    path.write_text(json.dumps(content, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    return path


def read_wrapper(path: Path) -> tuple[Path, EffectWrapper]:
    """The FMU that ``wrapper.json`` names, and the wrapper, whose parameters start at the values found.

    ScenarioError if the file is not one of ours.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        terms = tuple(_term(t) for t in content["effects"])
        own = content["catalogue"]
        wrapper = EffectWrapper(
            BlackBoxSpec(**content["signals"]),
            Drive(**content["drive"]),
            terms,
            None if own is None else Path(own),
        )
        return Path(content["fmu"]), wrapper
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ScenarioError(
            f"{path} is no {WRAPPER} of a diagnosis ({type(error).__name__}: {error})."
        ) from None


def _term(content: Mapping[str, Any]) -> Term:
    rest = {key: content[key] for key in ("place", "effect", "block", "prefix", "neutral")}
    return Term(**rest, starts=content["parameters"])


class WrappedPlant(Closing):
    """An FMU with the effects that a diagnosis put around it; used like `Plant`, as a context manager."""

    def __init__(self, plant: Plant, wrapper: EffectWrapper) -> None:
        self.plant = plant
        self.wrapper = wrapper

    @classmethod
    def open(cls, path: Path | str, *, fmu: Path | str | None = None) -> "WrappedPlant":
        """Open ``wrapper.json`` and its FMU, or ``fmu`` in place of that.

        Raises ScenarioError if the file is not one of ours, FmuError if the FMU cannot be used.
        """
        named, wrapper = read_wrapper(Path(path))
        return cls(Plant.open(named if fmu is None else fmu), wrapper)

    def run(
        self,
        values: Mapping[str, float],
        inputs: Signals | None,
        outputs: Sequence[str],
        time: FloatArray,
        *,
        tolerance: float | None = None,
    ) -> Signals:
        """As `Plant.run`; ``values`` may also set the wrapper's parameters, which else are as found."""
        return self.wrapper.run(self.plant.run, values, inputs, outputs, time, tolerance)

    def close(self) -> None:
        """Close the FMU."""
        self.plant.close()
