"""What the fuzzer has found once, kept as tests of their own."""

import os
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from small_scenario import toml

from fuzzing.material import motor, samples
from thsa_cosim.cli import run_command
from thsa_cosim.costs import rmse
from thsa_cosim.recordings import Column, TimeAxis, quantum, read_recording

ROOT = Path(__file__).parents[2]
MOTOR = ROOT / "scenarios" / "motor.toml"
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="pipes and links as POSIX has them")


@pytest.mark.slow
def test_tuning_finds_its_fmu_by_a_relative_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    # Margins are computed in worker processes, whose working directory is another.
    text = (ROOT / "scenarios" / "table4.toml").read_text(encoding="utf-8")
    for old, new in (
        ("../fmus", "fmus"),
        ("population = 45", "population = 5"),
        ("generations = 30", "generations = 1"),
        ("stop = 1.2", "stop = 0.6"),
        ("[1.0, 1.2]", "[0.5, 0.6]"),
    ):
        assert old in text
        text = text.replace(old, new)
    (tmp_path / "table4.toml").write_text(text[: text.index("[surface]")] + '[pareto]\nx = "effort"\n')
    (tmp_path / "fmus").symlink_to(ROOT / "fmus")
    monkeypatch.chdir(tmp_path)
    code = run_command(["tune", "table4.toml", "-o", "study", "--workers", "1"])
    errors = capsys.readouterr().err
    assert code in (0, 3), errors  # five sets of gains need not keep every requirement
    assert "usable response" not in errors


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (os.mkfifo, "it is a folder, pipe or device"),
        (lambda path: path.symlink_to("/dev/zero"), "it is a folder, pipe or device"),
        (lambda path: path.symlink_to(path), "symbolic link"),
    ],
    ids=["pipe", "endless", "loop"],
)
def test_a_recording_that_is_no_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], make: Callable[[Path], None], words: str
) -> None:
    path = tmp_path / "bench.csv"
    make(path)
    assert run_command(["identify", str(MOTOR), "--fit", str(path), "-o", str(tmp_path / "study")]) == 2
    errors = capsys.readouterr().err
    assert errors.count("\n") == 1
    assert words in errors


def test_an_fmu_that_is_a_pipe(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    os.mkfifo(tmp_path / "pipe.fmu")
    assert run_command(["check", str(tmp_path / "pipe.fmu")]) == 2
    assert "is a pipe or device" in capsys.readouterr().err


def test_memory_that_does_not_suffice_is_one_sentence(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def greedy(*_: object, **__: object) -> None:
        raise MemoryError

    monkeypatch.setattr("thsa_cosim.check.check_fmu", greedy)
    assert run_command(["check", "any.fmu"]) == 3
    assert capsys.readouterr().err.startswith("error: there is not enough memory")


@pytest.mark.slow
def test_a_cost_without_a_finite_value_names_its_channel(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    frame = samples("motor_m30")
    frame["q_current_A"] *= 1e-322  # noise that squares to 0
    frame.to_csv(tmp_path / "tiny.csv", index=False)
    scenario = tmp_path / "motor.toml"
    scenario.write_text(toml(motor()), encoding="utf-8")
    (tmp_path / "Motor.fmu").symlink_to(ROOT / "fmus" / "Motor.fmu")
    arguments = ["identify", str(scenario), "--fit", str(tmp_path / "tiny.csv"), "--workers", "1"]
    assert run_command([*arguments, "-o", str(tmp_path / "study")]) == 3
    assert "the cost of i_q is not finite" in capsys.readouterr().err


def test_a_root_mean_square_of_huge_errors_is_no_overflow() -> None:
    huge = np.array([1e200, -1e200])
    assert rmse(np.zeros(2), huge) == pytest.approx(1e200)
    assert rmse(huge, huge) == 0.0


def test_samples_that_span_next_to_no_time(tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text("t,v\n0,1\n5e-324,2\n1e-323,3\n")
    recording = read_recording(tmp_path / "run.csv", {"v": Column("v", "m/s")}, time=TimeAxis("t", "s"))
    assert recording.signals.time.size == 3


def test_the_quantum_of_values_beyond_single_precision() -> None:
    assert quantum(1e300 * np.repeat([1.0, 2.0, 3.0, 4.0], 10)) == pytest.approx(1e300)
