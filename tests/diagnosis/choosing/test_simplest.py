"""Of two forms of one effect that explain as much, the one with fewer coefficients."""

from types import SimpleNamespace
from typing import Any

import pytest

from thsa_cosim.diagnosis.choosing.selection import simplest_first


def scored(effect: str, slot: str, coefficients: int, gain: float) -> Any:
    candidate = SimpleNamespace(
        effect=SimpleNamespace(name=effect),
        slot=SimpleNamespace(name=slot),
        component="block",
        coefficients=tuple(range(coefficients)),
    )
    return SimpleNamespace(candidate=candidate, held_out_gain=gain)


def ties(other: Any, best: Any) -> bool:
    return bool(other.held_out_gain > best.held_out_gain - 5.0)


@pytest.mark.parametrize(
    ("other", "first"),
    [
        (scored("friction", "gear", 1, 96.0), 1),
        (scored("friction", "gear", 1, 90.0), 0),  # it explains less
        (scored("friction", "motor", 1, 99.0), 0),  # another place is a rival
        (scored("ripple", "gear", 1, 99.0), 0),  # another effect, too
        (scored("friction", "gear", 2, 99.0), 0),  # not simpler
    ],
)
def test_the_simplest_form_that_explains_as_much_comes_first(other: Any, first: int) -> None:
    found = [scored("friction", "gear", 2, 100.0), other, scored("wind", "gear", 1, 50.0)]
    ordered = simplest_first(found, ties)
    assert ordered[0] is found[first]
    assert len(ordered) == 3
    assert ordered[2] is found[2]
    assert simplest_first([], ties) == []
