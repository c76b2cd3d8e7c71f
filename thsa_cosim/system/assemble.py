"""A system from its parts as a scenario names them, written as an SSP archive that stands where an FMU stands."""

import hashlib
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from thsa_cosim.errors import FmuError, did_you_mean
from thsa_cosim.fmu.archive import sha256_of
from thsa_cosim.fmu.description import DefaultExperiment, FmuDescription
from thsa_cosim.fmu.description import read_description as read_fmu
from thsa_cosim.system.description import SystemDescription, describe_system
from thsa_cosim.system.structure import (
    Component,
    Connection,
    Connector,
    Execution,
    System,
    checked,
    default_execution,
)
from thsa_cosim.system.write import write_ssp

_STEP = 1e-3
"""Communication step of a component whose FMU suggests none [s]."""


@dataclass(frozen=True)
class Part:
    """One component as it is asked for."""

    name: str
    fmu: Path
    execution: Execution | None = None
    step: float | None = None
    delay: float = 0.0
    start: Mapping[str, float] = field(default_factory=dict)
    jitter: float = 0.0
    process: Literal["shared", "own"] = "shared"


@dataclass(frozen=True)
class Wire:
    """One connection as it is asked for: ``<component>.<variable>`` at both ends."""

    source: str
    target: str
    factor: float = 1.0
    offset: float = 0.0
    convert: bool = True
    disturbance: str = ""


def assemble(
    name: str,
    parts: Sequence[Part],
    wires: Sequence[Wire],
    connectors: Mapping[str, Sequence[str]],
    coupling_tolerance: float | None = None,
) -> tuple[System, dict[str, bytes]]:
    """Return the checked system and the archives of its components by source.

    Raises FmuError in one sentence: unknown names, two writers, units that do not convert, a missing interface.
    """
    names = [part.name for part in parts]
    archives: dict[str, bytes] = {}
    components = []
    for part in parts:
        fmu = read_fmu(part.fmu)
        source = f"resources/{sha256_of(part.fmu)[:16]}/{part.fmu.name}"
        archives[source] = part.fmu.read_bytes()
        execution: Execution = part.execution or default_execution(fmu, part.step)
        step = part.step
        if step is None and execution == "coupled":
            step = fmu.default_experiment.step or _STEP
        components.append(
            Component(
                part.name,
                fmu,
                source,
                execution,
                dict(part.start),
                step,
                part.delay,
                part.jitter,
                part.process,
            )
        )

    by_name = {component.name: component.fmu for component in components}
    links = [
        Connection(_pin(w.source, names), _pin(w.target, names), w.factor, w.offset, w.convert, w.disturbance)
        for w in wires
    ]
    outside = [
        _connector(shown, [_pin(pin, names) for pin in pins], by_name) for shown, pins in connectors.items()
    ]
    made = System(
        name,
        tuple(components),
        tuple(links),
        tuple(outside),
        coupling_tolerance=coupling_tolerance,
    )
    return checked(made), archives


def _pin(text: str, names: Sequence[str]) -> tuple[str, str]:
    for name in sorted(names, key=len, reverse=True):
        if text.startswith(name + "."):
            return name, text[len(name) + 1 :]
    first = text.partition(".")[0]
    raise FmuError(
        f"{text!r} names no component of the system; write <component>.<variable> with one of: {', '.join(names)}."
        f"{did_you_mean(first, names)}"
    )


def _connector(name: str, pins: Sequence[tuple[str, str]], fmus: Mapping[str, FmuDescription]) -> Connector:
    kinds = {fmus[part].variable(variable).causality for part, variable in pins}
    causality = "input" if kinds == {"input"} else "output"
    return Connector(name, causality, tuple((pin, 1.0, 0.0) for pin in pins))  # type: ignore[arg-type]


def system_folder() -> Path:
    """Folder in the user's cache where systems are kept by their content."""
    base = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    return Path(base).expanduser() / "thsa-cosim" / "systems"


def assembled(
    name: str,
    parts: Sequence[Part],
    wires: Sequence[Wire],
    connectors: Mapping[str, Sequence[str]],
    coupling_tolerance: float | None = None,
) -> SystemDescription:
    """Write the system as an archive into the user's cache folder, named after its content, and describe it."""
    system, archives = assemble(name, parts, wires, connectors, coupling_tolerance)
    folder = system_folder()
    stops = [c.fmu.default_experiment.stop for c in system.components if c.fmu.default_experiment.stop]
    experiment = DefaultExperiment(0.0, max(stops, default=None))
    try:
        folder.mkdir(parents=True, exist_ok=True)
        draft = write_ssp(system, archives, folder / f"{os.getpid()}.ssp", experiment)
        digest = hashlib.sha256(draft.read_bytes()).hexdigest()
        final = folder / digest[:24] / f"{name}.ssp"
        final.parent.mkdir(exist_ok=True)
        draft.replace(final)
    except OSError as error:
        raise FmuError(
            f"the system cannot be kept in {folder} ({error.strerror or error}); set XDG_CACHE_HOME to another folder."
        ) from None
    return describe_system(system, final, digest, experiment)
