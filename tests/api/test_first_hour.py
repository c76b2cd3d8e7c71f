"""From a CSV file and an FMU to identified parameters with their uncertainty, as a notebook's reader would type it."""

import tomllib
from pathlib import Path

import pandas as pd
import pytest

import thsa_cosim as tc
from thsa_cosim.errors import InputError
from thsa_cosim.laws import published_law

ROOT = Path(__file__).parents[2]
SCENARIOS = ROOT / "scenarios"

CELLS = (
    "import thsa_cosim as tc",
    'scenario = tc.init("Screw.fmu", "bench.csv")',
    'scenario["kind"] = "identify"\n'
    'scenario["parameters"] = [\n'
    '    {"name": "F_fn", "variable": "nut.F_fn.a0", "law_block": "nut.F_fn", "unit": "N",'
    ' "lower": 100, "upper": 30e3},\n'
    '    {"name": "b_n", "variable": "nut.b_n.a0", "law_block": "nut.b_n", "unit": "N/(m/s)", "lower": 1e3,'
    ' "upper": 1e7, "scale": "log"},\n'
    "]",
    "expected = tc.sensitivity(scenario, workers=1)",
    'study = tc.identify(scenario, folder="study", workers=1, quiet=True)',
    "parameters = study.parameters",
)


@pytest.mark.skipif(not (ROOT / "fmus" / "Screw.fmu").exists(), reason="fmus/Screw.fmu has not been exported")
def test_six_cells_from_a_csv_file_to_parameters(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    table = pd.read_parquet(SCENARIOS / "recordings" / "screw_m30.parquet").iloc[::2]
    table.to_csv(tmp_path / "bench.csv", index=False)
    (tmp_path / "Screw.fmu").symlink_to(ROOT / "fmus" / "Screw.fmu")
    monkeypatch.chdir(tmp_path)
    assert len(CELLS) <= 6
    names: dict[str, object] = {}
    for cell in CELLS:
        exec(cell, names)
    found, expected = names["parameters"], names["expected"]
    assert isinstance(found, pd.DataFrame)
    assert isinstance(expected, pd.DataFrame)
    found = found.droplevel(0)
    # RIG, laws of table III at -30 degC.
    for name in ("F_fn", "b_n"):
        assert 0.0 < found.stderr[name] < 0.05 * found.value[name]
        assert 0.2 < found.stderr[name] / expected.droplevel(0).stderr[name] < 5.0
    assert found.value["F_fn"] == pytest.approx(float(published("F_fn")), rel=0.02)
    assert found.value["b_n"] == pytest.approx(float(published("b_n")), rel=0.1)


def published(name: str) -> float:
    """The law that the shipped scenario quotes, at -30 degC."""
    scenario = tomllib.loads((SCENARIOS / "screw.toml").read_text(encoding="utf-8"))
    law = next(p["law"] for p in scenario["parameters"] if p["name"] == name)
    return float(published_law(law["form"], law["published"])(-30.0))


def test_what_is_missing_is_one_sentence() -> None:
    with pytest.raises(InputError, match="needs a recording"):
        tc.init(ROOT / "fmus" / "Screw.fmu")
    with pytest.raises(InputError, match="no recordings to fit or no parameters"):
        tc.sensitivity(SCENARIOS / "table4.toml")
