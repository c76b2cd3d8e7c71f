"""Channels weighed by what a model leaves in them, so that no channel's structure outshouts the others'.

The most likely parameters where the sizes of the residuals are unknown (L. Ljung, System Identification, 2nd edition,
section 7.4): a channel whose rms exceeds the noise counts as if that were its noise. Without it position, which sums
up every error of speed, decides alone as long as an effect is missing.
"""

from collections.abc import Mapping

import numpy as np

from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.fit import Fit, refine
from thsa_cosim.diagnosis.fitting.structure import rms_by_channel, structure
from thsa_cosim.diagnosis.fitting.trials import Part
from thsa_cosim.signals import FloatArray

#: Levels that differ by less than this factor are the same.
SAME = 1.2


class ChannelWeights:
    """The weights of a bench, and the declared model's held-out residuals ``base_held`` under them."""

    def __init__(self, bench: Bench) -> None:
        self.base_held: FloatArray = np.zeros(0)
        self._bench = bench

    def weigh(
        self, fit: Fit, iterations: int = 8, fresh: list[int] | None = None
    ) -> tuple[Fit, FloatArray | None]:
        """Weigh by what ``fit`` leaves: the fit under these weights, of so many iterations, and its held-out residuals.

        ``fresh``: which columns of the Jacobian are taken anew on the way (default: all).
        The weights stay as they are where the fit under new ones cannot be simulated on the held-out recordings.
        """
        bench, before, after = self._bench, self._bench.weights, {}
        for name, rms in rms_by_channel(bench.of("fit"), self.plain(fit.residual, "fit")).items():
            after[name] = 1.0 / max(1.0, rms)
        if any(not 1.0 / SAME < after[name] / before.get(name, 1.0) < SAME for name in after):
            factors = bench.factors("fit")
            self.take(after)
            jacobian = fit.jacobian_of(fit.unknowns, bench.factors("fit") / factors)
            again = refine(
                bench,
                fit.unknowns,
                fit.vector,
                jacobian=jacobian,
                steps=fit.steps,
                near=True,
                iterations=iterations,
                fresh=fresh,
            )
            moved = fit if again is None else again
            held = self._held(moved)
            if held is not None:
                return moved, held
            self.take(before)
        return fit, self._held(fit)

    def _held(self, fit: Fit) -> FloatArray | None:
        return self._bench.residuals(fit.unknowns, fit.vector[None, :], "validate")[0]

    def take(self, weights: Mapping[str, float]) -> None:
        """Have the bench weigh by ``weights``, by channel."""
        plain = self.plain(self.base_held, "validate") if self.base_held.size else self.base_held
        self._bench.weights = weights
        if plain.size:
            self.base_held = plain * self._bench.factors("validate")

    def plain(self, residual: FloatArray, part: Part) -> FloatArray:
        """``residual`` (N,) without the weights, in standard deviations of the noise."""
        return residual / self._bench.factors(part)

    def left(self, held: FloatArray) -> float:
        """Mean squared structure of held-out residuals (N,), in variances of the noise."""
        return structure(self._bench.of("validate"), self.plain(held, "validate")) / held.size
