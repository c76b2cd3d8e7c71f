"""What ``thsa-cosim check`` prints about an FMU."""

from rich.console import Console
from rich.table import Table
from rich.text import Text

from thsa_cosim.check import CheckReport

STYLES = {"ok": "green", "warning": "yellow", "failed": "red", "not tried": "dim"}


def print_check(console: Console, report: CheckReport) -> None:
    """Print the facts, one line per trial, and the conclusion."""
    facts = report.facts
    table = Table(title=str(report.path), title_justify="left", show_header=False)
    rows = {
        "model": facts.model,
        "FMI": f"{facts.fmi_version}: {', '.join(facts.interfaces)}",
        "tool": facts.tool or "not stated",
        "platforms": ", ".join(facts.platforms) or "none",
        "capabilities": ", ".join(n for n, v in facts.capabilities.items() if v) or "none",
        **{role: _listed(names) for role, names in facts.variables.items()},
        "states": str(facts.states),
        "sha256": report.sha256,
    }
    for name, value in rows.items():
        table.add_row(name, Text(value))
    console.print(table)
    trials = Table(title="Tried", title_justify="left")
    for heading in ("trial", "verdict", "finding"):
        trials.add_column(heading, overflow="fold")
    for finding in report.findings:
        verdict = str(finding.verdict)
        trials.add_row(Text(finding.name), Text(verdict, style=STYLES.get(verdict, "")), Text(finding.text))
    console.print(trials)
    console.print(f"verdict: {report.verdict}; instances may be reused by: {report.reuse}", highlight=False)


def _listed(names: tuple[str, ...], most: int = 12) -> str:
    shown = ", ".join(names[:most]) or "none"
    return shown if len(names) <= most else f"{shown} and {len(names) - most} more"
