"""Parameter spaces: bounds, scales, vectors; SSV files against the schema of SSP 1.0."""

import math
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from thsa_cosim.errors import ParameterError, UnitError
from thsa_cosim.parameters import Parameter, ParameterSpace
from thsa_cosim.ssv import ParameterSet, read_ssv, write_ssv


def parameter(name="R_s", variable="motor.R_s.a0", unit="ohm", lower=0.1, upper=10.0, **more):
    return Parameter(name, variable, unit, lower, upper, **more)


@st.composite
def spaces(draw):
    found = []
    for k in range(draw(st.integers(1, 5))):
        if draw(st.booleans()):
            low = draw(st.floats(1e-12, 1e6))
            found.append(
                parameter(f"p{k}", f"v{k}", "1", low, low * draw(st.floats(1.001, 1e6)), scale="log")
            )
        else:
            low = draw(st.floats(-1e6, 1e6))
            found.append(parameter(f"p{k}", f"v{k}", "1", low, low + draw(st.floats(1e-3, 1e6))))
    return ParameterSpace(tuple(found))


@given(spaces(), st.data())
def test_decode_and_encode_are_inverse_and_stay_inside(space, data):
    u = np.array(data.draw(st.lists(st.floats(0, 1), min_size=len(space), max_size=len(space))))
    values = space.decode(u)
    assert all(p.lower <= values[p.name] <= p.upper for p in space.parameters)
    back = space.encode(values)
    # An interval of 1e-3 around 1e6 leaves 1e9 * eps of a unit vector.
    assert np.allclose(back, u, rtol=0, atol=1e-6)
    again = space.decode(back)
    assert all(math.isclose(again[n], values[n], rel_tol=1e-9, abs_tol=1e-9) for n in values)


@given(spaces())
def test_the_ends_of_the_cube_are_the_bounds_exactly(space):
    n = len(space)
    assert np.array_equal(space.physical(np.zeros(n)), space.lower)
    assert np.array_equal(space.physical(np.ones(n)), space.upper)
    assert (space.physical(np.full((3, n), 2.0)) == space.upper).all()


@given(spaces(), st.data())
def test_slope_is_the_derivative(space, data):
    u = np.array(data.draw(st.lists(st.floats(0.1, 0.9), min_size=len(space), max_size=len(space))))
    h = 1e-5
    difference = (space.physical(u + h) - space.physical(u - h)) / (2 * h)
    scale = np.maximum(np.abs(space.lower), np.abs(space.upper))
    assert np.allclose(space.slope(u), difference, rtol=1e-6, atol=1e-9 * scale.max())


def test_log_scale_searches_in_equal_ratios():
    space = ParameterSpace((parameter(lower=1e-6, upper=1e-2, scale="log"),))
    assert space.decode([0.5])["R_s"] == pytest.approx(1e-4)
    assert space.start() == pytest.approx([0.5])


def test_assignments_are_in_the_units_of_the_fmu():
    space = ParameterSpace(
        (
            parameter("J", "motor.J", "g.m2", 0.1, 10.0, variable_unit="kg.m2"),
            parameter("T", "box.T", "K", 200.0, 300.0, variable_unit="degC", start=273.15),
        )
    )
    found = space.assignments({"J": 2.0, "T": 273.15})
    assert found == pytest.approx({"motor.J": 2e-3, "box.T": 0.0})
    assert space["J"].from_variable(2e-3) == pytest.approx(2.0)
    assert space["T"].from_variable(0.0) == pytest.approx(273.15)
    assert space.decode(space.start())["T"] == pytest.approx(273.15)


def test_parameters_of_single_recordings():
    space = ParameterSpace((parameter(), parameter("x0", "x_start", "m", -1.0, 1.0)))
    spread = space.for_recordings(["a", "b"], ["x0"])
    assert spread.names == ("R_s", "x0[a]", "x0[b]")
    values = spread.decode([0.5, 0.0, 1.0])
    assert spread.assignments(values, "a") == {"motor.R_s.a0": values["R_s"], "x_start": -1.0}
    assert spread.assignments(values, "b") == {"motor.R_s.a0": values["R_s"], "x_start": 1.0}
    assert spread.assignments(values) == {"motor.R_s.a0": values["R_s"]}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"lower": 10.0, "upper": 0.1}, "lower = 10 must be below upper = 0.1"),
        ({"lower": 1.0, "upper": 1.0}, "must be below"),
        ({"upper": math.inf}, "upper = inf must be a finite number"),
        ({"lower": math.nan}, "finite"),
        ({"lower": -1.7e308, "upper": 1.7e308}, "too far apart"),
        ({"lower": 0.0, "scale": "log"}, "above 0 on a log scale"),
        ({"scale": "lag"}, "Did you mean 'log'"),
        ({"start": 11.0}, "start = 11 must lie between"),
    ],
)
def test_contradictions_are_named(change, message):
    with pytest.raises(ParameterError, match=message):
        parameter(**change)


def test_wrong_unit_names_parameter_and_variable():
    with pytest.raises(UnitError, match=r"'R_s' \(motor.R_s.a0\): unit 'V' cannot be turned into 'Ohm'"):
        parameter(unit="V", variable_unit="Ohm")


def test_names_and_variables_are_unique():
    with pytest.raises(ParameterError, match="'R_s' appears twice"):
        ParameterSpace((parameter(), parameter(variable="other")))
    with pytest.raises(ParameterError, match=r"both set 'motor\.R_s\.a0'"):
        ParameterSpace((parameter(), parameter("R")))
    with pytest.raises(ParameterError, match="both set"):
        ParameterSpace((parameter(), parameter("R", recording="run")))


def test_encode_refuses_what_it_cannot_place():
    space = ParameterSpace((parameter(),))
    with pytest.raises(ParameterError, match="Did you mean 'R_s'"):
        space.encode({"R_ss": 1.0})
    with pytest.raises(ParameterError, match="no value for parameter 'R_s'"):
        space.encode({})
    with pytest.raises(ParameterError, match="outside"):
        space.encode({"R_s": 11.0})


SET = ParameterSet(
    "motor at -30 degC",
    {"motor.R_s.a0": 0.1 + 0.2, "motor.b_m.a0": 5.2e-5, "T_amb": -30.0, "motor.p": 4.0, "gap<&>": 1e-300},
    {"motor.R_s.a0": "Ohm", "motor.b_m.a0": "N.m.s/rad", "T_amb": "degC", "gap<&>": "mm"},
    "identified",
)


def test_ssv_round_trip_is_exact(tmp_path):
    write_ssv(tmp_path / "set.ssv", SET)
    assert read_ssv(tmp_path / "set.ssv") == SET


def test_ssv_is_valid_by_the_schema_of_ssp(tmp_path):
    etree = pytest.importorskip("lxml.etree")
    import fmpy

    schema = Path(fmpy.__file__).parent / "ssp" / "schema" / "SystemStructureParameterValues.xsd"
    if not schema.exists():
        pytest.skip("this fmpy carries no SSP schema")
    xsd = etree.XMLSchema(etree.parse(str(schema)))
    for k, chosen in enumerate((SET, ParameterSet("no units", {"a": 1.0}), ParameterSet("empty", {}))):
        write_ssv(tmp_path / f"{k}.ssv", chosen)
        assert xsd.validate(etree.parse(str(tmp_path / f"{k}.ssv"))), xsd.error_log
    wrong = (tmp_path / "0.ssv").read_text().replace('version="1.0"', "")
    assert not xsd.validate(etree.fromstring(wrong.encode()).getroottree())


def test_ssv_defines_every_unit_it_uses_in_si(tmp_path):
    write_ssv(tmp_path / "set.ssv", SET)
    ssv = "{http://ssp-standard.org/SSP1/SystemStructureParameterValues}"
    ssc = "{http://ssp-standard.org/SSP1/SystemStructureCommon}"
    root = ET.parse(tmp_path / "set.ssv").getroot()
    assert [child.tag for child in root] == [f"{ssv}Parameters", f"{ssv}Units"]
    used = {real.get("unit") for real in root.iter(f"{ssv}Real")} - {None}
    bases = {u.get("name"): u.find(f"{ssc}BaseUnit").attrib for u in root.iter(f"{ssc}Unit")}
    assert set(bases) == used
    assert bases["degC"] == {"K": "1", "offset": "273.15"}
    assert bases["mm"] == {"m": "1", "factor": "0.001"}


END = "</Parameter></Parameters></ParameterSet>"
HEAD = '<ParameterSet xmlns="http://ssp-standard.org/SSP1/SystemStructureParameterValues" version="1.0" name="x">'


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ('<Integer value="4"/>', 4.0),
        ('<Boolean value="true"/>', 1.0),
        ('<Boolean value="0"/>', 0.0),
        ('<Real value=" 1e-3 "/>', 1e-3),
    ],
)
def test_ssv_reads_numbers_of_other_tools(tmp_path, body, expected):
    file = tmp_path / "in.ssv"
    file.write_text(f'{HEAD}<Parameters><Parameter name="p">{body}{END}')
    assert read_ssv(file).values == {"p": expected}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no XML file"),
        ("<a/>", "holds 'a', not the ParameterSet"),
        (HEAD, "no XML file"),
        (f'{HEAD}<Parameters><Parameter name="p"><Binary value="x"/>{END}', "holds Binary"),
        (f'{HEAD}<Parameters><Parameter name="p"><Integer value="1 2"/>{END}', "holds an array"),
        (f'{HEAD}<Parameters><Parameter name="p"><Real value="x"/>{END}', "'x' is no"),
        (f'{HEAD}<Parameters><Parameter name="p">{END}', "nothing"),
        (
            f'{HEAD}<Parameters><Parameter name="p"><Real value="1" unit="foo"/>{END}',
            "unknown unit 'foo'",
        ),
        (
            f'{HEAD}<Parameters><Parameter name="p"><Real value="1"/></Parameter>'
            f'<Parameter name="p"><Real value="1"/>{END}',
            "set twice",
        ),
    ],
)  # fmt: skip
def test_ssv_that_cannot_be_used_is_one_sentence(tmp_path, text, message):
    file = tmp_path / "in.ssv"
    file.write_text(text)
    with pytest.raises((ParameterError, UnitError), match=message) as caught:
        read_ssv(file)
    assert str(file) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_ssv_missing_file_and_infinite_value(tmp_path):
    with pytest.raises(ParameterError, match="cannot be read"):
        read_ssv(tmp_path / "none.ssv")
    with pytest.raises(ParameterError, match="only finite"):
        write_ssv(tmp_path / "x.ssv", ParameterSet("x", {"p": math.nan}))
