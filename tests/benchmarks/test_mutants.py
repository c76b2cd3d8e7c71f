"""The report of mutation testing, on lines as mutmut prints them."""

import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parents[2] / "benchmarks"))
from mutants import report


def test_report_counts_what_was_noticed_and_lists_what_survived(capsys: pytest.CaptureFixture[str]):
    lines = [f"room.gates.x_objection__mutmut_{k}: killed" for k in range(8)]
    lines += ["room.score.xǁScoredǁname__mutmut_1: timeout", "room.score.x_polish__mutmut_2: not checked"]
    assert report([*lines, "room.score.x_polish__mutmut_3: survived"]) == 0
    printed = capsys.readouterr().out
    assert "room.gates" in printed
    assert "9 of    10   90.0 %" in printed
    assert printed.splitlines()[-1] == "room.score.x_polish__mutmut_3: survived"
    assert report([*lines, "room.a.x_b__mutmut_1: no tests", "room.a.x_b__mutmut_2: survived"]) == 1
    assert report([]) == 1
