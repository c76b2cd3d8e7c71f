"""Modelica class → flat scalar variables and equations, by the rumoca compiler.

This is the only file that knows rumoca. The expression trees stay as rumoca gives them; `expression`
reads them.
"""

import hashlib
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from thsa_cosim.errors import MissingExtraError, ModelicaError, did_you_mean, did_you_mean_path

Expression = dict[str, Any]


@dataclass(frozen=True)
class FlatVariable:
    """One scalar variable of the flattened model.

    ``variability`` is "continuous", "parameter" or "constant"; ``causality`` is "input", "output" or
    "local" and counts at the top level only. ``type`` is "Real", "Integer" or "Boolean".
    """

    name: str
    type: str
    variability: str
    causality: str
    unit: str | None
    quantity: str | None
    description: str
    start: Expression | None
    binding: Expression | None
    minimum: Expression | None
    maximum: Expression | None
    nominal: Expression | None
    fixed: bool | None
    final: bool
    state_select: str


@dataclass(frozen=True)
class FlatEquation:
    """A residual (an expression that is zero) and the component it comes from."""

    residual: Expression
    origin: str


@dataclass(frozen=True)
class Experiment:
    """The ``experiment`` annotation: times in s."""

    start: float = 0.0
    stop: float = 1.0
    tolerance: float = 1e-6
    interval: float = 1e-3


@dataclass(frozen=True)
class FlatModel:
    """A flattened Modelica class."""

    name: str
    description: str
    variables: dict[str, FlatVariable]
    equations: tuple[FlatEquation, ...]
    initial_equations: tuple[FlatEquation, ...]
    experiment: Experiment
    source_digest: str


def flatten(model: str, package: Path) -> FlatModel:
    """Flatten a Modelica class.

    Parameters
    ----------
    model:
        Qualified class name (``THSA.Actuator``, or ``Actuator`` for the package at hand) or the path of a
        ``.mo`` file that holds the class.
    package:
        Folder of the Modelica package (it holds ``package.mo``) that the class belongs to or uses.

    Raises
    ------
    ModelicaError
        The class is not found, does not compile, or is outside the exportable subset.
    MissingExtraError
        rumoca is not installed.
    """
    try:
        import rumoca
    except ImportError as error:
        raise MissingExtraError("Exporting a Modelica model", "export") from error
    file, name = locate(model, package)
    session = rumoca.Session(roots=[str(package.parent)] if (package / "package.mo").is_file() else [])
    try:
        flat = session.load(str(file), model=name).to_dict("flat")
    except rumoca.RumocaError as error:
        lines = " ".join(str(error).split())
        raise ModelicaError(f"{file}: class {name} does not compile: {_shorten(lines)}") from error
    return _read(flat, name, file, source_digest(file, package))


def source_digest(file: Path, package: Path) -> str:
    """SHA-256 over the Modelica sources that a class may use: its file and its package, in path order."""
    digest = hashlib.sha256()
    sources = {file.resolve()}
    if (package / "package.mo").is_file():
        sources |= {path.resolve() for path in package.rglob("*.mo")}
    for path in sorted(sources):
        digest.update(path.name.encode() + b"\0" + path.read_bytes().replace(b"\r\n", b"\n") + b"\0")
    return digest.hexdigest()


def locate(model: str, package: Path) -> tuple[Path, str]:
    """File and qualified name of a class given by name or ``.mo`` file; raises ModelicaError if there is none."""
    if model.endswith(".mo"):
        file = Path(model)
        if not file.is_file():
            raise ModelicaError(
                f"{file}: no such file; give a .mo file or a class name such as THSA.Actuator."
            )
        return file, _class_of(file)
    if not (package / "package.mo").is_file():
        raise ModelicaError(
            f"{package}: is no Modelica package (no package.mo); give its folder with --package."
            f"{did_you_mean_path(package)}"
        )
    parts = model.split(".")
    if parts[0] != package.name:
        parts = [package.name, *parts]
    file = package.parent.joinpath(*parts).with_suffix(".mo")
    if not file.is_file():
        known = sorted(
            ".".join(path.relative_to(package.parent).with_suffix("").parts)
            for path in package.rglob("*.mo")
            if path.name != "package.mo"
        )
        raise ModelicaError(f"{package}: holds no class {model!r}.{did_you_mean('.'.join(parts), known)}")
    return file, ".".join(parts)


def _class_of(file: Path) -> str:
    text = re.sub(
        r'//.*|/\*.*?\*/|"(?:\\.|[^"\\])*"',
        " ",
        file.read_text(encoding="utf-8", errors="replace"),
        flags=re.S,
    )
    within = re.search(r"\bwithin\s+([\w.]*)\s*;", text)
    declared = re.search(r"\b(?:model|block|class)\s+(\w+)", text)
    if declared is None:
        raise ModelicaError(f"{file}: declares no model or block; one is needed to export.")
    prefix = within.group(1) + "." if within and within.group(1) else ""
    return prefix + declared.group(1)


def _shorten(text: str, limit: int = 400) -> str:
    return text if len(text) <= limit else text[: limit - 1] + "…"


def _read(flat: dict[str, Any], name: str, file: Path, digest: str) -> FlatModel:
    unsupported = {
        "when_chains": "a when clause",
        "algorithms": "an algorithm section",
        "initial_algorithms": "an initial algorithm section",
        "assert_equations": "an assert",
    }
    for key, what in unsupported.items():
        if key != "assert_equations" and flat[key]:
            raise ModelicaError(f"{file}: class {name} has {what}, which the exporter does not support.")
    if flat["functions"]:
        called = ", ".join(sorted(flat["functions"]))
        raise ModelicaError(
            f"{file}: class {name} calls the function {called}; the exporter supports built-in functions only, "
            "so write the expression out or make it a block."
        )
    types = flat["variable_type_names"]
    finals = flat["variable_final_flags"]
    variables = {
        variable.name: variable
        for key, entry in flat["variables"].items()
        for variable in _scalars(key, entry, types.get(key, "Real"), bool(finals.get(key, False)), file)
    }
    return FlatModel(
        name=name,
        description=flat["model_description"] or "",
        variables=variables,
        equations=tuple(_equation(e) for e in flat["equations"]),
        initial_equations=tuple(_equation(e) for e in flat["initial_equations"]),
        experiment=_experiment(file.read_text(encoding="utf-8", errors="replace")),
        source_digest=digest,
    )


def _equation(entry: dict[str, Any]) -> FlatEquation:
    origin = entry["origin"]
    component = origin.get("ComponentEquation", {}).get("component", "") if isinstance(origin, dict) else ""
    return FlatEquation(entry["residual"], component)


def _scalars(
    key: str, entry: dict[str, Any], type_name: str, final: bool, file: Path
) -> Iterator[FlatVariable]:
    variability, causality = entry["variability"], entry["causality"]
    kind = next(iter(variability)) if isinstance(variability, dict) else "Continuous"
    if kind == "Discrete":
        raise ModelicaError(f"{file}: variable {key} is discrete, which the exporter does not support.")
    if type_name not in ("Real", "Integer", "Boolean"):
        raise ModelicaError(f"{file}: variable {key} has type {type_name}, not Real, Integer or Boolean.")
    role = next(iter(causality)).lower() if isinstance(causality, dict) and "." not in key else "local"
    dims = entry["dims"]
    if len(dims) > 1:
        raise ModelicaError(
            f"{file}: variable {key} has {len(dims)} dimensions; the exporter supports vectors at most."
        )

    def part(attribute: str, index: int | None) -> Expression | None:
        value: Expression | None = entry[attribute]
        if value is None or index is None or "Array" not in value:
            return value
        element: Expression = value["Array"]["elements"][index]
        return element

    fixed = entry["fixed"]
    for index in range(dims[0]) if dims else (None,):
        yield FlatVariable(
            name=key if index is None else f"{key}[{index + 1}]",
            type=type_name,
            variability={"Parameter": "parameter", "Constant": "constant"}.get(kind, "continuous"),
            causality=role if role in ("input", "output") else "local",
            unit=entry["unit"],
            quantity=entry["quantity"],
            description=entry["description"] or "",
            start=part("start", index),
            binding=part("binding", index),
            minimum=part("min", index),
            maximum=part("max", index),
            nominal=part("nominal", index),
            fixed=None if fixed is None else bool(fixed[0 if index is None or len(fixed) == 1 else index]),
            final=final,
            state_select=entry["state_select"].lower(),
        )


def _experiment(source: str) -> Experiment:
    annotation = re.search(r"\bexperiment\s*\(([^)]*)\)", source)
    if annotation is None:
        return Experiment()
    values = {
        key: float(value) for key, value in re.findall(r"(\w+)\s*=\s*([-+.\deE]+)", annotation.group(1))
    }
    default = Experiment()
    return Experiment(
        start=values.get("StartTime", default.start),
        stop=values.get("StopTime", default.stop),
        tolerance=values.get("Tolerance", default.tolerance),
        interval=values.get("Interval", default.interval),
    )
