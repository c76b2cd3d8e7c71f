"""All files of a simulate study in its folder."""

from pathlib import Path

from thsa_cosim.report.page.pictures import write_pictures
from thsa_cosim.report.signal_files import write_signals
from thsa_cosim.simulate import SimulateResult


def write_simulate(result: SimulateResult, folder: Path) -> list[Path]:
    """Write the signals of a simulate study, whose result.json and CSV files are there; return all its files."""
    written = list(result.files)
    for recording in result.recordings:
        if recording.simulated is not None:
            simulated = recording.simulated.select(recording.measured.names)
            both = {"measured": recording.measured, "simulated": simulated}
            written.append(write_signals(folder, recording.role, recording.name, both))
    return [*written, *write_pictures(folder)]
