"""The parts of an identification, each on its own: channels, laws, parameter sets."""

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.points import point_of
from thsa_cosim.costs import Channel, ResidualReducer, TermsReducer
from thsa_cosim.errors import InputError
from thsa_cosim.fmu import DefaultExperiment, FmuDescription, Variable
from thsa_cosim.identify.over_temperature import fit_laws, values_at
from thsa_cosim.identify.parameter_set import law_values, parameter_set
from thsa_cosim.identify.results import Estimate, PointResult
from thsa_cosim.laws import published_law
from thsa_cosim.parameters import Parameter, ParameterSpace
from thsa_cosim.report.parameter_files import modelica_record
from thsa_cosim.scenario import LawTable
from thsa_cosim.signals import Signals
from thsa_cosim.ssv import ParameterSet

TIME = np.linspace(0.0, 1.0, 11)


def test_residuals_are_in_units_of_noise_and_terms_their_squares() -> None:
    channels = (
        Channel("a", TIME, np.zeros(11), noise=0.5),
        Channel("b", TIME[3:], np.ones(8), noise=2.0, weight=4.0),
    )
    simulated = Signals(TIME, {"b": np.full(11, 3.0), "a": np.ones(11)})
    residuals = pickle.loads(pickle.dumps(ResidualReducer(channels)))
    np.testing.assert_allclose(residuals(simulated), [2.0] * 11 + [2.0] * 8)
    np.testing.assert_allclose(TermsReducer(channels)(simulated), [44.0, 32.0])
    assert residuals.lengths == (11, 8)
    single = ResidualReducer(channels, single=True)(simulated)
    assert (single.dtype, residuals(simulated).dtype) == (np.float32, np.float64)
    np.testing.assert_allclose(single, residuals(simulated), rtol=1e-7)


def test_a_coarser_simulation_is_interpolated_onto_the_samples() -> None:
    channel = Channel("a", TIME, 2.0 * TIME, noise=1.0)
    coarse = Signals(TIME[::5], {"a": 2.0 * TIME[::5]})
    np.testing.assert_allclose(channel.residual(coarse), 0.0, atol=1e-12)


def test_means_of_neighbours_are_compared_with_means_and_their_noise_is_smaller() -> None:
    channel = Channel("a", TIME, TIME**2, noise=0.5, weight=4.0).means(3)
    assert (channel.mean_of, channel.time.size) == (3, 3)
    np.testing.assert_allclose(channel.time, [0.1, 0.4, 0.7])
    np.testing.assert_allclose(channel.measured, (TIME[:9] ** 2).reshape(3, 3).mean(axis=1))
    curve = Signals(TIME, {"a": TIME**2 + 1.0})
    finer = np.linspace(0.0, 1.0, 1001)
    for simulated in (curve, Signals(finer, {"a": finer**2 + 1.0})):
        np.testing.assert_allclose(channel.residual(simulated), 2.0 / 0.5 * np.sqrt(3.0))


def test_means_keep_white_noise_at_one_and_what_the_data_say_about_a_slow_signal() -> None:
    time, noise = np.arange(60_000) * 1e-3, np.random.default_rng(3).normal(0.0, 0.2, 60_000)
    still, moved = (Signals(time, {"a": size * np.sin(2.0 * np.pi * time)}) for size in (0.0, 0.1))
    channel = Channel("a", time, noise, noise=0.2)
    means = channel.means(6)
    assert np.std(means.residual(still)) == pytest.approx(1.0, abs=0.02)
    # What the data say about a slow signal stays: the squares of what it adds have the same sum.
    whole, pooled = (c.residual(moved) - c.residual(still) for c in (channel, means))
    assert pooled @ pooled == pytest.approx(whole @ whole, rel=1e-3)


def test_means_of_means_are_means_of_all_their_samples() -> None:
    time = np.arange(62) * 0.1
    channel = Channel("a", time, time**2, noise=0.6)
    twice, once = channel.means(2).means(3), channel.means(6)
    assert (twice.mean_of, twice.noise) == (6, pytest.approx(once.noise))
    for name in ("time", "measured", "fine"):
        np.testing.assert_allclose(getattr(twice, name), getattr(once, name))


def test_a_channel_of_too_few_samples_for_means_stays_as_it_is() -> None:
    channel = Channel("a", TIME, TIME, noise=1.0)
    assert channel.means(1) is channel
    assert channel.means(6) is channel


def point(temperature: float | None, **values: float) -> PointResult:
    return point_of(temperature, {n: Estimate(v, "ohm", 0.01, True, "", 0.0, 9.0) for n, v in values.items()})


POINTS = [point(t, R=1.0 + 0.1 * t) for t in (-20.0, 0.0, 10.0, 30.0)]


def test_laws_are_fitted_as_wanted_or_selected() -> None:
    laws, notes = fit_laws(
        POINTS, {"R": LawTable(form="quadratic", published=[1.0, 0.2], published_form="linear")}
    )
    assert notes == []
    assert laws["R"].law.form == "quadratic"
    assert not laws["R"].selected
    assert laws["R"].deviation == pytest.approx(3.0 / 7.0)
    chosen, _ = fit_laws(POINTS, {"R": LawTable()})
    assert chosen["R"].selected
    assert chosen["R"].law.form == "linear"
    assert chosen["R"].deviation is None


def test_laws_are_compared_with_the_material_of_their_unit_or_the_one_that_is_named() -> None:
    """R = 1 + 0.1 t in ohm is negative and much steeper than copper; as a published law, too."""
    laws, _ = fit_laws(POINTS, {"R": LawTable(form="linear", published=[1.0, 0.1])})
    assert {doubt.kind for doubt in laws["R"].doubts} == {"sign"}
    assert {doubt.kind for doubt in laws["R"].published_doubts} == {"sign"}
    laws, _ = fit_laws(POINTS, {"R": LawTable(form="linear", quantity="none")})
    assert laws["R"].doubts == ()
    laws, _ = fit_laws(POINTS, {"R": LawTable(form="linear", quantity="magnet-flux")})
    assert {doubt.kind for doubt in laws["R"].doubts} == {"sign", "direction"}
    unsure = [replace(p, parameters={"R": replace(p.parameters["R"], identifiable=False)}) for p in POINTS]
    assert fit_laws(unsure, {"R": LawTable(form="linear")})[0]["R"].doubts == ()


def test_a_vogel_law_is_in_the_parameter_set_as_the_best_form_that_a_block_can_hold() -> None:
    true = published_law("vogel", [1e-3, 700.0, -120.0])
    points = [point(t, R=float(true(t))) for t in (-55.0, -40.0, -30.0, -20.0, -10.0, 0.0, 25.0)]
    laws, _ = fit_laws(points, {"R": LawTable(quantity="viscous-friction")})
    assert laws["R"].law.form == "vogel"
    space = ParameterSpace((Parameter("R", "m.R.a0", "Ohm", 0.0, 9e3, variable_unit="Ohm"),))
    found, (note,) = parameter_set("set", space, points, laws, description(*BLOCK))
    assert set(found.values) == set(BLOCK)
    assert "because a TemperatureLaw block holds no vogel law" in note
    held = found.values
    at_30 = held["m.R.alpha1"] * np.exp(-30.0 * held["m.R.beta1"]) + held["m.R.alpha2"] * np.exp(
        -30.0 * held["m.R.beta2"]
    )
    assert at_30 == pytest.approx(float(true(-30.0)), rel=0.1)


def test_too_few_points_for_a_law_is_a_note() -> None:
    laws, notes = fit_laws(POINTS[:3], {"R": LawTable(form="cubic")})
    assert laws == {}
    assert notes == ["R has no cubic law: that needs 4 temperatures, there are 3."]
    laws, notes = fit_laws([point(None, R=1.0)], {"R": LawTable(form="constant")})
    assert "fewer than two temperatures" in notes[0]


def test_values_come_from_the_own_point_or_else_from_the_laws() -> None:
    laws, _ = fit_laws(POINTS, {"R": LawTable(form="linear")})
    assert values_at(10.3, ["R"], POINTS, laws, 1.0) == {"R": 2.0}
    assert values_at(20.0, ["R"], POINTS, laws, 1.0)["R"] == pytest.approx(3.0)
    assert values_at(None, ["R"], [point(None, R=4.0)], {}, 1.0) == {"R": 4.0}
    with pytest.raises(InputError, match="neither point nor law"):
        values_at(20.0, ["R"], POINTS, {}, 1.0)
    with pytest.raises(InputError, match="no temperature"):
        values_at(None, ["R"], POINTS, laws, 1.0)


def description(*names: str) -> FmuDescription:
    variables = {
        name: Variable(name, k, "parameter", "fixed", "Real", unit="Ohm") for k, name in enumerate(names)
    }
    return FmuDescription(
        path=Path("x.fmu"),
        sha256="",
        model_name="x",
        fmi_version="2.0",
        tool="",
        guid="",
        supports_co_simulation=True,
        supports_model_exchange=False,
        capabilities={},
        variables=variables,
        default_experiment=DefaultExperiment(),
        platforms=(),
    )


BLOCK = [f"m.R.{c}" for c in ("a0", "a1", "a2", "a3", "alpha1", "beta1", "alpha2", "beta2")]


def test_a_law_becomes_the_start_values_of_its_block_in_the_fmus_unit() -> None:
    space = ParameterSpace((Parameter("R", "m.R.a0", "mOhm", 0.0, 9e3, variable_unit="Ohm"),))
    laws, _ = fit_laws(POINTS, {"R": LawTable(form="linear")})
    found, notes = parameter_set("set", space, POINTS, laws, description(*BLOCK))
    assert notes == []
    assert set(found.values) == set(BLOCK)
    assert found.values["m.R.a0"] == pytest.approx(1e-3)
    assert found.values["m.R.a1"] == pytest.approx(1e-4)
    assert found.values["m.R.beta1"] == 0.0
    assert found.units["m.R.a0"] == "Ohm"


def test_rates_of_exponentials_keep_their_size_when_the_unit_changes() -> None:
    parameter = Parameter("R", "m.R.a0", "mOhm", 0.0, 9e3, variable_unit="Ohm")
    values = law_values(parameter, published_law("exponential", [2.0, -0.03]), description(*BLOCK))
    assert values is not None
    assert values["m.R.alpha1"] == pytest.approx(2e-3)
    assert values["m.R.beta1"] == -0.03


def test_several_values_without_a_law_are_left_out_and_said() -> None:
    space = ParameterSpace((Parameter("R", "plain", "Ohm", 0.0, 9.0),))
    found, notes = parameter_set("set", space, POINTS, {}, description("plain"))
    assert dict(found.values) == {}
    assert "several values and no law" in notes[0]
    found, _ = parameter_set("set", space, POINTS[:1], {}, description("plain"))
    assert found.values == {"plain": -1.0}


def test_the_modelica_record_quotes_what_is_no_plain_name() -> None:
    values = ParameterSet("s", {"m.R.a0": 0.1, "L": 2e-3, "it's": 1.0}, {"m.R.a0": "Ohm"}, 'a "b"')
    assert modelica_record(values) == (
        'record Identified "a \\"b\\""\n'
        "  parameter Real 'm.R.a0'(unit=\"Ohm\") = 0.1;\n"
        "  parameter Real L = 0.002;\n"
        "  parameter Real 'it\\'s' = 1.0;\n"
        "end Identified;\n"
    )
