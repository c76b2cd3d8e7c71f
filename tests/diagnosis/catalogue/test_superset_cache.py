"""The superset that a study keeps, and leaves to others: exported anew once anything that it is made from has changed.

Only then: neither for a study that goes on nor for another study of the same user.
"""

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from thsa_cosim.diagnosis.catalogue import extend, superset
from thsa_cosim.diagnosis.catalogue.known import known_effects
from thsa_cosim.diagnosis.catalogue.superset import build_superset
from thsa_cosim.fmu import Plant
from thsa_cosim.signals import Signals

PACKAGE = Path(__file__).parents[3] / "modelica" / "THSA"
WINDAGE = "Effects/Windage.mo"


@pytest.fixture
def package(tmp_path: Path) -> Path:
    return Path(shutil.copytree(PACKAGE, tmp_path / "THSA"))


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")


CHANGES: dict[str, tuple[int, Callable[[Path, Path], None]]] = {
    "nothing": (1, lambda package, fmu: None),
    "an effect's block": (2, lambda package, fmu: edit(package / WINDAGE, "equation", "equation // edited")),
    "another class": (2, lambda package, fmu: edit(package / "Motor.mo", "equation", "equation // edited")),
    "a further class": (
        2,
        lambda package, fmu: (package / "More.mo").write_text("within THSA; block More end More;") and None,
    ),
    "a damaged FMU": (2, lambda package, fmu: fmu.write_bytes(b"torn") and None),
    "a lost FMU": (2, lambda package, fmu: fmu.unlink()),
}


@pytest.fixture
def exported(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[str]:
    """What an exporter that writes no real FMU was called for, with an empty cache of the user's."""
    models: list[str] = []

    def export(model: str, *, output: Path, **_: object) -> Path:
        models.append(model)
        output.write_bytes(b"an FMU")
        return output

    monkeypatch.setattr(extend, "export_fmu", export)
    monkeypatch.setenv("THSA_COSIM_CACHE", str(tmp_path / "cache"))
    monkeypatch.delenv("MODELICAPATH", raising=False)
    return models


@pytest.mark.parametrize("change", CHANGES)
def test_the_superset_is_exported_anew_for_what_it_is_made_from(
    change: str, exported: list[str], package: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("THSA_COSIM_CACHE", "")
    effects = [known_effects()["windage"]]
    times, touch = CHANGES[change]
    fmu, *_ = build_superset("Actuator", package, effects, tmp_path / "kept")
    touch(package, fmu)
    build_superset("Actuator", package, effects, tmp_path / "kept")
    assert len(exported) == times


@pytest.mark.parametrize("change", CHANGES)
def test_another_study_exports_only_what_no_study_has_exported(
    change: str, exported: list[str], package: Path, tmp_path: Path
) -> None:
    effects = [known_effects()["windage"]]
    times, touch = CHANGES[change]
    first, *_ = build_superset("Actuator", package, effects, tmp_path / "first")
    touch(package, first)
    second, *_ = build_superset("Actuator", package, effects, tmp_path / "second")
    assert len(exported) == (
        1 if change.endswith("FMU") else times
    )  # the first study's own copy may be damaged
    assert second.read_bytes() == b"an FMU"
    assert {path.name for path in second.parent.iterdir()} == {
        f"{second.stem}{ending}" for ending in (".fmu", ".mo", ".made-from.json")
    }


@pytest.mark.slow
def test_an_edited_effect_acts_as_it_now_says(package: Path, tmp_path: Path) -> None:
    effects = [known_effects()["windage"]]

    def speed() -> np.ndarray:
        fmu, slots, chosen = build_superset("Actuator", package, effects, tmp_path / "kept")
        found = superset.candidates_of(chosen, slots, {})
        time = np.linspace(0.0, 0.5, 51)
        inputs = {"v_cmd": np.full(51, 6e-3), "F_load": np.full(51, 1e4), "T_amb": np.full(51, 20.0)}
        with Plant.open(fmu) as plant:
            values = {p.variable: 1e-6 for c in found for p in c.coefficients}
            return np.asarray(plant.run(values, Signals(time, inputs), ("i_q",), time)["i_q"])

    before = speed()
    assert np.array_equal(speed(), before)
    text = (package / WINDAGE).read_text(encoding="utf-8")
    (right,) = [line for line in text.splitlines() if line.strip().startswith("F =")]
    edit(package / WINDAGE, right, right.replace("then b_q", "then 2*b_q"))
    assert not np.allclose(speed(), before, rtol=1e-6, atol=0.0)
