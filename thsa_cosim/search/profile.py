"""Profile likelihood: how the least cost grows when one parameter is held off its estimate.

Unlike a standard error it does not assume that the cost is a parabola (Raue et al., Bioinformatics 25, 2009).
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.search.differences import Residuals
from thsa_cosim.search.polish import PolishSettings, polish

FloatArray = NDArray[np.float64]

#: 95 % point of the chi-square distribution with one degree of freedom.
CHI2_95 = 3.841458820694124
#: Where the profile is evaluated, in standard errors off the estimate, outwards on both sides.
OFFSETS = (0.5, 1.0, 1.5, 2.0, 3.0)


@dataclass(frozen=True)
class Profile:
    """Least cost ``costs`` (k,) with the parameter held at ``positions`` (k,) in the unit cube, ascending.

    ``lower`` and ``upper``: ends of the 95 % interval, NaN on a side on which the cost does not rise enough
    within three standard errors or the bounds.
    """

    positions: FloatArray
    costs: FloatArray
    lower: float
    upper: float


def profile(
    evaluate: Residuals,
    best: FloatArray,
    index: int,
    stderr: float,
    threshold: float,
    settings: PolishSettings,
) -> Profile:
    """Profile the cost over direction ``index`` of ``best`` (n,), both in the unit cube.

    ``threshold`` is the rise of the cost that ends the interval: CHI2_95 for white noise of the stated size,
    more where residuals are larger or correlated. Each side starts from its neighbour's optimum.
    """
    settings = replace(settings, final_jacobian=False)
    others = [i for i in range(best.size) if i != index]
    centre = evaluate(best[None, :])[0]
    if centre is None:
        raise ValueError("the estimate itself cannot be simulated.")
    found: dict[float, float] = {float(best[index]): float(centre @ centre)}
    for sign in (-1.0, 1.0):
        free = best[others]
        for offset in OFFSETS:
            held = float(np.clip(best[index] + sign * offset * stderr, 0.0, 1.0))
            if held in found:
                break

            def residuals(vectors: FloatArray, held: float = held) -> list[FloatArray | None]:
                whole = np.insert(vectors, index, held, axis=1)
                return list(evaluate(whole))

            if others:
                result = polish(residuals, free, settings)
                residual, free = result.residual, result.best
            else:
                residual = evaluate(np.array([[held]]))[0]
            if residual is None:
                break
            found[held] = float(residual @ residual)
    positions = np.array(sorted(found))
    costs = np.array([found[p] for p in positions.tolist()])
    limit = float(centre @ centre) + threshold
    at = int(np.flatnonzero(positions == best[index])[0])
    lower = _crossing(positions[: at + 1][::-1], costs[: at + 1][::-1], limit)
    upper = _crossing(positions[at:], costs[at:], limit)
    return Profile(positions, costs, lower, upper)


def _crossing(positions: FloatArray, costs: FloatArray, limit: float) -> float:
    """Where ``costs``, walking outwards, first reach ``limit``; straight in √(rise), as a parabola is."""
    rise = np.sqrt(np.maximum(costs - costs[0], 0.0))
    wanted = np.sqrt(max(limit - costs[0], 0.0))
    above = np.flatnonzero(rise >= wanted)
    if above.size == 0 or above[0] == 0:
        return float("nan")
    k = int(above[0])
    share = (wanted - rise[k - 1]) / (rise[k] - rise[k - 1])
    return float(positions[k - 1] + share * (positions[k] - positions[k - 1]))
