"""Defects as benches make them, put into one channel with a random generator: (n,) samples in, (n,) samples out."""

from collections.abc import Callable

import numpy as np
from numpy.random import Generator
from scipy.interpolate import CubicSpline
from scipy.signal import resample_poly

from thsa_cosim.recordings import noise_estimate
from thsa_cosim.signals import FloatArray

Damage = Callable[[FloatArray, FloatArray, Generator], FloatArray]
DEFECTS: dict[str, tuple[Damage, frozenset[str]]] = {}
"""By name: what is done to (time, values), and the kinds of finding that name it."""


def defect(*kinds: str) -> Callable[[Damage], Damage]:
    def put(damage: Damage) -> Damage:
        DEFECTS[damage.__name__] = (damage, frozenset(kinds))
        return damage

    return put


@defect("held-samples")
def held(time: FloatArray, x: FloatArray, rng: Generator) -> FloatArray:
    period = rng.choice([2, 3, 5, 8, 20, 10 / 3, 2.5])
    return x[np.ceil(np.floor(np.arange(x.size) / period) * period).astype(int).clip(0, x.size - 1)]


@defect("interpolated-samples")
def upsampled(time: FloatArray, x: FloatArray, rng: Generator) -> FloatArray:
    knots = np.arange(0, x.size, rng.choice([2, 3, 5, 8]))
    return np.interp(np.arange(x.size), knots, x[knots])


@defect("spikes")
def few_spikes(time: FloatArray, x: FloatArray, rng: Generator) -> FloatArray:
    x, where = x.copy(), rng.choice(x.size - 20, 8, replace=False) + 10
    x[where] += rng.choice([-1, 1], 8) * rng.uniform(15, 40) * noise_estimate(x)
    return x


@defect("spikes")
def many_spikes(time: FloatArray, x: FloatArray, rng: Generator) -> FloatArray:
    hit = rng.random(x.size) < 0.03
    return x + hit * rng.normal(0, 25, x.size) * noise_estimate(x)


@defect("dropouts", "spikes")
def dropouts(time: FloatArray, x: FloatArray, rng: Generator) -> FloatArray:
    return np.where(rng.random(x.size) < 0.02, 0.0, x)


@defect("sentinel", "spikes")
def sentinels(time: FloatArray, x: FloatArray, rng: Generator) -> FloatArray:
    x = x.copy()
    x[rng.choice(x.size, rng.integers(1, 30), replace=False)] = rng.choice([65535.0, -9999.0, 32767.0, 1e6])
    return x


@defect("clipped")
def clipped(time: FloatArray, x: FloatArray, rng: Generator) -> FloatArray:
    return np.minimum(x, np.quantile(x, rng.uniform(0.8, 0.95)))


@defect("stuck")
def stuck(time: FloatArray, x: FloatArray, rng: Generator) -> FloatArray:
    x, first = x.copy(), rng.integers(x.size // 4, x.size // 2)
    x[first : first + rng.integers(x.size // 20, x.size // 3)] = x[first]
    return x


@defect("repeated")
def repeated(time: FloatArray, x: FloatArray, rng: Generator) -> FloatArray:
    x, n = x.copy(), x.size // 12
    source, target = rng.integers(0, x.size // 3), rng.integers(x.size // 2, x.size - n - 1)
    x[target : target + n] = x[source : source + n]
    return x


@defect("coarse-resolution")
def coarse(time: FloatArray, x: FloatArray, rng: Generator) -> FloatArray:
    step = max(np.ptp(x) / rng.integers(12, 40), 4.0 * noise_estimate(x))
    return np.round(x / step) * step


@defect("hum")
def hum(time: FloatArray, x: FloatArray, rng: Generator) -> FloatArray:
    amplitude = rng.uniform(1.0, 6.0) * noise_estimate(x)
    return x + amplitude * np.sin(
        2.0 * np.pi * rng.choice([50.0, 60.0, 100.0, 400.0]) * time + rng.uniform(0, 6)
    )


@defect("unequal-noise")
def noisy_end(time: FloatArray, x: FloatArray, rng: Generator) -> FloatArray:
    late = np.arange(x.size) > rng.integers(x.size // 2, 3 * x.size // 4)
    return x + late * rng.normal(0, rng.uniform(2.5, 6.0) * noise_estimate(x), x.size)


@defect("interpolated-samples")
def upsampled_by_a_spline(time: FloatArray, x: FloatArray, rng: Generator) -> FloatArray:
    knots = np.arange(0, x.size, rng.choice([3, 4]))
    return CubicSpline(knots, x[knots])(np.arange(x.size))


@defect("interpolated-samples")
def upsampled_by_a_filter(time: FloatArray, x: FloatArray, rng: Generator) -> FloatArray:
    factor = int(rng.choice([3, 4]))
    fine = resample_poly(x[::factor] - x[0], factor, 1) + x[0]
    return fine[: x.size]


@defect("held-samples")
def held_at_no_fixed_rate(time: FloatArray, x: FloatArray, rng: Generator) -> FloatArray:
    fresh = np.cumsum(rng.integers(3, 8, x.size))
    index = np.zeros(x.size, dtype=int)
    index[fresh[fresh < x.size]] = fresh[fresh < x.size]
    return x[np.maximum.accumulate(index)]


@defect("held-samples")
def held_from_the_middle_on(time: FloatArray, x: FloatArray, rng: Generator) -> FloatArray:
    held = x[np.arange(x.size) // 8 * 8]
    return np.where(np.arange(x.size) < x.size // 2, x, held)


@defect("dropouts")
def packets_lost(time: FloatArray, x: FloatArray, rng: Generator) -> FloatArray:
    x = x.copy()
    for first in rng.choice(x.size - 40, x.size // 150, replace=False) + 1:
        x[first : first + rng.integers(8, 20)] = x[first - 1]
    return x


@defect("unequal-noise")
def noise_that_grows(time: FloatArray, x: FloatArray, rng: Generator) -> FloatArray:
    return x + np.linspace(0.0, rng.uniform(4.0, 8.0), x.size) * rng.normal(0.0, noise_estimate(x), x.size)
