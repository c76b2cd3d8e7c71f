"""The schedule for other tools: compiled C, an FMU of the Modelica block, CSV and JSON against the schedule."""

import csv
import ctypes
import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from thsa_cosim.report.tune.schedule_files import identifier, write_schedule
from thsa_cosim.tune import GainSchedule


def over_temperature() -> GainSchedule:
    nodes = (np.array([-55.0, -30.0, 0.0, 25.0]),)
    gains = {"K_p": np.array([1.1, 0.9, 1.0, 1.3]), "K_i": np.array([90.0, 80.5, 70.0, 1e-05])}
    return GainSchedule(("T_amb",), ("degC",), nodes, gains, {"K_p": "A/(rad/s)", "K_i": "A/rad"})


def over_temperature_and_load() -> GainSchedule:
    nodes = (np.array([-55.0, 25.0, 30.0]), np.array([-55.0, 0.0, 55.0]))
    gains = {"K_p": np.array([[1.0, 2.0, 4.0], [3.0, 1.5, 0.5], [2.5, 2.5, 7.0]])}
    return GainSchedule(("T_amb", "F_load"), ("degC", "kN"), nodes, gains, {"K_p": "1"})


SCHEDULES = pytest.mark.parametrize(
    "schedule", [over_temperature(), over_temperature_and_load()], ids=["1d", "2d"]
)


def places(schedule: GainSchedule) -> list[dict[str, float]]:
    """Nodes, places between them and beyond the ends."""
    rng = np.random.default_rng(3)
    found = [{n: float(row[n]) for n in schedule.names} for row in schedule.points()]
    ends = [(n, x[0] - 20.0, x[-1] + 20.0) for n, x in zip(schedule.names, schedule.nodes, strict=True)]
    found += [{n: float(rng.uniform(low, high)) for n, low, high in ends} for _ in range(200)]
    return found


def compiler() -> list[str] | None:
    for name in ("cc", "gcc", "clang"):
        if shutil.which(name):
            return [name]
    try:
        import ziglang  # noqa: F401
    except ImportError:
        return None
    return [sys.executable, "-m", "ziglang", "cc"]


@SCHEDULES
def test_the_c_header_interpolates_like_the_schedule(tmp_path: Path, schedule: GainSchedule) -> None:
    command = compiler()
    if command is None:
        pytest.skip("no C compiler is there")
    write_schedule(tmp_path, schedule, "odd */ title")
    inputs = ", ".join(f"double {n}" for n in schedule.names)
    arguments = ", ".join(schedule.names)
    body = "".join(f"    out[{k}] = g.{name};\n" for k, name in enumerate(schedule.gains))
    source = tmp_path / "use.c"
    source.write_text(
        '#include "gain_schedule.h"\n'
        f"void use({inputs}, double *out) {{\n    gain_schedule_t g = gain_schedule({arguments});\n{body}}}\n"
    )
    library = tmp_path / "use.so"
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-shared", "-fPIC", "-O1"]
    done = subprocess.run(
        [*command, *flags, "-o", library, source], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr
    use = ctypes.CDLL(str(library)).use
    use.argtypes = [ctypes.c_double] * len(schedule.names) + [ctypes.c_void_p]
    use.restype = None
    for place in places(schedule):
        out = np.empty(len(schedule.gains))
        use(*place.values(), out.ctypes.data)
        assert out == pytest.approx(list(schedule.at(place).values()), rel=1e-12), place


@SCHEDULES
def test_the_modelica_block_becomes_an_fmu_that_interpolates_alike(
    tmp_path: Path, schedule: GainSchedule
) -> None:
    from thsa_cosim.export import export_fmu
    from thsa_cosim.fmu import Plant
    from thsa_cosim.signals import Signals

    write_schedule(tmp_path, schedule, 'gains "over" conditions')
    fmu = export_fmu(
        str(tmp_path / "GainSchedule.mo"),
        package=tmp_path,
        output=tmp_path / "GainSchedule.fmu",
        platforms=["x86_64-linux"],
    )
    points = places(schedule)[:40]
    time = np.arange(len(points), dtype=float)
    columns = {n: np.array([p[n] for p in points]) for n in schedule.names}
    with Plant.open(fmu) as plant:
        found = plant.run({}, Signals(time, columns), list(schedule.gains), time)
    for name in schedule.gains:
        expected = [schedule.at(p)[name] for p in points]
        assert found[name] == pytest.approx(np.array(expected), rel=1e-9)


@SCHEDULES
def test_csv_and_json_hold_the_nodes(tmp_path: Path, schedule: GainSchedule) -> None:
    write_schedule(tmp_path, schedule, "title")
    with (tmp_path / "schedule.csv").open() as file:
        header, *rows = list(csv.reader(file))
    assert len(header) == len(schedule.names) + len(schedule.gains)
    assert [[float(v) for v in row] for row in rows] == [list(p.values()) for p in schedule.points()]
    content = json.loads((tmp_path / "schedule.json").read_text())
    assert [c["name"] for c in content["conditions"]] == list(schedule.names)
    assert content["gains"]["K_p"]["values"] == schedule.gains["K_p"].tolist()


def test_names_become_identifiers() -> None:
    assert identifier("load.F é") == "load_F__"
    assert identifier("2nd") == "_2nd"
