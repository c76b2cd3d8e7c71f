"""Friction over speed and temperature: equation 5 of the article with the identified laws, as table, plot and section.

On this rig F_f = F_C + b_v |v|; figures 7 and 8 of the article show such surfaces.
"""

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.identify.results import LawResult
from thsa_cosim.laws import Law
from thsa_cosim.report.folder import Json
from thsa_cosim.report.identify.parameters import read_law
from thsa_cosim.report.parts.chart import Chart, packed, plain
from thsa_cosim.report.parts.content import Figure, Section

STEPS = 41
"""Speeds and temperatures of a surface on the page."""

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Element:
    """A sliding pair: its Coulomb and viscous parameters by name, and the speeds of the rig, up to ``fastest``."""

    title: str
    coulomb: str
    viscous: str
    fastest: float
    unit: str


ELEMENTS = (
    Element("motor", "T_fm", "b_m", 180.0, "rad/s"),
    Element("gearbox", "T_fg", "b_g", 6.0, "rad/s"),
    Element("nut", "F_fn", "b_n", 9e-3, "m/s"),
)


def surface(coulomb: Law, viscous: Law, speed: FloatArray, temperature: FloatArray) -> FloatArray:
    """Friction (temperatures, speeds) for ``speed`` (m,) ≥ 0 and ``temperature`` (k,) in degC."""
    return np.asarray(coulomb(temperature)[:, None] + viscous(temperature)[:, None] * speed[None, :])


def write_friction(
    folder: Path, laws: Mapping[str, LawResult], low: float, high: float, steps: int = 33
) -> list[Path]:
    """Write a table per element whose two laws are known, between ``low`` and ``high`` degC."""
    written = []
    for element in ELEMENTS:
        if element.coulomb not in laws or element.viscous not in laws:
            continue
        unit = laws[element.coulomb].unit
        speed = np.linspace(0.0, element.fastest, steps)
        temperature = np.linspace(low, high, steps)
        values = surface(laws[element.coulomb].law, laws[element.viscous].law, speed, temperature)
        written.append(folder / f"friction_{element.title}.csv")
        _write_table(written[-1], element, unit, speed, temperature, values)
    return written


def _write_table(
    path: Path, element: Element, unit: str, speed: FloatArray, temperature: FloatArray, friction: FloatArray
) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["temperature_degC", f"speed [{element.unit}]", f"friction [{unit}]"])
        for i, t in enumerate(temperature.tolist()):
            for k, v in enumerate(speed.tolist()):
                writer.writerow([repr(t), repr(v), repr(float(friction[i, k]))])


def friction(result: Json, prefix: str = "") -> Section | None:
    """The section; None unless some element's Coulomb and viscous laws are both known."""
    laws: Json = result.get("laws", {})
    temperatures = [
        p["temperature_degC"] for p in result.get("points", []) if p["temperature_degC"] is not None
    ]
    known = [e for e in ELEMENTS if e.coulomb in laws and e.viscous in laws]
    if not temperatures or not known:
        return None
    span = min(temperatures), max(temperatures)
    figures = tuple(_figure(f"{prefix}friction-{e.title}", e, laws, span) for e in known)
    return Section(f"{prefix}friction", "Friction over speed and temperature", figures)


def _figure(name: str, element: Element, laws: Json, span: tuple[float, float]) -> Figure:
    speed, temperature = np.linspace(0.0, element.fastest, STEPS), np.linspace(*span, STEPS)
    values = surface(read_law(laws[element.coulomb]), read_law(laws[element.viscous]), speed, temperature)
    title = {
        "text": plain(f"friction [{laws[element.coulomb]['unit']}]"),
        "side": "right",
        "font": {"size": 13},
    }
    drawn = Chart(name, row_height=300)
    drawn.add(
        0,
        0,
        "",
        type="contour",
        x=packed(speed),
        y=packed(temperature),
        z=packed(values),
        ncontours=20,
        colorscale="Viridis",
        contours={"showlabels": True, "labelfont": {"color": "white", "size": 11}, "labelformat": "~g"},
        line={"width": 0.5, "color": "white"},
        colorbar={"tickformat": "~g", "title": title},
        hovertemplate="speed %{x:.3g}<br>temperature %{y:.3g} °C<br>friction %{z:.4g}<extra></extra>",
    )
    drawn.axes(x=f"speed [{element.unit}]", y="temperature [°C]")
    drawn.title(f"Friction of the {element.title}: {element.coulomb} + {element.viscous} |v|")
    return drawn.build(f"Friction of the {element.title} by the identified laws, over its own speed.")
