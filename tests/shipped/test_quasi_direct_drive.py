"""Parts added to a quasi-direct drive and taken away again: ``compare`` names them, and nothing else."""

import re
from pathlib import Path

import pytest

from thsa_cosim.cli import run_command
from thsa_cosim.report.compare import Comparison, compare

from . import quasi_direct_drive as drive

MODEL = Path(__file__).with_name("QuasiDirectDrive.mo")
SCENARIO = """
kind = "identify"
fmu = "drive.fmu"
seed = 1
[recordings]
fit = ["bare.csv"]
time = {column = "time_s", unit = "s"}
[recordings.columns]
q_ref = {column = "reference_rad", unit = "rad"}
q = {column = "angle_rad", unit = "rad"}
w = {column = "speed_rad_s", unit = "rad/s"}
i = {column = "current_A", unit = "A"}
"""
#: Name, unit, lower and upper bound, scale.
PARAMETERS = (
    ("J", "kg.m2", 8e-4, 2e-2, "log"),
    ("T_c", "N.m", 0.03, 0.75, "log"),
    ("b", "N.m.s/rad", 2e-3, 0.05, "log"),
    ("mu", "1", 0.0, 0.2, "linear"),
    ("c", "N.m/rad", -2.0, 2.0, "linear"),
    ("T_d", "s", 4e-4, 0.01, "log"),
    ("T_f", "s", 2e-4, 0.01, "log"),
)


@pytest.fixture(scope="module")
def studies(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of the bare drive, of it with each part, and of the bare one again."""
    folder = tmp_path_factory.mktemp("bench")
    assert run_command(["export", str(MODEL), "-o", str(folder / "drive.fmu")]) == 0
    tables = (
        f'[[parameters]]\nname = "{name}"\nvariable = "{name}"\nunit = "{unit}"\nlower = {low}\nupper = {high}\n'
        f'scale = "{scale}"\n'
        for name, unit, low, high, scale in PARAMETERS
    )
    (folder / "bench.toml").write_text(SCENARIO + "".join(tables))
    for seed, name in enumerate(("bare", *drive.PARTS)):
        label = name if seed else "again"
        drive.record(name, folder / f"{label}.csv", seed)
        given = ["identify", str(folder / "bench.toml"), "--fit", str(folder / f"{label}.csv")]
        assert run_command([*given, "-o", str(folder / "studies" / label), "--workers", "1", "--quiet"]) == 0
    return folder / "studies"


def moved(found: Comparison) -> dict[str, tuple[float, float]]:
    """What differs beyond chance: difference and standard error, by name."""
    both = {row.name: row.differences[1] for row in found.rows if row.beyond(found.limit)}
    return {name: (d.value, d.stderr) for name, d in both.items() if d is not None and d.stderr is not None}


@pytest.mark.nightly
@pytest.mark.parametrize("part", ["disc", "spring", "bearing"])
@pytest.mark.parametrize("added", [True, False], ids=["added", "removed"])
def test_the_part_is_named_with_its_size_and_nothing_else_is(studies: Path, part: str, added: bool) -> None:
    pair = [studies / "bare", studies / part]
    found = compare(pair if added else pair[::-1])
    true = drive.PARTS[part]
    assert set(moved(found)) == set(true)
    for name, (difference, stderr) in moved(found).items():
        size = true[name] if added else -true[name]
        assert difference == pytest.approx(size, abs=0.1 * abs(size) + 3.0 * stderr)
        assert re.search(rf"\b{name} {'rose' if added else 'fell'} ", found.sentence())


@pytest.mark.nightly
def test_the_same_drive_again_has_not_changed(studies: Path) -> None:
    found = compare([studies / "bare", studies / "again"])
    assert moved(found) == {}
    assert found.sentence().startswith("No value differs beyond chance")
