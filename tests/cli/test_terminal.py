"""What a person sees: progress on a terminal, plain lines in a pipe, no colour where none is wanted, completion."""

import os
import pty
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from thsa_cosim.report.progress import ProgressDisplay, console
from thsa_cosim.study import Progress

ROOT = Path(__file__).parents[2]
ESCAPE = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")
COLOUR = re.compile(r"\x1b\[(?:\d+;)*(?:3[0-7]|9[0-7]|38;[0-9;]+)m")
needs_fmu = pytest.mark.skipif(
    not (ROOT / "fmus" / "Screw.fmu").exists(), reason="fmus/Screw.fmu has not been exported"
)


@pytest.fixture(scope="module")
def scenario(tmp_path_factory: pytest.TempPathFactory) -> Path:
    text = (ROOT / "scenarios" / "screw.toml").read_text()
    for old, new in {
        '"../fmus/': f'"{ROOT / "fmus"}/',
        '"recordings/screw_*.parquet"': f'"{ROOT}/scenarios/recordings/screw_m30.parquet"',
        # Local searches would be over before a bar is drawn.
        'method = "local-first"': 'method = "differential-evolution"',
        "generations = 30": "generations = 60",
    }.items():
        assert old in text
        text = text.replace(old, new)
    path = tmp_path_factory.mktemp("terminal") / "screw.toml"
    path.write_text(text)
    return path


def command(scenario: Path, study: Path, kind: str = "identify") -> list[str]:
    words = [kind, scenario, "-o", study, "--workers", 1, "--no-report"]
    return [sys.executable, "-m", "thsa_cosim.cli", *map(str, words)]


def on_terminal(words: list[str], **environment: str) -> str:
    """Run on a pseudo-terminal of 120 columns; return everything that was written to it."""
    master, slave = pty.openpty()
    settings = {k: v for k, v in os.environ.items() if k not in ("NO_COLOR", "FORCE_COLOR")}
    settings |= {"TERM": "xterm-256color", "COLUMNS": "120", **environment}
    process = subprocess.Popen(words, stdout=slave, stderr=slave, stdin=slave, env=settings, close_fds=True)
    os.close(slave)
    written = b""
    while True:
        try:
            part = os.read(master, 65536)
        except OSError:  # Linux: the other end was closed
            break
        if not part:
            break
        written += part
    os.close(master)
    assert process.wait(60) == 0, written.decode()
    return written.decode()


@pytest.mark.slow
@needs_fmu
def test_a_terminal_shows_a_bar_with_rate_time_cost_and_failures(scenario: Path, tmp_path: Path) -> None:
    written = on_terminal(command(scenario, tmp_path / "study"), NO_COLOR="1")
    assert not COLOUR.search(written)
    plain = ESCAPE.sub("", written)
    bars = [line for line in re.split(r"[\r\n]+", plain) if re.search(r"[━╸╺].*runs", line)]
    assert bars
    # A vector that was simulated before (by a local search, say) is taken from the journal, also in a new study.
    rate = r"(\d+ from the journal, )?\d+ runs/s, \d+ s left"
    state = rf"searching .* \d+/\d+ runs, {rate}, best cost [\d.e+]+ to [\d.e+]+, 0 failed"
    assert any(re.search(state, line) for line in bars), bars[-1]
    # The bar goes when the tables come.
    assert "runs/s" not in plain[plain.index("Identified values") :]


def test_a_terminal_has_colours_unless_they_are_not_wanted() -> None:
    code = "from thsa_cosim.report.progress import console; console().print('[red]stop[/]')"
    words = [sys.executable, "-c", code]
    assert COLOUR.search(on_terminal(words))
    assert not COLOUR.search(on_terminal(words, NO_COLOR="1"))
    piped = subprocess.run(words, capture_output=True, text=True, timeout=60, check=True)
    assert piped.stdout == "stop\n"


@needs_fmu
def test_a_pipe_gets_plain_text_and_quiet_nothing(scenario: Path, tmp_path: Path) -> None:
    words = command(scenario, tmp_path / "study", "simulate")
    done = subprocess.run(words, capture_output=True, text=True, timeout=120, check=True)
    assert "\x1b" not in done.stdout + done.stderr
    assert re.fullmatch(r" +[\d.]+ s  1 of 1 recordings simulated\n", done.stderr)
    tables = [line for line in done.stdout.splitlines() if line.startswith("│")]
    assert tables
    assert max(map(len, tables)) <= 140
    again = subprocess.run([*words, "--quiet"], capture_output=True, text=True, timeout=120, check=True)
    assert again.stdout + again.stderr == ""


def test_a_reader_that_leaves_is_no_failure() -> None:
    """As in ``thsa-cosim example | head -1``."""
    read, write = os.pipe()
    os.close(read)
    words = [sys.executable, "-m", "thsa_cosim.cli", "example"]
    done = subprocess.run(words, stdout=write, stderr=subprocess.PIPE, text=True, timeout=60, check=False)
    os.close(write)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_step_is_said_once(capsys: pytest.CaptureFixture[str]) -> None:
    """A stage tells each of its own steps under the same name."""
    with ProgressDisplay(console(stderr=True)) as display:
        for stage in ("stage 1 of 2", "stage 1 of 2", "stage 2 of 2", "stage 1 of 2"):
            display(Progress(stage))
    said = [line.partition(" s  ")[2] for line in capsys.readouterr().err.splitlines()]
    assert said == ["stage 1 of 2", "stage 2 of 2", "stage 1 of 2"]


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash here")
def test_bash_completes_commands_and_options(tmp_path: Path) -> None:
    script = tmp_path / "thsa-cosim"
    script.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m thsa_cosim.cli "$@"\n')
    script.chmod(0o755)
    ask = (
        'eval "$(thsa-cosim completion bash)";'
        " complete_words() { COMP_WORDS=(thsa-cosim $1); COMP_CWORD=${#COMP_WORDS[@]};"
        " COMP_CWORD=$((COMP_CWORD - 1)); COMPREPLY=(); _thsa_cosim_completion thsa-cosim;"
        ' echo "${COMPREPLY[@]}"; };'
        ' complete_words "ide"; complete_words "tune --s"'
    )
    environment = {**os.environ, "PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}"}
    done = subprocess.run(
        ["bash", "-c", ask], capture_output=True, text=True, env=environment, timeout=60, check=True
    )
    assert done.stdout.split() == ["identify", "--seed"]
