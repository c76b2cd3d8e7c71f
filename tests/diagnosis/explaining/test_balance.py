"""Balance equations on signals from closed forms: what closes, what does not, what is masked and what is refused."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import quad

from thsa_cosim.diagnosis.explaining.balance import close_balances, formulas_of, record_of
from thsa_cosim.diagnosis.results import Balance
from thsa_cosim.errors import ScenarioError
from thsa_cosim.scenario import Scenario, load
from thsa_cosim.scenario.formula import parse_formula

FMU = Path(__file__).parents[3] / "fmus" / "THSA.fmu"
R, L, KT, J, T_C, B = 1.0, 2e-3, 0.5, 2e-3, 0.05, 1e-4
NOISE = {"w_m": 0.2, "i_q": 0.05, "u_q": 0.3}
TIME = np.arange(6000) * 1e-3
Wave = np.ndarray


def motion() -> tuple[Wave, Wave]:
    """Speed that changes its sign often, and its derivative: (n,) rad/s and rad/s2."""
    slow, fast = 2 * np.pi * 0.4, 2 * np.pi * 1.3
    speed = 80.0 * np.sin(slow * TIME) + 25.0 * np.sin(fast * TIME)
    return speed, 80.0 * slow * np.cos(slow * TIME) + 25.0 * fast * np.cos(fast * TIME)


def table(
    friction: Callable[[Wave, Wave], Wave] = lambda w, load: 0.0 * w,
    voltage: Callable[[Wave], Wave] = lambda i: 0.0 * i,
    noise: float = 1.0,
) -> pd.DataFrame:
    """A motor under a load that alternates, with added friction [N.m] and voltage [V], and noisy sensors."""
    rng = np.random.default_rng(3)
    speed, acceleration = motion()
    load = 20e3 * np.sin(2 * np.pi * 0.17 * TIME)
    torque = J * acceleration + T_C * np.sign(speed) + B * speed + friction(speed, load)
    current = torque / KT
    voltages = R * current + L * np.gradient(current, 1e-3) + KT * speed + voltage(current)
    true = {"w_m": speed, "i_q": current, "u_q": voltages}
    measured = {n: v + noise * NOISE[n] * rng.standard_normal(v.size) for n, v in true.items()}
    return pd.DataFrame({"time_s": TIME, "load": load, **measured})


ELECTRICAL = {
    "name": "electrical",
    "unit": "V",
    "left": "u_q",
    "terms": ["i_q", "der(i_q)", "w_m"],
    "band": 50.0,
}
MECHANICAL = {
    "name": "mechanical",
    "unit": "A",
    "left": "i_q",
    "terms": ["der(w_m)", "sgn(w_m)", "w_m"],
    "moving": "w_m",
    "band": 20.0,
}


def close(folder: Path, data: pd.DataFrame, *balances: dict, start: float = 9e3) -> dict[str, Balance]:
    """The balances of :func:`scenario_of`, by name."""
    scenario = scenario_of(folder, data, *balances, start=start)
    assert scenario.diagnose is not None
    return {b.equation: b for b in close_balances(scenario, scenario.diagnose)}


def scenario_of(folder: Path, data: pd.DataFrame, *balances: dict, start: float = 9e3) -> Scenario:
    """A scenario whose only recording is ``data``; F_fn is ``start`` N on the drawing."""
    data.to_parquet(folder / "data.parquet")
    data.head(100).to_parquet(folder / "held_out.parquet")
    columns = {"F_load": "load", "w_m": "w_m", "i_q": "i_q", "u_q": "u_q"}
    units = {"F_load": "N", "w_m": "rad/s", "i_q": "A", "u_q": "V"}
    lines = [
        'kind = "diagnose"',
        f"fmu = {json.dumps(str(FMU))}",
        'recordings.fit = ["data.parquet"]',
        'recordings.validate = ["held_out.parquet"]',
        'recordings.time = {column = "time_s", unit = "s"}',
        "recordings.columns.v_cmd = {value = 0.0}",
        "recordings.columns.T_amb = {value = 25.0}",
        *(f'recordings.columns.{n} = {{column = "{c}", unit = "{units[n]}"}}' for n, c in columns.items()),
        "[diagnose]",
        'model = "THSA.Actuator"',
        f"package = {json.dumps(str(FMU.parents[1] / 'modelica' / 'THSA'))}",
        "[[parameters]]",
        'name = "F_fn"',
        'variable = "nut.F_fn.a0"',
        'unit = "N"',
        f"start = {start}",
        "lower = 0.0",
        "upper = 1e5",
        "spread = 0.1",
    ]
    for balance in balances:
        lines += ["[[diagnose.balances]]", *(f"{k} = {json.dumps(v)}" for k, v in balance.items())]
    path = folder / "scenario.toml"
    path.write_text("\n".join(lines), encoding="utf-8")
    return load(path)


def passing(band: float) -> float:
    """Share of white noise's power at 1 kHz that a Butterworth filter of order 4, there and back, lets through."""
    return quad(lambda f: (1.0 + (f / band) ** 8) ** -2, 0.0, 500.0, points=[band])[0] / 500.0


def test_closed_balances_are_not_at_fault_and_leave_the_noise(tmp_path: Path):
    found = close(tmp_path, table(), ELECTRICAL, MECHANICAL)
    assert not any(b.at_fault for b in found.values())
    # Voltage noise and that of speed and current through the balance; der(i_q) within the band adds L 2 pi f.
    sensors = NOISE["u_q"] ** 2 + (KT * NOISE["w_m"]) ** 2 + (R * NOISE["i_q"]) ** 2
    expected = np.sqrt(passing(50.0) * sensors)
    assert found["electrical"].noise == pytest.approx(expected, rel=0.05)
    assert found["electrical"].rmse == pytest.approx(expected, rel=0.1)
    assert found["mechanical"].rmse == pytest.approx(found["mechanical"].noise, rel=0.15)


def test_a_lost_voltage_is_an_electrical_fault_and_nothing_else(tmp_path: Path):
    found = close(tmp_path, table(voltage=lambda i: 2.0 * np.sign(i)), ELECTRICAL, MECHANICAL)
    assert found["electrical"].at_fault
    assert not found["mechanical"].at_fault
    # What no combination of i, di/dt and w explains of the lost voltage:
    speed, _ = motion()
    current = table(noise=0.0)["i_q"].to_numpy()
    terms = np.stack([current, np.gradient(current, 1e-3), speed], axis=1)
    lost = 2.0 * np.sign(current)
    left = lost - terms @ np.linalg.lstsq(terms, lost, rcond=None)[0]
    assert found["electrical"].rmse == pytest.approx(np.sqrt(np.mean(left**2)), rel=0.1)


def test_friction_that_the_terms_lack_is_a_mechanical_fault_alone(tmp_path: Path):
    found = close(tmp_path, table(friction=lambda w, _: 2e-5 * w * np.abs(w)), ELECTRICAL, MECHANICAL)
    assert found["mechanical"].at_fault
    assert not found["electrical"].at_fault
    assert found["mechanical"].share == pytest.approx(
        1.0 - (found["mechanical"].noise / found["mechanical"].rmse) ** 2
    )


def test_structure_that_is_sure_but_small_is_no_fault(tmp_path: Path):
    found = close(tmp_path, table(voltage=lambda i: 0.115 * np.sign(i)), ELECTRICAL)["electrical"]
    independent = 2.0 * 50.0 * TIME[-1]
    assert (found.rmse / found.noise) ** 2 - 1.0 > 6.0 * np.sqrt(2.0 / independent)
    assert found.share < 1.0 / 3.0
    assert not found.at_fault


def test_standstill_and_what_the_filter_smears_of_it_do_not_count(tmp_path: Path):
    held = table()
    rest = slice(3000, 4000)
    speed = held["w_m"].to_numpy().copy()
    current = held["i_q"].to_numpy().copy()
    speed[rest] = NOISE["w_m"] * np.random.default_rng(5).standard_normal(1000)
    current[rest] += 5.0  # whatever the static friction holds
    masked = close(tmp_path, held.assign(w_m=speed, i_q=current), MECHANICAL)["mechanical"]
    open_ = {k: v for k, v in MECHANICAL.items() if k != "moving"}
    assert close(tmp_path, held.assign(w_m=speed, i_q=current), open_)["mechanical"].at_fault
    assert masked.rmse < 1.2 * masked.noise
    # Of several signals every one has to move.
    both = {**MECHANICAL, "moving": ["u_q", "w_m"]}
    assert not close(tmp_path, held.assign(w_m=speed, i_q=current), both)["mechanical"].at_fault
    only = {**MECHANICAL, "moving": ["u_q"]}
    assert close(tmp_path, held.assign(w_m=speed, i_q=current), only)["mechanical"].at_fault


HINGE = {**MECHANICAL, "terms": [*MECHANICAL["terms"], "sgn(w_m)*max(F_load*sgn(w_m) + F_fn, 0)"]}


def hinged(speed: Wave, load: Wave) -> Wave:
    """A drag that begins at a load of -10 kN along the motion."""
    way = np.sign(speed)
    return 5e-6 * way * np.maximum(load * way + 10e3, 0.0)


def test_a_declared_parameter_inside_a_term_is_fitted_within_its_spread(tmp_path: Path):
    near = close(tmp_path, table(hinged), HINGE, start=9e3)["mechanical"]
    far = close(tmp_path, table(hinged), HINGE, start=2e3)["mechanical"]  # 40 spreads away
    assert not near.at_fault
    assert near.rmse < 1.1 * near.noise
    assert far.at_fault


def test_a_recording_too_short_for_the_band_leaves_the_balance_out(tmp_path: Path):
    assert close(tmp_path, table().head(500), MECHANICAL) == {}
    assert set(close(tmp_path, table().head(500), {**ELECTRICAL, "band": 100.0})) == {"electrical"}


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("u_qq", "'u_qq' in 'u_qq' has no column. Did you mean 'u_q'?"),
        ("sqn(i_q)", "there is no function 'sqn' in 'sqn(i_q)'. Did you mean 'sgn'?"),
        ("max(i_q)", "max in 'max(i_q)' takes 2 argument(s), not 1."),
        ("i_q +", "'i_q +' is no formula; correct its spelling."),
        ("__import__('os').system('true')", "is not understood"),
        ("i_q if w_m else u_q", "is not understood"),
        ("abs(i_q, key=w_m)", "is not understood"),
        ("(" * 3000 + "i_q" + ")" * 3000, "is no formula"),
    ],
)
def test_a_formula_that_is_none_is_refused_in_one_sentence(text: str, says: str):
    with pytest.raises(ScenarioError) as caught:
        parse_formula(text, ("i_q", "u_q", "w_m"), "diagnose.balances[electrical]")
    assert str(caught.value).startswith("diagnose.balances[electrical]: ")
    assert says in str(caught.value)


def test_a_wrong_formula_is_refused_when_the_scenario_is_read(tmp_path: Path):
    with pytest.raises(ScenarioError, match=r"diagnose.balances\[electrical\]: 'w_n'.*Did you mean 'w_m'"):
        close(tmp_path, table().head(500), {**ELECTRICAL, "terms": ["w_n"]})


def test_formulas_have_the_values_of_their_operations():
    x = np.linspace(-2.0, 3.0, 501)
    values = {"x": x, "y": np.full_like(x, 2.0)}
    expected = {
        "der(x**2)": 2.0 * x * 100.0,
        "-x + +y*3 - 1/y": -x + 5.5,
        "sgn(x)*abs(x)": x,
        "max(min(x, 1), -1)": np.clip(x, -1.0, 1.0),
        "2": np.full_like(x, 2.0),
        "der(4)": np.zeros_like(x),
    }
    for text, wanted in expected.items():
        found = parse_formula(text, values, "key")(values, 1e-4)
        np.testing.assert_allclose(found[1:-1], wanted[1:-1], atol=1e-9, err_msg=text)


def test_the_same_noise_is_drawn_whatever_the_order_of_a_set(tmp_path: Path):
    """Strings hash differently in every process, and noise is drawn signal by signal."""
    scenario = scenario_of(tmp_path, table(), ELECTRICAL)
    assert scenario.diagnose is not None
    (spec,) = scenario.diagnose.balances
    (recording,) = scenario.fit
    found = record_of(recording, spec, formulas_of(scenario, spec))
    assert found is not None
    assert list(found.values) == sorted(found.values)
    assert len(found.values) > 2
