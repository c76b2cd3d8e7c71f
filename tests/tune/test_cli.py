"""``thsa-cosim tune`` as a subprocess: the figures of table IV, a schedule, resuming, refusals."""

import csv
import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
SCENARIOS = ROOT / "scenarios"
RECORDINGS = ROOT.parent / "shared" / "recordings" / "table4"
pytestmark = pytest.mark.skipif(
    not (ROOT / "fmus" / "THSA.fmu").exists(), reason="fmus/THSA.fmu has not been exported"
)
QUICK = {"population = 45": "population = 8", "generations = 30": "generations = 4"}
NO_SURFACE = {'[surface]\nparameters = ["K_p", "K_i"]\npoints = 25\n': ""}


def run(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "thsa_cosim.cli", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)


def result_of(folder: Path) -> dict:
    return json.loads((folder / "result.json").read_text())


def scenario(folder: Path, name: str = "table4", **replacements: str) -> Path:
    """A shipped scenario with replacements, in a folder of its own."""
    text = (SCENARIOS / f"{name}.toml").read_text().replace('"../fmus', f'"{ROOT / "fmus"}')
    for old, new in replacements.items():
        assert old in text, old
        text = text.replace(old, new)
    path = folder / f"{name}.toml"
    path.write_text(text)
    return path


@pytest.fixture(scope="module")
def table4(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, subprocess.CompletedProcess[str]]:
    """The shipped scenario as it is, and what the command printed."""
    folder = tmp_path_factory.mktemp("table4") / "study"
    done = run("tune", SCENARIOS / "table4.toml", "-o", folder)
    assert done.returncode == 0, done.stderr
    return folder, done


def test_the_article_s_first_row_comes_out(table4) -> None:
    before = result_of(table4[0])["before"]
    assert before["gains"] == {"K_p": 0.12, "K_i": 0.45}
    assert 0.42 <= before["rise_time"] <= 0.45
    assert 0.0019 <= before["steady_state_error"] <= 0.0022


def test_the_tuned_gains_beat_the_article_s(table4) -> None:
    result = result_of(table4[0])
    after, article = result["after"], result["compare"]["article"]
    assert after["rise_time"] <= 0.31
    assert abs(after["steady_state_error"]) <= 1.3e-4
    assert after["overshoot"] <= min(result["before"]["overshoot"], article["overshoot"])
    assert after["cost"] < article["cost"] < result["before"]["cost"]
    assert after["cost"] == pytest.approx(sum(after["cost_terms"].values()))
    assert all(r["met"] for r in result["requirements"])
    assert result["gains"] == after["gains"]
    # SciPy's simplex on costs of its own ends at 355.514, in the corner of the bandwidth's limit.
    assert after["cost"] == pytest.approx(355.514, rel=2e-4)
    assert after["bandwidth"] == pytest.approx(50.0, rel=2e-3)
    assert result["schedule"] == [{"temperature_degC": -30.0, "F_load_kN": 55.0, **result["gains"]}]


def test_the_study_holds_line_surface_front_and_pictures(table4) -> None:
    folder, done = table4
    result = result_of(folder)
    line = result["line"]
    assert line["published"] == 0.1218
    assert line["ratio"] == pytest.approx(result["gains"]["K_p"] / result["gains"]["K_i"], rel=0.1)
    cost = np.array(result["surface"]["cost"], dtype=float)
    assert cost.shape == (25, 25)
    assert result["after"]["cost"] <= np.nanmin(cost) * 1.001
    front = result["pareto"]["front"]
    efforts, errors = [p["effort"] for p in front], [p["tracking"] for p in front]
    assert efforts == sorted(efforts)
    assert errors == sorted(errors, reverse=True)
    for name in ("surface", "response_T_amb_-30_degC_F_load_55_kN", "convergence", "pareto"):
        assert (folder / "plots" / f"{name}.png").read_bytes().startswith(b"\x89PNG")
    assert "cost (equation 7)" in done.stdout
    assert "published 0.1218" in done.stdout


def test_a_half_finished_study_ends_like_an_undisturbed_one(tmp_path: Path) -> None:
    path = scenario(tmp_path, **QUICK, **NO_SURFACE)
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    assert run("tune", path, "-o", whole, "--workers", 2).returncode in (0, 3)
    cut.mkdir()
    (cut / "study.json").write_bytes((whole / "study.json").read_bytes())
    lines = (whole / "journal.csv").read_bytes().splitlines(keepends=True)
    (cut / "journal.csv").write_bytes(b"".join(lines[:20]) + lines[20][:30])  # the last line is torn
    done = run("tune", path, "-o", cut, "--workers", 1)
    assert done.returncode in (0, 3), done.stderr
    first, second = result_of(whole), result_of(cut)
    assert first["gains"] == second["gains"]
    assert first["after"] == second["after"]
    assert (cut / "journal.csv").read_bytes() == (whole / "journal.csv").read_bytes()
    other = run("tune", path, "-o", whole, "--seed", 9)
    assert other.returncode == 2
    assert "this one has seed = 9" in other.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="needs SIGINT")
def test_ctrl_c_keeps_what_was_evaluated(tmp_path: Path) -> None:
    folder = tmp_path / "study"
    command = [
        sys.executable,
        "-m",
        "thsa_cosim.cli",
        "tune",
        str(SCENARIOS / "table4.toml"),
        "-o",
        str(folder),
    ]
    process = subprocess.Popen([*command, "--workers", "1"], stderr=subprocess.PIPE, text=True)
    journal, until = folder / "journal.csv", time.monotonic() + 60.0
    while not (journal.exists() and journal.read_bytes().count(b"\n") > 90) and time.monotonic() < until:
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "continue with: thsa-cosim tune" in errors
    result = result_of(folder)
    assert (result["status"], result["gains"], result["after"]) == ("interrupted", {}, None)
    assert journal.read_bytes().endswith(b"\n")


def test_what_cannot_be_met_is_said_and_leaves_with_3(tmp_path: Path) -> None:
    path = scenario(tmp_path, **QUICK, **NO_SURFACE, **{"maximum = 0.4": "maximum = 0.01"})
    done = run("tune", path, "-o", tmp_path / "study", "--workers", 1)
    assert done.returncode == 3
    assert "no gains within the bounds keep every hard requirement" in done.stderr
    result = result_of(tmp_path / "study")
    assert result["feasible"] is False
    assert any("settling_time" in note for note in result["notes"])


def test_a_small_schedule_is_written_and_checked_between_its_nodes(tmp_path: Path) -> None:
    path = scenario(
        tmp_path,
        "schedule",
        **{
            "values = [-55.0, -40.0, -25.0, -10.0, 5.0, 25.0]": "values = [-55.0, -15.0, 25.0]",
            "values = [-55.0, 0.0, 55.0]": "values = [-55.0, 55.0]",
            "values = [-55.0, -27.5, 0.0, 27.5, 55.0]": "values = [-55.0, 55.0]",
            "step = 2.5": "step = 20.0",
            "population = 30": "population = 12",
            "generations = 20": "generations = 8",
            "lower = 0.03\nupper = 3.0": "lower = 0.3\nupper = 2.0",
            "lower = 0.1\nupper = 300.0": "lower = 3.0\nupper = 30.0",
        },
    )
    done = run("tune", path, "-o", tmp_path / "study", "--workers", 2)
    assert done.returncode == 0, done.stderr
    result = result_of(tmp_path / "study")
    rows = result["schedule"]
    assert [row["temperature_degC"] for row in rows] == [-55.0, -15.0, 25.0]
    assert all(row["K_p"] > 0 and row["K_i"] > 0 for row in rows)
    sets = result["schedule_check"]["sets"]
    assert set(sets) == {"schedule", "best single set", "article", "before"}
    assert result["schedule_check"]["conditions"] == 10
    assert not sets["before"]["holds"]
    with (tmp_path / "study" / "schedule_check.csv").open() as file:
        table = list(csv.DictReader(file))
    assert len(table) == 40
    worst = max(float(row["rise_time"]) for row in table if row["gains"] == "schedule")
    assert worst == sets["schedule"]["worst"]["rise_time"]
    for name in ("schedule.csv", "schedule.json", "gain_schedule.h", "GainSchedule.mo"):
        assert (tmp_path / "study" / name).stat().st_size > 100
    assert (tmp_path / "study" / "plots" / "schedule_check.png").exists()


@pytest.mark.nightly
def test_the_shipped_schedule_holds_everywhere(tmp_path: Path) -> None:
    done = run("tune", SCENARIOS / "schedule.toml", "-o", tmp_path / "study")
    assert done.returncode == 0, done.stderr
    with (tmp_path / "study" / "schedule_check.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["gains"] == "schedule"]
    temperatures = sorted({float(row["temperature_degC"]) for row in rows})
    assert temperatures == pytest.approx(np.arange(-55.0, 25.1, 2.5))
    assert {float(row["F_load_kN"]) for row in rows} == {-55.0, -27.5, 0.0, 27.5, 55.0}
    assert len(rows) == 165
    assert max(float(row["rise_time"]) for row in rows) <= 0.32
    assert max(abs(float(row["steady_state_error"])) for row in rows) <= 2e-4
    sets = result_of(tmp_path / "study")["schedule_check"]["sets"]
    assert sets["schedule"]["holds"]
    assert sets["schedule"]["cost"] < sets["best single set"]["cost"] < sets["article"]["cost"]


def test_another_fmu_needs_another_scenario_only(tmp_path: Path) -> None:
    motor = ROOT / "fmus" / "Motor.fmu"
    path = tmp_path / "motor.toml"
    path.write_text(f"""
kind = "tune"
fmu = "{motor}"
command = {{ input = "w_cmd", output = "w_m", shape = "step", final = 100.0, stop = 0.5 }}
before = {{ speed_gain = 0.002, reset = 0.2 }}
metrics = {{ rise = "between", window = [0.4, 0.5] }}
cost = {{ kappa_rise = 1.0e4, kappa_steady = 1.0e4 }}
search = {{ population = 8, generations = 4 }}
[conditions.T_amb]
from = -55.0
to = 25.0
step = 40.0
[robust]
combine = "sum"
[[requirements]]
metric = "peak"
signal = "i_q"
maximum = 39.0
hard = false
penalty = 1e4
[[parameters]]
name = "speed_gain"
variable = "velocityController.K_p"
unit = "A/rpm"
lower = 0.001
upper = 0.1
[[parameters]]
name = "reset"
variable = "velocityController.K_i"
unit = "A/rad"
lower = 0.1
upper = 20.0
""")
    done = run("tune", path, "-o", tmp_path / "study", "--workers", 2)
    assert done.returncode == 0, done.stderr
    result = result_of(tmp_path / "study")
    assert set(result["gains"]) == {"speed_gain", "reset"}
    assert result["after"]["cost"] < result["before"]["cost"]
    assert result["after"]["rise_time"] < 0.2


def test_uncertain_parameters_add_simulations_and_never_lower_the_worst_cost(tmp_path: Path) -> None:
    identified = {
        "points": [
            {
                "temperature_degC": -30.0,
                "parameters": {"F_fn": {"value": 2.2e3, "unit": "N", "stderr": 300.0}},
                "correlation": [[1.0]],
            }
        ]
    }
    (tmp_path / "identified.json").write_text(json.dumps(identified))
    more = """
[uncertainty]
result = "identified.json"
samples = 3
temperature = "T_amb"
variables = { F_fn = "nut.F_fn.a0" }
"""
    path = scenario(tmp_path, **QUICK, **NO_SURFACE)
    plain = run("tune", path, "-o", tmp_path / "plain", "--workers", 2)
    path.write_text(path.read_text() + more)
    robust = run("tune", path, "-o", tmp_path / "robust", "--workers", 2)
    assert {plain.returncode, robust.returncode} <= {0, 3}
    one, many = result_of(tmp_path / "plain"), result_of(tmp_path / "robust")
    assert many["before"]["cost"] > one["before"]["cost"]
    assert many["compare"]["article"]["rise_time"] > one["compare"]["article"]["rise_time"]
    (tmp_path / "identified.json").write_text("{}")
    broken = run("tune", path, "-o", tmp_path / "broken")
    assert broken.returncode == 2
    assert "identified.json is no result of an identification" in broken.stderr


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('input = "v_cmd"', 'input = "v_cmnd"', "Did you mean 'v_cmd'?"),
        ('shape = "ramp"', 'shape = "step"', "takes final and nothing else"),
        ('unit = "mm/s"', 'unit = "mm"', "command: "),
        ("values = [-30.0]", "values = []", "conditions.T_amb.values"),
        ('[conditions.F_load]\nvalues = [55.0]\nunit = "kN"', "", "conditions.F_load is missing"),
        ("velocityController.K_i", "velocityController.Ki", "Did you mean 'velocityController.K_i'?"),
        ("K_i = 0.45", "", "before.K_i is missing"),
        ("K_i = 0.45", "K_i = 0.45\nK_d = 1.0", "before.K_d is no parameter"),
        ('metric = "overshoot"', 'metric = "overshot"', "Did you mean 'overshoot'?"),
        ('signal = "velocityController.y"', 'signal = "velocityController.yy"', "loop.signal"),
        ('[loop]\nsignal = "velocityController.y"', "", "needs the table [loop]"),
        ("window = [1.0, 1.2]", "window = [1.2, 1.0]", "metrics"),
        ("kappa_rise = 1000.0", "kapparise = 1000.0", "Did you mean 'kappa_rise'?"),
        ('denominator = "K_i"', 'denominator = "K_j"', "line: 'K_j' is no parameter"),
        ('x = "effort"', 'x = "efort"', "Did you mean 'effort'?"),
        ('parameters = ["K_p", "K_i"]', 'parameters = ["K_p", "K_p"]', "two different parameters"),
        ("lower = 0.03", "lower = -0.03", "log scale"),
    ],
)
def test_wrong_keys_and_values_are_one_sentence(tmp_path: Path, old: str, new: str, said: str) -> None:
    from thsa_cosim.errors import InputError
    from thsa_cosim.scenario import load

    path = scenario(tmp_path, **{old: new})
    with pytest.raises(InputError) as caught:
        load(path)
    text = str(caught.value)
    assert said in text
    assert str(path) in text
    assert "\n" not in text


def test_the_kind_and_the_command_must_match(tmp_path: Path) -> None:
    wrong = run("identify", SCENARIOS / "table4.toml", "-o", tmp_path / "a")
    assert wrong.returncode == 2
    assert "run 'thsa-cosim tune" in wrong.stderr
    other = run("tune", SCENARIOS / "motor.toml", "-o", tmp_path / "b")
    assert other.returncode == 2
    assert "run 'thsa-cosim identify" in other.stderr
    fitted = run("tune", SCENARIOS / "table4.toml", "--fit", "x.csv", "-o", tmp_path / "c")
    assert fitted.returncode == 2
    assert "leave out --fit" in fitted.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(not RECORDINGS.exists(), reason="../shared/recordings/table4 is not there")
@pytest.mark.parametrize(("name", "k_p", "k_i"), [("tuned_at_25", 0.12, 0.45), ("optimized", 0.363, 2.98)])
def test_the_recordings_of_table_iv_are_predicted(tmp_path: Path, name: str, k_p: float, k_i: float) -> None:
    path = tmp_path / "check.toml"
    path.write_text(f"""
kind = "simulate"
fmu = "{ROOT / "fmus" / "THSA.fmu"}"
fixed = {{ "velocityController.K_p" = {k_p}, "velocityController.K_i" = {k_i} }}
[recordings]
validate = ["{RECORDINGS / f"{name}.csv"}"]
time = {{ column = "time_s", unit = "s" }}
[recordings.columns]
v_cmd = {{ column = "velocity_command_mm_s", unit = "mm/s" }}
F_load = {{ column = "load_kN", unit = "kN", smooth = "mean" }}
T_amb = {{ column = "temperature_degC", unit = "degC", smooth = "mean" }}
v = {{ column = "velocity_mm_s", unit = "mm/s" }}
i_q = {{ column = "q_current_A", unit = "A" }}
""")
    done = run("simulate", path, "-o", tmp_path / "study", "--workers", 1)
    assert done.returncode == 0, done.stderr
    (recording,) = result_of(tmp_path / "study")["recordings"]
    print(name, {k: e["nrmse"] for k, e in recording["error"].items()})
    assert recording["error"]["v"]["nrmse"] <= 0.0078
    assert recording["error"]["i_q"]["nrmse"] <= 0.0356
