"""The order of a ripple from the force that keeps the model in step: a disturbance observer.

Where cogging makes a shaft stick and slip, the free run says little of it. In step with the measured speed, the
injected force is what the model lacks at that place, and over the shaft's angle it repeats with the ripple's order
(K. Ohnishi, M. Shibata, T. Murakami, IEEE/ASME Transactions on Mechatronics 1 (1996) 56).
"""

from collections.abc import Sequence

import numpy as np

from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.fit import Fit
from thsa_cosim.diagnosis.fitting.following import MEANS, Followed
from thsa_cosim.signals import FloatArray

#: Periods per revolution that are looked for.
ORDERS = np.arange(1.0, 145.0)
#: The force is taken about its mean over so many samples.
WINDOW = 101
#: Only samples count where the shaft turns slowly, between these shares of its largest speed, and so many of them: a
#: torque that makes it stick is as large there as at speed, an error of the speed's sensor is not.
MOVING, SLOW, FEWEST = 0.01, 0.25, 500


def order_in_step(bench: Bench, followed: Followed, gain: float, fit: Fit) -> tuple[float, float]:
    """Periods per revolution of what ``fit`` lacks at the followed place, and the share of the force they make up."""
    runs = bench.signals(fit.unknowns, fit.vector)
    speeds, forces, times = [], [], []
    for trial in bench.of("fit"):
        run = runs[trial.name]
        if run is not None:
            inputs = trial.case.inputs
            measured = np.interp(run.time, inputs.time, inputs[followed.slot.measured])
            times.append(run.time)
            speeds.append(measured)
            forces.append(gain * (run[followed.channel] - measured))
    shares = order_shares(times, speeds, forces)
    best = int(np.argmax(shares))
    return float(ORDERS[best]), float(shares[best])


def order_shares(
    times: Sequence[FloatArray], speeds: Sequence[FloatArray], forces: Sequence[FloatArray]
) -> FloatArray:
    """Share of the forces' power, about their running mean, that each of `ORDERS` makes up; 0 where too few samples.

    Per recording: s, rad/s, and the force, (n,) each. Each recording has a phase of its own.
    """
    repeated, power, count = (np.zeros(ORDERS.size) for _ in range(3))
    largest = max((float(np.max(np.abs(speed))) for speed in speeds), default=0.0)
    for time, speed, force in zip(times, speeds, forces, strict=True):
        if time.size <= WINDOW:
            continue
        angle = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time))])
        rest = force - np.convolve(force, np.ones(WINDOW) / WINDOW, "same")
        turn = np.abs(np.gradient(angle)) * MEANS
        mean = np.convolve(np.abs(speed), np.ones(WINDOW) / WINDOW, "same")
        moves = (mean > MOVING * largest) & (mean < SLOW * largest)
        for k, order in enumerate(ORDERS):
            own = moves & (order * turn < 0.5 * np.pi)
            part = rest[own]
            if part.size:
                wave = np.sum(part * np.exp(-1j * order * angle[own]))
                repeated[k] += 2.0 * float(np.abs(wave)) ** 2 / part.size
                power[k] += float(part @ part)
                count[k] += part.size
    return np.where(count >= FEWEST, repeated / np.maximum(power, 1e-300), 0.0)
