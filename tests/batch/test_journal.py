"""The journal: exact, durable, readable, and a study killed at any moment ends as if nothing had happened."""

import json
import math
import os
import random
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import pandas as pd
import pytest
from fmu_sources import build
from hypothesis import given, settings
from hypothesis import strategies as st

from thsa_cosim.batch import Journal, JournalRow, Status
from thsa_cosim.errors import InputError

NAMES, TERMS = ("R_s", "psi_pm"), ("i_q", "u_q")


def row(index: int = 0, values: tuple[float, ...] = (0.1, 1 / 3), **other: object) -> JournalRow:
    settings_: dict[str, object] = {"cost": 0.5, "terms": (0.2, 0.3)} | other
    return JournalRow("-30 degC", index, values, **settings_)  # type: ignore[arg-type]


numbers = st.floats(allow_nan=False)
texts = st.text(max_size=30)


@settings(max_examples=100, deadline=None)
@given(
    rows=st.lists(
        st.builds(
            JournalRow,
            stage=st.sampled_from(["-30 degC", "all", 'odd, "quoted"']),
            index=st.integers(0, 10**9),
            values=st.tuples(numbers, numbers),
            cost=numbers,
            terms=st.tuples(numbers, numbers),
            status=st.sampled_from(list(Status)),
            reason=texts,
        ),
        max_size=8,
    )
)
def test_rows_come_back_bit_for_bit(tmp_path_factory: pytest.TempPathFactory, rows: list[JournalRow]) -> None:
    path = tmp_path_factory.mktemp("journal") / "evaluations.csv"
    with Journal.open(path, NAMES, TERMS) as journal:
        journal.append(rows[:3])
        journal.append(rows[3:])
    with Journal.open(path, NAMES, TERMS) as journal:
        assert len(journal) == len(rows)
        for got, put in zip(journal.rows, rows, strict=True):
            assert repr(got.values) == repr(put.values)
            assert (got.stage, got.index, got.cost, got.terms) == (put.stage, put.index, put.cost, put.terms)
            assert got.status is put.status
            assert got.reason.split() == put.reason.replace("\0", " ").split()
            known = journal.known(put.stage, put.values)
            assert known is not None
            assert known.values == put.values


def test_lookup_is_exact_and_per_stage(tmp_path: Path) -> None:
    with Journal.open(tmp_path / "j.csv", NAMES, TERMS) as journal:
        journal.append([row()])
        assert journal.known("-30 degC", (0.1, 1 / 3)) == row()
        assert journal.known("-30 degC", (0.1, math.nextafter(1 / 3, 1.0))) is None
        assert journal.known("-40 degC", (0.1, 1 / 3)) is None


def test_pandas_reads_it(tmp_path: Path) -> None:
    path = tmp_path / "j.csv"
    with Journal.open(path, NAMES, TERMS) as journal:
        failed = row(
            1, status=Status.CRASH, reason="died,\nof SIGSEGV", cost=math.inf, terms=(math.inf, math.nan)
        )
        journal.append([row(), failed])
    table = pd.read_csv(path)
    assert list(table.columns) == [
        "stage",
        "index",
        "R_s",
        "psi_pm",
        "cost",
        "cost.i_q",
        "cost.u_q",
        "status",
        "reason",
    ]
    assert table["psi_pm"].tolist() == pytest.approx([1 / 3, 1 / 3], rel=1e-15)
    assert table["cost"].tolist() == [0.5, math.inf]
    assert table["status"].tolist() == ["ok", "crash"]
    assert table["reason"][1] == "died, of SIGSEGV"


def test_every_tear_loses_the_last_line_only(tmp_path: Path) -> None:
    path = tmp_path / "j.csv"
    with Journal.open(path, NAMES, TERMS) as journal:
        journal.append([row(i, (0.1 * i, 1.0)) for i in range(3)])
    whole = path.read_bytes()
    ends = [i + 1 for i, byte in enumerate(whole) if byte == ord("\n")]
    for length in range(len(whole) + 1):
        path.write_bytes(whole[:length])
        with Journal.open(path, NAMES, TERMS) as journal:
            kept = max(sum(end <= length for end in ends) - 1, 0)
            assert len(journal) == kept
            journal.append([row(9, (9.0, 9.0))])
        with Journal.open(path, NAMES, TERMS) as journal:
            assert len(journal) == kept + 1


def test_zeros_after_a_power_failure_are_dropped(tmp_path: Path) -> None:
    path = tmp_path / "j.csv"
    with Journal.open(path, NAMES, TERMS) as journal:
        journal.append([row()])
    whole = path.read_bytes()
    path.write_bytes(whole + bytes(100) + b"\n")
    with Journal.open(path, NAMES, TERMS) as journal:
        assert len(journal) == 1
    assert path.read_bytes() == whole


def test_damage_further_up_is_reported_with_its_line(tmp_path: Path) -> None:
    path = tmp_path / "j.csv"
    with Journal.open(path, NAMES, TERMS) as journal:
        journal.append([row(i, (float(i), 1.0)) for i in range(3)])
    lines = path.read_text().splitlines(keepends=True)
    lines[2] = lines[2].replace("1.0", "one")
    path.write_text("".join(lines))
    with pytest.raises(InputError, match=r"line 3 is damaged"):
        Journal.open(path, NAMES, TERMS)


def test_another_studys_journal_and_a_second_writer_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "j.csv"
    with Journal.open(path, NAMES, TERMS), pytest.raises(InputError, match="in use by another run"):
        Journal.open(path, NAMES, TERMS)
    with pytest.raises(InputError, match="other parameters or cost terms"):
        Journal.open(path, (*NAMES, "b_m"), TERMS)


def test_wrong_lengths_are_refused(tmp_path: Path) -> None:
    with Journal.open(tmp_path / "j.csv", NAMES, TERMS) as journal:
        with pytest.raises(ValueError, match="2 values and 2 terms"):
            journal.append([row(values=(1.0,))])
        journal.append([])
        assert len(journal) == 0


STUDY = """
    import json, sys
    from pathlib import Path
    from time import sleep
    import numpy as np
    from thsa_cosim.batch import Experiment, Job, Journal, JournalRow, LocalRunner
    from thsa_cosim.signals import Signals

    fmu, folder, enough = Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3])
    time = np.linspace(0.0, 1.0, 101)
    names, bounds = ("tau", "k"), np.array([[0.01, 0.5], [0.5, 4.0]])

    def reduce(signals):
        return np.array([np.sum((signals["y"] - 1.7 * (1.0 - np.exp(-time / 0.12))) ** 2)])

    if __name__ == "__main__":
        inputs = Signals(time, {"u": np.ones_like(time)})
        experiment = Experiment("step", fmu, inputs, ("y",), time, reduce=reduce)
        random = np.random.default_rng(7)
        simulated = written = 0
        with (
            LocalRunner([experiment], workers=2, backend="python") as runner,
            Journal.open(folder / "evaluations.csv", names, ("y",)) as journal,
        ):
            def evaluate(generation, vectors):
                global simulated
                costs = np.empty(len(vectors))
                todo = []
                for i, vector in enumerate(vectors):
                    known = journal.known("all", vector.tolist())
                    if known is None:
                        todo.append(i)
                    else:
                        costs[i] = known.cost
                # Every eleventh run crashes: failures are replayed like costs.
                fault = [1.0 if v[0] * 1e4 % 11 < 1 else 0.0 for v in vectors]
                jobs = [Job("step", dict(zip(names, vectors[i].tolist())) | {"fault": fault[i]}) for i in todo]

                def write(position, outcome):
                    global written
                    i = todo[position]
                    costs[i] = outcome.reduced[0] if outcome.ok else np.inf
                    journal.append(
                        [JournalRow("all", generation, tuple(vectors[i].tolist()), float(costs[i]),
                                    (float(costs[i]),), outcome.status, outcome.reason)]
                    )
                    written += 1
                    if written == enough:
                        sleep(600.0)  # to be killed here at the latest, however slow the machine is

                runner.run(jobs, write)
                simulated += len(jobs)
                return costs

            population = random.uniform(*bounds, (8, 2))
            costs = evaluate(0, population)
            for generation in range(1, 9):
                trial = np.clip(population + random.normal(size=(8, 2)) * 0.1 * (bounds[1] - bounds[0]), *bounds)
                found = evaluate(generation, trial)
                better = found < costs
                population[better], costs[better] = trial[better], found[better]
            best = int(np.argmin(costs))
            rows = len(journal)
        result = {"best": population[best].tolist(), "cost": costs[best], "rows": rows}
        (folder / "result.json").write_text(json.dumps(result))
        print(simulated)
"""


def test_a_study_killed_ten_times_ends_like_the_undisturbed_one(tmp_path: Path) -> None:
    script = tmp_path / "study.py"
    script.write_text(textwrap.dedent(STUDY))
    temporary = tmp_path / "temporary"
    environment = os.environ | {"TMPDIR": str(temporary)}
    fmu = build.lag2()

    def start(folder: Path, enough: int = 1000) -> "subprocess.Popen[str]":
        folder.mkdir(exist_ok=True)
        return subprocess.Popen(
            [sys.executable, str(script), str(fmu), str(folder), str(enough)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=environment,
        )

    temporary.mkdir()
    begin = time.monotonic()
    output, errors = start(tmp_path / "undisturbed").communicate(timeout=120.0)
    assert errors == ""
    assert int(output) == 72
    lasted = time.monotonic() - begin
    seed = random.Random(3)
    disturbed = tmp_path / "disturbed"
    journal = disturbed / "evaluations.csv"
    kills = 0
    while kills < 10:
        # Some kills come before the first row, most while rows are being written.
        wanted = seed.choice((0, 1, 1, 2, 3)) if kills else 0
        size = journal.stat().st_size if journal.exists() else 0
        process = start(disturbed, wanted + 2)
        until = time.monotonic() + 60.0
        while wanted and process.poll() is None and time.monotonic() < until:
            grown = journal.read_bytes()[size:] if journal.exists() else b""
            if grown.count(b"\n") >= wanted:
                break
            time.sleep(0.002)
        if not wanted:
            time.sleep(seed.uniform(0.0, 0.3 * lasted))
        time.sleep(seed.uniform(0.0, 0.01))
        process.send_signal(signal.SIGKILL)
        process.communicate(timeout=30.0)
        assert not (disturbed / "result.json").exists(), "the study ended before it was killed ten times"
        kills += 1
    rows = journal.read_text().count("\n") - 1
    assert 5 < rows < 72
    output, errors = start(disturbed).communicate(timeout=120.0)
    assert errors == ""
    assert int(output) == 72 - rows  # nothing is evaluated twice
    results = [
        json.loads((folder / "result.json").read_text()) for folder in (tmp_path / "undisturbed", disturbed)
    ]
    assert results[0] == results[1]
    tables = [pd.read_csv(f / "evaluations.csv") for f in (tmp_path / "undisturbed", disturbed)]
    columns = ["index", "tau", "k"]
    first, second = (t.sort_values(columns).reset_index(drop=True) for t in tables)
    assert first.drop(columns="reason").equals(second.drop(columns="reason"))
    assert (first["status"] == "crash").any()
    until = time.monotonic() + 60.0
    while list(temporary.iterdir()) and time.monotonic() < until:
        time.sleep(0.05)
    assert list(temporary.iterdir()) == []
