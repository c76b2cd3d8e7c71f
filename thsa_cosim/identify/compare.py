"""Simulated against measured: per recording and channel, and over all recordings of a role."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from thsa_cosim.costs import nrmse, rmse, signal_range
from thsa_cosim.identify.problem import Case
from thsa_cosim.identify.results import ChannelError, Comparison
from thsa_cosim.inspection import Residual
from thsa_cosim.recordings import Recording
from thsa_cosim.signals import FloatArray, Signals


def compare(case: Case, recording: Recording, role: str, simulated: Signals) -> Comparison:
    """Errors of every measured signal over all samples; a signal that is not fitted has its estimated noise."""
    measured = case.measured
    noise = {channel.name: channel.noise for channel in case.channels}
    on_samples = simulated.select(measured.names).resample(measured.time)
    errors = {}
    for name in measured.names:
        kept = recording.counted(name)
        errors[name] = ChannelError(
            rmse=rmse(measured[name][kept], on_samples[name][kept]),
            nrmse=nrmse(measured[name][kept], on_samples[name][kept]),
            noise=noise.get(name, recording.noise.get(name, 0.0)),
            unit=measured.units[name],
            samples=int(np.count_nonzero(kept)),
        )
    return Comparison(
        recording=case.name,
        role=role,
        temperature_degC=case.temperature_degC,
        measured=measured,
        simulated=on_samples,
        errors=errors,
    )


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
