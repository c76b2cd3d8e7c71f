"""What a fit leaves that one slip of one signal would explain: delay, offset, drift, step, unit, sign.

Lagrange multiplier (score) tests: what the fit leaves is regressed on what each slip would leave, after everything
that the parameters could make of it (the columns of the Jacobian) has been taken out of both. A wrong value of a
parameter is therefore no slip, nor what such a value hides. The slip that explains most is taken in and the rest is
tested again. A model that lacks something leaves structure that no slip explains: it has no finding.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from thsa_cosim.errors import UnitError
from thsa_cosim.inspection.across import SLIPS, slip
from thsa_cosim.inspection.channel import correlation
from thsa_cosim.inspection.finding import Finding, Severity
from thsa_cosim.inspection.remainder import Column, Remainder, Slip, orthonormal
from thsa_cosim.inspection.trust import Residual
from thsa_cosim.signals import FloatArray
from thsa_cosim.units import conversion

_SURE = 60.0
"""Drop of the sum of squares, in noise variances, below which nothing is said (z of 7.7)."""
_SHARE = 0.75
"""Share of what is more than noise that a slip has to account for. Set on the shipped motor bench: true slips account
for 97 % and more, a command that seems to be early because the controller's gain is wrong for 62 %."""
_UNIT_SHARE = 0.9
"""The same of a unit and of a late command: a wrong model, too, is off by a factor, or answers at another time."""
_UNIT_NEAR = 0.05
_AGAINST = -0.8
"""Correlation of what is measured with what is simulated; parameters cannot follow a wrong sign, and end on bounds."""
_CHOSEN = 0.9
"""What counts of the drop of a slip with two numbers beside one with a single number."""
_SMALL = 0.3
"""Noise below which the size of an offset, drift or step is not worth a word."""
_SHORT = 0.3
"""Sampling steps below which a delay is the sampling's own."""
_UNEVEN, _HOP = 1.15, 0.3
"""Mean step around a moment in usual ones, share of its range that a signal goes in one step: coarse sampling."""
_LAGS = (0.5, 1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0, 32.0, 50.0, 80.0)
_STEPS = 24
_MOST_SLOPES = 20
"""Parameters up to which a delay is settled together with them: it takes twenty factorisations."""
_MOST = 3
_LEAST = 200


def misfits(
    residuals: Sequence[Residual], file_units: Mapping[str, str | None] | None = None
) -> list[Finding]:
    """Return findings on what the fit of one set of parameters leaves; residuals without ``simulated`` tell nothing.

    The columns of the residuals' ``slopes`` are the same parameters throughout. ``file_units``: of the channels'
    columns in the file, in which remedies are given; None: by the file itself.
    """
    if not residuals or any(r.simulated.size != r.values.size or not _usable(r) for r in residuals):
        return []
    stacked = np.concatenate([r.values for r in residuals])
    slopes = np.concatenate([r.slopes for r in residuals])
    basis = orthonormal(slopes)
    found: list[Finding] = []
    first = 0
    for name in dict.fromkeys(r.recording for r in residuals):
        own = [r for r in residuals if r.recording == name]
        found += _recording(Remainder(own, stacked, slopes, basis, first), file_units or {})
        first += sum(r.values.size for r in own)
    return found


def _usable(residual: Residual) -> bool:
    return bool(residual.values.size >= _LEAST and np.all(np.isfinite(residual.values)))


def _recording(rest: Remainder, file_units: Mapping[str, str | None]) -> Iterator[Finding]:
    against = [f for r in rest.own if (f := _against(r)) is not None]
    if against:
        yield from against  # of a fit to the wrong sign nothing else is told
        return
    for _ in range(_MOST):
        excess = rest.excess
        slips = [s for k in range(len(rest.own)) for s in _candidates(rest, k)]
        slips += _common_delay(rest)
        best = max(slips, key=lambda s: s.weight * s.gain, default=None)
        if best is None or excess <= 0.0:
            return
        floor = max(rest.floors)
        least = _UNIT_SHARE if best.kind in ("gain", "common-delay") else _SHARE
        if best.gain < _SURE * floor or best.gain < least * (excess - rest.chance):
            return
        share = min(best.gain / excess, 1.0)
        settled = _settled_delay(rest, best) if best.kind.endswith("delay") else best
        finding = _finding(rest, settled, share, file_units)
        if finding is None:
            return
        yield finding
        rest.take(best.column)


def _against(residual: Residual) -> Finding | None:
    """A signal that does the opposite of the model."""
    measured = residual.simulated - residual.values * residual.noise
    if not np.ptp(measured) > 20.0 * residual.noise or not np.ptp(residual.simulated) > residual.noise:
        return None
    likeness = correlation(measured, residual.simulated)
    if not likeness < _AGAINST:
        return None
    name = residual.channel
    text = f"{name} does the opposite of what the model says (their correlation is {likeness:.2f})"
    remedy = f"[recordings.columns.{name}]\nscale = -1"
    return Finding(residual.recording, name, "sign", "error", text, (), remedy)


def _column(rest: Remainder, k: int, own: FloatArray) -> Column:
    return [(rest.rows[k], own)]


def _candidates(rest: Remainder, k: int) -> Iterator[Slip]:
    """Every slip of channel ``k``, with the size that explains most."""
    residual = rest.own[k]
    time, one = residual.time, np.ones(residual.values.size)
    middle = 0.5 * (time[0] + time[-1])

    def linear(kind: str, shape: FloatArray, at: float = 0.0, weight: float = 1.0) -> Slip:
        column = _column(rest, k, -shape / residual.noise)
        size, gain = rest.gain(column)
        return Slip(kind, residual.channel, column, size, gain, at, weight)

    yield linear("offset", one)
    yield _drift(rest, k, time - middle)
    yield linear("gain", residual.simulated)
    starts = np.linspace(time[0], time[-1], _STEPS + 2)[1:-1]
    coarse = max((linear("step", (time >= at) * 1.0, at, _CHOSEN) for at in starts), key=lambda s: s.gain)
    near = np.linspace(coarse.at - starts[0] + time[0], coarse.at + starts[0] - time[0], _STEPS)
    yield max((linear("step", (time >= at) * 1.0, at, _CHOSEN) for at in near), key=lambda s: s.gain)
    yield from _delayed(rest, [k], residual.channel)


def _drift(rest: Remainder, k: int, elapsed: FloatArray) -> Slip:
    """A drift from wherever it begins: a straight line over ``elapsed`` s."""
    residual = rest.own[k]
    span = float(np.ptp(elapsed))
    shapes = np.column_stack((np.ones(elapsed.size), elapsed / span)) / -residual.noise
    level, slope = rest.best(rest.rows[k], shapes)
    column = _column(rest, k, shapes @ (level, slope))
    return Slip("drift", residual.channel, column, slope / span, rest.drop(column), weight=_CHOSEN)


def _delayed(rest: Remainder, which: Sequence[int], channel: str) -> Iterator[Slip]:
    """The channels ``which`` later (earlier) than simulated, by the delay that explains most."""
    step = float(np.median(np.diff(rest.own[which[0]].time)))

    lags = [sign * lag * step for lag in _LAGS for sign in (1.0, -1.0)]
    best = max(lags, key=lambda by: rest.drop(_late(rest, which, by)))
    width = 0.5 * abs(best)
    for _ in range(3):
        near = np.linspace(best - width, best + width, 7)
        best = float(max(near, key=lambda by: rest.drop(_late(rest, which, float(by)))))
        width /= 3.0
    column = _late(rest, which, best)
    yield Slip("delay", channel, column, best, rest.drop(column))


def _late(rest: Remainder, which: Sequence[int], by: float) -> Column:
    """What is left of channels that are late ``by`` s."""
    column = []
    for k in which:
        r = rest.own[k]
        shifted = np.interp(r.time - by, r.time, r.simulated)
        column.append((rest.rows[k], (r.simulated - shifted) / r.noise))
    return column


def _settled_delay(rest: Remainder, best: Slip) -> Slip:
    """The delay once more, now that what parameters do is late as well: a wrong one hid a part of it."""
    if rest.own[0].slopes.shape[1] > _MOST_SLOPES:
        return best
    every = range(len(rest.own))
    which = [k for k in every if best.kind == "common-delay" or rest.own[k].channel == best.channel]

    from scipy.optimize import minimize_scalar  # slow to import, and slips are rare

    def left(by: float) -> float:
        return rest.beside_late(_late(rest, which, by), which, by)

    ends = (min(0.5 * best.size, 2.0 * best.size), max(0.5 * best.size, 2.0 * best.size))
    found = minimize_scalar(left, bounds=ends, method="bounded", options={"maxiter": 20})
    return replace(best, size=float(found.x))


def _common_delay(rest: Remainder) -> Iterator[Slip]:
    """All outputs early by the same time: the input that moves is late."""
    moving = [n for n, x in rest.own[0].inputs.items() if np.ptp(x) > 0.0]
    if len(rest.own) > 1 and len(moving) == 1:
        for found in _delayed(rest, range(len(rest.own)), moving[0]):
            yield Slip("common-delay", found.channel, found.column, found.size, found.gain)


def _finding(
    rest: Remainder, best: Slip, share: float, file_units: Mapping[str, str | None]
) -> Finding | None:
    """``best`` in words; None if it is too small, or no slip after all."""
    if best.kind == "common-delay":
        return _delay_finding(rest.own[0], best, -best.size, share)
    residual = next(r for r in rest.own if r.channel == best.channel)
    if best.kind == "delay":
        return _delay_finding(residual, best, best.size, share)
    if best.kind == "gain":
        return _unit_finding(residual, 1.0 + best.size, share)
    name, unit, length = best.channel, residual.unit, float(residual.time[-1] - residual.time[0])
    table = f"[recordings.columns.{name}]"
    explained = f"which explains {100.0 * min(share, 1.0):.0f} % of the misfit"
    if best.kind == "drift":
        if abs(best.size) * length < 2.0 * _SMALL * residual.noise:
            return None
        text = f"{name} drifts by {best.size * length:.3g} {unit} over the recording against the model, {explained}"
        return Finding(residual.recording, name, "drift", "warning", text)
    if abs(best.size) < _SMALL * residual.noise:
        return None
    more = "more" if best.size > 0.0 else "less"
    what = f"{name} reads {abs(best.size):.3g} {unit} {more} than the model says"
    if best.kind == "step":
        text = (
            f"{what} from {best.at:.4g} s on, {explained}: its sensor stepped, or something does there that"
        )
        text += " the model lacks"
        where = ((best.at, float(residual.time[-1])),)
        return Finding(residual.recording, name, "step", "warning", text, where)
    text = f"{what} all the time, {explained}: an offset of its sensor, or a constant that the model lacks"
    remedy = f"{table}\noffset = {_in_file(-best.size, unit, file_units.get(name))}"
    return Finding(residual.recording, name, "offset", "warning", text, (), remedy)


def _in_file(offset: float, unit: str, file_unit: str | None) -> str:
    """An offset as a scenario wants it: in the file's unit."""
    try:
        own = offset * conversion(unit, file_unit)[0] if file_unit else None
    except UnitError:
        own = None
    if own is None:
        return f"{offset:.4g}  # in {unit}; write it in the unit of the file's numbers"
    return f"{own:.4g}  # in {file_unit}, the unit of the file's numbers"


def _commanded_by_steps(residual: Residual) -> bool:
    """Whether an input that is held from sample to sample moves."""
    return any(float(np.ptp(residual.inputs[n])) > 0.0 for n in residual.held if n in residual.inputs)


def own_delay(time: FloatArray, simulated: FloatArray, *, held: bool = False) -> float:
    """Return the longest delay, in s, that the sampling itself makes of a command that changes between two samples.

    A controller changes it at its own samples: where some are lost, the answer is too fast, or a command that moves is
    ``held`` from one sample of the recording to the next, nobody knows when.
    """
    steps = np.diff(time)
    usual, mean = float(np.median(steps)), float(np.sum(steps**2) / np.sum(steps))
    hop, whole = float(np.max(np.abs(np.diff(simulated)))), float(np.ptp(simulated))
    return mean if held or mean > _UNEVEN * usual or hop > _HOP * whole else _SHORT * usual


def _delay_finding(residual: Residual, best: Slip, by: float, share: float) -> Finding | None:
    step = float(np.median(np.diff(residual.time)))
    if abs(by) < own_delay(residual.time, residual.simulated, held=_commanded_by_steps(residual)):
        return None
    severity: Severity = "warning" if abs(by) < 20.0 * step else "error"
    word = "late" if by > 0.0 else "early"
    against = "for what the outputs do" if best.kind == "common-delay" else "against the model"
    text = (
        f"{best.channel} is {1e3 * abs(by):.3g} ms {word} {against}, which explains {100.0 * min(share, 1.0):.0f} %"
        " of the misfit: its stamps, its filter, or a lag that the model lacks"
    )
    remedy = f"[recordings.columns.{best.channel}]\nshift = {-by:.4g}"
    return Finding(residual.recording, best.channel, "delay", severity, text, (), remedy)


def _unit_finding(residual: Residual, factor: float, share: float) -> Finding | None:
    """A factor that units are confused by, or a sign; None for any other: the model is wrong, or a sensor's gain."""
    if share < _UNIT_SHARE:
        return None
    name, size = residual.channel, abs(factor)
    table = f"[recordings.columns.{name}]"
    meant = slip(size, _UNIT_NEAR)
    sign = -1.0 if factor < 0.0 else 1.0
    if meant is not None:
        text = f"{name} is {factor:.4g} times what the model says: {meant}"
        remedy = f"{table}\nscale = {sign / SLIPS[meant]:.9g}"
        return Finding(residual.recording, name, "unit", "error", text, (), remedy)
    if sign < 0.0 and 0.5 < size < 2.0:
        text = f"{name} runs against the model ({factor:.3g} times what it says)"
        return Finding(residual.recording, name, "sign", "error", text, (), f"{table}\nscale = -1")
    return None
