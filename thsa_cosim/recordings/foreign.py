"""Binary formats whose parsers are not ours, read in a process of their own.

A damaged file makes a parser written in C end its process by a signal, or never end at all; then it is this one that
ends, and the file gets its sentence. ``python -m thsa_cosim.recordings.foreign FORMAT PATH PART`` is the other side: it
writes a line with the column names, reads a line with those to load, and writes the columns (pickled).
"""

import json
import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO, Any

from thsa_cosim.errors import MissingExtraError, RecordingError, ThsaCosimError
from thsa_cosim.recordings.table import Choose, RawColumn

FORMATS = {"mat": ("MAT 7.3", "mat73"), "mf4": ("MF4", "mf4"), "tdms": ("TDMS", "tdms")}
"""Modules that are read apart, with what they read by an optional part, and its name."""
PARTS = {"mat": "h5py", "mf4": "asammdf", "tdms": "nptdms"}
"""The package that is this part."""
DEADLINE_S = 300.0


def read(format_: str, path: Path, choose: Choose) -> dict[str, RawColumn]:
    """Read the columns that ``choose`` picks, as the module ``format_`` of this package does, in another process.

    Raises
    ------
    RecordingError
        If the file cannot be read; also if the process ends without an answer, or within ``DEADLINE_S`` gives none.
    MissingExtraError
        If an optional dependency is needed.
    """
    part = PARTS[format_] if _is_there(PARTS[format_]) else ""
    command = [sys.executable, "-m", "thsa_cosim.recordings.foreign", format_, str(path), part]
    root = str(Path(__file__).parents[2])
    paths = os.pathsep.join([root, os.environ.get("PYTHONPATH", "")])
    # A folder of its own, because a parser that is ended leaves its temporary files behind.
    with TemporaryDirectory(prefix="thsa-cosim-", ignore_cleanup_errors=True) as temporary:
        environment = {
            **os.environ,
            "PYTHONPATH": paths,
            **dict.fromkeys(("TMPDIR", "TEMP", "TMP"), temporary),
        }
        with subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=environment
        ) as process:
            timer = threading.Timer(DEADLINE_S, process.kill)
            timer.start()
            try:
                return _converse(process, format_, path, choose)
            except (EOFError, BrokenPipeError, pickle.UnpicklingError):
                pass
            finally:
                timer.cancel()
                process.kill()
    raise RecordingError(f"{path}: is damaged: its reader ended without an answer; export it again.")


def _is_there(package: str) -> bool:
    try:
        return find_spec(package) is not None
    except ValueError:  # it has been taken out of this process
        return False


def _converse(
    process: "subprocess.Popen[bytes]", format_: str, path: Path, choose: Choose
) -> dict[str, RawColumn]:
    assert process.stdin is not None
    assert process.stdout is not None
    names = _answer(process.stdout, format_)["names"]
    chosen = list(choose(names))
    process.stdin.write(json.dumps(chosen).encode() + b"\n")
    process.stdin.flush()
    _answer(process.stdout, format_)
    columns: dict[str, RawColumn] = pickle.load(process.stdout)
    return columns


def _answer(stream: IO[bytes], format_: str) -> dict[str, Any]:
    """The next line of the other side; what it raised is raised here."""
    line = stream.readline()
    if not line:
        raise EOFError
    answer: dict[str, Any] = json.loads(line)
    if answer.get("missing"):
        feature, extra = FORMATS[format_]
        raise MissingExtraError(f"reading {feature}", extra)
    if "error" in answer:
        raise RecordingError(answer["error"]) if answer["known"] else ValueError(answer["error"])
    return answer


def _serve(format_: str, path: Path, part: str) -> None:
    """The other side; without its optional ``part`` it does as if that were not installed."""
    if not part:
        sys.modules[PARTS[format_]] = None  # type: ignore[assignment]
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # what parsers print is no answer

    def say(content: dict[str, Any]) -> None:
        answers.write(json.dumps(content).encode() + b"\n")
        answers.flush()

    def choose(names: Sequence[str]) -> list[str]:
        say({"names": list(names)})
        wanted: list[str] = json.loads(sys.stdin.readline() or "[]")
        return wanted

    try:
        columns = import_module(f"thsa_cosim.recordings.{format_}").read(path, choose)
    except MissingExtraError:
        say({"missing": True})
    except ThsaCosimError as error:
        say({"error": str(error), "known": True})
    except Exception as error:  # the parsers raise anything on a damaged file
        say({"error": " ".join(str(error).split())[:160] or type(error).__name__, "known": False})
    else:
        say({"columns": len(columns)})
        pickle.dump(columns, answers, protocol=5)
        answers.flush()


if __name__ == "__main__":
    _serve(sys.argv[1], Path(sys.argv[2]), sys.argv[3])
