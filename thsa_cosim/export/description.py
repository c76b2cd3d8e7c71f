"""``modelDescription.xml`` for FMI 2.0.4 and FMI 3.0, and ``buildDescription.xml`` for FMI 3.0 sources."""

import warnings
from collections.abc import Iterable
from xml.etree import ElementTree as ET

import casadi as ca

from thsa_cosim import __version__
from thsa_cosim.errors import ModelicaError
from thsa_cosim.export.codegen import first_value_references, value_reference
from thsa_cosim.export.model import CausalModel, ModelVariable
from thsa_cosim.export.units import base_unit

LOG_CATEGORIES = {
    "logAll": "All messages",
    "logStatusWarning": "Warnings",
    "logStatusDiscard": "Steps that the solver could not finish",
    "logStatusError": "Forbidden calls and wrong arguments",
    "logStatusFatal": "Failures that end the instance",
    "logEvents": "State events and event iterations",
    "logSolver": "Steps of the Co-Simulation solver",
}
FMI2_CO_SIMULATION = {
    "canHandleVariableCommunicationStepSize": "true",
    "canInterpolateInputs": "true",
    "canNotUseMemoryManagementFunctions": "true",
    "maxOutputDerivativeOrder": "1",
    "canGetAndSetFMUstate": "true",
    "canSerializeFMUstate": "true",
    "providesDirectionalDerivative": "true",
}
FMI2_MODEL_EXCHANGE = {
    "canNotUseMemoryManagementFunctions": "true",
    "canGetAndSetFMUstate": "true",
    "canSerializeFMUstate": "true",
    "providesDirectionalDerivative": "true",
}
FMI3_COMMON = {
    "canGetAndSetFMUState": "true",
    "canSerializeFMUState": "true",
    "providesDirectionalDerivatives": "true",
    "providesAdjointDerivatives": "true",
}
FMI3_CO_SIMULATION = {
    "canReturnEarlyAfterIntermediateUpdate": "true",
    "canHandleVariableCommunicationStepSize": "true",
    "maxOutputDerivativeOrder": "1",
    "providesIntermediateUpdate": "true",
}


def fmi2_description(
    model: CausalModel, identifier: str, token: str, date: str, sources: Iterable[str]
) -> bytes:
    """The model description of an FMI 2.0 FMU; ``date`` is ISO 8601 in UTC, ``sources`` the C files to compile."""
    root = ET.Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=model.flat.name,
        guid=token,
        description=model.flat.description,
        version=__version__,
        generationTool=f"thsa-cosim {__version__}",
        generationDateAndTime=date,
        variableNamingConvention="structured",
        numberOfEventIndicators=str(model.g.numel()),
    )
    for tag, capabilities in (("ModelExchange", FMI2_MODEL_EXCHANGE), ("CoSimulation", FMI2_CO_SIMULATION)):
        interface = ET.SubElement(root, tag, {"modelIdentifier": identifier, **capabilities})
        files = ET.SubElement(interface, "SourceFiles")
        for name in sources:
            ET.SubElement(files, "File", name=name)
    _units(root, model)
    categories = ET.SubElement(root, "LogCategories")
    for name, text in LOG_CATEGORIES.items():
        ET.SubElement(categories, "Category", name=name, description=text)
    _experiment(root, model)
    listed = list(model.variables)
    number = {variable.name: str(index + 1) for index, variable in enumerate(listed)}
    entries = ET.SubElement(root, "ModelVariables")
    for variable in listed:
        attributes, real = _attributes(model, variable)
        if variable.name.startswith("der("):
            real["derivative"] = number[model.states[variable.index]]
        scalar = ET.SubElement(entries, "ScalarVariable", attributes)
        ET.SubElement(scalar, "Real", real)
    structure = ET.SubElement(root, "ModelStructure")
    outputs, derivatives, dependencies = _structure(model)
    knowns = [number[name] for name in _known_names(model)]
    for tag, unknowns in (("Outputs", outputs), ("Derivatives", derivatives)):
        if unknowns:
            group = ET.SubElement(structure, tag)
            for name in unknowns:
                ET.SubElement(
                    group, "Unknown", {"index": number[name], **_dependencies(dependencies[name], knowns)}
                )
    initial = _initial_unknowns(model)
    if initial:
        group = ET.SubElement(structure, "InitialUnknowns")
        for index in sorted(int(number[name]) for name in initial):
            ET.SubElement(group, "Unknown", index=str(index))
    return _text(root)


def fmi3_description(model: CausalModel, identifier: str, token: str, date: str) -> bytes:
    """The model description of an FMI 3.0 FMU."""
    root = ET.Element(
        "fmiModelDescription",
        fmiVersion="3.0",
        modelName=model.flat.name,
        instantiationToken=token,
        description=model.flat.description,
        version=__version__,
        generationTool=f"thsa-cosim {__version__}",
        generationDateAndTime=date,
        variableNamingConvention="structured",
    )
    ET.SubElement(root, "ModelExchange", {"modelIdentifier": identifier, **FMI3_COMMON})
    ET.SubElement(root, "CoSimulation", {"modelIdentifier": identifier, **FMI3_COMMON, **FMI3_CO_SIMULATION})
    _units(root, model)
    categories = ET.SubElement(root, "LogCategories")
    for name, text in LOG_CATEGORIES.items():
        ET.SubElement(categories, "Category", name=name, description=text)
    _experiment(root, model)
    entries = ET.SubElement(root, "ModelVariables")
    ET.SubElement(
        entries,
        "Float64",
        name="time",
        valueReference="0",
        causality="independent",
        variability="continuous",
        description="Time",
    )
    reference = {variable.name: str(value_reference(model, variable)) for variable in model.variables}
    primary: dict[str, ET.Element] = {}
    for variable in sorted(model.variables, key=lambda v: not _names_its_reference(model, v)):
        attributes, real = _attributes(model, variable)
        held = primary.get(attributes["valueReference"])
        if held is not None:
            ET.SubElement(held, "Alias", {"name": variable.name, **_described(variable)})
            continue
        attributes |= {key: value for key, value in real.items() if key != "unit"}
        if variable.unit:
            attributes["unit"] = variable.unit
        if variable.name.startswith("der("):
            attributes["derivative"] = reference[model.states[variable.index]]
        if variable.causality == "input":
            attributes["intermediateUpdate"] = "true"
        primary[attributes["valueReference"]] = ET.SubElement(entries, "Float64", attributes)
    first = first_value_references(model)["indicator"]
    for index in range(model.g.numel()):
        ET.SubElement(
            entries, "Float64", name=f"indicator[{index + 1}]", valueReference=str(first + index), causality="local",
            variability="continuous", description="Event indicator",
        )  # fmt: skip
    structure = ET.SubElement(root, "ModelStructure")
    outputs, derivatives, dependencies = _structure(model)
    knowns = [reference[name] for name in _known_names(model)]
    for tag, unknowns in (("Output", outputs), ("ContinuousStateDerivative", derivatives)):
        for name in unknowns:
            listed = _dependencies(dependencies[name], knowns)
            ET.SubElement(structure, tag, {"valueReference": reference[name], **listed})
    for name in _initial_unknowns(model):
        ET.SubElement(structure, "InitialUnknown", valueReference=reference[name])
    for index in range(model.g.numel()):
        ET.SubElement(structure, "EventIndicator", valueReference=str(first + index))
    return _text(root)


def build_description(identifier: str, sources: Iterable[str]) -> bytes:
    """``sources/buildDescription.xml`` (FMI 3.0, 2.5.1.4)."""
    root = ET.Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = ET.SubElement(root, "BuildConfiguration", modelIdentifier=identifier)
    files = ET.SubElement(configuration, "SourceFileSet", language="C99")
    for name in sources:
        ET.SubElement(files, "SourceFile", name=name)
    return _text(root)


def _names_its_reference(model: CausalModel, variable: ModelVariable) -> bool:
    """Whether a variable, and not an alias of it, is listed with its value reference in FMI 3.0."""
    return (
        variable.causality != "local"
        or variable.name in model.states
        or variable.name.startswith("der(")
        or variable.kind in ("parameter", "dependent")
    )


def _described(variable: ModelVariable) -> dict[str, str]:
    return {"description": variable.description} if variable.description else {}


def _attributes(model: CausalModel, variable: ModelVariable) -> tuple[dict[str, str], dict[str, str]]:
    """Attributes of the variable and of its type, with the names that FMI 2 and 3 share."""
    attributes = {
        "name": variable.name,
        "valueReference": str(value_reference(model, variable)),
        **_described(variable),
    }
    real: dict[str, str] = {}
    if variable.causality == "input":
        attributes |= {"causality": "input", "variability": "discrete" if variable.discrete else "continuous"}
    elif variable.kind == "parameter":
        attributes |= {"causality": "parameter", "variability": "tunable", "initial": "exact"}
    elif variable.kind == "dependent":
        attributes |= {"causality": "calculatedParameter", "variability": "tunable", "initial": "calculated"}
    else:
        initial = "exact" if variable.kind == "state" and variable.start is not None else "calculated"
        variability = "discrete" if variable.discrete else "continuous"
        attributes |= {"causality": variable.causality, "variability": variability, "initial": initial}
    if variable.start is not None:
        real["start"] = repr(float(variable.start))
    if variable.unit:
        real["unit"] = variable.unit
    for key, value in (("min", variable.minimum), ("max", variable.maximum), ("nominal", variable.nominal)):
        if value is not None:
            real[key] = repr(float(value))
    return attributes, real


def _units(root: ET.Element, model: CausalModel) -> None:
    names = sorted({variable.unit for variable in model.variables if variable.unit})
    if not names:
        return
    definitions = ET.SubElement(root, "UnitDefinitions")
    for name in names:
        try:
            base = base_unit(name)
        except ModelicaError as error:  # a unit of its own, as dB: it can be shown, but not converted
            warnings.warn(f"{model.flat.name}: {error} It is kept as it is written.", stacklevel=2)
            ET.SubElement(definitions, "Unit", name=name)
            continue
        attributes = {key: str(value) for key, value in base.exponents.items()}
        if base.factor != 1.0:
            attributes["factor"] = repr(base.factor)
        if base.offset:
            attributes["offset"] = repr(base.offset)
        ET.SubElement(ET.SubElement(definitions, "Unit", name=name), "BaseUnit", attributes)


def _experiment(root: ET.Element, model: CausalModel) -> None:
    e = model.flat.experiment
    ET.SubElement(
        root,
        "DefaultExperiment",
        startTime=repr(e.start),
        stopTime=repr(e.stop),
        tolerance=repr(e.tolerance),
        stepSize=repr(e.interval),
    )


def _known_names(model: CausalModel) -> list[str]:
    inputs = sorted((v for v in model.variables if v.causality == "input"), key=lambda v: v.index)
    return [*model.states, *[v.name for v in inputs]]


def _structure(model: CausalModel) -> tuple[list[str], list[str], dict[str, list[int]]]:
    """Outputs, derivatives, and which knowns (states, inputs) each depends on."""
    knowns = ca.vertcat(model.x, model.u)
    rows: dict[tuple[str, int], list[int]] = {}
    for kind, expression in (("derivative", model.rhs), ("algebraic", model.w)):
        pattern = ca.jacobian(expression, knowns).sparsity()
        for row, known in zip(*pattern.get_triplet(), strict=True):
            rows.setdefault((kind, row), []).append(known)
    outputs = [v.name for v in model.variables if v.causality == "output"]
    derivatives = [f"der({state})" for state in model.states]
    places = {v.name: (v.kind, v.index) for v in model.variables}
    dependencies = {}
    for name in (*outputs, *derivatives):
        kind, index = places[name]
        dependencies[name] = [index] if kind == "state" else rows.get((kind, index), [])
    return outputs, derivatives, dependencies


def _dependencies(indices: list[int], knowns: list[str]) -> dict[str, str]:
    return {"dependencies": " ".join(sorted((knowns[i] for i in indices), key=int))}


def _initial_unknowns(model: CausalModel) -> list[str]:
    """Outputs, calculated parameters, calculated states and all derivatives (FMI 2.0.4, 2.2.8)."""
    return [
        v.name
        for v in model.variables
        if (v.causality == "output" and v.start is None)
        or v.kind == "dependent"
        or (v.name in model.states and v.start is None and v.causality != "output")
        or v.name.startswith("der(")
    ]


def _text(root: ET.Element) -> bytes:
    ET.indent(root)
    body: bytes = ET.tostring(root, encoding="utf-8")
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + body + b"\n"
