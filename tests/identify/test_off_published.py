"""A value off its published law is named where all else fits: what one parameter takes up leaves no other trace."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from thsa_cosim.cli import run_command
from thsa_cosim.identify.off_published import Fitted, off_published
from thsa_cosim.inspection import Expected, Finding, Residual
from thsa_cosim.signals import FloatArray

ROOT = Path(__file__).parents[2]
SPEED = np.repeat(np.linspace(-0.01, 0.01, 16), 100)
COLUMNS = np.column_stack((np.sign(SPEED), SPEED))
DRAWN = {"F_c": 2000.0, "b": 3e5}
NOISE = 60.0


def fitted(
    force: FloatArray,
    speed: FloatArray = SPEED,
    *,
    label: str = "-30 degC",
    published: bool = True,
    seed: int = 3,
) -> Fitted:
    """Coulomb and viscous friction, fitted to ``force`` with noise over the ``speed`` that was recorded."""
    columns = np.column_stack((np.sign(speed), speed))
    measured = force + np.random.default_rng(seed).normal(0.0, NOISE, SPEED.size)
    value, *_ = np.linalg.lstsq(columns, measured, rcond=None)
    stderr = NOISE * np.sqrt(np.diag(np.linalg.inv(columns.T @ columns)))
    left = (columns @ value - measured) / NOISE
    time = np.arange(speed.size) * 1e-2
    residual = Residual(
        f"run at {label}", "F", left, NOISE, "N", {"v": speed}, time, columns @ value, columns / NOISE
    )
    known = [
        Expected(name, "N", float(v), float(s), drawn, 1.0, published)
        for (name, drawn), v, s in zip(DRAWN.items(), value, stderr, strict=True)
    ]
    return Fitted(label, [residual], known)


def friction(f_c: float = 2000.0, b: float = 3e5) -> FloatArray:
    return np.asarray(COLUMNS @ (f_c, b))


def only(findings: list[Finding]) -> Finding:
    assert len(findings) == 1, findings
    return findings[0]


@pytest.mark.parametrize("seed", range(40))
def test_values_at_their_law_are_not_named(seed: int) -> None:
    assert off_published([fitted(friction(), seed=seed)], ()) == []


@pytest.mark.parametrize("seed", range(10))
def test_a_law_is_known_to_a_hundredth(seed: int) -> None:
    assert off_published([fitted(friction(2030.0, 2.96e5), seed=seed)], ()) == []


def test_an_input_that_reads_too_much_moves_one_value() -> None:
    found = only(off_published([fitted(friction(), 1.05 * SPEED)], ()))
    assert (found.kind, found.severity, found.channel) == ("off-published", "warning", "F")
    assert found.text.startswith("b at -30 degC is ")
    assert "an error of F or v that b takes up" in found.text


def test_a_dead_zone_moves_the_constant() -> None:
    force = friction()
    found = only(off_published([fitted(force - 200.0 * np.sign(force))], ()))
    assert "F_c at -30 degC" in found.text
    assert "where its published law says 2000 (-10 %, " in found.text


def test_several_temperatures_are_one_finding_at_the_surest() -> None:
    points = [
        fitted(friction(f_c), label=f"{t} degC") for f_c, t in ((2200.0, 0), (2400.0, 10), (2000.0, 20))
    ]
    text = only(off_published(points, ())).text
    assert text.startswith("F_c at 10 degC (the surest of 2 temperatures) is ")


def test_nothing_is_said_without_a_law_or_where_something_else_is_doubted() -> None:
    off = friction(2400.0)
    assert off_published([fitted(off, published=False)], ()) == []
    assert off_published([fitted(off)], ("run at -30 degC",)) == []
    assert off_published([fitted(off + 400.0 * np.sin(900.0 * SPEED))], ()) == []  # more than noise is left
    assert only(off_published([fitted(off)], ("another",))).kind == "off-published"


def test_the_command_names_a_speed_that_reads_too_much(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = pd.read_parquet(ROOT / "scenarios/recordings/screw_m30.parquet")
    data["velocity_mm_s"] *= 1.05
    data.to_csv(tmp_path / "screw.csv", index=False)
    study = tmp_path / "study"
    arguments = [str(ROOT / "scenarios/screw.toml"), "--fit", str(tmp_path / "screw.csv"), "-o", str(study)]
    assert run_command(["identify", *arguments, "--no-report", "--workers", "1"]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "data warning: screw, F: off-published: b_n at -30 degC is 3.2" in printed
    result = json.loads((study / "result.json").read_text())
    assert result["trust"] == {"verdict": "explained", "reasons": []}
    (finding,) = [f for f in result["data"]["findings"] if f["severity"] != "note"]
    assert (finding["kind"], finding["recording"]) == ("off-published", "screw")
