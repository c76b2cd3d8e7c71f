"""What an FMU says about itself: ``modelDescription.xml`` as frozen objects (FMI 1.0, 2.0 and 3.0)."""

import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import IO, Any
from xml.etree import ElementTree

import numpy as np

from thsa_cosim.errors import FmuError, did_you_mean
from thsa_cosim.fmu.archive import open_archive, read_text, sha256_of
from thsa_cosim.fmu.clocks import Clock, read_clocks

FLOAT_TYPES = ("Real", "Float64", "Float32")
INTEGERS = tuple(f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64))
NUMBERS = (*FLOAT_TYPES, *INTEGERS, "Integer", "Boolean", "Enumeration")
_ATTRIBUTES = (
    "canBeInstantiatedOnlyOncePerProcess",
    "canGetAndSetFMUstate",
    "canHandleVariableCommunicationStepSize",
    "canInterpolateInputs",
    "canNotUseMemoryManagementFunctions",
    "canReturnEarlyAfterIntermediateUpdate",
    "canRunAsynchronuously",
    "canSerializeFMUstate",
    "hasEventMode",
    "maxOutputDerivativeOrder",
    "mightReturnEarlyFromDoStep",
    "needsCompletedIntegratorStep",
    "needsExecutionTool",
    "providesAdjointDerivatives",
    "providesDirectionalDerivative",
    "providesIntermediateUpdate",
    "recommendedIntermediateInputSmoothness",
)


_ABSOLUTE_ZERO = {"K": 0.0, "degC": -273.15, "degF": -459.67}


@dataclass(frozen=True)
class Variable:
    """One variable of an FMU; numbers are in ``unit``, ``None`` where the description is silent."""

    name: str
    value_reference: int
    causality: str
    """parameter, calculatedParameter, input, output, local, independent, structuralParameter"""
    variability: str
    """constant, fixed, tunable, discrete, continuous"""
    type: str
    """Real, Integer, Boolean, String, Enumeration (FMI 1 and 2); Float64, Int32, ... (FMI 3)"""
    unit: str | None = None
    start: float | None = None
    minimum: float | None = None
    maximum: float | None = None
    nominal: float | None = None
    description: str = ""
    is_array: bool = False
    intermediate_update: bool = False
    """FMI 3: may be set inside a communication step (clause 4.2.2)."""
    initial: str | None = None
    """exact, approx, calculated"""
    element: tuple[int, int, int] | None = None
    """FMI 3, one element of an array: value reference, index and length of the array; ``value_reference`` is then a
    number of our own. The array itself has its entry, but is no input, output or parameter."""
    is_negated: bool = False
    """FMI 1: an alias of the other sign; the FMU sets and gets the variable that it stands for."""
    is_alias: bool = False
    """FMI 3: another name of a variable that has its own entry."""
    items: tuple[tuple[str, int], ...] = ()
    """Names and numbers of an enumeration, in the order of its type definition."""

    @property
    def is_scalar(self) -> bool:
        """Whether it is a number of its own: no second name, and no array, whose elements are numbers."""
        return not self.is_alias and not (self.is_array and self.type in NUMBERS)

    @property
    def is_float(self) -> bool:
        """Whether the value is a floating-point number."""
        return self.type in FLOAT_TYPES

    @property
    def takes_start(self) -> bool:
        """Whether a local variable or an output, such as a state, takes a start value (FMI 2.0.4, clause 2.2.7)."""
        started = self.causality in ("local", "output") and self.initial in ("exact", "approx")
        return started and self.variability != "constant"

    @property
    def may_stay_open(self) -> bool:
        """Whether it is an input that needs no signal: a temperature that starts below absolute zero."""
        zero = _ABSOLUTE_ZERO.get(self.unit or "")
        return self.causality == "input" and None not in (zero, self.start) and self.start < zero  # type: ignore[operator]


@dataclass(frozen=True)
class DefaultExperiment:
    """Start and stop time [s], relative tolerance and step [s] that the FMU suggests."""

    start: float | None = None
    stop: float | None = None
    tolerance: float | None = None
    step: float | None = None


@dataclass(frozen=True)
class FmuDescription:
    """What an FMU says about itself."""

    path: Path
    sha256: str
    model_name: str
    fmi_version: str
    """"1.0", "2.0" or "3.0" """
    tool: str
    guid: str
    supports_co_simulation: bool
    supports_model_exchange: bool
    capabilities: Mapping[str, bool | int]
    """Capability flags by their FMI names, of the Co-Simulation interface where both exist."""
    variables: Mapping[str, Variable]
    default_experiment: DefaultExperiment
    platforms: tuple[str, ...]
    co_simulation_identifier: str | None = None
    model_exchange_identifier: str | None = None
    states: int = 0
    event_indicators: int = 0
    state_references: tuple[tuple[int, int], ...] = ()
    """(state, its derivative) as value references, in the order of the state vector; empty if unknown."""
    clocks: tuple[Clock, ...] = ()
    """FMI 3 input clocks."""
    dimension_references: frozenset[int] = frozenset()
    """FMI 3: value references of the structural parameters that are lengths of arrays."""
    feedthrough: Mapping[str, tuple[str, ...] | None] = field(default_factory=dict)
    """What each output depends on directly, by name (ModelStructure, FMI 2.0.4 clause 2.2.8); None: not said."""

    @property
    def inputs(self) -> tuple[Variable, ...]:
        """Variables with causality input, in declaration order."""
        return tuple(v for v in self.variables.values() if v.causality == "input" and v.is_scalar)

    @property
    def outputs(self) -> tuple[Variable, ...]:
        """Variables with causality output, in declaration order."""
        return tuple(v for v in self.variables.values() if v.causality == "output" and v.is_scalar)

    @property
    def parameters(self) -> tuple[Variable, ...]:
        """Variables that can be set before initialisation, in declaration order."""
        return tuple(
            v
            for v in self.variables.values()
            if v.causality in ("parameter", "structuralParameter") and (v.is_scalar or v.is_alias)
        )

    @cached_property
    def state_names(self) -> tuple[str, ...]:
        """Names of the continuous states, in the order of the state vector; empty if the FMU does not state them all.

        Where variables share a state, the one that takes a start value names it.
        """
        floats = [v for v in self.variables.values() if v.is_float]
        by_reference = {v.value_reference: v.name for v in sorted(floats, key=lambda v: v.takes_start)}
        names = tuple(by_reference.get(state, "") for state, _ in self.state_references)
        return names if all(names) and len(names) == self.states else ()

    @cached_property
    def structural_references(self) -> frozenset[int]:
        """Value references of structural parameters (FMI 3)."""
        found = (v for v in self.variables.values() if v.causality == "structuralParameter")
        return frozenset(v.value_reference for v in found if v.element is None)

    def variable(self, name: str) -> Variable:
        """Return the variable ``name``; FmuError with a suggestion if there is none."""
        try:
            return self.variables[name]
        except KeyError:
            hint = did_you_mean(name, self.variables)
            raise FmuError(f"{self.path} has no variable {name!r}.{hint}") from None


def read_description(path: Path | str) -> FmuDescription:
    """Read an FMU's description without unpacking it; FmuError (one sentence) if it is no usable FMU."""
    # fmpy and lxml take 0.2 s to import: only where an FMU is really read.
    import fmpy
    from fmpy.model_description import read_model_description

    path = Path(path)
    with open_archive(path) as archive:
        try:
            xml = read_text(path, archive, "modelDescription.xml")
        except KeyError:
            raise FmuError(
                f"{path} is a zip archive without modelDescription.xml{_deeper(archive)} and so no FMU."
            ) from None
        except (OSError, zipfile.BadZipFile, RuntimeError, NotImplementedError, zlib.error) as error:
            raise FmuError(f"{path}: modelDescription.xml cannot be unpacked ({error}).") from None
    try:
        # Many vendor FMUs break the schema in harmless ways; `thsa-cosim check` reports those.
        # fmpy gets an open file, as it does not close what it opens when it raises.
        with path.open("rb") as file:
            raw = read_model_description(file, validate=False)
            platforms = tuple(sorted({*fmpy.supported_platforms(file), *_windows_paths(file)}))
    except Exception as error:
        message = " ".join(str(error).split()) or type(error).__name__
        if isinstance(error, IndexError):
            message = "its ModelStructure names a variable that is not there"
        raise FmuError(f"{path}: modelDescription.xml cannot be read ({message.rstrip('.')}).") from None
    if any(draft in raw.fmiVersion for draft in ("alpha", "beta")):
        raise FmuError(
            f"{path} was made for FMI {raw.fmiVersion}, a draft that differs from FMI 3.0; export it again."
        )
    if raw.coSimulation is None and raw.modelExchange is None:
        also = " but Scheduled Execution" if getattr(raw, "scheduledExecution", None) is not None else ""
        raise FmuError(
            f"{path} offers neither Co-Simulation nor Model Exchange{also}; export it with one of them."
        )
    co_simulation, model_exchange = raw.coSimulation, raw.modelExchange
    experiment = raw.defaultExperiment
    intermediate = _intermediate_variables(xml)
    return FmuDescription(
        path=path,
        sha256=sha256_of(path),
        model_name=raw.modelName or "",
        fmi_version=f"{raw.fmiVersion.split('.')[0]}.0",
        tool=raw.generationTool or "",
        guid=raw.guid or "",
        supports_co_simulation=co_simulation is not None,
        supports_model_exchange=model_exchange is not None,
        capabilities=_capabilities(model_exchange) | _capabilities(co_simulation) | _plural(xml),
        variables=_negated(_variables(raw, intermediate), xml),
        default_experiment=DefaultExperiment()
        if experiment is None
        else DefaultExperiment(
            start=_number(experiment.startTime),
            stop=_number(experiment.stopTime),
            tolerance=_number(experiment.tolerance),
            step=_number(experiment.stepSize),
        ),
        platforms=platforms,
        co_simulation_identifier=getattr(co_simulation, "modelIdentifier", None),
        model_exchange_identifier=getattr(model_exchange, "modelIdentifier", None),
        states=_count(raw.derivatives, raw) or int(raw.numberOfContinuousStates or 0),
        event_indicators=_count(raw.eventIndicators, raw) or int(raw.numberOfEventIndicators or 0),
        state_references=_state_references(raw),
        clocks=read_clocks(xml),
        dimension_references=frozenset(
            int(d.valueReference)
            for v in raw.modelVariables
            for d in v.dimensions or ()
            if d.valueReference is not None
        ),
        feedthrough={
            unknown.variable.name: None
            if unknown.dependencies is None
            else tuple(known.name for known in unknown.dependencies)
            for unknown in raw.outputs
        },
    )


def _deeper(archive: zipfile.ZipFile) -> str:
    """Where a description lies that is not at the top."""
    inside = [name for name in archive.namelist() if name.endswith("/modelDescription.xml")]
    return f" at its top (it has {inside[0]}; zip what is in that folder)" if inside else ""


def _windows_paths(file: IO[bytes]) -> set[str]:
    """Platforms of an archive whose entries have backslashes, as some tools on Windows write them."""
    with zipfile.ZipFile(file) as archive:
        parts = [name.split("\\") for name in archive.namelist() if "\\" in name]
    return {p[1] for p in parts if len(p) == 3 and p[0] == "binaries" and p[2]}


def _state_references(raw: Any) -> tuple[tuple[int, int], ...]:
    pairs = []
    for unknown in raw.derivatives:
        state = getattr(unknown.variable, "derivative", None)
        if state is None or unknown.variable.dimensions:
            return ()
        reference = getattr(state, "valueReference", state)
        pairs.append((int(reference), int(unknown.variable.valueReference)))
    return tuple(pairs)


def _capabilities(interface: Any) -> dict[str, bool | int]:
    if interface is None:
        return {}
    values = {name: getattr(interface, name, None) for name in _ATTRIBUTES}
    return {name: int(v) if name in _COUNTS else bool(v) for name, v in values.items() if v is not None}


_COUNTS = {"maxOutputDerivativeOrder", "recommendedIntermediateInputSmoothness"}


def _plural(xml: bytes) -> dict[str, bool | int]:
    """FMI 3 writes providesDirectionalDerivatives where FMI 2 has no s; fmpy reads the latter only."""
    if b"providesDirectionalDerivatives" not in xml:
        return {}
    root = ElementTree.fromstring(xml)
    flags = [
        e.get("providesDirectionalDerivatives") for e in root if e.tag.endswith(("Exchange", "Simulation"))
    ]
    return {"providesDirectionalDerivative": any(flag in ("true", "1") for flag in flags)}


def _variables(raw: Any, intermediate: set[int]) -> dict[str, Variable]:
    """All variables by name; arrays as their elements, in row-major order: ``A[1,1]``, ``A[1,2]``, ..."""
    found: dict[str, Variable] = {}
    virtual = 0
    for one in raw.modelVariables:
        variable = _variable(one, intermediate)
        shape = _shape(one, raw)
        found[variable.name] = variable
        if shape is None or variable.type not in NUMBERS:
            continue
        size = int(np.prod(shape))
        starts = str(one.start or "").split()
        for index in range(size):
            where = ",".join(str(int(i) + 1) for i in np.unravel_index(index, shape))
            start = starts[index] if index < len(starts) else starts[0] if len(starts) == 1 else None
            found[f"{variable.name}[{where}]"] = replace(
                variable,
                name=f"{variable.name}[{where}]",
                value_reference=virtual,
                start=_number(start),
                is_array=False,
                intermediate_update=False,
                element=(variable.value_reference, index, size),
            )
            virtual += 1
    return found


def _negated(variables: dict[str, Variable], xml: bytes) -> dict[str, Variable]:
    """Mark FMI 1.0's negated aliases, which fmpy does not read."""
    if b"negatedAlias" not in xml:
        return variables
    elements = ElementTree.fromstring(xml).findall("ModelVariables/ScalarVariable")
    names = {e.get("name") for e in elements if e.get("alias") == "negatedAlias"}
    return {n: replace(v, is_negated=n in names) for n, v in variables.items()}


def _shape(one: Any, raw: Any) -> tuple[int, ...] | None:
    """Lengths of an array's dimensions, which may be structural parameters' start values; None for a scalar."""
    if not one.dimensions:
        return None
    starts = {int(v.valueReference): v.start for v in raw.modelVariables}
    lengths = []
    for dimension in one.dimensions:
        length = dimension.start
        if length is None:
            variable = getattr(dimension, "variable", None)
            length = starts.get(int(dimension.valueReference)) if variable is None else variable.start
        lengths.append(int(length or 0))
    return tuple(lengths)


def _count(unknowns: Any, raw: Any) -> int:
    """How many numbers the variables of a list are together."""
    shapes = [_shape(unknown.variable, raw) for unknown in unknowns]
    return sum(1 if shape is None else int(np.prod(shape)) for shape in shapes)


def _variable(raw: Any, intermediate: set[int]) -> Variable:
    declared = raw.declaredType

    def attribute(name: str) -> Any:
        own = getattr(raw, name)
        return own if own is not None else getattr(declared, name, None)

    return Variable(
        name=raw.name,
        value_reference=int(raw.valueReference),
        causality=raw.causality or "local",
        variability=raw.variability or "continuous",
        type=raw.type,
        unit=attribute("unit"),
        start=_number(raw.start),
        minimum=_number(attribute("min")),
        maximum=_number(attribute("max")),
        nominal=_number(attribute("nominal")),
        description=raw.description or "",
        is_array=bool(raw.dimensions),
        intermediate_update=int(raw.valueReference) in intermediate,
        initial=raw.initial,
        is_alias=raw.alias is not None,
        items=_items(declared) if raw.type == "Enumeration" else (),
    )


def _items(declared: Any) -> tuple[tuple[str, int], ...]:
    """Items of an enumeration's type; those of FMI 1.0 count from 1."""
    listed = getattr(declared, "items", None) or ()
    return tuple(
        (item.name, k if item.value is None else int(item.value)) for k, item in enumerate(listed, 1)
    )


def _intermediate_variables(xml: bytes) -> set[int]:
    """Value references that FMI 3 allows in Intermediate Update Mode; fmpy does not read that attribute."""
    if b"intermediateUpdate" not in xml:
        return set()
    root = ElementTree.fromstring(xml)
    variables = root.findall("ModelVariables/*")
    return {
        int(v.attrib["valueReference"]) for v in variables if v.get("intermediateUpdate") in ("true", "1")
    }


def _number(text: Any) -> float | None:
    """Read a number or an FMI boolean; ``None`` for anything else (strings, arrays)."""
    if text is None:
        return None
    if text in ("true", "false"):
        return float(text == "true")
    try:
        return float(text)
    except ValueError:
        return None
