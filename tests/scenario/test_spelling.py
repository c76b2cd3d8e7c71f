"""A misspelling anywhere in a scenario ends with one sentence that holds the right spelling.

Every key and every name or choice in a valid scenario of each kind is misspelt in turn.
"""

import copy
import fnmatch
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from small_scenario import toml, valid, write_folder

from thsa_cosim.diagnosis.catalogue.known import choose, known_effects
from thsa_cosim.errors import InputError
from thsa_cosim.export.flatten import locate
from thsa_cosim.scenario import load
from thsa_cosim.units import is_unit, same_dimension

ROOT = Path(__file__).parents[2]
SCENARIOS = ROOT / "scenarios"

#: Texts and names that are the author's own: nothing is there to misspell.
FREE = {"title", "description", "name"}
FREE_KEYS = {"compare"}


def typo(word: str) -> str:
    """``word`` with its last letter doubled: ``columnn``, ``rad/ss``, ``runs/cold_*.csvv``."""
    place = max((k for k, c in enumerate(word) if c.isalpha()), default=0)
    return word[: place + 1] + word[place:]


def places(here: Any, path: tuple[str | int, ...] = ()) -> Iterator[tuple[tuple[str | int, ...], bool]]:
    """Every place of a word in nested tables: its path, and whether the key (or the text there) is meant."""
    if isinstance(here, dict):
        for key, value in here.items():
            if not (path and path[-1] in FREE_KEYS) and len(key) > 1:
                yield (*path, key), True
            if key not in FREE:
                yield from places(value, (*path, key))
    elif isinstance(here, list):
        for k, value in enumerate(here):
            yield from places(value, (*path, k))
    elif isinstance(here, str) and len(here) > 2:
        yield path, False


def misspelt(data: dict[str, Any], path: tuple[str | int, ...], is_key: bool) -> tuple[dict[str, Any], str]:
    """The scenario with the word at ``path`` misspelt, and the right word."""
    data = copy.deepcopy(data)
    here: Any = data
    for part in path[:-1]:
        here = here[part]
    last = path[-1]
    if not is_key:
        word = here[last]
        here[last] = typo(word)
        return data, str(word)
    content = dict(here)
    here.clear()
    here.update({typo(k) if k == last else k: v for k, v in content.items()})
    return data, str(last)


def small() -> dict[str, Any]:
    data = valid()
    data["recordings"]["columns"]["w_cmd"]["interpolation"] = "linear"
    data["recordings"]["columns"]["w_cmd"]["smooth"] = "piecewise-linear"
    data["recordings"]["columns"]["w_cmd"]["noise"] = 0.1
    data["recordings"]["parts"] = [{"name": "begin", "use": "fit", "stop": 0.3}]
    data["force"] = {"position": "w_m", "force": "i_q", "mass": "motor.J", "band": 10.0, "period": 0.1}
    data["parameters"][1]["zero"] = ["motor.gain"]
    data["cost"]["also"] = ["huber"]
    data["search"]["profile"] = ["R_s"]
    data["simulation"]["interface"] = "co-simulation"
    return data


def simulate() -> dict[str, Any]:
    data = small()
    for key in ("parameters", "search", "force"):
        del data[key]
    return data | {"kind": "simulate", "outputs": ["flux"]}


def tune() -> dict[str, Any]:
    data = tomllib.loads((SCENARIOS / "schedule.toml").read_text())
    table4 = tomllib.loads((SCENARIOS / "table4.toml").read_text())
    data |= {key: table4[key] for key in ("line", "surface")}
    return data | {"fmu": str(SCENARIOS / data["fmu"])}


def stages() -> dict[str, Any]:
    scenarios = [{"scenario": "first.toml", "give": ["R_s"]}, {"scenario": "second.toml"}]
    return {"kind": "identify", "title": "both", "seed": 2, "stages": scenarios}


def is_still_right(kind: str, path: tuple[str | int, ...], is_key: bool) -> bool:
    """Whether the misspelling is another unit of the same dimension: ``g.mm2``."""
    _, word = misspelt(KINDS[kind], path, is_key)
    return path[-1] == "unit" and not is_key and is_unit(typo(word)) and same_dimension(typo(word), word)


def diagnose() -> dict[str, Any]:
    data = small()
    del data["force"]
    data["diagnose"] = {
        "model": "THSA.Actuator",
        "package": str(ROOT / "modelica" / "THSA"),
        "effects": ["windage"],
        "most": 2,
        "spread": 0.1,
        "command": "w_cmd",
        "load": "T_amb",
        "empirical": False,
        "balances": [
            {
                "name": "mechanical",
                "unit": "A",
                "left": "i_q",
                "terms": ["der(w_m)", "w_m"],
                "moving": "w_m",
                "band": 9.0,
            }
        ],
    }
    data["parameters"][0]["spread"] = 0.1
    return data | {"kind": "diagnose"}


def black_box() -> dict[str, Any]:
    data = diagnose()
    for key in ("model", "package"):
        del data["diagnose"][key]
    data["diagnose"]["blackbox"] = {"motor_speed": "w_m", "current": "i_q"}
    return data


KINDS = {"identify": small(), "simulate": simulate(), "tune": tune(), "stages": stages()}
KINDS |= {"diagnose": diagnose(), "black box": black_box()}
CASES = [
    (kind, *place)
    for kind, data in KINDS.items()
    for place in places(data)
    if not is_still_right(kind, *place)
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("spelling")
    write_folder(path)
    (path / "first.toml").write_text(toml(small()))
    (path / "second.toml").write_text(toml(simulate()))
    return path


def loaded(path: Path, kind: str) -> object:
    scenario = load(path)
    spec = getattr(scenario, "diagnose", None)
    if spec is not None:  # what the diagnosis itself looks up, before it runs anything
        choose(known_effects(spec.catalogue), spec.effects, "diagnose.effects")
        if spec.model is not None:
            locate(spec.model, spec.package)
    return scenario


def test_every_section_is_misspelt() -> None:
    sections = {".".join(str(p) for p in path if isinstance(p, str)) for _, path, is_key in CASES if is_key}
    assert {
        "recordings.time",
        "recordings.columns",
        "temperature",
        "fixed",
        "parameters.law",
        "cost.channels",
    } <= sections
    assert {
        "cost.window",
        "search",
        "simulation",
        "command",
        "conditions",
        "metrics",
        "requirements",
    } <= sections
    assert {
        "before",
        "compare",
        "loop",
        "robust",
        "schedule.check",
        "pareto",
        "line",
        "surface",
        "stages",
    } <= sections


@pytest.mark.parametrize("kind", KINDS)
def test_the_right_spelling_loads(folder: Path, kind: str) -> None:
    path = folder / f"{kind}.toml"
    path.write_text(toml(KINDS[kind]))
    assert loaded(path, kind)


@pytest.mark.parametrize(
    ("kind", "path", "is_key"),
    CASES,
    ids=[f"{k}-{'.'.join(map(str, p))}{'' if i else '='}" for k, p, i in CASES],
)
def test_a_misspelling_gets_the_right_spelling(
    folder: Path, kind: str, path: tuple[str | int, ...], is_key: bool
) -> None:
    data, word = misspelt(KINDS[kind], path, is_key)
    file = folder / "misspelt.toml"
    file.write_text(toml(data))
    with pytest.raises(InputError) as caught:
        loaded(file, kind)
    message = str(caught.value)
    assert "\n" not in message
    meant = re.search(r"Did you mean '([^']*)'\?", message)
    assert meant, message
    assert any(same(meant[1], word) for same in (equal, same_file, same_unit)), message


def equal(meant: str, word: str) -> bool:
    return meant == word or meant in re.findall(r"\w+", word)  # in a formula, the name that is wrong


def same_file(meant: str, word: str) -> bool:
    return fnmatch.fnmatch(meant, Path(word).name)


def same_unit(meant: str, word: str) -> bool:
    return is_unit(meant) and is_unit(word) and same_dimension(meant, word)
