"""What a person sees on a study's page, in headless Chromium: plots, tables, colours, print, hostile names."""

import json
import re
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import report_studies as studies

from thsa_cosim.batch import Journal
from thsa_cosim.report.page import follow, write_page
from thsa_cosim.study import claim_folder

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
FLAGS = (
    "--no-sandbox",
    "--disable-gpu",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-sync",
)
playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium was found")

Show = Callable[..., Any]
#: Plotly names them g-xtitle, g-x2title, g-ytitle, …
AXIS_TITLE = "[class^='g-x'][class$='title'] text, [class^='g-y'][class$='title'] text"


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with playwright.sync_playwright() as driver:
        opened = driver.chromium.launch(executable_path=CHROMIUM, args=[*FLAGS, "--disable-component-update"])
        yield opened
        opened.close()


@pytest.fixture(scope="module")
def show(browser: Any) -> Iterator[Show]:
    """Open a page's file; wait until every plot that is not folded away is drawn. Errors end up in ``troubles``."""
    contexts = []

    def opened(path: Path, **options: Any) -> Any:
        context = browser.new_context(
            **{"viewport": {"width": 1280, "height": 900}, "offline": True, **options}
        )
        contexts.append(context)
        page = context.new_page()
        page.troubles = []
        page.on("console", lambda m: page.troubles.append(m.text) if m.type in ("error", "warning") else None)
        page.on("pageerror", lambda error: page.troubles.append(str(error)))
        page.on(
            "request", lambda r: None if r.url.startswith(("file:", "data:")) else page.troubles.append(r.url)
        )
        page.goto(path.as_uri())
        if options.get("java_script_enabled", True):
            page.wait_for_selector("html[data-drawn=all]", state="attached")
        return page

    yield opened
    for context in contexts:
        context.close()


@pytest.fixture(scope="module")
def identified(show: Show, tmp_path_factory: pytest.TempPathFactory) -> Any:
    folder = tmp_path_factory.mktemp("identify")
    studies.write_identify(folder / "study")
    page = show(write_page(folder / "study"))
    folds = page.query_selector_all("details")
    page.folds = {d.query_selector("summary").inner_text(): d.get_attribute("open") for d in folds}
    return page


@pytest.fixture(scope="module")
def tuned(show: Show, tmp_path_factory: pytest.TempPathFactory) -> Any:
    folder = tmp_path_factory.mktemp("tune")
    studies.write_tune(folder / "study")
    return show(write_page(folder / "study"))


@pytest.fixture(scope="module")
def diagnosed(show: Show, tmp_path_factory: pytest.TempPathFactory) -> Any:
    folder = tmp_path_factory.mktemp("diagnose")
    studies.write_diagnose(folder / "study")
    return show(write_page(folder / "study"))


def unfold(page: Any) -> None:
    """Open every fold and wait for what is inside."""
    for fold in page.query_selector_all("details:not([open]) > summary"):
        fold.click()
    for plot in page.query_selector_all(".plot"):
        page.wait_for_selector(f'.plot[data-drawn][id="{plot.get_attribute("id")}"]')


def plots(page: Any) -> dict[str, Any]:
    unfold(page)
    return {plot.get_attribute("id"): plot for plot in page.query_selector_all(".plot")}


def axis_titles(plot: Any) -> list[str]:
    return [title.text_content() for title in plot.query_selector_all(AXIS_TITLE)]


def cells(table: Any, column: str) -> list[str]:
    headings = [h.inner_text() for h in table.query_selector_all("th")]
    k = next(i for i, text in enumerate(headings) if text.startswith(column)) + 1
    return [cell.inner_text() for cell in table.query_selector_all(f"tbody td:nth-child({k})")]


def table_of(page: Any, caption: str) -> Any:
    return next(
        t for t in page.query_selector_all("table") if t.query_selector("caption").inner_text() == caption
    )


def test_summary_comes_first_and_says_what_came_out_and_how_sure_it_is(identified: Any) -> None:
    sections = [s.get_attribute("id") for s in identified.query_selector_all("section")]
    assert sections[0] == "summary"
    text = identified.inner_text("#summary")
    assert text.split("\n")[2].startswith(
        "Found R_s and T_fm, 1 value of them not determined by the data, but the model"
    )
    details = identified.inner_text("#details")
    assert "Find R_s and T_fm of Motor.fmu at 2 temperatures (−30 °C to 25 °C) from 2 recordings" in details
    assert "0.5000 ± 0.0050" in text
    assert "1.900 ± 0.019" in text
    assert "1 of 4 values are not determined by the data: T_fm at −30 °C" in details
    assert "6.0" in text or "6 ×" in text  # rmse 0.3 A against 0.05 A
    assert "the model does not explain the recordings" in details
    assert "48 evaluations, 6 failed." in details


def test_every_plot_is_drawn_with_units_on_its_axes_and_nothing_complains(
    identified: Any, tuned: Any
) -> None:
    expected = (
        {"laws", "fit-run_-30", "fit-run_25", "convergence", "costs", "coordinates-0", "coordinates-1"},
        {"response-T_amb_-30_degC", "surface", "pareto", "convergence", "costs", "coordinates-0"},
    )
    for page, names in zip((identified, tuned), expected, strict=True):
        found = plots(page)
        assert set(found) == names
        for name, plot in found.items():
            assert plot.query_selector_all(".scatterlayer .trace path, .contourlayer path"), name
            box = plot.bounding_box()
            assert box["width"] > 800, name
            assert box["height"] > 250, name
            titles = axis_titles(plot)
            assert len(titles) > (-1 if name.startswith("coordinates") else 1), name
            assert all(re.search(r"\[.+\]$", title) for title in titles), (name, titles)
        assert page.troubles == []


PANELS = """p => Object.values(p._fullLayout._plots).map(({xaxis, yaxis}) => {
  const box = p.getBoundingClientRect();
  return {x: box.x + xaxis._offset, y: box.y + yaxis._offset, width: xaxis._length, height: yaxis._length};
})"""


def overlap(a: dict[str, float], b: dict[str, float]) -> bool:
    """Whether two boxes share more than a pixel's breadth."""
    apart_x = a["x"] >= b["x"] + b["width"] - 1 or b["x"] >= a["x"] + a["width"] - 1
    apart_y = a["y"] >= b["y"] + b["height"] - 1 or b["y"] >= a["y"] + a["height"] - 1
    return not (apart_x or apart_y)


def test_titles_and_labels_overlap_neither_each_other_nor_a_panel(
    identified: Any, tuned: Any, diagnosed: Any
) -> None:
    for page in (identified, tuned, diagnosed):
        for name, plot in plots(page).items():
            texts = plot.query_selector_all(f"{AXIS_TITLE}, .annotation text, .legendtext")
            boxes = [(t.text_content(), t.evaluate("t => t.getBoundingClientRect().toJSON()")) for t in texts]
            panels = [(f"panel {k}", box) for k, box in enumerate(plot.evaluate(PANELS))]
            for k, (first, a) in enumerate(boxes):
                for second, b in (*boxes[:k], *panels):
                    assert not overlap(a, b), (name, first, second)


def test_diagnosis_shows_verdict_attribution_structure_and_what_was_weighed(diagnosed: Any) -> None:
    page = diagnosed
    summary = page.inner_text("#summary")
    assert (
        "The model lacks backlash (Backlash of the screw). Adding it lowers the error on held-out" in summary
    )
    details = page.inner_text("#details")
    assert "Find the physical effect that THSA.fmu lacks" in details
    assert "THSA_with_backlash.mo, THSA_with_backlash.fmu" in summary
    assert "fmus/THSA.fmu, SHA-256 aaaa" in page.inner_text("#provenance")
    assert "(2.50 ± 0.10)e-4" in summary
    assert "These recordings cannot distinguish backlash from velocity-sensor-delay." in summary
    assert (
        "Record slow reversals under no load (experiment.csv). It separates backlash and velocity-sensor-delay: the"
        " squared difference of the two fitted models is 232 times that in these recordings." in summary
    )
    assert "largest error falls from 5 × the sensor's noise to 1.05 × noise" in details
    assert "2 % of the repeatable residual is left in the worst signal." in summary
    errors = table_of(page, "Errors before and after")
    assert cells(errors, "after / noise") == ["1.05", "1.05"]
    assert cells(errors, "unit") == ["m/s", "m/s"]
    assert cells(table_of(page, "The residual by balance equation"), "at fault") == ["yes", "no"]
    alike = table_of(page, "Effects that would look alike in these recordings")
    assert cells(alike, "effects") == ["stribeck:motor and stribeck:gearbox"]
    assert cells(alike, "principal angle [deg]") == ["0.82"]
    law = table_of(page, "Empirical law of the unexplained residual ± one standard error")
    assert cells(law, "slot") == ["screw", "motor"]
    assert cells(law, "coefficient") == ["0.0310 ± 0.0020", "(2.00 ± 0.10)e-6"]
    found = plots(page)
    scored = table_of(page, "Effects that were fitted and scored on held-out recordings")
    assert cells(scored, "decision") == ["accepted", "rejected"]
    assert cells(table_of(page, "Effects whose predicted gain was too small to fit them"), "effect") == [
        "windage"
    ]
    assert cells(table_of(page, "Effects that these recordings cannot test"), "effect") == [
        "winding-self-heating"
    ]
    assert set(found) == {
        "evidence",
        "balance",
        "ratios",
        "dependence",
        "dependence-0",
        "dependence-1",
        "fit-fit_1",
        "validate-validate_1",
    }
    assert len(found["balance"].query_selector_all(".barlayer .point path")) == 2
    # Each channel's clearest dependence stands out, the others are below in order.
    assert axis_titles(found["dependence"]) == ["u_q [V]", "x [m]", "v [m/s]", "i_q [A]"]
    order = axis_titles(found["dependence-0"])[:7]
    assert order == ["u_q [V]", "i_q [A]", "w_m [rad/s]", "x [m]", "F_load [N]", "v_cmd [m/s]", "time [s]"]
    names = found["fit-fit_1"].evaluate("p => p._fullData.map(t => t.name)")
    assert names == ["measured", "before", "after", "residual before", "residual after"]
    assert page.troubles == []


def test_single_wrong_sample_of_thousands_is_in_the_plot(identified: Any) -> None:
    plot = plots(identified)["fit-run_25"]
    drawn = plot.evaluate("p => p._fullData.filter(t => t.name === 'residual').map(t => Math.min(...t.y))")
    assert drawn[0] == pytest.approx(-studies.SPIKE, abs=0.3)
    assert plot.evaluate("p => p._fullData[0].x.length") < 3000


def test_worst_recording_is_open_and_the_others_are_folded(identified: Any) -> None:
    folds = {title: state for title, state in identified.folds.items() if title.startswith("run")}
    assert folds == {"run_-30 (fitted, −30 °C)": None, "run_25 (fitted, 25 °C)": ""}


def test_click_on_a_heading_sorts_by_number_and_again_the_other_way(tuned: Any, identified: Any) -> None:
    table = table_of(identified, "Errors by recording and signal")
    heading = next(h for h in table.query_selector_all("th") if h.inner_text().startswith("temperature"))
    assert heading.get_attribute("aria-sort") is None
    heading.query_selector("button").click()
    assert cells(table, "temperature") == ["−30", "25"]
    assert heading.get_attribute("aria-sort") == "ascending"
    heading.query_selector("button").click()
    assert cells(table, "temperature") == ["25", "−30"]
    table = table_of(tuned, "Before and after")
    heading = next(h for h in table.query_selector_all("th") if h.inner_text().startswith("before"))
    for _ in range(2):
        heading.query_selector("button").click()
        order = cells(table, "before")
        # By value, not by letters (2977 is after 8); what has no value stays last either way.
        numbers = [float(text.replace("∞", "inf")) for text in order if text != "–"]
        assert len(numbers) > 5
        assert numbers in (sorted(numbers), sorted(numbers)[::-1])
        assert "–" not in order[: len(numbers)]


def test_tuning_shows_gains_requirements_line_and_what_was_broken_before(tuned: Any) -> None:
    text = tuned.inner_text("#summary")
    assert "Found: K_p = 0.4 A/(rad/s) and K_i = 3 A/rad; 2 of 2 requirements are met." in text
    assert "Note: K_i ends at its upper bound" in tuned.inner_text("#details")
    assert "K_p/K_i = 0.125 (middle half 0.11 to 0.14); published: 0.1218." in tuned.inner_text("#plane")
    table = table_of(tuned, "Before and after")
    row = next(r for r in table.query_selector_all("tbody tr") if r.inner_text().startswith("overshoot"))
    assert [c.get_attribute("class").split()[-1] for c in row.query_selector_all("td.number")] == [
        "bad",
        "good",
        "good",
    ]
    names = plots(tuned)["surface"].evaluate("p => p._fullData.filter(t => t.showlegend).map(t => t.name)")
    assert {"breaks a hard requirement", "before", "after", "article", "generation 0", "generation 3"} <= set(
        names
    )


HOSTILE = "<img src=x onerror='document.title=\"owned\"'><b>&amp;${x}%{y}</script><script>document.title='x'</script>"


def test_hostile_names_are_shown_as_they_are_written(show: Show, tmp_path: Path) -> None:
    studies.write_identify(tmp_path, title=HOSTILE, channel=HOSTILE, parameter=HOSTILE)
    page = show(write_page(tmp_path))
    assert page.title() == HOSTILE
    assert page.inner_text("h1") == HOSTILE
    assert cells(table_of(page, "Errors by recording and signal"), "signal") == [HOSTILE] * 2
    for name, plot in plots(page).items():
        if name.startswith("coordinates"):
            ticks = plot.eval_on_selector_all(".xtick text", "all => all.map(t => t.textContent)")
            assert any(HOSTILE in text.replace("% {", "%{") for text in ticks), name
        elif name not in ("convergence", "costs"):
            shown = "".join(axis_titles(plot)).replace("% {", "%{")
            assert HOSTILE in shown, name
    assert not page.query_selector_all("img, b, svg image[href=x]")
    assert page.troubles == []


def test_policy_stops_a_script_even_if_one_slipped_through(show: Show, tmp_path: Path) -> None:
    studies.write_tune(tmp_path)
    path = write_page(tmp_path)
    path.write_text(path.read_text().replace("<main>", "<main><script>document.title='owned'</script>"))
    page = show(path)
    assert page.title() == "gains"
    assert any("Content Security Policy" in text for text in page.troubles)


def colours(page: Any) -> tuple[str, str, str]:
    """Background, ink, and the colour of an axis title."""
    title = page.query_selector(".g-xtitle text")
    return (
        page.evaluate("getComputedStyle(document.body).backgroundColor"),
        page.evaluate("getComputedStyle(document.body).color"),
        title.evaluate("t => getComputedStyle(t).fill"),
    )


def luminance(colour: str) -> float:
    """Relative luminance (WCAG 2.2) of ``rgb(r, g, b)``."""
    shares = [int(n) / 255.0 for n in re.findall(r"\d+", colour)[:3]]
    linear = [s / 12.92 if s <= 0.04045 else ((s + 0.055) / 1.055) ** 2.4 for s in shares]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(a: str, b: str) -> float:
    low, high = sorted((luminance(a), luminance(b)))
    return (high + 0.05) / (low + 0.05)


def test_light_and_dark_are_legible_and_plots_follow_a_change(tuned: Any) -> None:
    seen = {}
    for scheme in ("light", "dark"):
        tuned.emulate_media(color_scheme=scheme)
        tuned.wait_for_timeout(400)
        paper, ink, axis = seen[scheme] = colours(tuned)
        assert min(contrast(paper, ink), contrast(paper, axis)) > 7.0, (scheme, seen)
        for selector in ("td.bad", "td.good", "th", "figcaption", "a"):
            colour = tuned.query_selector(selector).evaluate("e => getComputedStyle(e).color")
            assert contrast(paper, colour) > 4.5, (scheme, selector)
    tuned.emulate_media(color_scheme="light")
    assert luminance(seen["light"][0]) > 0.9 > 0.1 > luminance(seen["dark"][0])


def test_without_javascript_tables_are_there_and_plots_are_not_promised(show: Show, tmp_path: Path) -> None:
    studies.write_identify(tmp_path)
    page = show(write_page(tmp_path), java_script_enabled=False)
    assert "Plots need JavaScript" in page.inner_text("header")
    assert cells(table_of(page, "Errors by recording and signal"), "rmse / noise") == ["1.00", "6.00"]
    assert page.query_selector(".plot").bounding_box() is None
    assert page.query_selector("#parameters table").is_visible()


def test_printing_opens_folds_and_leaves_the_page_as_it_was(show: Show, tmp_path: Path) -> None:
    studies.write_identify(tmp_path)
    page = show(write_page(tmp_path), color_scheme="dark")
    before = colours(page)
    page.evaluate(
        """() => addEventListener('beforeprint', () => {
          window.printed = {
            folded: document.querySelectorAll('details:not([open])').length,
            empty: [...document.querySelectorAll('.plot')].filter((p) => !p.querySelector('.trace')).length,
            ink: getComputedStyle(document.body).color,
            widest: Math.max(...[...document.querySelectorAll('.main-svg')].map((svg) => svg.width.baseVal.value)),
          };
        })"""
    )
    pdf = page.pdf(format="A4")
    assert pdf.startswith(b"%PDF")
    printed = page.evaluate("window.printed")
    assert (printed["folded"], printed["empty"]) == (0, 0)
    assert printed["widest"] < 210 / 25.4 * 96  # A4
    assert contrast(printed["ink"], "rgb(255, 255, 255)") > 7.0
    assert len(page.query_selector_all("details:not([open])")) == 2
    assert colours(page) == before
    assert page.query_selector(".main-svg").bounding_box()["width"] > 1000


#: Boxes of the visible texts of a plot that overlap, as pairs of texts; a pixel of touching is none.
OVERLAPS = """plot => {
  const texts = [...plot.querySelectorAll('.infolayer text, .xtick text, .ytick text')]
    .filter(t => t.textContent.trim() && !t.closest('.hoverlayer') && t.getBoundingClientRect().width > 0);
  const boxes = texts.map(t => [t.textContent, t.getBoundingClientRect()]);
  const found = [];
  for (let i = 0; i < boxes.length; i++) for (let k = i + 1; k < boxes.length; k++) {
    const [a, b] = [boxes[i][1], boxes[k][1]];
    const wide = Math.min(a.right, b.right) - Math.max(a.left, b.left);
    const high = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
    if (wide > 2 && high > 3) found.push([boxes[i][0], boxes[k][0]]);
  }
  return found;
}"""


@pytest.mark.parametrize("width", [1280, 390])
@pytest.mark.parametrize("kind", ["identify", "tune", "diagnose"])
def test_nothing_overlaps_and_nothing_is_wider_than_the_screen(
    show: Show, tmp_path: Path, kind: str, width: int
) -> None:
    getattr(studies, f"write_{kind}")(tmp_path / "study")
    page = show(write_page(tmp_path / "study"), viewport={"width": width, "height": 900})
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    for name, plot in plots(page).items():
        assert plot.evaluate(OVERLAPS) == [], name
        inside = plot.evaluate("p => p.querySelector('.main-svg').getBoundingClientRect().right")
        assert inside <= width, name
    assert page.troubles == []


def test_first_screen_of_a_diagnosis_argues(diagnosed: Any) -> None:
    blocks = diagnosed.eval_on_selector_all("#summary > *", "all => all.map(e => e.className || e.tagName)")
    assert blocks[:3] == ["H2", "lead bad", "FIGURE"]
    assert diagnosed.query_selector("#summary .plot").get_attribute("id") == "evidence"
    text = diagnosed.inner_text("#summary")
    assert "Errors before → after, as multiples of the noise" in text
    assert "Use the extended model" in text


def test_cursor_tells_values_with_units(identified: Any) -> None:
    plot = plots(identified)["fit-run_25"]
    layout = plot.evaluate("p => [p._fullLayout.hovermode, p._fullLayout.xaxis.unifiedhovertitle.text]")
    assert layout == ["x unified", "time %{x:.5g} s"]
    assert plot.evaluate("p => new Set(p.data.map(t => t.xaxis)).size") == 1
    assert set(plot.evaluate("p => p.data.map(t => t.hovertemplate)")) == {"%{y:.5g} A"}
    laws = plots(identified)["laws"].evaluate("p => p.data.map(t => t.hovertemplate || '')")
    assert any("temperature %{x:.5g} °C<br>identified %{y:.5g} ± %{customdata:.2g} ohm" in t for t in laws)


def test_running_study_shows_how_far_it_is(show: Show, tmp_path: Path) -> None:
    labels = ["-30 degC", "25 degC"]
    claim_folder(
        tmp_path,
        studies.identity("identify"),
        studies.about(parameters={"R_s": "ohm"}, samples=dict.fromkeys(labels, 10)),
    )
    studies.write_journal(tmp_path, labels, ["R_s"], ["i_q"], generations=2)
    with (tmp_path / "journal.csv").open("a") as file:
        file.write("-30 degC,13,0.5,1")  # a line that is being written
    with Journal.open(tmp_path / "journal.csv", ["R_s"], ["i_q"]):
        page = show(write_page(tmp_path))
    assert page.inner_text(".status") == "running"
    summary = page.inner_text("#summary")
    assert "Find R_s of Motor.fmu" in summary
    assert "24 vectors evaluated of at most 48 in 2 searches, 4 failed so far." in summary
    assert cells(table_of(page, "How far the searches are"), "generation") == ["1", "1"]
    assert cells(table_of(page, "Failed evaluations by reason"), "evaluations") == ["4"]
    assert plots(page)["convergence"].query_selector_all(".trace")
    assert page.troubles == []


def test_live_page_follows_a_study_to_its_end(show: Show, tmp_path: Path) -> None:
    """While the study runs the browser loads the page anew; the last page does not, and says what came out."""
    names, study = ["R_s", "psi_pm"], tmp_path / "study"
    labels = ["-30 degC"]
    about = studies.about(parameters=dict.fromkeys(names, "1"), samples=dict.fromkeys(labels, 10))
    claim_folder(study, studies.identity("identify"), about)
    studies.write_journal(study, labels, names, ["i_q"], generations=2)
    journal = Journal.open(study / "journal.csv", names, ["i_q"])
    texts: list[str] = []

    def finish(_: float) -> None:
        texts.append((study / "report.html").read_text())
        journal.close()
        result = studies.identify_result()
        (study / "result.json").write_text(json.dumps(result))

    pages = list(follow(study, sleep=finish))
    assert len(texts) == 1
    assert pages == [study / "report.html"] * 2
    assert '<meta http-equiv="refresh" content="5">' in texts[0]
    (tmp_path / "running.html").write_text(texts[0].replace('http-equiv="refresh"', "", 1))
    running = show(tmp_path / "running.html", viewport={"width": 390, "height": 900})
    best = table_of(running, "Best vector of each search so far")
    assert cells(best, "evaluations") == ["12"]
    assert cells(best, "failed") == ["2"]
    drawn = plots(running)
    assert {"costs", "coordinates-0"} <= set(drawn)
    labelled = drawn["coordinates-0"].eval_on_selector_all(
        ".xtick text", "all => all.map(t => t.textContent)"
    )
    assert [text.split("0")[0][:3] for text in labelled] == ["R_s", "psi", "cos"]
    assert running.troubles == []
    assert "refresh" not in (study / "report.html").read_text().split("</title>")[0]
