"""Axes that draw their ticks, labels and grid in one go: half of a figure's time is matplotlib's own tick objects.

Everything else of matplotlib's axes works as ever: limits, scales, locators and formatters can be changed later.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis, XAxis, YAxis
from matplotlib.font_manager import FontProperties
from matplotlib.path import Path
from matplotlib.ticker import LogFormatter
from matplotlib.transforms import Bbox, IdentityTransform

from thsa_cosim.signals import FloatArray

LABEL_POINTS = 8.0
_MAJOR, _MINOR = (3.5, 0.8), (2.0, 0.6)
"""Length and width of tick marks in points."""
_PAD_POINTS = 3.5
_GRID_COLOUR, _GRID_WIDTH = (0.9, 0.9, 0.9, 1.0), 0.6
_BLACK = (0.0, 0.0, 0.0, 1.0)
_RAISED = str.maketrans("-−0123456789", "⁻⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


class PowerFormatter(LogFormatter):
    """10³ on logarithmic axes in plain text; matplotlib's own goes through a parser of formulas."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        """The label at ``x``; empty where matplotlib shows none."""
        if not super().__call__(x, pos):
            return ""
        exponent = int(np.floor(np.log10(x) + 1e-9))
        factor = x / 10.0**exponent
        power = f"10{str(exponent).translate(_RAISED)}"
        return power if abs(factor - 1.0) < 1e-6 else f"{factor:.3g}×{power}"


class _InOneGo:
    """``draw`` of an axis without tick objects; ``across``: 1 for x, whose ticks stand below, 0 for y."""

    across: int

    def draw(self: Any, renderer: Any) -> None:
        if not self.get_visible():
            return
        box = self.axes.bbox
        major, labels = self._shown(self.get_majorticklocs(), self.major.formatter)
        minor, more = self._shown(self.get_minorticklocs(), self.minor.formatter)
        if self._major_tick_kw.get("gridOn"):
            ends = (box.y0, box.y1) if self.across else (box.x0, box.x1)
            self._strokes(renderer, major, ends, _GRID_WIDTH, _GRID_COLOUR)
        start = box.y0 if self.across else box.x0
        pixels = renderer.points_to_pixels
        for at, (length, width) in ((major, _MAJOR), (minor, _MINOR)):
            self._strokes(renderer, at, (start - pixels(length), start), width, _BLACK)
        self._boxes = self._texts(renderer, np.append(major, minor), [*labels, *more], start)
        self._update_label_position(renderer)
        self.label.draw(renderer)
        self._update_offset_text_position(self._boxes, [])
        self.offsetText.set_text(self.major.formatter.get_offset())
        self.offsetText.draw(renderer)
        self.stale = False

    def _update_label_position(self: Any, renderer: Any) -> None:
        """Put the title beyond the labels."""
        if not self._autolabelpos:
            return
        x, y = self.label.get_position()
        box = Bbox.union([self.axes.bbox, *self._boxes])
        pad = renderer.points_to_pixels(self.labelpad)
        self.label.set_position((x, box.y0 - pad) if self.across else (box.x0 - pad, y))

    def _shown(self: Any, values: Any, formatter: Any) -> tuple[FloatArray, list[str]]:
        """Pixels and labels of the ticks that lie inside of the limits."""
        values = np.asarray(values, dtype=np.float64)
        labels = formatter.format_ticks(values)
        place = self.get_transform().transform
        low, high = sorted(place(np.array(self.get_view_interval(), dtype=np.float64)))
        with np.errstate(all="ignore"):
            found = place(values)
        slack = 1e-10 * (high - low)
        inside = (found >= low - slack) & (found <= high + slack)
        line = np.zeros((int(inside.sum()), 2))
        line[:, 1 - self.across] = values[inside]
        line[:, self.across] = self._other_end()
        pixels = self.axes.transData.transform(line)[:, 1 - self.across] if len(line) else np.empty(0)
        return pixels, [label for label, yes in zip(labels, inside, strict=True) if yes]

    def _other_end(self: Any) -> float:
        """A value on the other axis, wherever it is."""
        other = self.axes.yaxis if self.across else self.axes.xaxis
        return float(other.get_view_interval()[0])

    def _strokes(
        self: Any, renderer: Any, at: FloatArray, ends: tuple[float, float], width: float, colour: Any
    ) -> None:
        if not at.size:
            return
        points = np.empty((2 * at.size, 2))
        points[:, 1 - self.across] = np.repeat(at, 2)
        points[:, self.across] = np.tile(ends, at.size)
        codes = np.tile(np.array([Path.MOVETO, Path.LINETO], dtype=Path.code_type), at.size)
        context = renderer.new_gc()
        context.set_foreground(colour, isRGBA=True)
        context.set_linewidth(width)
        context.set_snap(True)
        renderer.draw_path(context, Path(points, codes), IdentityTransform())
        context.restore()

    def _texts(self: Any, renderer: Any, at: FloatArray, labels: Sequence[str], start: float) -> list[Bbox]:
        """Draw the labels; return the box around all of them, if there are any."""
        if not self._major_tick_kw.get("label1On", True) or not any(labels):
            return []
        font = FontProperties(size=self._major_tick_kw.get("labelsize", LABEL_POINTS))
        _, line, below = renderer.get_text_width_height_descent("lp", font, False)
        digit = 0.7 * line
        edge = start - renderer.points_to_pixels(_MAJOR[0] + _PAD_POINTS)
        context = renderer.new_gc()
        context.set_foreground(_BLACK, isRGBA=True)
        boxes = []
        for place, label in zip(at.tolist(), labels, strict=True):
            for k, text in enumerate(label.replace(r"\$", "$").split("\n") if label else ()):
                wide, _, _ = renderer.get_text_width_height_descent(text, font, False)
                x = place - 0.5 * wide if self.across else edge - wide
                y = edge - (line - below) - 1.2 * k * line if self.across else place - 0.5 * digit
                renderer.draw_text(context, x, renderer.height - y, text, font, 0.0, False)
                boxes.append(Bbox.from_extents(x, y - below, x + wide, y + digit))
        context.restore()
        return [Bbox.union(boxes)] if boxes else []

    def set_tick_params(self: Any, which: Any = "major", reset: bool = False, **kwargs: Any) -> None:
        with _no_ticks_made(self):
            super().set_tick_params(which=which, reset=reset, **kwargs)  # type: ignore[misc]

    def set_clip_path(self: Any, path: Any, transform: Any = None) -> None:
        with _no_ticks_made(self):
            super().set_clip_path(path, transform)  # type: ignore[misc]


@contextmanager
def _no_ticks_made(axis: Axis) -> Iterator[None]:
    """matplotlib makes a tick where its parameters are set; here there is none yet to be changed."""
    missing = [name for name in ("majorTicks", "minorTicks") if name not in vars(axis)]
    vars(axis).update({name: [] for name in missing})
    yield
    for name in missing:
        if vars(axis).get(name) == []:
            del vars(axis)[name]


class _PanelX(_InOneGo, XAxis):
    across = 1


class _PanelY(_InOneGo, YAxis):
    across = 0


class Panel(Axes):
    """Axes of a figure of the page."""

    name = "thsa-panel"

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        for spine in self.spines.values():
            spine.set_position(("outward", 0.0))  # matplotlib leaves that to the first tick

    def _init_axis(self) -> None:
        self.xaxis, self.yaxis = _PanelX(self, clear=False), _PanelY(self, clear=False)
        for side, axis in (
            ("bottom", self.xaxis),
            ("top", self.xaxis),
            ("left", self.yaxis),
            ("right", self.yaxis),
        ):
            self.spines[side].register_axis(axis)
