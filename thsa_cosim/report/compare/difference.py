"""What differs between studies: parameters, effects, errors and settings, with the uncertainty of each difference.

A difference d of two estimates with standard errors s₁, s₂ has √(s₁² + s₂²) if the estimates are independent, which
those of separate recordings are; z = d / that. Beyond |z| = 2 a difference is unlikely to be chance (5 %).
"""

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from scipy.stats import norm

from thsa_cosim.errors import InputError
from thsa_cosim.report.compare.ripple import amplitude, pairs
from thsa_cosim.report.folder import Json, Study, read_study
from thsa_cosim.report.parts.text import bound_text, degrees, listing, plus_minus

NOTABLE_Z = 2.0
#: So many changes are told one by one.
_TOLD = 4
_DIGEST = re.compile(r"[0-9a-f]{64}")
Key = tuple[str, str, str]


@dataclass(frozen=True)
class Estimate:
    """A value with its standard error (None: not known), and whether the data determine it.

    ``comparable``: its standard error is that of a difference, too. So it is for what is only not determined because it
    cannot be distinguished from zero: it may well differ from what another study found.
    """

    value: float
    stderr: float | None = None
    determined: bool = True
    comparable: bool = True

    @property
    def is_nothing(self) -> bool:
        """Whether it lies within three standard errors of zero."""
        return self.stderr is not None and abs(self.value) < 3.0 * self.stderr


@dataclass(frozen=True)
class Difference:
    """A study's value less the first study's; ``stderr`` and ``z`` are None without both uncertainties."""

    value: float
    stderr: float | None
    z: float | None


@dataclass(frozen=True)
class Row:
    """One quantity over all studies: ``group`` is parameter, effect, error or result; None where a study lacks it.

    ``at`` is the place: a temperature, a role of recordings.
    """

    group: str
    name: str
    at: str
    unit: str
    values: tuple[Estimate | None, ...]
    same_unit: bool = True
    part_of: str = ""
    """The amplitude that a sine or cosine part belongs to: by itself it depends on where the angle is counted from."""

    def furthest(self) -> float:
        """Less the largest |z|: sorts the surest difference first."""
        return -max((abs(d.z) for d in self.differences if d is not None and d.z is not None), default=0.0)

    @cached_property
    def differences(self) -> tuple[Difference | None, ...]:
        """Of every study from the first one."""
        first = self.values[0]
        return tuple(
            None if first is None or not self.same_unit else _difference(first, v) for v in self.values
        )

    def beyond(self, limit: float) -> bool:
        """Whether some study differs from the first by more than ``limit`` standard errors."""
        return any(d is not None and d.z is not None and abs(d.z) > limit for d in self.differences)

    @property
    def change(self) -> str:
        """What became of the quantity, for two studies: ``fell by 80 ± 3 %``; "" where that says little.

        From nothing there is no share: ``rose from 0.001 ± 0.002 to 1.820 ± 0.004 N.m/rad``.
        """
        first, last, difference = self.values[0], self.values[-1], self.differences[-1]
        if first is None or last is None or difference is None or len(self.values) != 2:
            return ""
        if first.is_nothing or first.value * last.value < 0.0:
            verb = "rose" if difference.value > 0.0 else "fell"
            unit = f" {self.unit}" if self.unit not in ("", "1") else ""
            ends = (plus_minus(v.value, v.stderr) for v in (first, last))
            return f"{verb} from {' to '.join(ends)}{unit}"
        share = abs(difference.value / first.value)
        ratio = last.value / first.value
        errors = [v.stderr / abs(first.value) for v in (last, first) if v.stderr is not None]
        if len(errors) < 2:
            return ""
        stderr = math.hypot(errors[0], ratio * errors[1])
        verb = "fell" if difference.value * first.value < 0.0 else "rose"
        return f"{verb} by {100 * share:.0f} ± {max(100 * stderr, 1.0):.0f} %"


@dataclass(frozen=True, eq=False)
class Comparison:
    """Studies beside the first of them: ``rows`` of quantities, ``settings`` that differ, ``notes`` to read them by."""

    studies: tuple[Study, ...]
    labels: tuple[str, ...]
    rows: tuple[Row, ...]
    settings: tuple[tuple[str, tuple[str, ...]], ...]
    notes: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return the comparison as JSON holds it."""
        return {
            "studies": [
                {"label": label, "folder": str(s.whole.folder), "kind": s.whole.kind, "status": s.status}
                for label, s in zip(self.labels, self.studies, strict=True)
            ],
            "settings": {name: dict(zip(self.labels, values, strict=True)) for name, values in self.settings},
            "quantities": [_row_dict(row, self.labels) for row in self.rows],
            "notes": list(self.notes),
        }

    @cached_property
    def limit(self) -> float:
        """Standard errors that a difference has to exceed, so that of all of them together 5 % do by chance."""
        count = max(sum(self._tested().values()), 1)
        return max(NOTABLE_Z, float(norm.isf(0.5 * (1.0 - 0.95 ** (1.0 / count)))))

    def sentence(self) -> str:
        """What differs, in a sentence."""
        parts = []
        for name, has in self._effects().items():
            if not all(has):
                where = [label for label, one in zip(self.labels, has, strict=True) if one]
                parts.append(f"only {listing(where)} found {name}")
        moved = sorted((r for r in self.rows if not r.part_of and r.beyond(self.limit)), key=Row.furthest)
        tested = self._tested()
        changes = {r.name: f"{r.name} {r.change}" for r in moved if r.change and len(moved) <= _TOLD}
        apart = [name for name in dict.fromkeys(r.name for r in moved) if name not in changes]
        parts += changes.values()
        if apart:
            parts.append(f"{listing(apart)} {'differs' if len(apart) == 1 else 'differ'} beyond chance")
        if len(tested) > len(apart) + len(changes):
            other = "no other value" if moved else "no value"
            parts.append(f"{other} differs beyond chance")
        text = "; ".join(parts) or "no uncertainty is known, so no difference can be tested"
        if text.startswith(("only ", "no ")):  # a name stays as it is
            text = text[0].upper() + text[1:]
        text += f" (|z| > {self.limit:.3g})" if tested else ""
        return f"{text}{self._doubt()}."

    def _doubt(self) -> str:
        """Which of the studies cannot be believed, as the end of the sentence; "" if all can."""
        poor = [
            label for label, study in zip(self.labels, self.studies, strict=True) if _is_unexplained(study)
        ]
        if not poor:
            return ""
        models = "the model leaves" if len(poor) == 1 else "the models leave"
        return f"; this is in doubt, since {models} more than noise in {listing(poor)}"

    def _tested(self) -> dict[str, int]:
        """The quantities whose difference has an uncertainty, with how many differences each has."""
        found: dict[str, int] = {}
        for row in self.rows:
            count = sum(d is not None and d.z is not None for d in row.differences[1:])
            if count and not row.part_of:
                found[row.name] = found.get(row.name, 0) + count
        return found

    def _effects(self) -> dict[str, list[bool]]:
        """Which study found which effect."""
        found: dict[str, list[bool]] = {}
        for row in (r for r in self.rows if r.group == "effect"):
            has = found.setdefault(row.name.partition(".")[0], [False] * len(self.labels))
            found[row.name.partition(".")[0]] = [
                a or b is not None for a, b in zip(has, row.values, strict=True)
            ]
        return found


def compare(folders: Sequence[Path]) -> Comparison:
    """Compare the studies in ``folders`` with the first of them.

    Raises
    ------
    InputError
        If there are fewer than two, one is no study or has no result yet, or they share no quantity.
    """
    if len(folders) < 2:
        raise InputError("A comparison needs two study folders or more: thsa-cosim compare A B.")
    studies = tuple(read_study(folder) for folder in folders)
    for study in studies:
        if study.whole.result is None:
            raise InputError(f"{study.whole.folder} has no result yet; let its study finish first.")
    try:
        found = [_with_amplitudes(dict(_quantities(study))) for study in studies]
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(
            f"A result cannot be read ({error}); repeat the study's command to write it anew."
        ) from None
    keys = list(dict.fromkeys(key for own in found for key in own))
    if not any(all(key in own for own in found) for key in keys):
        raise InputError(
            f"{folders[0]} and the others share no parameter, effect or signal: there is nothing to compare."
        )
    whole = {part: key[1] for own in found for s, c, key in pairs(own) for part in (s, c)}
    rows = tuple(_row(key, [own.get(key) for own in found], whole.get(key, "")) for key in keys)
    settings = tuple(_settings(studies))
    return Comparison(studies, _labels(folders), rows, settings, tuple(_notes(studies, rows)))


def _labels(folders: Sequence[Path]) -> tuple[str, ...]:
    names = [folder.resolve().name for folder in folders]
    return tuple(names) if len(set(names)) == len(names) else tuple(str(folder) for folder in folders)


def _with_amplitudes(found: dict[Key, tuple[Estimate, str]]) -> dict[Key, tuple[Estimate, str]]:
    """The quantities with the amplitudes of ripples before their parts."""
    made: dict[Key, tuple[Key, tuple[Estimate, str]]] = {}
    for sine, cosine, key in pairs(found):
        (s, unit), (c, _) = found[sine], found[cosine]
        size, stderr = amplitude(s.value, c.value, (s.stderr, c.stderr))
        made[sine] = key, (Estimate(size, stderr, stderr is not None), unit)
    ordered: dict[Key, tuple[Estimate, str]] = {}
    for key, value in found.items():
        ordered |= dict([made[key]]) if key in made else {}
        ordered[key] = value
    return ordered


def _row(key: Key, found: Sequence[tuple[Estimate, str] | None], part_of: str) -> Row:
    units = list(dict.fromkeys(item[1] for item in found if item is not None and item[1])) or [""]
    values = tuple(None if item is None else item[0] for item in found)
    return Row(*key, unit=" or ".join(units), values=values, same_unit=len(units) == 1, part_of=part_of)


def _difference(first: Estimate, other: Estimate | None) -> Difference | None:
    if other is None:
        return None
    d = other.value - first.value
    if first.stderr is None or other.stderr is None or not (first.comparable and other.comparable):
        return Difference(d, None, None)
    together = math.hypot(first.stderr, other.stderr)
    return Difference(d, together, d / together if together > 0.0 else None)


def _quantities(study: Study) -> Iterator[tuple[Key, tuple[Estimate, str]]]:
    """Everything of a study that has a number, by group, name and place."""
    result = study.whole.result or {}
    for point in result.get("points", []):
        at = degrees(point["temperature_degC"])
        for name, value in point["parameters"].items():
            # The coefficients of a diagnosis' extended model carry the name of their effect.
            effect = ":" in name and "." in name
            yield ("effect", name, "") if effect else ("parameter", name, at), _estimate(value)
    if study.whole.kind == "diagnose":
        yield from _of_diagnosis(result)
    if study.whole.kind == "tune":
        yield from _of_tuning(result)
    for role, channels in result.get("error", {}).items():
        for name, error in channels.items():
            yield ("error", name, role), (Estimate(float(error["rmse"])), str(error.get("unit", "")))
    if "error" not in result:
        for recording in result.get("recordings", []):
            for name, error in recording["error"].items():
                key = "error", name, f"{recording['role']}: {recording['name']}"
                yield key, (Estimate(float(error["rmse"])), str(error.get("unit", "")))


def _of_diagnosis(result: Json) -> Iterator[tuple[Key, tuple[Estimate, str]]]:
    declared = result.get("parameters") or {}
    for name, value in (declared.get("after") or declared.get("before") or {}).items():
        yield ("parameter", name, degrees(None)), _estimate(value)
    for effect in result.get("effects", []):
        for name, value in effect["parameters"].items():
            yield ("effect", f"{effect['name']}.{name}", ""), _estimate(value)
    errors = result.get("after") or {}
    for role in ("fit", "validate"):
        channels = errors.get(role) or (result.get("before") or {}).get(role) or {}
        for name, error in channels.items():
            yield ("error", name, role), (Estimate(float(error["rmse"])), str(error.get("unit", "")))


def _of_tuning(result: Json) -> Iterator[tuple[Key, tuple[Estimate, str]]]:
    units: Json = result.get("units", {})
    for name, value in result.get("gains", {}).items():
        yield ("parameter", name, ""), (Estimate(float(value)), str(units.get(name, "1")))
    after = result.get("after") or {}
    for name, unit in {"cost": "1", **result.get("term_units", {})}.items():
        if isinstance(after.get(name), int | float):
            yield ("result", name.replace("_", " "), ""), (Estimate(float(after[name])), str(unit))


def _estimate(value: Json) -> tuple[Estimate, str]:
    stderr = value.get("stderr")
    known = float(stderr) if isinstance(stderr, int | float) and math.isfinite(stderr) else None
    found = Estimate(float(value["value"]), known, bool(value.get("identifiable", True)))
    ended = bound_text(value) or "end of its range" in str(value.get("reason", ""))
    comparable = found.determined or (found.is_nothing and not ended)
    return replace(found, comparable=comparable), str(value.get("unit", ""))


def _settings(studies: Sequence[Study]) -> Iterator[tuple[str, tuple[str, ...]]]:
    """What was asked differently, key by key, and which verdicts differ; digests by their first digits."""
    each = [_asked(study) for study in studies]
    one_kind = len({study.whole.kind for study in studies}) == 1
    for name in dict.fromkeys(name for own in each for name in own):
        if not one_kind and any(name not in own for own in each):
            continue  # a question that only one kind of study asks
        values = tuple(own.get(name, "") for own in each)
        if len(set(values)) > 1:
            yield name, tuple(v[:12] if _DIGEST.fullmatch(v) else v for v in values)


def _asked(study: Study) -> dict[str, str]:
    result = study.whole.result or {}
    own = {"kind": study.whole.kind, "status": study.status, "verdict": str(result.get("verdict", ""))}
    asked = {str(k): str(v) for k, v in study.whole.asked.items() if not str(k).endswith("(order)")}
    if not asked:  # written by an older version, or by hand
        own |= {k: str(result.get(k, "")) for k in ("scenario", "seed", "version")}
        own["fmu"] = str(study.whole.fmu.get("sha256") or "")
    return own | asked


def _notes(studies: Sequence[Study], rows: Sequence[Row]) -> Iterator[str]:
    known = [_recordings(study) for study in studies]
    if any(known[0] & other for other in known[1:]):
        yield (
            "Some studies fitted the same recordings, so their estimates are not independent: standard errors of"
            " differences, and z, are only approximate."
        )
    poor = [s.whole.folder.name for s in studies if _is_unexplained(s)]
    if poor:
        yield (
            f"The {'model leaves' if len(poor) == 1 else 'models leave'} more than noise in {listing(poor)}: a small"
            " difference beside a large one may be the model's error, which changes with load and motion; recordings"
            " of one state and motion do not show it. First mend the model: the loop as the drive has it, with the"
            " filters and delays of its signals, then what a diagnosis finds."
        )
    unsure = [r.name for r in rows if _is_untested(r)]
    if unsure:
        names = ", ".join(dict.fromkeys(unsure))
        yield (
            f"Not determined by the data of at least one study, hence no standard error of the difference: {names}."
            " Where the data determine only a combination of them, give one in [fixed], alike in all studies."
        )
    other = [r.name for r in rows if not r.same_unit]
    if other:
        yield f"In different units, so not subtracted: {', '.join(dict.fromkeys(other))}."


def _is_unexplained(study: Study) -> bool:
    return ((study.whole.result or {}).get("trust") or {}).get("verdict") == "not-explained"


def _is_untested(row: Row) -> bool:
    """Whether a study has a value that its data do not determine, so that a difference has no error."""
    tested = all(d is None or d.z is not None for d in row.differences[1:])
    return not tested and any(v is not None and not v.determined for v in row.values)


def _recordings(study: Study) -> set[str]:
    """Digests of the recordings that a study fitted."""
    asked = {str(k): str(v) for part in (study.whole, *study.parts) for k, v in part.asked.items()}
    return {digest for key, digest in asked.items() if key.startswith("recordings.fit[")}


def _row_dict(row: Row, labels: Sequence[str]) -> dict[str, Any]:
    values, differences = {}, {}
    for label, value, difference in zip(labels, row.values, row.differences, strict=True):
        values[label] = None if value is None else {"value": value.value, "stderr": value.stderr}
        if difference is not None and label != labels[0]:
            differences[label] = {
                "difference": difference.value,
                "stderr": difference.stderr,
                "z": difference.z,
            }
    return {
        "group": row.group,
        "name": row.name,
        "at": row.at,
        "unit": row.unit,
        "values": values,
        "differences": differences,
    }
