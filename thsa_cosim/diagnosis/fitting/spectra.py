"""Recordings compared by the magnitudes of short-time spectra: by what a machine does, not by when.

A machine that sticks and slips some hundred times a second takes up the phase of every cycle before. A model that is
off by a thousandth in its frequency is out of phase within a second, and its squared residuals have an optimum for
every cycle that it skips, as those of a seismic wave have (J. Virieux, S. Operto, Geophysics 74 (2009) WCC1). How often
and how widely it slips in a second changes smoothly with its parameters: so do magnitudes of spectra, without phase.
"""

import numpy as np

from thsa_cosim.costs.channels import Channel
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.trials import Part
from thsa_cosim.diagnosis.fitting.unknowns import Unknowns
from thsa_cosim.signals import FloatArray

#: Length of a window [s]. Set while looking at one simulated unit with a Stribeck friction at 166 Hz, of which 1 s had
#: the widest funnel, 0.1 s a rugged one.
SECONDS = 1.0
#: A window of fewer samples has no spectrum to speak of.
FEWEST = 16


class Spectra:
    """The recordings of ``bench`` by the magnitudes of their spectra: what a fit asks for, without the weights."""

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        self._measured: dict[Part, list[tuple[FloatArray, int, FloatArray]]] = {}

    def residuals(self, unknowns: Unknowns, vectors: FloatArray, part: Part) -> list[FloatArray | None]:
        """Per vector (m, n) what the magnitudes differ by (K,), None where a run failed.

        Each in standard deviations of what the sensors' white noise does to it where the signal exceeds that.
        """
        factors = self._bench.factors(part)
        return [
            None if r is None else self._apart(r / factors, part)
            for r in self._bench.residuals(unknowns, vectors, part)
        ]

    def level(self, part: Part) -> float:
        """Root mean square of what noise leaves: 1, since nothing is weighed."""
        return 1.0

    def size(self, part: Part) -> int:
        """How many magnitudes are compared, once some were."""
        return sum(magnitudes.size for _, _, magnitudes in self._measured[part])

    def _apart(self, residual: FloatArray, part: Part) -> FloatArray:
        """(K,) simulated less measured magnitudes, of the residuals (N,) of all signals."""
        if part not in self._measured:
            channels = [c for t in self._bench.of(part) for c in t.case.channels]
            self._measured[part] = [_measured(c) for c in channels]
        found, begin = [], 0
        for signal, length, magnitudes in self._measured[part]:
            end = begin + signal.size
            found.append(np.ravel(spectra_of(signal + residual[begin:end], length) - magnitudes))
            begin = end
        return np.concatenate(found)


def _measured(channel: Channel) -> tuple[FloatArray, int, FloatArray]:
    """A signal (n,) in standard deviations of its noise, the samples of a window, and its magnitudes."""
    signal = channel.measured * (np.sqrt(channel.weight) / channel.noise)
    step = float(channel.time[-1] - channel.time[0]) / max(1, channel.time.size - 1)
    length = min(signal.size, max(FEWEST, round(SECONDS / step)))
    return signal, length, spectra_of(signal, length)


def spectra_of(signal: FloatArray, length: int) -> FloatArray:
    """(windows, frequencies) magnitudes of ``signal`` (n,) in Hann windows of ``length`` samples that overlap by half.

    White noise of variance 1 has real and imaginary parts of variance 1.
    """
    window = np.hanning(length + 1)[:-1]
    parts = np.lib.stride_tricks.sliding_window_view(signal, length)[:: max(1, length // 2)]
    return np.asarray(np.abs(np.fft.rfft(parts * window)) / np.sqrt(0.5 * float(window @ window)))
