"""What mutation testing says: of all mutants, and of all from a sample of them."""

import math
import sys
from collections import Counter
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parents[2] / "benchmarks"))
from mutants import estimate, meant, module, report, sample


def test_report_counts_what_was_noticed_and_lists_what_survived(capsys: pytest.CaptureFixture[str]):
    known = {f"room.gates.x_objection__mutmut_{k}": "killed" for k in range(8)}
    known |= {"room.score.xǁScoredǁname__mutmut_1": "timeout", "room.score.x_polish__mutmut_3": "survived"}
    assert report(known) == 0, "nine of ten are the goal"
    printed = capsys.readouterr().out.splitlines()
    assert printed[0] == "room.score.x_polish__mutmut_3: survived"
    assert printed[1].startswith("room.gates ")
    assert "9 of    10 tried of    10   90.0 %" in printed[-1]
    assert report(known | {"room.a.x_b__mutmut_1": "no tests"}) == 1
    assert report(known | {"room.a.x_b__mutmut_1": "segfault"}) == 0
    assert report({}) == report({"room.a.x_b__mutmut_1": "not checked"}) == 1


def test_some_of_every_module_speak_for_all_with_each_module_by_its_size(capsys: pytest.CaptureFixture[str]):
    """100 mutants that are noticed wholly, and 900 of which half are: 50 of each were tried."""
    known = {f"room.a.x_f__mutmut_{k}": "killed" for k in range(100)}
    known |= {f"room.b.x_f__mutmut_{k}": "killed" if k % 2 else "survived" for k in range(900)}
    some = {n: s if int(n.rpartition("_")[2]) < 50 else "not checked" for n, s in known.items()}
    assert report(some) == 1
    printed = capsys.readouterr().out
    assert "75 of   100 tried of  1000   75.0 %" in printed
    assert "of all 1000 mutants 55.0 +- 6.2 %" in printed.splitlines()[-1]
    assert printed.count("survived") == 25
    share, error = estimate(Counter(a=50, b=25), Counter(a=50, b=50), Counter(a=100, b=900))
    assert share == pytest.approx(0.55)
    assert error == pytest.approx(0.9 * math.sqrt(0.25 / 49 * (1 - 50 / 900)))
    assert estimate(Counter(a=9), Counter(a=10), Counter(a=10)) == (0.9, 0.0), "all of them is no sample"


def test_a_sample_makes_as_many_of_each_module_known_and_repeats_itself():
    known = {f"room.a.x_f__mutmut_{k}": "not checked" for k in range(100)}
    known |= {f"room.b.x_f__mutmut_{k}": "not checked" for k in range(3)}
    drawn = sample(known, 10, seed=1)
    assert Counter(map(module, drawn)) == {"room.a": 10, "room.b": 3}
    assert len(set(drawn)) == 13
    assert drawn == sample(known, 10, seed=1) != sample(known, 10, seed=2)
    more = sample(known | dict.fromkeys(drawn, "killed"), 12, seed=1)
    assert len(more) == 2
    assert not set(more) & set(drawn)
    assert sample(known | dict.fromkeys(drawn, "killed"), 10, seed=1) == []
    assert list(meant(known, ["room.b*"])) == [f"room.b.x_f__mutmut_{k}" for k in range(3)]
    assert meant(known, []) == known
