"""Scores of the blind benchmark: a unit's label against its result.json. What all reach of the goals: `blind_goals`.

Names count as in the contract: what follows a colon is a location, `equivalent` names of the first effect are a
tie that these data allow, and more than two of them are no answer. A place is right if it is named, or in the tie.
Motor and gearbox turn as one: a speed or an angle stated at one is compared at the other by the gear's ratio. The noise
floor is the sensors' own.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations
from pathlib import Path
from typing import Any

from blind_units import FLOOR

from thsa_cosim.errors import ThsaCosimError
from thsa_cosim.units import convert

NONE, UNEXPLAINED, FAILED = "no-missing-effect", "unexplained-structure", "no result"
MOST_TIES = 2
#: Where an effect that can act at several places is, by the last word of its fields; as the model calls it.
PLACES = {"motor": "motor", "gear": "gearbox", "nut": "screw"}
HELD_OUT = 1.1  # goal: rmse over the noise floor


@dataclass(frozen=True)
class Reported:
    """One effect of a result.json."""

    name: str
    ties: tuple[str, ...]
    parameters: Mapping[str, Mapping[str, Any]]
    place: str = ""
    places: tuple[str, ...] = ()  # of the same effect, those of the tie included

    def covers(self, truth: str) -> bool:
        return truth == self.name or (truth in self.ties and len(self.ties) <= MOST_TIES)


@dataclass(frozen=True)
class Score:
    """What a diagnosis made of one unit."""

    unit: str
    kind: str  # "single", "pair", "outside" or "clean"
    truth: tuple[str, ...]
    forms: tuple[str, ...]
    strength: str
    verdict: str
    names: tuple[str, ...]
    first: str  # what the confusion matrix counts: the truth, where the first name or its ties have it
    right: bool
    alone: bool  # right, and nothing else named
    held_out: float | None  # largest rmse over noise floor on the validate recordings, after
    covered: tuple[bool, ...]  # true coefficients inside their 95 % intervals
    placed: tuple[
        bool, ...
    ]  # of the effects rightly named that can be at several places: named there, or tied
    seconds: float | None
    cpu: float | None = None  # s, the plant's included

    @property
    def quiet(self) -> bool:
        return self.verdict == NONE

    @property
    def flagged(self) -> bool:
        return self.verdict == UNEXPLAINED


def score(
    unit: str,
    label: Mapping[str, Any],
    result: Mapping[str, Any] | None,
    seconds: float | None,
    cpu: float | None = None,
) -> Score:
    """`label` as blind.py writes it; `result` is None where the diagnosis failed; times in s."""
    truth = tuple(effect["name"] for effect in label["effects"])
    reported = [_reported(entry) for entry in (result or {}).get("effects", [])]
    verdict = FAILED if result is None else str(result["verdict"])
    pairing = _pairing(truth, reported)
    kind = label["kind"]
    if kind == "clean":
        right = verdict == NONE
    elif kind == "outside":
        right = verdict == UNEXPLAINED
    elif kind == "single":
        right = bool(reported) and reported[0].covers(truth[0])
    else:
        right = len(pairing) == len(truth)
    first = reported[0].name if reported else verdict
    if reported:
        first = next((name for name in truth if reported[0].covers(name)), first)
    return Score(
        unit=unit,
        kind=kind,
        truth=truth,
        forms=tuple(effect["form"] for effect in label["effects"]),
        strength=label["strength"],
        verdict=verdict,
        names=tuple(effect.name for effect in reported),
        first=first,
        right=right,
        alone=right and len(reported) == len(truth if kind in ("single", "pair") else ()),
        held_out=None if result is None else held_out(result),
        covered=tuple(
            inside
            for effect in label["effects"]
            if effect["name"] in pairing and pairing[effect["name"]].name == effect["name"]
            for inside in _covered(
                moved(effect, pairing[effect["name"]].place, label.get("rig", {})),
                pairing[effect["name"]].parameters,
            )
        ),
        placed=tuple(
            place in pairing[effect["name"]].places
            for effect in label["effects"]
            if effect["name"] in pairing and pairing[effect["name"]].name == effect["name"]
            if (place := place_of(effect)) and pairing[effect["name"]].place
        ),
        seconds=seconds,
        cpu=cpu,
    )


def _reported(entry: Mapping[str, Any]) -> Reported:
    names = [str(name).partition(":") for name in (entry["name"], *entry.get("equivalent", []))]
    own, _, place = names[0]
    places = tuple(where for name, _, where in names if name == own and where)
    return Reported(own, tuple(name for name, _, _ in names[1:]), entry.get("parameters", {}), place, places)


def place_of(effect: Mapping[str, Any]) -> str:
    """The place of a label's effect, as the model calls it; "" where its fields name none, or several."""
    found = {
        place
        for field in effect.get("fields", {})
        for word, place in PLACES.items()
        if word in field.split("_")
    }
    return found.pop() if len(found) == 1 else ""


def moved(effect: Mapping[str, Any], place: str, rig: Mapping[str, float]) -> list[dict[str, Any]]:
    """True coefficients as they are at ``place``: of motor and gearbox, by the gear's ratio, speeds and angles."""
    true = place_of(effect)
    coefficients = [dict(c) for c in effect["coefficients"]]
    if {true, place} == {"motor", "gearbox"} and "i" in rig:
        ratio = rig["i"] if place == "motor" else 1.0 / rig["i"]
        for c in coefficients:
            if c["unit"] in ("rad/s", "rad"):
                c["value"] *= ratio
    return coefficients


def _pairing(truth: Sequence[str], reported: Sequence[Reported]) -> dict[str, Reported]:
    """The reported effect of each true one, no reported effect twice; as many as can be."""
    best: dict[str, Reported] = {}
    spots: list[Reported | None] = [*reported, *[None] * len(truth)]
    for chosen in permutations(spots, len(truth)):
        found = {
            name: effect for name, effect in zip(truth, chosen, strict=True) if effect and effect.covers(name)
        }
        best = max(best, found, key=len)
    return best


def held_out(result: Mapping[str, Any]) -> float | None:
    """Largest rmse over the floor of the channels after, or before where nothing was added."""
    after = result.get("after", {}).get("validate") or result.get("before", {}).get("validate") or {}
    ratios = [channel["rmse"] / FLOOR[name] for name, channel in after.items() if name in FLOOR]
    return max(ratios, default=None)


def _covered(coefficients: Iterable[Mapping[str, Any]], found: Mapping[str, Mapping[str, Any]]) -> list[bool]:
    """For every true coefficient with exactly one comparable estimate: is it inside value +- 1.96 stderr?"""
    return [abs(value - true) <= 1.96 * stderr for _, value, stderr, true in estimates(coefficients, found)]


def estimates(
    coefficients: Iterable[Mapping[str, Any]], found: Mapping[str, Mapping[str, Any]]
) -> Iterator[tuple[str, float, float, float]]:
    """Name, value, standard error and truth of every true coefficient with exactly one comparable estimate.

    Comparable is what has the same dimension and, where that leaves a choice, a name that holds a known word.
    """
    for true in coefficients:
        same = {
            name: entry for name, entry in found.items() if _converted(1.0, entry, true["unit"]) is not None
        }
        if len(same) > 1:
            same = {n: e for n, e in same.items() if any(word in n.lower() for word in true["words"])}
        if len(same) != 1 or next(iter(same.values())).get("stderr") is None:
            continue
        name, entry = next(iter(same.items()))
        value, stderr = (_converted(entry[key], entry, true["unit"]) for key in ("value", "stderr"))
        assert value is not None
        assert stderr is not None
        # a gain may be given as a factor or as its error
        wanted = true["value"] - 1.0 if "gain" in true["words"] and abs(value) < 0.5 else true["value"]
        yield name, value, stderr, wanted


def _converted(value: float, entry: Mapping[str, Any], unit: str) -> float | None:
    try:
        return float(convert(value, str(entry.get("unit", "1")), unit))
    except ThsaCosimError:
        return None


def read_score(unit: str, label: Path, study: Path) -> Score:
    """The score of a unit whose diagnosis has ended."""
    found = study / "result.json"
    run = json.loads((study.parent / f"{unit}.json").read_text())
    result = json.loads(found.read_text()) if found.exists() and run["exit_code"] == 0 else None
    spent = run["seconds"] + run.get("plant_seconds", 0.0)
    return score(unit, json.loads(label.read_text()), result, spent, run.get("cpu_seconds"))
