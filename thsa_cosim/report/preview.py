"""A page on what a drafted scenario reads: the mapping, the signals with the stretches of findings, the findings."""

import base64
import html
import io
from collections.abc import Sequence
from pathlib import Path

from thsa_cosim.draft import Draft
from thsa_cosim.inspection import Finding
from thsa_cosim.recordings import Recording
from thsa_cosim.scenario import Scenario

_COLOURS = {"note": "#888888", "warning": "#e0a000", "error": "#d02020"}


def write_preview(scenario: Scenario, draft: Draft, path: Path) -> Path:
    """Write the page; return its path."""
    recordings = (*scenario.fit, *scenario.validate)
    title = html.escape(f"What {scenario.path.name} reads")
    parts = [
        f"<!doctype html><html><head><meta charset='utf-8'><title>{title}</title><style>"
        "body{font-family:sans-serif;max-width:60em;margin:2em auto}td,th{padding:.2em .8em;text-align:left}"
        "img{max-width:100%}</style></head><body>",
        f"<h1>{title}</h1>",
        _mapping(draft),
        _findings(scenario),
    ]
    for recording in recordings[:8]:
        own = [f for f in scenario.data.findings if f.recording == recording.name]
        parts.append(f"<h2>{html.escape(recording.name)}</h2>{_plot(recording, own)}")
    path.write_text("\n".join([*parts, "</body></html>"]), encoding="utf-8")
    return path


def _mapping(draft: Draft) -> str:
    rows: list[tuple[str, ...]] = [
        (m.variable.name, str(m.variable.causality), m.column.name, m.column.unit or "not stated", m.why)
        for m in draft.matches
    ]
    rows += [(v.name, "input", "–", v.unit or "", "constant") for v in draft.constant]
    rows += [("–", "", c.name, c.unit or "", "fits no variable") for c in draft.unmatched_columns]
    rows += [("–", "", name, "", f"not used: {reason}") for name, reason in draft.unused.items()]
    return _table(("variable", "role", "column", "unit", "matched"), rows)


def _findings(scenario: Scenario) -> str:
    rows = [(f.severity, f.recording, f.channel, f.kind, f.text) for f in scenario.data.findings]
    if not rows:
        return "<p>The recordings have no defect that would affect a fit.</p>"
    return _table(("severity", "recording", "signal", "what", "finding"), rows)


def _table(header: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> str:
    lines = ["<tr>" + "".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in row) + "</tr>"
             for tag, row in (("th", header), *(("td", row) for row in rows))]  # fmt: skip
    return f"<table>{''.join(lines)}</table>"


def _plot(recording: Recording, findings: list[Finding]) -> str:
    """All signals over time, the stretches of their findings shaded; a picture inside the page."""
    from matplotlib.figure import Figure

    names = list(recording.samples)
    figure = Figure(figsize=(9, 1.6 * max(1, len(names))), layout="constrained")
    axes = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    for axis, name in zip(axes, names, strict=True):
        samples = recording.samples[name]
        axis.plot(samples.time, samples.values, lw=0.7)
        axis.set_ylabel(f"{name} [{samples.unit}]".replace("$", "\\$"), fontsize=8)
        for finding in (f for f in findings if f.channel in (name, "time")):
            for begin, end in finding.where:
                axis.axvspan(begin, max(end, begin + 1e-9), color=_COLOURS[finding.severity], alpha=0.3)
    axes[-1].set_xlabel("time [s]", fontsize=8)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=90)
    return f'<img alt="signals" src="data:image/png;base64,{base64.b64encode(buffer.getvalue()).decode()}">'
