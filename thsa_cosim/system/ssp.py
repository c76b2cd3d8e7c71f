"""SSP archives: read into a :class:`System`, and written.

Source: Modelica Association, *System Structure and Parameterization* 1.0 (2019) and 2.0 (2024). Read: nested systems,
connectors of all numeric types, signal dictionaries, connections with linear transformations, units by their
definitions, parameter bindings (inline or a resource, with parameter mapping), FMUs as resources or from another place
relative to the archive. How a component goes on (its step, delay, and whether it is sampled) is no part of SSP: it
stands in an annotation of the type ``thsa-cosim``, which other tools skip.
"""

import posixpath
import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from urllib.parse import unquote

from thsa_cosim.errors import FmuError, InputError, ParameterError
from thsa_cosim.fmu.archive import check_archive, open_archive
from thsa_cosim.fmu.description import DefaultExperiment, FmuDescription, read_description
from thsa_cosim.ssv import FLOATS, SSC, SSV, parse_parameter_set
from thsa_cosim.system.flatten import flattened
from thsa_cosim.system.nested import Bus, Element, Link, Nested
from thsa_cosim.system.parameters import Binding, Mapped
from thsa_cosim.system.structure import System
from thsa_cosim.system.unit_definitions import UnitDefinitions, read_units

SSD = "http://ssp-standard.org/SSP1/SystemStructureDescription"
SSM = "http://ssp-standard.org/SSP1/SystemStructureParameterMapping"
SSB = "http://ssp-standard.org/SSP1/SystemStructureSignalDictionary"
ROOT = "SystemStructure.ssd"
ANNOTATION = "thsa-cosim"
_LARGEST = 64 * 2**20
"""No XML file of an SSP may be larger [bytes]."""
_FMU_TYPES = ("", "application/x-fmu-sharedlibrary")
_IMPLEMENTATIONS = {"any": "", "ModelExchange": "continuous", "CoSimulation": "coupled"}


@dataclass(frozen=True)
class Archive:
    """An SSP on disk: its system, the FMU files inside, and the suggested experiment."""

    system: System
    experiment: DefaultExperiment = field(default_factory=DefaultExperiment)


def is_ssp(path: Path) -> bool:
    """Tell an SSP from an FMU by its ending."""
    return path.suffix.lower() == ".ssp"


def read_ssp(path: Path, fmus: Mapping[str, FmuDescription]) -> Archive:
    """Read the archive ``path``; ``fmus``: descriptions of its component FMUs by source, as ``sources`` lists them.

    Raises
    ------
    FmuError
        In one sentence: no SSP, a resource that is absent, names, units or connections that do not fit.
    """
    with open_archive(path) as archive:
        check_archive(path, archive)
        try:
            root = _xml(path, archive, ROOT)
            units = UnitDefinitions(_units(path, archive))
            nested = _system(path, archive, _required(path, root, "System"), fmus, frozenset())
            return Archive(flattened(nested, units), _experiment(root))
        except InputError as error:
            message = str(error)
            raise FmuError(message if str(path) in message else f"{path}: {message}") from None


def _units(path: Path, archive: zipfile.ZipFile) -> dict[str, tuple[Mapping[str, int], float, float]]:
    """Definitions of units in all of the archive's files; a name means the same in each."""
    found = {}
    for name in archive.namelist():
        if name.endswith((".ssd", ".ssv", ".ssb")):
            found.update(read_units(_xml(path, archive, name)))
    return found


def sources(path: Path) -> list[str]:
    """List the FMUs that the components of an SSP name, as paths within the archive."""
    with open_archive(path) as archive:
        check_archive(path, archive)
        return _sources(path, archive, ROOT, ())


def _sources(path: Path, archive: zipfile.ZipFile, member: str, above: tuple[str, ...]) -> list[str]:
    if member in above:
        raise FmuError(f"{path}: {member} contains itself by way of {' -> '.join(above)}; break the cycle.")
    found: list[str] = []
    for component in _xml(path, archive, member).iter(f"{{{SSD}}}Component"):
        source = _source(path, component, member)
        if _is_nested(source):
            found += _sources(path, archive, source, (*above, member))
        else:
            found.append(source)
    return list(dict.fromkeys(found))


def _is_nested(source: str) -> bool:
    return source.endswith(".ssd")


def _source(path: Path, component: ET.Element, member: str) -> str:
    name, source = component.get("name", ""), component.get("source", "")
    kind = component.get("type", "")
    if kind not in _FMU_TYPES and not _is_nested(source):
        raise FmuError(
            f"{path}: component {name!r} is of the type {kind!r}; only FMUs (and .ssd files) are run."
        )
    if not source or "://" in source:
        raise FmuError(
            f"{path}: component {name!r} has the source {source!r}; put its FMU into the archive's resources."
        )
    return _inside(member, source)


def _inside(member: str, reference: str) -> str:
    """Path within the archive of what ``member`` refers to by a URI (RFC 3986)."""
    plain = unquote(reference.removeprefix("file:")).replace("\\", "/").lstrip("/")
    return posixpath.normpath(posixpath.join(posixpath.dirname(member), plain))


def _xml(path: Path, archive: zipfile.ZipFile, member: str) -> ET.Element:
    try:
        entry = archive.getinfo(member)
    except KeyError:
        what = "and so is no SSP" if member == ROOT else "which it names"
        raise FmuError(f"{path} holds no {member}, {what}.") from None
    if entry.file_size > _LARGEST:
        raise FmuError(f"{path}: {member} is {entry.file_size / 2**20:.0f} MiB large, which no SSP needs.")
    try:
        data = archive.read(entry)
        if b"<!DOCTYPE" in data[:4096]:
            raise FmuError(
                f"{path}: {member} has a document type declaration, which SSP does not know; remove it."
            )
        return ET.fromstring(data)
    except (ET.ParseError, LookupError, ValueError) as error:
        raise FmuError(f"{path}: {member} is no valid XML ({error}).") from None
    except (zipfile.BadZipFile, OSError, RuntimeError, NotImplementedError) as error:
        raise FmuError(f"{path}: {member} cannot be unpacked ({error}).") from None


def _required(path: Path, element: ET.Element, tag: str) -> ET.Element:
    found = element.find(f"{{{SSD}}}{tag}")
    if found is None:
        raise FmuError(f"{path}: {ROOT} has no {tag} element.")
    return found


def _experiment(root: ET.Element) -> DefaultExperiment:
    found = root.find(f"{{{SSD}}}DefaultExperiment")
    if found is None:
        return DefaultExperiment()
    return DefaultExperiment(_float(found.get("startTime")), _float(found.get("stopTime")))


def _float(text: str | None) -> float | None:
    return None if text is None else _number(text, "a time")


def _number(text: str, what: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise FmuError(f"{what} is {text!r}, which is no number.") from None


def _system(
    path: Path,
    archive: zipfile.ZipFile,
    element: ET.Element,
    fmus: Mapping[str, FmuDescription],
    above: frozenset[str],
    member: str = ROOT,
) -> Nested:
    elements: list[Element | Nested | Bus] = []
    for child in element.iterfind(f"{{{SSD}}}Elements/*"):
        tag = child.tag.removeprefix(f"{{{SSD}}}")
        if tag == "System":
            elements.append(_system(path, archive, child, fmus, above, member))
        elif tag == "Component":
            elements.append(_component(path, archive, child, fmus, above | {member}, member))
        elif tag == "SignalDictionaryReference":
            elements.append(Bus(child.get("name", ""), child.get("dictionary", "")))
    return Nested(
        name=element.get("name", ""),
        elements=tuple(elements),
        links=tuple(_link(c) for c in element.iterfind(f"{{{SSD}}}Connections/{{{SSD}}}Connection")),
        connectors=_connectors(element),
        bindings=_bindings(path, archive, element, member),
        dictionaries=_dictionaries(path, archive, element, member),
        coupling_tolerance=_float(_own(element, "Coupling").get("tolerance")),
    )


def _dictionaries(
    path: Path, archive: zipfile.ZipFile, element: ET.Element, member: str
) -> dict[str, dict[str, str]]:
    """Units of the signals by dictionary."""
    found = {}
    for dictionary in element.iterfind(f"{{{SSD}}}SignalDictionaries/{{{SSD}}}SignalDictionary"):
        source = dictionary.get("source")
        root = _xml(path, archive, _inside(member, source)) if source else dictionary
        name = dictionary.get("name", "")
        found[name] = {
            entry.get("name", ""): _unit(entry) for entry in root.iter(f"{{{SSB}}}DictionaryEntry")
        }
    return found


def _unit(element: ET.Element) -> str:
    typed = next((e for k in FLOATS for e in element.iterfind(f"{{{SSC}}}{k}")), None)
    return "" if typed is None else typed.get("unit", "")


def _component(
    path: Path,
    archive: zipfile.ZipFile,
    element: ET.Element,
    fmus: Mapping[str, FmuDescription],
    above: frozenset[str],
    member: str,
) -> Element | Nested:
    name, source = element.get("name", ""), _source(path, element, member)
    bindings = _bindings(path, archive, element, member)
    if _is_nested(source):
        root = _required(path, _xml(path, archive, source), "System")
        inner = _system(path, archive, root, fmus, above, source)
        return Nested(name, inner.elements, inner.links, inner.connectors, (*inner.bindings, *bindings))
    if source not in fmus:
        raise FmuError(f"{path} holds no {source}, which component {name!r} names; add it to the archive.")
    given = _own(element, "Execution")
    return Element(
        name=name,
        fmu=fmus[source],
        source=source,
        bindings=bindings,
        execution=given.get("kind") or _implementation(path, element),
        step=_float(given.get("step")),
        delay=_float(given.get("delay")) or 0.0,
        jitter=_float(given.get("jitter")) or 0.0,
        process="own" if given.get("process") == "own" else "shared",
    )


def _own(element: ET.Element, tag: str) -> Mapping[str, str]:
    """Attributes of what our annotation of an element says under ``tag``."""
    for annotation in element.iterfind(f"{{{SSD}}}Annotations/{{{SSC}}}Annotation"):
        found = annotation.find(tag) if annotation.get("type") == ANNOTATION else None
        if found is not None:
            return found.attrib
    return {}


def _implementation(path: Path, element: ET.Element) -> str:
    """How the archive asks for a component to be run, in our words; "" leaves it to us (SSP 1.0, section 5.4.2)."""
    asked = element.get("implementation", "any")
    if asked not in _IMPLEMENTATIONS:
        raise FmuError(
            f"{path}: component {element.get('name', '')!r} asks for {asked!r}; "
            f"supported are {', '.join(_IMPLEMENTATIONS)}."
        )
    return _IMPLEMENTATIONS[asked]


def _connectors(element: ET.Element) -> Mapping[str, tuple[str, str]]:
    """Kind and unit of each connector."""
    found = {}
    for connector in element.iterfind(f"{{{SSD}}}Connectors/{{{SSD}}}Connector"):
        name = connector.get("name", "")
        if next(connector.iter(f"{{{SSC}}}Dimension"), None) is not None:
            raise FmuError(
                f"connector {name!r} is an array (SSP 2.0), which is not supported; connect its elements."
            )
        if connector.find(f"{{{SSC}}}Clock") is not None:
            raise FmuError(
                f"connector {name!r} is a clock (SSP 2.0), which is not supported; give a step instead."
            )
        found[name] = (connector.get("kind", ""), _unit(connector))
    return found


def _link(connection: ET.Element) -> Link:
    where = f"{connection.get('startConnector')} -> {connection.get('endConnector')}"
    factor, offset = _linear(connection, where)
    return Link(
        connection.get("startElement") or "",
        connection.get("startConnector", ""),
        connection.get("endElement") or "",
        connection.get("endConnector", ""),
        factor,
        offset,
        connection.get("suppressUnitConversion") in ("true", "1"),
        _own(connection, "Disturbance").get("name", ""),
    )


def _linear(element: ET.Element, where: str) -> tuple[float, float]:
    for child in element:
        tag = child.tag.removeprefix(f"{{{SSC}}}")
        if tag == "LinearTransformation":
            return _number(child.get("factor", "1"), "a factor"), _number(
                child.get("offset", "0"), "an offset"
            )
        if tag.endswith("Transformation"):
            raise FmuError(
                f"connection {where} has a {tag}, which is not supported; only LinearTransformation is."
            )
    return 1.0, 0.0


def _bindings(path: Path, archive: zipfile.ZipFile, element: ET.Element, member: str) -> tuple[Binding, ...]:
    found = []
    for binding in element.iterfind(f"{{{SSD}}}ParameterBindings/{{{SSD}}}ParameterBinding"):
        source = binding.get("source")
        if source:
            inside = _inside(member, source)
            root = _xml(path, archive, inside)
        else:
            inside = f"the parameters of {element.get('name')!r}"
            inline = binding.find(f"{{{SSD}}}ParameterValues/{{{SSV}}}ParameterSet")
            if inline is None:
                raise FmuError(
                    f"{path}: a parameter binding of {element.get('name')!r} has no source and no values."
                )
            root = inline
        try:
            parameters = parse_parameter_set(root, f"{path}: {inside}")
        except ParameterError as error:
            raise FmuError(str(error)) from None
        mapping = _mapping(path, archive, binding, member)
        found.append(
            Binding(
                binding.get("prefix", ""),
                parameters.values,
                parameters.units,
                mapping,
                inside,
                parameters.others,
                parameters.texts,
            )
        )
    return tuple(found)


def _mapping(
    path: Path, archive: zipfile.ZipFile, binding: ET.Element, member: str
) -> Mapping[str, Mapped] | None:
    """Parameter mapping of a binding by target; None if it has none."""
    element = binding.find(f"{{{SSD}}}ParameterMapping")
    if element is None:
        return None
    source = element.get("source")
    inside = source and _inside(member, source)
    root = _xml(path, archive, inside) if inside else element.find(f"{{{SSM}}}ParameterMapping")
    if root is None:
        raise FmuError(f"{path}: a parameter mapping has neither source nor entries.")
    entries = {}
    for entry in root.iterfind(f"{{{SSM}}}MappingEntry"):
        target = entry.get("target", "")
        if target in entries:
            raise FmuError(f"{path}: a parameter mapping sets {target!r} twice; keep one.")
        suppress = entry.get("suppressUnitConversion") in ("true", "1")
        entries[target] = Mapped(entry.get("source", ""), *_linear(entry, target), suppress)
    return entries


def component_fmus(path: Path, folder: Path) -> dict[str, FmuDescription]:
    """Unpack the component FMUs of ``path`` as archives into ``folder`` and read what they say, by source."""
    found = {}
    wanted = sources(path)
    with open_archive(path) as archive:
        for source in wanted:
            try:
                entry = archive.getinfo(source)
            except KeyError:
                message = f"{path} holds no {source}, which a component names; add it to the archive."
                raise FmuError(message) from None
            target = folder / source
            target.parent.mkdir(parents=True, exist_ok=True)
            try:
                target.write_bytes(archive.read(entry))
            except (zipfile.BadZipFile, OSError, RuntimeError, NotImplementedError) as error:
                raise FmuError(f"{path}: {source} cannot be unpacked ({error}).") from None
            shown = path / source
            try:
                found[source] = replace(read_description(target), path=shown)
            except FmuError as error:
                raise FmuError(str(error).replace(str(target), str(shown))) from None
    return found
