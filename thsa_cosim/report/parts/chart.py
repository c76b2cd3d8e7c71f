"""Plotly figures as plain dictionaries: a grid of panels, with text escaped and arrays packed.

Plotly reads a small HTML in every text; what comes out of files is escaped before it gets there.
"""

import base64
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thsa_cosim.report.parts.content import Figure

FloatArray = NDArray[np.float64]

#: Colours that tell series apart, as names of the style sheet.
SERIES = tuple(f"var(--series-{k})" for k in range(1, 9))
MEASURED, SIMULATED = "var(--measured)", "var(--simulated)"
PUBLISHED, RESIDUAL, INK = "var(--published)", "var(--residual)", "var(--ink)"
BEFORE, AFTER = "var(--before)", "var(--after)"

_PIXELS_ABOVE, _PIXELS_BELOW, _PIXELS_BETWEEN = 64, 52, 72


def plain(text: object) -> str:
    """Text that plotly shows as it is: no tags, no entities, no ``%{...}`` of its hover templates."""
    escaped = str(text).replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    return escaped.replace("%{", "% {")


def packed(values: ArrayLike) -> dict[str, Any]:
    """An array (any shape up to 2) as base64 float32, which plotly ≥ 6 reads: a third of the text's size.

    Infinite values become NaN, which plotly leaves out.
    """
    array = np.asarray(values, dtype=np.float64)
    with np.errstate(over="ignore"):
        small = np.where(np.isfinite(array), array, np.nan).astype("<f4")
    small[~np.isfinite(small)] = np.nan
    entry: dict[str, Any] = {"dtype": "f4", "bdata": base64.b64encode(small.tobytes()).decode("ascii")}
    if small.ndim == 2:
        entry["shape"] = f"{small.shape[0]},{small.shape[1]}"
    return entry


def envelope(values: FloatArray, buckets: int = 1250) -> NDArray[np.intp]:
    """Indices of the lowest and the highest of each of ``buckets`` runs of ``values`` (n,), ends included.

    Drawn as a line they look like all samples do; short arrays keep every index.
    """
    if values.size <= 2 * buckets:
        return np.arange(values.size)
    length = -(-values.size // buckets)
    padded = np.full(length * buckets, np.nan)
    padded[: values.size] = np.nan_to_num(values, nan=0.0, posinf=0.0, neginf=0.0)
    runs = padded.reshape(buckets, length)
    filled = np.flatnonzero(np.isfinite(runs).any(axis=1))
    runs = runs[filled]
    low, high = np.nanargmin(runs, axis=1), np.nanargmax(runs, axis=1)
    starts = filled * length
    return np.unique(np.concatenate([[0], starts + low, starts + high, [values.size - 1]]))


class Chart:
    """A grid of panels under one legend; ``weights`` give the rows' relative heights.

    Panels are addressed by (row, column) from the top left. With ``shared_x`` the panels of a column have one x axis
    below the lowest: they zoom together, under one cursor that tells all values.
    """

    def __init__(
        self,
        name: str,
        *,
        rows: int = 1,
        columns: int = 1,
        row_height: int = 300,
        weights: Sequence[float] | None = None,
        shared_x: bool = False,
        between: int | None = None,
    ) -> None:
        self.name = name
        self.rows, self.columns = rows, columns
        self._shared_x = shared_x
        self._data: list[dict[str, Any]] = []
        self._named: set[str] = set()
        gap = between if between is not None else (14 if shared_x else _PIXELS_BETWEEN)
        plot_height = row_height * rows + gap * (rows - 1)
        self.height = plot_height + _PIXELS_ABOVE + _PIXELS_BELOW
        self._layout: dict[str, Any] = {
            "height": self.height,
            "margin": {"t": _PIXELS_ABOVE, "b": _PIXELS_BELOW, "l": 78, "r": 24},
            "legend": {"orientation": "h", "x": 0.0, "y": 1.0 + 22 / plot_height, "yanchor": "bottom"},
            "annotations": [],
            "shapes": [],
        }
        self._place(np.array(weights or [1.0] * rows), gap / plot_height)

    def _place(self, weights: FloatArray, gap: float) -> None:
        heights = weights / weights.sum() * (1.0 - gap * (self.rows - 1))
        side = {2: 0.1, 3: 0.105}.get(self.columns, 0.06)  # room for tick labels and an axis title
        width = (1.0 - side * (self.columns - 1)) / self.columns
        top = 1.0
        for row in range(self.rows):
            bottom = max(top - float(heights[row]), 0.0)
            for column in range(self.columns):
                x, y = self._names(row, column)
                left = column * (width + side)
                self._axis(x).update(domain=[left, min(left + width, 1.0)], anchor=y, automargin=True)
                self._axis(y).update(domain=[bottom, top], anchor=x, automargin=True)
            top = bottom - gap

    def _names(self, row: int, column: int) -> tuple[str, str]:
        """Plotly's names of a panel's axes: x, x2, … and y, y2, …; panels that share an x axis lie on the same."""
        number = row * self.columns + column + 1
        below = column + 1 if self._shared_x else number
        return f"x{below if below > 1 else ''}", f"y{number if number > 1 else ''}"

    def _axis(self, name: str) -> dict[str, Any]:
        axis: dict[str, Any] = self._layout.setdefault(f"{name[0]}axis{name[1:]}", {})
        return axis

    def axes(self, row: int = 0, column: int = 0, *, x: str = "", y: str = "", **options: Any) -> None:
        """Label a panel's axes; ``log_x``, ``log_y`` make one logarithmic, ``y_range`` and ``x_range`` limit it."""
        first, second = self._names(row, column)
        if x:
            self._axis(first)["title"] = {"text": plain(x), "standoff": 8}
        if y:
            self._axis(second)["title"] = {"text": plain(y), "standoff": 8}
        for name, letter in ((first, "x"), (second, "y")):
            axis = self._axis(name)
            if options.get(f"log_{letter}"):
                axis.update(
                    type="log", dtick=options.get(f"dtick_{letter}"), exponentformat="power", nticks=6
                )
            if f"{letter}_range" in options:
                axis["range"] = list(options[f"{letter}_range"])
            if f"{letter}_options" in options:
                axis.update(options[f"{letter}_options"])

    def title(self, text: str, row: int = 0, column: int = 0) -> None:
        """A heading over one panel."""
        x, y = self._names(row, column)
        self._layout["annotations"].append(
            {
                "text": f"<b>{plain(text)}</b>",
                "xref": f"{x} domain",
                "yref": f"{y} domain",
                "x": 0.0,
                "y": 1.0,
                "xanchor": "left",
                "yanchor": "bottom",
                "showarrow": False,
                "yshift": 2,
            }
        )

    def add(self, row: int, column: int, name: str, **trace: Any) -> None:
        """A trace; of traces with the same ``name`` the first stands in the legend and switches all."""
        x, y = self._names(row, column)
        shown = bool(name) and name not in self._named
        self._named.add(name)
        entry = {"xaxis": x, "yaxis": y, "name": plain(name), "showlegend": shown, **trace}
        if name:
            entry.setdefault("legendgroup", plain(name))
        self._data.append(entry)

    def line(
        self, x: ArrayLike, y: ArrayLike, name: str = "", *, at: tuple[int, int] = (0, 0), **style: Any
    ) -> None:
        """A line; ``colour``, ``width`` in px, ``dash``, ``thin`` (bucket-wise lowest and highest samples only)."""
        x, y = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
        if style.get("thin"):
            chosen = envelope(y)
            x, y = x[chosen], y[chosen]
        line = {"color": style.get("colour", SERIES[0]), "width": style.get("width", 1.5)}
        line["simplify"] = False  # plotly's own thinning leaves kinks in smooth curves
        if "dash" in style:
            line["dash"] = style["dash"]
        extra = style.get("extra", {})
        self.add(*at, name, type="scatter", mode="lines", x=packed(x), y=packed(y), line=line, **extra)

    def points(
        self, x: ArrayLike, y: ArrayLike, name: str = "", *, at: tuple[int, int] = (0, 0), **style: Any
    ) -> None:
        """Markers; ``colour``, ``size`` in px, ``symbol``, ``error`` (n,) for bars, ``labels`` for hovering."""
        marker = {"color": style.get("colour", INK), "size": style.get("size", 7)}
        marker["symbol"] = style.get("symbol", "circle")
        marker["line"] = {"width": style.get("edge", 1), "color": style.get("edge_colour", marker["color"])}
        extra: dict[str, Any] = dict(style.get("extra", {}))
        if style.get("error") is not None:
            bars = packed(np.nan_to_num(np.asarray(style["error"], dtype=np.float64)))
            extra["error_y"] = {"type": "data", "array": bars, "color": marker["color"], "thickness": 1.2}
            extra["customdata"] = bars
        if style.get("labels") is not None:
            extra["text"] = [plain(text) for text in style["labels"]]
        mode = "lines+markers" if style.get("joined") else "markers"
        if style.get("joined"):
            extra["line"] = {"color": marker["color"], "width": 1.5}
        self.add(*at, name, type="scatter", mode=mode, x=packed(x), y=packed(y), marker=marker, **extra)

    def bars(
        self,
        labels: Sequence[str],
        heights: Sequence[float | None],
        name: str,
        *,
        at: tuple[int, int] = (0, 0),
        colour: str | Sequence[str] = INK,
    ) -> None:
        """Bars beside each other over ``labels``; ``colour`` for all of them, or one each."""
        shown = [plain(label) for label in labels]
        shade = colour if isinstance(colour, str) else list(colour)
        self.add(*at, name, type="bar", x=shown, y=list(heights), marker={"color": shade})

    def band(
        self,
        x: ArrayLike,
        low: ArrayLike,
        high: ArrayLike,
        name: str = "",
        *,
        at: tuple[int, int] = (0, 0),
        colour: str = "var(--band)",
    ) -> None:
        """A filled region between two lines."""
        x = np.asarray(x, dtype=np.float64)
        around, outline = (
            np.concatenate([x, x[::-1]]),
            np.concatenate([np.asarray(high), np.asarray(low)[::-1]]),
        )
        trace: dict[str, Any] = {
            "type": "scatter",
            "mode": "lines",
            "x": packed(around),
            "y": packed(outline),
        }
        trace |= {"fill": "toself", "fillcolor": colour, "line": {"width": 0}, "hoverinfo": "skip"}
        self.add(at[0], at[1], name, **trace)

    def level(self, y: float, *, at: tuple[int, int] = (0, 0), colour: str = INK, dash: str = "dot") -> None:
        """A horizontal line across a panel."""
        x_name, y_name = self._names(*at)
        line = {"color": colour, "width": 1, "dash": dash}
        self._layout["shapes"].append(
            {"type": "line", "xref": f"{x_name} domain", "yref": y_name, "x0": 0, "x1": 1, "y0": y, "y1": y}
            | {"line": line}
        )

    def _hover(self) -> None:
        """Say a value's unit under the cursor, and where it is on the x axis; stacked panels share the cursor."""
        for trace in self._data:
            if trace["type"] not in ("scatter", "bar") or trace.get("hoverinfo") == "skip":
                continue
            unit = _unit(self._axis(trace["yaxis"]))
            error = " ± %{customdata:.2g}" if "customdata" in trace else ""
            trace.setdefault("hovertemplate", f"%{{y:.5g}}{error}{unit}")
            if self._shared_x or trace["type"] == "bar":
                continue
            name = trace["name"] or "value"
            title = _title(self._axis(trace["xaxis"]))
            trace["hovertemplate"] = f"{title} %{{x:.5g}}{_unit(self._axis(trace['xaxis']))}<br>{name} " + (
                f"{trace['hovertemplate']}<extra></extra>"
            )
        if self._shared_x:
            self._layout |= {"hovermode": "x unified", "hoversubplots": "axis"}
            for column in range(self.columns):
                axis = self._axis(self._names(0, column)[0])
                text = f"{_title(axis)} %{{x:.5g}}{_unit(axis)}"
                axis.update(showspikes=True, spikemode="across", spikesnap="cursor", spikethickness=1)
                axis["unifiedhovertitle"] = {"text": text}

    def build(self, caption: str, **layout: Any) -> Figure:
        """The finished figure; without a legend it needs less room above."""
        self._hover()
        if not any(entry["showlegend"] for entry in self._data):
            self.height -= _PIXELS_ABOVE - 32
            self._layout["margin"]["t"] = 32
            self._layout["height"] = self.height
        return Figure(self.name, self._data, {**self._layout, **layout}, self.height, caption)


def _title(axis: dict[str, Any]) -> str:
    """An axis' quantity without its unit."""
    return str(axis.get("title", {}).get("text", "")).rpartition(" [")[0]


def _unit(axis: dict[str, Any]) -> str:
    """An axis' unit behind a space; nothing for a plain number."""
    unit = str(axis.get("title", {}).get("text", "")).rpartition(" [")[2].rstrip("]")
    return "" if unit in ("", "1", "–") else f" {unit}"


def limits(values: Sequence[ArrayLike], margin: float = 0.06) -> tuple[float, float] | None:
    """The range that holds every finite one of ``values``, with a margin; None without any."""
    every = (
        np.concatenate([np.asarray(v, dtype=np.float64).ravel() for v in values]) if values else np.array([])
    )
    every = every[np.isfinite(every)]
    if not every.size:
        return None
    low, high = float(every.min()), float(every.max())
    space = margin * (high - low) if high > low else margin * (abs(high) or 1.0)
    return low - space, high + space
