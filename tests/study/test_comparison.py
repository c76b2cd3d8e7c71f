"""Simulated against measured: pooled over recordings, and as far as a simulation came."""

from pathlib import Path

import numpy as np
import pytest

from thsa_cosim.recordings import Recording
from thsa_cosim.signals import Signals
from thsa_cosim.study import ChannelError, Comparison, compare, summarise


def comparison(name: str, role: str, offset: float, noise: float, count: int) -> Comparison:
    t = np.linspace(0.0, 1.0, count)
    measured = Signals(t, {"a": np.sin(7.0 * t)}, {"a": "A"})
    simulated = Signals(t, {"a": np.sin(7.0 * t) + offset}, {"a": "A"})
    error = ChannelError(abs(offset), abs(offset) / np.ptp(measured["a"]), noise, "A", count)
    return Comparison(name, role, 20.0, measured, simulated, {"a": error})


def test_errors_over_recordings_weigh_by_samples() -> None:
    errors = summarise(
        [
            comparison("x", "fit", 0.3, 0.1, 300),
            comparison("y", "fit", -0.1, 0.5, 100),
            comparison("z", "validate", 1.0, 1.0, 50),
        ]
    )
    assert errors["fit"]["a"].rmse == pytest.approx(np.sqrt((300 * 0.09 + 100 * 0.01) / 400))
    assert errors["fit"]["a"].noise == pytest.approx(np.sqrt((300 * 0.01 + 100 * 0.25) / 400))
    assert errors["fit"]["a"].nrmse == pytest.approx(errors["fit"]["a"].rmse / 2.0, rel=0.01)
    assert errors["validate"]["a"].samples == 50
    assert summarise([]) == {"fit": {}, "validate": {}}


def recording(**more: object) -> Recording:
    t = np.arange(11) * 0.1
    signals = Signals(t, {"a": np.arange(11.0), "b": np.zeros(11)}, {"a": "A"})
    return Recording("r", Path("r.csv"), "0" * 64, signals, 20.0, {"a": 0.1, "b": 0.3}, **more)  # type: ignore[arg-type]


def test_a_simulation_counts_as_far_as_it_came() -> None:
    t = np.arange(7) * 0.1
    found = compare(
        recording(), "fit", ["a", "b"], {"a": 0.5}, Signals(t, {"b": np.ones(7), "a": np.arange(7.0) + 2.0})
    )
    assert found.errors["a"] == ChannelError(pytest.approx(2.0), pytest.approx(2.0 / 6.0), 0.5, "A", 7)  # type: ignore[arg-type]
    assert (found.errors["b"].rmse, found.errors["b"].noise) == (pytest.approx(1.0), 0.3)
    assert found.measured.names == found.simulated.names == ("a", "b")
    assert len(found.measured) == len(found.simulated) == 7


def test_the_lead_in_and_what_repairs_leave_out_do_not_count() -> None:
    left_out = np.zeros(11, dtype=bool)
    left_out[[1, 9]] = True
    t = np.arange(11) * 0.1
    wrong = np.arange(11.0)
    wrong[[0, 1, 2, 9]] += 5.0
    found = compare(
        recording(lead_in=0.3, left_out={"a": left_out}),
        "fit",
        ["a"],
        {},
        Signals(t, {"a": wrong, "b": wrong}),
    )
    assert found.errors["a"].rmse == pytest.approx(0.0, abs=1e-12)
    assert found.errors["a"].samples == 7
