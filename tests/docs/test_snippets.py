"""Every command and snippet of README, CONTRIBUTING and docs runs, page by page, in a copy of the checkout.

A fenced block ``sh`` is run line by line, the ``python`` blocks of a page as one script. A block that names a file,
such as ``toml bench.toml``, is written to that file, and ``toml +bench.toml`` is added to it; other ``toml`` blocks
are fragments, which must fit into a scenario. What takes long is shortened as ``shorten`` says, nothing else is
changed, and what cannot run here stands in ``NOT_RUN`` with a reason.
"""

import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from small_scenario import toml

from thsa_cosim.cli.main import run_command
from thsa_cosim.scenario.schema import KINDS
from thsa_cosim.scenario.tune_schema import TuneTable

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(DOCS.rglob("*.md"))]

NOT_RUN = {
    r"^python3 -m venv ": "the tests run in an environment already",
    r"^(python -m )?pip install ": "what it installs is installed",
    r"^python -m pytest -n auto$": "that is what runs",
    r"^thsa-cosim demo$": "tests/cli/test_demo.py runs it, shortened as well",
    r"^dask (scheduler|worker)": "does not end; tests/batch/test_cluster.py starts both",
    r"--cluster tcp://host:8786$": "needs the two above; tests/batch/test_cluster.py has them",
    r"^thsa-cosim (list|compare) studies": "about studies of the reader's own; tests/report/test_compare.py runs both",
    r"--library ": "needs a library that is not shipped; tests/export tries it with one of its own",
    r"make_data\.py|dcpm\.toml": "needs such an FMU; tests/docs/test_modelica_library.py runs it where the library is",
    r"benchmarks/article\.py": "two minutes of studies; a nightly test of tests/benchmarks/test_article.py runs it",
    r"scenarios/(servo|cogging|cogging_speed)\.toml|^thsa-cosim identify before/": (
        "minutes of studies; a nightly test of tests/shipped/test_measured_drives.py runs it"
    ),
    r"^thsa-cosim compare '?(before|unit)|MyDrive\.fmu": "the reader's own; tests/report/test_compare.py runs both",
    r"benchmarks/redundant_recordings\.py": "tests/rig/test_redundant_diagnosis.py runs it",
    r"^python benchmarks/mutants\.py$": "takes most of an hour; tests/benchmarks/test_mutants.py tries its report",
    r"DATA_EMPS\.mat": "the data may not be shipped; tests/identify/test_emps.py runs it where they are",
}
"""Commands, as regular expressions, that are not run, and why."""
LAST_SECOND = {"motor.toml": 1.1, "driven_check.toml": 1.0, "bench.toml": 1.1, "driven.toml": 1.5}
"""s at which the recordings of a scenario are cut."""
KIND_OF = {"components": "system", "command": "table4", "conditions": "table4", "diagnose": "driven"}
"""Shipped scenario that a fragment with a table of this name belongs to; else ``motor``."""
FEWER = {
    **{
        f"{bench}.toml": [f"recordings/{bench}_{t}.parquet" for t in ("m55", "m30", "p00", "p25")]
        for bench in ("motor", "screw", "gearbox")
    },
    "driven_check.toml": ["recordings/driven_m30_a.parquet"],
}
"""Recordings of a scenario that are left: four temperatures are the least for the laws."""
INFEASIBLE = "no gains within the bounds keep every hard requirement"
"""How a tuning that was shortened to ten sets of gains may end."""


def shorten(name: str, table: dict[str, Any]) -> dict[str, Any]:
    """Return the scenario ``name`` with a tiny search, few and short recordings, few conditions."""
    if table["kind"] in ("identify", "tune") and "stages" not in table:
        table["search"] = {**table.get("search", {}), "population": 5, "generations": 1}
    if name in LAST_SECOND:
        table["recordings"]["time"]["stop"] = LAST_SECOND[name]
    if name in FEWER:
        role = "fit" if table["recordings"].get("fit") else "validate"
        table["recordings"][role] = FEWER[name]
    if table["kind"] == "diagnose":
        table["diagnose"]["effects"] = ["windage"]
    if "surface" in table:
        table["surface"]["points"] = 3
    if "schedule" in table:
        table["conditions"]["T_amb"]["values"] = [-55.0, 25.0]
        table["schedule"]["check"]["T_amb"]["step"] = 40.0
    return table


@dataclass(frozen=True)
class Block:
    """A fenced block: its language, the rest of its info string, and its text."""

    language: str
    info: str
    text: str

    def write(self) -> None:
        """Write the file that the block names, or add to it."""
        path = Path(self.info.removeprefix("+"))
        path.parent.mkdir(parents=True, exist_ok=True)
        if self.language != "toml":
            path.write_text(self.text, encoding="utf-8")
            return
        table = tomllib.loads(self.text)
        if self.info.startswith("+"):
            table = merged(tomllib.loads(path.read_text(encoding="utf-8")), table)
        else:
            table = shorten(path.name, table)
        path.write_text(toml(table), encoding="utf-8")


def blocks(page: Path) -> list[Block]:
    found = re.findall(r"^```(\w+)([^\n]*)\n(.*?)^```$", page.read_text(encoding="utf-8"), re.M | re.S)
    return [Block(language, info.strip(), text) for language, info, text in found]


def commands(block: Block) -> Iterator[str]:
    """The commands of a ``sh`` block, without comments, continued lines joined, chains taken apart."""
    for line in block.text.replace("\\\n", " ").splitlines():
        for command in shlex.join(shlex.split(line, comments=True)).split(" '&&' "):
            if command:
                yield command.replace(".venv/bin/", "")


def reason_not_to_run(command: str) -> str | None:
    return next((reason for pattern, reason in NOT_RUN.items() if re.search(pattern, command)), None)


def name_of(page: Path) -> str:
    return str(page.relative_to(ROOT))


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of what the snippets use, its scenarios shortened, with a model and a recording of the user's."""
    folder = tmp_path_factory.mktemp("checkout")
    for name in ("fmus", "thsa_cosim"):
        (folder / name).symlink_to(ROOT / name)
    for name in ("docs", "modelica"):  # to which pages add
        shutil.copytree(ROOT / name, folder / name)
    (folder / "scenarios").mkdir()
    (folder / "scenarios" / "recordings").symlink_to(ROOT / "scenarios" / "recordings")
    for scenario in (ROOT / "scenarios").glob("*.toml"):
        table = shorten(scenario.name, tomllib.loads(scenario.read_text(encoding="utf-8")))
        (folder / "scenarios" / scenario.name).write_text(toml(table), encoding="utf-8")
    shutil.copy(ROOT / "tests" / "modelica" / "HarmonicOscillator.mo", folder / "my_model.mo")
    return folder


@pytest.fixture(scope="module")
def already_run() -> set[str]:
    """Commands that stand on several pages run once."""
    return set()


def pages_with(language: str) -> list[Path]:
    return [page for page in PAGES if any(b.language == language and not b.info for b in blocks(page))]


@pytest.mark.slow
@pytest.mark.parametrize("page", pages_with("sh"), ids=name_of)
def test_commands_run(
    page: Path,
    checkout: Path,
    already_run: set[str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(checkout)
    for block in blocks(page):
        if block.info:
            block.write()
        if block.language != "sh":
            continue
        for command in commands(block):
            if command in already_run or reason_not_to_run(command):
                continue
            already_run.add(command)
            program, *arguments = shlex.split(command)
            if program == "thsa-cosim":
                code = run_command(arguments)
                errors = capsys.readouterr().err
            else:
                assert program == "python", f"{command!r} is neither run nor in NOT_RUN"
                done = subprocess.run(
                    [sys.executable, *arguments], capture_output=True, text=True, timeout=120, check=False
                )
                code, errors = done.returncode, done.stderr
            assert code == 0 or (code == 3 and INFEASIBLE in errors), f"{command}: {errors}"


@pytest.mark.slow
@pytest.mark.parametrize("page", pages_with("python"), ids=name_of)
def test_python_blocks_run_as_one_script(page: Path, checkout: Path) -> None:
    script = checkout / "snippets.py"
    parts = [block.text for block in blocks(page) if block.language == "python" and not block.info]
    if "DATA_EMPS.mat" in "".join(parts):
        pytest.skip(NOT_RUN[r"DATA_EMPS\.mat"])
    script.write_text("\n".join(parts), encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-W", "error", script.name],
        capture_output=True, text=True, timeout=120, check=False, cwd=checkout,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("page", pages_with("toml"), ids=name_of)
def test_fragments_fit_into_a_scenario(page: Path) -> None:
    for block in blocks(page):
        if block.language == "toml" and not block.info:
            fragment = tomllib.loads(block.text)
            kind = next((kind for key, kind in KIND_OF.items() if key in fragment), "motor")
            base = tomllib.loads((ROOT / "scenarios" / f"{kind}.toml").read_text(encoding="utf-8"))
            whole = merged(base, fragment)
            (TuneTable if whole["kind"] == "tune" else KINDS[whole["kind"]]).model_validate(whole)


def merged(base: dict[str, Any], fragment: dict[str, Any]) -> dict[str, Any]:
    """``base`` with the fragment's tables laid over it."""
    result = dict(base)
    for key, value in fragment.items():
        inside = isinstance(value, dict) and isinstance(base.get(key), dict)
        result[key] = merged(base[key], value) if inside else value
    return result


def test_nothing_is_left_out_for_a_reason_that_is_gone() -> None:
    said = [c for page in PAGES for b in blocks(page) if b.language == "sh" for c in commands(b)]
    said += [b.text for page in PAGES for b in blocks(page) if b.language == "python"]
    for pattern in NOT_RUN:
        assert any(re.search(pattern, command) for command in said), pattern


def test_every_block_says_what_it_is() -> None:
    known = {"sh", "python", "toml", "text", "modelica", "c", "json", "math"}
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        fences = re.findall(r"^```(.*)$", text, re.M)[::2]
        for fence in fences:
            assert fence.split(" ")[0] in known or fence == "{eval-rst}", f"{name_of(page)}: {fence!r}"
