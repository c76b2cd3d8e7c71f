"""Declared model + effects → a new Modelica class → a new FMU.

The class extends the declared one and redeclares its slots; each slot gets a block that adds up the effects there, so
that one and several effects have the same form, and the superset that the search runs is made the same way (decision
004).
"""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from thsa_cosim.diagnosis.catalogue.candidate import Candidate
from thsa_cosim.diagnosis.catalogue.slots import INJECTED, INPUTS, OPTIONAL, OUTPUTS, Slot
from thsa_cosim.errors import ModelicaError
from thsa_cosim.export import export_fmu
from thsa_cosim.export.compile import native_platform
from thsa_cosim.export.flatten import locate
from thsa_cosim.study import export_digest, is_made_from, keep, note_made_from, take_kept

#: Extended models are named after their own class; the system model of the shipped package goes by the package's name.
KNOWN_AS = {"THSA.Actuator": "THSA"}

#: What the terms of an empirical law go by in the name of a model; the term follows after a slash.
EMPIRICAL_NAME = "empirical"


def extended_class(
    name: str,
    base: str,
    candidates: Sequence[Candidate],
    values: Mapping[str, float] | None = None,
    description: str = "",
    beside: str = "",
    injection: bool = False,
) -> str:
    """Modelica source of a class ``name`` that extends ``base`` (qualified) with the candidates' effects.

    ``values``: start values by FMU variable, in SI units as the classes have them; else neutral. ``beside``: source of
    classes that are in no package (`source_beside`). ``injection``: every friction slot can follow a measured speed.
    """
    slots = {candidate.slot.name: candidate.slot for candidate in candidates}
    injected = {name for name, slot in slots.items() if injection and slot.interface == INJECTED}
    blocks = [
        _block(slot, [c for c in candidates if c.slot.name == name], values or {}, name in injected)
        for name, slot in slots.items()
    ]
    inputs = [
        f'  THSA.Interfaces.RealInput {slots[name].measured} "Measured speed: {name}";\n'
        for name in sorted(injected)
    ]
    redeclared = ",\n    ".join(
        f"redeclare {_block_name(slot)} {slot.component}"
        + (f"(v_m = {slot.measured})" if n in injected else "")
        for n, slot in slots.items()
    )
    return (
        f'within ;\n{beside}model {name} "{description or base}"\n'
        + "".join([*blocks, *inputs])
        + f"  extends {base}(\n    {redeclared});\nend {name};\n"
    )


def _block_name(slot: Slot) -> str:
    return slot.name[0].upper() + slot.name[1:] + "Effects"


def _block(
    slot: Slot, candidates: Sequence[Candidate], values: Mapping[str, float], injected: bool = False
) -> str:
    """The block of a slot; candidates of one component, such as the terms of a law, set its parameters together.

    ``injected``: with a force against the speed's deviation from a measured one.
    """
    members = {c.component: c for c in candidates}
    titles = dict.fromkeys(c.effect.title for c in members.values())
    lines = [f'  block {_block_name(slot)} "{", ".join(titles)}"']
    lines.append(f"    extends THSA.Interfaces.{slot.interface};")
    for component, member in members.items():
        own = {p.name: p for c in candidates if c.component == component for p in c.all_parameters}
        modifiers = [
            f'{p.name}(unit="{p.unit}") = {values.get(p.variable, p.at_start)!r}' for p in own.values()
        ]
        modifiers += [f"{v} = {v}" for v in OPTIONAL.get(slot.interface, ())]
        lines.append(f"    {member.qualified_block} {component}({', '.join(modifiers)});")
    terms = {v: [f"{component}.{v}" for component in members] for v in OUTPUTS[slot.interface]}
    if injected:
        lines.append('    THSA.Interfaces.RealInput v_m "Measured speed";')
        lines.append(
            '    parameter Real g_m = 0 "Output injection: force per speed beyond the measured one";'
        )
        terms["F"].append("(if g_m > 0 then g_m*(v - v_m) else 0)")
    lines.append("  equation")
    for component in members:
        lines += [f"    {component}.{v} = {v};" for v in INPUTS[slot.interface]]
    lines += [f"    {output} = {' + '.join(parts)};" for output, parts in terms.items()]
    return "\n".join([*lines, f"  end {_block_name(slot)};\n"])


def write_extended(folder: Path, name: str, source: str) -> Path:
    """Write ``<folder>/<name>.mo``; its folder holds nothing else that a Modelica compiler would load with it."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.mo"
    path.write_text(source, encoding="utf-8")
    return path


def export_kept(folder: Path, name: str, source: str, package: Path) -> Path:
    """Have the class ``name`` of ``source`` in ``folder`` as ``.mo`` and ``.fmu``, for this machine; the ``.fmu``.

    It is exported anew once anything that it is made from has changed; until then the study keeps it, and the user's
    cache for other studies.
    """
    fmu, platforms = folder / f"{name}.fmu", (native_platform().fmi3,)
    made_from = export_digest(source, package, platforms)
    if not is_made_from(fmu, made_from):
        file = write_extended(folder, name, source)
        if not take_kept(fmu, made_from):
            export_fmu(str(file), package=package, output=fmu, platforms=platforms)
            keep(fmu, made_from)
        note_made_from(fmu, made_from)
    return fmu


def write_extended_model(
    folder: Path, model: str, package: Path, candidates: Sequence[Candidate], values: Mapping[str, float]
) -> tuple[Path, Path]:
    """Write the class that holds the candidates with their ``values``, and export it; (.mo, .fmu) in ``folder``.

    The FMU is for this machine: compilers of other platforms are only started when somebody asks for them.
    """
    base = qualified(model, package)
    effects = list(dict.fromkeys(c.effect.name.split("/")[0] for c in candidates))
    own = KNOWN_AS.get(base, base.split(".")[-1])
    name = "_and_".join([f"{own}_with_{effects[0]}", *effects[1:]]).replace("-", "_")
    titles = ", ".join(dict.fromkeys(c.effect.title for c in candidates))
    source = extended_class(
        name, base, candidates, values, f"{base} with: {titles}", source_beside(model, package)
    )
    file = write_extended(folder, name, source)
    fmu = folder / f"{name}.fmu"
    return file, export_fmu(str(file), package=package, output=fmu, platforms=(native_platform().fmi3,))


def qualified(model: str, package: Path) -> str:
    """``Actuator`` → ``THSA.Actuator``; of a ``.mo`` file the class that it holds."""
    if model.endswith(".mo"):
        return locate(model, package)[1]
    return model if model.split(".")[0] == package.name else f"{package.name}.{model}"


def source_beside(model: str, package: Path) -> str:
    """The classes of a ``.mo`` file, to stand above the class that extends one of them; "" for a class of a package.

    ModelicaError for a file that is part of a package.
    """
    if not model.endswith(".mo"):
        return ""
    name = qualified(model, package)
    if "." in name:
        raise ModelicaError(
            f"{model}: holds the class {name} of a package; set diagnose.package to the package's folder and"
            f' diagnose.model to "{name}".'
        )
    return (
        re.sub(r"^\s*within\s*;", "", Path(model).read_text(encoding="utf-8"), count=1, flags=re.M).strip()
        + "\n"
    )
