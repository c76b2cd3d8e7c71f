"""The command ``demo``: every main command on the shipped data, step by step."""

import importlib.util
import json
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from thsa_cosim.cli.options import PATH, console
from thsa_cosim.errors import StudyError

_EXAMPLES = ("motor", "table4", "driven")
_NEEDED = (*(f"scenarios/{name}.toml" for name in _EXAMPLES), "modelica/THSA")
#: Temperatures of the motor bench that are identified: a double exponential needs four.
_SOME, _FEW = ("m55", "m40", "m20", "p00", "p25"), ("m55", "m30", "p00", "p25")


@dataclass(frozen=True)
class Step:
    """One command of the demo: why it is there, its words, and what came out as sentences."""

    title: str
    why: str
    words: tuple[str, ...]
    outcome: Callable[[], list[str]]
    folder: Path | None = None
    """Where its page is, if it is a study."""
    needs_exporter: bool = False
    picture: str = ""
    """File name of the plot that shows what came out."""


@click.command(short_help="Run every main command on the shipped data.")
@click.option(
    "-o",
    "--output",
    type=PATH,
    default=Path("demo"),
    show_default=True,
    help="Folder; an existing demo is continued.",
)
@click.option("--quick", is_flag=True, help="Use fewer temperatures and recordings.")
def demo(output: Path, quick: bool) -> None:
    """Run every main command on the shipped data: export, check, identify, tune, diagnose.

    Each step prints its command and its result. The demo takes about a minute on two idle cores. It copies the data
    into the folder, unless this is a checkout of the repository. Open index.html in the folder at the end.
    """
    from rich.text import Text

    from thsa_cosim.fmu.sources import has_compiler
    from thsa_cosim.report.page.index import Entry, write_index

    root = _data(output)
    can_export = importlib.util.find_spec("casadi") is not None and has_compiler()
    steps = _steps(root, output, quick, can_export)
    output.mkdir(parents=True, exist_ok=True)
    out, begin, entries = console(), time.monotonic(), []
    for number, step in enumerate(steps, start=1):
        if step.needs_exporter and not can_export:
            click.echo(
                f"\n{number}/{len(steps)} {step.title}: left out, it needs pip install 'thsa-cosim[export]'."
            )
            continue
        out.print(Text(f"\n{number}/{len(steps)} {step.title}", "bold"), soft_wrap=True)
        click.echo(f"{step.why}\n$ thsa-cosim {' '.join(step.words)}")
        started = time.monotonic()
        _run(step)
        found = step.outcome()
        for sentence in found:
            out.print(Text(f"→ {sentence}", "bold"), soft_wrap=True)
        page = None if step.folder is None else step.folder / "report.html"
        seconds = time.monotonic() - started
        picture = None if step.folder is None else step.folder / "plots" / step.picture
        effects = _effects(step)
        entries.append(Entry(step.title, step.why, step.words, tuple(found), seconds, page, picture, effects))
    index = write_index(output / "index.html", "thsa-cosim: demo on the shipped data", entries)
    click.echo(f"\nThe demo took {time.monotonic() - begin:.0f} s. Open {index}")


def _steps(root: Path, output: Path, quick: bool, can_export: bool) -> list[Step]:
    from thsa_cosim.fmu.native import platform_folders

    scenarios, recordings = root / "scenarios", root / "scenarios" / "recordings"
    fmu = output / "THSA.fmu" if can_export else root / "fmus" / "THSA.fmu"
    checked = output / "check.json"
    host = ("--platforms", platform_folders("3.0")[0])
    fit = [w for t in (_FEW if quick else _SOME) for w in ("--fit", str(recordings / f"motor_{t}.parquet"))]
    one = ["--fit", str(recordings / "undeclared_fit_1.parquet")]
    one += ["--validate", str(recordings / "undeclared_validate_1.parquet")]
    identify, tune, diagnose = (output / name for name in ("identify", "tune", "diagnose"))
    return [
        Step(
            "Export the actuator's Modelica model as an FMU",
            "The equations become C code with an exact Jacobian; the .fmu file holds it and a solver.",
            ("export", "THSA.Actuator", "--package", str(root / "modelica" / "THSA"), *host, "-o", str(fmu)),
            lambda: [f"{fmu.name} of {fmu.stat().st_size / 1e6:.1f} MB"],
            needs_exporter=True,
        ),
        Step(
            "Check what the FMU can be trusted with",
            "Compares repeated runs, runs after a reset and runs with a smaller step. Do this with every FMU.",
            ("check", str(fmu), "-o", str(checked)),
            lambda: _checked(checked),
        ),
        Step(
            "Identify the motor from its bench recordings, over temperature",
            "Least squares from several starts finds four parameters at each temperature; a law over temperature is "
            "fitted to each.",
            ("identify", str(scenarios / "motor.toml"), *fit, "-o", str(identify)),
            lambda: _identified(identify),
            identify,
            picture="laws.png",
        ),
        Step(
            "Tune the velocity controller at -30 degC against 55 kN",
            "Differential evolution finds gains for a ramp, with limits on overshoot, current, bandwidth, margins.",
            ("tune", str(scenarios / "table4.toml"), "--fmu", str(fmu), "-o", str(tune)),
            lambda: _tuned(tune),
            tune,
            picture="response_T_amb_-30_degC_F_load_55_kN.png",
        ),
        Step(
            "Diagnose a recording that shows an effect the model lacks",
            "Finds the effect of the catalogue that explains the residual, adds it to the Modelica model, and scores "
            "the result on held-out recordings.",
            ("diagnose", str(scenarios / "driven.toml"), *(one if quick else ()), "-o", str(diagnose)),
            lambda: _diagnosed(diagnose),
            diagnose,
            needs_exporter=True,
            picture="evidence.png",
        ),
    ]


def _result(folder: Path) -> Mapping[str, Any]:
    """What a step's study found."""
    from thsa_cosim.api import open_study

    return open_study(folder).result


def _effects(step: Step) -> tuple[str, ...]:
    """The effects that a diagnosis named."""
    if step.words[0] != "diagnose" or step.folder is None:
        return ()
    return tuple(str(effect["name"]) for effect in _result(step.folder)["effects"])


def _run(step: Step) -> None:
    """Run the step's command here; StudyError if it fails, which it has explained by then."""
    from thsa_cosim.cli.main import run_command

    code = run_command(list(step.words))
    if code == 130:
        raise KeyboardInterrupt
    if code:
        raise StudyError(
            f"The step {step.title!r} failed (exit code {code}); the same command goes on from here."
        )


def _checked(file: Path) -> list[str]:
    content = json.loads(file.read_text(encoding="utf-8"))
    found = {finding["name"]: finding for finding in content["findings"]}
    good = sum(finding["verdict"] == "ok" for finding in found.values())
    told = [f"{n}: {found[n]['text']}" for n in ("communication step", "model exchange") if n in found]
    return [f"verdict: {content['verdict']}, {good} of {len(found)} trials passed", *told]


def _identified(folder: Path) -> list[str]:
    result = _result(folder)
    away = {name: (law.get("largest_deviation") or {}).get("law") for name, law in result["laws"].items()}
    told = ", ".join(f"{name} {100.0 * value:.2g} %" for name, value in away.items() if value is not None)
    ratios: dict[str, list[float]] = {}
    for recording in result["recordings"]:
        for name, error in recording["error"].items():
            ratios.setdefault(name, []).append(error["rmse"] / error["noise"] if error["noise"] else math.nan)
    left = ", ".join(f"{name} {sum(own) / len(own):.2f}" for name, own in ratios.items())
    return [
        f"laws from {len(result['points'])} temperatures deviate from the published laws by at most: {told}",
        f"rmse / noise of the sensors: {left}",
    ]


def _tuned(folder: Path) -> list[str]:
    result = _result(folder)
    before, after, units = result["before"], result["after"], result["units"]
    gains = [f"{n} {before['gains'][n]:.3g} → {v:.3g} {units[n]}" for n, v in after["gains"].items()]
    change = []
    for name in ("rise_time", "steady_state_error", "overshoot"):
        unit = "" if result["term_units"][name] == "1" else f" {result['term_units'][name]}"
        change.append(f"{name.replace('_', ' ')} {before[name]:.3g} → {after[name]:.3g}{unit}")
    return [f"gains: {', '.join(gains)}", f"response: {', '.join(change)}"]


def _diagnosed(folder: Path) -> list[str]:
    result = _result(folder)
    found = [
        f"{effect['name']}: {name} = {value['value']:.3g} ± {_known(value.get('stderr')):.1g} {value['unit']}"
        for effect in result["effects"]
        for name, value in effect["parameters"].items()
    ]
    left = []
    for name, error in result["before"]["validate"].items():
        after = result["after"]["validate"].get(name, error)  # nothing was added: there is no after
        left.append(f"{name} {error['rmse'] / error['noise']:.2f} → {after['rmse'] / after['noise']:.2f}")
    return [f"verdict: {result['verdict']}", *found, f"held-out rmse / noise: {', '.join(left)}"]


def _known(stderr: float | None) -> float:
    return math.nan if stderr is None else stderr


def _data(output: Path) -> Path:
    """Return the folder with the shipped data: this one in a checkout, else ``output``, into which they are copied."""
    if all(Path(name).exists() for name in _NEEDED):
        return Path()
    from thsa_cosim.shipped import copy_example

    for name in _EXAMPLES:
        copy_example(name, output)
    return output
