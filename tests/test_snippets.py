"""Every command and snippet of README, CONTRIBUTING and docs runs, page by page, in a copy of the checkout.

A fenced block ``sh`` is run line by line, the ``python`` blocks of a page as one script. A block ``toml NAME`` is
written to that file; other ``toml`` blocks are fragments, which must fit into a scenario. What takes long is
shortened as ``shorten`` says, nothing else is changed, and what cannot run here stands in ``NOT_RUN`` with a reason.
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

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(DOCS.rglob("*.md"))]

NOT_RUN = {
    r"^python3 -m venv ": "the tests run in an environment already",
    r"^(python -m )?pip install ": "what it installs is installed",
    r"^python -m pytest$": "that is what runs",
    r"^dask (scheduler|worker)": "does not end; tests/test_batch_cluster.py starts both",
    r"--cluster tcp://host:8786$": "needs the two above; tests/test_batch_cluster.py has them",
    r"DATA_EMPS\.mat": "the data may not be shipped; tests/test_emps.py runs it where they are",
}
"""Commands, as regular expressions, that are not run, and why."""
LAST_SECOND = {"motor.toml": 1.1, "driven_check.toml": 1.0, "bench.toml": 1.1}
"""s at which the recordings of a scenario are cut."""
INFEASIBLE = "no gains within the bounds keep every hard requirement"
"""How a tuning that was shortened to ten sets of gains may end."""


def shorten(name: str, table: dict[str, Any]) -> dict[str, Any]:
    """Return the scenario ``name`` with a tiny search, short recordings and few conditions."""
    if table["kind"] in ("identify", "tune") and "stages" not in table:
        table["search"] = {**table.get("search", {}), "population": 5, "generations": 1}
    if name in LAST_SECOND:
        table["recordings"]["time"]["stop"] = LAST_SECOND[name]
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
    for name in ("fmus", "modelica", "thsa_cosim"):
        (folder / name).symlink_to(ROOT / name)
    shutil.copytree(DOCS, folder / "docs")
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
    return [page for page in PAGES if any(block.language == language for block in blocks(page))]


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
        if block.language == "toml" and block.info:
            table = shorten(block.info, tomllib.loads(block.text))
            Path(block.info).write_text(toml(table), encoding="utf-8")
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
    parts = [block.text for block in blocks(page) if block.language == "python"]
    if "DATA_EMPS.mat" in "".join(parts):
        pytest.skip(NOT_RUN[r"DATA_EMPS\.mat"])
    script.write_text("\n".join(parts), encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-W", "error", script.name],
        capture_output=True, text=True, timeout=120, check=False, cwd=checkout,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("page", pages_with("toml"), ids=name_of)
def test_toml_blocks_fit_into_a_scenario(page: Path) -> None:
    for block in blocks(page):
        if block.language != "toml":
            continue
        table = tomllib.loads(block.text)
        if not block.info:
            base = "table4.toml" if {"command", "conditions"} & table.keys() else "motor.toml"
            whole = tomllib.loads((ROOT / "scenarios" / base).read_text(encoding="utf-8"))
            table = merged(whole, table)
        (TuneTable if table["kind"] == "tune" else KINDS[table["kind"]]).model_validate(table)


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
