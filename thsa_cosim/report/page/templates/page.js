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
  const draw = (place) => {
    const styles = getComputedStyle(root);
    const figure = resolve(figures[place.id], styles);
    figure.layout.template = { layout: theme(styles) };
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
