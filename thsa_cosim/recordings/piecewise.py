"""A noisy measured input as a continuous piecewise-linear function with as few knots as the noise warrants.

Bench loads and commands are plateaus and ramps under sensor noise. A moving average long enough to remove the
noise smears their kinks; a linear spline with free knots does not. The fit goes in rounds:

1. insert: in every segment, the hinge ``max(t - tau, 0)`` that explains most of what the segment's own line
   leaves; it becomes a knot if it lowers the sum of squares by more than ``penalty`` noise variances
   (3 log n, the strengthened BIC for a knot's two parameters, time and level);
2. move: each knot goes to where the lines through the samples of its two segments meet (Muggeo 2003,
   Statistics in Medicine 22, 3055: one Gauss-Newton step in the knot times), to a fraction of a sample;
3. simplify: knots go, and one knot takes the place of two neighbours, where that costs less than ``penalty``
   noise variances a knot.

Levels are least squares throughout (``spline``).
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.recordings.spline import LinearSpline, removal_costs
from thsa_cosim.signals import FloatArray

_ROUNDS, _REPAIRS = 60, 3
_SAMPLES_PER_KNOT = 10
"""With fewer samples per knot than this the function would be nothing but the noise."""
_LEAST = 4
"""Samples that a segment needs for a line of its own."""
_SPREAD, _COLOUR = 1.3, 0.25
"""Largest residual, in noise, and autocovariance, in its square: structure of half the noise is left then."""


@dataclass(frozen=True, eq=False)
class PiecewiseLinear:
    """``levels`` (k,) at the times ``knots`` (k,) s, linear between them.

    ``doubt`` says why the samples are no such function with white noise; empty if they are.
    """

    knots: FloatArray
    levels: FloatArray
    doubt: str = ""

    def at(self, time: FloatArray) -> FloatArray:
        """Return the values at ``time`` (m,) s; outside of the knots they hold."""
        return np.asarray(np.interp(time, self.knots, self.levels))


def fit_piecewise_linear(time: FloatArray, values: FloatArray, noise: float) -> PiecewiseLinear:
    """Fit ``values`` (n,) at ``time`` (n,) s, increasing, with white noise of standard deviation ``noise``.

    ``noise`` is in the values' unit; 0 keeps every sample as a knot.
    """
    if time.size < 3 or not noise > 0.0:
        return PiecewiseLinear(time, values)
    # In mean sample steps and standard deviations, around zero: sums stay accurate, limits are plain numbers.
    step = float(time[-1] - time[0]) / (time.size - 1)
    middle = float(np.mean(values))
    search = _Search((time - time[0]) / step, (values - middle) / noise)
    search.run()
    knots = time[0] + step * search.spline.knots
    knots[0], knots[-1] = time[0], time[-1]
    return PiecewiseLinear(knots, middle + noise * search.spline.levels, search.doubt())


class _Search:
    """The rounds of a fit to y (n,), with noise of standard deviation 1, over t (n,), in steps of about 1."""

    def __init__(self, t: FloatArray, y: FloatArray) -> None:
        self.t, self.y = t, y
        self.penalty = 3.0 * float(np.log(t.size))
        self.most = max(2, t.size // _SAMPLES_PER_KNOT)
        self.spline = LinearSpline(t, y, t[[0, -1]])
        self._settled: set[tuple[float, float]] = set()

    def run(self) -> None:
        """Insert, move and simplify until nothing more is warranted."""
        for _ in range(_REPAIRS):
            self._settled.clear()  # with other knots beside them, segments may have become worse
            before = self.spline.knots.size
            for _ in range(_ROUNDS):
                if self.spline.knots.size > self.most or not self._insert():
                    break
                self._move(1)
            if self.spline.knots.size == before or self.spline.knots.size > self.most:
                break
            for _ in range(_ROUNDS):
                self._move(4)
                if not (self._delete() or self._merge()):
                    break

    def _insert(self) -> bool:
        """Add the best hinge of every segment that warrants one, and a knot in its longer part; True if any did."""
        found: list[float] = []
        bounds = self.spline.bounds()
        for j, (left, right) in enumerate(pairwise(self.spline.knots.tolist())):
            if (left, right) in self._settled:
                continue
            place = self._hinge(bounds[j] - (self.t[bounds[j]] > left), bounds[j + 1] + 1)
            if place is None:
                self._settled.add((left, right))
                continue
            found.append(place)
            if right - left > 2 * _LEAST:
                # Else a signal of many periods would be taken apart one by one, from its ends.
                found.append(0.5 * (place + (left if place - left > right - place else right)))
        return self._use(np.union1d(self._apart_from(np.sort(found)), found))

    def _use(self, knots: FloatArray) -> bool:
        """Take these knots; True if they are others."""
        changed = not np.array_equal(knots, self.spline.knots)
        self.spline = LinearSpline(self.t, self.y, knots)
        return changed

    def _apart_from(self, places: FloatArray) -> FloatArray:
        """Return the knots without those within half a sample of ``places`` (sorted): two would be one too many."""
        knots = self.spline.knots
        if places.size == 0:
            return knots
        next_ = np.minimum(np.searchsorted(places, knots), places.size - 1)
        apart = (
            np.minimum(np.abs(places[next_] - knots), np.abs(knots - places[np.maximum(next_ - 1, 0)])) > 0.5
        )
        apart[[0, -1]] = True
        return np.asarray(knots[apart])

    def _hinge(self, first: int, last: int) -> float | None:
        """Return the time of the hinge that the residual of samples first..last-1 warrants, if any."""
        first, last = max(first, 0), min(last, self.t.size)
        count = last - first
        if count < 3:
            return None
        u = self.t[first:last] - self.t[first]
        mean = u.mean()
        spread = float(((u - mean) ** 2).sum())
        r = self.spline.residual[first:last]
        r = r - r.mean()
        r = r - (r @ (u - mean)) / spread * (u - mean)
        later = np.arange(count - 1, -1, -1)  # samples after each one
        s1, s2, r0, r1 = (w.sum() - np.cumsum(w) for w in (u, u * u, r, u * r))
        product = r1 - u * r0
        # The hinge's square, less what the segment's line takes of it.
        h = s1 - later * u
        square = s2 - 2.0 * u * s1 + later * u * u - h * h / count - (s2 - u * s1 - mean * h) ** 2 / spread
        # A hinge next to an end is all but the line itself: what is left of it is rounding in a long segment.
        gain = np.where(square > 1e-10 * spread, product * product / np.maximum(square, 1e-10 * spread), 0.0)
        best = int(np.argmax(gain))
        return float(self.t[first + best]) if gain[best] > self.penalty else None

    def _move(self, times: int) -> None:
        """Move knots to where their neighbouring lines meet, as long as that lowers the sum of squares."""
        for _ in range(times):
            before = self.spline
            target = self._meeting_points()
            if np.max(np.abs(target - before.knots)) < 1e-3:
                return
            self._use(target)
            if self.spline.squares > before.squares:
                self.spline = before
                return

    def _meeting_points(self) -> FloatArray:
        """Return the knots moved to the meeting points, none over more than 0.4 of a neighbouring segment."""
        knots, width = self.spline.knots, np.diff(self.spline.knots)
        count, level, slope = self.spline.lines()
        with np.errstate(divide="ignore", invalid="ignore"):
            left, right = level + 0.5 * width * slope, level - 0.5 * width * slope
            shift = (left[:-1] - right[1:]) / (slope[1:] - slope[:-1])
        own = count >= _LEAST
        shift = np.where(own[:-1] & own[1:] & np.isfinite(shift), shift, 0.0)
        moved = knots.copy()
        moved[1:-1] += np.clip(shift, -0.4 * width[:-1], 0.4 * width[1:])
        return moved

    def _delete(self) -> bool:
        """Remove the knots that are not worth their penalty, no two neighbours at once; True if any went."""
        cost = removal_costs(self.spline)
        gone: set[int] = set()
        for j in np.argsort(cost, kind="stable").tolist():
            if cost[j] > self.penalty:
                break
            if not {j - 1, j + 1} & gone:
                gone.add(j)
        return bool(gone) and self._use(np.delete(self.spline.knots, np.array(sorted(gone)) + 1))

    def _merge(self) -> bool:
        """Let one knot take the place of two where that costs less than a penalty; True if any did."""
        before = self.spline
        joined: dict[int, float] = {}
        for j in self._doubtful_pairs().tolist():
            if not {j - 2, j - 1} & joined.keys():
                place = self._junction(*before.bounds()[j - 1 : j + 3])
                if place is not None and before.knots[j - 1] < place < before.knots[j + 2]:
                    joined[j] = place
        if not joined:
            return False
        kept = np.delete(before.knots, [i for j in joined for i in (j, j + 1)])
        self._use(np.union1d(kept, list(joined.values())))
        self._move(4)
        if self.spline.squares - before.squares <= self.penalty * len(joined):
            return True
        self.spline = before
        return False

    def _doubtful_pairs(self) -> NDArray[np.intp]:
        """Return each j whose knots j and j + 1 lie near the corner of the lines before and after them."""
        spline, width = self.spline, np.diff(self.spline.knots)
        count, level, slope = spline.lines()
        centre = spline.knots[:-1] + 0.5 * width
        with np.errstate(divide="ignore", invalid="ignore"):
            turn = slope[2:] - slope[:-2]
            place = (level[:-2] - level[2:] + slope[2:] * centre[2:] - slope[:-2] * centre[:-2]) / turn
            corner = level[:-2] + slope[:-2] * (place - centre[:-2])
            height = corner - np.interp(place, spline.knots, spline.levels)
            # A triangle of that height over the segment; new lines take up to 7/8 of its square away.
            near = count[1:-1] * height**2 / 3.0 < 8.0 * self.penalty
        return np.flatnonzero(near & (count[:-2] >= _LEAST) & (count[2:] >= _LEAST)) + 1

    def _junction(self, first: int, left: int, right: int, last: int) -> float | None:
        """Return where one knot can replace those at samples ``left`` and ``right``, from ``first`` to ``last``."""
        t, y = self.t, self.y
        place = _meeting(_line(t[first:left], y[first:left]), _line(t[right:last], y[right:last]))
        if place is None or not t[first] < place < t[last - 1]:
            return None
        split = int(np.clip(np.searchsorted(t, place), first + _LEAST, last - _LEAST))
        lines = (_line(t[first:split], y[first:split]), _line(t[split:last], y[split:last]))
        now = self.spline.residual[first:last]
        grown = lines[0][2] + lines[1][2] - float(now @ now)
        return _meeting(*lines) if grown < self.penalty else None

    def doubt(self) -> str:
        """Say what speaks against white noise around the spline; empty: nothing."""
        residual, size = self.spline.residual, self.t.size
        if self.spline.knots.size > self.most:
            return f"it bends more often than every {_SAMPLES_PER_KNOT} samples"
        spread = float(np.sqrt(self.spline.squares / size))
        if spread > _SPREAD + 4.0 / np.sqrt(2.0 * size):
            return f"what is left is {spread:.2f} times its noise"
        lags = range(1, min(10, size // 4) + 1)
        colour = max((abs(float(residual[k:] @ residual[:-k])) / size for k in lags), default=0.0)
        if colour > _COLOUR + 4.0 / np.sqrt(size):
            return f"what is left is not white (autocovariance {colour:.2f} in units of its noise)"
        return ""


def _line(t: FloatArray, y: FloatArray) -> tuple[float, float, float]:
    """Return level at 0, slope and sum of squares of the line of least squares through y (n,) over t (n,)."""
    mean_t, mean_y = float(t.mean()), float(y.mean())
    u, v = t - mean_t, y - mean_y
    slope = float(u @ v) / float(u @ u)
    rest = v - slope * u
    return mean_y - slope * mean_t, slope, float(rest @ rest)


def _meeting(one: tuple[float, float, float], other: tuple[float, float, float]) -> float | None:
    """Return the time at which two lines meet; None if they are parallel."""
    turn = one[1] - other[1]
    return (other[0] - one[0]) / turn if turn != 0.0 else None
