"""Mutations of a scenario's tables: keys, values, whole subtables."""

import copy
from collections.abc import Iterator
from random import Random
from typing import Any

from fuzzing.raw import ODD_TEXT, misspell, odd_value

EFFORT: dict[str, tuple[Any, ...]] = {
    "population": (0, -5, 4, 5, 6, 7.5, "45", True, 10**9, 10**30),
    "generations": (0, -1, 1, 2, 1.5, "30", 10**9, [1]),
    "points": (0, 2, 3, 4, 201, 3.5, "21", [[0.0, 1.0], [0.3, 2.0]], [[0.0, 0.0]], [[0, 0], [0, 1]]),
    "samples": (0, 1, 2, 1001, -8, "8"),
}
"""Keys by which a scenario asks for long work: values that are wrong or small, as long work is no hang."""


def mutate_tables(rng: Random, table: dict[str, Any]) -> dict[str, Any]:
    """Return a copy of ``table`` with one to four mistakes; half of the time such that pass the first look."""
    changed = copy.deepcopy(table)
    mutate = rng.choice((_mutate_anything, _mutate_plausibly))
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        mutate(rng, changed)
    return changed


def _nodes(here: Any) -> Iterator[tuple[Any, Any]]:
    """Every (container, key) below ``here``."""
    pairs = here.items() if isinstance(here, dict) else enumerate(here) if isinstance(here, list) else ()
    for key, value in pairs:
        yield here, key
        yield from _nodes(value)


def _mutate_anything(rng: Random, table: dict[str, Any]) -> None:
    nodes = list(_nodes(table))
    if not nodes:
        return
    here, key = rng.choice(nodes)
    old = here[key]
    if key in EFFORT:
        here[key] = rng.choice(EFFORT[key])
        return
    match rng.randrange(10):
        case 0 | 1 | 2:
            here[key] = odd_value(rng, old)
        case 3:
            del here[key]
        case 4 if isinstance(here, dict):
            here[rng.choice((misspell(rng, key), rng.choice(ODD_TEXT)))] = here.pop(key)
        case 4:
            here.insert(rng.randrange(len(here) + 1), copy.deepcopy(old))
        case 5 | 6:  # what stands elsewhere, here: a unit as a column, a path as a name
            there, other = rng.choice(nodes)
            here[key] = copy.deepcopy(there[other])
        case 7:
            strings = [(h, k) for h, k in nodes if isinstance(h[k], str)]
            there, other = rng.choice(strings)
            there[other] = rng.choice((misspell(rng, there[other]), rng.choice(ODD_TEXT)))
        case 8:
            numbers = [(h, k) for h, k in nodes if type(h[k]) in (int, float) and k not in EFFORT]
            if numbers:
                there, other = rng.choice(numbers)
                there[other] = odd_value(rng, there[other])
        case 9:
            tables = [h[k] for h, k in nodes if isinstance(h[k], dict)] + [table]
            into, (there, other) = rng.choice(tables), rng.choice(nodes)
            into[str(other) if rng.random() < 0.5 else misspell(rng, str(other))] = copy.deepcopy(
                there[other]
            )


def _mutate_plausibly(rng: Random, table: dict[str, Any]) -> None:
    """Change a number, drop a key, or exchange two values of a type: each may be what somebody wants."""
    nodes = list(_nodes(table))
    numbers = [(h, k) for h, k in nodes if type(h[k]) in (int, float)]
    texts = [(h, k) for h, k in nodes if isinstance(h[k], str) and k not in ("kind", "fmu", "scenario")]
    match rng.randrange(6):
        case 0 | 1 | 2 if numbers:
            here, key = rng.choice(numbers)
            if key in EFFORT:
                here[key] = rng.choice(EFFORT[key])
            else:
                scaled = here[key] * rng.choice(
                    (0.0, -1.0, 0.1, 0.9, 1.1, 10.0, 1e3, 1e-3, 1e6, 1e-6, 1e12, 1e-12)
                )
                here[key] = int(scaled) if isinstance(here[key], int) else scaled
        case 3:
            here, key = rng.choice(nodes)
            del here[key]
        case 4:
            (here, key), (there, other) = rng.choice(texts), rng.choice(texts)
            here[key], there[other] = there[other], here[key]
        case _ if numbers:
            (here, key), (there, other) = rng.choice(numbers), rng.choice(numbers)
            if key not in EFFORT and other not in EFFORT:
                here[key], there[other] = float(there[other]), float(here[key])
