"""What the terminal says about recordings: one line per finding."""

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

from thsa_cosim.inspection import FileReport, Finding, Inspection, Trust

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
    print_inspection(console, report.data, remedies=True)
    console.print(f"verdict: {report.to_dict()['verdict']}", highlight=False)


def print_inspection(
    console: Console, data: Inspection, *, notes: bool = True, remedies: bool = False
) -> None:
    """Print one line per finding, the gravest first, and one per repair.

    Without ``notes`` only warnings and errors; with ``remedies`` also the lines for the scenario that deal with them.
    """
    for finding in data.findings:
        if notes or finding.severity != "note":
            console.print(_line(finding), soft_wrap=True)
    for sentence in data.repairs:
        console.print(Text(f"repaired: {sentence}"), soft_wrap=True)
    lines = list(dict.fromkeys(f.remedy for f in data.findings if f.remedy and f.severity != "note"))
    if remedies and lines:
        console.print("\nLines for the scenario that repair this; each is your choice:")
        for text in _merged(lines):
            console.print(Text(text), soft_wrap=True)


def _merged(remedies: Sequence[str]) -> list[str]:
    """One table per heading, with the keys of all remedies below it; lists of one key are one list."""
    tables: dict[str, dict[str, str]] = {}
    for remedy in remedies:
        heading, _, lines = remedy.partition("\n")
        table = tables.setdefault(heading, {})
        for line in lines.splitlines():
            key, _, value = line.partition(" = ")
            known = table.get(key)
            if known is not None and known != value and known.startswith("["):
                table[key] = f"{known[:-1]}, {value[1:]}"
            else:
                table.setdefault(key, value)
    return [
        "\n".join((heading, *(f"{key} = {value}" for key, value in table.items())))
        for heading, table in tables.items()
    ]


def _line(finding: Finding) -> Text:
    line = Text(f"data {finding.severity}: ", style=STYLES[finding.severity])
    line.append(f"{finding.recording}, {finding.channel}: {finding.kind}: {finding.text}", style="default")
    return line


def print_trust(console: Console, trust: Trust) -> None:
    """Print why a fit does not explain its recordings; nothing if it does."""
    if trust.verdict == "explained":
        return
    line = Text("not explained: ", style="red")
    line.append("do not trust the values above, for these reasons", style="default")
    console.print(line, soft_wrap=True)
    for reason in trust.reasons:
        console.print(Text(f"  {reason}"), soft_wrap=True)
