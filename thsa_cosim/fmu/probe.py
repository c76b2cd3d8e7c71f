"""What can be said about an FMU without running it, and what a trial run needs to know."""

import contextlib
import os
import re
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from thsa_cosim.fmu.archive import open_archive
from thsa_cosim.fmu.description import FmuDescription
from thsa_cosim.fmu.native import LIBRARY_SUFFIX, platform_folders
from thsa_cosim.fmu.variable import NUMBERS, Variable
from thsa_cosim.signals import FloatArray, Signals

_STEPS = 2000
"""Communication steps of a trial at most; a longer default experiment takes a multiple of its step."""
_OUTPUTS = 200
"""Variables compared at most."""


@dataclass(frozen=True)
class Facts:
    """What the description says, in plain types."""

    model: str
    fmi_version: str
    tool: str
    interfaces: tuple[str, ...]
    platforms: tuple[str, ...]
    capabilities: Mapping[str, bool | int]
    variables: Mapping[str, tuple[str, ...]]
    """Names by role: input, output, parameter (fixed), tunable parameter."""
    other_variables: int
    states: int
    state_names: tuple[str, ...]
    """In the order of the state vector; empty if the FMU does not name them."""
    started_states: tuple[str, ...]
    """Those that can be given a start value."""
    event_indicators: int

    def to_dict(self) -> dict[str, Any]:
        """Return the facts as JSON types."""
        return {
            "model": self.model,
            "fmi_version": self.fmi_version,
            "tool": self.tool,
            "interfaces": list(self.interfaces),
            "platforms": list(self.platforms),
            "capabilities": dict(self.capabilities),
            "variables": {role: list(names) for role, names in self.variables.items()},
            "other_variables": self.other_variables,
            "states": self.states,
            "state_names": list(self.state_names),
            "started_states": list(self.started_states),
            "event_indicators": self.event_indicators,
        }


def facts(description: FmuDescription) -> Facts:
    """Collect the facts of a description."""
    interfaces = {
        "Co-Simulation": description.supports_co_simulation,
        "Model Exchange": description.supports_model_exchange,
    }
    roles = {
        "input": description.inputs,
        "output": description.outputs,
        "parameter": tuple(v for v in description.parameters if v.variability != "tunable"),
        "tunable parameter": tuple(v for v in description.parameters if v.variability == "tunable"),
    }
    return Facts(
        model=description.model_name,
        fmi_version=description.fmi_version,
        tool=description.tool or "unknown tool",
        interfaces=tuple(name for name, offered in interfaces.items() if offered),
        platforms=description.platforms,
        capabilities=description.capabilities,
        variables={role: tuple(v.name for v in members) for role, members in roles.items()},
        other_variables=len(description.variables) - sum(len(members) for members in roles.values()),
        states=description.states,
        state_names=description.state_names,
        started_states=tuple(n for n in description.state_names if description.variables[n].takes_start),
        event_indicators=description.event_indicators,
    )


def validation_messages(path: Path) -> tuple[str, ...]:
    """Return what fmpy's validation finds wrong with the description, one sentence each."""
    from fmpy.validation import validate_fmu

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            problems = validate_fmu(str(path))
    except Exception as error:  # the validation itself stumbles over some descriptions
        problems = [f"the validation stopped: {type(error).__name__}: {error}"]
    return tuple(_what_differs(" ".join(str(problem).split())) for problem in problems)


def _what_differs(problem: str) -> str:
    """Of two sets of variables, name those that one of them lacks."""
    found = _SETS.fullmatch(problem)
    if found is None:
        return problem
    wanted, there = (dict.fromkeys(found[group].split(", ")) for group in ("wanted", "there"))
    apart = {
        "it lacks": [n for n in wanted if n not in there],
        "it has too much": [n for n in there if n not in wanted],
    }
    said = [
        f"{what} {', '.join(names[:_NAMED])}" + (f" and {len(names) - _NAMED} more" if names[_NAMED:] else "")
        for what, names in apart.items()
        if names
    ]
    return f"{found['where']}: {'; '.join(said)}" if said else problem


_SETS = re.compile(r"(?P<where>.*?)\.? Expected \{(?P<wanted>.*)\} but was \{(?P<there>.*)\}\.?")
_NAMED = 5


def missing_binary(description: FmuDescription) -> str:
    """Return why this machine cannot load the FMU, or an empty string."""
    wanted = platform_folders(description.fmi_version)
    identifiers = {description.co_simulation_identifier, description.model_exchange_identifier} - {None}
    with open_archive(description.path) as archive:
        names = [name.replace("\\", "/") for name in archive.namelist() if not name.endswith("/")]
    files = [name.split("/") for name in names if name.startswith("binaries/") and name.count("/") >= 2]
    folders = sorted({parts[1] for parts in files})
    here = [f"{identifier}{LIBRARY_SUFFIX}" for identifier in sorted(identifiers, key=str)]
    if all(any(parts[1] in wanted and parts[2:] == [file] for parts in files) for file in here):
        return ""
    remedy = "export it for this platform"
    if any(name.startswith("sources/") and name.endswith(".c") for name in names):
        remedy = "it has C sources: `thsa-cosim check --compile OUT.fmu` builds them"
    if set(folders) & set(wanted):
        there = ", ".join(parts[-1] for parts in files if parts[1] in wanted)
        return f"binaries/{wanted[0]} does not hold {' and '.join(here)}, but {there}; {remedy}"
    return f"no library for {wanted[0]} (it has {', '.join(folders) or 'none at all'}); {remedy}"


def trial_time(
    description: FmuDescription,
    *,
    duration: float | None = None,
    step: float | None = None,
    cut: bool = False,
) -> FloatArray:
    """Return the communication points of a trial, (n,) s: the default experiment up to its stop time.

    ``duration`` and ``step`` [s] replace what the FMU declares. More than 2000 steps of the declared size become
    fewer ones of a multiple of it, unless they are ``cut`` short; a ``step`` that is given is kept.
    """
    default = description.default_experiment
    start = default.start or 0.0
    stop = default.stop if default.stop is not None and default.stop > start else start + 1.0
    span = duration or stop - start
    size = step or (default.step if default.step and default.step > 0.0 else span / 500.0)
    count = max(int(np.round(span / size)), 1)
    if step is None and count > _STEPS:
        if cut:
            count = _STEPS
        else:
            size *= int(np.ceil(count / _STEPS))
            count = max(int(np.round(span / size)), 1)
    return np.asarray(start + size * np.arange(count + 1), dtype=np.float64)


def halved(time: FloatArray) -> FloatArray:
    """Return ``time`` with a point in the middle of every step."""
    fine: FloatArray = np.empty(2 * len(time) - 1)
    fine[::2], fine[1::2] = time, 0.5 * (time[1:] + time[:-1])
    return fine


def observed(description: FmuDescription) -> tuple[str, ...]:
    """Return the names to compare: numbers that are outputs; where there are none states, or local variables.

    Whole numbers and Booleans are compared where no output is a floating-point number.
    """
    variables = [v for v in description.variables.values() if v.is_scalar and v.variability != "constant"]
    outputs = [v for v in variables if v.causality == "output"]
    states = {reference for reference, _ in description.state_references}
    choices = (
        [v for v in outputs if v.is_float],
        [v for v in outputs if v.type in NUMBERS],
        [v for v in variables if v.is_float and v.value_reference in states and v.element is None],
        [v for v in variables if v.is_float and v.causality == "local"],
    )
    return next((tuple(v.name for v in choice[:_OUTPUTS]) for choice in choices if choice), ())


def raised_inputs(description: FmuDescription, time: FloatArray) -> Signals | None:
    """Return inputs that ramp up from their start values over the first half of ``time``, None if none can.

    By a tenth of the range or of the start value, or by the nominal value, whichever is declared.
    """
    ramp = np.clip(2.0 * (time - time[0]) / (time[-1] - time[0]), 0.0, 1.0)
    values = {v.name: (v.start or 0.0) + _amplitude(v) * ramp for v in excitable(description)}
    return Signals(time, values) if values else None


_KNOTS = (
    np.array([0.0, 0.08, 0.3, 0.45, 0.6, 0.7, 1.0]),
    np.array([0.0, 0.0, 1.0, 1.0, 0.3, 0.6, 0.6]),
)
"""A course with kinks, from 0 to 1, that comes to rest."""


def excitable(description: FmuDescription) -> tuple[Variable, ...]:
    """Floating-point inputs that need a signal; discrete ones are held from one communication point to the next."""
    return tuple(v for v in description.inputs if v.is_float and not v.is_array and not v.may_stay_open)


def kinked_inputs(
    description: FmuDescription,
    time: FloatArray,
    *,
    ends: Mapping[str, float] | None = None,
    times: float = 1.0,
    only: str | None = None,
    whole: FloatArray | None = None,
) -> Signals | None:
    """Return inputs that run with kinks from their start values, each with a shift of its own; None if none can.

    ``ends``: value that an input runs to, by name; otherwise a tenth of its range or of its start value, or its
    nominal value. ``times`` scales what nobody declared. ``only`` moves that input alone.
    ``whole``: points of the run whose begin ``time`` is; its inputs are cut, and run no faster.
    """
    variables = excitable(description)
    last = (time if whole is None else whole)[-1]
    values = {}
    for k, v in enumerate(variables):
        share = (time - time[0]) / (last - time[0])
        course = np.interp(share - 0.04 * (k % 5), *_KNOTS)
        start = v.start or 0.0
        size = (ends or {}).get(v.name, start + _amplitude(v) * (times if is_undeclared(v) else 1.0)) - start
        values[v.name] = start + size * (course if only in (None, v.name) else 0.0 * course)
    return Signals(time, values) if values else None


def is_undeclared(variable: Variable) -> bool:
    """Whether nothing says how large an input is."""
    return variable.nominal is None and variable.minimum is None and variable.maximum is None


def _amplitude(variable: Variable) -> float:
    start = variable.start or 0.0
    if variable.nominal is not None:
        size = abs(variable.nominal)
    elif variable.minimum is not None and variable.maximum is not None:
        size = 0.1 * (variable.maximum - variable.minimum)
    else:
        size = 0.1 * abs(start) or 1.0
    if variable.maximum is not None and start + size > variable.maximum:
        return -size if variable.minimum is None or start - size >= variable.minimum else 0.0
    return size


def changed_parameters(description: FmuDescription, *, zeros: bool = False) -> dict[str, float]:
    """Return start values 1 % off for floating-point parameters, within their bounds.

    Those that are 0 are left out, or with ``zeros`` come out a little off 0.
    """
    changed = {}
    for v in description.parameters:
        if not v.is_float or v.is_array or v.start is None or not (v.start or zeros):
            continue
        size = 0.01 * v.start or 1e-3 * (v.nominal or 1.0)
        for value in (v.start + size, v.start - size):
            above = v.minimum is None or value >= v.minimum
            if above and (v.maximum is None or value <= v.maximum):
                changed[v.name] = value
                break
    return changed


def footprint(_: Signals) -> FloatArray:
    """Reduce a run to its process: process id, resident bytes, open file handles (NaN where unknown)."""
    resident = handles = np.nan
    with contextlib.suppress(OSError, ValueError):
        page = os.sysconf("SC_PAGE_SIZE")
        resident = int(Path("/proc/self/statm").read_text().split()[1]) * page
        handles = len(list(Path("/proc/self/fd").iterdir()))
    return np.array([os.getpid(), resident, handles], dtype=np.float64)
