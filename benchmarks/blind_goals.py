"""What all units of the blind benchmark reach together: the goals, the confusion matrix, and the page in the docs.

A goal is met if the share (or the time) itself reaches it; the binomial interval beside it says how much that proves.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from blind_score import FAILED, HELD_OUT, NONE, UNEXPLAINED, Score
from blind_units import EFFECTS
from scipy.stats import binomtest

#: Minutes in which two cores are to make and diagnose the whole benchmark.
MINUTES, CORES = 60.0, 2
DOCS_HEAD = """<!-- Written by benchmarks/blind.py --docs: run that again, change nothing here. -->

# The blind benchmark

`python benchmarks/blind.py -o DIR --seed {seed} --units {units} --docs`, run on commit {commits}: {count} of the
{whole} units of the whole benchmark. The plant shares nothing with the Modelica model ([how it is made and what it
asks](diagnose.md#how-well-it-works)). "met" and "missed" judge the share; the interval is binomial, 95 %.

```text
"""


@dataclass(frozen=True)
class Goal:
    """A share of ``cases`` that is to be from ``least`` to ``most`` (None: counted only); ``holds`` per case."""

    text: str
    cases: Sequence[Any]
    holds: Callable[[Any], bool] = bool
    least: float | None = None
    most: float = 1.0

    @property
    def wanted(self) -> str:
        """The goal in words, "" without one."""
        if self.least is None:
            return ""
        if self.most == 1.0:
            return f">= {100 * self.least:.0f} %"
        return (
            f"<= {100 * self.most:.0f} %"
            if self.least == 0.0
            else f"{100 * self.least:.0f}..{100 * self.most:.0f} %"
        )

    @property
    def count(self) -> int:
        """How many cases hold."""
        return sum(map(self.holds, self.cases))

    @property
    def verdict(self) -> str:
        """ "met" or "missed", "" without a goal or a case."""
        if self.least is None or not self.cases:
            return ""
        return _verdict(self.least <= self.count / len(self.cases) <= self.most)

    def __str__(self) -> str:
        if not self.cases:
            return f"{self.text:36s} {self.wanted:9s}    no case"
        interval = binomtest(self.count, len(self.cases)).proportion_ci(method="exact")
        share, low, high = (100.0 * s for s in (self.count / len(self.cases), interval.low, interval.high))
        return (
            f"{self.text:36s} {self.wanted:9s} {self.count:4d} of {len(self.cases):4d} {share:5.1f} %"
            f"   {low:5.1f} .. {high:5.1f} %   {self.verdict}"
        ).rstrip()


def goals(scores: Sequence[Score]) -> list[Goal]:
    """The goals that are shares, each on its own units; a diagnosis that failed holds no goal."""
    kinds = {kind: [s for s in scores if s.kind == kind] for kind in ("single", "pair", "outside", "clean")}
    named = kinds["single"] + kinds["pair"] + kinds["clean"]
    return [
        Goal("right class first", kinds["single"], lambda s: s.right, 0.97),
        Goal("  ... and no other named", kinds["single"], lambda s: s.alone),
        Goal("right place, or a tie that holds it", [p for s in scores for p in s.placed], least=0.95),
        Goal("false alarms on clean units", kinds["clean"], lambda s: not s.quiet, 0.0, 0.02),
        Goal("  ... that name an effect", kinds["clean"], lambda s: bool(s.names)),
        Goal("outside effects flagged", kinds["outside"], lambda s: s.flagged, 0.95),
        Goal("both of two", kinds["pair"], lambda s: s.right, 0.90),
        Goal("  ... and no third named", kinds["pair"], lambda s: s.alone),
        Goal(f"held-out error <= {HELD_OUT} x floor", named, _reaches_the_floor, 0.95),
        Goal("coefficient in its 95 % interval", [c for s in scores for c in s.covered], bool, 0.92, 0.98),
    ]


def _reaches_the_floor(s: Score) -> bool:
    return s.held_out is not None and s.held_out <= HELD_OUT


def _verdict(met: bool) -> str:
    return "met" if met else "missed"


def summary(scores: Sequence[Score], whole: int) -> str:
    """The goals and what was reached, the confusion matrix, every unit that went wrong; ``whole``: units of all."""
    kinds = Counter(s.kind for s in scores)
    lines = [
        f"{len(scores)} units: "
        + ", ".join(f"{kinds[k]} {k}" for k in ("single", "pair", "outside", "clean")),
        "",
        f"{'goal':36s} {'wanted':9s} reached                {'95 % interval':18s} verdict",
        *map(str, goals(scores)),
        *_time(scores, whole),
        "",
        "right class first, by strength",
    ]
    for strength in ("weak", "medium", "strong"):
        cases = [s for s in scores if s.kind == "single" and s.strength == strength]
        lines.append(str(Goal(f"  {strength}", cases, lambda s: s.right)))
    lines += ["", *_confusion(scores), "", "units that went wrong"]
    lines += [f"  {_told(s)} -> {s.verdict} {', '.join(s.names)}".rstrip() for s in scores if not s.right]
    lines += ["", f"units with effects of the catalogue, or clean, that leave more than {HELD_OUT} x floor"]
    lines += [
        f"  {_told(s)} {'no result' if s.held_out is None else f'{s.held_out:.2f}'}"
        for s in scores
        if s.kind != "outside" and not _reaches_the_floor(s)
    ]
    return "\n".join(lines)


def _told(s: Score) -> str:
    return f"{s.unit} {s.strength:6s} {' + '.join(s.truth) or 'clean'} ({'; '.join(s.forms)})"


def _time(scores: Sequence[Score], whole: int) -> list[str]:
    """Time of all units on two cores, by the clock and by the processors, in proportion where only some were run."""
    seconds = sorted(s.seconds for s in scores if s.seconds is not None)
    if not seconds:
        return []
    minutes = sum(seconds) / len(seconds) * whole / CORES / 60.0
    of = f"{whole} units" if len(seconds) == whole else f"in proportion, from {len(seconds)} to {whole} units"
    verdict = _verdict(minutes <= MINUTES)
    lines = [f"{'time on 2 cores':36s} {f'<= {MINUTES:.0f} min':9s} {minutes:5.1f} min ({of})   {verdict}"]
    cpu = [s.cpu for s in scores if s.cpu is not None]
    if cpu:
        mean = sum(cpu) / len(cpu)
        lines.append(
            f"{'  ... of processor time':46s} {mean * whole / CORES / 60.0:5.1f} min, {mean:.1f} s a unit"
        )
    return [
        *lines,
        f"{'  ... of a unit, by the clock':46s} median {seconds[len(seconds) // 2]:.0f} s, longest {seconds[-1]:.0f} s",
    ]


def _confusion(scores: Sequence[Score]) -> list[str]:
    """Rows: truth (pairs left out). Columns: what was named first, a tie with the truth counted as the truth."""
    table: dict[str, Counter[str]] = defaultdict(Counter)
    for s in scores:
        if s.kind != "pair":
            table[s.truth[0] if s.truth else "clean"][s.first] += 1
    rows = [name for name in [*EFFECTS, "clean"] if name in table]
    met = {first for row in table.values() for first in row}
    known = [name for name in [*EFFECTS, NONE, UNEXPLAINED, FAILED] if name in met]
    columns = known + sorted(met - set(known))
    letters = [chr(ord("A") + j) for j in range(len(columns))]
    lines = [
        "confusion: truth by what was named first",
        " " * 28 + "".join(f"{letter:>4s}" for letter in letters),
    ]
    for name in rows:
        counts = (table[name][column] for column in columns)
        lines.append(f"{name:28s}" + "".join(f"{count or '.':>4}" for count in counts))
    return lines + [f"  {letter} {column}" for letter, column in zip(letters, columns, strict=True)]


def docs_page(text: str, *, seed: int, commits: Sequence[str], count: int, whole: int) -> str:
    """The page of the docs around a `summary`."""
    head = DOCS_HEAD.format(
        seed=seed, units=count, count=count, whole=whole, commits=" and ".join(commits) or "not recorded"
    )
    return f"{head}{text}\n```\n"
