"""FMUs that attack their process: every innocent run is right and bit-equal, in bounded time, and nothing stays."""

import random
import tempfile
import time
from pathlib import Path

import numpy as np
import pytest
from fmu_sources import build

from thsa_cosim.batch import Experiment, Job, LocalRunner, Outcome, Status
from thsa_cosim.batch.supervisor import family
from thsa_cosim.signals import FloatArray, Signals

TIME = np.linspace(0.0, 1.0, 101)
INPUTS = Signals(TIME, {"u": np.sin(5.0 * TIME)}, {"u": "m/s"})
DEADLINE = 4.0
HARMLESS = {
    "write to low descriptors",
    "close low descriptors",
    "fork and return twice",
    "rounding mode",
    "environment",
    "no environment",
    "change directory",
    "remove directory",
    "file mask",
    "locale",
    "close standard descriptors",
    "replace standard descriptors",
    "flood",
    "delete its library",
    "leave files open",
    "block signals",
}
"""What an FMU may do and still give its own result."""


def rounding_sensitive(signals: Signals) -> FloatArray:
    """The outputs, and sums that a changed rounding mode would show in."""
    y = signals["y"]
    return np.concatenate([y, [np.cumsum(y)[-1], np.sum(1.0 / (3.0 + y))]])


def jobs_of(kinds: list[str]) -> list[Job]:
    return [
        Job("lag", {"tau": 0.05 + 0.001 * (i % 40)})
        if kind == "innocent"
        else Job("lag", {"fault": 100.0 + build.HOSTILE.index(kind)})
        for i, kind in enumerate(kinds)
    ]


def attack(kinds: list[str], folder: Path, monkeypatch: pytest.MonkeyPatch) -> list[Outcome]:
    """Run everything in two workers; compare the innocent runs with an undisturbed batch."""
    fmu = build.lag2()  # before anything goes to ``folder``
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    jobs = jobs_of(kinds)
    one = Experiment("lag", fmu, INPUTS, ("y",), TIME, reduce=rounding_sensitive)
    innocent = [i for i, kind in enumerate(kinds) if kind == "innocent"]
    with LocalRunner([one], workers=1, backend="python") as runner:
        quiet = runner.run([jobs[i] for i in innocent])
    begin = time.monotonic()
    with LocalRunner([one], workers=2, deadline_s=DEADLINE, backend="python") as runner:
        outcomes = runner.run(jobs)
    lasted = time.monotonic() - begin
    for i, alone in zip(innocent, quiet, strict=True):
        assert outcomes[i].status is Status.OK, (i, kinds[max(0, i - 5) : i], outcomes[i].reason)
        assert outcomes[i].reduced is not None
        assert alone.reduced is not None
        assert outcomes[i].reduced.tobytes() == alone.reduced.tobytes(), kinds[max(0, i - 5) : i]
    assert len(outcomes) == len(jobs)
    assert lasted < 60.0 + 3.0 * DEADLINE * (len(jobs) - len(innocent))
    assert list(folder.iterdir()) == []
    assert family(str(folder)) == []
    return outcomes


@pytest.mark.slow
def test_two_hundred_jobs_among_them_every_attack(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kinds = [*build.HOSTILE] + ["innocent"] * (200 - len(build.HOSTILE))
    random.Random(3).shuffle(kinds)
    outcomes = attack(kinds, tmp_path, monkeypatch)
    for kind, outcome in zip(kinds, outcomes, strict=True):
        if kind in HARMLESS:
            assert outcome.status is Status.OK, (kind, outcome.reason)
        if kind in ("stop itself", "sleep for ever", "end the main thread"):
            assert outcome.status is Status.TIMEOUT, (kind, outcome.reason)


@pytest.mark.parametrize(
    "some",
    [
        ("write to all descriptors", "close all descriptors", "rounding mode"),
        ("fork and return twice", "child in a session of its own", "delete its library"),
        ("thread that crashes later", "environment", "read from all descriptors"),
    ],
)
def test_a_few_attacks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, some: tuple[str, ...]) -> None:
    kinds = [kind for attacker in some for kind in (attacker, *["innocent"] * 6)]
    attack(kinds, tmp_path, monkeypatch)
