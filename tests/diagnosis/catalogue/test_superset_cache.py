"""The superset that a study keeps: exported anew once anything that it is made from has changed, and only then."""

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from thsa_cosim.diagnosis.catalogue import superset
from thsa_cosim.diagnosis.catalogue.known import known_effects
from thsa_cosim.diagnosis.catalogue.superset import SizesReducer, build_superset
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


@pytest.mark.parametrize("change", CHANGES)
def test_the_superset_is_exported_anew_for_what_it_is_made_from(
    change: str, package: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    exported = []

    def fake(model: str, *, output: Path, **_: object) -> Path:
        exported.append(model)
        output.write_bytes(b"an FMU")
        return output

    monkeypatch.setattr(superset, "export_fmu", fake)
    effects = [known_effects()["windage"]]
    times, touch = CHANGES[change]
    fmu, *_ = build_superset("Actuator", package, effects, tmp_path / "kept")
    touch(package, fmu)
    build_superset("Actuator", package, effects, tmp_path / "kept")
    assert len(exported) == times


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


def test_sizes_of_signals_in_closed_form() -> None:
    time = np.linspace(0.0, 2.0, 2001)
    signals = Signals(time, {"z": 3.0 * np.sin(2.0 * np.pi * time), "F": np.full(time.size, -2.0)})
    largest, squares, count, travel = SizesReducer(("z", "F"))(signals).reshape(-1, 4).T
    np.testing.assert_allclose(largest, [3.0, 2.0])
    np.testing.assert_allclose(squares / count, [4.5 * 2000 / 2001, 4.0])
    np.testing.assert_allclose(travel, [24.0, 0.0])
