"""Which column of a recording is which variable of an FMU.

Every pair gets a score: how alike the words are of the column's name and of the variable's name or description,
and whether the units have one dimension, which they must where both are known. The pairs with the largest sum
are taken (linear assignment), so that ``velocity`` goes to ``v`` where ``velocity_command`` goes to ``v_cmd``.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher

import numpy as np
from scipy.optimize import linear_sum_assignment

from thsa_cosim.fmu import Variable
from thsa_cosim.recordings.columns import FoundColumn, words
from thsa_cosim.units import is_unit, same_dimension

_EMPTY_WORDS = {
    "a",
    "an",
    "and",
    "as",
    "at",
    "by",
    "from",
    "in",
    "is",
    "it",
    "of",
    "on",
    "or",
    "the",
    "to",
    "with",
}
_EMPTY_WORDS |= {"measured", "output", "input", "signal", "value", "sensor", "channel"}
_SHORT = {
    "cmd": "command", "ref": "reference", "set": "reference", "temp": "temperature", "vel": "velocity",
    "pos": "position", "cur": "current", "curr": "current", "volt": "voltage", "acc": "acceleration",
    "spd": "speed", "trq": "torque", "amb": "ambient", "act": "actual",
    "setpoint": "reference", "target": "reference", "demand": "command", "amps": "current", "volts": "voltage",
}  # fmt: skip
#: German words of a bench, also as parts of longer ones (Solldrehzahl), and what they mean.
_GERMAN = {
    "soll": "command", "ist": "actual", "sollwert": "command", "istwert": "actual", "vorgabe": "command",
    "drehzahl": "speed", "winkelgeschwindigkeit": "speed", "geschwindigkeit": "velocity", "weg": "position",
    "position": "position", "lage": "position", "winkel": "angle", "strom": "current", "spannung": "voltage",
    "temperatur": "temperature", "kraft": "force", "drehmoment": "torque", "moment": "torque", "last": "load",
    "druck": "pressure", "beschleunigung": "acceleration", "umgebung": "ambient", "motor": "motor",
    "leistung": "power", "antrieb": "drive", "getriebe": "gearbox", "spindel": "screw", "mutter": "nut",
}  # fmt: skip
_SURE, _LIKELY = 0.5, 0.2
_UNIT = 0.35
"""What an agreement of units counts beside the likeness of the words, which is at most 1 (1.5: the same name)."""


@dataclass(frozen=True)
class Match:
    """A variable and its column; ``why`` is half a sentence for the file."""

    variable: Variable
    column: FoundColumn
    why: str


def match_columns(variables: Sequence[Variable], columns: Sequence[FoundColumn]) -> tuple[Match, ...]:
    """Return the matches of FMU variables with columns, in the order of the variables; each is used once."""
    if not variables or not columns:
        return ()
    likeness = np.array([[_likeness(v, c) for c in columns] for v in variables])
    agree = np.array([[_units_agree(v, c) for c in columns] for v in variables], dtype=object)
    same = agree == True  # noqa: E712 (None: a unit is unknown)
    allowed = (agree != False) & ((likeness >= _SURE) | (same & (likeness >= _LIKELY)))  # noqa: E712
    # The only column of a dimension can be nothing else than its only variable.
    alone = same & (same.sum(axis=0) == 1)[None, :] & (same.sum(axis=1) == 1)[:, None]
    score = np.where(allowed | alone, likeness + _UNIT * same + 1e-3, 0.0)
    rows, chosen = linear_sum_assignment(score, maximize=True)
    found = []
    for i, k in zip(rows.tolist(), chosen.tolist(), strict=True):
        if score[i, k] > 0.0:
            by_name = likeness[i, k] >= _LIKELY
            why = (
                ("by name and unit" if same[i, k] else "by name")
                if by_name
                else "by its unit alone: check this"
            )
            found.append(Match(variables[i], columns[k], why))
    return tuple(found)


def _units_agree(variable: Variable, column: FoundColumn) -> bool | None:
    """Whether the units have one dimension; None if one of them is unknown."""
    if column.unit is None or not variable.unit or not is_unit(variable.unit) or variable.unit == "1":
        return None
    return same_dimension(column.unit, variable.unit)


def _likeness(variable: Variable, column: FoundColumn) -> float:
    name, plain = variable.name.rpartition(".")[2].lower(), "".join(column.words).lower()
    if _letters(column.plain) in (_letters(variable.name), _letters(name)):
        return 2.0 if _letters(column.plain) == _letters(variable.name) else 1.9
    if plain in (name, name.replace("_", "")):
        return 1.5
    own = _meaning(column.words)
    texts = (words(name), words(variable.description), (*words(name), *words(variable.description)))
    letters = SequenceMatcher(None, name.replace("_", ""), plain).ratio()
    return max(0.8 * letters if letters >= 0.75 else 0.0, *(_dice(own, _meaning(text)) for text in texts))


def _letters(name: str) -> str:
    """A name without what separates its words."""
    return "".join(c for c in name.lower() if c.isalnum())


def _english(word: str) -> list[str]:
    """A word, or the meanings of the German words that it is made of; a part that is none stays as it is."""
    if word in _GERMAN:
        return [_GERMAN[word]]
    for part in sorted(_GERMAN, key=len, reverse=True):
        if len(part) > 2 and word.startswith(part):
            return [_GERMAN[part], *(_english(word[len(part) :].removeprefix("s")) if word != part else [])]
        if len(part) > 3 and word.endswith(part):
            return [*_english(word[: -len(part)]), _GERMAN[part]]
    return [word]


def _meaning(found: Sequence[str]) -> set[str]:
    """The words that mean something, in English, abbreviations spelt out, single letters left out."""
    plain = {e for word in found for e in _english(_SHORT.get(word.lower(), word.lower()))}
    return {word for word in plain if len(word) > 1 and word not in _EMPTY_WORDS}


def _dice(a: set[str], b: set[str]) -> float:
    """Share of common words, 0 to 1; words count as common if they differ by an ending or a slip."""
    if not a or not b:
        return 0.0
    common = sum(1 for x in a if any(SequenceMatcher(None, x, y).ratio() >= 0.8 for y in b))
    return 2.0 * common / (len(a) + len(b))
