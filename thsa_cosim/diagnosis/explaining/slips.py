"""Slips of signals that explain what an identified model leaves, as for an identification."""

from collections.abc import Mapping

from thsa_cosim.diagnosis.fitting.identified import Identified
from thsa_cosim.inspection import Finding, Inspection, Residual, misfits
from thsa_cosim.study import case_residuals


def with_slips(data: Inspection, identified: Identified, file_units: Mapping[str, str | None]) -> Inspection:
    """Return ``data`` with what one slip of one signal explains of the fit recordings, beyond what is known."""
    known = {(f.recording, f.channel, f.kind) for f in data.findings}
    found = [f for f in _slips(identified, file_units) if (f.recording, f.channel, f.kind) not in known]
    return Inspection.of((*data.findings, *found), data.repairs)


def _slips(identified: Identified, file_units: Mapping[str, str | None]) -> list[Finding]:
    jacobian, first = identified.fit.jacobian, 0
    residuals: list[Residual] = []
    for trial in identified.trials:
        if trial.part != "fit":
            continue
        simulated = identified.signals.get(trial.name)
        if simulated is None:
            return []  # which rows are whose is not known
        slopes = []
        for channel in trial.case.channels:
            rows = slice(first, first + channel.residual(simulated).size)
            slopes.append(jacobian[rows])
            first = rows.stop
        residuals += case_residuals(trial.case, simulated, slopes)
    return misfits(residuals, file_units) if first == jacobian.shape[0] else []
