"""What an FMU can be trusted with: read its description, then try it in worker processes.

``finding``  the lines of the report
``trials``   how each line comes about
"""

from collections.abc import Callable, Mapping
from pathlib import Path

from thsa_cosim.check.finding import CheckReport, Finding, Verdict
from thsa_cosim.check.trials import Trials
from thsa_cosim.fmu import probe
from thsa_cosim.signals import FloatArray, Signals
from thsa_cosim.system import read_description

__all__ = ["CheckReport", "Finding", "Verdict", "check_fmu"]


def check_fmu(
    path: Path | str,
    *,
    values: Mapping[str, float] | None = None,
    inputs: Signals | None = None,
    time: FloatArray | None = None,
    deadline_s: float = 30.0,
    cycles: int = 50,
    on_finding: Callable[[Finding], None] | None = None,
) -> CheckReport:
    """Examine and try the FMU ``path``.

    Parameters
    ----------
    values
        Start values for all trials, by variable name, in the FMU's units.
    inputs, time
        Input signals and communication points (n,) s; default: the FMU's default experiment with inputs at
        their start values, or ramping away from them where nothing moves otherwise.
    deadline_s
        Wall time after which a run is killed, s.
    cycles
        Runs over which memory and file handles are watched.
    on_finding
        Called with each line as soon as it is known.

    Raises
    ------
    FmuError
        If the file is no FMU at all. An FMU that crashes, hangs or fails is a line of the report.
    """
    description = read_description(path)
    trials = Trials(description, dict(values or {}), inputs, time, deadline_s, on_finding)
    trials.description_lines()
    if trials.first_run():
        runs_changed = trials.fresh_lines(cycles)
        trials.reset_lines(cycles, runs_changed)
        trials.exchange_line()
    return CheckReport(description.path, description.sha256, probe.facts(description), tuple(trials.findings))
