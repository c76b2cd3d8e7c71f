"""All files of an identification in its study folder."""

from collections.abc import Callable
from pathlib import Path

from thsa_cosim.identify.results import IdentifyResult
from thsa_cosim.report.files import RESULT, write_json
from thsa_cosim.report.identify.friction import write_friction
from thsa_cosim.report.identify.result import (
    identify_to_dict,
    write_laws_csv,
    write_parameters_csv,
)
from thsa_cosim.report.page.pictures import write_pictures
from thsa_cosim.report.parameter_files import write_parameter_set
from thsa_cosim.report.signal_files import write_signals


def write_identify(
    result: IdentifyResult, folder: Path, on_file: Callable[[Path], None] | None = None
) -> list[Path]:
    """Write result.json, parameters.csv, laws.csv, the signals and the plots; return what was written, in order."""
    written: list[Path] = []

    def note(path: Path) -> None:
        written.append(path)
        if on_file is not None:
            on_file(path)

    write_json(folder / RESULT, identify_to_dict(result))
    note(folder / RESULT)
    if not result.points:
        return written
    write_parameters_csv(folder / "parameters.csv", result)
    note(folder / "parameters.csv")
    if result.laws:
        write_laws_csv(folder / "laws.csv", result)
        note(folder / "laws.csv")
    if result.parameter_set.values:
        for path in write_parameter_set(folder, result.parameter_set):
            note(path)
    temperatures = [p.temperature_degC for p in result.points if p.temperature_degC is not None]
    temperatures += [t for law in result.laws.values() for t in law.between or ()]
    if temperatures:
        for path in write_friction(folder, result.laws, min(temperatures), max(temperatures)):
            note(path)
    for comparison in result.comparisons:
        both = {"measured": comparison.measured, "simulated": comparison.simulated}
        note(write_signals(folder, comparison.role, comparison.recording, both))
    for path in write_pictures(folder):
        note(path)
    return written
