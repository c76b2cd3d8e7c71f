"""Friction surfaces: what the identified laws mean over speed and temperature (equation 5, figures 7 and 8)."""

import numpy as np

from thsa_cosim.report.friction import ELEMENTS, Element, surface
from thsa_cosim.report.page.chart import Chart, packed, plain
from thsa_cosim.report.page.content import Figure, Section
from thsa_cosim.report.page.folder import Json
from thsa_cosim.report.page.parameters import read_law

STEPS = 41


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
    return drawn.build(f"Friction of the {element.title} by the identified laws, at its own speed.")
