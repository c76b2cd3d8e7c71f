"""What the terminal shows of a diagnosis."""

import io

from report_studies import diagnose_result
from rich.console import Console

from thsa_cosim.report.diagnose.tables import print_diagnosis


def printed(**changes: object) -> str:
    out = io.StringIO()
    print_diagnosis(Console(file=out, width=400), {**diagnose_result(), "notes": [], **changes})
    return out.getvalue()


def test_verdict_advice_and_what_looks_alike():
    alike = [{"names": ["backlash", "screw-ripple"], "angle_deg": 0.82}]
    text = printed(equivalence=alike)
    assert "tell apart" not in printed()
    assert "The model lacks backlash of the screw (backlash)." in text
    assert "These recordings cannot tell backlash from velocity-sensor-delay." in text
    assert (
        "could not tell apart at an ordinary size: backlash, screw-ripple (principal angle 0.82 deg)" in text
    )
    assert "To tell backlash from velocity-sensor-delay, run slow reversals under no load" in text


def test_empirical_law_is_an_equation_with_units_and_says_whether_it_was_added():
    text = printed(verdict="unexplained-structure", effects=[], unexplained=0.4)
    assert "40 % of the repeatable residual in the worst signal" in text
    assert "(0.031 +- 0.002) |N| sgn(v) at screw + (2e-06 +- 1e-07 N.m.s2/rad2) v |v| at motor" in text
    assert "empirical = true in [diagnose] adds it" in text
    assert "Empirical" not in printed(empirical=None)
