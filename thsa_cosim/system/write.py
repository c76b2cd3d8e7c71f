"""Write a system as an SSP 1.0 archive that other tools open."""

import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from thsa_cosim.fmu.description import DefaultExperiment
from thsa_cosim.fmu.variable import Variable
from thsa_cosim.ssv import SSC, SSV
from thsa_cosim.system.description import SystemDescription
from thsa_cosim.system.ssp import ANNOTATION, ROOT, SSD
from thsa_cosim.system.structure import Component, System

_TYPES = {"Real": "Real", "Boolean": "Boolean", "String": "String", "Enumeration": "Enumeration"}
_DATE = (1980, 1, 1, 0, 0, 0)


def write_ssp(system: System, fmus: Mapping[str, bytes], path: Path, experiment: DefaultExperiment) -> Path:
    """Write a checked system to ``path`` and return it; ``fmus``: the archives of its components by source.

    The file appears only when it is complete, and the same system gives the same bytes.
    """
    entries = {ROOT: _structure(system, experiment)}
    entries |= {component.source: fmus[component.source] for component in system.components}
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(path.name + ".part")
    with zipfile.ZipFile(partial, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(entries):
            entry = zipfile.ZipInfo(name, date_time=_DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, entries[name])
    partial.replace(path)
    return path


def write_halved(description: SystemDescription, path: Path) -> Path:
    """Write the same system with half the communication steps of its coupled components."""
    system = replace(
        description.system,
        components=tuple(
            replace(c, step=0.5 * c.step) if c.execution == "coupled" and c.step is not None else c
            for c in description.system.components
        ),
    )
    with zipfile.ZipFile(description.path) as archive:
        fmus = {c.source: archive.read(c.source) for c in system.components}
    return write_ssp(system, fmus, path, description.default_experiment)


def _structure(system: System, experiment: DefaultExperiment) -> bytes:
    for prefix, space in (("ssd", SSD), ("ssc", SSC), ("ssv", SSV)):
        ET.register_namespace(prefix, space)
    root = ET.Element(
        f"{{{SSD}}}SystemStructureDescription",
        {"version": "1.0", "name": system.name, "generationTool": "thsa-cosim"},
    )
    whole = _sub(root, SSD, "System", name=system.name)
    if system.connectors:
        connectors = _sub(whole, SSD, "Connectors")
        for connector in system.connectors:
            variable = system.variable(connector.pins[0][0])
            _connector(connectors, connector.name, connector.causality, variable, connector.unit)
    elements = _sub(whole, SSD, "Elements")
    for component in system.components:
        _component(elements, component)
    links = _sub(whole, SSD, "Connections")
    if system.coupling_tolerance is not None:
        _annotate(whole, "Coupling", {"tolerance": repr(system.coupling_tolerance)})
    for connector in system.connectors:
        for (element, name), factor, offset in connector.pins:
            inner = {"Element": element, "Connector": name}
            outer = {"Connector": connector.name}
            start, end = (inner, outer) if connector.causality == "output" else (outer, inner)
            _link(links, start, end, factor, offset)
    for connection in system.connections:
        start = dict(zip(("Element", "Connector"), connection.source, strict=True))
        end = dict(zip(("Element", "Connector"), connection.target, strict=True))
        _link(links, start, end, connection.factor, connection.offset, connection.disturbance)
    if experiment.stop is not None:
        _sub(
            root,
            SSD,
            "DefaultExperiment",
            startTime=repr(experiment.start or 0.0),
            stopTime=repr(experiment.stop),
        )
    ET.indent(root)
    body: bytes = ET.tostring(root, encoding="utf-8")
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + body + b"\n"


def _sub(parent: ET.Element, space: str, tag: str, **attributes: str) -> ET.Element:
    return ET.SubElement(parent, f"{{{space}}}{tag}", attributes)


def _connector(parent: ET.Element, name: str, kind: str, variable: Variable, unit: str | None) -> None:
    element = _sub(parent, SSD, "Connector", name=name, kind=kind)
    if variable.is_float:
        typed = _sub(element, SSC, "Real")
        if unit:
            typed.set("unit", unit)
    elif variable.type in ("Boolean", "String"):
        _sub(element, SSC, variable.type)
    else:
        _sub(element, SSC, "Integer")


def _component(parent: ET.Element, component: Component) -> None:
    implementation = "ModelExchange" if component.execution == "continuous" else "CoSimulation"
    if component.fmu.supports_co_simulation and component.fmu.supports_model_exchange:
        implementation = "any"
    element = _sub(
        parent,
        SSD,
        "Component",
        name=component.name,
        type="application/x-fmu-sharedlibrary",
        source=component.source,
        implementation=implementation,
    )
    connectors = _sub(element, SSD, "Connectors")
    for variable in component.fmu.variables.values():
        if variable.causality in ("input", "output") and not variable.is_alias:
            _connector(connectors, variable.name, variable.causality, variable, variable.unit)
    if component.start:
        bindings = _sub(element, SSD, "ParameterBindings")
        values = _sub(_sub(bindings, SSD, "ParameterBinding"), SSD, "ParameterValues")
        parameters = _sub(_sub(values, SSV, "ParameterSet", version="1.0", name="start"), SSV, "Parameters")
        for name, value in component.start.items():
            kind = component.fmu.variable(name)
            number = _sub(parameters, SSV, "Parameter", name=name)
            if kind.type == "Boolean":
                _sub(number, SSV, "Boolean", value="true" if value else "false")
            elif kind.is_float:
                _sub(number, SSV, "Real", value=repr(float(value)))
            else:
                _sub(number, SSV, "Integer", value=str(round(value)))
    how: dict[str, str] = {"kind": component.execution}
    if component.step is not None:
        how["step"] = repr(component.step)
    if component.delay:
        how["delay"] = repr(component.delay)
    if component.jitter:
        how["jitter"] = repr(component.jitter)
    if component.process == "own":
        how["process"] = "own"
    _annotate(element, "Execution", how)


def _annotate(element: ET.Element, tag: str, attributes: dict[str, str]) -> None:
    """Say in an annotation what SSP has no words for; other tools skip it."""
    annotation = _sub(_sub(element, SSD, "Annotations"), SSC, "Annotation", type=ANNOTATION)
    ET.SubElement(annotation, tag, attributes)


def _link(
    parent: ET.Element,
    start: Mapping[str, str],
    end: Mapping[str, str],
    factor: float,
    offset: float,
    disturbance: str = "",
) -> None:
    attributes = {f"start{k}": v for k, v in start.items()} | {f"end{k}": v for k, v in end.items()}
    element = _sub(parent, SSD, "Connection", **attributes)
    element.set("suppressUnitConversion", "true")  # the factor holds it already
    if factor != 1.0 or offset != 0.0:
        _sub(element, SSC, "LinearTransformation", factor=repr(factor), offset=repr(offset))
    if disturbance:
        _annotate(element, "Disturbance", {"name": disturbance})
