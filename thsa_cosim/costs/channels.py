"""What a worker sends back instead of whole signals: weighted residuals, or their cost terms.

Both are plain picklable objects; a worker receives them once per study with its experiments.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.costs.identification import error_terms
from thsa_cosim.inverse_dynamics import low_pass
from thsa_cosim.signals import FloatArray, Signals


@dataclass(frozen=True, eq=False)
class Channel:
    """One measured signal to be met: samples (n,) at ``time`` (n,) in s, in the FMU variable's unit.

    ``noise``: one standard deviation in that unit; ``weight`` multiplies the squared error. The samples
    outside the cost's window are left out beforehand. ``band``: Hz below which signals are compared, after the same
    filter without phase shift; ``measured`` has gone through it. ``fine``: the times (n·k,) of the samples, where
    ``time``, ``measured`` and ``noise`` are of the means of k neighbours.
    """

    name: str
    time: FloatArray
    measured: FloatArray
    noise: float
    weight: float = 1.0
    band: float | None = None
    fine: FloatArray | None = None

    @property
    def mean_of(self) -> int:
        """Number of samples that each value is the mean of."""
        return 1 if self.fine is None else self.fine.size // self.time.size

    def means(self, of: int) -> "Channel":
        """The same of the means of ``of`` neighbouring samples, simulated as measured; white noise is √of smaller.

        What is left over at the end is dropped; a channel of fewer than two means stays as it is. Of means, means of
        these.
        """
        count = self.time.size // of
        if of < 2 or count < 2:
            return self
        time, measured = (values[: count * of] for values in (self.time, self.measured))
        fine = self.time if self.fine is None else self.fine
        return replace(
            self,
            time=time.reshape(count, of).mean(axis=1),
            measured=measured.reshape(count, of).mean(axis=1),
            noise=self.noise / np.sqrt(of),
            fine=fine[: count * of * self.mean_of],
        )

    def residual(self, simulated: Signals) -> FloatArray:
        """√weight · (simulated - measured) / noise, (n,); linear between samples where times differ."""
        values = simulated[self.name]
        if self.band is not None:
            values = low_pass(values, self.band, float(np.mean(np.diff(simulated.time))))
        at = self.time if self.fine is None else self.fine
        if simulated.time.shape != at.shape or not np.array_equal(simulated.time, at):
            values = np.interp(at, simulated.time, values)
        if self.fine is not None:
            # A product takes a fifteenth of the time of ``mean`` over so short an axis.
            values = values.reshape(self.time.size, -1) @ np.full(self.mean_of, 1.0 / self.mean_of)
        return np.asarray((values - self.measured) * (np.sqrt(self.weight) / self.noise))


@dataclass(frozen=True, eq=False)
class ResidualReducer:
    """Signals → the residuals of all channels, one after the other (N,).

    ``single``: in single precision, which halves what travels and is kept; it errs by 6e-8 of each.
    """

    channels: tuple[Channel, ...]
    single: bool = False

    def __call__(self, simulated: Signals) -> NDArray[np.floating[Any]]:
        """Return the stacked residuals (N,), dimensionless."""
        residuals = [channel.residual(simulated) for channel in self.channels]
        return np.concatenate(residuals, dtype=np.float32 if self.single else np.float64)

    @property
    def lengths(self) -> tuple[int, ...]:
        """Samples per channel, in order."""
        return tuple(channel.measured.size for channel in self.channels)


@dataclass(frozen=True, eq=False)
class TermsReducer:
    """Signals → the cost term of each channel (c,), equation 6."""

    channels: tuple[Channel, ...]
    error: str = "squared"

    def __call__(self, simulated: Signals) -> FloatArray:
        """Return Σ f(residual) per channel (c,), dimensionless."""
        terms = error_terms({c.name: c.residual(simulated) for c in self.channels}, self.error)
        return np.array([terms[c.name] for c in self.channels])
