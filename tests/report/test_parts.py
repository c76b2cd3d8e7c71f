"""What a page is made from: populations from the journal, thinned signals, folders of every state, the command."""

import base64
import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
import report_studies as studies
from cli.test_identify import small_scenario
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from thsa_cosim import cli
from thsa_cosim.batch import Journal, read_journal
from thsa_cosim.errors import InputError
from thsa_cosim.report.folder import read_study
from thsa_cosim.report.identify.doubts import LawDoubts, doubt_sentences
from thsa_cosim.report.page import PAGE, write_page
from thsa_cosim.report.parts.chart import envelope, packed, plain
from thsa_cosim.report.parts.populations import evolutions
from thsa_cosim.report.parts.text import degrees, listing, plus_minus
from thsa_cosim.report.signal_files import read_signals, signal_units, write_signals
from thsa_cosim.search import EvolutionSettings, evolve
from thsa_cosim.signals import Signals
from thsa_cosim.study import claim_folder

ROOT = Path(__file__).parents[2]
LOCAL_FIRST, EVOLUTION = 'method = "local-first"', 'method = "differential-evolution"'


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A real study by the real command: the motor bench's first second at two temperatures."""
    if not (ROOT / "fmus" / "Motor.fmu").exists():
        pytest.skip("fmus/Motor.fmu has not been exported")
    folder = tmp_path_factory.mktemp("report")
    # The few vectors of this search find nothing; what is looked at is what they leave behind.
    changes = {"population = 12": "population = 6", "stop = 3.0": "stop = 1.0", LOCAL_FIRST: EVOLUTION}
    scenario = small_scenario(folder, **changes)
    held_out = ROOT / "scenarios" / "recordings" / "motor_m10.parquet"
    command = [
        "identify",
        scenario,
        "--validate",
        held_out,
        "-o",
        folder / "study",
        "--workers",
        2,
        "--quiet",
    ]
    done = subprocess.run(
        [sys.executable, "-m", "thsa_cosim.cli", *map(str, command)],
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return folder / "study"


def test_study_ends_with_its_page_which_needs_no_other_file(study: Path) -> None:
    text = (study / PAGE).read_text()
    own = text[: text.index("<script>")] + text[text.rindex("<script>") :]  # without plotly
    links = re.findall(r"""(?:src|href)=["']([^"']*)""", own)
    assert len(links) > 5
    assert all(link.startswith(("#", "data:")) for link in links)
    assert "http" not in re.sub(r"http-equiv", "", own)
    assert "R_s" in own
    assert "thsa-cosim identify" in own


def test_populations_of_the_journal_are_those_of_the_search(study: Path) -> None:
    result = json.loads((study / "result.json").read_text())
    journal = read_journal(study / "journal.csv")
    used = {p["label"]: len(p["generations"]) - 1 for p in result["points"]}
    found = {e.label: e for e in evolutions(journal, 6, 8, used)}
    assert set(found) == {"-30 degC", "25 degC"}
    for point in result["points"]:
        least, _, median, *_ = found[point["label"]].quantiles
        np.testing.assert_array_equal(least, [g["best_cost"] for g in point["generations"]])
        np.testing.assert_array_equal(median, [g["median_cost"] for g in point["generations"]])


def test_signal_files_hold_what_was_compared(study: Path) -> None:
    result = json.loads((study / "result.json").read_text())
    assert sorted(p.relative_to(study).as_posix() for p in study.glob("signals/*/*")) == [
        "signals/fit/motor_m30.parquet",
        "signals/fit/motor_p25.parquet",
        "signals/validate/motor_m10.parquet",
    ]
    for recording in result["recordings"]:
        file = read_signals(study / "signals" / recording["role"] / f"{recording['name']}.parquet")
        for channel, error in recording["error"].items():
            difference = file.channels[channel]["simulated"] - file.channels[channel]["measured"]
            assert np.sqrt(np.mean(difference**2)) == pytest.approx(error["rmse"], rel=1e-12)
            assert file.units[channel] == error["unit"]


def test_study_says_how_it_was_made_before_it_is_done(study: Path) -> None:
    about = json.loads((study / "study.json").read_text())["about"]
    assert about["command"].startswith("thsa-cosim identify ")
    assert "--validate" in about["command"]
    assert (about["population"], about["generations"]) == (6, 8)
    assert about["parameters"]["R_s"] == "ohm"
    assert set(about["samples"]) == {"-30 degC", "25 degC"}
    assert about["versions"]["numpy"] == np.__version__
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\+00:00", about["started"])


@pytest.mark.parametrize("seed", range(3))
def test_populations_follow_a_search_with_failures_and_a_torn_generation(tmp_path: Path, seed: int) -> None:
    settings = EvolutionSettings(population=7, generations=9, seed=seed, tolerance=0.0, spread_tolerance=0.0)
    rows: list[tuple[np.ndarray, np.ndarray]] = []

    def costs(vectors: np.ndarray) -> np.ndarray:
        found = np.sum((vectors - 0.3) ** 2, axis=1)
        found[vectors[:, 0] > 0.9] = np.inf
        rows.append((vectors, found))
        return found

    history = evolve(costs, 2, settings).history
    with Journal.open(tmp_path / "journal.csv", ["a", "b"]) as journal:
        for generation, (vectors, found) in enumerate(rows):
            # The last generation is on its way: some have come in, not in the order in which they were asked for.
            slots = [4, 0, 2] if generation == len(rows) - 1 else range(7)
            for k in slots:
                row = studies.journal_rows("x", 2, 0, 1)[0]
                values, cost = tuple(vectors[k].tolist()), float(found[k])
                journal.append([type(row)("x", generation * 7 + k + 1, values, cost, ())])
    (evolution,) = evolutions(read_journal(tmp_path / "journal.csv"), 7, 9)
    assert len(evolution.costs) == 10
    least, _, median, *_ = evolution.quantiles[:, :-1]
    np.testing.assert_array_equal(least, [g.best_cost for g in history[:-1]])
    np.testing.assert_array_equal(median, [g.median_cost for g in history[:-1]])
    assert evolution.quantiles[0, -1] >= history[-1].best_cost


def test_what_a_search_evaluated_later_is_no_generation(tmp_path: Path) -> None:
    studies.write_journal(tmp_path, ["all"], ["K_p", "K_i"], ["tracking"], generations=7)
    table = read_journal(tmp_path / "journal.csv")
    assert len(evolutions(table, studies.POPULATION, 4)[0].costs) == 5
    assert len(evolutions(table, studies.POPULATION, 4, {"all": 2})[0].costs) == 3
    assert evolutions(table, None, 4) == []


finite = st.floats(-1e6, 1e6, allow_subnormal=False)


@given(arrays(np.float64, st.integers(1, 400), elements=finite), st.integers(2, 40))
def test_thinned_signal_keeps_ends_extremes_and_order(values: np.ndarray, buckets: int) -> None:
    chosen = envelope(values, buckets)
    assert (np.diff(chosen) > 0).all()
    assert (chosen[0], chosen[-1]) == (0, values.size - 1)
    assert chosen.size <= max(2 * buckets + 2, values.size if values.size <= 2 * buckets else 0)
    assert (values[chosen].min(), values[chosen].max()) == (values.min(), values.max())


def test_text_for_plotly_is_shown_as_it_is_and_arrays_have_no_infinity() -> None:
    assert plain("<b>&%{x}") == "&lt;b&gt;&amp;% {x}"
    array = packed([[1.0, np.inf], [np.nan, 1e300]])
    assert array["shape"] == "2,2"
    decoded = np.frombuffer(base64.b64decode(array["bdata"]), "<f4")
    assert decoded[0] == 1.0
    assert np.isnan(decoded[1:]).all()


@pytest.mark.parametrize(
    ("value", "stderr", "text"),
    [
        (0.49812, 0.0021, "0.4981 ± 0.0021"),
        (4.57e-5, 2.1e-7, "(4.570 ± 0.021)e-5"),
        (2712.3, 41.0, "2712 ± 41"),
        (-3.2e6, 4.1e5, "(-3.20 ± 0.41)e6"),
        (0.0, 0.02, "0.000 ± 0.020"),
        (1.5, None, "1.5"),
        (None, 0.1, "–"),
        (float("nan"), 0.1, "–"),
    ],
)
def test_value_has_the_decimals_of_its_error(value: float | None, stderr: float | None, text: str) -> None:
    assert plus_minus(value, stderr) == text


def test_words() -> None:
    assert degrees(-0.0005) == "0 °C"
    assert degrees(-29.96) == "−30 °C"
    assert listing(["a", "b", "c"]) == "a, b and c"
    assert listing([str(k) for k in range(9)]) == "0, 1, 2, 3, 4, 5 and 3 more"


def test_signals_with_dots_in_every_name_come_back(tmp_path: Path) -> None:
    time = np.arange(5) * 0.1
    one = Signals(time, {"motor.i_q": time}, {"motor.i_q": "A"})
    short = Signals(time[:3], {"motor.i_q": 2.0 * time[:3]}, {"motor.i_q": "A"})
    path = write_signals(tmp_path, "fit", "run 1.5/b", {"measured": one, "v1.2": short})
    assert path.relative_to(tmp_path).as_posix() == "signals/fit/run_1.5_b.parquet"
    back = read_signals(path)
    assert (back.name, back.role, back.units) == ("run 1.5/b", "fit", {"motor.i_q": "A"})
    np.testing.assert_array_equal(back.channels["motor.i_q"]["measured"], time)
    np.testing.assert_array_equal(back.channels["motor.i_q"]["v1.2"], [0.0, 0.2, 0.4, np.nan, np.nan])
    assert signal_units(tmp_path) == {"motor.i_q": "A"}
    assert pq.read_schema(path).names == ["time_s", "motor.i_q.measured", "motor.i_q.v1.2"]


def test_signals_that_differ_in_case_only_come_back(tmp_path: Path) -> None:
    time = np.arange(3) * 0.1
    path = write_signals(
        tmp_path,
        "fit",
        "it's",
        {"measured": Signals(time, {"v": time, "V": 2.0 * time}, {"v": "m/s", "V": "V"})},
    )
    back = read_signals(path)
    assert back.name == "it's"
    np.testing.assert_array_equal(back.channels["v"]["measured"], time)
    np.testing.assert_array_equal(back.channels["V"]["measured"], 2.0 * time)


def run(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    code = cli.run_command([str(a) for a in arguments])
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def test_command_prints_the_page_that_it_wrote(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    studies.write_identify(tmp_path / "study")
    assert run(capsys, "report", tmp_path / "study") == (0, f"{tmp_path / 'study' / PAGE}\n", "")
    target = tmp_path / "elsewhere.html"
    assert run(capsys, "report", tmp_path / "study", "-o", target) == (0, f"{target}\n", "")
    assert target.read_text().startswith("<!DOCTYPE html>")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["elsewhere.html", "study"]


def damaged(folder: Path, case: str) -> Path:
    """A folder that is no study, or one that has suffered."""
    studies.write_identify(folder / "study")
    result = folder / "study" / "result.json"
    if case == "torn":
        result.write_text(result.read_text()[:-200])
    elif case == "list":
        result.write_text("[]")
    elif case == "other":
        result.write_text('{"kind": "identify", "points": [{"parameters": 3}]}')
    elif case == "journal":
        (folder / "study" / "journal.csv").write_text("a,b\n1,2\n")
    elif case == "signals":
        next((folder / "study").glob("signals/*/*")).write_text("no parquet")
    places = {"missing": folder / "nowhere", "above": folder, "file": folder / "study" / "study.json"}
    return places.get(case, folder / "study")


@pytest.mark.parametrize(
    ("case", "words"),
    [
        ("missing", "is no folder; give the folder of a study"),
        ("file", "is no folder"),
        ("above", "is no study folder: it has neither study.json nor result.json. Did you mean"),
        ("torn", "result.json is damaged: it is no JSON; repeat the study's command"),
        ("list", "result.json is damaged: it holds no object"),
        ("other", "holds a result that this version cannot read"),
        ("journal", "journal.csv is no journal of a study"),
        ("signals", "holds no signals of a study"),
    ],
)
def test_folder_that_is_no_study_gets_one_sentence(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, case: str, words: str
) -> None:
    code, out, err = run(capsys, "report", damaged(tmp_path, case))
    assert (code, out) == (2, "")
    assert words in err
    assert len(err.strip().splitlines()) == 1


def test_page_that_cannot_be_written_is_one_sentence(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    studies.write_identify(tmp_path / "study")
    code, _, err = run(capsys, "report", tmp_path / "study", "-o", tmp_path / "no" / "page.html")
    assert code == 2
    assert "cannot be written (No such file or directory); choose another file with -o." in err


def test_study_in_stages_that_runs_shows_the_stages_that_have_begun(tmp_path: Path) -> None:
    claim_folder(
        tmp_path, studies.identity("identify in stages"), studies.about(stages=["motor", "screw", "check"])
    )
    for number, name in enumerate(("motor", "screw"), start=1):
        place = tmp_path / f"{number}_{name}"
        claim_folder(place, studies.identity("identify"), studies.about(title=f"{name} bench"))
        studies.write_journal(place, ["-30 degC"], ["R_s"], ["i_q"], generations=number)
    found = read_study(tmp_path)
    assert found.status == "stopped"  # no process writes a journal
    assert [part.name for part in found.parts] == ["motor", "screw"]
    text = write_page(tmp_path).read_text()
    assert f"Its finished runs are kept. Continue with: {studies.COMMAND}" in text
    assert "6 vectors evaluated of at most 24 in 1 search, 1 failed so far." in text
    assert "12 vectors evaluated of at most 24 in 1 search, 2 failed so far." in text
    for name in ("motor-convergence", "screw-convergence", "motor-part", "screw-part"):
        assert f'id="{name}"' in text


def test_fresh_study_without_a_single_vector_has_a_page(tmp_path: Path) -> None:
    claim_folder(tmp_path, studies.identity("identify"), studies.about())
    text = write_page(tmp_path).read_text()
    assert "Its folder does not show whether it is still running" in text
    with Journal.open(tmp_path / "journal.csv", ["R_s"], ["i_q"]):
        assert read_study(tmp_path).status == "running"
        assert "0 vectors evaluated in 0 searches, 0 failed so far." in write_page(tmp_path).read_text()


def test_result_of_an_older_version_without_signals_and_study_file_still_has_a_page(tmp_path: Path) -> None:
    (tmp_path / "result.json").write_text(json.dumps(studies.identify_result()))
    text = write_page(tmp_path).read_text()
    assert "0.5000 ± 0.0050" in text


def test_reading_a_journal_takes_nothing_from_its_writer(tmp_path: Path) -> None:
    path = tmp_path / "journal.csv"
    with Journal.open(path, ["cost"], ["cost"]) as journal:  # names that look like the table's own
        journal.append(studies.journal_rows("a", 1, 1, 1))
        table = read_journal(path)
        assert (table.names, table.terms, table.in_use) == (("cost",), ("cost",), True)
        assert table.rows == journal.rows
        journal.append(studies.journal_rows("b", 1, 1, 1))
    assert not read_journal(path).in_use
    with Journal.open(path, ["cost"], ["cost"]) as journal:
        assert len(journal) == 2 * studies.POPULATION
    path.write_text("stage,index,status,reason\n")
    with pytest.raises(InputError, match="is no journal of a study"):
        read_journal(path)


def test_doubts_about_laws_are_told_once_where_both_laws_share_them() -> None:
    law = {
        "doubts": [{"kind": "sign", "severity": "warning", "text": "b is negative."}],
        "published": {
            "doubts": [
                {"kind": "sign", "severity": "warning", "text": "b is negative, too."},
                {"kind": "rate", "severity": "warning", "text": "b is fast."},
            ]
        },
    }
    assert doubt_sentences({"b": LawDoubts.read(law), "c": LawDoubts.read({})}) == [
        "warning: b is negative. The published law does so, too.",
        "warning: the published law of b: b is fast.",
    ]
