"""What an FMU says about itself: ``modelDescription.xml`` as frozen objects (FMI 1.0, 2.0 and 3.0)."""

import io
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path
from typing import IO, Any
from xml.etree import ElementTree

from thsa_cosim.errors import FmuError, did_you_mean
from thsa_cosim.fmu.archive import open_archive, read_text, sha256_of
from thsa_cosim.fmu.clocks import Clock, read_clocks
from thsa_cosim.fmu.variable import Variable, count_numbers, read_number, read_variables

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
            if v.causality in ("parameter", "structuralParameter")
            and v.variability != "constant"
            and (v.is_scalar or v.is_alias)
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
    path = Path(path)
    try:
        content = sha256_of(path) if path.is_file() else ""
    except OSError:  # what cannot be read is refused as it is opened
        content = ""
    return _read(path, content)


@lru_cache(maxsize=32)
def _read(path: Path, content: str) -> FmuDescription:
    """A study asks for the same description many times, 50 ms each; ``content``: the file's SHA-256."""
    # fmpy and lxml take 0.2 s to import: only where an FMU is really read.
    import fmpy
    from fmpy.model_description import read_model_description

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
            raw = read_model_description(_with_legal_constants(xml) or file, validate=False)
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
    return FmuDescription(
        path=path,
        sha256=content,
        model_name=raw.modelName or "",
        fmi_version=f"{raw.fmiVersion.split('.')[0]}.0",
        tool=raw.generationTool or "",
        guid=raw.guid or "",
        supports_co_simulation=co_simulation is not None,
        supports_model_exchange=model_exchange is not None,
        capabilities=_capabilities(model_exchange) | _capabilities(co_simulation) | _plural(xml),
        variables=read_variables(raw, xml),
        default_experiment=DefaultExperiment()
        if experiment is None
        else DefaultExperiment(
            start=read_number(experiment.startTime),
            stop=read_number(experiment.stopTime),
            tolerance=read_number(experiment.tolerance),
            step=read_number(experiment.stepSize),
        ),
        platforms=platforms,
        co_simulation_identifier=getattr(co_simulation, "modelIdentifier", None),
        model_exchange_identifier=getattr(model_exchange, "modelIdentifier", None),
        states=count_numbers(raw.derivatives, raw) or int(raw.numberOfContinuousStates or 0),
        event_indicators=count_numbers(raw.eventIndicators, raw) or int(raw.numberOfEventIndicators or 0),
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


def _with_legal_constants(xml: bytes) -> IO[bytes] | None:
    """An archive with the description that fmpy can read where parameters are declared constant; else None.

    FMI 2.0.4 (clause 2.2.7) forbids that pair, and some tools write it. Their value is known and cannot be set.
    """
    if b'variability="constant"' not in xml:
        return None
    root = ElementTree.fromstring(xml)
    constants = [
        v
        for v in root.findall("ModelVariables/*")
        if (v.get("causality"), v.get("variability")) == ("parameter", "constant")
        and v.get("initial") is None
    ]
    if not constants:
        return None
    for variable in constants:
        variable.set("initial", "exact")
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w") as target:
        target.writestr("modelDescription.xml", ElementTree.tostring(root, encoding="utf-8"))
    return archive


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
