"""Simulated against measured: per recording and signal, and over all recordings of a role."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from thsa_cosim.costs import nrmse, rmse, signal_range
from thsa_cosim.inspection import Residual
from thsa_cosim.recordings import Recording
from thsa_cosim.signals import FloatArray, Signals
from thsa_cosim.study.case import Case


@dataclass(frozen=True)
class ChannelError:
    """How well a measured signal is met: rmse and noise (1 σ) in ``unit``, nrmse over the measured range."""

    rmse: float
    nrmse: float
    noise: float
    unit: str
    samples: int


@dataclass(frozen=True)
class Comparison:
    """Measured and simulated signals of one recording, each channel (n,) in the FMU variable's unit."""

    recording: str
    role: str
    temperature_degC: float | None
    measured: Signals
    simulated: Signals
    errors: Mapping[str, ChannelError]


def compare(
    recording: Recording, role: str, names: Sequence[str], noise: Mapping[str, float], simulated: Signals
) -> Comparison:
    """Errors of the named signals over all samples after the lead-in that the simulation reached.

    ``noise``: 1 σ by signal; one that is not there has the recording's own estimate.
    """
    measured = reached(recording.compared.select(names), simulated)
    on_samples = simulated.select(names).resample(measured.time)
    errors = {}
    for name in names:
        kept = recording.counted(name)[: len(measured)]
        errors[name] = ChannelError(
            rmse=rmse(measured[name][kept], on_samples[name][kept]),
            nrmse=nrmse(measured[name][kept], on_samples[name][kept]),
            noise=noise.get(name, recording.noise.get(name, 0.0)),
            unit=measured.units[name],
            samples=int(np.count_nonzero(kept)),
        )
    return Comparison(recording.name, role, recording.temperature_degC, measured, on_samples, errors)


def reached(measured: Signals, simulated: Signals) -> Signals:
    """The samples of ``measured`` that a simulation came to."""
    end = simulated.time[-1] * (1.0 + 1e-12) + 1e-9
    return measured if measured.time[-1] <= end else measured.window(stop=end)


def compare_case(case: Case, recording: Recording, role: str, simulated: Signals) -> Comparison:
    """The same of a recording as a case, whose fitted signals have a noise."""
    noise = {channel.name: channel.noise for channel in case.channels}
    return compare(recording, role, case.measured.names, noise, simulated)


def case_residuals(
    case: Case, simulated: Signals, slopes: Sequence[FloatArray | None] = ()
) -> list[Residual]:
    """What a simulation leaves of each fitted signal, where it counts, with the inputs at the same samples.

    ``slopes``: per channel the rows (n, p) of the Jacobian of its weighted residual; without, no slip is looked for.
    """
    found = []
    for k, channel in enumerate(case.channels):
        inputs = case.inputs.resample(channel.time)
        values = channel.residual(simulated) / np.sqrt(channel.weight)
        own = slopes[k] if k < len(slopes) else None
        found.append(
            Residual(
                recording=case.name,
                channel=channel.name,
                values=values,
                noise=channel.noise,
                unit=case.measured.units.get(channel.name, "1"),
                inputs={name: inputs[name] for name in inputs.names},
                held=case.inputs.held,
            )
        )
        if own is not None:
            found[-1] = replace(
                found[-1],
                time=channel.time,
                simulated=channel.measured + values * channel.noise,
                slopes=own / np.sqrt(channel.weight),
            )
    return found


def summarise(comparisons: Sequence[Comparison]) -> dict[str, dict[str, ChannelError]]:
    """Errors per role and channel over all samples; nrmse relative to the range over all recordings."""
    summary: dict[str, dict[str, ChannelError]] = {"fit": {}, "validate": {}}
    for role, channels in summary.items():
        members = [c for c in comparisons if c.role == role]
        for name in members[0].errors if members else ():
            measured = np.concatenate([c.measured[name] for c in members])
            weights = np.array([c.errors[name].samples for c in members], dtype=np.float64)
            noises = np.array([c.errors[name].noise for c in members])
            errors = np.array([c.errors[name].rmse for c in members])
            error = float(np.sqrt(np.sum(weights * errors**2) / np.sum(weights)))
            span = signal_range(measured)
            channels[name] = ChannelError(
                rmse=error,
                nrmse=error / span if span > 0.0 else float("nan"),
                noise=float(np.sqrt(np.sum(weights * noises**2) / np.sum(weights))),
                unit=members[0].errors[name].unit,
                samples=int(np.sum(weights)),
            )
    return summary
