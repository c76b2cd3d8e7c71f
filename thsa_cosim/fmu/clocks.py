"""FMI 3.0 clocks that tick by time: read from the description, ticked by the importer (FMI 3.0.2 clause 2.2.8.5)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING
from xml.etree import ElementTree

import numpy as np

if TYPE_CHECKING:
    from thsa_cosim.fmu.fmi3 import Fmi3Instance

_FIXED = ("constant", "fixed")
_ASKED = ("calculated", "tunable", "changing", "countdown")
_SLACK = 1e-9
"""Share of an interval by which a tick may be missed and still counts as met."""


@dataclass(frozen=True)
class Clock:
    """An input clock; ``interval`` and ``shift`` [s] are None where the FMU is asked for them at run time."""

    name: str
    value_reference: int
    variability: str
    """constant, fixed, tunable, changing, calculated, countdown, triggered"""
    interval: float | None
    shift: float

    @property
    def is_timed(self) -> bool:
        """Whether it ticks by time; triggered ones tick when something outside of the FMU says so."""
        return self.variability in (*_FIXED, *_ASKED)


def read_clocks(xml: bytes) -> tuple[Clock, ...]:
    """Return the input clocks of a model description; fmpy does not read all of their attributes."""
    if b"<Clock" not in xml:
        return ()
    found = ElementTree.fromstring(xml).findall("ModelVariables/Clock")
    return tuple(_clock(element) for element in found if element.get("causality") == "input")


def _clock(element: ElementTree.Element) -> Clock:
    interval, shift = element.get("intervalDecimal"), float(element.get("shiftDecimal") or 0.0)
    if interval is None and element.get("intervalCounter") is not None:
        ticks_per_second = float(element.get("resolution") or 1.0)
        interval = str(float(element.attrib["intervalCounter"]) / ticks_per_second)
        shift = float(element.get("shiftCounter") or 0.0) / ticks_per_second
    variability = element.get("intervalVariability", "triggered")
    return Clock(
        element.get("name", ""),
        int(element.attrib["valueReference"]),
        variability,
        float(interval) if interval is not None and variability in _FIXED else None,
        shift,
    )


class Schedule:
    """When the clocks of one instance tick next.

    A countdown ticks once, an interval after the event that set it; a changing clock says after each tick when the
    next one is; the others are periodic, at start + shift + k interval.
    """

    def __init__(self, instance: "Fmi3Instance", clocks: Sequence[Clock], start: float) -> None:
        self._instance = instance
        self._clocks = [clock for clock in clocks if clock.is_timed]
        self._start = start
        self._interval = {c.value_reference: c.interval for c in self._clocks}
        self._base = {c.value_reference: start + c.shift for c in self._clocks}
        self._ticks = dict.fromkeys(self._interval, 0)
        self._next = {
            c.value_reference: self._base[c.value_reference] if c.interval else np.inf for c in self._clocks
        }

    def begin(self) -> None:
        """Ask for the intervals that are known once the instance is initialised."""
        asked = [c for c in self._clocks if c.variability in ("calculated", "tunable", "changing")]
        if not asked:
            return
        references = [c.value_reference for c in asked]
        shifts = self._instance.clock_shifts(references)
        for reference, shift in zip(references, shifts.tolist(), strict=True):
            self._base[reference] = self._next[reference] = self._start + shift
        self._ask(references)

    @property
    def next(self) -> float:
        """Time of the next tick [s]; infinite if there is none."""
        return min(self._next.values(), default=np.inf)

    def due(self, time: float) -> list[int]:
        """Value references of the clocks that tick at ``time``; each tick is returned once."""
        found = []
        for reference, at in self._next.items():
            interval = self._interval[reference]
            if at > time + _SLACK * (interval or abs(time) or 1.0):
                continue
            found.append(reference)
            self._ticks[reference] += 1
            periodic = interval is not None and interval > 0.0
            self._next[reference] = (
                self._base[reference] + self._ticks[reference] * interval if periodic else np.inf  # type: ignore[operator]
            )
        return found

    def refresh(self, time: float, ticked: Sequence[int]) -> bool:
        """Ask, in Event Mode, when clocks tick next whose interval may have changed; whether one is due at once."""
        if any(c.variability == "tunable" for c in self._clocks):
            self._ask([c.value_reference for c in self._clocks if c.variability == "tunable"])
        changing = [
            c.value_reference
            for c in self._clocks
            if c.variability == "changing" and c.value_reference in ticked
        ]
        countdown = [c.value_reference for c in self._clocks if c.variability == "countdown"]
        for references in (changing, countdown):
            if not references:
                continue
            intervals, changed = self._instance.clock_intervals(references)
            for reference, interval, is_new in zip(
                references, intervals.tolist(), changed.tolist(), strict=True
            ):
                if is_new or references is changing:
                    self._next[reference] = time + interval
        return self.next <= time

    def _ask(self, references: Sequence[int]) -> None:
        intervals, _ = self._instance.clock_intervals(references)
        variabilities = {c.value_reference: c.variability for c in self._clocks}
        for reference, interval in zip(references, intervals.tolist(), strict=True):
            if variabilities[reference] == "changing":  # told again after each tick
                continue
            if self._interval[reference] not in (None, interval):  # a tunable clock was tuned
                last = self._next[reference] - (self._interval[reference] or 0.0)
                self._base[reference], self._ticks[reference] = last, 1
                self._next[reference] = last + interval
            self._interval[reference] = interval
