"""The evidence of a diagnosis, on signals from closed forms: the residual, its cause, and what either model says."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd

from diagnosis.explaining.test_balance import ELECTRICAL, MECHANICAL, Wave, scenario_of, table
from thsa_cosim.diagnosis.explaining.balance import close_balances
from thsa_cosim.diagnosis.explaining.evidence import _first, evidence
from thsa_cosim.diagnosis.fitting.trials import trials_of
from thsa_cosim.diagnosis.results import Evidence
from thsa_cosim.scenario import Scenario
from thsa_cosim.signals import Signals

UNITS = {"w_m": "rad/s", "i_q": "A", "u_q": "V"}


def drag(w: Wave, _load: Wave) -> Wave:
    """Windage [N.m]: 0.26 N.m at 105 rad/s."""
    return 2.4e-5 * w * np.abs(w)


def model(scenario: Scenario, data: pd.DataFrame) -> Any:
    """An identified model that gives ``data``."""
    signals = Signals(data["time_s"].to_numpy(), {n: data[n].to_numpy() for n in UNITS}, UNITS)
    return SimpleNamespace(signals={t.name: signals for t in trials_of(scenario)})


def found(folder: Path, data: pd.DataFrame, before: pd.DataFrame, after: pd.DataFrame | None) -> Evidence:
    scenario = scenario_of(folder, data, ELECTRICAL, MECHANICAL)
    assert scenario.diagnose is not None
    balances = close_balances(scenario, scenario.diagnose)
    models = model(scenario, before), None if after is None else model(scenario, after)
    one = evidence(scenario, balances, trials_of(scenario), *models)
    assert one is not None
    return one


def test_a_missing_drag_is_seen_over_speed_and_followed_by_the_right_model_only(tmp_path: Path) -> None:
    one = found(tmp_path, table(friction=drag), table(noise=0.0), table(friction=drag, noise=0.0))
    assert (one.equation, one.cause, one.cause_unit, one.unit) == ("mechanical", "w_m", "rad/s", "A")
    assert one.part == "fit"  # the held-out recording is too short for the band
    assert one.share > 0.5
    measured, error = np.array(one.measured), np.array(one.stderr)
    right, wrong = np.array(one.after), np.array(one.before)
    assert np.ptp(measured) > 10.0 * np.median(error)
    assert np.sqrt(np.mean(((measured - right) / error) ** 2)) < 2.0
    assert np.sqrt(np.mean(((measured - wrong) / error) ** 2)) > 5.0


def test_a_lost_voltage_is_seen_in_the_electrical_balance_over_current(tmp_path: Path) -> None:
    def lost(i: Wave) -> Wave:
        return 2.0 * np.sign(i)

    one = found(tmp_path, table(voltage=lost), table(noise=0.0), table(voltage=lost, noise=0.0))
    assert (one.equation, one.left, one.cause) == ("electrical", "u_q", "i_q")


def test_a_left_side_of_several_signals_goes_by_its_first_one_in_every_run() -> None:
    """A set of names has another order in every process."""
    text = "u_q*i_q - 5.3e-5*w_m*F_load"
    for names in (["F_load", "w_m", "i_q", "u_q"], ["i_q", "F_load", "u_q", "w_m"]):
        assert _first(text, names) == "u_q"
    assert _first("w_m_b + w_m", ["w_m", "w_m_b"]) == "w_m_b"
    assert _first("1", []) == ""


def test_without_an_extended_model_only_the_declared_one_is_shown(tmp_path: Path) -> None:
    one = found(tmp_path, table(friction=drag), table(noise=0.0), None)
    assert np.isnan(one.after).all()
    assert np.isfinite(one.before).all()
