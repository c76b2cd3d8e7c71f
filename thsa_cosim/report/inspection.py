"""What the terminal says about recordings: one line per finding."""

from rich.console import Console
from rich.table import Table
from rich.text import Text

from thsa_cosim.inspection import FileReport, Finding, Inspection

STYLES = {"note": "dim", "warning": "yellow", "error": "red"}


def print_file(console: Console, report: FileReport) -> None:
    """Print a file's columns, then what was found in them."""
    table = Table(title=Text(str(report.path)), title_justify="left")
    for heading in ("column", "unit", "noise (1 σ)"):
        table.add_column(heading, overflow="fold")
    for column in report.columns:
        role = " (time)" if column.name == report.time else ""
        noise = "" if role else f"{column.noise:.3g}"
        table.add_row(Text(column.name + role), Text(column.unit or "not stated"), noise)
    console.print(table)
    print_inspection(console, report.data)
    console.print(f"verdict: {report.to_dict()['verdict']}", highlight=False)


def print_inspection(console: Console, data: Inspection) -> None:
    """Print one line per finding, the gravest first."""
    for finding in data.findings:
        console.print(_line(finding), soft_wrap=True)


def _line(finding: Finding) -> Text:
    line = Text(f"{finding.severity}: ", style=STYLES[finding.severity])
    line.append(f"{finding.recording}, {finding.channel}: {finding.kind}: {finding.text}", style="default")
    return line
