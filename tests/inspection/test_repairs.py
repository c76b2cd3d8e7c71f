"""Repairs end to end: a damaged recording, the lines that ``check`` proposes, and the values of the clean recording."""

import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from thsa_cosim import cli

ROOT = Path(__file__).parents[2]
SCENARIOS = ROOT / "scenarios"
pytestmark = pytest.mark.skipif(
    not (ROOT / "fmus" / "Screw.fmu").exists(), reason="fmus/Screw.fmu has not been exported"
)
Damage = Callable[[pd.DataFrame], pd.DataFrame]
TRUE = {
    "screw": {"F_fn": 2.7e3 - 370.0 - 140.0 + 70.0, "b_n": 4e4 + 3e4 + 2.3e4},
    "motor": {"R_s": 0.498, "psi_pm": 0.0946, "T_fm": 0.0561},
}
NEAR = {"F_fn": 0.02, "b_n": 0.06, "R_s": 0.05, "psi_pm": 0.003, "T_fm": 0.05}
RECORDINGS = {"screw": "screw_m10", "motor": "motor_m30"}


def changed(column: str, change: Callable[[pd.DataFrame, np.random.Generator], object]) -> Damage:
    def damage(table: pd.DataFrame) -> pd.DataFrame:
        table[column] = change(table, np.random.default_rng(5))
        return table

    return damage


def sentinels(table: pd.DataFrame, rng: np.random.Generator) -> object:
    return table["force_kN"].where(rng.random(len(table)) > 0.01, -9999.0)


def spikes(table: pd.DataFrame, rng: np.random.Generator) -> object:
    return table["force_kN"] + 3.0 * (rng.random(len(table)) < 0.03)


def held(table: pd.DataFrame, rng: np.random.Generator) -> object:
    return table["q_current_A"].iloc[np.arange(len(table)) // 4 * 4].to_numpy()


def clipped(table: pd.DataFrame, rng: np.random.Generator) -> object:
    return table["force_kN"].clip(-2.9, 2.9)


def gap(table: pd.DataFrame) -> pd.DataFrame:
    return table[(table["time_s"] < 0.95) | (table["time_s"] > 1.25)]


def late_voltage(table: pd.DataFrame, rng: np.random.Generator) -> object:
    return table["q_voltage_V"].shift(5).fillna(0.0)


def offset(table: pd.DataFrame, rng: np.random.Generator) -> object:
    return table["force_kN"] + 0.5


def scenario(bench: str, damage: Damage, folder: Path) -> Path:
    table = damage(pd.read_parquet(SCENARIOS / "recordings" / f"{RECORDINGS[bench]}.parquet").astype(float))
    table.to_csv(folder / "run.csv", index=False, float_format="%.14g")
    text = (SCENARIOS / f"{bench}.toml").read_text().replace('"../fmus/', f'"{ROOT}/fmus/')
    text = text.replace(f"recordings/{bench}_*.parquet", "run.csv")
    text = text.replace("population = 45", "population = 12").replace("generations = 30", "generations = 6")
    path = folder / "scenario.toml"
    path.write_text(text)
    return path


def pasted(text: str, lines: str) -> str:
    """``lines`` put under the scenario's headings of the same name."""
    for table in re.split(r"\n(?=\[)", lines.strip()):
        heading, _, keys = table.partition("\n")
        assert f"\n{heading}\n" in text, heading
        text = text.replace(f"\n{heading}\n", f"\n{heading}\n{keys}\n", 1)
    return text


def proposed(path: Path, capsys: pytest.CaptureFixture[str]) -> str:
    capsys.readouterr()
    cli.run_command(["check", str(path)])
    printed = capsys.readouterr().out
    after = printed.partition("Lines for the scenario")[2].partition("\n")[2]
    return "\n".join(line for line in after.splitlines() if line.startswith("[") or " = " in line)


def identified(path: Path, folder: Path) -> dict[str, object]:
    assert cli.run_command(["identify", str(path), "-o", str(folder), "--no-report"]) == 0
    found: dict[str, object] = json.loads((folder / "result.json").read_text())
    return found


def assert_right(bench: str, result: dict[str, object], explained: bool = True, more: float = 1.0) -> None:
    """Values within their limits times ``more``."""
    found = result["points"][0]["parameters"]  # type: ignore[index]
    values = {name: found[name]["value"] for name in TRUE[bench]}
    assert values == {n: pytest.approx(v, rel=more * NEAR[n]) for n, v in TRUE[bench].items()}
    assert not explained or result["trust"]["verdict"] == "explained", result["trust"]  # type: ignore[index]


@pytest.mark.parametrize(
    ("bench", "damage", "kind"),
    [
        ("screw", changed("force_kN", sentinels), "missing = [-9999.0]"),
        pytest.param("screw", changed("force_kN", spikes), "despike = true", marks=pytest.mark.slow),
        pytest.param("screw", changed("force_kN", clipped), "above = 2900.0", marks=pytest.mark.slow),
        pytest.param("motor", changed("q_current_A", held), "independent = true", marks=pytest.mark.slow),
        pytest.param("motor", gap, "mask = [[0.949, 1.751]]", marks=pytest.mark.slow),
    ],
    ids=["sentinel", "spikes", "clipped", "held", "gap"],
)
def test_the_lines_that_check_proposes_recover_the_values(
    bench: str, damage: Damage, kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = scenario(bench, damage, tmp_path)
    lines = proposed(path, capsys)
    assert kind in lines
    path.write_text(pasted(path.read_text(), lines))
    result = identified(path, tmp_path / "study")
    # Spikes beside a step of the signal look like the step, and stay: the fit says so.
    assert_right(bench, result, explained="despike" not in kind)
    assert result["data"].get("repairs") or "[cost]" in lines  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("bench", "damage", "channel", "kind"),
    [
        ("screw", changed("force_kN", offset), "F", "offset"),
        pytest.param("motor", changed("q_voltage_V", late_voltage), "u_q", "delay", marks=pytest.mark.slow),
    ],
    ids=["offset", "delay"],
)
def test_the_lines_that_a_fit_proposes_recover_the_values(
    bench: str, damage: Damage, channel: str, kind: str, tmp_path: Path
) -> None:
    path = scenario(bench, damage, tmp_path)
    result = identified(path, tmp_path / "before")
    assert result["trust"]["verdict"] == "not-explained"  # type: ignore[index]
    findings = result["data"]["findings"]  # type: ignore[index]
    (finding,) = [f for f in findings if f["severity"] != "note"]
    assert (finding["channel"], finding["kind"]) == (channel, kind)
    path.write_text(pasted(path.read_text(), finding["remedy"]))
    # R_s, which was on its bound, depends on the delay by 2 % per 0.1 ms, a tenth of a sample.
    assert_right(bench, identified(path, tmp_path / "after"), more=2.0 if kind == "delay" else 1.0)
