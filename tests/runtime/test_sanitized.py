"""The C runtime under AddressSanitizer and UndefinedBehaviorSanitizer: random calls, many instances."""

from __future__ import annotations

import functools
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

import pytest

from runtime.harness import HERE, build

SANITIZE = (
    "-g",
    "-O1",
    "-fsanitize=address,undefined",
    "-fno-sanitize-recover=all",
    "-fno-omit-frame-pointer",
)
ENVIRONMENT = {
    **os.environ,
    "ASAN_OPTIONS": "detect_leaks=1:abort_on_error=0:exitcode=9",
    "UBSAN_OPTIONS": "print_stacktrace=1",
}


@functools.cache
def sanitizers_work() -> bool:
    """Whether gcc is here with the sanitizers' libraries."""
    if not shutil.which("gcc"):
        return False
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "a.c"
        source.write_text("int main(void) { return 0; }\n")
        made = subprocess.run(["gcc", *SANITIZE, source, "-o", f"{folder}/a"], capture_output=True)
        return made.returncode == 0 and subprocess.run([f"{folder}/a"], env=ENVIRONMENT).returncode == 0


MODELS = ("stickslip", "saturation", "bench", "linear", "runaway", "kink", "dahlquist")


def fuzz(model: str, fmi: int, sequences: int, calls: int) -> None:
    if not sanitizers_work():
        pytest.skip("needs gcc with AddressSanitizer and UBSan")
    program = build(model, fmi, SANITIZE, (str(HERE / f"fuzz{fmi}.c"),))
    done = subprocess.run(
        [program, str(sequences), str(calls)], capture_output=True, text=True, timeout=500, env=ENVIRONMENT
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-4000:]
    assert f"{sequences} sequences" in done.stdout


@pytest.mark.parametrize("fmi", [2, 3])
def test_random_calls_leave_memory_intact(fmi: int) -> None:
    fuzz("stickslip", fmi, 100, 200)


@pytest.mark.slow
@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("model", MODELS)
def test_thousands_of_instances_of_every_model_under_random_calls(model: str, fmi: int) -> None:
    fuzz(model, fmi, 2000 if model == "stickslip" else 10000, 60)
