"""The article's rows: each number of ``docs/article.md`` that a short run can hold."""

import json
from pathlib import Path

import numpy as np
import pytest

import thsa_cosim as tc

ROOT = Path(__file__).parents[2]
SCENARIOS = ROOT / "scenarios"


@pytest.mark.parametrize("figure", ["fig10", "fig11"])
def test_the_identified_laws_meet_the_articles_validation(figure: str, tmp_path: Path) -> None:
    """Velocity within 0.78 % and current within 3.56 %, whichever of the usual formulas is meant."""
    study = tc.simulate(SCENARIOS / f"{figure}.toml", folder=tmp_path / "study", workers=1, quiet=True)
    (recording,) = json.loads((tmp_path / "study" / "result.json").read_text())["recordings"]
    assert recording["role"] == "validate"
    signals = study.signals(recording["name"])
    for name, unit, limit in (("v", "m/s", 0.0078), ("i_q", "A", 0.0356)):
        measured = signals[f"{name} [{unit}]"]["measured"]
        error = recording["error"][name]
        assert error["nrmse"] <= limit
        assert error["rmse"] / np.sqrt(np.mean(np.square(measured))) <= limit
        assert error["rmse"] == pytest.approx(error["noise"], rel=0.1)  # noise is all that is left
