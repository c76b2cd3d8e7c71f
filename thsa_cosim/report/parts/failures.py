"""What failed while the study ran."""

from collections import Counter

from thsa_cosim.batch import Status
from thsa_cosim.report.folder import Part
from thsa_cosim.report.parts.content import Block, Column, Section, Table, Text
from thsa_cosim.report.parts.text import count, number_cell, text_cell


def failures(parts: tuple[Part, ...]) -> Section:
    """Failed evaluations by reason, per part."""
    rows = []
    for part in parts:
        for reason, times in failed(part).items():
            rows.append((text_cell(part.title), text_cell(reason), number_cell(times, 8)))
    if not rows:
        done = sum(evaluations(part) for part in parts)
        return Section("failures", "Failures", (Text(f"None of {count(done, 'evaluation')} failed."),))
    columns = (Column("study", numeric=False), Column("reason", numeric=False), Column("evaluations"))
    blocks: tuple[Block, ...] = (Table("Failed evaluations by reason", columns, rows),)
    return Section("failures", "Failures", blocks)


def failed(part: Part) -> dict[str, int]:
    """Reason → number of evaluations: the result's own count, else that of the journal so far."""
    if part.result is not None:
        return {str(reason): int(times) for reason, times in part.result.get("failures", {}).items()}
    rows = () if part.journal is None else part.journal.rows
    return dict(Counter(row.reason or str(row.status) for row in rows if row.status != Status.OK))


def evaluations(part: Part) -> int:
    """Evaluated vectors: the result's count, else the rows of the journal so far."""
    if part.result is not None:
        return int(part.result.get("evaluations") or 0)
    return 0 if part.journal is None else len(part.journal.rows)
