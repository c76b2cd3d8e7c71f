"""``parameter_set``: what an SSV file holds reaches the FMU in its type, or is refused in one sentence."""

from pathlib import Path

import numpy as np
import pytest
from fmu_sources.build import strict2, texts

from thsa_cosim.cli import run_command
from thsa_cosim.errors import InputError
from thsa_cosim.scenario import load
from thsa_cosim.simulate import simulate
from thsa_cosim.study.identity import study_identity
from thsa_cosim.study.place import Place

SSV = (
    '<ParameterSet xmlns="http://ssp-standard.org/SSP1/SystemStructureParameterValues"'
    ' xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" version="1.0" name="set">'
    "<Parameters>{}</Parameters>{}</ParameterSet>"
)
ITEMS = '<Enumerations><ssc:Enumeration name="Own"><ssc:Item name="drei" value="3"/></ssc:Enumeration></Enumerations>'


def scenario(folder: Path, fmu: Path, values: str, output: str, fixed: str = "", more: str = "") -> Path:
    (folder / "model.fmu").write_bytes(fmu.read_bytes())
    time = np.arange(101) * 0.01
    rows = "\n".join(f"{t:.2f},{np.sin(3.0 * t):.9f},0" for t in time)
    (folder / "data.csv").write_text(f"t,u,y\n{rows}\n")
    (folder / "set.ssv").write_text(SSV.format(values, more), encoding="utf-8")
    path = folder / "s.toml"
    unit = '\nunit = "m"' if output == "x" else ""
    columns = f'[recordings.columns.u]\ncolumn = "u"\n[recordings.columns.{output}]\ncolumn = "y"{unit}\n'
    path.write_text(
        'kind = "simulate"\nfmu = "model.fmu"\nparameter_set = "set.ssv"\n[recordings]\nfit = ["data.csv"]\n'
        f'[recordings.time]\ncolumn = "t"\nunit = "s"\n{columns}[fixed]\n{fixed}\n'
    )
    return path


def value(name: str, element: str) -> str:
    return f'<Parameter name="{name}"><{element}/></Parameter>'


def simulated(path: Path, output: str) -> np.ndarray:
    (run,) = simulate(load(path), Place(path.parent / "study")).recordings
    assert run.simulated is not None, run.reason
    return np.asarray(run.simulated[output])


@pytest.mark.parametrize(
    ("given", "fixed", "factor"),
    [("steep", "", 7.0), ("flat", "", 1.0), ("steep", 'curve = "flat"', 1.0)],
)
def test_a_string_reaches_the_fmu_and_fixed_wins(
    tmp_path: Path, given: str, fixed: str, factor: float
) -> None:
    path = scenario(tmp_path, texts("2"), value("curve", f'String value="{given}"'), "y", fixed)
    u = np.loadtxt(tmp_path / "data.csv", delimiter=",", skiprows=1)[:, 1]
    assert simulated(path, "y") == pytest.approx(factor * u, abs=1e-12)


def test_a_string_makes_another_study(tmp_path: Path) -> None:
    path = scenario(tmp_path, texts("2"), value("curve", 'String value="steep"'), "y")
    before = study_identity(load(path))
    (tmp_path / "set.ssv").write_text(SSV.format(value("curve", 'String value="flat"'), ""))
    after = study_identity(load(path))
    assert {key for key in before if before[key] != after.get(key)} == {"fixed.curve"}


@pytest.mark.parametrize(
    ("element", "number"),
    [
        ('Enumeration value="three"', 3.0),
        ('Enumeration value="2"', 2.0),
        ('Enumeration value="drei" name="Own"', 3.0),
        ('Integer value="2"', 2.0),
    ],
)
def test_an_item_of_an_enumeration_is_given_by_its_name_or_number(
    tmp_path: Path, element: str, number: float
) -> None:
    path = scenario(tmp_path, strict2(), value("order", element), "x", more=ITEMS)
    assert load(path).fixed == {"order": number}
    named = simulated(path, "x")
    (tmp_path / "number").mkdir()
    by_number = scenario(tmp_path / "number", strict2(), "", "x", fixed=f"order = {number:g}")
    np.testing.assert_array_equal(named, simulated(by_number, "x"))


@pytest.mark.parametrize(("text", "number"), [("true", 1.0), ("false", 0.0), ("1", 1.0)])
def test_a_boolean_is_a_number(tmp_path: Path, text: str, number: float) -> None:
    path = scenario(tmp_path, strict2(), value("on", f'Boolean value="{text}"'), "x")
    assert load(path).fixed == {"on": number}


@pytest.mark.parametrize(
    ("name", "element", "sentence"),
    [
        (
            "order",
            'Enumeration value="thre"',
            "'order' of model.fmu is an enumeration without an item 'thre'; give one of one, two, three.",
        ),
        (
            "order",
            'Enumeration value="4"',
            "'order' of model.fmu is an enumeration without an item '4'; give one of one, two, three.",
        ),
        (
            "order",
            'Real value="2.5"',
            "2.5 is not a whole number; 'order' of model.fmu is of type Enumeration",
        ),
        ("order", 'Integer value="2.5"', "'order' is of type Integer: '2.5' is no whole number"),
        ("order", 'String value="two"', "'order' of model.fmu is of type Enumeration and takes no String"),
        ("tau", 'Enumeration value="two"', "'tau' of model.fmu is of type Real and takes no Enumeration"),
        (
            "tau",
            'String value="1"',
            "'tau' of model.fmu is of type Real and takes no String; give it as a Real.",
        ),
        ("on", 'Boolean value="yes"', "'on': 'yes' is no Boolean; give true or false."),
        ("on", 'Real value="0.5"', "0.5 is not true or false; 'on' of model.fmu is of type Boolean"),
        ("nothing", 'String value="a"', "has no variable 'nothing'"),
        ("tau", 'Binary value="ff"', "'tau' holds Binary; only numbers and texts can be set, so remove it."),
    ],
)
def test_what_does_not_fit_is_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, element: str, sentence: str
) -> None:
    path = scenario(tmp_path, strict2(), value(name, element), "x")
    assert run_command(["simulate", str(path), "-o", str(tmp_path / "study")]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert sentence in line
    assert "set.ssv" in line


def test_a_number_for_a_text_is_refused(tmp_path: Path) -> None:
    path = scenario(tmp_path, texts("2"), value("curve", 'Real value="2"'), "y")
    with pytest.raises(InputError, match=r"set\.ssv: 'curve' of model\.fmu is a text; give it as a String"):
        load(path)


def test_a_fraction_in_fixed_is_no_item(tmp_path: Path) -> None:
    path = scenario(tmp_path, strict2(), "", "x", fixed="order = 2.5")
    with pytest.raises(InputError, match=r"fixed\.order: 2\.5 is not a whole number.*1 \(one\), 2 \(two\)"):
        load(path)
