"""The amplitude of a ripple, which its sine and cosine part make together: what falls when cogging is compensated."""

import math
import re
from collections.abc import Iterator, Mapping
from typing import TypeVar

#: Sine and cosine part of one wave: a_s and a_c, a_s3 and a_c3, c_s and c_c.
_SINE = re.compile(r"^(?P<before>.*\b)(?P<letter>[a-z])_s(?P<number>\d*)$")
Key = TypeVar("Key", bound=tuple[str, str, str])


def pairs(names: Mapping[Key, object]) -> Iterator[tuple[Key, Key, tuple[str, str, str]]]:
    """Sine part, cosine part and the amplitude's key of every wave among ``names`` (group, name, place)."""
    for key in names:
        group, name, at = key
        match = _SINE.match(name)
        if match is None:
            continue
        cosine = (group, f"{match['before']}{match['letter']}_c{match['number']}", at)
        if cosine in names:
            number = f"_{match['number']}" if match["number"] else ""
            amplitude = f"{match['before']}amplitude{number}"
            yield key, cosine, (group, amplitude, at)  # type: ignore[misc]


def amplitude(
    sine: float, cosine: float, stderr: tuple[float | None, float | None]
) -> tuple[float, float | None]:
    """√(sine² + cosine²) with its standard error to first order; at zero amplitude that of the larger part."""
    size = math.hypot(sine, cosine)
    s, c = stderr
    if s is None or c is None:
        return size, None
    return size, max(s, c) if size == 0.0 else math.hypot(sine * s, cosine * c) / size
