"""What a conclusion says, where that can be told from its parts."""

from thsa_cosim.diagnosis.conclusion import WORTH, note_on_no_law


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
