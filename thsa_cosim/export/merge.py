"""A system of our own FMUs compiled into one FMU: no coupling at run time, one solver, exact Jacobian.

It takes the C sources that our FMUs carry (FMI 2.0). What it cannot merge (other tools' FMUs, sampled or coupled
components, algebraic loops, discrete variables) is run by ``thsa_cosim.system`` instead, with the same results.
"""

import hashlib
import re
import shutil
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path

from thsa_cosim.errors import ThsaCosimError
from thsa_cosim.export.compile import Platform, compile_library, native_platform
from thsa_cosim.export.merge_description import merged_description
from thsa_cosim.export.merge_layout import Glue, Member, layout
from thsa_cosim.export.merge_source import member_source, merged_source
from thsa_cosim.system.description import SystemDescription
from thsa_cosim.system.order import stages
from thsa_cosim.system.structure import Component, System

IDENTIFIER = "System"
_OWN = ("model.c", "model_start.c", "model_config.h")
_DISCRETE = ("N_EVENTS", "N_Z", "N_T", "N_R", "N_A", "N_IMPLICIT")
_FORMAT = "2"
"""Goes into the digest: raise it when the generated code changes."""


class NotMergeable(Exception):
    """Why a system cannot be compiled into one FMU."""


def merge(description: SystemDescription, archives: Mapping[str, bytes], folder: Path) -> Path:
    """Compile the system into an FMU below ``folder`` (kept there under its digest) and return its path.

    ``archives``: the component FMUs by source. Raises NotMergeable with the reason.
    """
    system = description.system
    if any(stage.is_loop for stage in stages(system)):
        raise NotMergeable("it has an algebraic loop")
    if any(connection.disturbance for connection in system.connections):
        raise NotMergeable("a disturbance is added to a connection")
    runtime: dict[str, bytes] = {}
    members, documents, headers = [], [], []
    for component in system.components:
        files, document = _sources(component, archives[component.source])
        own = {name: files.pop(name) for name in _OWN}
        headers.append({**{n: c for n, c in files.items() if n.endswith(".h")}, **own})
        if runtime and files != runtime:
            raise NotMergeable(f"{component.name} was exported by another version")
        runtime = files
        members.append(_member(component, own, document))
        documents.append(document)
    glue = _glue(system, tuple(members))
    digest = hashlib.sha256(_FORMAT.encode())
    for content in (description.sha256.encode(), *(runtime[name] for name in sorted(runtime))):
        digest.update(content)
    code = digest.hexdigest()
    target = folder / code[:24] / f"{description.path.stem}.fmu"
    if not target.exists():
        _build(glue, documents, headers, runtime, code, description, target)
    return target


def _sources(component: Component, archive: bytes) -> tuple[dict[str, bytes], ET.Element]:
    """The C files of one of our FMUs and its model description."""
    if component.execution != "continuous":
        raise NotMergeable(f"{component.name} is {component.execution}")
    if component.fmu.fmi_version != "2.0" or not component.fmu.tool.startswith("thsa-cosim"):
        raise NotMergeable(f"{component.name} is no FMI 2.0 FMU of this exporter")
    with zipfile.ZipFile(BytesIO(archive)) as file:
        files = {
            name.removeprefix("sources/"): file.read(name)
            for name in file.namelist()
            if re.fullmatch(r"sources/[\w.]+\.[ch]", name)
        }
        document = ET.fromstring(file.read("modelDescription.xml"))
    if "model.c" not in files:
        raise NotMergeable(f"{component.name} carries no sources")
    if not all(name in files for name in _OWN):
        raise NotMergeable(f"{component.name} was exported by an earlier version")
    return files, document


def _member(component: Component, own: Mapping[str, bytes], document: ET.Element) -> Member:
    text = own["model_config.h"].decode()
    config = {name: float(value) for name, value in re.findall(r"#define (\w+) ([\d.eE+-]+)$", text, re.M)}
    used = [name for name in _DISCRETE if config.get(name)]
    if used:
        raise NotMergeable(f"{component.name} has discrete parts or implicit equations")
    model = own["model.c"].decode() + own["model_start.c"].decode()
    for name in ("outputs", "rhs"):
        body = model.split(f"int model_{name}(", 1)[1].split("\n}\n", 1)[0]
        if re.search(r"\bt\b", body.split("{", 1)[1].replace("(void)t", "")):
            raise NotMergeable(f"{component.name} depends on time explicitly")
    references = {
        v.get("name", ""): int(v.get("valueReference", "0")) for v in document.iter("ScalarVariable")
    }
    fmu = component.fmu
    inputs = sorted((v for v in fmu.inputs), key=lambda v: v.value_reference)
    first = int(config["VR_X"])
    by_reference = {
        r: n
        for n, r in references.items()
        if first <= r < first + config["N_X"] and f"der({n})" in references
    }
    states = tuple(by_reference[first + k] for k in range(int(config["N_X"])))
    return Member(
        component.name, model, config, references, fmu.feedthrough, tuple(v.name for v in inputs), states
    )


def _glue(system: System, members: tuple[Member, ...]) -> Glue:
    places = layout(members)
    by_name = {member.name: member for member in members}
    for connection in system.connections:
        if by_name[connection.source[0]].source(connection.source[1]) is None:
            raise NotMergeable(f"{'.'.join(connection.source)} is no output")

    def pin(name: str, variable: str) -> int:
        return places.first[name]["V"] + by_name[name].inputs.index(variable)

    inputs = [
        (connector.name, tuple((pin(*target), factor, offset) for target, factor, offset in connector.pins))
        for connector in system.connectors
        if connector.causality == "input"
    ]
    taken = {p for _, pins in inputs for p, *_ in pins} | {pin(*c.target) for c in system.connections}
    for member in members:
        for variable in member.inputs:
            index = pin(member.name, variable)
            if index not in taken:
                inputs.append((f"{member.name}.{variable}", ((index, 1.0, 0.0),)))
    outputs = []
    for connector in system.connectors:
        if connector.causality == "output":
            shown, factor, offset = connector.pins[0]
            if by_name[shown[0]].source(shown[1]) is None:
                raise NotMergeable(f"{'.'.join(shown)} is no output")
            outputs.append((connector.name, shown, factor, offset))
    return Glue(system, members, places, tuple(inputs), tuple(outputs))


def _config(glue: Glue) -> str:
    total, shown = glue.places.total, len(glue.outputs)
    n_x, n_u = total["X"], len(glue.inputs)
    n_w = shown + total["Y"] + total["W"] + total["V"]
    sizes = {"N_X": n_x, "N_U": n_u, "N_P": total["P"], "N_D": 0, "N_CACHE": total["D"], "N_W": n_w}
    sizes |= {"N_Y": shown + total["Y"], "N_G": total["G"]}
    first = 1
    references = {}
    groups = ("X", n_x), ("DX", n_x), ("U", n_u), ("P", total["P"]), ("D", 0), ("W", n_w), ("G", total["G"])
    for group, size in groups:
        references[f"VR_{group}"] = first
        first += size
    tolerance = min(member.config.get("DEFAULT_TOLERANCE", 1e-6) for member in glue.members)
    lines = ["#ifndef MODEL_CONFIG_H", "#define MODEL_CONFIG_H", f"#define MODEL_IDENTIFIER {IDENTIFIER}"]
    lines += [f"#define {name} {value}" for name, value in (sizes | references).items()]
    lines += [f"#define DEFAULT_TOLERANCE {tolerance!r}", f"#define VR_END {first}", "#endif", ""]
    return "\n".join(lines)


def _build(
    glue: Glue,
    documents: list[ET.Element],
    headers: list[dict[str, bytes]],
    runtime: Mapping[str, bytes],
    code: str,
    description: SystemDescription,
    target: Path,
) -> None:
    guid = f"{{{code[:8]}-{code[8:12]}-{code[12:16]}-{code[16:20]}-{code[20:32]}}}"
    config = _config(glue)
    xml = merged_description(glue, documents, config, guid, IDENTIFIER, description.default_experiment)
    platform = native_platform()
    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="thsa-cosim-merge-") as scratch:
        folder = Path(scratch)
        for name, content in runtime.items():
            (folder / name).write_bytes(content)
        for k, files in enumerate(headers):
            (folder / f"c{k}").mkdir()
            for name, content in files.items():
                (folder / f"c{k}" / name).write_bytes(content)
            (folder / f"c{k}.c").write_text(member_source(k))
        (folder / "model_config.h").write_text(config)
        (folder / "model.c").write_text(merged_source(glue))
        (folder / "model_start.c").write_text(f'#include "model.h"\nconst char model_guid[] = "{guid}";\n')
        sources = sorted(path.name for path in folder.glob("*.c"))
        library = folder / f"{IDENTIFIER}{platform.suffix}"
        _compile(folder, sources, platform, library)
        draft = folder / "system.fmu"
        with zipfile.ZipFile(draft, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("modelDescription.xml", xml)
            archive.write(library, f"binaries/{platform.fmi2}/{library.name}")
        partial = target.with_name(f"{target.name}.part")
        shutil.copyfile(draft, partial)
        partial.replace(target)


def _compile(folder: Path, sources: list[str], platform: Platform, library: Path) -> None:
    try:
        compile_library(folder, sources, platform, library)
    except ThsaCosimError as error:
        command = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
        if command is None or sys.platform == "win32":
            raise NotMergeable(str(error)) from None
        flags = ("-std=c99", "-O2", "-shared", "-fPIC", "-fvisibility=hidden", "-ffp-contract=off", "-I.")
        done = subprocess.run(
            [command, *flags, *sources, "-o", str(library), "-lm"], cwd=folder, capture_output=True
        )
        if done.returncode:
            raise NotMergeable("the C compiler failed") from None
