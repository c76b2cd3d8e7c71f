"""The page on a motor of the Modelica Standard Library: exported, simulated, identified as the page says."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("ziglang", reason="the export extra is not installed")

from thsa_cosim.cli.main import run_command

PAGE = Path(__file__).parents[2] / "docs" / "howto" / "modelica-library.md"
LIBRARIES = [Path(p) for p in os.environ.get("MODELICAPATH", "").split(os.pathsep) if p]
FOLDER = next((p for p in LIBRARIES if list(p.glob("Modelica*/package.mo"))), None)


@pytest.mark.slow
@pytest.mark.skipif(FOLDER is None, reason="the Modelica Standard Library is not in MODELICAPATH")
def test_the_motor_is_identified(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = PAGE.read_text(encoding="utf-8")
    for name, body in re.findall(r"```(?:python|toml) (\S+)\n(.*?)```", text, re.S):
        Path(name).write_text(body, encoding="utf-8")
    export, identify = re.findall(r"^thsa-cosim (.*)$", text, re.M)
    assert run_command([*export.replace("LIBRARY", str(FOLDER)).split(), "--platforms", "linux64"]) == 0
    subprocess.run([sys.executable, "make_data.py"], check=True, timeout=120)
    assert run_command(identify.split()) == 0
    found = json.loads((tmp_path / "found" / "result.json").read_text(encoding="utf-8"))["points"][0][
        "parameters"
    ]
    for name, true in {"R_a": 0.06, "J": 0.2, "T": 55.0}.items():
        assert abs(found[name]["value"] - true) < 4.0 * found[name]["stderr"], name
        assert found[name]["stderr"] < 1e-3 * true
