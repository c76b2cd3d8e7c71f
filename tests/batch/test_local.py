"""The local runner: every fault is one outcome, nothing is lost, repeated or left behind."""

import os
import random
import signal
import subprocess
import sys
import tempfile
import textwrap
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from fmu.test_plant import lag
from fmu_sources import build

from thsa_cosim.batch import Experiment, Job, LocalRunner, Outcome, Status
from thsa_cosim.batch.inbox import ThreadInbox
from thsa_cosim.batch.supervisor import family
from thsa_cosim.errors import FmuError, ParameterError, StudyError
from thsa_cosim.signals import FloatArray, Signals

TIME = np.linspace(0.0, 1.0, 101)
INPUTS = Signals(TIME, {"u": np.sin(5.0 * TIME)}, {"u": "m/s"})


def last_value(signals: Signals) -> FloatArray:
    return signals["y"][-1:]


def failing_reducer(signals: Signals) -> FloatArray:
    raise ZeroDivisionError("no\nway")


def printing_reducer(signals: Signals) -> FloatArray:
    print("from the reducer")
    return np.array([os.getpid()])


def flooding_reducer(signals: Signals) -> FloatArray:
    """Print 2 MiB, wait until the runner has emptied the console, and print 16 KiB."""
    print(f"flood of {os.getpid()}\n" + "." * 2**21, flush=True)
    until = time.monotonic() + 10.0
    while os.fstat(1).st_size > 2**20 and time.monotonic() < until:
        time.sleep(0.01)
    print("." * 2**14, flush=True)
    return signals["y"][-1:]


def halves_in_single(signals: Signals) -> np.ndarray:
    return np.full(40, 0.5, dtype=np.float32)


def integers(signals: Signals) -> np.ndarray:
    return np.arange(40)


def experiment(name: str = "lag", fmu: Path | None = None, **options: object) -> Experiment:
    settings: dict[str, object] = {"reduce": last_value} | options
    return Experiment(name, fmu or build.lag2(), INPUTS, ("y",), TIME, **settings)  # type: ignore[arg-type]


def fault(name: str, **values: float) -> Job:
    return Job("lag", {"fault": build.FAULTS[name], **values})


def expected(tau: float) -> float:
    return float(lag(TIME, INPUTS["u"], tau, 1.0)[-1])


@pytest.fixture(autouse=True)
def nothing_left_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """No folder, no process and no thread survives a runner."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    before = descendants()
    yield
    assert [p.name for p in tmp_path.iterdir() if p.name.startswith("thsa-cosim")] == []
    assert descendants() - before == set()


def descendants() -> set[int]:
    """Process ids of all children, zombies too, of this process and of theirs."""
    parents: dict[int, int] = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                stat = (entry / "stat").read_text()
            except OSError:
                continue
            parents[int(entry.name)] = int(stat.rsplit(")", 1)[1].split()[1])
    found: set[int] = set()
    frontier = {os.getpid()}
    while frontier:
        frontier = {child for child, parent in parents.items() if parent in frontier} - found
        found |= frontier
    return found


DEADLINE = 1.5

FAULTS = {
    "segfault": (Status.CRASH, "SIGSEGV while stepping at t = 0.5 s"),
    "abort": (Status.CRASH, "SIGABRT while stepping"),
    "exit": (Status.EXIT, "exit code 3 while stepping"),
    "hang": (Status.TIMEOUT, "killed after 1.5 s while stepping at t = 0.5 s"),
    "init_hang": (Status.TIMEOUT, "killed after 1.5 s while initialising"),
    "error": (Status.FMI_ERROR, "fmi2DoStep returned fmi2Error at t = 0.5 s: solver failed with 42 in lag"),
    "fatal": (Status.FMI_FATAL, "fmi2Fatal"),
    "discard": (Status.FMI_DISCARD, "fmi2Discard at t = 0.5 s"),
    "nan": (Status.NOT_FINITE, "y became nan at t = 0.51 s"),
    "inf": (Status.NOT_FINITE, "y became inf at t = 0.51 s"),
    "short": (Status.INCOMPLETE, "ended the simulation at t = 0.5 s of 1 s"),
    "memory": (Status.MEMORY, "outgrew 200 MiB"),
    "pending": (Status.FMI_ERROR, "fmi2Pending"),
    "free_crash": (Status.CRASH, "SIGSEGV while freeing the instance"),
    "init_crash": (Status.CRASH, "SIGSEGV while initialising"),
    "init_error": (Status.FMI_ERROR, "fmi2EnterInitializationMode returned fmi2Error"),
    "child": (Status.CRASH, "SIGABRT"),
    "shutdown": (Status.CRASH, "SIGTERM"),
    "flood": (Status.OK, ""),
    "files": (Status.OK, ""),
    "chdir": (Status.OK, ""),
}
ELSEWHERE = {
    "hangs in instantiate": (Status.TIMEOUT, "while instantiating"),
    "crashes in instantiate": (Status.CRASH, "SIGSEGV while instantiating"),
    "wrong guid": (Status.LOAD_ERROR, "NULL: wrong GUID {other}"),
    "points outside": (Status.BAD_ARCHIVE, "points outside"),
    "no archive": (Status.BAD_ARCHIVE, "no zip archive"),
    "cost raises": (Status.COST_ERROR, "ZeroDivisionError: no way"),
}


def test_two_hundred_jobs_with_every_fault(tmp_path: Path) -> None:
    """200 ordered outcomes, each one right, in bounded time, whatever the others do."""
    folder = tmp_path / "fmus"
    folder.mkdir()
    xml = build.LAG2.format(guid="{lag}", interpolates="true")
    slip = build.write_fmu(
        folder / "slip.fmu", xml, build.library("lag2.c"), "lag2", {"../../slipped.txt": b"evil"}
    )
    text = folder / "text.fmu"
    text.write_text("no archive")
    experiments = [
        experiment(),
        experiment("hangs in instantiate", build.lag2("HANG_INSTANTIATE")),
        experiment("crashes in instantiate", build.lag2("CRASH_INSTANTIATE")),
        experiment("wrong guid", build.lag2(guid="{other}")),
        experiment("points outside", slip),
        experiment("no archive", text),
        experiment("cost raises", reduce=failing_reducer),
    ]
    kinds = [*FAULTS, *ELSEWHERE] * 3
    kinds += ["good"] * (200 - len(kinds))
    random.Random(1).shuffle(kinds)
    jobs, taus = [], {}
    for index, kind in enumerate(kinds):
        if kind == "good":
            taus[index] = 0.05 + 0.001 * index
            jobs.append(Job("lag", {"tau": taus[index]}))
        else:
            jobs.append(Job(kind) if kind in ELSEWHERE else fault(kind))
    told: list[int] = []
    begin = time.monotonic()
    with LocalRunner(experiments, workers=2, deadline_s=DEADLINE, memory_limit_mb=200.0) as runner:
        outcomes = runner.run(jobs, lambda index, _: told.append(index))
    elapsed = time.monotonic() - begin
    assert sorted(told) == list(range(200))
    assert len(outcomes) == 200
    for index, (kind, outcome) in enumerate(zip(kinds, outcomes, strict=True)):
        if kind == "good":
            assert outcome.status is Status.OK, outcome.reason
            assert outcome.reduced == pytest.approx([expected(taus[index])], abs=1e-13)
            assert outcome.console == ""
            continue
        status, says = (FAULTS | ELSEWHERE)[kind]
        assert outcome.status is status, (kind, outcome)
        assert says in outcome.reason
        assert "\n" not in outcome.reason
        assert (outcome.reduced is not None) is (status is Status.OK)
        assert len(outcome.console) < 10_000
        assert ("lag: assertion failed" in outcome.console) is (kind == "abort")
        assert ("very talkative" in outcome.console) is (kind == "flood")
    assert list(tmp_path.rglob("slipped.txt")) == []
    assert list(Path.cwd().glob("left_behind.txt")) == []
    assert elapsed < 120.0


@pytest.fixture(scope="module")
def shared() -> Iterator[LocalRunner]:
    with LocalRunner([experiment(), experiment("kept", reduce=None)], workers=2, deadline_s=20.0) as runner:
        while not all(worker.is_ready for worker in runner._workers):  # all of its processes are there
            runner.run([Job("lag")])
        yield runner


def test_outcomes_do_not_depend_on_the_number_of_workers(shared: LocalRunner) -> None:
    jobs = [Job("lag", {"tau": 0.01 + 0.003 * i}, keep_signals=i % 3 == 0) for i in range(40)]
    results = [shared.run(jobs)]
    for workers in (1, 3):
        with LocalRunner([experiment()], workers=workers, backend="python") as runner:
            results.append(runner.run(jobs))
    for outcomes in zip(*results, strict=True):
        assert len({o.reduced.tobytes() for o in outcomes if o.reduced is not None}) == 1
        signals = [o.signals["y"].tobytes() for o in outcomes if o.signals is not None]
        assert len(signals) in (0, 3)
        assert len(set(signals)) <= 1


def test_signals_come_back_when_wanted(shared: LocalRunner) -> None:
    plain, kept, whole = shared.run([Job("lag"), Job("lag", keep_signals=True), Job("kept")])
    assert plain.signals is None
    assert kept.signals is not None
    assert kept.reduced is not None
    assert whole.reduced is None
    assert whole.signals is not None
    assert np.max(np.abs(whole.signals["y"] - lag(TIME, INPUTS["u"], 0.1, 1.0))) < 1e-13
    assert whole.duration_s > 0.0


def test_a_job_wins_over_the_experiments_fixed_values() -> None:
    with LocalRunner([experiment(fixed={"tau": 0.3, "k": 2.0})], workers=1) as runner:
        fixed, own = runner.run([Job("lag"), Job("lag", {"tau": 0.05})])
    assert fixed.reduced == pytest.approx([lag(TIME, INPUTS["u"], 0.3, 2.0)[-1]])
    assert own.reduced == pytest.approx([lag(TIME, INPUTS["u"], 0.05, 2.0)[-1]])


def test_misuse_is_refused_before_anything_runs(shared: LocalRunner) -> None:
    told: list[int] = []
    for job, says in (
        (Job("leg"), r"no experiment 'leg'\. Did you mean 'lag'"),
        (Job("lag", {"tua": 1.0}), "Did you mean 'tau'"),
    ):
        with pytest.raises((ParameterError, FmuError), match=says):
            shared.run([Job("lag"), job], lambda index, _: told.append(index))
    assert told == []
    with pytest.raises(FmuError, match="no variable 'yy'"):
        LocalRunner([Experiment("a", build.lag2(), None, ("yy",), TIME)])
    with pytest.raises(ParameterError, match="named 'lag'"):
        LocalRunner([experiment(), experiment()])
    with pytest.raises(ParameterError, match="at least 1"):
        LocalRunner([experiment()], workers=0)


def test_no_jobs_no_outcomes_and_a_closed_runner_refuses() -> None:
    runner = LocalRunner([experiment()], workers=1)
    assert runner.run([]) == []
    runner.close()
    runner.close()
    with pytest.raises(StudyError, match="closed"):
        runner.run([Job("lag")])


def test_an_exception_from_the_callback_ends_the_batch_and_the_runner_lives_on() -> None:
    def stop(index: int, outcome: Outcome) -> None:
        if index == 5:
            raise KeyboardInterrupt

    with LocalRunner([experiment()], workers=2, backend="python") as runner:
        with pytest.raises(KeyboardInterrupt):
            runner.run([Job("lag")] * 50, stop)
        outcomes = runner.run([Job("lag", {"tau": 0.2})] * 3)
    assert [o.reduced for o in outcomes] == [pytest.approx([expected(0.2)])] * 3


def test_jobs_waiting_behind_a_crash_are_run_elsewhere_and_once(tmp_path: Path) -> None:
    """Every run leaves a mark outside of its scratch folder: one mark per job."""
    marks = tmp_path / "marks"
    marks.mkdir()
    jobs = [fault("segfault") if i % 14 == 3 else Job("lag", {"tau": 0.1 + i}) for i in range(42)]
    with LocalRunner([experiment(reduce=Mark(marks))], workers=2, backend="python") as runner:
        outcomes = runner.run(jobs)
    assert [o.status for o in outcomes] == [Status.CRASH if i % 14 == 3 else Status.OK for i in range(42)]
    assert len(list(marks.iterdir())) == 39


class Mark:
    """A reducer that leaves a file per call."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __call__(self, signals: Signals) -> FloatArray:
        descriptor, _ = tempfile.mkstemp(dir=self.folder)
        os.close(descriptor)
        return signals["y"][-1:]


def test_workers_are_recycled_by_count_and_by_memory() -> None:
    pids = experiment(reduce=printing_reducer)
    with LocalRunner([pids], workers=1, recycle_runs=4, backend="python") as runner:
        outcomes = runner.run([Job("lag")] * 12)
        used = [float(o.reduced[0]) for o in outcomes if o.reduced is not None]
        assert len(set(used)) == 3
        assert sorted(used, key=used.index) == used
        assert [(o.status, o.reason) for o in outcomes] == [(Status.OK, "")] * 12
        assert [o.console.strip() for o in outcomes] == ["from the reducer"] * 12
    with LocalRunner([pids], workers=1, recycle_growth_mb=100.0, backend="python") as runner:
        # Each of these leaks 4 MiB in each of its last 10 steps.
        leaking = runner.run([fault("leak", at=0.9)] * 8)
        assert len({float(o.reduced[0]) for o in leaking if o.reduced is not None}) in (2, 3, 4)


def test_a_flood_is_told_of_the_run_that_printed_it(tmp_path: Path) -> None:
    """The runner sees the flood of a run before it has read the answers of those before it."""

    def read_late(index: int, _: Outcome) -> None:
        until = time.monotonic() + 10.0
        while index == 0 and time.monotonic() < until:
            if any(file.stat().st_size > 2**20 for file in tmp_path.rglob("console")):
                time.sleep(0.1)  # more than a tick: the runner looks before it reads the next answer
                return
            time.sleep(0.01)

    flooding = experiment("flooding", reduce=flooding_reducer)
    with LocalRunner([experiment(), flooding], workers=1, backend="python") as runner:
        runner.run([Job("lag")] * 40)  # short runs: the worker is given some ahead
        outcomes = runner.run([Job("lag")] * 3 + [Job("flooding"), Job("lag")], read_late)
    assert [o.status for o in outcomes] == [Status.OK] * 5
    assert [o.console[:9] for o in outcomes] == ["", "", "", "flood of ", ""]
    # What came before and after the file was emptied is cut as one text, and says so.
    assert outcomes[3].console[8191:] == ".\n... (cut)"


def test_memory_limit_lets_others_pass() -> None:
    with LocalRunner([experiment()], workers=1, memory_limit_mb=100.0, backend="python") as runner:
        outcomes = runner.run([Job("lag"), fault("memory"), Job("lag"), fault("segfault")])
    assert [o.status for o in outcomes] == [Status.OK, Status.MEMORY, Status.OK, Status.CRASH]


def test_files_written_to_the_working_directory_do_not_reach_the_next_run() -> None:
    with LocalRunner([experiment(reduce=CountFiles())], workers=1) as runner:
        outcomes = runner.run([fault("files"), fault("files"), Job("lag")])
    assert [o.reduced.tolist() for o in outcomes if o.reduced is not None] == [[1.0], [1.0], [0.0]]


class CountFiles:
    def __call__(self, signals: Signals) -> FloatArray:
        return np.array([float(len(list(Path.cwd().iterdir())))])


def test_reset_is_used_only_on_request() -> None:
    jobs = [Job("lag", {"tau": 0.2})] * 4
    found = {}
    for reuse in ("fresh", "reset"):
        with LocalRunner(
            [experiment(fmu=build.lag2("WRONG_RESET"))], workers=1, reuse=reuse, backend="python"
        ) as runner:
            found[reuse] = [float(o.reduced[0]) for o in runner.run(jobs) if o.reduced is not None]
    assert len(set(found["fresh"])) == 1
    assert len(set(found["reset"])) > 1


def test_several_fmus_take_turns_in_one_worker() -> None:
    experiments = [experiment("two"), experiment("three", build.lag3()), experiment("one", build.lag1())]
    jobs = [Job(name, {"tau": 0.1}) for name in ("two", "three", "one") * 4]
    with LocalRunner(experiments, workers=1) as runner:
        outcomes = runner.run(jobs)
    values = [float(o.reduced[0]) for o in outcomes if o.reduced is not None]
    assert values[:3] * 4 == values
    assert values[0] == pytest.approx(values[1], abs=1e-12)
    assert values[2] == pytest.approx(values[0], abs=1e-3)


@pytest.mark.parametrize("kind", ["co-simulation", "model-exchange"])
@pytest.mark.parametrize("backend", ["compiled", "python"])
def test_kind_and_backend_reach_the_workers(kind: str, backend: str) -> None:
    with LocalRunner([experiment(tolerance=1e-8)], workers=1, kind=kind, backend=backend) as runner:
        (outcome,) = runner.run([Job("lag", {"tau": 0.2})])
    assert outcome.reduced == pytest.approx([expected(0.2)], abs=1e-6)


def test_workers_that_cannot_start_are_an_error_with_a_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("thsa_cosim.batch.process._BOOT", ("-c", "raise SystemExit('no such luck')"))
    with (
        LocalRunner([experiment()], workers=2) as runner,
        pytest.raises(StudyError, match=r"do not start .*no such luck"),
    ):
        runner.run([Job("lag")])


SCRIPT = """
    import faulthandler, os, signal, sys, tempfile, time
    from pathlib import Path
    import numpy as np
    from thsa_cosim.batch import Experiment, Job, LocalRunner
    fmu, folder, fault = sys.argv[1:4]
    tempfile.tempdir = folder
    time_ = np.linspace(0.0, 1.0, 101)

    def reduce(signals):  # lives in __main__
        return signals["y"][-1:]

    if __name__ == "__main__":
        experiment = Experiment("lag", Path(fmu), None, ("y",), time_, reduce=reduce)
        with LocalRunner([experiment], workers=2) as runner:
            done = runner.run([Job("lag", {"u": 1.0})] * 4)
            print("started", done[0].status, float(done[0].reduced[0]), flush=True)
            faulthandler.dump_traceback_later(25.0, exit=True)  # where it is, should it not end
            try:
                runner.run([Job("lag", {"fault": float(fault)})] * 100)
            except KeyboardInterrupt:
                print("interrupted", flush=True)
                raise SystemExit(130)
"""


@pytest.mark.parametrize(
    ("how", "name"), [("SIGINT", "hang"), ("SIGKILL", "hang"), ("SIGKILL", "slow"), ("SIGTERM", "slow")]
)
def test_the_parent_may_be_interrupted_or_killed(tmp_path: Path, how: str, name: str) -> None:
    """Workers ignore SIGINT and notice the parent's death even while their FMU hangs; no folder stays."""
    script = tmp_path / "script.py"
    script.write_text(textwrap.dedent(SCRIPT))
    folder = tmp_path / "temporary"
    folder.mkdir()
    process = subprocess.Popen(
        [sys.executable, str(script), str(build.lag2()), str(folder), str(build.FAULTS[name])],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    with process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline().startswith("started ok 0.999")
            time.sleep(0.3)
            workers = _workers_of(folder)
            assert len(workers) == 2
            number = signal.Signals[how]
            if how == "SIGINT":
                for pid in workers:  # as a terminal would not, but a supervisor might
                    os.kill(pid, signal.SIGINT)
            process.send_signal(number)
            output, errors = process.communicate(timeout=30.0)
        finally:
            process.kill()
    if how == "SIGINT":
        assert errors == ""
        assert output == "interrupted\n"
        assert process.returncode == 130
    else:
        assert process.returncode == -number
    until = time.monotonic() + 10.0
    while (any(_runs(pid) for pid in workers) or list(folder.iterdir())) and time.monotonic() < until:
        time.sleep(0.02)
    assert [pid for pid in workers if _runs(pid)] == []
    assert list(folder.iterdir()) == []


@pytest.mark.skipif(os.name == "nt", reason="supervisors are forked")
def test_supervisors_of_a_killed_parent_clear_its_folder_in_turn(tmp_path: Path) -> None:
    """Each ends all others of the folder: two that did so at once would both be dead before it is removed."""
    import fcntl

    script, folder = tmp_path / "script.py", tmp_path / "temporary"
    script.write_text(textwrap.dedent(SCRIPT))
    folder.mkdir()
    process = subprocess.Popen(
        [sys.executable, str(script), str(build.lag2()), str(folder), str(build.FAULTS["slow"])],
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    with process:
        assert process.stdout is not None
        assert process.stdout.readline().startswith("started ok 0.999")
        (root,) = folder.iterdir()
        descriptor = os.open(root, os.O_RDONLY)
        fcntl.flock(descriptor, fcntl.LOCK_EX)
        process.kill()
    time.sleep(0.5)
    assert len(list(root.rglob("ended"))) == 2
    assert len(family(str(root))) == 2
    os.close(descriptor)
    until = time.monotonic() + 10.0
    while root.exists() and time.monotonic() < until:
        time.sleep(0.02)
    assert not root.exists()
    assert family(str(root)) == []


def _workers_of(folder: Path) -> list[int]:
    """Processes that work in a folder."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                if str((entry / "cwd").readlink()).startswith(str(folder)):
                    found.append(int(entry.name))
            except OSError:
                continue
    return found


def _runs(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def test_a_worker_killed_from_outside_costs_nothing() -> None:
    with LocalRunner([experiment()], workers=1, backend="python") as runner:
        runner.run([Job("lag")])
        pid = runner._workers[0].pid
        killed = []

        def kill(index: int, outcome: Outcome) -> None:
            if index == 2:
                killed.append(os.kill(pid, signal.SIGKILL))

        outcomes = runner.run([Job("lag")] * 3 + [fault("slow", at=0.0)] + [Job("lag")] * 5, kill)
    assert killed
    assert [o.status for o in outcomes] == [Status.OK] * 9


def test_jobs_do_not_wait_behind_a_hanging_one() -> None:
    """Short runs make workers hoard orders; what waits behind a run that hangs goes to whoever is idle."""
    finished: dict[int, float] = {}
    with LocalRunner([experiment()], workers=2, deadline_s=3.0, backend="python") as runner:
        runner.run([Job("lag")] * 100)
        begin = time.monotonic()
        jobs = [Job("lag")] * 20 + [fault("hang")] + [Job("lag")] * 60
        outcomes = runner.run(jobs, lambda index, _: finished.update({index: time.monotonic() - begin}))
    assert [o.status for o in outcomes] == [Status.TIMEOUT if i == 20 else Status.OK for i in range(81)]
    assert finished[20] >= 3.0
    assert max(t for i, t in finished.items() if i != 20) < 2.0


def test_listening_by_threads_does_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """What Windows uses, whose pipes cannot be selected."""
    monkeypatch.setattr("thsa_cosim.batch.local.open_inbox", ThreadInbox)
    kinds = ["segfault", "good", "exit", "child", "good", "hang", "flood", "fatal", "nan", "good"]
    with LocalRunner([experiment()], workers=2, deadline_s=1.5, backend="python") as runner:
        outcomes = runner.run([fault("none" if kind == "good" else kind) for kind in kinds])
    wanted = [Status.OK if kind == "good" else FAULTS[kind][0] for kind in kinds]
    assert [o.status for o in outcomes] == wanted


def test_what_a_reducer_returns_in_single_precision_travels_so_and_all_else_in_double():
    experiments = [experiment("single", reduce=halves_in_single), experiment("integers", reduce=integers)]
    with LocalRunner(experiments, workers=1) as runner:
        single, whole = (o.reduced for o in runner.run([Job("single"), Job("integers")]))
    assert single is not None
    assert whole is not None
    assert (single.dtype, whole.dtype) == (np.float32, np.float64)
    assert (single[3], whole[3]) == (0.5, 3.0)
