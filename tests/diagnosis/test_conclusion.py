"""What a conclusion says, where that can be told from its parts."""

from thsa_cosim.diagnosis.conclusion import WORTH, note_on_no_law


def test_no_law_is_described_where_effects_leave_little_and_a_note_says_so():
    assert note_on_no_law(WORTH, empirical=False) == note_on_no_law(1.0, empirical=False) == ""
    assert note_on_no_law(0.07, empirical=True) == ""
    said = note_on_no_law(0.07, empirical=False)
    assert "7 %" in said.replace("%", " %").replace("  %", " %")
    assert "empirical = true" in said
