"""The commented scenario: it loads and runs as it is, and says what to change for more."""

import json
import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from thsa_cosim.draft.match import Match, match_columns
from thsa_cosim.errors import ParameterError, did_you_mean
from thsa_cosim.fmu import FmuDescription, Variable
from thsa_cosim.recordings.columns import FoundColumn, find_columns, time_column, unused_columns
from thsa_cosim.units import same_dimension

_MOST_PARAMETERS = 60
"""So many of the FMU's parameters are listed."""


@dataclass(frozen=True)
class Draft:
    """The ``text`` of a scenario, and what it rests on.

    ``matches``: what is driven and compared. ``constant``: inputs without a column. ``unused``: why a column of the
    file holds no usable numbers.
    """

    text: str
    matches: tuple[Match, ...]
    constant: tuple[Variable, ...]
    unmatched_columns: tuple[FoundColumn, ...]
    unmatched_outputs: tuple[Variable, ...]
    unused: Mapping[str, str] = field(default_factory=dict)

    @property
    def is_driven(self) -> bool:
        """Whether a column that changes drives the model, beside its loads and temperatures."""
        inputs = (m for m in self.matches if m.variable.causality == "input" and not m.column.constant)
        return any(not _is_temperature(m.variable) and not _is_load(m.variable) for m in inputs)

    @property
    def undriven(self) -> tuple[Variable, ...]:
        """Inputs that command or load the model, but have no column, or one that never changes."""
        still = tuple(
            m.variable for m in self.matches if m.variable.causality == "input" and m.column.constant
        )
        return tuple(v for v in (*self.constant, *still) if not _is_temperature(v) and not _is_load(v))


def draft_scenario(
    fmu: FmuDescription, recordings: Sequence[Path], target: Path, identify: Sequence[str] = ()
) -> Draft:
    """Draft a scenario for an FMU and recordings that share their columns; it simulates, or identifies ``identify``.

    Parameters
    ----------
    recordings
        Files of one format; the first is looked into.
    target
        Where the scenario will stand: its paths are relative to it.
    identify
        Parameters of the FMU, each ``NAME`` or ``NAME=LOWER:UPPER`` with its bounds in the FMU's unit; left out, these
        are a fifth and five times the start value, within the FMU's own limits.

    Raises
    ------
    RecordingError
        If the first recording cannot be read, or holds no column of numbers.
    ParameterError
        If ``identify`` names no parameter, or gives no bounds that could be searched.
    """
    found = find_columns(recordings[0])
    return draft_from_columns(fmu, found, recordings, target, unused_columns(recordings[0], found), identify)


def draft_from_columns(
    fmu: FmuDescription,
    columns: Sequence[FoundColumn],
    recordings: Sequence[Path],
    target: Path,
    unused: Mapping[str, str] | None = None,
    identify: Sequence[str] = (),
) -> Draft:
    """Draft as :func:`draft_scenario`, from columns that were found."""
    columns = [column for column in columns if _is_name(column.name)]
    time = time_column(columns)
    rest = [column for column in columns if column is not time]
    outputs = [v for v in fmu.outputs if v.type != "String" and not v.is_array and _is_name(v.name)]
    inputs = [v for v in fmu.inputs if v.is_float and not v.is_array and _is_name(v.name)]
    matches = match_columns([*inputs, *outputs], rest)
    taken = {match.variable.name for match in matches}
    constant = tuple(v for v in inputs if v.name not in taken and not v.may_stay_open)
    unmatched_outputs = tuple(v for v in outputs if v.name not in taken)
    used = {match.column.name for match in matches}
    unmatched_columns = tuple(c for c in rest if c.name not in used)
    temperature = next((m for m in matches if m.variable in inputs and _is_temperature(m.variable)), None)
    parts = [
        _head(fmu, recordings, target, bool(identify)),
        _time(time),
        *(_signal(match, match is temperature) for match in matches),
        *(_constant(variable) for variable in constant),
        _left_out(unmatched_columns, unmatched_outputs, unused or {}),
        _temperature(temperature),
        _fixed(fmu),
        _simulation(fmu),
        "\n".join(_parameter(fmu, asked) for asked in identify) or _identify(fmu),
    ]
    text = "\n".join(part for part in parts if part)
    return Draft(text, matches, constant, unmatched_columns, unmatched_outputs, unused or {})


def _head(fmu: FmuDescription, recordings: Sequence[Path], target: Path, identifies: bool) -> str:
    listed = ", ".join(_quoted(_relative(path, target)) for path in recordings)
    kind = "identify" if identifies else "simulate"
    what = "simulates the FMU once per recording and compares"
    end = "See at the end for what to change to identify parameters."
    title = "simulated against measured"
    if identifies:
        what, end = "identifies the parameters at its end", "Look at their bounds first."
        title = "parameters from recordings"
    return f"""\
# A first scenario for {_plain(fmu.path.name)}, drafted by thsa-cosim init. It {what}:
# thsa-cosim {kind} {_plain(target.name)}
# docs/scenario.md lists every key. {end}
kind = {_quoted(kind)}
title = {_quoted(f"{fmu.model_name}: {title}")}
fmu = {_quoted(_relative(fmu.path, target))}

[recordings]
fit = [{listed}]
validate = []            # held out: only scored, never fitted
"""


def _time(time: FoundColumn | None) -> str:
    if time is None:
        return "# No time column: every channel brings its own time.\n"
    unit = time.unit or "s"
    known = "" if time.unit else "  # assumed: neither the file nor the name says"
    return f"[recordings.time]\ncolumn = {_quoted(time.name)}\nunit = {_quoted(unit)}{known}\n"


def _signal(match: Match, is_temperature: bool) -> str:
    variable, column = match.variable, match.column
    role = "input" if variable.causality == "input" else "output, compared"
    lines = [
        f"# {role}: {_plain(variable.description) or _plain(variable.name)}; matched {match.why}",
        f"[recordings.columns.{_key(variable.name)}]",
        f"column = {_quoted(column.name)}",
    ]
    if column.unit is not None:
        origin = "" if column.stated else "  # from the column's name"
        lines.append(f"unit = {_quoted(column.unit)}{origin}")
    elif variable.unit:
        lines.append(f"unit = {_quoted(variable.unit)}  # assumed: the FMU's; the file does not say")
    if is_temperature:
        lines.append('smooth = "mean"')
    elif variable.causality == "input" and column.silent:
        lines.append('interpolation = "hold"  # it has no noise: a command that stays until the next sample')
        return "\n".join(lines) + "\n"
    elif variable.causality == "input" and column.noise > 0.0:
        noise = f"{column.noise:.2g} {column.unit or ''}".rstrip()
        lines.append(f'# smooth = "piecewise-linear"  # plateaus and ramps below its noise of about {noise}')
    if variable.causality == "input" and not is_temperature:
        lines.append('# interpolation = "hold"  # if a controller holds the value until the next sample')
    return "\n".join(lines) + "\n"


def _constant(variable: Variable) -> str:
    unit = [f"unit = {_quoted(variable.unit)}"] if variable.unit else []
    return (
        "\n".join(
            [
                f"# input: {_plain(variable.description) or _plain(variable.name)}; no column fits, so it is constant",
                f"[recordings.columns.{_key(variable.name)}]",
                f"value = {_number(variable.start)}",
                *unit,
            ]
        )
        + "\n"
    )


def _left_out(columns: Sequence[FoundColumn], outputs: Sequence[Variable], unused: Mapping[str, str]) -> str:
    lines = []
    if unused:
        lines.append("# Columns that cannot be used:")
        lines += [f"#   {_plain(name)}: {_plain(reason)}" for name, reason in unused.items()]
    if columns:
        lines.append("# Columns that no variable fits:")
        lines += [f"#   {_plain(c.name)}{f' [{_plain(c.unit)}]' if c.unit else ''}" for c in columns]
    if outputs:
        lines.append("# Outputs of the FMU without a column; to compare one, give its column:")
        for variable in outputs:
            unit = f", unit = {_quoted(variable.unit)}" if variable.unit else ""
            lines.append(
                f'#   [recordings.columns.{_key(variable.name)}]  column = "..."{unit}'
                f"  # {_plain(variable.description)}".rstrip(" #")
            )
    return "\n".join(lines) + "\n" if lines else ""


def _temperature(match: Match | None) -> str:
    if match is None:
        return ""
    return (
        "# Recordings are grouped by the mean of this input.\n"
        f"[temperature]\ninput = {_quoted(match.variable.name)}\nround_to = 1.0\n"
    )


def _fixed(fmu: FmuDescription) -> str:
    known = [v for v in fmu.parameters if v.is_float and not v.is_array]
    lines = ["# Start values for every run, in the FMU's units.", "[fixed]"]
    for variable in known[:_MOST_PARAMETERS]:
        about = f"  # {_about(variable)}" if _about(variable) else ""
        lines.append(f"# {_key(variable.name)} = {_number(variable.start)}{about}")
    if len(known) > _MOST_PARAMETERS:
        lines.append(f"# ... and {len(known) - _MOST_PARAMETERS} more in the FMU's modelDescription.xml")
    return "\n".join(lines) + "\n"


def _simulation(fmu: FmuDescription) -> str:
    tolerance = fmu.default_experiment.tolerance if fmu.default_experiment else None
    shown = _number(tolerance or 1e-6)
    return (
        "[simulation]\n"
        f"# tolerance = {shown}      # relative; left out: the FMU's own\n"
        "# step = 0.001           # s between communication points; left out: the recording's samples\n"
        "deadline = 60.0          # s; a run that takes longer counts as failed\n"
    )


def _identify(fmu: FmuDescription) -> str:
    example = next((v for v in fmu.parameters if v.is_float and not v.is_array), None)
    if example is None:
        return ""
    start = example.start or 1.0
    low, high = sorted((0.2 * start, 5.0 * start))
    unit = example.unit or "1"
    return f"""\
# To identify parameters: set kind = "identify" above, run thsa-cosim identify, and take one of these per parameter.
# [[parameters]]
# name = {_quoted(re.sub(r"[^A-Za-z0-9_]+", "_", example.name))}
# variable = {_quoted(example.name)}
# unit = {_quoted(unit)}
# lower = {_number(low)}
# upper = {_number(high)}
# scale = "linear"         # or "log", for bounds that span decades
"""


def _parameter(fmu: FmuDescription, asked: str) -> str:
    """A ``[[parameters]]`` table for ``NAME`` or ``NAME=LOWER:UPPER``."""
    name, _, bounds = asked.partition("=")
    known = {v.name: v for v in fmu.parameters if v.is_float and not v.is_array}
    if name not in known:
        raise ParameterError(f"{fmu.path} has no parameter {name!r} to identify.{did_you_mean(name, known)}")
    variable = known[name]
    low, high = _bounds(variable, bounds, fmu.path)
    scale = "log" if low > 0.0 and high > 20.0 * low else "linear"
    about = f"# {_about(variable)}\n" if _about(variable) else ""
    return f"""\
{about}[[parameters]]
name = {_quoted(re.sub(r"[^A-Za-z0-9_]+", "_", name))}
variable = {_quoted(name)}
unit = {_quoted(variable.unit or "1")}
lower = {low:.9g}
upper = {high:.9g}
scale = {_quoted(scale)}         # "log" for bounds that span decades
"""


def _bounds(variable: Variable, asked: str, path: Path) -> tuple[float, float]:
    start = float(variable.start or 0.0)
    low, high = sorted((0.2 * start, 5.0 * start))
    if asked:
        try:
            low, high = (float(part) for part in asked.split(":"))
        except ValueError:
            raise ParameterError(
                f"The bounds {asked!r} of {variable.name!r} are not LOWER:UPPER, such as 0.1:5."
            ) from None
    else:
        low = low if variable.minimum is None else max(low, variable.minimum)
        high = high if variable.maximum is None else min(high, variable.maximum)
    if not (low < high and math.isfinite(low) and math.isfinite(high)):
        raise ParameterError(
            f"{path}: {variable.name!r} starts at {start:g}, which gives no bounds to search; add them as"
            f" {variable.name}=LOWER:UPPER."
        )
    return low, high


def _is_name(name: str) -> bool:
    """Whether a scenario can hold the name."""
    return re.fullmatch(r"[^\x00-\x1f\x7f]+", name) is not None


def _is_load(variable: Variable) -> bool:
    """Whether a variable is a force or torque, which may well be none."""
    return bool(variable.unit) and any(same_dimension(str(variable.unit), u) for u in ("N", "N.m"))


def _is_temperature(variable: Variable) -> bool:
    return bool(variable.unit) and same_dimension(str(variable.unit), "K")


def _about(variable: Variable) -> str:
    unit = f"[{_plain(variable.unit)}]" if variable.unit else ""
    return " ".join(part for part in (unit, _plain(variable.description)) if part)


def _relative(path: Path, target: Path) -> str:
    """``path`` as seen from the scenario, absolute if it lies far away."""
    try:
        relative = Path(os.path.relpath(path.resolve(), target.resolve().parent)).as_posix()
    except ValueError:  # another drive
        return path.resolve().as_posix()
    return relative if relative.count("../") <= 3 else path.resolve().as_posix()


def _quoted(text: str) -> str:
    """A TOML string: JSON's escapes are TOML's, except for the delete character."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _quoted(name)


def _plain(text: str | None) -> str:
    """Text that cannot leave its comment."""
    return " ".join("".join(c if c.isprintable() else " " for c in text or "").split())


def _number(value: float | None) -> str:
    """A TOML float: Python's shortest digits, which always hold a dot or an exponent; 0 for none."""
    return repr(float(value)) if value is not None and math.isfinite(value) else "0.0"
