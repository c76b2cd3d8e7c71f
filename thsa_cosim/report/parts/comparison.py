"""Measured against simulated: errors per channel, then every recording with its residual below."""

from collections.abc import Mapping

import numpy as np

from thsa_cosim.report.folder import Json, Part, Study
from thsa_cosim.report.parts import chart
from thsa_cosim.report.parts.chart import Chart
from thsa_cosim.report.parts.content import Block, Cell, Column, Figure, Fold, Section, Table, Text
from thsa_cosim.report.parts.text import (
    DASH,
    count,
    degrees,
    number,
    percent,
    quantity,
    significant_cell,
    text_cell,
)
from thsa_cosim.report.signal_files import SignalFile, file_name, read_signals, signal_paths

#: rmse over noise up to which a model counts as met, and from which it lacks something.
MET, MISSED = 1.2, 2.0

#: Variants of a signal with their colours, in the order in which they are drawn.
STYLES: Mapping[str, tuple[str, float]] = {
    "measured": (chart.MEASURED, 1.2),
    "before": (chart.BEFORE, 1.2),
    "simulated": (chart.SIMULATED, 1.4),
    "after": (chart.AFTER, 1.4),
}


def comparison(part: Part) -> Section | None:
    """The section; None if the study compared nothing."""
    recordings = (part.result or {}).get("recordings", [])
    signals = [read_signals(path) for path in signal_paths(part.folder)]
    if not recordings and not signals:
        return None
    blocks: list[Block] = []
    if recordings:
        blocks.append(_errors(recordings))
        failed = [r for r in recordings if r.get("reason")]
        blocks += [Text(f"{r['name']} was not simulated: {r['reason']}", "bad") for r in failed]
    blocks += recording_folds(part, signals)
    return Section(f"{part.prefix}signals", "Measured against simulated", tuple(blocks))


def role_text(role: str) -> str:
    """``fitted`` or ``held out``."""
    return {"fit": "fitted", "validate": "held out"}.get(role, role)


def _temperature(value: float | None) -> Cell:
    return Cell(DASH if value is None else degrees(value).removesuffix(" °C"), value)


def ratio_mark(ratio: float | None) -> str:
    """How good an rmse over noise is."""
    return "" if ratio is None else "good" if ratio <= MET else "bad" if ratio > MISSED else ""


def noise_ratio(error: Json) -> float | None:
    """The rmse in units of the noise; None without noise."""
    return error["rmse"] / error["noise"] if error.get("noise") else None


def all_errors(study: Study) -> list[tuple[str, str, Json]]:
    """Role, channel and error over the whole study; of a simulate study the worst recording's."""
    result = study.whole.result or {}
    found = [(role, n, e) for role, channels in result.get("error", {}).items() for n, e in channels.items()]
    if found or study.whole.kind != "simulate":
        return found
    worst: dict[tuple[str, str], Json] = {}
    for recording in result.get("recordings", []):
        for name, error in recording["error"].items():
            key = recording["role"], name
            if key not in worst or error["rmse"] > worst[key]["rmse"]:
                worst[key] = error
    return [(f"{role_text(role)}, worst recording", name, error) for (role, name), error in worst.items()]


def _errors(recordings: list[Json]) -> Table:
    columns = (
        Column("recording", numeric=False),
        Column("role", numeric=False),
        Column("temperature", "°C"),
        Column("signal", numeric=False),
        Column("unit", numeric=False),
        Column("rmse"),
        Column("noise (1 σ)"),
        Column("rmse / noise"),
        Column("rmse / range"),
    )
    rows = []
    for recording in recordings:
        for name, error in recording["error"].items():
            ratio = noise_ratio(error)
            share = error.get("nrmse")
            rows.append(
                (
                    text_cell(recording["name"]),
                    text_cell(role_text(recording["role"])),
                    _temperature(recording.get("temperature_degC")),
                    text_cell(name),
                    text_cell(error["unit"]),
                    significant_cell(error["rmse"]),
                    significant_cell(error.get("noise")),
                    significant_cell(ratio, 3, ratio_mark(ratio)),
                    Cell(percent(share), share),
                )
            )
    note = f"1 × noise is the best that a model can reach; above {MISSED:g} × noise it does not explain the signal."
    return Table("Errors by recording and signal", columns, rows, note)


def recording_folds(part: Part, signals: list[SignalFile]) -> list[Block]:
    """One fold per recording with its figure; the worst one is open."""
    facts = {(r["role"], r["name"]): r for r in (part.result or {}).get("recordings", [])}
    order = list(facts)
    signals = sorted(
        signals, key=lambda s: order.index((s.role, s.name)) if (s.role, s.name) in facts else len(order)
    )
    scores = [_score(found, facts.get((found.role, found.name), {}).get("error", {})) for found in signals]
    opened = int(np.argmax(scores)) if scores else 0
    folds: list[Block] = []
    for k, found in enumerate(signals):
        known = facts.get((found.role, found.name), {})
        temperature = known.get("temperature_degC")
        where = f", {degrees(temperature)}" if temperature is not None else ""
        role = role_text(found.role)
        figure = compare_figure(
            f"{part.prefix}{file_name(found.role)}-{file_name(found.name)}", found, known.get("error", {})
        )
        folds.append(Fold(f"{found.name} ({role}{where})", (figure,), is_open=k == opened))
    return folds


def _score(found: SignalFile, errors: Json) -> float:
    """How badly a recording is met: the worst rmse over noise, else over the measured range."""
    ratios = [ratio for error in errors.values() if (ratio := noise_ratio(error)) is not None]
    if ratios:
        return max(ratios)
    worst = 0.0
    for variants in found.channels.values():
        if "measured" in variants and len(variants) > 1:
            measured, other = variants["measured"], list(variants.values())[-1]
            span = float(np.nanmax(measured) - np.nanmin(measured)) or 1.0
            worst = max(worst, float(np.nan_to_num(np.nanstd(measured - other))) / span)
    return worst


def compare_figure(name: str, found: SignalFile, errors: Json) -> Figure:
    """All channels of a recording, each with its residual below, over one time axis."""
    channels = {c: v for c, v in found.channels.items() if "measured" in v} or found.channels
    drawn = Chart(
        name,
        rows=2 * len(channels),
        row_height=125,
        weights=[2.0, 1.2] * len(channels),
        shared_x=True,
        between=30,
    )
    for k, (channel, variants) in enumerate(channels.items()):
        above, below, unit = (2 * k, 0), (2 * k + 1, 0), found.units.get(channel, "1")
        for variant in (v for v in STYLES if v in variants):
            colour, width = STYLES[variant]
            drawn.line(
                found.time, variants[variant], variant, at=above, colour=colour, width=width, thin=True
            )
        for variant, values in variants.items():
            if variant == "measured" or "measured" not in variants:
                continue
            label = "residual" if variant == "simulated" else f"residual {variant}"
            colour = (
                chart.RESIDUAL if variant == "simulated" else STYLES.get(variant, (chart.RESIDUAL, 1.0))[0]
            )
            residual = values - variants["measured"]
            drawn.line(found.time, residual, label, at=below, colour=colour, width=1.0, thin=True)
        if channel in errors:
            drawn.title(_heading(channel, unit, errors[channel]), *above)
        drawn.axes(*above, y=f"{channel} [{unit}]")
        drawn.axes(*below, y=f"residual [{unit}]", x="time [s]" if k == len(channels) - 1 else "")
    samples = count(found.time.size, "sample")
    return drawn.build(
        f"{found.name}: measured and simulated, and simulated − measured below. {samples}; long signals are drawn by"
        " the minimum and maximum of each short span."
    )


def _heading(channel: str, unit: str, error: Json) -> str:
    ratio = noise_ratio(error)
    times = "" if ratio is None else f" = {number(ratio, 3)} × noise"
    share = percent(error.get("nrmse"))
    return f"{channel}: rmse {quantity(error['rmse'], unit, 3)}{times}" + (
        f", {share} of range" if share != DASH else ""
    )
