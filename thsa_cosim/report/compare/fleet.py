"""Several units: each watched over time, and the latest study of each beside those of the others.

Units of one make differ, and the same one is the odd one out each week: that is no alarm, but said, with a chance of
5 % that any of them is, over all units and quantities.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.stats import t as student

from thsa_cosim.errors import InputError
from thsa_cosim.report.compare.difference import Comparison, compare
from thsa_cosim.report.compare.watch import FEWEST, Trend, is_watched, single_of, told, watch
from thsa_cosim.signals import FloatArray

#: Chance that some unit is called another one although all are alike.
CHANCE = 0.05


@dataclass(frozen=True)
class Odd:
    """A quantity of a unit that differs from the other units: ``latest`` beside their mean ± ``scatter``, t value."""

    unit: str
    name: str
    at: str
    latest: float
    expected: float
    scatter: float
    t: float


@dataclass(frozen=True, eq=False)
class Fleet:
    """The ``latest`` study of every unit, its ``trends`` (names begin with the unit's), and the ``odd`` ones."""

    latest: Comparison
    trends: tuple[Trend, ...]
    odd: tuple[Odd, ...]

    def sentence(self) -> str:
        """The alarms, and the units that differ from the others."""
        text = told(self.trends)
        if self.odd:
            parts = (
                f"{o.name}{' at ' + o.at if o.at else ''} of {o.unit} is {o.latest:.4g}, where the other units have"
                f" {o.expected:.4g} ± {o.scatter:.2g}"
                for o in self.odd
            )
            text += f" Unlike the others: {'; '.join(parts)}."
        return text


def units_of(folders: Sequence[Path]) -> dict[str, list[Path]]:
    """The studies of each unit, which is the folder that they lie in, by its name; the order is kept.

    Studies that all lie in folders of their own are one unit's.
    """
    found: dict[Path, list[Path]] = {}
    for folder in folders:
        found.setdefault(folder.resolve().parent, []).append(folder)
    if all(len(own) == 1 for own in found.values()):
        return {"": list(folders)}
    names = [parent.name for parent in found]
    unique = len(set(names)) == len(names)
    return {parent.name if unique else str(parent): own for parent, own in found.items()}


def watch_fleet(units: Mapping[str, Sequence[Path]]) -> Fleet:
    """Watch two units or more, the studies of each being in the order of time.

    Raises
    ------
    InputError
        If a unit has fewer than `FEWEST` studies, or the units share no quantity.
    """
    few = [name for name, own in units.items() if len(own) < FEWEST]
    if few:
        raise InputError(
            f"The folder {few[0]} holds {len(units[few[0]])} of the studies, and a trend needs {FEWEST} or more: the"
            " studies of one unit lie in one folder."
        )
    trends = [
        replace(t, name=f"{unit}: {t.name}") for unit, own in units.items() for t in watch(compare(own))
    ]
    latest = replace(compare([own[-1] for own in units.values()]), labels=tuple(units))
    return Fleet(latest, tuple(trends), tuple(_odd(latest)))


def _odd(latest: Comparison) -> list[Odd]:
    """The quantities of units that differ from the other units; none for fewer than four units."""
    rows = [row for row in latest.rows if is_watched(row)]
    count = len(latest.labels)
    if count < FEWEST or not rows:
        return []
    limit = float(student.isf(0.5 * CHANCE / (len(rows) * count), count - 2))
    found = []
    for row in rows:
        values = [v.value for v in row.values if v is not None]
        for k, unit in enumerate(latest.labels):
            t, expected, scatter = single_of(_with_last(values, k))
            if t is not None and abs(t) > limit:
                found.append(Odd(unit, row.name, row.at, values[k], expected, scatter, t))
    return found


def _with_last(values: Sequence[float], k: int) -> FloatArray:
    return np.array([*values[:k], *values[k + 1 :], values[k]])
