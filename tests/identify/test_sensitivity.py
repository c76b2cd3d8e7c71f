"""Sensitivities before a search, against closed forms of a model that is linear in its parameters."""

import io
import tomllib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from thsa_cosim import cli
from thsa_cosim.batch import Job, Outcome, Status
from thsa_cosim.batch.runner import OnOutcome
from thsa_cosim.costs.channels import Channel, ResidualReducer
from thsa_cosim.identify.problem import PointProblem
from thsa_cosim.identify.sensitivity import _at, sensitivity
from thsa_cosim.parameters import Parameter, ParameterSpace
from thsa_cosim.report.identify.sensitivity import print_sensitivity
from thsa_cosim.scenario import Executor, load
from thsa_cosim.signals import Signals
from thsa_cosim.study import Case, Engine

ROOT = Path(__file__).parents[2]
TIME = np.linspace(0.0, 1.0, 400)
NOISE = {"v": 0.01, "i": 0.1}


def outputs(a: float, b: float, c: float) -> dict[str, np.ndarray]:
    """v = a t + (b + c) t², i = a: b and c act only together, and a on both."""
    return {"v": a * TIME + (b + c) * TIME**2, "i": np.full(TIME.size, a)}


class LinearRunner:
    """Simulates ``outputs`` as a worker would; ``fails`` says so for every run."""

    def __init__(self, fails: bool = False) -> None:
        self.fails, self.jobs = fails, 0

    def run(self, jobs: Sequence[Job], on_outcome: OnOutcome) -> list[Outcome]:
        found = self.simulate(jobs)
        for index, outcome in enumerate(found):
            on_outcome(index, outcome)
        return found

    def simulate(self, jobs: Sequence[Job]) -> list[Outcome]:
        self.jobs += len(jobs)
        reduce = ResidualReducer(point().cases[0].channels)
        if self.fails:
            return [Outcome(Status.CRASH, "the process died by SIGSEGV") for _ in jobs]
        found = []
        for job in jobs:
            signals = Signals(TIME, outputs(*(job.values[n] for n in "abc")), {"v": "m/s", "i": "A"})
            found.append(Outcome(Status.OK, reduced=reduce(signals)))
        return found


def point(names: str = "abc") -> PointProblem:
    measured = outputs(1.0, 0.2, 0.3)
    channels = tuple(Channel(name, TIME, measured[name], NOISE[name]) for name in ("v", "i"))
    signals = Signals(TIME, measured, {"v": "m/s", "i": "A"})
    case = Case("run", Path("none.fmu"), signals, TIME, {}, channels, signals, None, None)
    space = ParameterSpace(tuple(Parameter(n, n, "1", 0.0, 2.0, start=1.0) for n in names))
    return PointProblem("all", None, (case,), space, "squared")


def test_expected_errors_and_responses_are_those_of_linear_least_squares() -> None:
    class OnlyTwo(LinearRunner):
        def simulate(self, jobs: Sequence[Job]) -> list[Outcome]:
            return super().simulate([Job(j.experiment, {**j.values, "c": 0.0}) for j in jobs])

    runner = OnlyTwo()
    found = _at(point("ab"), Engine(runner))
    jacobian = np.zeros((2 * TIME.size, 2))
    jacobian[: TIME.size] = np.stack([TIME, TIME**2], axis=1) / NOISE["v"]
    jacobian[TIME.size :, 0] = 1.0 / NOISE["i"]
    expected = np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))
    for parameter, stderr in zip(found.parameters, expected, strict=True):
        assert parameter.reason == ""
        assert parameter.stderr == pytest.approx(stderr, rel=0.15)  # the long-run covariance of drawn noise
    a, b = found.parameters
    assert a.responses["i"] == pytest.approx(0.1 * 2.0 / NOISE["i"])
    assert b.responses["v"] == pytest.approx(0.1 * 2.0 * np.sqrt(np.mean(TIME**4)) / NOISE["v"])
    assert b.responses["i"] == 0.0
    assert (a.signal, b.signal) == ("v", "v")
    assert found.runs == runner.jobs


def test_parameters_that_act_only_together_are_not_determined() -> None:
    a, b, c = _at(point(), Engine(LinearRunner())).parameters
    assert a.stderr is not None
    assert b.stderr is None
    assert "combination of it with c" in b.reason
    assert "combination of it with b" in c.reason


def test_start_values_that_cannot_be_simulated_are_said() -> None:
    found = _at(point(), Engine(LinearRunner(fails=True)))
    assert found.failure == "the process died by SIGSEGV"
    assert found.parameters == ()


def test_points_share_a_table_with_the_range_over_them() -> None:
    out = Console(width=140, file=io.StringIO())
    one = _at(point(), Engine(LinearRunner()))
    print_sensitivity(out, [one, replace(one, label="25 degC")])
    text = out.file.getvalue()
    assert "2 points from all to 25 degC" in text
    assert "i 2" in text
    assert "not determined" in text


@pytest.mark.skipif(not (ROOT / "fmus" / "Screw.fmu").exists(), reason="fmus/Screw.fmu has not been exported")
def test_a_bench_of_the_rig_determines_what_is_identified_on_it() -> None:
    text = (ROOT / "scenarios" / "screw.toml").read_text().replace('"../fmus/', f'"{ROOT / "fmus"}/')
    text = text.replace('"recordings/screw_*', f'"{ROOT}/scenarios/recordings/screw_m[35]0')
    found = sensitivity(load(tomllib.loads(text)), Executor(workers=1))
    assert [p.label for p in found] == ["-50 degC", "-30 degC"]
    for parameter in (p for at in found for p in at.parameters):
        assert parameter.stderr is not None
        assert 0.0 < parameter.stderr < 0.05 * parameter.value


def test_only_a_scenario_that_identifies_has_sensitivities(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.run_command(["check", str(tmp_path / "any.fmu"), "--sensitivity"]) == 2
    assert "needs a scenario with recordings to fit and [[parameters]]" in capsys.readouterr().err
