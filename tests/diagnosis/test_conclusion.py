"""What a diagnosis says beside its numbers."""

from thsa_cosim.diagnosis.catalogue.known import known_effects
from thsa_cosim.diagnosis.conclusion import doubts


def test_what_a_law_simplifies_is_said_once_where_the_effect_is_found():
    backlash, stribeck = known_effects()["backlash"], known_effects()["stribeck"]
    said = list(doubts([backlash, stribeck, backlash]))
    assert len(said) == 1
    assert said[0].startswith("backlash: ")
    assert "the mass behind the contact" in said[0]
    assert list(doubts([stribeck])) == []
