"""docs/article.md and docs/cold-start.md: every claim of the article beside what our studies find, with the figures.

    python benchmarks/article.py [--studies studies/article] [--check]

Runs the studies that are not finished in ``--studies`` (an interrupted one is continued), takes their numbers, and
writes ``docs/article/numbers.json``, the pictures beside it and the page. ``--check`` writes nothing: it compares the
studies' numbers with the stored ones and ends with exit code 1 if one of them differs by more than its tolerance.
About three minutes of processor time without finished studies.
"""

import argparse
import json
import sys
import tomllib
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
SCENARIOS = ROOT / "scenarios"
PAGE = ROOT / "docs" / "article.md"
COLD_START = ROOT / "docs" / "cold-start.md"
FOLDER = ROOT / "docs" / "article"
sys.path.append(str(HERE))

import article_numbers as numbers
from article_page import cold_start_page, page

#: Studies by folder: command and scenario.
STUDIES = {
    "article": ("identify", "article"),
    "current_alone": ("identify", "motor"),
    "table4": ("tune", "table4"),
    "tuned_at_25": ("tune", "tuned_at_25"),
    "cold_start": ("tune", "cold_start"),
    "profile": ("tune", "profile"),
}
#: Relative difference of two runs that counts: searches end within standard errors, not within rounding.
TOLERANCE = 0.03


def main() -> int:
    """Run what is missing, then write or check."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--studies", type=Path, default=Path("studies/article"))
    parser.add_argument("--check", action="store_true", help="compare with the stored numbers, write nothing")
    given = parser.parse_args()
    folders = {name: given.studies / name for name in STUDIES}
    for name, folder in folders.items():
        run(name, folder)
    results = {name: numbers.read_result(folder) for name, folder in folders.items()}
    found = collect(results)
    if given.check:
        return report(differences(json.loads((FOLDER / "numbers.json").read_text(encoding="utf-8")), found))
    from article_figures import draw_all

    draw_all(folders, results, FOLDER)
    text = json.dumps(found, indent=1, ensure_ascii=False)
    (FOLDER / "numbers.json").write_text(text + "\n", encoding="utf-8")
    PAGE.write_text(page(found), encoding="utf-8")
    COLD_START.write_text(cold_start_page(found), encoding="utf-8")
    print(f"written: docs/{PAGE.name}, docs/{COLD_START.name}, {len(list(FOLDER.glob('*.png')))} pictures")
    return 0


def run(name: str, folder: Path) -> None:
    """Run the study ``name`` in ``folder``, unless it is finished."""
    import thsa_cosim as tc

    if (folder / "result.json").is_file() and numbers.read_result(folder)["status"] == "complete":
        return
    command, scenario = STUDIES[name]
    source: Any = SCENARIOS / f"{scenario}.toml"
    if name == "current_alone":
        source = current_alone(source)
    print(f"{command} {scenario} in {folder}", flush=True)
    getattr(tc, command)(source, folder=folder)


def current_alone(motor: Path) -> dict[str, Any]:
    """The motor bench at −30 °C with the article's objective: the error of i_q, and nothing else."""
    content = tomllib.loads(motor.read_text(encoding="utf-8"))
    content["title"] = "Motor bench at -30 degC: the current's error alone"
    content["fmu"] = str(ROOT / "fmus" / "Motor.fmu")
    content["recordings"]["fit"] = [str(SCENARIOS / "recordings" / "motor_m30.parquet")]
    content["cost"]["channels"] = {"i_q": {"noise": "estimate"}}
    return content


def collect(results: dict[str, numbers.Json]) -> numbers.Json:
    """Every number of the page."""
    benches = results["article"]
    recorded = {r["name"]: r for r in stage_recordings(benches)}
    alone = results["current_alone"]["points"][0]["parameters"]
    return {
        "laws": numbers.laws_numbers(),
        "identified": numbers.identified_numbers(benches),
        "validation": {
            name: numbers.validation_numbers(recorded[f"ramp_m30_{name}"], name)
            for name in ("tuned_at_25", "optimized")
        },
        "recorded": {name: numbers.response(name) for name in ("tuned_at_25", "optimized")},
        "copper_loss": numbers.copper_loss(benches),
        "current_alone": {name: {k: one[k] for k in ("value", "stderr")} for name, one in alone.items()},
        "table4": numbers.tuned_numbers(results["table4"]),
        "tuned_at_25": numbers.tuned_numbers(results["tuned_at_25"]),
        "profile": numbers.tuned_numbers(results["profile"]),
        "start": numbers.start_numbers(results["cold_start"], benches["laws"]),
        "start_gains": results["cold_start"]["gains"],
        "efficiency": numbers.efficiency_numbers(benches),
    }


def stage_recordings(result: numbers.Json) -> list[numbers.Json]:
    """The recordings of all stages of a merged result."""
    return [r for stage in result["stages"].values() for r in stage.get("recordings", [])]


def differences(stored: Any, found: Any, where: str = "") -> list[str]:
    """One line per number that is missing, or differs by more than :data:`TOLERANCE` of its size."""
    if isinstance(stored, dict) and isinstance(found, dict):
        lines = [f"{where}: keys {sorted(set(stored) ^ set(found))}"] if set(stored) != set(found) else []
        return lines + [
            line
            for key in stored.keys() & found.keys()
            for line in differences(stored[key], found[key], f"{where}/{key}")
        ]
    if isinstance(stored, list) and isinstance(found, list) and len(stored) == len(found):
        pairs = zip(stored, found, strict=True)
        return [line for k, (a, b) in enumerate(pairs) for line in differences(a, b, f"{where}/{k}")]
    if isinstance(stored, int | float) and isinstance(found, int | float) and not isinstance(stored, bool):
        near = abs(stored - found) <= max(TOLERANCE * max(abs(stored), abs(found)), 1e-6)
        return [] if near else [f"{where}: stored {stored:.6g}, now {found:.6g}"]
    return [] if stored == found else [f"{where}: stored {stored!r}, now {found!r}"]


def report(lines: list[str]) -> int:
    """Print the differences; the exit code."""
    for line in lines:
        print(line)
    print(f"{len(lines)} numbers differ from docs/article/numbers.json")
    return 1 if lines else 0


if __name__ == "__main__":
    raise SystemExit(main())
