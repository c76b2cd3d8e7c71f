"""Texts as start values: parameters and inputs of type String, and the files that an FMU reads."""

import numpy as np
import pytest
from fmu_sources.build import texts

from thsa_cosim.errors import ParameterError
from thsa_cosim.fmu import Plant
from thsa_cosim.fmu.failure import SimulationFailure
from thsa_cosim.signals import Signals

TIME = np.linspace(0.0, 1.0, 11)
RAMP = Signals(TIME, {"u": TIME}, held=frozenset({"u"}))


def slope(plant: Plant, **given: str) -> float:
    plant.texts = given
    found = plant.run({}, RAMP, ["y"], TIME)["y"]
    return float(found[-1])


@pytest.mark.parametrize(
    ("version", "curve", "expected"),
    [
        ("1", "steep", 5.0),
        ("1 exchange", "μ", 2.0),
        ("2", "steep", 7.0),
        ("3", "steep", 7.0),
        ("3", "Steigung für μ", 11.0),
    ],
)
def test_a_text_is_set_and_files_of_the_resources_are_read(version: str, curve: str, expected: float) -> None:
    with Plant.open(texts(version)) as plant:
        assert slope(plant) == 1.0
        assert slope(plant, curve=curve) == expected
        assert slope(plant, curve=curve, mode="twice") == 2.0 * expected
        assert slope(plant) == 1.0  # nothing of an earlier run is left


@pytest.mark.parametrize("version", ["2", "3"])
def test_an_instance_that_is_reset_gets_its_texts_again(version: str) -> None:
    with Plant.open(texts(version), reuse="reset") as plant:
        assert [slope(plant, curve="steep"), slope(plant, curve="steep"), slope(plant)] == [7.0, 7.0, 1.0]


def test_a_text_that_the_fmu_refuses_is_a_failed_run() -> None:
    with Plant.open(texts("2")) as plant, pytest.raises(SimulationFailure, match="EnterInitializationMode"):
        slope(plant, curve="no such curve")


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("u", "7", "u is a continuous Real and takes no text"),
        ("curve", "a\0b", "null character"),
    ],
)
def test_what_takes_no_text_is_refused(name: str, text: str, message: str) -> None:
    with Plant.open(texts("2")) as plant, pytest.raises(ParameterError, match=message):
        slope(plant, **{name: text})


def test_a_number_for_a_text_is_refused() -> None:
    with (
        Plant.open(texts("2")) as plant,
        pytest.raises(ParameterError, match="curve is of type String; only numbers"),
    ):
        plant.run({"curve": 1.0}, RAMP, ["y"], TIME)
