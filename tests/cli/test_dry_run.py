"""``--dry-run``: what would run, and how long it would take, before anything is written."""

import json
from collections.abc import Sequence
from pathlib import Path

import pytest

from thsa_cosim import cli
from thsa_cosim.api.forecast import _usual
from thsa_cosim.batch import Job, Outcome, Status

ROOT = Path(__file__).parents[2]
SCENARIOS = ROOT / "scenarios"
pytestmark = pytest.mark.skipif(
    not (ROOT / "fmus" / "Screw.fmu").exists(), reason="fmus/Screw.fmu has not been exported"
)


def small(name: str, folder: Path, **replacements: str) -> Path:
    """A shipped scenario with a small search that does not stop early, its paths made absolute."""
    text = (SCENARIOS / name).read_text()
    changes = {
        '"../fmus/': f'"{ROOT / "fmus"}/',
        '"recordings/screw_*.parquet"': f'"{SCENARIOS}/recordings/screw_m[35]*.parquet"',
        "population = 45": "population = 6\ntolerance = 0",
        "generations = 30": "generations = 3",
        **replacements,
    }
    for old, new in changes.items():
        text = text.replace(old, new)
    path = folder / name
    path.write_text(text)
    return path


def run(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    capsys.readouterr()
    code = cli.run_command([str(a) for a in arguments])
    printed = capsys.readouterr()
    return code, printed.out, printed.err


def test_it_counts_what_the_study_then_runs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scenario = small("screw.toml", tmp_path, **{"polish = true": "polish = false"})
    study = tmp_path / "study"
    code, out, err = run(capsys, "identify", scenario, "-o", study, "--dry-run", "--json", "--workers", 2)
    assert (code, err) == (0, "")
    assert not study.exists()
    found = json.loads(out)
    (part,) = found["parts"]
    assert [(s["label"], s["cases"]) for s in part["searches"]] == [
        ("-55 degC", ["screw_m55"]),
        ("-50 degC", ["screw_m50"]),
        ("-30 degC", ["screw_m30"]),
    ]
    assert part["failures"] == {}
    assert found["seconds"] == pytest.approx(found["runs"] * part["run_s"] + part["besides_s"])
    assert part["besides_s"] > 0.0
    assert 0.0 < part["run_s"] < 5.0

    assert run(capsys, "identify", scenario, "-o", study, "--quiet", "--workers", 2)[0] == 0
    # Two vectors a point are spare: the estimate is simulated once more with its signals.
    evaluations = json.loads((study / "result.json").read_text())["evaluations"]
    assert evaluations <= found["runs"] <= evaluations + 3 * 2


def test_a_person_reads_points_runs_time_and_folder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scenario = small("screw.toml", tmp_path)
    code, out, _ = run(capsys, "identify", scenario, "-o", tmp_path / "study", "--dry-run", "--workers", 1)
    assert code == 0
    for words in (
        "-30 degC",
        "screw_m30",
        "about 318 runs; 12 timed",
        "more where local searches do not agree",
        "with 1 worker",
        "nothing was written",
    ):
        assert words in out
    assert f"{tmp_path / 'study'} would be made" in out


def test_a_tuning_counts_conditions_and_the_map(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scenario = small("table4.toml", tmp_path, **{"points = 25": "points = 3"})
    code, out, _ = run(
        capsys, "tune", scenario, "-o", tmp_path / "study", "--dry-run", "--json", "--workers", 2
    )
    assert code == 0
    (part,) = json.loads(out)["parts"]
    assert [s["vectors"] for s in part["searches"]] == [6 * 4 + 180]  # and the simplex, as a rule
    assert part["also"] == 3 + 9  # before, after, the article's gains; the map of the cost
    assert not (tmp_path / "study").exists()


class FailingRunner:
    """A runner of an FMU that never succeeds."""

    def __init__(self, *_: object, **limits: object) -> None:
        pass

    def run(self, jobs: Sequence[Job]) -> list[Outcome]:
        return [Outcome(Status.CRASH, "the process died by SIGSEGV") for _ in jobs]

    def __enter__(self) -> "FailingRunner":
        return self

    def __exit__(self, *_: object) -> None:
        pass


def test_failing_runs_are_told_beforehand(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("thsa_cosim.scenario.executor.LocalRunner", FailingRunner)
    scenario = small("screw.toml", tmp_path)
    code, out, _ = run(capsys, "identify", scenario, "-o", tmp_path / "study", "--dry-run")
    assert code == 0
    assert "12 of the timed runs failed: the process died by SIGSEGV" in out


def test_one_run_in_many_that_creeps_does_not_decide_the_forecast() -> None:
    usual = [Outcome(Status.OK, duration_s=0.01)] * 11
    assert _usual(usual, 0.12, 1) == pytest.approx(0.12 / 11)
    creeping = [*usual, Outcome(Status.OK, duration_s=6.0)]
    assert _usual(creeping, 6.13, 1) == pytest.approx((6.13 - (6.0 - 0.05)) / 12)
    # Two workers: while one creeps, the other has long done its share.
    assert 0.0 < _usual(creeping, 6.01, 2) < 0.3
