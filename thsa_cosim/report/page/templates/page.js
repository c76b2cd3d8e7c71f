"use strict";
(() => {
  const root = document.documentElement;
  const figures = JSON.parse(document.getElementById("figures").textContent);
  const drawn = new Set();
  // CSS pixels that fit on A4 and Letter between usual margins.
  const PAPER_WIDTH = 680;

  // ---- plots: colours are names of the style sheet, looked up when a plot is drawn ----
  const resolve = (value, styles) => {
    if (typeof value === "string") {
      return value.startsWith("var(--") ? styles.getPropertyValue(value.slice(4, -1)).trim() : value;
    }
    if (Array.isArray(value)) return value.map((item) => resolve(item, styles));
    if (value && typeof value === "object") {
      return Object.fromEntries(Object.entries(value).map(([key, item]) => [key, resolve(item, styles)]));
    }
    return value;
  };
  const theme = (styles) => {
    const ink = styles.getPropertyValue("--ink").trim();
    const rule = styles.getPropertyValue("--rule").trim();
    const axis = { gridcolor: rule, zerolinecolor: rule, linecolor: rule, showline: true, ticks: "outside", tickcolor: rule, exponentformat: "e", title: { font: { size: 13 } } };
    return {
      font: { color: ink, family: getComputedStyle(document.body).fontFamily, size: 13 },
      paper_bgcolor: "rgba(0,0,0,0)",
      plot_bgcolor: "rgba(0,0,0,0)",
      hoverlabel: { bgcolor: styles.getPropertyValue("--raised").trim(), font: { color: ink } },
      hovermode: "closest",
      modebar: { bgcolor: "rgba(0,0,0,0)", color: rule, activecolor: ink },
      annotationdefaults: { font: { color: ink, size: 13 } },
      xaxis: axis,
      yaxis: axis,
    };
  };
  // ---- on a narrow screen panels stand below each other, each as wide as the screen ----
  const NARROW = 640;
  const stack = (figure) => {
    const layout = figure.layout;
    const panels = Object.keys(layout).filter((key) => /^yaxis\d*$/.test(key)).map((key) => {
      const y = layout[key];
      const x = layout["xaxis" + (y.anchor || "x").slice(1)];
      return { x, y, used: figure.data.some((trace) => (trace.yaxis || "y") === key.replace("axis", "")) };
    }).filter((panel) => panel.x && panel.x.domain && panel.y.domain);
    const columns = new Set(panels.map((panel) => panel.x.domain[0])).size;
    const named = figure.data.filter((trace) => trace.showlegend).length;
    const legend = 22 * named;  // one name a line, at worst
    Object.assign(layout.margin, { l: 64, r: 12 });
    if (named) layout.margin.t = 40 + legend;
    if (columns > 1) {
      const shown = panels.filter((panel) => panel.used);
      shown.sort((a, b) => b.y.domain[1] - a.y.domain[1] || a.x.domain[0] - b.x.domain[0]);
      const [high, gap] = [190, 84];
      const total = shown.length * high + (shown.length - 1) * gap;
      shown.forEach((panel, k) => {
        const top = 1 - (k * (high + gap)) / total;
        panel.x.domain = [0, 1];
        panel.y.domain = [Math.max(0, top - high / total), top];
      });
      for (const panel of panels) if (!panel.used) { panel.x.visible = false; panel.y.visible = false; }
      layout.height = total + layout.margin.t + layout.margin.b + 8;
    } else {
      layout.height += named ? legend : 0;
    }
    if (layout.legend) Object.assign(layout.legend, { orientation: "v", yref: "container", y: 1, yanchor: "top" });
    const bars = figure.data.some((trace) => trace.type === "bar");  // every bar keeps its name, upright
    for (const axis of panels.flatMap((panel) => (bars ? [panel.y] : [panel.x, panel.y]))) axis.nticks = 5;
    if (bars) {
      for (const panel of panels) panel.x.tickangle = -90;
      layout.height += 80;
    }
    for (const axis of panels.map((panel) => panel.x)) delete axis.dtick;
    for (const note of layout.annotations || []) {
      note.font = { size: 11 };
      if (note.text.length > 44) note.text = note.text.replace(", ", ",<br>");
    }
    if ((layout.annotations || []).some((note) => note.text.includes("<br>"))) layout.margin.t += 16;
  };
  const draw = (place) => {
    const styles = getComputedStyle(root);
    const figure = resolve(figures[place.id], styles);
    figure.layout.template = { layout: theme(styles) };
    if (!root.classList.contains("printing") && place.clientWidth < NARROW) stack(figure);
    place.style.height = `${figure.layout.height}px`;
    if (root.classList.contains("printing")) figure.layout.width = PAPER_WIDTH;
    drawn.add(place);
    const options = { responsive: true, displaylogo: false, modeBarButtonsToRemove: ["select2d", "lasso2d"] };
    return Plotly.react(place, figure.data, figure.layout, options).then(() => { place.dataset.drawn = "yes"; });
  };
  const places = [...document.querySelectorAll(".plot")];
  const hidden = (place) => place.offsetWidth === 0;
  const idle = window.requestIdleCallback || ((task) => setTimeout(task, 30));
  // One plot at a time, from the top, so that the page can be read at once.
  const drawNext = () => {
    const next = places.find((place) => !drawn.has(place) && !hidden(place));
    if (next) {
      draw(next).then(() => idle(drawNext));
    } else {
      root.dataset.drawn = "all";
    }
  };
  idle(drawNext);
  for (const fold of document.querySelectorAll("details")) {
    fold.addEventListener("toggle", () => {
      if (fold.open) idle(drawNext);
    });
  }
  matchMedia(`(max-width: ${NARROW}px)`).addEventListener("change", () => drawn.forEach(draw));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => drawn.forEach(draw));

  // ---- paper is white and shows everything ----
  let closed = [];
  addEventListener("beforeprint", () => {
    root.classList.add("printing");
    closed = [...document.querySelectorAll("details:not([open])")];
    closed.forEach((fold) => { fold.open = true; });
    places.forEach(draw);
  });
  addEventListener("afterprint", () => {
    root.classList.remove("printing");
    closed.forEach((fold) => { fold.open = false; });
    drawn.forEach((place) => {
      Plotly.purge(place);  // it would keep the paper's width
      if (hidden(place)) drawn.delete(place);
      else draw(place);
    });
  });

  // ---- tables sort by a click on a heading; cells without a value stay last ----
  const compare = (a, b) => {
    const [x, y] = [Number(a), Number(b)];
    return Number.isNaN(x) || Number.isNaN(y) ? a.localeCompare(b) : x - y;
  };
  const sort = (heading, column) => {
    const body = heading.closest("table").tBodies[0];
    const descending = heading.getAttribute("aria-sort") === "ascending";
    for (const other of heading.parentNode.cells) other.removeAttribute("aria-sort");
    heading.setAttribute("aria-sort", descending ? "descending" : "ascending");
    const key = (row) => row.cells[column].dataset.sort;
    const rows = [...body.rows].sort((a, b) => {
      const [x, y] = [key(a), key(b)];
      if (x === "" || y === "") return (x === "") - (y === "");
      return descending ? compare(y, x) : compare(x, y);
    });
    body.append(...rows);
  };
  for (const heading of document.querySelectorAll("thead th")) {
    const button = document.createElement("button");
    button.type = "button";
    button.title = "Sort by this column";
    button.append(...heading.childNodes);
    heading.append(button);
    button.addEventListener("click", () => sort(heading, heading.cellIndex));
  }
})();
