"""What a study thinks of its recordings, and of its own fit."""

from thsa_cosim.report.folder import Json, Part
from thsa_cosim.report.parts.content import Block, Cell, Column, Section, Table, Text
from thsa_cosim.report.parts.text import text_cell

_MARKS = {"error": "bad", "warning": "", "note": ""}
_VERDICTS = {
    "good": "The recordings have no defect that would affect a fit.",
    "usable": "The recordings have defects that may affect the results.",
    "bad": "The recordings have defects that make the results unreliable.",
}


def data(part: Part) -> Section | None:
    """The findings, what was left out by consent, and why a fit is not to be believed; None of older results."""
    result = part.result or {}
    if "data" not in result or (part.kind == "tune" and not result.get("profiles")):
        return None
    found, trust = result["data"], result.get("trust", {"verdict": "explained", "reasons": []})
    blocks: list[Block] = []
    if trust["verdict"] == "not-explained":
        blocks.append(Text("The model does not explain the recordings: do not trust its values.", "bad"))
        blocks += [Text(f"– {reason}") for reason in trust["reasons"]]
    blocks.append(Text(_VERDICTS[found["verdict"]], "bad" if found["verdict"] == "bad" else ""))
    if found["findings"]:
        headings = ("recording", "signal", "what", "severity", "where", "finding")
        columns = [Column(heading, numeric=False) for heading in headings]
        blocks.append(Table("Findings", columns, [_row(finding) for finding in found["findings"]]))
    blocks += [Text(f"Repaired as the scenario asks: {sentence}.") for sentence in found.get("repairs", [])]
    return Section(f"{part.prefix}data", "Data and trust", tuple(blocks))


def _row(finding: Json) -> list[Cell]:
    spans = finding["where"]
    where = ", ".join(f"{a:.4g} to {b:.4g} s" for a, b in spans[:4]) + (", ..." if len(spans) > 4 else "")
    severity = Cell(finding["severity"], None, _MARKS[finding["severity"]])
    texts = [text_cell(finding[key]) for key in ("recording", "channel", "kind")]
    return [*texts, severity, text_cell(where or "throughout"), text_cell(finding["text"])]
