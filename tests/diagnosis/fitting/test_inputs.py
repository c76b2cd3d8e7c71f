"""What the noise of smoothed inputs adds to a fit's errors, against closed forms."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from thsa_cosim.costs.channels import Channel
from thsa_cosim.diagnosis.fitting import inputs as room
from thsa_cosim.diagnosis.fitting.fit import Fit
from thsa_cosim.diagnosis.fitting.inputs import DRAWS, LEAST, drawn, draws_of, errors_of_inputs, knots
from thsa_cosim.diagnosis.fitting.trials import Trial
from thsa_cosim.diagnosis.fitting.unknowns import Unknown, Unknowns
from thsa_cosim.recordings.piecewise import fit_piecewise_linear
from thsa_cosim.signals import Signals
from thsa_cosim.study import Case

TIME = np.arange(10_001) * 1e-3
NOISE = 60.0
LOAD = np.interp(TIME, [0.0, 3.0, 3.2, 7.0, 7.1, 10.0], [5e4, 5e4, 2e4, 2e4, -1e4, -1e4])


def trial(part: Any = "fit", noise: Mapping[str, float] | None = None) -> Trial:
    inputs = Signals(TIME, {"v_cmd": np.sin(TIME), "F_load": LOAD}, {"F_load": "N"})
    channel = Channel("y", TIME, np.zeros(TIME.size), 1.0)
    case = Case(
        "a", Path("x.fmu"), inputs, TIME, {}, (channel,), inputs, 20.0, None,
        input_noise={"F_load": NOISE} if noise is None else noise,
    )  # fmt: skip
    return Trial(case, part, "20 degC")


def test_knots_are_where_a_signal_bends():
    np.testing.assert_allclose(knots(TIME, LOAD), [0.0, 3.0, 3.2, 7.0, 7.1, 10.0])
    np.testing.assert_allclose(knots(TIME, np.full(TIME.size, 3.0)), [0.0, 10.0])
    between = np.interp(TIME, [0.0, 3.0004, 10.0], [0.0, 1.0, 0.0])  # bends at both neighbours of its knot
    np.testing.assert_allclose(knots(TIME, between), [0.0, 3.0, 10.0])


def test_a_draw_errs_as_the_smoothing_itself_does():
    """Level and error of a straight piece, over many draws, against those of the smoothing of noisy samples."""
    random = np.random.default_rng(3)
    pieces = [slice(200, 2800), slice(3400, 6800), slice(7300, 9800)]
    ours = np.array([drawn(trial(), k).case.inputs["F_load"] - LOAD for k in range(200)])
    theirs = np.array(
        [
            fit_piecewise_linear(TIME, LOAD + random.normal(0.0, NOISE, TIME.size), NOISE).at(TIME) - LOAD
            for _ in range(40)
        ]
    )
    for piece in pieces:
        sizes = [np.sqrt(np.mean(errors[:, piece].mean(axis=1) ** 2)) for errors in (ours, theirs)]
        assert sizes[0] == pytest.approx(sizes[1], rel=0.4)
        assert sizes[0] == pytest.approx(NOISE / np.sqrt(piece.stop - piece.start), rel=0.25)
    other = drawn(trial(), 1).case
    np.testing.assert_array_equal(other.inputs["v_cmd"], np.sin(TIME))
    assert other.inputs.units["F_load"] == "N"
    assert other.name != "a"
    np.testing.assert_array_equal(other.inputs["F_load"], drawn(trial(), 1).case.inputs["F_load"])


def test_only_fit_recordings_with_a_smoothed_input_are_drawn(monkeypatch: pytest.MonkeyPatch):
    assert draws_of([trial(noise={}), trial("validate")]) == []
    draws = draws_of([trial(), trial("validate")])
    assert [len(d) for d in draws] == [1] * DRAWS
    assert len({d[0].name for d in draws}) == DRAWS
    monkeypatch.setattr(room, "AT_ONCE", 1)
    assert len(draws_of([trial()])) == LEAST, "of long recordings"


def test_the_error_of_a_factor_of_the_input_is_that_of_the_inputs_level():
    """y = p F, F a straight line that is near a constant: p errs by the mean's error, in units of F."""
    level, p, sigma = 5e4, 0.3, 20.0
    flat = trial()
    flat = Trial(
        Case(
            "a", Path("x.fmu"), Signals(TIME, {"F_load": np.full(TIME.size, level)}), TIME, {}, (), flat.case.measured,
            20.0, None, input_noise={"F_load": NOISE},
        ), "fit", "",
    )  # fmt: skip
    unknowns = Unknowns((Unknown("p", "p", "1", p, np.inf, scale=0.1, lower=0.0, upper=1.0),))
    jacobian = np.full((TIME.size, 1), 0.1 * level / sigma)
    fit = Fit(unknowns, np.array([p]), np.zeros(TIME.size), jacobian, np.ones(1), 0.0, True)
    residuals = [p * (drawn(flat, k).case.inputs["F_load"] - level) / sigma for k in range(400)]
    (found,) = errors_of_inputs(fit, residuals)
    assert found == pytest.approx(p * NOISE / np.sqrt(TIME.size) / level, rel=0.15)
    assert errors_of_inputs(fit, []) == np.zeros(1)


def test_few_draws_state_an_error_whose_double_holds_in_95_percent():
    unknowns = Unknowns((Unknown("p", "p", "1", 0.3, np.inf, scale=0.1, lower=0.0, upper=1.0),))
    fit = Fit(unknowns, np.array([0.3]), np.zeros(4), np.full((4, 1), 0.5), np.ones(1), 0.0, True)
    random, inside = np.random.default_rng(4), []
    for sizes in random.standard_normal((2000, 9)):
        (stated,) = errors_of_inputs(fit, [np.full(4, 0.5 * size) for size in sizes[:8]])
        inside.append(abs(0.1 * sizes[8]) < 1.96 * stated)
    assert np.mean(inside) == pytest.approx(0.95, abs=0.015)
