"""Studies that are cut short at random moments end with the undisturbed result, whatever kind they are."""

import contextlib
import errno
import json
import multiprocessing
import os
import random
import shutil
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd
import pytest
from matplotlib.figure import Figure
from small_scenario import toml

from thsa_cosim.api.conduct import KINDS, ask
from thsa_cosim.batch import LocalRunner
from thsa_cosim.errors import MachineError
from thsa_cosim.scenario import Executor
from thsa_cosim.study import Place, Progress
from thsa_cosim.study.runs import RUNS

ROOT = Path(__file__).parents[2]
SCENARIOS = ROOT / "scenarios"
pytestmark = pytest.mark.skipif(
    not (ROOT / "fmus" / "Screw.fmu").exists(), reason="fmus/Screw.fmu has not been exported"
)
#: What may differ between two runs of the same study.
TIMES = {"duration_s", "started"}


@pytest.fixture(autouse=True)
def no_plots(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Figure, "savefig", lambda self, path, **_: Path(path).touch())


class Killed(BaseException):
    """Nothing may catch this."""


def shipped(name: str, **changes: Any) -> dict[str, Any]:
    """A shipped scenario as a dict, its paths made absolute, some of its tables replaced."""
    data = tomllib.loads((SCENARIOS / name).read_text(encoding="utf-8"))
    data["fmu"] = str((SCENARIOS / data["fmu"]).resolve())
    for key, value in changes.items():
        data[key] = {**data[key], **value} if isinstance(value, dict) else value
    return data


def screw(method: str) -> dict[str, Any]:
    fit = [str(SCENARIOS / "recordings" / f"screw_{t}.parquet") for t in ("m30", "p25")]
    held_out = [str(SCENARIOS / "recordings" / "screw_p00.parquet")]
    search = {"population": 6, "generations": 4, "method": method}
    return shipped("screw.toml", recordings={"fit": fit, "validate": held_out}, search=search)


def table4() -> dict[str, Any]:
    data = shipped("table4.toml", search={"population": 6, "generations": 3})
    return {key: value for key, value in data.items() if key not in ("surface", "line")}


def driven(folder: Path) -> dict[str, Any]:
    """A diagnosis of 2.5 s of two recordings, with one effect to try."""
    data = shipped("driven.toml")
    for role in ("fit", "validate"):
        table = pd.read_parquet(SCENARIOS / "recordings" / f"undeclared_{role}_1.parquet").head(2500)
        table.to_parquet(folder / f"{role}.parquet")
        data["recordings"][role] = [str(folder / f"{role}.parquet")]
    data["diagnose"] |= {"effects": ["windage"], "package": str(ROOT / "modelica" / "THSA"), "most": 1}
    return data


def simulated() -> dict[str, Any]:
    return screw("differential-evolution") | {"kind": "identify"}


STUDIES: dict[str, tuple[str, Callable[[], dict[str, Any]]]] = {
    "identify, local searches": ("identify", lambda: screw("local-first")),
    "identify, evolution": ("identify", lambda: screw("differential-evolution")),
    "tune": ("tune", table4),
    "simulate": ("simulate", simulated),
}


def without_times(content: Any) -> Any:
    if isinstance(content, dict):
        return {key: without_times(value) for key, value in content.items() if key not in TIMES}
    return [without_times(member) for member in content] if isinstance(content, list) else content


def kill() -> None:
    raise Killed


def run(
    command: str,
    data: dict[str, Any],
    folder: Path,
    at: int | None = None,
    happens: Callable[[], None] = kill,
) -> tuple[Any, int]:
    """Run the study; ``at`` so much progress something ``happens``; its result and how much progress was told."""
    told = 0

    def on_progress(_: Progress) -> None:
        nonlocal told
        told += 1
        if told == at:
            happens()

    asked = ask(command, data, folder=folder)
    kind = KINDS[command]
    kind.write(kind.run(asked.scenario, Place(folder, Executor(1), on_progress)), folder)
    return without_times(json.loads((folder / "result.json").read_text(encoding="utf-8"))), told


def kill_often(command: str, data: dict[str, Any], tmp_path: Path, kills: int, seed: int) -> None:
    whole, told = run(command, data, tmp_path / "whole")
    chance = random.Random(seed)
    cut, killed = tmp_path / "cut", 0
    for _ in range(kills):
        try:
            run(command, data, cut, chance.randrange(1, max(told, 2)))
        except Killed:
            killed += 1
        log = cut / RUNS
        if log.exists() and chance.random() < 0.5:  # a power cut tears the end besides
            log.write_bytes(log.read_bytes()[: -chance.randrange(1, 200)])
    assert killed
    assert run(command, data, cut)[0] == whole
    assert not (cut / RUNS).exists()


@pytest.mark.parametrize(
    "study", [s if s == "simulate" else pytest.param(s, marks=pytest.mark.slow) for s in STUDIES]
)
def test_a_study_that_is_killed_ends_like_the_undisturbed_one(study: str, tmp_path: Path) -> None:
    command, build = STUDIES[study]
    kill_often(command, build(), tmp_path, kills=2, seed=len(study))


@pytest.mark.nightly
@pytest.mark.parametrize("study", STUDIES)
def test_a_study_that_is_killed_ten_times_ends_like_the_undisturbed_one(study: str, tmp_path: Path) -> None:
    command, build = STUDIES[study]
    kill_often(command, build(), tmp_path, kills=10, seed=1)


@pytest.mark.slow
def test_what_was_run_is_not_run_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The second attempt at a tuning that was killed late runs the rest only, within a generation, too."""
    counts: list[int] = []
    plain = LocalRunner.run

    def counted(self: Any, jobs: Any, on_outcome: Any = None) -> Any:
        counts.append(len(jobs))
        return plain(self, jobs, on_outcome)

    _, told = run("tune", table4(), tmp_path / "whole")
    monkeypatch.setattr(LocalRunner, "run", counted)
    run("tune", table4(), tmp_path / "undisturbed")
    undisturbed = sum(counts)
    with pytest.raises(Killed):
        run("tune", table4(), tmp_path / "cut", told - 3)
    counts.clear()
    run("tune", table4(), tmp_path / "cut")
    assert 0 < sum(counts) < 0.5 * undisturbed


class Runs:
    """Counts the outcomes of all runs; from the ``limit``-th on something ``happens`` after each."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.ran, self.limit, self.happens = 0, 10**9, kill
        plain = LocalRunner.run

        def counted(runner: Any, jobs: Any, on_outcome: Any = None) -> Any:
            def note(index: int, outcome: Any) -> None:
                if on_outcome is not None:
                    on_outcome(index, outcome)
                self.ran += 1
                if self.ran >= self.limit:
                    self.happens()

            return plain(runner, jobs, note)

        monkeypatch.setattr(LocalRunner, "run", counted)


@pytest.mark.nightly
def test_a_diagnosis_that_is_killed_ends_like_the_undisturbed_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Killed at ten random runs: each attempt recalls what the ones before have run."""
    data, runs = driven(tmp_path), Runs(monkeypatch)
    whole, _ = run("diagnose", data, tmp_path / "whole")
    total, chance = runs.ran, random.Random(4)
    for _ in range(10):
        runs.ran, runs.limit = 0, chance.randrange(1, total // 4)
        with contextlib.suppress(Killed):
            run("diagnose", data, tmp_path / "cut")
    runs.ran, runs.limit = 0, 10**9
    cut, _ = run("diagnose", data, tmp_path / "cut")
    assert runs.ran < total
    assert json.loads(json.dumps(cut).replace("/cut/", "/whole/")) == whole


# -- the machine's faults -----------------------------------------------------------------------------
def full(monkeypatch: pytest.MonkeyPatch, temporary: Path) -> Callable[[], None]:
    def refuse(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(zipfile.ZipFile, "extractall", refuse)
    monkeypatch.setattr(shutil, "copyfileobj", refuse)
    monkeypatch.setattr(Path, "write_bytes", refuse)
    return lambda: None


def noexec(monkeypatch: pytest.MonkeyPatch, temporary: Path) -> Callable[[], None]:
    real = os.statvfs

    def mounted(path: Any) -> Any:
        found = real(path)
        fields = {name: getattr(found, name) for name in dir(found) if name.startswith("f_")}
        return SimpleNamespace(**{**fields, "f_flag": found.f_flag | os.ST_NOEXEC})

    monkeypatch.setattr(os, "statvfs", mounted)
    return lambda: None


def swept(monkeypatch: pytest.MonkeyPatch, temporary: Path) -> Callable[[], None]:
    def sweep() -> None:
        for folder in temporary.glob("thsa-cosim-*"):
            shutil.rmtree(folder, ignore_errors=True)
        for process in multiprocessing.active_children():
            process.kill()

    return sweep


def rows_of(study: Path) -> set[str]:
    """The rows of a study's journal, which holds no times."""
    journal = study / "journal.csv"
    return set(journal.read_text(encoding="utf-8").splitlines()) if journal.exists() else set()


FAULTS = {"full": (full, "is full"), "noexec": (noexec, "noexec"), "swept": (swept, "removed while")}


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("study", ["identify, evolution", "tune"])
def test_a_machines_fault_stops_the_study_and_leaves_no_row(study: str, fault: str, tmp_path: Path) -> None:
    """The sentence names the temporary folder; the same command after the repair ends right."""
    begin, says = FAULTS[fault]
    command, build = STUDIES[study]
    data, temporary = build(), tmp_path / "temporary"
    temporary.mkdir()
    whole, told = run(command, data, tmp_path / "whole")
    with pytest.MonkeyPatch.context() as broken:
        broken.setattr(tempfile, "tempdir", str(temporary))
        happens = begin(broken, temporary)
        with pytest.raises(MachineError, match=says) as caught:
            run(command, data, tmp_path / "cut", told // 2, happens)
        assert str(temporary) in str(caught.value)
        assert "same command again" in str(caught.value)
    assert rows_of(tmp_path / "cut") <= rows_of(tmp_path / "whole")
    assert run(command, data, tmp_path / "cut")[0] == whole


@pytest.mark.nightly
def test_a_swept_temporary_folder_stops_a_diagnosis(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    data, runs, temporary = driven(tmp_path), Runs(monkeypatch), tmp_path / "temporary"
    temporary.mkdir()
    whole, _ = run("diagnose", data, tmp_path / "whole")
    runs.ran, runs.limit, runs.happens = 0, runs.ran // 2, swept(monkeypatch, temporary)
    with pytest.MonkeyPatch.context() as broken:
        broken.setattr(tempfile, "tempdir", str(temporary))
        with pytest.raises(MachineError, match="removed while") as caught:
            run("diagnose", data, tmp_path / "cut")
    assert str(temporary) in str(caught.value)
    runs.limit = 10**9
    cut, _ = run("diagnose", data, tmp_path / "cut")
    assert json.loads(json.dumps(cut).replace("/cut/", "/whole/")) == whole


#: What of a result says nothing of where the study was run.
FOUND = {
    "identify": ("points", "failures"),
    "tune": ("gains", "before", "after", "failures"),
    "diagnose": ("verdict", "effects", "before", "after", "candidates", "failures"),
}


@pytest.mark.nightly
@pytest.mark.parametrize("kind", FOUND)
@pytest.mark.parametrize(("options", "says"), [("size=1m", "is full"), ("noexec", "noexec")])
def test_a_real_temporary_folder_that_is_full_or_noexec_stops_the_study(
    kind: str, options: str, says: str, tmp_path: Path
) -> None:
    """The same command, in a mounted folder that no FMU fits in or can be loaded from, and then elsewhere."""
    if shutil.which("unshare") is None or subprocess.run(["unshare", "-m", "true"], check=False).returncode:
        pytest.skip("mounting a folder of its own needs `unshare -m` (root)")
    place, study, scenario = tmp_path / "place", tmp_path / "study", tmp_path / "asked.toml"
    place.mkdir()
    data = {"tune": table4, "diagnose": lambda: driven(tmp_path)}.get(
        kind, lambda: screw("differential-evolution")
    )()
    scenario.write_text(toml(data), encoding="utf-8")
    command = f"{sys.executable} -m thsa_cosim.cli {kind} {scenario} -o {study} --workers 1 --quiet"
    mounted = f"mount -t tmpfs -o {options} tmpfs {place} && TMPDIR={place} exec {command}"
    asked = ["unshare", "-m", "sh", "-c", mounted]
    done = subprocess.run(asked, capture_output=True, text=True, timeout=300, check=False, cwd=ROOT)
    if "mount:" in done.stderr:
        pytest.skip(f"cannot mount here: {done.stderr.strip()}")
    assert done.returncode == 3, done.stderr
    assert f"{place} {'is mounted ' if says == 'noexec' else ''}{says}" in " ".join(done.stderr.split())
    again = subprocess.run(
        command.split(), capture_output=True, text=True, timeout=300, check=False, cwd=ROOT
    )
    assert again.returncode == 0, again.stderr
    whole = run(kind, data, tmp_path / "whole")[0]
    found = without_times(json.loads((study / "result.json").read_text(encoding="utf-8")))
    assert {key: found[key] for key in FOUND[kind]} == {key: whole[key] for key in FOUND[kind]}
    assert found["failures"] == {}
