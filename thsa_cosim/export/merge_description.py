"""The model description of a merged system: the components' variables under ``<component>.<variable>``."""

import copy
import re
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence

from thsa_cosim.export.merge_layout import Glue, Member, input_starts
from thsa_cosim.fmu.description import DefaultExperiment
from thsa_cosim.system.structure import qualified

_FLAGS = {
    "canNotUseMemoryManagementFunctions": "true",
    "canGetAndSetFMUstate": "true",
    "canSerializeFMUstate": "true",
    "providesDirectionalDerivative": "true",
}


def merged_description(
    glue: Glue,
    documents: Sequence[ET.Element],
    config: str,
    guid: str,
    identifier: str,
    experiment: DefaultExperiment,
) -> bytes:
    """Text of ``modelDescription.xml`` (FMI 2.0); ``documents``: those of the components."""
    first = {name: int(value) for name, value in re.findall(r"#define (VR_\w+) (\d+)$", config, re.M)}
    root = ET.Element(
        "fmiModelDescription",
        {
            "fmiVersion": "2.0",
            "modelName": glue.system.name or identifier,
            "guid": guid,
            "generationTool": documents[0].get("generationTool", "thsa-cosim"),
            "variableNamingConvention": "structured",
            "numberOfEventIndicators": str(glue.places.total["G"]),
        },
    )
    ET.SubElement(root, "ModelExchange", {"modelIdentifier": identifier, **_FLAGS})
    co_simulation = {"canHandleVariableCommunicationStepSize": "true", "canInterpolateInputs": "true"}
    ET.SubElement(
        root,
        "CoSimulation",
        {"modelIdentifier": identifier, **co_simulation, "maxOutputDerivativeOrder": "1", **_FLAGS},
    )
    _units(root, documents)
    _experiment(root, documents, experiment)
    variables = ET.SubElement(root, "ModelVariables")
    indices: dict[str, int] = {}
    for element in [*_connectors(glue, documents, first), *_members(glue, documents, first)]:
        variables.append(element)
        indices[element.get("name", "")] = len(variables)
    _derivatives(variables, glue, indices)
    _structure(root, variables, glue, indices)
    ET.indent(root)
    body: bytes = ET.tostring(root, encoding="utf-8")
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + body + b"\n"


def _units(root: ET.Element, documents: Sequence[ET.Element]) -> None:
    found: dict[str, ET.Element] = {}
    for document in documents:
        for unit in document.iterfind("UnitDefinitions/Unit"):
            found.setdefault(unit.get("name", ""), unit)
    if found:
        definitions = ET.SubElement(root, "UnitDefinitions")
        definitions.extend(copy.deepcopy(found[name]) for name in sorted(found))


def _experiment(root: ET.Element, documents: Sequence[ET.Element], experiment: DefaultExperiment) -> None:
    found = [d.attrib for document in documents for d in document.iterfind("DefaultExperiment")]
    attributes = dict(found[0]) if found else {}
    if experiment.stop is not None:
        attributes |= {"startTime": repr(experiment.start or 0.0), "stopTime": repr(experiment.stop)}
    if attributes:
        ET.SubElement(root, "DefaultExperiment", attributes)


def _scalars(document: ET.Element) -> Mapping[str, ET.Element]:
    return {v.get("name", ""): v for v in document.iter("ScalarVariable")}


def _connectors(glue: Glue, documents: Sequence[ET.Element], first: Mapping[str, int]) -> list[ET.Element]:
    elements = []
    shown = {c.name: c for c in glue.system.connectors}
    for index, ((name, _), start) in enumerate(zip(glue.inputs, input_starts(glue), strict=True)):
        if name not in shown:
            continue
        element = _pin(glue, documents, shown[name].pins[0][0], name, shown[name].unit)
        element.set("valueReference", str(first["VR_U"] + index))
        element.find("Real").set("start", repr(start))  # type: ignore[union-attr]
        elements.append(element)
    for index, (name, pin, _, _) in enumerate(glue.outputs):
        element = _pin(glue, documents, pin, name, shown[name].unit)
        element.set("valueReference", str(first["VR_W"] + index))
        element.set("causality", "output")
        element.set("initial", "calculated")
        element.find("Real").attrib.pop("start", None)  # type: ignore[union-attr]
        elements.append(element)
    return elements


def _pin(
    glue: Glue, documents: Sequence[ET.Element], pin: tuple[str, str], name: str, unit: str
) -> ET.Element:
    element = copy.deepcopy(_scalars(documents[glue.number(pin[0])])[pin[1]])
    element.set("name", name)
    real = element.find("Real")
    assert real is not None
    for key in ("min", "max", "derivative"):
        real.attrib.pop(key, None)
    if unit:
        real.set("unit", unit)
    return element


def _members(glue: Glue, documents: Sequence[ET.Element], first: Mapping[str, int]) -> list[ET.Element]:
    external = {name: index for index, (name, _) in enumerate(glue.inputs)}
    elements = []
    for member, document in zip(glue.members, documents, strict=True):
        given = next(c.start for c in glue.system.components if c.name == member.name)
        for name, original in _scalars(document).items():
            reference = _reference(glue, member, name, first, external)
            if reference is None:
                continue
            element = copy.deepcopy(original)
            element.set("name", qualified(member.name, name))
            element.set("valueReference", str(reference))
            real = element.find("Real")
            if real is not None and name in given and "start" in real.attrib:
                real.set("start", repr(float(given[name])))
            if element.get("causality") == "input" and f"{member.name}.{name}" not in external:
                element.set("causality", "local")
                element.set("initial", "calculated")
                if real is not None:
                    real.attrib.pop("start", None)
            elements.append(element)
    return elements


def _reference(
    glue: Glue, member: Member, name: str, first: Mapping[str, int], external: Mapping[str, int]
) -> int | None:
    """Value reference of a component's variable in the whole; None for what the whole does not show."""
    place, at, total = member.place(name), glue.places.first[member.name], glue.places.total
    if place is None:  # time, calculated parameters
        return None
    group, index = place
    shown, n_y = len(glue.outputs), member.size("N_Y")
    if group in ("X", "DX"):
        return first[f"VR_{group}"] + at["X"] + index
    if group == "P":
        return first["VR_P"] + at["P"] + index
    if group == "U":
        whole = f"{member.name}.{name}"
        if whole in external:
            return first["VR_U"] + external[whole]
        return first["VR_W"] + shown + total["Y"] + total["W"] + at["V"] + index
    if index < n_y:
        return first["VR_W"] + shown + at["Y"] + index
    return first["VR_W"] + shown + total["Y"] + at["W"] + index - n_y


def _derivatives(variables: ET.Element, glue: Glue, indices: Mapping[str, int]) -> None:
    """``derivative`` is an index into the list of variables: the whole has another list."""
    for member in glue.members:
        for state in member.states:
            element = variables[indices[f"der({member.name}.{state})"] - 1]
            element.find("Real").set("derivative", str(indices[f"{member.name}.{state}"]))  # type: ignore[union-attr]


def _structure(root: ET.Element, variables: ET.Element, glue: Glue, indices: Mapping[str, int]) -> None:
    structure = ET.SubElement(root, "ModelStructure")
    outputs = [index for name, index in indices.items() if variables[index - 1].get("causality") == "output"]
    rates = [indices[f"der({member.name}.{state})"] for member in glue.members for state in member.states]
    calculated = [
        indices[f"{member.name}.{state}"]
        for member in glue.members
        for state in member.states
        if variables[indices[f"{member.name}.{state}"] - 1].get("initial") == "calculated"
    ]
    unknown = sorted({*outputs, *rates, *calculated})
    for tag, listed in (("Outputs", outputs), ("Derivatives", rates), ("InitialUnknowns", unknown)):
        if listed:
            parent = ET.SubElement(structure, tag)
            for index in listed:
                ET.SubElement(parent, "Unknown", index=str(index))
