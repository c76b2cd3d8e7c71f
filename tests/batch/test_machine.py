"""The machine's faults are no facts about an FMU: tried again once, then one sentence with place and remedy."""

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import textwrap
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from fmu_sources import build

from thsa_cosim.batch import Experiment, Job, LocalRunner, Outcome, Status
from thsa_cosim.batch.attempts import Attempt, Batch, fault_of
from thsa_cosim.errors import MachineError
from thsa_cosim.signals import FloatArray, Signals

TIME = np.linspace(0.0, 1.0, 101)


def last_value(signals: Signals) -> FloatArray:
    return signals["y"][-1:]


def experiment(name: str = "lag") -> Experiment:
    inputs = Signals(TIME, {"u": np.ones(101)})
    return Experiment(name, build.lag2(), inputs, ("y",), TIME, reduce=last_value)


@pytest.fixture(autouse=True)
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def test_a_swept_temporary_folder_ends_the_batch_with_its_name(temporary: Path) -> None:
    told: list[Outcome] = []

    def sweep(index: int, outcome: Outcome) -> None:
        told.append(outcome)
        if index == 2:
            for folder in temporary.glob("thsa-cosim-*"):
                shutil.rmtree(folder)

    jobs = [Job("lag", {"tau": 0.1 + 0.01 * i}) for i in range(5)]
    jobs += [Job("lag", {"fault": build.FAULTS["segfault"]})] * 2  # brings a fresh worker
    jobs += [Job("lag")] * 5
    with (
        LocalRunner([experiment()], workers=1, backend="python") as runner,
        pytest.raises(MachineError, match=r"removed while it was in use; .*TMPDIR") as caught,
    ):
        runner.run(jobs, sweep)
    assert str(temporary) in str(caught.value)
    assert caught.value.exit_code == 3
    assert {o.status for o in told} <= {Status.OK}


def test_a_missing_temporary_folder_is_named(temporary: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(temporary / "gone"))
    with pytest.raises(MachineError, match="gone was removed"):
        LocalRunner([experiment()])


def test_who_kills_every_worker_from_outside_ends_the_batch() -> None:
    """Two workers in turn are killed in the midst of the same run, but at different times of it."""
    with LocalRunner([experiment()], workers=1, backend="python") as runner:
        runner.run([Job("lag")])

        def kill() -> None:
            for pause in (0.3, 0.5):
                while not [w for w in runner._workers if w.worker_pid and w.progress().serial]:
                    time.sleep(0.01)
                time.sleep(pause)
                os.kill(runner._workers[0].pid, signal.SIGKILL)
                time.sleep(0.2)

        threading.Thread(target=kill, daemon=True).start()
        with pytest.raises(MachineError, match="ended from outside by SIGKILL, twice"):
            runner.run([Job("lag", {"fault": build.FAULTS["slow"], "at": 0.0})])


def test_an_fmu_that_kills_itself_twice_at_the_same_place_has_crashed() -> None:
    with LocalRunner([experiment()], workers=1, backend="python") as runner:
        (outcome,) = runner.run([Job("lag", {"fault": build.FAULTS["shutdown"]})])
    assert outcome.status is Status.CRASH
    assert "SIGTERM while stepping at t = 0.5 s" in outcome.reason


class FailsAtFirst:
    """A reducer whose first call finds the disk full, and later ones do not."""

    def __init__(self, mark: Path, times: int) -> None:
        self.mark, self.times = mark, times

    def __call__(self, signals: Signals) -> FloatArray:
        with self.mark.open("ab") as file:
            file.write(b"x")
        if self.mark.stat().st_size <= self.times:
            raise OSError(28, "No space left on device")
        return np.array([float(os.getpid())])


@pytest.mark.parametrize("times", [1, 2])
def test_the_machines_fault_is_tried_again_once_in_a_fresh_process(tmp_path: Path, times: int) -> None:
    trial = Experiment("lag", build.lag2(), None, ("y",), TIME, reduce=FailsAtFirst(tmp_path / "mark", times))
    told: list[int] = []
    with LocalRunner([trial], workers=1, backend="python") as runner:
        if times == 2:
            with pytest.raises(MachineError, match="No space left on device"):
                runner.run([Job("lag")], lambda index, _: told.append(index))
            assert told == []
            return
        before = runner._workers[0]
        (outcome,) = runner.run([Job("lag")])
        assert outcome.ok
        assert before not in runner._workers


def test_a_process_that_the_system_killed_for_memory_is_no_crash(monkeypatch: pytest.MonkeyPatch) -> None:
    counts = iter([3, 4])
    monkeypatch.setattr("thsa_cosim.batch.attempts.kills_for_memory", lambda: next(counts))
    batch = Batch([Job("lag")], None)
    attempt = Attempt(Outcome(Status.CRASH, "died"), None, "SIGKILL", True, (4.0, 0.5, 50.0))
    batch.ended(0, attempt)
    assert list(batch.retries) == [0]
    with pytest.raises(MachineError, match="ran out of memory"):
        batch.ended(0, attempt)


def test_memory_refused_without_a_limit_is_the_machines_fault() -> None:
    fault = fault_of(Outcome(Status.MACHINE, "memory ran out"), None)
    assert fault is not None
    assert "refused memory" in str(fault)
    assert fault_of(Outcome(Status.MEMORY, "the run outgrew 200 MiB"), None) is None


MOUNTED = """
    import shutil, sys, tempfile
    from pathlib import Path
    import numpy as np
    from thsa_cosim.batch import Experiment, Job, LocalRunner
    from thsa_cosim.errors import MachineError
    how, folder = sys.argv[2:]
    tempfile.tempdir = folder
    told = []
    def fill(index, outcome):
        told.append(str(outcome.status))
        if how == "later" and index == 1:
            with open(folder + "/ballast", "wb") as file:
                try:
                    while True:
                        file.write(bytes(65536)); file.flush()
                except OSError:
                    pass
    if how == "first":
        fill_with = open(folder + "/ballast", "wb")
        try:
            while True:
                fill_with.write(bytes(65536)); fill_with.flush()
        except OSError:
            pass
    one = Experiment("lag", Path(sys.argv[1]), None, ("y",), np.linspace(0.0, 1.0, 101))
    try:
        with LocalRunner([one], workers=1, backend="python") as runner:
            runner.run([Job("lag")] * 3 + [Job("lag", {"fault": 1.0})] + [Job("lag")] * 3, fill)
    except MachineError as error:
        print(error)
    print(sorted(set(told)))
"""


@pytest.mark.parametrize(
    ("how", "options", "says"),
    [
        ("noexec", "noexec", "is mounted noexec, so no FMU can be loaded from it; mount it with exec"),
        ("first", "size=4m", "is full; make room there, or set TMPDIR"),
        ("later", "size=4m", "is full; make room there, or set TMPDIR"),
    ],
)
def test_a_full_or_noexec_temporary_folder(tmp_path: Path, how: str, options: str, says: str) -> None:
    if shutil.which("unshare") is None or subprocess.run(["unshare", "-m", "true"], check=False).returncode:
        pytest.skip("mounting a folder of its own needs `unshare -m` (root)")
    place = tmp_path / "place"
    place.mkdir()
    script = tmp_path / "script.py"
    script.write_text(textwrap.dedent(MOUNTED))
    command = f"mount -t tmpfs -o {options} tmpfs {place} && exec {sys.executable} {script} "
    command += f"{build.lag2()} {how} {place}"
    done = subprocess.run(
        ["unshare", "-m", "sh", "-c", command], capture_output=True, text=True, timeout=120, check=False
    )
    if "mount" in done.stderr:
        pytest.skip(f"cannot mount here: {done.stderr.strip()}")
    assert f"The temporary folder {place} {says}" in done.stdout, done.stderr
    assert done.stdout.splitlines()[-1] in ("[]", "['ok']")


def test_signals_of_the_fmus_own_are_no_outside_kill() -> None:
    batch = Batch([Job("lag")], None)
    for at in (1.0, 2.0):
        died = Attempt(Outcome(Status.CRASH, f"{at}"), None, signal.SIGSEGV.name, True, (4.0, at, 0.0))
        batch.ended(0, died)
    assert [o.reason for o in batch.result()] == ["2.0"]
