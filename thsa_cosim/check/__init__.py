"""What an FMU can be trusted with: read its description, then try it in worker processes.

``finding``   the lines of the report
``excitation`` what the FMU is given
``trials``    how each line comes about
``numerics``  what the numbers of a trial mean
"""

from collections.abc import Callable, Mapping
from pathlib import Path

from thsa_cosim.check.budget import TOTAL
from thsa_cosim.check.excitation import Excitation
from thsa_cosim.check.finding import CheckReport, Finding, Verdict
from thsa_cosim.check.trials import Trials
from thsa_cosim.errors import ParameterError
from thsa_cosim.fmu import FmuDescription, probe
from thsa_cosim.signals import FloatArray, Signals
from thsa_cosim.system import read_description

__all__ = ["CheckReport", "Excitation", "Finding", "Verdict", "check_fmu"]


def check_fmu(
    path: Path | str,
    *,
    values: Mapping[str, float] | None = None,
    inputs: Signals | None = None,
    time: FloatArray | None = None,
    excitation: Excitation | None = None,
    deadline_s: float = 30.0,
    limit_s: float = TOTAL,
    cycles: int = 50,
    on_finding: Callable[[Finding], None] | None = None,
) -> CheckReport:
    """Examine and try the FMU ``path``.

    Parameters
    ----------
    values
        Start values for all trials, by variable name, in the FMU's units.
    inputs, time
        Input signals and communication points (n,) s; default: the FMU's default experiment with inputs that run
        away from their start values, with kinks.
    excitation
        All of these and more (duration, step, interface); wins over them.
    deadline_s
        Wall time after which a run is killed, s.
    limit_s
        Wall time after which no further run is begun, s; a line says what was not tried. The first run is made
        in any case, so the check ends within about ``limit_s`` and one ``deadline_s``.
    cycles
        Runs over which memory and file handles are watched.
    on_finding
        Called with each line as soon as it is known.

    Raises
    ------
    FmuError, ParameterError
        If the file is no FMU at all, or lacks a variable that is named. An FMU that crashes, hangs or fails is a
        line of the report.
    """
    description = read_description(path)
    given = excitation or Excitation(dict(values or {}), inputs=inputs, time=time)
    _check_names(description, given)
    trials = Trials(description, given, deadline_s, on_finding, limit_s)
    trials.description_lines()
    if trials.first_run():
        trials.lines(cycles)
    return CheckReport(description.path, description.sha256, probe.facts(description), tuple(trials.findings))


def _check_names(description: FmuDescription, given: Excitation) -> None:
    for name in given.values:
        description.variable(name)
    movable = [v.name for v in probe.excitable(description)]
    for name in given.ends:
        if name not in movable:
            raise ParameterError(
                f"{description.path}: {description.variable(name).name} is no floating-point input; "
                f"those are {', '.join(movable) or 'none'}."
            )
