"""The time axis: rate, jitter, lost samples and gaps, stamps that repeat or go back, too few samples."""

from collections.abc import Callable, Iterator

import numpy as np

from thsa_cosim.inspection.finding import Finding, Severity, Span
from thsa_cosim.recordings.outliers import running_median
from thsa_cosim.signals import FloatArray

_JITTER_NOTE, _JITTER = 0.02, 0.1
"""Scatter of the stamps (1 σ), in steps, from which on it is worth a note, a warning."""
_GAP = 10
"""Steps without a sample that make a gap; fewer are lost samples."""
_FEW, _TOO_FEW = 200, 40
_CATCH_UP = 0.5
"""s after a gap in which the model may still be elsewhere: its inputs are not known within."""
_MOST_SPANS = 40
_ABSURD = 1e15
"""Steps between two stamps; more cannot be counted."""

Found = Callable[..., Finding]


def time_findings(recording: str, time: FloatArray) -> Iterator[Finding]:
    """Yield what is wrong with the stamps ``time`` (n,) in s, in the file's order."""

    def found(
        kind: str, severity: Severity, text: str, where: tuple[Span, ...] = (), remedy: str = ""
    ) -> Finding:
        return Finding(recording, "time", kind, severity, text, where, remedy)

    if time.size < _FEW:
        severity: Severity = "error" if time.size < _TOO_FEW else "warning"
        yield found(
            "too-short",
            severity,
            f"{time.size} samples in {np.ptp(time):.4g} s are few to tell noise from motion",
        )
    distances = np.diff(time)
    stuck, back = distances == 0.0, distances < 0.0
    if stuck.any():
        where = _spans(time, stuck)
        yield found(
            "repeated-stamps",
            "warning",
            f"{np.sum(stuck)} of {time.size} stamps repeat the one before",
            where,
        )
    if back.any():
        yield found("repeated-stamps", "error", _goes_back(time, back), _spans(time, back))
    distances = distances[distances > 0.0]
    if distances.size < 8:
        return
    several = _rate_changes(time)
    if several is not None:
        text = f"the sampling step changes between {several[0]:.4g} s and {several[1]:.4g} s"
        yield found("several-rates", "warning", text)
    step = local_step(np.diff(time)) if several is not None else base_step(distances)
    with np.errstate(over="ignore"):  # a stamp of a damaged file may be any number
        steps = np.minimum(np.diff(time) / step, _ABSURD)
    missing = np.where(steps > 1.5, np.round(steps) - 1.0, 0.0)
    regular = steps[(steps > 0.0) & (missing < _GAP)]
    scatter = float(np.sqrt(np.mean((regular - np.maximum(np.round(regular), 1.0)) ** 2)))
    if np.ndim(step) == 0:
        # Stamps that only scatter come too late as often as too early: in the end nothing is missing.
        absent = np.sum(np.diff(time)) / float(np.median(step)) - np.sum(steps > 0.0)
        if np.sum(missing[missing < _GAP]) > 1.5 * max(absent - np.sum(missing[missing >= _GAP]), 0.0) + 3.0:
            missing = np.where(missing >= _GAP, missing, 0.0)
    yield from _missing(found, time, missing)
    if scatter > _JITTER_NOTE:
        severity = "warning" if scatter > _JITTER else "note"
        text = f"stamps scatter by {100.0 * scatter:.2g} % of the step of {float(np.median(step)):.4g} s"
        yield found("jitter", severity, text)


def _goes_back(time: FloatArray, back: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> str:
    """How time goes back, in words."""
    count, first = int(np.sum(back)), int(np.argmax(back))
    if count > 1:
        return f"time goes back {count} times"
    text = f"time goes back once, from {time[first]:.6g} s to {time[first + 1]:.6g} s"
    again = time[first + 1 : first + 5]
    if first > 2 and again.size > 3 and np.all(again < time[first]):
        text += ": the logger started again, or two recordings are joined"
    return text


def local_step(distances: FloatArray) -> FloatArray:
    """Return what is the usual step around each of (n,) ``distances``, s."""
    return np.maximum(running_median(distances, 101 if distances.size > 202 else 11), 1e-12)


def base_step(distances: FloatArray) -> float:
    """Return the step that most of (n,) positive ``distances`` are whole multiples of, s."""
    usual = float(np.median(distances))
    short = float(np.quantile(distances, 0.1))
    for step in (short, float(np.median(distances[distances < 1.5 * short]))):
        with np.errstate(over="ignore", invalid="ignore"):
            multiples = distances / step
            fitting = np.abs(multiples - np.round(multiples)) < 0.05
        if step < 0.7 * usual and np.mean(fitting) > 0.95:
            return step
    return usual


def _missing(found: Found, time: FloatArray, missing: FloatArray) -> Iterator[Finding]:
    lost = float(np.sum(missing))
    if lost == 0.0:
        return
    gaps = missing >= _GAP
    if gaps.any():
        longest = float(np.max(np.diff(time)[gaps]))
        text = f"{np.sum(gaps)} gap{'s' if np.sum(gaps) > 1 else ''} without samples, the longest of {longest:.4g} s"
        spans = _spans(time, gaps)
        pairs = ", ".join(f"[{a - time[0]:.6g}, {b - time[0] + _CATCH_UP:.6g}]" for a, b in spans)
        yield found("gaps", "warning", text, spans, f"[cost]\nmask = [{pairs}]")
    scattered = float(np.sum(missing[~gaps]))
    if scattered:
        part = scattered / (scattered + time.size)
        severity = "warning" if part > 1e-3 else "note"
        where = () if part > 0.05 else _spans(time, (missing > 0.0) & ~gaps)
        yield found(
            "lost-samples", severity, f"{scattered:.0f} samples ({100.0 * part:.2g} %) are missing", where
        )


def _rate_changes(time: FloatArray) -> tuple[float, float] | None:
    """Shortest and longest usual step of a recording whose rate changes for good, not from sample to sample."""
    parts = np.array_split(np.diff(time), max(2, min(20, time.size // 50)))
    rates = np.array([float(np.median(part)) for part in parts if part.size])
    rates = rates[rates > 0.0]
    if rates.size < 2 or rates.max() < 1.2 * rates.min():
        return None
    changes = np.flatnonzero(np.abs(np.diff(np.log(rates))) > 0.1)
    return (float(rates.min()), float(rates.max())) if 1 <= changes.size <= 4 else None


def _spans(time: FloatArray, after: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> tuple[Span, ...]:
    """Stretches between the samples k and k + 1 with ``after[k]``."""
    marked = np.flatnonzero(after)[:_MOST_SPANS]
    return tuple((float(time[k]), float(time[k + 1])) for k in marked)
