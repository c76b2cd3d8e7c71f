"""Signals: common time axis, cutting, resampling; exact where mathematics says so."""

import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from thsa_cosim.signals import Signals

TIMES = st.lists(st.floats(0.001, 10.0), min_size=2, max_size=40).map(np.cumsum)
NUMBERS = st.floats(-1e3, 1e3)


def test_everything_becomes_contiguous_float64():
    table = np.arange(12).reshape(4, 3)
    signals = Signals(table[:, 0], {"v": table[:, 1]}, {"v": "m/s"})
    assert signals.time.dtype == np.float64
    assert signals["v"].flags.c_contiguous
    assert signals.names == ("v",)
    assert len(signals) == 4


def test_unit_defaults_to_one_and_unknown_unit_names_are_refused():
    assert Signals(np.arange(2), {"a": np.zeros(2)}).units == {"a": "1"}
    with pytest.raises(ValueError, match="unknown signal 'b'"):
        Signals(np.arange(2), {"a": np.zeros(2)}, {"b": "V"})
    with pytest.raises(ValueError, match="unknown signal 'b'"):
        Signals(np.arange(2), {"a": np.zeros(2)}, held=frozenset("b"))


@pytest.mark.parametrize(
    ("time", "values", "message"),
    [
        ([0, 1, 1], [0, 0, 0], "strictly increasing"),
        ([0, 2, 1], [0, 0, 0], "strictly increasing"),
        ([0, np.nan, 1], [0, 0, 0], "finite"),
        ([[0, 1]], [0, 0], "one-dimensional"),
        ([0, 1, 2], [0, 0], "has shape"),
    ],
)
def test_misuse_says_what_is_wrong(time, values, message):
    with pytest.raises(ValueError, match=message):
        Signals(np.array(time, dtype=float), {"v": np.array(values, dtype=float)})


def test_unknown_name_suggests_the_right_one():
    signals = Signals(np.arange(3), {"velocity": np.zeros(3)})
    with pytest.raises(KeyError, match="Did you mean 'velocity'"):
        signals["velocty"]
    assert "velocity" in signals
    assert "v" not in signals


@given(TIMES, NUMBERS, NUMBERS, st.lists(st.floats(0, 1), min_size=1, max_size=20))
def test_resampling_a_straight_line_is_exact(time, offset, slope, shares):
    signals = Signals(time, {"v": offset + slope * time})
    target = np.unique(time[0] + np.array(shares) * (time[-1] - time[0]))
    found = signals.resample(target)["v"]
    assert np.allclose(found, offset + slope * target, rtol=0, atol=1e-9 * (1 + abs(slope) * time[-1]))


@given(TIMES, st.data())
def test_resampling_at_the_samples_changes_nothing(time, data):
    values = np.array(data.draw(st.lists(NUMBERS, min_size=len(time), max_size=len(time))))
    signals = Signals(time, {"a": values, "b": values}, {"a": "V"}, frozenset("b"))
    again = signals.resample(time)
    assert np.array_equal(again["a"], values)
    assert np.array_equal(again["b"], values)
    assert (again.units, again.held) == (signals.units, signals.held)


def test_held_signals_keep_their_value_until_the_next_sample_even_with_rounding():
    time = np.arange(4) * 0.1
    signals = Signals(time, {"command": np.array([1.0, 2.0, 3.0, 4.0])}, held=frozenset({"command"}))
    assert signals.resample([0.05, 0.0999, 0.1 - 1e-12, 0.1, 0.25])["command"].tolist() == [1, 1, 2, 2, 3]
    assert signals.resample([-1.0, 9.0])["command"].tolist() == [1, 4]


def test_window_select_and_with_values_keep_units_and_hold():
    time = np.linspace(0, 1, 11)
    signals = Signals(time, {"a": time, "b": 2 * time}, {"a": "V", "b": "A"}, frozenset("b"))
    cut = signals.window(0.25, 0.65)
    assert cut.time.tolist() == pytest.approx([0.3, 0.4, 0.5, 0.6])
    assert cut["b"].tolist() == pytest.approx([0.6, 0.8, 1.0, 1.2])
    only = signals.select(["b"])
    assert (only.names, only.units, only.held) == (("b",), {"b": "A"}, frozenset("b"))
    assert signals.select(["a"]).held == frozenset()
    more = signals.with_values({"a": -time, "c": time}, {"c": "N"})
    assert more.units == {"a": "V", "b": "A", "c": "N"}
    assert np.array_equal(more["a"], -time)
    assert np.array_equal(signals["a"], time)


def test_signals_travel_between_processes_and_become_tables():
    signals = Signals(np.arange(3), {"v": np.array([1.0, 2.0, 4.0])}, {"v": "m/s"}, frozenset("v"))
    twin = pickle.loads(pickle.dumps(signals))
    assert np.array_equal(twin["v"], signals["v"])
    assert twin.held == frozenset("v")
    frame = signals.to_frame()
    assert list(frame.columns) == ["v [m/s]"]
    assert frame.index.name == "time [s]"
    assert frame["v [m/s]"].tolist() == [1.0, 2.0, 4.0]


def test_signals_without_samples_cannot_be_resampled():
    with pytest.raises(ValueError, match="without samples"):
        Signals(np.empty(0), {"v": np.empty(0)}).resample([0.0])
