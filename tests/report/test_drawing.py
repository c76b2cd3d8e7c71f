"""A page's figure as a matplotlib figure: the same numbers in the same places."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg

from thsa_cosim.report.page.write import figures_of
from thsa_cosim.report.parts import drawing
from thsa_cosim.report.parts.axes import Panel
from thsa_cosim.report.parts.chart import BEFORE, Chart
from thsa_cosim.report.parts.content import Fold, Section
from thsa_cosim.report.parts.drawing import draw


def test_lines_bands_levels_and_scales_are_those_of_the_page() -> None:
    chart = Chart("both", columns=2)
    x = np.linspace(1.0, 10.0, 7)
    chart.line(x, x**2, "square & <co>", colour=BEFORE, dash="dash")
    chart.band(x, x, 2.0 * x, "band")
    chart.level(3.0)
    chart.points(x, 1.0 / x, "points", at=(0, 1), error=0.1 * x)
    chart.axes(x="time [s]", y="cost of $ [1]", log_y=True, y_range=(0.0, 2.0))
    chart.title("left")
    left, right = draw(chart.build("")).axes
    np.testing.assert_allclose(left.lines[0].get_ydata(), x**2, rtol=1e-6)
    assert left.lines[0].get_color() == "#c4772b"
    assert left.lines[0].get_linestyle() == "--"
    assert left.lines[1].get_ydata()[0] == 3.0
    assert len(left.patches) == 1
    assert (left.get_yscale(), left.get_ylim()) == ("log", (1.0, 100.0))
    assert (left.get_xlabel(), left.get_title(loc="left")) == ("time [s]", "left")
    assert left.get_position().x1 < right.get_position().x0
    bars, points = right.lines
    ends = bars.get_ydata().reshape(-1, 3)
    np.testing.assert_allclose(ends[:, 1] - ends[:, 0], 0.2 * x, rtol=1e-5)
    np.testing.assert_allclose(ends[:, :2].mean(axis=1), points.get_ydata(), rtol=1e-5)
    assert np.isnan(ends[:, 2]).all()


def test_bars_stand_beside_each_other_and_a_legend_names_each_once() -> None:
    chart = Chart("bars")
    chart.bars(["i_q", "v"], [1.0, 2.0], "before")
    chart.bars(["i_q", "v"], [0.5, None], "after")
    sheet = draw(chart.build(""))
    (axes,) = sheet.axes
    before, after = axes.patches[0], axes.patches[2]
    assert before.get_x() + before.get_width() <= after.get_x() + 1e-9
    assert [text.get_text() for text in sheet.legends[0].get_texts()] == ["before", "after"]
    assert sheet._repr_png_().startswith(b"\x89PNG")


def test_details_of_another_figure_are_on_the_page_but_in_no_file() -> None:
    whole, detail, other = (
        replace(Chart(name).build(""), name=name) for name in ("whole", "detail", "other")
    )
    blocks = (whole, Fold("more", (detail,), details=True), Fold("another recording", (other,)))
    section = Section("structure", "Structure", blocks)
    assert list(figures_of([section])) == ["whole", "detail", "other"]
    assert list(figures_of([section], details=False)) == ["whole", "other"]


def test_contours_leave_out_what_is_not_known() -> None:
    chart = Chart("map")
    z = np.array([[1.0, 2.0], [np.nan, 4.0]])
    chart.add(0, 0, "", type="contour", x=[0.0, 1.0], y=[0.0, 1.0], z=z, ncontours=5)
    chart.axes(x="a [1]", y="b [1]")
    assert draw(chart.build("")).axes[0].get_xlabel() == "a [1]"


def test_a_png_is_read_back_as_its_pixels(tmp_path: Path) -> None:
    from PIL import Image

    pixels = np.random.default_rng(3).integers(0, 256, (37, 53, 3), dtype=np.uint8)
    (tmp_path / "noise.png").write_bytes(drawing.png(pixels))
    assert np.array_equal(np.asarray(Image.open(tmp_path / "noise.png")), pixels)


@pytest.mark.parametrize("scale", ["linear", "log"])
def test_ticks_in_one_go_are_where_matplotlib_puts_them(scale: str) -> None:
    """Beside matplotlib's own axes of the same data: marks, grid and spines in the same pixels."""

    def drawn(kind: type[Axes]) -> np.ndarray:
        sheet = drawing.Drawing(figsize=(4.0, 3.0), dpi=130)
        axes = sheet.add_axes(kind(sheet, (0.2, 0.2, 0.7, 0.7)))
        axes.plot([1.0, 40.0], [2.0, 3000.0])
        axes.set_yscale(scale)
        axes.grid(True, color="0.9", lw=0.6)
        axes.tick_params(labelsize=8)
        canvas = FigureCanvasAgg(sheet)
        canvas.draw()
        return np.asarray(canvas.buffer_rgba())[:, :, :3].astype(int)

    ours, theirs = drawn(Panel), drawn(Axes)
    inside = (slice(20, 312), slice(104, 468))  # labels and their place are drawn by other rules
    assert np.mean(np.any(ours[inside] != theirs[inside], axis=2)) < 2e-3
    assert np.mean(np.any(ours != theirs, axis=2)) < 0.02
    assert np.any(ours != 255)
