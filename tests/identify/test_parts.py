"""The parts of an identification, each on its own: interleaving, channels, comparison, laws, study folder."""

import pickle
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from thsa_cosim.costs import Channel, ResidualReducer, TermsReducer
from thsa_cosim.errors import InputError
from thsa_cosim.fmu import DefaultExperiment, FmuDescription, Variable
from thsa_cosim.identify.compare import summarise
from thsa_cosim.identify.interleave import interleave
from thsa_cosim.identify.over_temperature import fit_laws, values_at
from thsa_cosim.identify.parameter_set import law_values, parameter_set
from thsa_cosim.identify.results import ChannelError, Comparison, Estimate, PointResult
from thsa_cosim.laws import published_law
from thsa_cosim.parameters import Parameter, ParameterSpace
from thsa_cosim.report.parameter_files import modelica_record
from thsa_cosim.scenario import LawTable
from thsa_cosim.signals import Signals
from thsa_cosim.ssv import ParameterSet


def countdown(steps: int):
    def task(ask):
        return [ask(k) for k in range(steps)]

    return task


def test_interleaving_answers_all_waiting_tasks_in_one_batch() -> None:
    batches = []

    def serve(requests):
        batches.append(list(requests))
        return [index * 100 + request for index, request in requests]

    found = dict(interleave([countdown(3), countdown(1), countdown(2)], serve))
    assert found == {0: [0, 1, 2], 1: [100], 2: [200, 201]}
    assert batches == [[(0, 0), (1, 0), (2, 0)], [(0, 1), (2, 1)], [(0, 2)]]


def test_interleaving_serves_in_the_calling_thread() -> None:
    threads = set()

    def serve(requests):
        threads.add(threading.current_thread())
        return [0 for _ in requests]

    list(interleave([countdown(2), countdown(2)], serve))
    assert threads == {threading.current_thread()}


def test_an_error_in_one_task_ends_the_others_and_is_raised() -> None:
    ended = []

    def patient(ask):
        try:
            while True:
                ask(0)
        finally:
            ended.append(True)

    def broken(ask):
        ask(0)
        raise ZeroDivisionError("one")

    with pytest.raises(ZeroDivisionError, match="one"):
        list(interleave([patient, broken, patient], lambda requests: [0 for _ in requests]))
    assert ended == [True, True]
    assert not [t for t in threading.enumerate() if t.name.startswith("search-")]


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_an_interrupted_batch_keeps_what_was_yielded(error: type[BaseException]) -> None:
    def serve(requests):
        if len(requests) == 1:
            raise error
        return [0 for _ in requests]

    found = {}

    def consume() -> None:
        found.update((index, result) for index, result in interleave([countdown(1), countdown(5)], serve))

    with pytest.raises(error):
        consume()
    assert found == {0: [0]}
    time.sleep(0.05)
    assert not [t for t in threading.enumerate() if t.name.startswith("search-")]


def test_a_task_without_questions_finishes() -> None:
    assert dict(interleave([countdown(0), countdown(1)], lambda requests: [7] * len(requests))) == {
        0: [],
        1: [7],
    }
    assert list(interleave([], lambda requests: [])) == []


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


def test_a_coarser_simulation_is_interpolated_onto_the_samples() -> None:
    channel = Channel("a", TIME, 2.0 * TIME, noise=1.0)
    coarse = Signals(TIME[::5], {"a": 2.0 * TIME[::5]})
    np.testing.assert_allclose(channel.residual(coarse), 0.0, atol=1e-12)


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


def point(temperature: float | None, **values: float) -> PointResult:
    return PointResult(
        label=f"{temperature} degC",
        temperature_degC=temperature,
        recordings=("r",),
        parameters={n: Estimate(v, "ohm", 0.01, True, "", 0.0, 9.0) for n, v in values.items()},
        correlation=np.eye(len(values)),
        cost=1.0,
        cost_per_sample=1.0,
        terms={},
        also={},
        profiles={},
        generations=(),
        evaluations=1,
        converged=True,
        stopped="",
        polished="",
    )


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
