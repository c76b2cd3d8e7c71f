"""The command line around the studies: help, versions, one sentence per mistake, never a traceback."""

import gc
import os
import shlex
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

import thsa_cosim
from thsa_cosim import cli
from thsa_cosim.cli.options import StudyOptions
from thsa_cosim.errors import FmuError, MissingExtraError, StudyError

ROOT = Path(__file__).parents[2]
MOTOR = ROOT / "scenarios" / "motor.toml"


def run(*arguments: object, **options: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "thsa_cosim.cli", *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
        **options,
    )


def test_the_package_runs_as_the_command() -> None:
    """Where scripts are not on the PATH, as often on Windows."""
    done = subprocess.run(
        [sys.executable, "-m", "thsa_cosim", "--version"],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert (done.returncode, done.stdout) == (0, run("--version").stdout)


def test_an_empty_folder_has_no_study_and_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run_command(["list", str(tmp_path)]) == 0
    assert (
        capsys.readouterr().out
        == f"No study in {tmp_path} or below; name the folder that holds your studies.\n"
    )


def outcome(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str]:
    """Exit code and stderr of a command line, in this process."""
    code = cli.run_command([str(a) for a in arguments])
    return code, capsys.readouterr().err


def test_version_and_help() -> None:
    done = run("--version")
    assert done.returncode == 0
    assert thsa_cosim.__version__ in done.stdout
    helped = run("--help")
    assert helped.returncode == 0
    for command in ("export", "check", "simulate", "identify"):
        assert command in helped.stdout


def test_help_imports_nothing_heavy() -> None:
    code = (
        "import sys; from thsa_cosim import cli; cli.run_command(['identify', '--help']);"
        "heavy = {'numpy', 'scipy', 'pandas', 'matplotlib', 'fmpy', 'pydantic', 'pint', 'rich'} & set(sys.modules);"
        "sys.exit(str(heavy) if heavy else 0)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr


def test_the_command_alone_shows_its_help() -> None:
    done = run()
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("Usage: thsa-cosim")
    assert "\n  identify " in done.stdout, "one command a line"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["identfy", "x.toml"], "Did you mean 'identify'?"),
        (["frobnicate"], "Known commands: export, check, init, simulate, identify"),
        (["identify"], "Missing argument 'SCENARIO'. Usage: thsa-cosim identify [OPTIONS] SCENARIO."),
        (["identify", ROOT / "scenarios"], "is a folder; name a scenario file (.toml), such as "),
        (
            ["identify", ROOT / "fmus" / "Motor.fmu"],
            "is a model, no scenario file (.toml); 'thsa-cosim init ",
        ),
        (["tune", ROOT / "scenarios" / "recordings" / "motor_m30.parquet"], "'thsa-cosim init MODEL.fmu "),
        (["identify", "x.toml", "--workers", "0"], "--workers"),
        (["identify", "x.toml", "--sed", "1"], "--seed"),
        (["identify", "no/such.toml"], "no/such.toml"),
        (["simulate", "no/such.toml"], "no/such.toml"),
        (["export", "NoSuchModel", "--fmi", "7"], "--fmi"),
    ],
)
def test_mistakes_on_the_command_line(
    capsys: pytest.CaptureFixture[str], arguments: list[object], words: str
) -> None:
    code, err = outcome(capsys, *arguments)
    assert code == 2
    assert err.startswith("error: ")
    assert err.count("\n") == 1
    assert words in err


needs_fmu = pytest.mark.skipif(
    not (ROOT / "fmus" / "Motor.fmu").exists(), reason="fmus/Motor.fmu has not been exported"
)


@needs_fmu
@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('fmu = "../fmus/Motor.fmu"', 'fmu = "../fmus/Motr.fmu"', "Motr.fmu"),
        ('column = "q_current_A"', 'column = "q_curent_A"', "Did you mean 'q_current_A'?"),
        ('variable = "motor.R_s.a0"', 'variable = "motor.R_s.a00"', "Did you mean 'motor.R_s.a0'?"),
        ('unit = "ohm"', 'unit = "V"', "cannot be turned into"),
        ("lower = 0.05", "lower = 50.0", "lower"),
        ("population = 45", "popluation = 45", "population"),
        ('form = "cubic"', 'form = "cubik"', "Did you mean 'cubic'?"),
        ("seed = 1", "seed = 1\nsede = 2", "seed"),
        ('kind = "identify"', 'kind = "identfy"', "Did you mean 'identify'?"),
        ("recordings/motor_*", "recordings/motr_*", "motr_"),
    ],
)
def test_mistakes_in_a_scenario(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, old: str, new: str, words: str
) -> None:
    text = MOTOR.read_text()
    assert old in text
    scenario = tmp_path / "scenarios" / "motor.toml"
    scenario.parent.mkdir()
    (tmp_path / "fmus").symlink_to(ROOT / "fmus")
    (scenario.parent / "recordings").symlink_to(ROOT / "scenarios" / "recordings")
    scenario.write_text(text.replace(old, new, 1))
    code, err = outcome(capsys, "identify", scenario, "-o", tmp_path / "study")
    assert code == 2, err
    assert err.startswith("error: ")
    assert err.count("\n") == 1
    assert words in err
    assert not (tmp_path / "study").exists()


@needs_fmu
@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("time_s,a\n0,1\n", "column"),
        ("", "empty"),
        (None, "no such file"),
    ],
)
def test_bad_recordings(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, content: str | None, words: str
) -> None:
    recording = tmp_path / "bad.csv"
    if content is not None:
        recording.write_text(content)
    code, err = outcome(capsys, "identify", MOTOR, "--fit", recording, "-o", tmp_path / "study")
    assert code == 2
    assert err.count("\n") == 1
    assert words in err
    assert "bad.csv" in err


@pytest.mark.parametrize("content", [b"PK no zip", None])
def test_an_fmu_that_is_none(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, content: bytes | None
) -> None:
    fmu = tmp_path / "bad.fmu"
    if content is None:
        with zipfile.ZipFile(fmu, "w") as archive:
            archive.writestr("readme.txt", "no model description")
    else:
        fmu.write_bytes(content)
    for arguments in (("check", fmu), ("identify", MOTOR, "--fmu", fmu, "-o", tmp_path / "study")):
        code, err = outcome(capsys, *arguments)
        assert code == 2
        assert "bad.fmu" in err
        assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("error", "code", "words"),
    [
        (FmuError("broken.fmu is broken."), 2, "error: broken.fmu is broken."),
        (MissingExtraError("Reading MF4", "mf4"), 2, "pip install 'thsa-cosim[mf4]'"),
        (StudyError("nothing\nworked."), 3, "error: nothing worked."),
        (PermissionError(13, "Permission denied", "/root/x"), 2, "Permission denied (/root/x); allow it"),
        (OSError(28, "No space left on device"), 3, "No space left on device; make room, and give the same"),
        (RuntimeError("boom"), 3, "internal fault, please report it: RuntimeError: boom"),
        (KeyboardInterrupt(), 130, "interrupted"),
    ],
)
def test_every_exception_is_one_sentence(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    error: BaseException,
    code: int,
    words: str,
) -> None:
    def broken(**_: object) -> None:
        raise error

    monkeypatch.setattr(cli.cli.commands["check"], "callback", broken)
    found, err = outcome(capsys, "check", "x.fmu")
    assert found == code
    assert words in err
    assert len(err.strip().splitlines()) == 1


def test_the_command_to_continue_is_the_one_that_was_given_with_its_folder() -> None:
    given = StudyOptions(Path("my scenario.toml"), (), (), None, 3, None, None, None, True, False, True)
    folder = Path("studies/my scenario-2026-01-01")
    text = given.repeat("identify", folder)
    assert text == f"thsa-cosim identify 'my scenario.toml' --seed 3 -o '{folder}'"
    runs = (Path("a.csv"), Path("b.csv"))
    given = StudyOptions(
        Path("s.toml"), runs, (Path("c.csv"),), folder, None, None, 2, None, False, False, True
    )
    words = shlex.split(given.repeat("identify", Path("here")))
    fit = ["--fit", "a.csv", "--fit", "b.csv", "--validate", "c.csv"]
    assert words == ["thsa-cosim", "identify", "s.toml", *fit, "--workers", "2", "-o", "here"]


@pytest.mark.parametrize(("given", "threads"), [({}, 1), ({"OPENBLAS_NUM_THREADS": "2"}, 2)])
def test_a_command_computes_with_one_thread_unless_the_user_sets_more(given: dict[str, str], threads: int):
    program = (
        "from thsa_cosim.cli import run_command; run_command(['--version'])\n"
        "import numpy, scipy.linalg, threadpoolctl\n"
        "print({p['num_threads'] for p in threadpoolctl.threadpool_info() if p['internal_api'] == 'openblas'})"
    )
    unset = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    done = subprocess.run(
        [sys.executable, "-c", program], env=unset | given, capture_output=True, text=True, check=True
    )
    found = done.stdout.splitlines()[-1]
    if found == "set()":
        pytest.skip("NumPy does not use OpenBLAS here")
    assert found == f"{{{min(threads, os.cpu_count() or 1)}}}"


def test_full_collections_are_rare_in_a_command() -> None:
    program = (
        "import atexit, gc; from thsa_cosim.cli import main\n"
        "atexit.register(lambda: print(gc.get_threshold())); main()"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, "--version"], capture_output=True, text=True, timeout=60, check=True
    )
    _, middle, _ = gc.get_threshold()
    assert done.stdout.splitlines()[-1] == str((10_000, middle, 100))
