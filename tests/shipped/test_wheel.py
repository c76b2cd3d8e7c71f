"""Wheel and sdist, built and tried in a bare environment and an empty folder: nothing of the checkout is in reach."""

import os
import subprocess
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def run(*words: object, folder: Path, ok: bool = True) -> str:
    """Run a command; return what it printed. PYTHONPATH would bring the checkout back."""
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
    done = subprocess.run(
        [str(w) for w in words], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert (done.returncode == 0) is ok, done.stderr
    return done.stdout + done.stderr


@pytest.fixture(scope="module")
def bare(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A wheel built from the sdist, and the ``bin`` of an environment that has nothing but it and what it needs."""
    folder = tmp_path_factory.mktemp("wheel")
    python = venv_python(folder / "env")
    code = "from setuptools.build_meta import build_sdist; import sys; build_sdist(sys.argv[1])"
    run(python, "-m", "pip", "install", "--quiet", "setuptools>=77", "plotly>=6.0", folder=folder)
    run(python, "-c", code, folder, folder=ROOT)
    sdist = next(folder.glob("*.tar.gz"))
    run(python, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", folder, sdist, folder=folder)
    wheel = next(folder.glob("*.whl"))
    used = venv_python(folder / "used")
    run(used, "-m", "pip", "install", "--quiet", wheel, folder=folder)
    return wheel, used.parent


def venv_python(folder: Path) -> Path:
    """Make an empty environment; return its interpreter."""
    venv.create(folder, with_pip=True)
    return folder / "bin" / "python"


@pytest.mark.slow
def test_the_wheel_holds_the_shipped_data_and_stays_small(bare: tuple[Path, Path]) -> None:
    with zipfile.ZipFile(bare[0]) as archive:
        held = set(archive.namelist())
    for folder in ("modelica", "fmus", "scenarios"):
        own = [
            p.relative_to(ROOT).as_posix()
            for p in (ROOT / folder).rglob("*")
            if p.is_file() and "studies" not in p.parts
        ]
        assert own
        assert {f"thsa_cosim/_shipped/{name}" for name in own} <= held
    assert not any(name.startswith(("tests", "docs", "modelica")) for name in held)
    assert bare[0].stat().st_size < 12e6


@pytest.mark.slow
def test_the_wheel_is_the_product_in_an_empty_folder(bare: tuple[Path, Path], tmp_path: Path) -> None:
    command = bare[1] / "thsa-cosim"
    assert "0." in run(command, "--version", folder=tmp_path)
    run(command, "example", "screw", folder=tmp_path)
    scenario = tmp_path / "scenarios" / "screw.toml"
    text = scenario.read_text().replace("population = 45", "population = 5")
    scenario.write_text(text.replace("generations = 30", "generations = 1"))
    said = run(command, "identify", scenario, "-o", "study", "--workers", "2", folder=tmp_path)
    assert said.count("thsa-cosim[notebook]") == 1  # no PNG files
    assert (
        tmp_path / "study" / "report.html"
    ).stat().st_size > 1_000_000  # plotly's script came with the wheel
    said = run(command, "export", "THSA.Screw", folder=tmp_path, ok=False)
    assert "pip install 'thsa-cosim[export]'" in said
    run(command, "list", "--json", folder=tmp_path)
    code = "import thsa_cosim as tc; tc.open_study('study').parameters"
    said = run(bare[1] / "python", "-c", code, folder=tmp_path, ok=False)
    assert "pip install 'thsa-cosim[notebook]'" in said
    size = sum(p.stat().st_size for p in bare[1].parent.rglob("*") if p.is_file() and not p.is_symlink())
    assert size < 500e6
