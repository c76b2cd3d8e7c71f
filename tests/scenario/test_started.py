"""Columns of the FMU's parameters: start values that differ from recording to recording."""

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from thsa_cosim.errors import InputError
from thsa_cosim.fmu import Plant
from thsa_cosim.scenario import load
from thsa_cosim.study import study_identity
from thsa_cosim.study.case import build_case

FMU = Path(__file__).parents[2] / "fmus" / "Servo.fmu"
TIME = np.linspace(0.0, 1.0, 201)


def write(path: Path, gain: float, start: float) -> Path:
    columns = {
        "t": TIME,
        "goal": np.full(TIME.size, 0.3),
        "position": np.linspace(start, 0.3, TIME.size),
        "kp": np.full(TIME.size, gain),
    }
    pq.write_table(pa.table(columns), path)
    return path


def scenario(folder: Path, **more: Any) -> dict[str, Any]:
    columns = {
        "q_ref": {"column": "goal", "unit": "rad"},
        "U_in": {"value": 7.4, "unit": "V"},
        "on": {"value": 1.0, "unit": "1"},
        "q": {"column": "position", "unit": "rad"},
        "controller.k_P": {"column": "kp", "unit": "1"},
        "q_start": {"column": "position", "unit": "rad"},
    }
    return {
        "kind": "identify",
        "fmu": str(FMU),
        "recordings": {
            "fit": [
                str(write(folder / "a.parquet", 100.0, 0.1)),
                str(write(folder / "b.parquet", 400.0, -0.2)),
            ],
            "time": {"column": "t", "unit": "s"},
            "columns": columns | more.pop("columns", {}),
        },
        "cost": {"channels": {"q": {"noise": 1e-3}}},
        "parameters": [
            {"name": "R", "variable": "R", "unit": "ohm", "lower": 1.0, "upper": 9.0},
        ],
        **more,
    }


def test_every_recording_gives_its_own_start_values(tmp_path: Path) -> None:
    found = load(scenario(tmp_path, fixed={"b": 0.02}))
    cases = [build_case(found, r, found.fixed_for(r.name)) for r in found.fit]
    own = [{"controller.k_P": 100.0, "q_start": 0.1}, {"controller.k_P": 400.0, "q_start": -0.2}]
    assert [case.fixed for case in cases] == [{"b": 0.02, **values} for values in own]
    assert set(found.fit[0].signals.names) == {"q_ref", "U_in", "on", "q"}
    with Plant.open(FMU) as plant:
        run = plant.run(cases[1].fixed, cases[1].inputs, ("q", "duty"), TIME)
    assert run["q"][0] == pytest.approx(-0.2)
    assert run["duty"][0] == pytest.approx(400 / 256 * 4096 / (2 * np.pi) * 0.5)


def test_another_start_value_is_another_study(tmp_path: Path) -> None:
    before = study_identity(load(scenario(tmp_path)))
    asked = scenario(tmp_path)
    write(tmp_path / "b.parquet", 401.0, -0.2)
    after = study_identity(load(asked))
    assert [key for key in before if before[key] != after[key]] == ["recordings.fit[b]"]


@pytest.mark.parametrize(
    ("more", "says"),
    [
        (
            {"fixed": {"q_start": 0.0}},
            r"recordings\.columns\.q_start is in \[fixed\], too; remove one of them",
        ),
        (
            {"columns": {"R": {"column": "kp", "unit": "ohm"}}},
            r"recordings\.columns\.R is searched for as parameter 'R'; remove one of them",
        ),
        ({"columns": {"m": {"value": 1.0, "unit": "kg"}}}, r"a parameter's constant belongs in \[fixed\]"),
        (
            {"columns": {"T_c": {"column": "goal", "unit": "kN.m", "scale": -1.0}}},
            r"T_c.*outside what Servo\.fmu",
        ),
    ],
)
def test_a_start_value_that_cannot_be_is_refused(tmp_path: Path, more: dict[str, Any], says: str) -> None:
    with pytest.raises(InputError, match=says):
        load(scenario(tmp_path, **more))
