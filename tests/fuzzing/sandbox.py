"""Run a case in a forked process with a deadline, and judge what it did.

Forking costs milliseconds where a new interpreter takes a second; the command line still starts from the same
state every time, may crash or hang, and starts its own worker processes as ever. Linux only.
"""

import atexit
import hashlib
import json
import os
import re
import resource
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fuzzing.cases import STUDY, Case
from thsa_cosim.cli import run_command

MARK = "THSA_COSIM_FUZZ"
"""Environment variable by which processes that a case has left behind are found."""
CACHE = "THSA_COSIM_CACHE"
"""Environment variable with the folder of compiled libraries, which a case may write to where it is set."""
MEMORY_BYTES = 4 << 30
LONGEST_SENTENCE = 1500
Command = Callable[[list[str]], int]
"""A command line: arguments in, exit code out."""


@dataclass(frozen=True)
class Verdict:
    """How a case ended; ``findings`` is empty if it behaved."""

    case: Case
    code: int | None
    """Exit code; None: killed at the deadline."""
    seconds: float
    output: str
    errors: str
    findings: tuple[str, ...]


@dataclass
class Trial:
    """A case that runs. ``poll`` returns its verdict once it has ended or was killed at its deadline."""

    case: Case
    deadline_s: float
    command: Command = run_command
    _before: dict[str, str] = field(init=False)
    _pid: int = field(init=False)
    _began: float = field(init=False)

    def __post_init__(self) -> None:
        self._aside.mkdir()
        (self._aside / "tmp").mkdir()
        self._before = dict(snapshot(self.case.folder))
        self._began = time.monotonic()
        sys.stdout.flush()
        sys.stderr.flush()
        self._pid = os.fork()
        if self._pid == 0:
            _run(self.command, self.case, self._aside)

    @property
    def _aside(self) -> Path:
        """Console and temporary files of the case, beside its folder."""
        return self.case.folder.with_name(f"{self.case.folder.name}.aside")

    def poll(self) -> Verdict | None:
        """Look whether the case has ended."""
        pid, status = os.waitpid(self._pid, os.WNOHANG)
        seconds = time.monotonic() - self._began
        if pid == 0 and seconds < self.deadline_s:
            return None
        if pid == 0:
            os.kill(self._pid, signal.SIGKILL)
            os.waitpid(self._pid, 0)
        code = None if pid == 0 else os.waitstatus_to_exitcode(status)
        time.sleep(0.0 if code in (0, 2) else 0.05)  # workers that notice their parent's death need a moment
        left = list(_left_behind(self.case.name))
        for process in left:
            os.kill(process, signal.SIGKILL)
        return self._judge(code, seconds, len(left))

    def _judge(self, code: int | None, seconds: float, left: int) -> Verdict:
        output, errors = ((self._aside / name).read_text(errors="replace") for name in ("out", "err"))
        findings = list(_exit_findings(code, output, errors))
        if code == 0 and self.case.writes_result:
            findings += _result_findings(self.case.folder / STUDY / "result.json")
        if code is not None:
            findings += [f"{left} processes left behind"] if left else []
            findings += [f"temporary file left behind: {p.name}" for p in (self._aside / "tmp").iterdir()]
        written = (self._aside / "written").read_text(errors="replace").splitlines()
        findings += [f"wrote outside of the study folder: {path}" for path in written[:5]]
        after = dict(snapshot(self.case.folder))
        for path in sorted(after.keys() | self._before.keys()):
            if path.split("/")[0] != STUDY and after.get(path) != self._before.get(path):
                findings.append(f"touched outside of the study folder: {path[:200]}")
        return Verdict(self.case, code, seconds, output, errors, tuple(findings))

    def remove(self) -> None:
        """Delete the case's folders."""
        shutil.rmtree(self.case.folder, ignore_errors=True)
        shutil.rmtree(self._aside, ignore_errors=True)


def snapshot(folder: Path) -> Iterator[tuple[str, str]]:
    """Every path below ``folder`` with what it is."""
    for root, folders, files in os.walk(folder):
        for name in folders + files:
            path = Path(root, name)
            relative = str(path.relative_to(folder))
            if path.is_symlink():
                yield relative, f"link to {path.readlink()}"
            elif path.is_file():
                yield relative, hashlib.sha256(path.read_bytes()).hexdigest()
            else:
                yield relative, "special"


def _exit_findings(code: int | None, output: str, errors: str) -> Iterator[str]:
    if code is None:
        yield "hang: killed at the deadline"
    elif code < 0:
        yield f"died by {signal.Signals(-code).name}"
    elif code not in (0, 2, 3):
        yield f"exit code {code}"
    if "Traceback (most recent call last)" in output + errors:
        yield "traceback"
    if "internal fault" in errors:
        yield f"internal fault: {_last_line(errors)}"
    if warning := re.search(r"^.*\w+Warning: .*$", output + errors, re.MULTILINE):
        yield f"Python warning: {warning.group()[-200:]}"
    if code == 3 and "verdict: failed" in output:
        return  # the answer of a check, not an error
    if code in (2, 3):
        sentences = [line for line in errors.splitlines() if line.strip()]
        if len([s for s in sentences if s.startswith("error: ")]) != 1 or not sentences[-1].startswith(
            "error: "
        ):
            yield f"no single sentence on stderr: {errors[-300:]!r}"
        elif sentences[-1].endswith(":"):
            yield f"a sentence without an end: {sentences[-1][-300:]!r}"
        elif len(sentences[-1]) > LONGEST_SENTENCE:
            yield f"a sentence of {len(sentences[-1])} characters"


def _last_line(text: str) -> str:
    return (text.strip().splitlines() or [""])[-1]


def _result_findings(path: Path) -> Iterator[str]:
    def refuse(constant: str) -> None:
        raise ValueError(f"it holds {constant}")

    try:
        json.loads(path.read_text(encoding="utf-8"), parse_constant=refuse)
    except (OSError, ValueError) as error:
        yield f"exit code 0, but result.json is unusable: {error}"


def _left_behind(name: str) -> Iterator[int]:
    """Processes that were started by the case ``name`` and still run."""
    mark = f"{MARK}={name}".encode()
    for path in Path("/proc").glob("[0-9]*/environ"):
        try:
            if mark in path.read_bytes().split(b"\0"):
                yield int(path.parent.name)
        except OSError:
            continue  # it has ended, or is not ours


def _run(command: Command, case: Case, aside: Path) -> None:
    """Become ``command`` with the arguments of ``case``; does not return."""
    code = 70  # something outside of the command line failed
    try:
        os.setsid()
        for number, name in ((1, "out"), (2, "err")):
            os.dup2(os.open(aside / name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), number)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        resource.setrlimit(resource.RLIMIT_DATA, (MEMORY_BYTES, MEMORY_BYTES))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 30, 1 << 30))
        tempfile.tempdir = str(aside / "tmp")
        os.environ.update({"TMPDIR": tempfile.tempdir, MARK: case.name, "PYTHONDONTWRITEBYTECODE": "1"})
        os.chdir(case.folder)
        cache = os.environ.get(CACHE)
        kept = (Path(cache),) if cache else ()
        _note_writing_but_in((case.folder / STUDY, aside, *kept), aside / "written")
        sys.argv = ["thsa-cosim", *case.arguments]
        code = command(list(case.arguments))
        sys.stdout.flush()
        atexit._run_exitfuncs()
    except BaseException:
        import traceback

        traceback.print_exc()
    finally:
        sys.stderr.flush()
        os._exit(code)


def _note_writing_but_in(allowed: tuple[Path, ...], notes: Path) -> None:
    """Write down every path elsewhere that Python makes or opens for writing."""
    roots = tuple(str(path.resolve()) for path in allowed)
    writing = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
    notebook = os.open(notes, os.O_WRONLY | os.O_CREAT)

    def watch(event: str, arguments: tuple[Any, ...]) -> None:
        flags = arguments[2] if event == "open" else 0
        if event == "os.mkdir" or (isinstance(flags, int) and flags & writing):
            path = arguments[0]
        elif event in ("os.rename", "os.link", "os.symlink"):
            path = arguments[1]
        else:
            return
        if isinstance(path, str | bytes | os.PathLike):
            where = os.path.realpath(os.fsdecode(path))
            made = event != "os.mkdir" or not Path(where).is_dir()
            if made and not where.startswith(roots) and not where.startswith("/dev/"):
                os.write(notebook, f"{where}\n".encode(errors="replace"))

    sys.addaudithook(watch)
