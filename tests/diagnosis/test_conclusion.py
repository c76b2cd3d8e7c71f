"""What a conclusion says, where that can be told from its parts."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.analytic import candidates
from thsa_cosim.diagnosis import conclusion as room
from thsa_cosim.diagnosis.conclusion import WORTH, Conclusion, note_on_no_law


def test_no_law_is_described_where_effects_leave_little_and_a_note_says_so():
    assert note_on_no_law(WORTH, "", empirical=False) == note_on_no_law(1.0, "", empirical=False) == ""
    assert note_on_no_law(0.07, "", empirical=True) == ""
    said = note_on_no_law(0.07, "", empirical=False)
    assert "7 %" in said.replace("%", " %").replace("  %", " %")
    assert "empirical = true" in said


def test_no_law_is_described_beside_what_makes_the_model_stick_and_slip():
    assert note_on_no_law(1.0, "stribeck:screw", empirical=True) == ""
    said = note_on_no_law(1.0, "stribeck:screw", empirical=False)
    assert "stribeck:screw" in said
    assert "empirical = true" in said


@pytest.mark.parametrize(
    ("effect", "values"), [("stribeck", {"dF": 0.6, "v_S": 4.0, "n": 1.0}), ("windage", {"c": 1e-3})]
)
def test_what_falls_over_the_speed_is_what_makes_it_stick(effect: str, values: dict[str, float]):
    one = next(c for c in candidates(effect) if not c.variant.beside)
    at = {p.variable: values[p.name] for p in one.parameters if p.name in values}
    final = SimpleNamespace(unknowns=SimpleNamespace(named=lambda _vector: at), vector=np.zeros(0))
    asked: Any = SimpleNamespace(
        found=SimpleNamespace(accepted=(SimpleNamespace(candidate=one),), final=final, sticking=())
    )
    assert Conclusion._sticking(asked) == (one.name if effect == "stribeck" else "")
    asked.found.sticking = ("a:b",)
    assert Conclusion._sticking(asked) == "a:b", "or what was found in step, be it dropped since"


@pytest.mark.parametrize("sticking", [(), ("a:b",)])
def test_an_extended_model_that_sticks_and_slips_is_not_identified_from_the_drawing(
    monkeypatch: pytest.MonkeyPatch, sticking: tuple[str, ...]
):
    monkeypatch.setattr(room, "by_samples", lambda *_given: None)
    asked: list[Any] = []
    own: Any = SimpleNamespace(
        trials=(), bench=SimpleNamespace(trials=()), found=SimpleNamespace(sticking=sticking),
        _identify=lambda _fmu, _unknowns, starts, *_rest: asked.extend(starts),
    )  # fmt: skip
    hint, drawing = np.array([2.0]), np.array([1.0])
    unknowns: Any = SimpleNamespace(
        names=("a",), at_drawing=lambda vector: drawing if vector is hint else None
    )
    final: Any = SimpleNamespace(at=lambda _names: hint)
    Conclusion._identify_near(own, final, None, unknowns, ())  # type: ignore[arg-type]
    assert asked == ([hint] if sticking else [drawing, hint])
