"""Identification in stages on the screw and gearbox benches: results are handed on, with their uncertainty."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from thsa_cosim import cli
from thsa_cosim.fmu import read_description
from thsa_cosim.ssv import read_ssv

ROOT = Path(__file__).parents[2]
RECORDINGS = ROOT / "scenarios" / "recordings"
pytestmark = pytest.mark.skipif(
    not (ROOT / "fmus" / "Gearbox.fmu").exists() or not (ROOT / "scenarios" / "gearbox.toml").exists(),
    reason="fmus/Gearbox.fmu or scenarios/gearbox.toml is missing",
)


def shortened(name: str, folder: Path) -> None:
    text = (ROOT / "scenarios" / f"{name}.toml").read_text()
    files = [str(RECORDINGS / f"{name}_{t}.parquet") for t in ("m30", "p25")]
    for old, new in {
        f'["recordings/{name}_*.parquet"]': json.dumps(files),
        "../fmus/": f"{ROOT}/fmus/",
        "population = 45": "population = 15",
        "generations = 30": "generations = 6",
        'form = "cubic"': 'form = "linear", published_form = "cubic"',
        'form = "quadratic"': 'form = "linear", published_form = "quadratic"',
    }.items():
        text = text.replace(old, new)
    (folder / f"{name}.toml").write_text(text)


def run(*arguments: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "thsa_cosim.cli", *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


@pytest.fixture
def without_plots(monkeypatch: pytest.MonkeyPatch) -> None:
    """Plots take most of a short study's time, and the first run draws them all."""
    monkeypatch.setattr(Figure, "savefig", lambda self, path, **_: Path(path).touch())


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, subprocess.CompletedProcess[str]]:
    folder = tmp_path_factory.mktemp("staged")
    for name in ("screw", "gearbox"):
        shortened(name, folder)
    (folder / "both.toml").write_text(
        'kind = "identify"\ntitle = "Both"\n'
        '[[stages]]\nscenario = "screw.toml"\n[[stages]]\nscenario = "gearbox.toml"\n'
    )
    done = run("identify", folder / "both.toml", "-o", folder / "study", "--workers", 2)
    assert done.returncode == 0, done.stderr
    return folder, done


def test_points_and_laws_of_all_stages_are_merged(study) -> None:
    folder, done = study
    result = json.loads((folder / "study" / "result.json").read_text())
    assert (result["kind"], result["status"]) == ("identify", "complete")
    assert [p["temperature_degC"] for p in result["points"]] == [-30.0, 25.0]
    for point, true in zip(
        result["points"],
        [{"F_fn": 2220.0, "b_n": 3.37e5, "T_fg": 18.68}, {"F_fn": 1656.25, "b_n": 1.0875e5, "T_fg": 4.875}],
        strict=True,
    ):
        assert set(point["parameters"]) == {"F_fn", "b_n", "T_fg", "b_g"}
        for name, value in true.items():
            found = point["parameters"][name]
            assert abs(found["value"] - value) < 4.0 * found["stderr"], name
        b_g = point["parameters"]["b_g"]  # true: about 1e-5
        assert not b_g["identifiable"]
        assert "cannot be distinguished from zero" in b_g["reason"]
    assert set(result["laws"]) == {"F_fn", "b_n", "T_fg", "b_g"}
    assert set(result["error"]["fit"]) == {"screw:F", "gearbox:F"}
    assert "Gearbox bench" in done.stdout
    assert read_ssv(folder / "study" / "identified.ssv").values["nut.F_fn.a1"] == pytest.approx(
        result["laws"]["F_fn"]["coefficients"][1]
    )


def test_the_second_stage_carries_the_first_ones_uncertainty(study, without_plots) -> None:
    """Both benches see the same noise, and T_fg is what is left of two forces: its error is √2 larger."""
    folder, _ = study
    stage = json.loads((folder / "study" / "2_gearbox" / "result.json").read_text())
    assert cli.run_command(["identify", str(folder / "gearbox.toml"), "-o", str(folder / "alone")]) == 0
    single = json.loads((folder / "alone" / "result.json").read_text())
    for staged, other in zip(stage["points"], single["points"], strict=True):
        ratio = staged["parameters"]["T_fg"]["stderr"] / other["parameters"]["T_fg"]["stderr"]
        assert ratio == pytest.approx(2.0**0.5, rel=0.1)


def test_a_finished_staged_study_is_repeated_from_its_journals(
    study, without_plots, capfd: pytest.CaptureFixture[str]
) -> None:
    folder, _ = study
    before = (folder / "study" / "result.json").read_text()
    repeated = [
        "identify",
        str(folder / "both.toml"),
        "-o",
        str(folder / "study"),
        "--quiet",
        "--no-export-fmu",
    ]
    assert cli.run_command(repeated) == 0
    assert "".join(capfd.readouterr()) == ""
    assert (folder / "study" / "result.json").read_text() == before


def test_the_identified_fmu_starts_with_what_was_found(study) -> None:
    pytest.importorskip("casadi")
    folder, done = study
    path = folder / "study" / "Gearbox_identified.fmu"
    if not path.exists():
        pytest.skip(f"the export tools are not installed: {done.stdout[-300:]}")
    found = read_ssv(folder / "study" / "identified.ssv").values
    variables = read_description(path).variables
    for name, value in found.items():
        assert variables[name].start == pytest.approx(value, rel=1e-12)
    assert variables["gearbox.T_fg.a2"].start == 0.0
