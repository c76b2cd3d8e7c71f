"""A page's figure as a matplotlib figure: files and notebooks show the drawing that the page shows.

Understands what ``chart`` makes: lines, markers with error bars, filled bands, bars, contours, levels and headings.
"""

import base64
import html
import io
import re
import struct
import zlib
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as Sheet
from numpy.typing import NDArray

from thsa_cosim.report.parts import content
from thsa_cosim.report.parts.axes import LABEL_POINTS, Panel, PowerFormatter

FloatArray = NDArray[np.float64]
Trace = Mapping[str, Any]

WIDTH_PX, PX_PER_INCH = 980, 100
DOTS_PER_INCH = 130
"""Of PNG files."""
_DASHES = {"dash": "--", "dot": ":", "dashdot": "-.", "solid": "-"}
_SYMBOLS = {
    "circle": "o",
    "circle-open": "o",
    "diamond": "D",
    "star": "*",
    "cross": "P",
    "x": "X",
    "square": "s",
}


class Drawing(Sheet):
    """A matplotlib figure that notebooks show without ``%matplotlib``; ``savefig`` writes it to a file."""

    def _repr_png_(self) -> bytes:
        buffer = io.BytesIO()
        self.savefig(buffer, format="png", dpi=PX_PER_INCH)
        return buffer.getvalue()


def draw(figure: content.Figure) -> Drawing:
    """Draw a figure of the page in its light colours."""
    layout = figure.layout
    sheet = Drawing(figsize=(WIDTH_PX / PX_PER_INCH, figure.height / PX_PER_INCH))
    FigureCanvasAgg(sheet)
    panels = _panels(sheet, layout, figure.data)
    named: dict[str, Any] = {}
    for k, trace in enumerate(figure.data):
        axes = panels[trace.get("yaxis", "y")]
        handle = _TRACES[trace["type"]](axes, trace, figure.data)
        if trace.get("showlegend") and trace.get("name"):
            named.setdefault(_plain(trace["name"]), handle)
        axes.set_zorder(1.0 + 0.001 * k)
    for shape in layout.get("shapes", ()):
        line = shape["line"]
        panels[shape["yref"].split()[0]].axhline(
            shape["y0"], color=_colour(line["color"]), lw=line["width"], ls=_DASHES.get(line["dash"], "-")
        )
    below = {trace.get("yaxis", "y"): trace.get("xaxis", "x") for trace in figure.data}
    for name, axes in panels.items():
        _finish(axes, layout, below[name], name)
    for note in layout.get("annotations", ()):
        # A height of its own spares matplotlib the measuring of every label, a third of the time.
        panels[note["yref"].split()[0]].set_title(
            _plain(note["text"]), loc="left", fontsize=9.5, weight="bold", pad=5, y=1.0
        )
    if named:
        sheet.legend(
            [h for h in named.values() if h is not None],
            [n for n, h in named.items() if h is not None],
            loc="upper left",
            bbox_to_anchor=(70 / WIDTH_PX, 1.0 - 4 / figure.height),
            ncols=max(1, min(len(named), 135 // (max(map(len, named)) + 7))),
            frameon=False,
            fontsize=8.5,
        )
    return sheet


def save(figure: content.Figure, path: Path) -> Path:
    """Write a figure as PNG; return ``path``."""
    path.parent.mkdir(parents=True, exist_ok=True)
    sheet = draw(figure)
    sheet.set_dpi(DOTS_PER_INCH)
    canvas: Any = FigureCanvasAgg(sheet)
    canvas.draw()
    path.write_bytes(png(np.asarray(canvas.buffer_rgba())[:, :, :3]))
    return path


def png(pixels: NDArray[np.uint8]) -> bytes:
    """A picture (height, width, 3) as PNG file: each row as its difference from the one above (filter type 2).

    Pillow tries all filters on every row, which takes twice as long and saves nothing in drawings.
    """
    high, wide, _ = pixels.shape
    rows = np.empty((high, 1 + 3 * wide), dtype=np.uint8)
    rows[:, 0] = 2
    for k in range(3):  # colour by colour: numpy copies three bytes at a time slowly
        rows[0, 1 + k :: 3] = pixels[0, :, k]
        np.subtract(pixels[1:, :, k], pixels[:-1, :, k], out=rows[1:, 1 + k :: 3])
    head = struct.pack(">IIBBBBB", wide, high, 8, 2, 0, 0, 0)
    chunks = ((b"IHDR", head), (b"IDAT", zlib.compress(rows.data, 1)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in chunks
    )


def _panels(sheet: Drawing, layout: Mapping[str, Any], data: Sequence[Trace]) -> dict[str, Axes]:
    """Axes by plotly's name of their y axis, where plotly puts them."""
    height = layout["height"]
    left, right = 82 / WIDTH_PX, 24 / WIDTH_PX
    above, below = layout["margin"]["t"] / height, (layout["margin"]["b"] + 4) / height
    wide, high = 1.0 - left - right, 1.0 - above - below
    found: dict[str, Axes] = {}
    for first, second in dict.fromkeys((t.get("xaxis", "x"), t.get("yaxis", "y")) for t in data):
        x, y = layout[f"xaxis{first[1:]}"]["domain"], layout[f"yaxis{second[1:]}"]["domain"]
        place = (left + wide * x[0], below + high * y[0], wide * (x[1] - x[0]), high * (y[1] - y[0]))
        found[second] = sheet.add_axes(Panel(sheet, place))
    return found


def _finish(axes: Axes, layout: Mapping[str, Any], first: str, second: str) -> None:
    """Scale, label and clean a panel; only the one that its x axis is anchored to shows it."""
    lowest = layout[f"xaxis{first[1:]}"].get("anchor", second) == second
    for letter, axis, name in (("x", axes.xaxis, first), ("y", axes.yaxis, second)):
        asked = layout[f"{letter}axis{name[1:]}"]
        if asked.get("type") == "log" and _is_positive(axes, letter):
            (axes.set_xscale if letter == "x" else axes.set_yscale)("log")
            axis.set_major_formatter(PowerFormatter())
            axis.set_minor_formatter(PowerFormatter(minor_thresholds=(1.0, 0.4)))
        if "title" in asked and (letter == "y" or lowest):
            axis.set_label_text(_plain(asked["title"]["text"]), fontsize=9)
        if "range" in asked:
            ends = [10.0**v for v in asked["range"]] if asked.get("type") == "log" else asked["range"]
            (axes.set_xlim if letter == "x" else axes.set_ylim)(*ends)
        elif asked.get("rangemode") == "tozero":
            (axes.set_xlim if letter == "x" else axes.set_ylim)(0.0, None)
    if not lowest:
        axes.xaxis.set_tick_params(labelbottom=False)
    axes.tick_params(labelsize=LABEL_POINTS)
    axes.yaxis.get_offset_text().set(fontsize=7, x=-0.05)
    axes.grid(True)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def _is_positive(axes: Axes, letter: str) -> bool:
    """Whether a logarithmic axis would show anything: a search that found nothing has only NaN."""
    bounds = axes.dataLim.intervalx if letter == "x" else axes.dataLim.intervaly
    return bool(np.isfinite(bounds).all() and bounds[1] > 0.0)


def _scatter(axes: Axes, trace: Trace, _every: Sequence[Trace]) -> Any:
    x, y = _values(trace["x"]), _values(trace["y"])
    if trace.get("fill") == "toself":
        known = np.isfinite(x) & np.isfinite(y)
        return (
            axes.fill(x[known], y[known], color=_colour(trace["fillcolor"]), lw=0)[0] if known.any() else None
        )
    style: dict[str, Any] = {"ls": "none"}
    line, marker = trace.get("line", {}), trace.get("marker", {})
    if "lines" in trace["mode"]:
        style |= {"ls": _DASHES.get(line.get("dash", "solid"), "-"), "lw": 0.75 * line.get("width", 1.5)}
        style["color"] = _colour(line.get("color", marker.get("color", "black")))
    if "markers" in trace["mode"]:
        colour, symbol = _colour(marker["color"]), str(marker.get("symbol", "circle"))
        style |= {"marker": _SYMBOLS.get(symbol, "o"), "ms": 0.75 * marker.get("size", 7), "color": colour}
        style["mfc"] = "none" if symbol.endswith("-open") else colour
        style["mec"] = _colour(marker.get("line", {}).get("color", marker["color"]))
        style["mew"] = marker.get("line", {}).get("width", 1)
    if "error_y" in trace:
        _whiskers(axes, x, y, _values(trace["error_y"]["array"]), style["color"])
    return axes.plot(x, y, **style)[0]


def _whiskers(axes: Axes, x: FloatArray, y: FloatArray, errors: FloatArray, colour: Any) -> None:
    """Error bars as one line: matplotlib's own take three artists and ten times as long."""
    ends = np.stack([y - errors, y + errors, np.full(y.size, np.nan)], axis=1).ravel()
    axes.plot(np.repeat(x, 3), ends, color=colour, lw=0.9, marker="_", ms=4, mew=0.9)


def _bar(axes: Axes, trace: Trace, every: Sequence[Trace]) -> Any:
    beside = [t for t in every if t["type"] == "bar" and t.get("xaxis") == trace.get("xaxis")]
    labels = list(dict.fromkeys(_plain(label) for t in beside for label in t["x"]))
    width = 0.8 / len(beside)
    shift = (next(k for k, t in enumerate(beside) if t is trace) + 0.5) * width - 0.4
    at = [labels.index(_plain(label)) + shift for label in trace["x"]]
    heights = [np.nan if h is None else h for h in trace["y"]]
    given = trace["marker"]["color"]
    shades = _colour(given) if isinstance(given, str) else [_colour(one) for one in given]
    drawn = axes.bar(at, heights, width=0.94 * width, color=shades)
    axes.set_xticks(range(len(labels)), labels)
    return drawn


def _contour(axes: Axes, trace: Trace, _every: Sequence[Trace]) -> Any:
    x, y, z = _values(trace["x"]), _values(trace["y"]), _values(trace["z"])
    if trace.get("contours", {}).get("type") == "constraint":
        axes.contourf(
            x, y, z, levels=[trace["contours"]["value"], np.inf], colors=[(0.2, 0.2, 0.2)], alpha=0.45
        )
        return axes.fill([], [], color=(0.2, 0.2, 0.2, 0.45))[0]
    if not np.isfinite(z).any():
        return None
    shades = "viridis_r" if trace.get("reversescale") else "viridis"
    filled = axes.contourf(x, y, np.ma.masked_invalid(z), levels=trace.get("ncontours", 20), cmap=shades)
    label = _plain(trace.get("colorbar", {}).get("title", {}).get("text", ""))
    axes.get_figure().colorbar(filled, ax=axes, label=label)  # type: ignore[union-attr]
    return None


_TRACES = {"scatter": _scatter, "bar": _bar, "contour": _contour}


def _values(packed: Any) -> FloatArray:
    """The numbers of a trace, packed or not, as (n,) or (n, m)."""
    if not isinstance(packed, Mapping):
        return np.asarray(packed, dtype=np.float64)
    values = np.frombuffer(base64.b64decode(packed["bdata"]), dtype=f"<{packed['dtype']}").astype(np.float64)
    return values.reshape([int(n) for n in packed["shape"].split(",")]) if "shape" in packed else values


def _plain(text: str) -> str:
    """What plotly shows, for matplotlib, which reads formulas between dollars."""
    return html.unescape(re.sub(r"<[^>]+>", "", text)).replace("$", r"\$")


@cache
def _palette() -> dict[str, str]:
    """The style sheet's light colours by name."""
    sheet = files("thsa_cosim.report.page").joinpath("templates", "page.css").read_text(encoding="utf-8")
    light = sheet[sheet.index("{") + 1 : sheet.index("}")]
    return dict(re.findall(r"(--[\w-]+):\s*([^;]+);", light))


def _colour(name: str) -> Any:
    """A colour of the page as matplotlib wants it."""
    shade = _palette()[name[4:-1]] if name.startswith("var(") else name
    numbers = re.fullmatch(r"rgba?\(([^)]*)\)", shade)
    if numbers is None:
        return shade
    red, green, blue, *alpha = (float(part) for part in numbers[1].split(","))
    return (red / 255.0, green / 255.0, blue / 255.0, *alpha)
