"""The log of runs: exact, torn at worst at its end, never in doubt about what a run was, and free of machine faults."""

import errno
import random
import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from thsa_cosim.batch import Experiment, Job, Outcome, Status
from thsa_cosim.errors import InputError, MachineError
from thsa_cosim.scenario import SimulationTable
from thsa_cosim.signals import Signals
from thsa_cosim.study import Place, Study, runs
from thsa_cosim.study.runs import RUNS, LoggedRunner, RunLog

TIME = np.linspace(0.0, 1.0, 11)
KEY = b"k" * 16


def outcome(seed: int = 0, status: Status = Status.OK) -> Outcome:
    rng = np.random.default_rng(seed)
    if status is not Status.OK:
        return Outcome(status, "why not: α", None, None, 0.25, "console\n")
    signals = Signals(
        TIME, {"y": rng.normal(size=11), "u": rng.normal(size=11)}, {"y": "m/s"}, frozenset({"u"})
    )
    return Outcome(status, "", signals, rng.normal(size=3), 0.1 + seed)


def same(one: Outcome | None, other: Outcome) -> bool:
    """Bit for bit, units and held signals included."""
    assert one is not None
    facts = [(o.status, o.reason, o.duration_s, o.console) for o in (one, other)]
    arrays = [[a.tobytes() for a in runs._arrays(o)] for o in (one, other)]
    kept = [
        None if o.signals is None else (o.signals.names, o.signals.units, o.signals.held)
        for o in (one, other)
    ]
    return facts[0] == facts[1] and arrays[0] == arrays[1] and kept[0] == kept[1]


class Counting:
    """A runner that makes an outcome of the job's values and notes what it ran; it may stop in the midst."""

    notes: Sequence[str] = ()

    def __init__(self, stop_after: int = 10**9) -> None:
        self.ran: list[tuple[str, dict[str, float]]] = []
        self.stop_after = stop_after

    def run(self, jobs: Sequence[Job], on_outcome: Any = None) -> list[Outcome]:
        found = []
        for index, job in enumerate(jobs):
            if len(self.ran) >= self.stop_after:
                raise KeyboardInterrupt
            self.ran.append((job.experiment, dict(job.values)))
            found.append(outcome(int(job.values["seed"])))
            if on_outcome is not None:
                on_outcome(index, found[-1])
        return found

    def close(self) -> None:
        pass

    def __enter__(self) -> "Counting":
        return self

    def __exit__(self, *_: object) -> None:
        pass


@pytest.fixture
def experiment(tmp_path: Path) -> Experiment:
    fmu = tmp_path / "Model.fmu"
    fmu.write_bytes(b"an archive")
    return Experiment("fit/a", fmu, Signals(TIME, {"u": TIME}), ("y",), TIME, {"tau": 0.1}, 1e-6)


def test_what_is_read_is_what_was_written(tmp_path: Path) -> None:
    kept = {bytes([k]) * 16: outcome(k) for k in range(5)}
    kept[b"f" * 16] = outcome(status=Status.CRASH)
    kept[b"s" * 16] = replace(outcome(7), signals=None)
    kept[b"l" * 16] = replace(outcome(8), reduced=np.random.default_rng(8).normal(size=(700, 3)))
    kept[b"e" * 16] = replace(outcome(9), signals=None, reduced=np.zeros(0))
    single = np.random.default_rng(10).normal(size=700).astype(np.float32)
    kept[b"4" * 16] = replace(outcome(10), reduced=single)
    kept[b"5" * 16] = replace(outcome(11), signals=None, reduced=single)
    with RunLog.open(tmp_path / RUNS) as log:
        for key, value in kept.items():
            log.append(key, value)
    with RunLog.open(tmp_path / RUNS) as log:
        assert len(log) == len(kept)
        assert all(same(log.known(key), value) for key, value in kept.items())
        assert log.known(b"x" * 16) is None


def test_a_torn_end_is_dropped_wherever_it_is_torn(tmp_path: Path) -> None:
    with RunLog.open(tmp_path / RUNS) as log:
        for k in range(4):
            log.append(bytes([k]) * 16, outcome(k))
    whole, chance = (tmp_path / RUNS).read_bytes(), random.Random(3)
    for _ in range(60):
        (tmp_path / RUNS).write_bytes(whole[: chance.randrange(len(whole))] + chance.choice([b"", b"\0" * 9]))
        try:
            log = RunLog.open(tmp_path / RUNS)
        except InputError:  # torn within the first line, and zeros after it
            continue
        with log:
            known = [k for k in range(4) if log.known(bytes([k]) * 16) is not None]
            assert known == list(range(len(known)))
            assert all(same(log.known(bytes([k]) * 16), outcome(k)) for k in known)
            log.append(KEY, outcome(9))
        with RunLog.open(tmp_path / RUNS) as log:
            assert same(log.known(KEY), outcome(9))


def test_a_flipped_bit_is_no_outcome(tmp_path: Path) -> None:
    with RunLog.open(tmp_path / RUNS) as log:
        log.append(KEY, outcome())
    content = bytearray((tmp_path / RUNS).read_bytes())
    content[-5] ^= 1
    (tmp_path / RUNS).write_bytes(content)
    with RunLog.open(tmp_path / RUNS) as log:
        assert log.known(KEY) is None


def test_two_runs_do_not_share_a_folder(tmp_path: Path) -> None:
    with RunLog.open(tmp_path / RUNS), pytest.raises(InputError, match="is in use by another run"):
        RunLog.open(tmp_path / RUNS)


def test_a_machines_fault_is_never_kept(tmp_path: Path) -> None:
    with RunLog.open(tmp_path / RUNS) as log:
        log.append(KEY, outcome(status=Status.MACHINE))
        assert log.known(KEY) is None


def test_a_full_disk_names_the_folder_and_tears_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with RunLog.open(tmp_path / RUNS) as log:
        log.append(KEY, outcome(1))
        file = log._file

        class Full:
            def write(self, data: bytes) -> int:
                file.write(bytes(data)[:7])
                raise OSError(errno.ENOSPC, "No space left on device")

            def __getattr__(self, name: str) -> Any:
                return getattr(file, name)

        log._file = Full()  # type: ignore[assignment]
        with pytest.raises(
            MachineError, match=r"cannot be written .*make room.*same command again"
        ) as caught:
            log.append(b"m" * 16, outcome(2))
        assert str(tmp_path) in str(caught.value)
    with RunLog.open(tmp_path / RUNS) as log:
        assert same(log.known(KEY), outcome(1))
        assert log.known(b"m" * 16) is None


def test_large_outcomes_are_kept_as_far_as_the_disk_has_room(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    large, small = Outcome(Status.OK, reduced=np.zeros(1000)), Outcome(Status.OK, reduced=np.zeros(5))

    def kept(free: int) -> int:
        monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=free))
        with RunLog.open(tmp_path / RUNS) as log:
            before = len(log)
            for k in range(10):
                log.append(bytes([before + k]) * 16, large)
            found = len(log) - before
            log.append(bytes([100 + before]) * 16, small)
            assert log.known(bytes([100 + before]) * 16) is not None
            return found

    assert kept(4 * 30_000) == 3
    assert kept(4 * 20_000) == 2  # what is there already is not counted against it
    assert kept(0) == 0
    monkeypatch.setattr(runs, "LARGEST", (tmp_path / RUNS).stat().st_size + 9_000)
    assert kept(10**12) == 1


def test_a_full_log_stops_growing_keeps_what_came_first_and_says_so_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[str] = []
    monkeypatch.setattr(runs, "LARGEST", 50_000)
    with RunLog.open(tmp_path / RUNS, said.append) as log:
        for k in range(100):
            log.append(bytes([k]) * 16, Outcome(Status.OK, reduced=np.full(1000, float(k))))
        assert log.left_out == 94
        assert log.known(bytes([5]) * 16) is not None
        assert log.known(bytes([6]) * 16) is None
    assert (tmp_path / RUNS).stat().st_size <= 51_000
    assert len(said) == 1
    assert said[0].startswith("runs.log is full at 0 MB; further runs are not kept")


def test_a_study_says_on_its_way_that_its_log_is_full(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[str] = []
    monkeypatch.setattr(runs, "LARGEST", 0)
    place = Place(tmp_path / "study", on_progress=lambda progress: told.append(progress.stage))
    with Study.open(place, {"kind": "diagnose"}, {}) as study:
        study._log.append(KEY, Outcome(Status.OK, reduced=np.zeros(1000)))
    assert [text for text in told if "runs.log is full" in text]


def test_only_what_is_not_known_is_run(tmp_path: Path, experiment: Experiment) -> None:
    jobs = [Job("fit/a", {"seed": float(k)}) for k in range(6)]
    first, second = Counting(stop_after=4), Counting()
    with RunLog.open(tmp_path / RUNS) as log, pytest.raises(KeyboardInterrupt):
        LoggedRunner(first, log, [experiment], ()).run(jobs)
    told: list[int] = []
    with RunLog.open(tmp_path / RUNS) as log:
        found = LoggedRunner(second, log, [experiment], ()).run(jobs, lambda index, _: told.append(index))
        assert log.recalled == 4
    assert [values["seed"] for _, values in second.ran] == [4.0, 5.0]
    assert sorted(told) == list(range(6))
    assert all(same(one, outcome(k)) for k, one in enumerate(found))


def changed_experiments(experiment: Experiment) -> dict[str, Experiment]:
    other = experiment.fmu.with_name("Other.fmu")
    other.write_bytes(b"another archive")
    return {
        "fmu": replace(experiment, fmu=other),
        "inputs": replace(experiment, inputs=Signals(TIME, {"u": TIME + 1.0})),
        "no inputs": replace(experiment, inputs=None),
        "outputs": replace(experiment, outputs=("y", "u")),
        "time": replace(experiment, time=TIME[:-1]),
        "fixed": replace(experiment, fixed={"tau": 0.2}),
        "tolerance": replace(experiment, tolerance=1e-5),
        "steps": replace(experiment, most_steps=100_000),
        "reduce": replace(experiment, reduce=len),  # type: ignore[arg-type]
    }


@pytest.mark.parametrize(
    "what", ["fmu", "inputs", "no inputs", "outputs", "time", "fixed", "tolerance", "steps", "reduce"]
)
def test_another_run_is_not_looked_up(tmp_path: Path, experiment: Experiment, what: str) -> None:
    job, other = Job("fit/a", {"seed": 1.0}), changed_experiments(experiment)[what]
    with RunLog.open(tmp_path / RUNS) as log:
        LoggedRunner(Counting(), log, [experiment], ()).run([job])
        for changed, settings in ((other, ()), (experiment, ("model-exchange",))):
            again = Counting()
            LoggedRunner(again, log, [changed], settings).run([job])
            assert len(again.ran) == 1
        again = Counting()
        runner = LoggedRunner(again, log, [experiment], ())
        runner.run([Job("fit/a", {"seed": 2.0}), replace(job, keep_signals=True), job])
        assert len(again.ran) == 2


def test_where_the_fmu_lies_does_not_matter(tmp_path: Path, experiment: Experiment) -> None:
    copy = tmp_path / "copy.fmu"
    copy.write_bytes(experiment.fmu.read_bytes())
    again = Counting()
    with RunLog.open(tmp_path / RUNS) as log:
        LoggedRunner(Counting(), log, [experiment], ()).run([Job("fit/a", {"seed": 1.0})])
        LoggedRunner(again, log, [replace(experiment, fmu=copy)], ()).run([Job("fit/a", {"seed": 1.0})])
    assert again.ran == []


def test_a_complete_study_keeps_no_log(tmp_path: Path, experiment: Experiment) -> None:
    class Executor:
        def open_runner(self, spec: Any, experiments: Any) -> Counting:
            return Counting()

    place = Place(tmp_path / "study", Executor())  # type: ignore[arg-type]
    with Study.open(place, {"kind": "simulate"}, {}) as study:
        with study.open_runner(SimulationTable(), [experiment]) as runner:
            runner.run([Job("fit/a", {"seed": 1.0})])
        assert (place.folder / RUNS).stat().st_size > 100
        study.complete()
    assert not (place.folder / RUNS).exists()
