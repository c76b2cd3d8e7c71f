"""Units against known factors, in every spelling that is promised."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from thsa_cosim import units
from thsa_cosim.errors import UnitError
from thsa_cosim.units import base_exponents, conversion, convert, is_unit, same_dimension

SAME = [
    ("N.m", "Nm"), ("N.m", "N*m"), ("kg.m2", "kg*m^2"), ("kg.m2", "kg·m²"), ("Ohm", "ohm"), ("Ohm", "Ω"),
    ("N.m/(rad/s)", "N.m.s/rad"), ("N.m.s/rad", "N.m.s"), ("V.s/rad", "Wb"), ("m/s2", "m.s-2"), ("1", ""),
    ("A/(rad/s)", "A.s/rad"), ("N.m.s/(rad.K2)", "N*m*s/rad/K**2"), ("degC", "°C"), ("V", "Volts"), ("1", "-"),
    ("Ohm/K3", "Ohm/degC3"), ("rpm", "rev/min"), ("rpm", "U/min"), ("rad/s", "1/s"), ("N/(m/s)", "N.s/m"),
]  # fmt: skip
FACTORS = [
    ("mm/s", "m/s", 1e-3), ("kN", "N", 1e3), ("rpm", "rad/s", 2 * math.pi / 60), ("deg", "rad", math.pi / 180),
    ("%", "1", 0.01), ("mNm", "N.m", 1e-3), ("min", "s", 60.0), ("µm", "m", 1e-6), ("bar", "Pa", 1e5),
    ("deg/s", "rad/s", math.pi / 180), ("kg.cm2", "kg.m2", 1e-4), ("rev/s", "rad/s", 2 * math.pi),
    ("l/min", "m3/s", 1e-3 / 60), ("g.mm2", "kg.m2", 1e-9), ("kOhm", "Ohm", 1e3),
]  # fmt: skip


@pytest.mark.parametrize(("a", "b"), SAME)
def test_spellings_of_the_same_unit(a, b):
    assert conversion(a, b) == pytest.approx((1.0, 0.0), abs=1e-12)
    assert same_dimension(a, b)


@pytest.mark.parametrize(("source", "target", "factor"), FACTORS)
def test_known_factors(source, target, factor):
    assert conversion(source, target) == pytest.approx((factor, 0.0), rel=1e-12)
    assert convert(3.0, source, target) == pytest.approx(3 * factor, rel=1e-12)


def test_temperatures_have_offsets_and_differences_have_none():
    assert convert(-55.0, "degC", "K") == pytest.approx(218.15)
    assert convert(np.array([32.0, 212.0]), "degF", "degC").tolist() == pytest.approx([0.0, 100.0])
    assert conversion("Ohm/degC", "Ohm/K") == (1.0, 0.0)
    assert conversion("V/degF", "V/K")[0] == pytest.approx(1.8)


@pytest.mark.parametrize(
    ("a", "b"), [("kN", "mm"), ("A", "V"), ("degC", "s"), ("N.m", "N"), ("rad/s", "m/s")]
)
def test_different_dimensions_are_refused(a, b):
    assert not same_dimension(a, b)
    with pytest.raises(UnitError, match="dimensions differ"):
        conversion(a, b)


@pytest.mark.parametrize("plain", ["Hz", "1/min", "kHz"])
def test_a_hidden_factor_of_two_pi_is_refused(plain):
    for a, b in ((plain, "rad/s"), ("rpm", plain)):
        with pytest.raises(UnitError, match="turns or radians"):
            conversion(a, b)
    assert convert(2.0, "kHz", "Hz") == 2000.0


@pytest.mark.parametrize(
    "text", ["counts/div/", "(", "s2x", "10*kg", "[]", "foo", "V" * 90, "m//s", "\0", "1e999"]
)
def test_nonsense_is_no_unit(text):
    assert not is_unit(text)
    with pytest.raises(UnitError) as caught:
        conversion(text, "1")
    assert "\n" not in str(caught.value)


def test_a_near_miss_is_suggested():
    with pytest.raises(UnitError, match="Did you mean 'rad/s'"):
        conversion("radd/s", "rad/s")


@given(st.text(max_size=30))
def test_any_text_is_a_unit_or_a_unit_error(text):
    if is_unit(text):
        assert math.isfinite(conversion(text, text)[0])


LINEAR = st.sampled_from([(a, b) for a, b, _ in FACTORS] + [("degC", "K"), ("degF", "degC")])


@given(LINEAR, st.lists(st.floats(-1e9, 1e9), min_size=1, max_size=5))
def test_there_and_back_is_the_same(pair, values):
    array = np.array(values)
    back = convert(convert(array, *pair), *reversed(pair))
    assert np.allclose(back, array, rtol=1e-12, atol=1e-10)


@given(LINEAR, st.floats(-1e6, 1e6))
def test_scalars_and_arrays_agree(pair, value):
    assert convert(value, *pair) == convert(np.array([value]), *pair)[0]


@pytest.mark.parametrize(
    ("unit", "exponents", "factor", "offset"),
    [
        ("kN", {"kg": 1, "m": 1, "s": -2}, 1000.0, 0.0),
        ("degC", {"K": 1}, 1.0, 273.15),
        ("Ohm", {"kg": 1, "m": 2, "s": -3, "A": -2}, 1.0, 0.0),
        ("N.m/(rad/s)", {"kg": 1, "m": 2, "s": -1, "rad": -1}, 1.0, 0.0),
        ("%", {}, 0.01, 0.0),
        ("rad/s", {"s": -1, "rad": 1}, 1.0, 0.0),
    ],
)
def test_base_units_as_in_the_fmi(unit, exponents, factor, offset):
    found = base_exponents(unit)
    assert found[0] == exponents
    assert found[1:] == pytest.approx((factor, offset))


_SPELLED = (*units._COMMON, *units._SI, *units._SCALED, "N.m.s/(rad.K2)", "Wb/K3", "1/K", "1/(s.K)", "s-1", "1/s",
            "N*m", "mm/s2", "m2/s2", "V/(m/s)", "m/(s.s)", "N.m/(rad/(s.K))", "kg.mm2")  # fmt: skip


def _answers(unit: str, others: tuple[str, ...]) -> list[object]:
    found: list[object] = [units.base_exponents(unit), units.is_unit(unit)]
    for other in others:
        try:
            found.append((units.conversion(unit, other), units.same_dimension(unit, other)))
        except UnitError as error:
            found.append((str(error), units.same_dimension(unit, other)))
    return found


def test_well_known_symbols_are_read_as_pint_reads_them(monkeypatch: pytest.MonkeyPatch) -> None:
    units.conversion.cache_clear()
    ours = {unit: _answers(unit, _SPELLED[::4]) for unit in _SPELLED}
    assert sum(units._plain(unit) is not None for unit in _SPELLED) > 50
    monkeypatch.setattr(units, "_plain", lambda _unit: None)
    units.conversion.cache_clear()
    for unit in _SPELLED:
        assert ours[unit] == _answers(unit, _SPELLED[::4]), unit


@pytest.mark.parametrize(
    "text", ["", "N.", "N..m", "(N.m", "N.m)", "N m", "1/", "2.N", "N/m/", "Nx", "N.(m", "mm999"]
)
def test_spellings_that_are_not_plain_are_left_to_pint(text: str) -> None:
    assert units._plain(text) is None
