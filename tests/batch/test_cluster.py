"""The same jobs on a Dask cluster: a scheduler and two workers, started by hand as the docs say."""

import gc
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from fmu.test_plant import lag
from fmu_sources import build

from thsa_cosim.batch import Experiment, Job, LocalRunner, Outcome, Status
from thsa_cosim.batch.cluster import ClusterRunner
from thsa_cosim.errors import InputError, MissingExtraError
from thsa_cosim.fmu.description import DefaultExperiment
from thsa_cosim.fmu.scratch import ScratchFolder
from thsa_cosim.signals import FloatArray, Signals
from thsa_cosim.system.assemble import Part, Wire, assemble
from thsa_cosim.system.write import write_ssp

pytest.importorskip("distributed", reason="the extra `cluster` is not installed")

TIME = np.linspace(0.0, 1.0, 101)
INPUTS = Signals(TIME, {"u": np.sin(5.0 * TIME)}, {"u": "m/s"})


def _host() -> int:
    """Process of the cluster that runs this: a supervisor stands between it and each of its workers."""
    status = Path(f"/proc/{os.getppid()}/stat").read_text()
    return int(status.rsplit(")", 1)[1].split()[1])


class SumOfSquares:
    """A reducer; pickled with the experiment."""

    def __call__(self, signals: Signals) -> FloatArray:
        return np.array([np.sum(signals["y"] ** 2), float(_host())])


def experiment(**options: object) -> Experiment:
    return Experiment("lag", build.lag2(), INPUTS, ("y",), TIME, **options)  # type: ignore[arg-type]


@dataclass
class Cluster:
    address: str
    scheduler: "subprocess.Popen[bytes]"
    workers: "list[subprocess.Popen[bytes]]"


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    port = _free_port()
    address = f"tcp://127.0.0.1:{port}"
    tests = str(Path(__file__).parents[1])
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    environment = os.environ | {"TMPDIR": str(temporary), "PYTHONPATH": tests}

    def start(*arguments: str) -> "subprocess.Popen[bytes]":
        return subprocess.Popen(
            [sys.executable, "-m", "distributed.cli." + arguments[0], *arguments[1:]],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            cwd=tmp_path,
            env=environment,
            start_new_session=True,
        )

    scheduler = start("dask_scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard")
    worker = ("dask_worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard")
    workers = [start(*worker) for _ in range(2)]
    yield Cluster(address, scheduler, workers)
    for process in (*workers, scheduler):
        process.send_signal(signal.SIGTERM)
    for process in (*workers, scheduler):
        try:
            process.wait(15.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


@pytest.mark.slow
def test_a_system_travels_with_all_of_its_fmus(cluster: Cluster, tmp_path: Path) -> None:
    parts = [Part("first", build.lag2(), "coupled", 0.01), Part("second", build.lag3(), "coupled", 0.01)]
    system, archives = assemble("chain", parts, [Wire("first.y", "second.u")], {"u": ["first.u"]})
    path = write_ssp(system, archives, tmp_path / "here only" / "chain.ssp", DefaultExperiment(0.0, 1.0))
    chain = Experiment("chain", path, INPUTS, ("second.y",), TIME)
    jobs = [Job("chain", {"first.tau": tau}, keep_signals=True) for tau in (0.05, 0.1)]
    with LocalRunner([chain], workers=1) as runner:
        local = runner.run(jobs)
    with ClusterRunner([chain], cluster.address, timeout_s=60.0) as remote:
        found = remote.run(jobs)
    for mine, theirs in zip(local, found, strict=True):
        assert mine.signals is not None
        assert theirs.signals is not None, theirs.reason
        assert np.array_equal(mine.signals["second.y"], theirs.signals["second.y"])


@pytest.mark.slow
def test_cluster_gives_what_local_gives_and_survives_the_loss_of_a_worker(
    cluster: Cluster, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    jobs = [Job("lag", {"tau": 0.05 + 0.01 * i}, keep_signals=i % 5 == 0) for i in range(30)]
    jobs[7] = Job("lag", {"fault": build.FAULTS["segfault"]})
    jobs[11] = Job("lag", {"fault": build.FAULTS["hang"]})
    jobs[13] = Job("lag", {"fault": build.FAULTS["exit"]})
    described = experiment(reduce=SumOfSquares())
    with LocalRunner([described], workers=2, deadline_s=2.0, backend="python") as runner:
        local = runner.run(jobs)
    with ClusterRunner(
        [described], cluster.address, timeout_s=60.0, deadline_s=2.0, backend="python"
    ) as remote:
        deadline = time.monotonic() + 60.0
        while len(remote._client.scheduler_info()["workers"]) < 2 and time.monotonic() < deadline:
            time.sleep(0.1)
        remote.run(jobs[:4])
        told: list[int] = []
        first = remote.run(jobs, lambda index, _: told.append(index))
        assert sorted(told) == list(range(30))

        def lose_a_worker(index: int, outcome: Outcome) -> None:
            if index == 3:
                os.killpg(cluster.workers[0].pid, signal.SIGKILL)

        slow = [Job("lag", {"fault": build.FAULTS["slow"], "at": 0.6 + 0.001 * i}) for i in range(8)]
        second = remote.run([*jobs, *slow], lose_a_worker)
    for outcomes in (first, second):
        for mine, theirs in zip(local, outcomes, strict=False):
            assert mine.status is theirs.status
            assert mine.reason == theirs.reason
            assert (mine.reduced is None) is (theirs.reduced is None)
            if mine.reduced is not None and theirs.reduced is not None:
                assert mine.reduced[0] == theirs.reduced[0]
            assert (mine.signals is None) is (theirs.signals is None)
            if mine.signals is not None and theirs.signals is not None:
                assert np.array_equal(mine.signals["y"], theirs.signals["y"])
    assert [o.status for o in second[30:]] == [Status.OK] * 8
    both = {float(o.reduced[1]) for o in first if o.reduced is not None}
    assert len(both) == 2, "both workers took part"
    alive = cluster.workers[1].pid
    assert alive in both
    # The surviving worker dropped the study; what the killed one left goes with the next start there.
    temporary = tmp_path / "temporary"
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    until = time.monotonic() + 10.0
    while _folders(temporary) and time.monotonic() < until:
        ScratchFolder().remove()
        time.sleep(0.1)
    assert _folders(temporary) == []


def _folders(folder: Path) -> list[str]:
    return [p.name for p in folder.iterdir() if re.match("thsa-cosim-", p.name)]


def test_no_scheduler_is_one_sentence() -> None:
    with pytest.raises(InputError, match=r"No Dask scheduler answers at tcp://127\.0\.0\.1:\d+ .*; start it"):
        ClusterRunner([experiment()], f"tcp://127.0.0.1:{_free_port()}", timeout_s=0.5)


def test_an_address_that_is_none_is_refused_at_once(capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(
        InputError, match="'nonsense' is no address of a Dask scheduler; give its host and port"
    ):
        ClusterRunner([experiment()], "nonsense")
    gc.collect()
    assert capfd.readouterr().err == "", "no client is torn down with a traceback"


def test_missing_extra_is_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingExtraError, match=r"thsa-cosim\[cluster\]"):
        ClusterRunner([experiment()], "tcp://127.0.0.1:1")


def test_the_workers_side_without_a_cluster(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What a Dask worker does with a parcel: unpack once, run, drop everything on close."""
    from thsa_cosim.batch import cluster as room

    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    parcel = room._pack([experiment()], {"backend": "python"})
    assert parcel.digest == room._pack([experiment()], {"backend": "python"}).digest
    try:
        outcomes = [room.run_job(parcel, Job("lag", {"tau": tau})) for tau in (0.1, 0.3)]
        assert len(room._studies) == 1
    finally:
        room.close_study(parcel.digest)
    for outcome, tau in zip(outcomes, (0.1, 0.3), strict=True):
        assert outcome.signals is not None
        assert np.max(np.abs(outcome.signals["y"] - lag(TIME, INPUTS["u"], tau, 1.0))) < 1e-13
    assert list(tmp_path.iterdir()) == []
    assert room._studies == {}
