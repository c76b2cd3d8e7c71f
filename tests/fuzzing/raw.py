"""Mutations of bytes, text and single values; all drawn from a ``random.Random``."""

import datetime
import math
from collections.abc import Callable
from random import Random
from typing import Any

ODD_NUMBERS: tuple[Any, ...] = (
    0, -1, 1, 2, 0.0, -0.0, 1e-300, 5e-324, 1e300, -1e300, 1e-9, 1e9, math.nan, math.inf, -math.inf,
    2**31, 2**53 + 1, 2**63, -(2**63), 10**40, 0.1, -0.5,
)  # fmt: skip
ODD_TEXT = (
    "", " ", "x", "none", "nan", "inf", "0", "1e999", "-", "*", "**", "?", "[", "[z-a]", ".", "..", "../..", "/",
    "//", "~", "~root", "/dev/null", "a/b", "\\", "con", "a" * 5000, "ä", "𝜓", "\u202e", "e\u0301", "%s", "{0}",
    "{key}", "$HOME", "'; rm", "<b>", "[bold]x[/bold]", "[/]", "m/s", "degC", "K", "parsec", "m//s", "m**999999",
    "1/0", "mm", "__class__", "\t", "a\nb",
)  # fmt: skip


def odd_value(rng: Random, old: Any = None) -> Any:
    """Return a value that nobody meant, often of the type of ``old``."""
    if isinstance(old, bool) and rng.random() < 0.5:
        return not old
    if isinstance(old, int | float) and rng.random() < 0.75:
        return rng.choice((_odd_number, _scaled))(rng, old)
    if isinstance(old, str) and rng.random() < 0.6:
        return rng.choice((lambda: rng.choice(ODD_TEXT), lambda: misspell(rng, old)))()
    others: tuple[Callable[[], Any], ...] = (
        lambda: rng.choice(ODD_NUMBERS),
        lambda: rng.choice(ODD_TEXT),
        lambda: rng.random() < 0.5,
        lambda: [],
        lambda: {},
        lambda: [old, old] if old is not None else [[]],
        lambda: {rng.choice(ODD_TEXT): old if old is not None else 1},
        lambda: datetime.date(2026, 1, 31),
        lambda: datetime.time(12, 0),
    )
    return rng.choice(others)()


def _odd_number(rng: Random, _old: float) -> Any:
    return rng.choice(ODD_NUMBERS)


def _scaled(rng: Random, old: float) -> Any:
    factor = rng.choice((-1, 0.5, 2, 1000, 0.001, 1e6, 1e-6, 1 + 1e-15))
    changed = old * factor + rng.choice((0, 0, 1, -1))
    return int(changed) if isinstance(old, int) and abs(changed) < 1e15 and rng.random() < 0.7 else changed


def misspell(rng: Random, word: str) -> str:
    """Return ``word`` as a hasty person types it."""
    if len(word) < 2:
        return word + rng.choice("xX_ ")
    k = rng.randrange(len(word) - 1)
    return rng.choice(
        (
            word[:k] + word[k + 1] + word[k] + word[k + 2 :],
            word[:k] + word[k + 1 :],
            word[:k] + word[k] + word[k:],
            word.upper(),
            word + " ",
            word[: k + 1],
            word[:k] + rng.choice("äZ.*[]\"'/ ") + word[k + 1 :],
        )
    )


def mutate_bytes(rng: Random, data: bytes, most: int = 8) -> bytes:
    """Flip, cut, repeat, insert or blank some of ``data``."""
    changed = bytearray(data)
    for _ in range(rng.randint(1, most)):
        start = rng.randrange(len(changed) + 1)
        length = min(int(rng.expovariate(1 / 16)) + 1, len(changed) - start)
        match rng.randrange(8):
            case 0 | 1 if start < len(changed):
                changed[start] ^= 1 << rng.randrange(8)
            case 2:
                del changed[start : start + length]
            case 3:
                changed[start:start] = changed[start : start + length]
            case 4:
                changed[start:start] = rng.randbytes(length)
            case 5:
                changed[start : start + length] = bytes(length)
            case 6:
                changed[start : start + length] = rng.choice((b"\xff", b"\x80", b"\x7f")) * length
            case 7 if rng.random() < 0.3:
                del changed[rng.randrange(len(changed) + 1) :]
    return bytes(changed)


def mutate_text(rng: Random, text: str, separators: str = ",") -> str:
    """Change lines and cells of a text: repeat, drop, swap, replace, misspell."""
    lines = text.split("\n")
    for _ in range(rng.randint(1, 4)):
        # The head of a file decides how the rest is read, so it is hit half of the time.
        k = rng.randrange(min(3, len(lines)) if rng.random() < 0.5 else len(lines))
        cells = lines[k].split(separators)
        j = rng.randrange(len(cells))
        match rng.randrange(9):
            case 0:
                del lines[k]
            case 1:
                lines.insert(k, lines[rng.randrange(len(lines))])
            case 2:
                del cells[j]
            case 3:
                cells.insert(j, str(rng.choice(ODD_NUMBERS)))
            case 4 | 5:
                cells[j] = str(odd_value(rng, rng.choice(("a", 1.5))))
            case 6:
                cells[j] = misspell(rng, cells[j])
            case 7:
                cells = [rng.choice((";", "\t", '"', "#", "\r", "\0", ",")).join(cells)]
            case 8:
                text = "\n".join(lines)
                lines = text[: rng.randrange(len(text) + 1)].split("\n")
                continue
        if k < len(lines):
            lines[k] = separators.join(cells)
        lines = lines or [""]
    return "\n".join(lines)
