"""The fuzzer: what it would notice, that its cases repeat, and a small sample of it (``benchmarks/fuzz.py``)."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from fuzzing import cases
from fuzzing.material import write_material
from fuzzing.sandbox import snapshot

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the sandbox forks, and looks into /proc")

MISBEHAVING = """
import json, os, subprocess, sys, time
from pathlib import Path
from fuzzing.cases import Case
from fuzzing.sandbox import Trial

def hang(_): time.sleep(60)
def crash(_): os.kill(os.getpid(), 11)
def fault(_): print("error: internal fault, please report it", file=sys.stderr); return 3
def trace(_): print("Traceback (most recent call last):", file=sys.stderr); return 2
def mute(_): return 2
def talk(_): print("error: a.\\nerror: b.", file=sys.stderr); return 2
def code(_): return 1
def litter(_): Path("evil").touch(); return 0
def elsewhere(_): Path("../evil").touch(); return 0
def change(_): Path("input").write_text("b"); return 0
def orphan(_): subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"]); return 0
def temporary(_): Path(os.environ["TMPDIR"], "left").touch(); return 0
def nan(_): Path("study").mkdir(); Path("study/result.json").write_text('{"a": NaN}'); return 0
def warn(_): print("x.py:1: RuntimeWarning: overflow", file=sys.stderr); return 0
def good(_): Path("study").mkdir(); Path("study/result.json").write_text("{}"); return 0
def keep(_): Path(os.environ["THSA_COSIM_CACHE"], "library.so").touch(); return 0
def sorry(_): print("error: no such key.", file=sys.stderr); return 2

found = {}
for command in (hang, crash, fault, trace, mute, talk, code, litter, elsewhere, change, orphan, temporary, nan, warn,
                good, keep, sorry):
    folder = Path(sys.argv[1], command.__name__)
    folder.mkdir()
    (folder / "input").write_text("a")
    wants_result = command in (nan, good)
    trial = Trial(Case(command.__name__, folder, ("identify" if wants_result else "check",)), 0.5, command)
    while (verdict := trial.poll()) is None:
        time.sleep(0.01)
    found[command.__name__] = verdict.findings
print(json.dumps(found))
"""
NOTICED = {
    "hang": "hang",
    "crash": "died by SIGSEGV",
    "fault": "internal fault",
    "trace": "traceback",
    "mute": "no single sentence",
    "talk": "no single sentence",
    "code": "exit code 1",
    "litter": "touched outside of the study folder: evil",
    "elsewhere": "wrote outside of the study folder",
    "change": "touched outside of the study folder: input",
    "orphan": "1 processes left behind",
    "temporary": "temporary file left behind: left",
    "nan": "result.json is unusable",
    "warn": "Python warning",
}


def test_misbehaviour_is_noticed_and_good_behaviour_is_not(tmp_path: Path) -> None:
    (cache := tmp_path / "cache").mkdir()
    done = subprocess.run(
        [sys.executable, "-c", MISBEHAVING, str(tmp_path)], env={**os.environ, "THSA_COSIM_CACHE": str(cache)},
        capture_output=True, text=True, timeout=60, check=False, cwd=ROOT / "tests",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["good"] == found["keep"] == found["sorry"] == []
    for name, words in NOTICED.items():
        assert any(words in finding for finding in found[name]), (name, found[name])


@pytest.mark.parametrize("kind", ["scenario", "recording", "fmu"])
def test_a_case_is_drawn_from_kind_seed_and_index_alone(tmp_path: Path, kind: str) -> None:
    write_material(tmp_path / "material")
    made = []
    for base in (tmp_path / "a", tmp_path / "b"):
        case = cases.make_case(kind, 1, 5, material=tmp_path / "material", base=base)
        made.append((case.name, case.arguments, {name for name, _ in snapshot(case.folder)}))
        changed = dict(snapshot(case.folder))
        made[-1] += tuple(changed[name] for name in changed if name.endswith((".toml", ".csv")))
    assert made[0] == made[1]
    other = cases.make_case(kind, 2, 5, material=tmp_path / "material", base=tmp_path / "c")
    assert dict(snapshot(other.folder)) != dict(snapshot(tmp_path / "a" / made[0][0]))


@pytest.mark.slow
def test_a_sample_behaves() -> None:
    done = subprocess.run(
        [sys.executable, str(ROOT / "benchmarks" / "fuzz.py"), "--count", "2", "--seed", "7", "--verbose"],
        capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert json.loads(done.stdout.splitlines()[-1])["cases"] == 2 * (
        len(cases.KINDS) - 1
    )  # diagnosis takes too long
