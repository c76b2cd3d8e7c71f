"""``thsa-cosim init``: a scenario drafted from an FMU and a recording loads, runs and maps the right columns."""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from fmu_sources import build
from fmu_sources.build import HABITS2
from hypothesis import given, settings
from hypothesis import strategies as st
from small_scenario import write_fmu

from thsa_cosim import cli
from thsa_cosim.draft import draft_from_columns, draft_scenario, find_columns, match_columns, time_column
from thsa_cosim.errors import ParameterError
from thsa_cosim.fmu import FmuDescription, Variable, read_description
from thsa_cosim.fmu.description import DefaultExperiment
from thsa_cosim.recordings.columns import FoundColumn, words
from thsa_cosim.scenario import load

ROOT = Path(__file__).parents[2]
SCENARIOS = ROOT / "scenarios"
RECORDINGS = SCENARIOS / "recordings"
needs_fmus = pytest.mark.skipif(
    not (ROOT / "fmus" / "THSA.fmu").exists(), reason="fmus/THSA.fmu has not been exported"
)


@needs_fmus
@pytest.mark.parametrize(
    ("name", "recording"),
    [
        ("driven_check", "driven_m30_a"),
        ("motor", "motor_m10"),
        ("screw", "screw_m10"),
        ("gearbox", "gearbox_m10"),
    ],
)
def test_shipped_recordings_are_matched_as_their_scenarios_do(
    name: str, recording: str, tmp_path: Path
) -> None:
    by_hand = tomllib.loads((SCENARIOS / f"{name}.toml").read_text())
    fmu = read_description(SCENARIOS / by_hand["fmu"])
    draft = draft_scenario(fmu, [RECORDINGS / f"{recording}.parquet"], tmp_path / "scenario.toml")
    data = tomllib.loads(draft.text)
    wanted = {n: (c["column"], c["unit"]) for n, c in by_hand["recordings"]["columns"].items()}
    assert {n: (c["column"], c["unit"]) for n, c in data["recordings"]["columns"].items()} == wanted
    assert data["recordings"]["time"] == {"column": "time_s", "unit": "s"}
    assert data["temperature"]["input"] == "T_amb"
    assert data["recordings"]["columns"]["T_amb"]["smooth"] == "mean"


@needs_fmus
def test_files_are_given_with_or_without_options(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    fmu, recording = str(ROOT / "fmus" / "Motor.fmu"), str(RECORDINGS / "motor_m30.parquet")
    assert cli.run_command(["init", "--fmu", fmu, "--recording", recording, "-o", "a.toml"]) == 0
    assert cli.run_command(["init", recording, fmu, "-o", "b.toml"]) == 0
    assert cli.run_command(["init", fmu, "--recording", recording, "-o", "c.toml"]) == 0
    texts = [Path(f"{n}.toml").read_text(encoding="utf-8").replace(f"{n}.toml", "S") for n in "abc"]
    assert texts[0] == texts[1] == texts[2]


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ([], "init takes one FMU, and none was given"),
        (["a.fmu", "b.fmu", "x.csv"], "2 were given (a.fmu, b.fmu)"),
        (["a.fmu", "--fmu", "b.fmu", "x.csv"], "2 were given (a.fmu, b.fmu)"),
        (["a.fmu"], "no recording was given: thsa-cosim init a.fmu RECORDING.csv"),
    ],
)
def test_what_is_missing_is_one_sentence(
    given: list[str], sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.run_command(["init", *given]) == 2
    assert sentence in capsys.readouterr().err


@needs_fmus
def test_three_commands_from_a_recording_to_parameters_with_uncertainty(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    recording = RECORDINGS / "screw_p25.parquet"
    init = [
        "init",
        "--fmu",
        str(ROOT / "fmus" / "Screw.fmu"),
        "--recording",
        str(recording),
        "-o",
        "screw.toml",
    ]
    names = [v.name for v in read_description(ROOT / "fmus" / "Screw.fmu").parameters]
    force, viscous = (next(n for n in names if n.endswith(end)) for end in ("F_fn.a0", "b_n.a0"))
    assert cli.run_command([*init, "--identify", f"{force}=10:5000", "--identify", f"{viscous}=100:1e6"]) == 0
    assert "is ready: thsa-cosim check screw.toml --sensitivity" in capsys.readouterr().out
    assert cli.run_command(["check", "screw.toml", "--sensitivity"]) == 0
    assert cli.run_command(["identify", "screw.toml", "-o", "study", "--workers", "1"]) == 0
    (point,) = json.loads((tmp_path / "study" / "result.json").read_text())["points"]
    for estimate in point["parameters"].values():
        assert estimate["identifiable"]
        assert 0.0 < estimate["stderr"] < 0.1 * abs(estimate["value"])


@needs_fmus
@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ("motor.R_s.a9", "has no parameter 'motor.R_s.a9' to identify. Did you mean"),
        (
            "motor.R_s.alpha1",
            "starts at 0, which gives no bounds to search; add them as motor.R_s.alpha1=LOWER:UPPER",
        ),
        ("motor.R_s.a0=1", "The bounds '1' of 'motor.R_s.a0' are not LOWER:UPPER"),
        ("motor.R_s.a0=5:1", "gives no bounds to search"),
    ],
)
def test_a_parameter_that_cannot_be_identified_is_one_sentence(tmp_path: Path, asked: str, said: str) -> None:
    fmu = read_description(ROOT / "fmus" / "Motor.fmu")
    with pytest.raises(ParameterError) as caught:
        draft_scenario(fmu, [RECORDINGS / "motor_p25.parquet"], tmp_path / "scenario.toml", [asked])
    assert said in str(caught.value)


@needs_fmus
def test_what_init_writes_runs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    recording = RECORDINGS / "motor_p25.parquet"
    init = ["init", "--fmu", str(ROOT / "fmus" / "Motor.fmu"), "--recording", str(recording)]
    assert cli.run_command(init) == 0
    printed = capsys.readouterr()
    assert printed.err == ""
    assert "scenario.toml is ready: thsa-cosim simulate scenario.toml" in printed.out
    assert cli.run_command(["simulate", "scenario.toml", "-o", "study", "--workers", "1"]) == 0
    assert json.loads(Path("study/result.json").read_text())["failures"] == {}
    capsys.readouterr()
    assert cli.run_command(init) == 2
    assert "scenario.toml exists already; choose another file with -o." in capsys.readouterr().err


def csv(path: Path, header: str, seed: int = 0) -> Path:
    rng = np.random.default_rng(seed)
    columns = header.split(",")
    rows = np.column_stack([np.arange(40) * 0.01, *(rng.normal(size=40) for _ in columns[1:])])
    np.savetxt(path, rows, delimiter=",", header=header, comments="", fmt="%.6g")
    return path


@pytest.fixture
def small(tmp_path: Path) -> FmuDescription:
    """Inputs w_cmd [rad/s], T_amb [degC]; outputs w_m [rad/s], i_q [A]; about-texts without meaning."""
    return write_fmu(tmp_path / "Small.fmu")


def mapping(text: str) -> dict[str, object]:
    columns = tomllib.loads(text)["recordings"]["columns"]
    return {name: table.get("column", table.get("value")) for name, table in columns.items()}


def test_what_fits_nowhere_is_listed_and_the_rest_still_loads(small: FmuDescription, tmp_path: Path) -> None:
    file = csv(tmp_path / "run.csv", "Time [s],W CMD [rpm],vibration [m/s2],note")
    target = tmp_path / "scenario.toml"
    draft = draft_scenario(small, [file], target)
    assert mapping(draft.text) == {"w_cmd": "W CMD [rpm]", "T_amb": 25.0}
    assert [c.name for c in draft.unmatched_columns] == ["vibration [m/s2]", "note"]
    assert [v.name for v in draft.unmatched_outputs] == ["w_m", "i_q"]
    for comment in (
        "#   vibration [m/s2] [m/s2]",
        '#   [recordings.columns.i_q]  column = "...", unit = "A"',
    ):
        assert comment in draft.text
    target.write_text(draft.text)
    assert load(target).inputs == ("w_cmd", "T_amb")


def test_a_unit_with_a_slash_is_the_unit_and_the_name_before_it_is_the_variable(
    small: FmuDescription, tmp_path: Path
) -> None:
    file = csv(tmp_path / "run.csv", "time [s],w_cmd [rad/s],T_amb [degC],J1_w [rad/s],i_q [A]")
    target = tmp_path / "scenario.toml"
    draft = draft_scenario(small, [file], target)
    columns = tomllib.loads(draft.text)["recordings"]["columns"]
    assert columns["w_cmd"]["column"] == "w_cmd [rad/s]"
    assert columns["i_q"]["column"] == "i_q [A]"
    assert {n: c["unit"] for n, c in columns.items()}["w_cmd"] == "rad/s"
    # Another name of a measured speed is either found for w_m, or said to be left.
    left = {c.name: c.unit for c in draft.unmatched_columns}
    assert columns.get("w_m", {}).get("column") == "J1_w [rad/s]" or left == {"J1_w [rad/s]": "rad/s"}
    target.write_text(draft.text)
    assert "w_cmd" in load(target).inputs


def test_columns_named_as_the_outputs_with_their_unit_are_those_outputs(tmp_path: Path) -> None:
    """J1_w [rad/s] for J1_w in rad/s, next to a J2_w."""
    unit = '<UnitDefinitions><Unit name="rad/s"><BaseUnit s="-1" rad="1"/></Unit></UnitDefinitions>'
    xml = HABITS2.replace("{flags}", "").replace(" <DefaultExperiment", f" {unit}\n <DefaultExperiment")
    for old, new in (("y", "J1_w"), ("u", "tau_1"), ("tau", "J2_w")):
        xml = xml.replace(f'name="{old}"', f'name="{new}"')
    xml = xml.replace("<Real/>", '<Real unit="rad/s"/>').replace(
        'valueReference="2" causality="parameter" variability="fixed"><Real start="0.1"/>',
        'valueReference="2" causality="output"><Real unit="rad/s"/>',
    )
    fmu = build.write_fmu(tmp_path / "shafts.fmu", xml, build.library("habits2.c"), "habits2")
    file = csv(tmp_path / "run.csv", "time [s],J2_w [rad/s],tau_1,J1_w [rad/s]")
    draft = draft_scenario(read_description(fmu), [file], tmp_path / "s.toml")
    assert mapping(draft.text) == {"J1_w": "J1_w [rad/s]", "J2_w": "J2_w [rad/s]", "tau_1": "tau_1"}
    assert draft.unmatched_columns == ()
    assert draft.unmatched_outputs == ()


def test_units_of_the_file_count_and_missing_ones_are_assumed(small: FmuDescription, tmp_path: Path) -> None:
    file = csv(tmp_path / "run.csv", "t,w_cmd,T_amb,w_m [rpm],i_q_mA")
    draft = draft_scenario(small, [file], tmp_path / "scenario.toml")
    columns = tomllib.loads(draft.text)["recordings"]["columns"]
    assert {n: c["unit"] for n, c in columns.items()} == {
        "w_cmd": "rad/s",
        "T_amb": "degC",
        "w_m": "rpm",
        "i_q": "mA",
    }
    assert "assumed: the FMU's" in draft.text
    (tmp_path / "scenario.toml").write_text(draft.text)
    recording = load(tmp_path / "scenario.toml").fit[0]
    assert recording.signals.units["w_m"] == "rad/s"


def test_a_column_of_another_dimension_is_never_taken(small: FmuDescription, tmp_path: Path) -> None:
    file = csv(tmp_path / "run.csv", "t,w_m [mm],i_q [V]")
    assert draft_scenario(small, [file], tmp_path / "s.toml").matches == ()


def test_the_only_column_of_a_dimension_is_taken_with_a_warning(
    small: FmuDescription, tmp_path: Path
) -> None:
    file = csv(tmp_path / "run.csv", "t,strom [A]")
    (match,) = draft_scenario(small, [file], tmp_path / "s.toml").matches
    assert (match.variable.name, match.why) == ("i_q", "by its unit alone: check this")


def column(name: str, unit: str | None = None) -> FoundColumn:
    return FoundColumn(name, words(name), unit, unit is not None, False, False, 0.0)


def variable(name: str, unit: str, description: str = "", causality: str = "output") -> Variable:
    return Variable(name, 0, causality, "continuous", "Real", unit, description=description)


def test_the_best_sum_decides_not_the_first_pair() -> None:
    # Alone, "velocity" fits both; the command's column leaves it to the measured one.
    variables = [variable("v_cmd", "m/s", "Velocity command", "input"), variable("v", "m/s", "Velocity")]
    for order in (["velocity", "velocityCommand"], ["velocityCommand", "velocity"]):
        matches = match_columns(variables, [column(name, "m/s") for name in order])
        assert {m.variable.name: m.column.name for m in matches} == {
            "v_cmd": "velocityCommand",
            "v": "velocity",
        }


def test_time_is_found_by_name_then_by_unit_and_must_increase(tmp_path: Path) -> None:
    def time_of(header: str) -> str | None:
        found = time_column(find_columns(csv(tmp_path / "run.csv", header)))
        return None if found is None else found.name

    assert time_of("Elapsed Time (s),a") == "Elapsed Time (s)"
    assert time_of("clock [ms],a") == "clock [ms]"
    assert time_of("x [mm],time") is None


@settings(max_examples=100, deadline=None)
@given(st.text(max_size=30), st.text(max_size=30), st.text(max_size=30))
def test_no_text_of_a_file_leaves_its_place(name: str, description: str, model: str) -> None:
    gain = Variable("gain", 1, "parameter", "fixed", "Real", "1", 2.0, description=description)
    strange = variable(name, "m", description)
    fmu = FmuDescription(
        path=Path("/nowhere/a.fmu"),
        sha256="",
        model_name=model,
        fmi_version="2.0",
        tool="",
        guid="",
        supports_co_simulation=True,
        supports_model_exchange=False,
        capabilities={},
        variables={"gain": gain, name: strange},
        default_experiment=DefaultExperiment(),
        platforms=(),
    )
    columns = [column("t", "s"), column(name, "m")]
    draft = draft_from_columns(fmu, columns, [Path("/nowhere/a.csv")], Path("/nowhere/s.toml"))
    data = tomllib.loads(draft.text)
    assert (data["kind"], data["fixed"]) == ("simulate", {})
    usable = name != "" and not any(c < " " or c == "\x7f" for c in name)
    assert set(data["recordings"].get("columns", {})) == ({name} if usable else set())


def test_a_recording_that_cannot_be_read_says_so(
    small: FmuDescription, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code = cli.run_command(
        [
            "init",
            "--fmu",
            str(small.path),
            "--recording",
            str(tmp_path / "x.csv"),
            "-o",
            str(tmp_path / "s.toml"),
        ]
    )
    assert code == 2
    assert "x.csv: no such file" in capsys.readouterr().err
    assert not (tmp_path / "s.toml").exists()


@pytest.mark.parametrize("moving", [("u",), ("u", "turn"), ("turn",), ()])
def test_a_model_that_another_input_drives_is_not_said_to_stay_at_rest(
    moving: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Two inputs that command, u and turn; those that do not move stay at zero."""
    turn = (
        '<ScalarVariable name="turn" valueReference="4" causality="input"><Real start="0"/></ScalarVariable>'
    )
    xml = HABITS2.replace("{flags}", "").replace(" </ModelVariables>", f"  {turn}\n </ModelVariables>")
    fmu = build.write_fmu(tmp_path / "two.fmu", xml, build.library("habits2.c"), "habits2")
    time = np.linspace(0.0, 1.0, 101)
    columns = [np.sin(7.0 * time + k) * (name in moving) for k, name in enumerate(("u", "turn"))]
    table = np.column_stack([time, *columns, np.sin(time)])
    np.savetxt(tmp_path / "run.csv", table, delimiter=",", header="time [s],u,turn,y", comments="")
    assert cli.run_command(["init", str(fmu), str(tmp_path / "run.csv"), "-o", str(tmp_path / "s.toml")]) == 0
    said = " ".join(capsys.readouterr().out.split())
    still = [name for name in ("u", "turn") if name not in moving]
    assert ("so the model stays at rest" in said) == (not moving)
    assert ("is ready" in said) == bool(moving)
    assert (f"No column that changes drives {', '.join(still)};" in said) == bool(moving and still)
