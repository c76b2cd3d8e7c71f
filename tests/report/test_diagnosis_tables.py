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
    assert "could not distinguish" not in printed()
    assert "The model lacks backlash of the screw (backlash)." in text
    assert "These recordings cannot distinguish backlash from velocity-sensor-delay." in text
    assert (
        "could not distinguish effects of a typical size: backlash, screw-ripple (principal angle 0.82 deg)"
        in text
    )
    assert "To distinguish backlash from velocity-sensor-delay, run slow reversals under no load" in text


def test_empirical_law_is_an_equation_with_units_and_says_whether_it_was_added():
    text = printed(verdict="unexplained-structure", effects=[], unexplained=0.4)
    assert "40 % of the repeatable residual in the worst signal" in text
    assert "(0.031 +- 0.002) |N| sgn(v) at screw + (2e-06 +- 1e-07 N.m.s2/rad2) v |v| at motor" in text
    assert "empirical = true in [diagnose] adds it" in text
    assert "Empirical" not in printed(empirical=None)


def test_laws_that_explain_as_much_as_the_effects_are_said():
    term = {"slot": "currentSensor", "term": "u", "coefficient": -0.06, "unit": "1", "stderr": 3e-4}
    text = printed(instead=[{"terms": [term], "parameters": {}}])
    assert "from an empirical law in place of them: (-0.06 +- 0.0003) u at currentSensor." in text
    assert "in place of them" not in printed()
    alone = printed(
        verdict="unexplained-structure", effects=[], instead=[{"terms": [term], "parameters": {}}]
    )
    assert "could not distinguish this law from another: (-0.06 +- 0.0003) u at currentSensor." in alone


def test_not_tested_and_what_is_left_beside_an_effect_are_said():
    assert "No effect could be tried on this model" in printed(verdict="not-tested", effects=[])
    text = printed(verdict="unexplained-structure", unexplained=0.02)
    assert "The model lacks backlash of the screw (backlash); a repeatable residual is left" in text
    assert "(2 % of the repeatable residual in the worst signal)" in text


def test_the_order_of_a_ripple_and_values_that_are_not_determined_are_said():
    effect = {
        "name": "cogging:motor", "title": "Cogging torque", "equivalent": [], "order": "12, 18 per turn of the motor",
        "parameters": {
            "a_s": {"value": 1.5, "unit": "N.m", "stderr": 42.0, "identifiable": False, "reason": "it is not known"}
        },
    }  # fmt: skip
    ended = {
        "value": 9.0,
        "unit": "kg",
        "stderr": 7e-7,
        "identifiable": False,
        "reason": "it ended at the end of its range",
    }
    text = printed(effects=[effect], parameters={"before": {}, "after": {"M": ended}})
    assert "The model lacks cogging torque (cogging:motor, 12, 18 per turn of the motor)." in text
    assert "42 (not determined)" in text
    assert "Not determined: M, it ended at the end of its range." in text
    assert "Not determined: cogging:motor: a_s, it is not known." in text


def test_candidates_of_every_round_are_shown():
    row = {
        "variant": "a",
        "round": 1,
        "fit_gain": 9.0,
        "held_out_gain": 8.0,
        "decision": "rejected",
        "reason": "less well",
    }
    later = {**row, "round": 2, "decision": "accepted", "reason": ""}
    screened = {**row, "variant": "only screened", "round": 2, "held_out_gain": None}
    rows = [line for line in printed(candidates=[row, later, screened]).splitlines() if "│" in line]
    shown = [[cell.strip() for cell in line.strip("│").split("│")] for line in rows if "│ a " in line]
    assert [(cells[0], cells[4]) for cells in shown] == [("1", "rejected"), ("2", "accepted")]
    assert not any("only screened" in line for line in rows)
