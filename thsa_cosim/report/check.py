"""What ``thsa-cosim check`` prints about an FMU."""

from rich.console import Console
from rich.table import Table
from rich.text import Text

from thsa_cosim.check import CheckReport
from thsa_cosim.fmu.probe import Facts

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
        "states": states(facts),
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


def states(facts: Facts) -> str:
    """Return how many states there are, their names, and which of them can start at another value (``[fixed]``)."""
    if not facts.state_names:
        return f"{facts.states}" + (", without names" if facts.states else "")
    text = f"{facts.states}: {_listed(facts.state_names)}"
    if facts.started_states == facts.state_names:
        return f"{text}; each takes a start value"
    if not facts.started_states:
        return f"{text}; none takes a start value"
    return f"{text}; these take a start value: {_listed(facts.started_states)}"


def _listed(names: tuple[str, ...], most: int = 12) -> str:
    shown = ", ".join(names[:most]) or "none"
    return shown if len(names) <= most else f"{shown} and {len(names) - most} more"
