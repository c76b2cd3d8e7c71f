"""What mutation testing says: of all mutants, and of all from a sample of them."""

import math
import sys
from collections import Counter
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parents[2] / "benchmarks"))
from mutants import estimate, matches, module, report, sample


def said(known: dict[str, str], tried: list[str] | None = None) -> int:
    return report(known, Counter(map(module, known)), tried)


def test_report_counts_what_was_noticed_and_lists_what_survived(capsys: pytest.CaptureFixture[str]):
    known = {f"room.gates.x_objection__mutmut_{k}": "killed" for k in range(8)}
    known |= {"room.score.xǁScoredǁname__mutmut_1": "timeout", "room.score.x_polish__mutmut_2": "not checked"}
    assert said(known | {"room.score.x_polish__mutmut_3": "survived"}) == 0
    printed = capsys.readouterr().out
    assert "room.gates" in printed
    assert "9 of    10 tried of    11   90.0 %" in printed
    assert printed.splitlines()[-1] == "room.score.x_polish__mutmut_3: survived"
    assert said(known | {"room.a.x_b__mutmut_1": "no tests", "room.a.x_b__mutmut_2": "survived"}) == 1
    assert said({}) == 1


def test_a_sample_speaks_for_all_with_each_module_by_its_size(capsys: pytest.CaptureFixture[str]):
    """A small module that is noticed wholly, and a large one of which half is: 100 and 900 mutants."""
    known = {f"room.a.x_f__mutmut_{k}": "killed" for k in range(100)}
    known |= {f"room.b.x_f__mutmut_{k}": "killed" if k % 2 else "survived" for k in range(900)}
    tried = [name for name in known if int(name.rpartition("_")[2]) < 50]
    assert said(known, tried) == 1
    printed = capsys.readouterr().out
    assert "75 of   100 tried of  1000   75.0 %" in printed
    assert "of all mutants of these modules 55.0 +- 6.2 %" in printed
    assert printed.count("survived") == 25
    share, error = estimate(Counter(a=50, b=25), Counter(a=50, b=50), Counter(a=100, b=900))
    assert share == pytest.approx(0.55)
    assert error == pytest.approx(0.9 * math.sqrt(0.25 / 49 * (1 - 50 / 900)))
    assert estimate(Counter(a=9), Counter(a=10), Counter(a=10)) == (0.9, 0.0), "all of them is no sample"


def test_a_sample_takes_as_many_of_each_module_and_repeats_itself():
    names = [f"room.a.x_f__mutmut_{k}" for k in range(100)] + [f"room.b.x_f__mutmut_{k}" for k in range(3)]
    drawn = sample(names, 10, seed=1)
    assert Counter(map(module, drawn)) == {"room.a": 10, "room.b": 3}
    assert len(set(drawn)) == 13
    assert drawn == sample(names, 10, seed=1) != sample(names, 10, seed=2)
    assert [n for n in names if matches(n, ["room.b*"])] == names[100:]
    assert all(matches(n, []) for n in names)
