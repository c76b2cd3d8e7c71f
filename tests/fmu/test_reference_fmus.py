"""The Modelica Association's Reference FMUs, built from their C sources: every interface agrees with the references.

Set REFERENCE_FMUS to a check-out of https://github.com/modelica/Reference-FMUs; without it these tests are skipped.
"""

import csv
import os
import zipfile
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from thsa_cosim.errors import FmuError
from thsa_cosim.fmu import Plant, read_description
from thsa_cosim.fmu.sources import compile_sources
from thsa_cosim.fmu.variable import NUMBERS

ROOT = Path(os.environ.get("REFERENCE_FMUS", ""))
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not (ROOT / "BouncingBall").is_dir(), reason="REFERENCE_FMUS names no check-out"),
]
MODELS = [
    (model, version)
    for model in ("BouncingBall", "Dahlquist", "Feedthrough", "Resource", "Stair", "VanDerPol")
    for version in (2, 3)
] + [("StateSpace", 3)]
EULER = {"BouncingBall": 5e-2, "Dahlquist": 6e-2, "VanDerPol": 0.15, "StateSpace": 2e-2}
"""Of the range, where not 1e-9: Model Exchange is exact, the references are fixed steps of forward Euler."""
STEPPED = {"StateSpace": 2e-2, "BouncingBall": 1e-6, "VanDerPol": 1e-6, "Dahlquist": 1e-6}


def build(model: str, version: int, folder: Path) -> Path:
    """Zip the sources as the project's own build does, and compile them here."""
    path = folder / f"{model}{version}-sources.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.write(ROOT / model / f"FMI{version}.xml", "modelDescription.xml")
        for name in (
            f"src/fmi{version}Functions.c",
            "src/cosimulation.c",
            f"{model}/config.h",
            f"{model}/model.c",
        ):
            archive.write(ROOT / name, f"sources/{Path(name).name}")
        for header in (ROOT / "include").glob("*.h"):
            archive.write(header, f"sources/{header.name}")
        if version == 2:
            includes = "".join(f'#include "{n}"\n' for n in ("fmi2Functions.c", "model.c", "cosimulation.c"))
            archive.writestr("sources/all.c", f"#define FMI_VERSION 2\n{includes}")
        else:
            archive.write(ROOT / model / "buildDescription.xml", "sources/buildDescription.xml")
        if model == "Resource":
            archive.write(ROOT / model / "y.txt", "resources/y.txt")
    return compile_sources(path, folder / f"{model}{version}.fmu")


def reference(model: str) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Times and signals of the reference; arrays as their elements, texts left out."""
    with (ROOT / model / f"{model}_out.csv").open() as file:
        header, *rows = list(csv.reader(file))
    signals: dict[str, np.ndarray] = {}
    for name, column in zip(header[1:], list(zip(*rows, strict=True))[1:], strict=True):
        cells = [[{"true": "1", "false": "0"}.get(c, c) for c in cell.split(" ")] for cell in column]
        try:
            table = np.array(cells, dtype=float)
        except ValueError:
            continue
        names = [name] if table.shape[1] == 1 else [f"{name}[{i + 1}]" for i in range(table.shape[1])]
        signals |= dict(zip(names, table.T, strict=True))
    return np.array([float(row[0]) for row in rows]), signals


@pytest.mark.parametrize("kind", ["co-simulation", "model-exchange"])
@pytest.mark.parametrize(("model", "version"), MODELS)
def test_agrees_with_its_reference(model: str, version: int, kind: str, tmp_path: Path) -> None:
    path = build(model, version, tmp_path)
    description = read_description(path)
    time, expected = reference(model)
    names = [n for n in expected if n in description.variables and description.variable(n).type in NUMBERS]
    assert names
    _, unique = np.unique(time, return_index=True)  # an event has two rows: the last one counts
    last = np.append(unique[1:], len(time)) - 1
    for backend in ("python", "compiled"):
        with Plant.open(path, kind=kind, backend=backend) as plant:  # type: ignore[arg-type]
            found = plant.run({}, None, names, time[last], tolerance=1e-8)
        for name in names:
            wanted = expected[name][last]
            scale = max(float(np.ptp(wanted)), 1e-12 + 1e-9 * float(np.max(np.abs(wanted))))
            error = np.abs(found[name] - wanted)
            if model == "Stair":  # steps at whole seconds: a row may lie on either side
                error = error[np.abs(time[last] - np.round(time[last])) > 1e-9]
            share = float(np.max(error)) / scale
            if model == "BouncingBall":  # a bounce a little earlier or later: nearly all rows
                share = float(np.quantile(error, 0.9)) / scale
            allowed = (EULER if kind == "model-exchange" else STEPPED).get(model, 1e-9)
            assert share < allowed, (name, share)


def test_the_stiff_one_agrees_with_an_independent_integration(tmp_path: Path) -> None:
    """Robertson's chemical reaction; its reference in the repository is another model's."""
    path = build("Roberts", 3, tmp_path)
    time = np.linspace(0.0, 40.0, 41)
    with Plant.open(path, kind="model-exchange") as plant:
        found = plant.run({}, None, ["y1", "y2", "y3"], time, tolerance=1e-9)

    def rhs(_: float, y: np.ndarray) -> list[float]:
        slow, fast = 0.04 * y[0] - 1e4 * y[1] * y[2], 3e7 * y[1] ** 2
        return [-slow, slow - fast, fast]

    exact = solve_ivp(rhs, (0.0, 40.0), [1.0, 0.0, 0.0], "Radau", time, rtol=1e-10, atol=1e-14).y
    for name, wanted in zip(("y1", "y2", "y3"), exact, strict=True):
        assert np.max(np.abs(found[name] - wanted)) < 1e-5 * np.max(np.abs(wanted))


def test_elements_of_arrays_are_set_and_drive(tmp_path: Path) -> None:
    """dx/dt = A x + B u, y = C x + D u with A = -1, B = 1, C = 1, D = 0 and a step of u[2]."""
    path = build("StateSpace", 3, tmp_path)
    values = {f"A[{i},{i}]": -1.0 for i in (1, 2, 3)} | {f"D[{i},{i}]": 0.0 for i in (1, 2, 3)}
    values |= {"u[1]": 0.0, "u[2]": 2.0, "u[3]": 0.0}
    time = np.linspace(0.0, 3.0, 31)
    with Plant.open(path, kind="model-exchange") as plant:
        found = plant.run(values, None, ["y[1]", "y[2]", "y[3]"], time, tolerance=1e-9)
    assert np.max(np.abs(found["y[1]"])) < 1e-9
    assert np.max(np.abs(found["y[2]"] - 2.0 * (1.0 - np.exp(-time)))) < 1e-6
    assert np.max(np.abs(found["y[3]"])) < 1e-9


def test_scheduled_execution_alone_is_refused_with_the_reason(tmp_path: Path) -> None:
    path = tmp_path / "Clocks.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.write(ROOT / "Clocks" / "FMI3.xml", "modelDescription.xml")
    with pytest.raises(FmuError, match="but Scheduled Execution"):
        read_description(path)
