"""What a diagnosis' page and notes say first: a picture that argues, values in brackets, a command to copy."""

import shlex
from pathlib import Path
from typing import Any

import pytest
from report_studies import diagnose_result

from thsa_cosim.diagnosis.conclusion import export_command
from thsa_cosim.report.diagnose.evidence import evidence
from thsa_cosim.report.diagnose.verdict import before_after, verdict
from thsa_cosim.report.folder import Part
from thsa_cosim.report.parts.content import Table

STRUCTURE = """variable,unit,channel,channel_unit,bin_centre,mean_before,mean_after,stderr
F_load,N,x,m,1.0,1e-4,0.0,1e-6
F_load,N,x,m,2.0,-1e-4,0.0,1e-6
"""


def found(before: list[float]) -> dict[str, Any]:
    bins = {
        "at": [1.0, 2.0],
        "measured": [0.5, -0.5],
        "stderr": [0.1, 0.1],
        "before": before,
        "after": [0.5, -0.5],
    }
    return {
        "equation": "kinematic: speed", "left": "v", "unit": "m/s", "cause": "F_load", "cause_unit": "N",
        "part": "validate", "share": 0.3, "bins": bins,
    }  # fmt: skip


def titles(part: Part) -> set[str]:
    figure = evidence(part)
    assert figure is not None
    return {value["title"]["text"] for key, value in figure.layout.items() if key.startswith("yaxis")}


@pytest.mark.parametrize(
    ("before", "effects", "shown"),
    [
        ([0.0, 0.0], True, "missing speed, balance “kinematic: speed” [m/s]"),
        ([0.45, -0.55], True, "residual of x [m]"),
        ([0.45, -0.55], False, "missing speed, balance “kinematic: speed” [m/s]"),
    ],
)
def test_a_balance_that_the_declared_model_closes_gives_way_to_the_dependence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, before: list[float], effects: bool, shown: str
) -> None:
    result = diagnose_result() | {"evidence": found(before)}
    part = Part("", "diagnose", tmp_path, result if effects else result | {"effects": []}, {}, None)
    (tmp_path / "structure.csv").write_text(STRUCTURE)
    assert titles(part) == {shown}


def test_what_the_data_do_not_determine_is_in_brackets_with_its_reason() -> None:
    result = diagnose_result()
    unknown = {"value": 0.0, "unit": "1", "stderr": 6e-5, "identifiable": False, "reason": "it ended at 0"}
    result["effects"][0]["parameters"]["s_0"] = unknown
    (table,) = (b for b in verdict(result) if isinstance(b, Table))
    values = {row[2].text: row[3].text for row in table.rows}
    assert values == {"gap": "(2.50 ± 0.10)e-4", "s_0": "((0.0 ± 6.0)e-5)"}
    assert table.note == "In brackets: not determined by these data: s_0, it ended at 0."


@pytest.mark.parametrize(
    ("word", "added", "doubted"),
    [
        ("missing-effect", False, False),
        ("no-missing-effect", False, False),
        ("unexplained-structure", False, True),
        ("unexplained-structure", True, False),  # a law that joined the model explains it
    ],
)
def test_standard_errors_beside_a_residual_that_is_left_are_doubted(
    tmp_path: Path, word: str, added: bool, doubted: bool
) -> None:
    result = diagnose_result() | {"verdict": word}
    result["empirical"]["added"] = added
    section = before_after(Part("", "diagnose", tmp_path, result, {}, None))
    assert section is not None
    tables = [b for b in (*verdict(result), *section.blocks) if isinstance(b, Table)]
    notes = [t.note for t in tables if "± one standard error" in t.caption]
    assert len(notes) == 2  # of the effects' parameters and of the declared ones
    assert all(("values may be off by more" in note) is doubted for note in notes)


def test_a_command_to_copy_survives_a_space_in_a_path() -> None:
    command = export_command(Path("my studies/A.mo"), Path("modelica/THSA"), Path("my studies/A.fmu"))
    assert shlex.split(command) == [
        "thsa-cosim", "export", "my studies/A.mo", "--package", "modelica/THSA", "-o", "my studies/A.fmu",
    ]  # fmt: skip
