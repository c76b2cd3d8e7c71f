"""The verdict, in standard deviations of the noise, and the share that is left."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from thsa_cosim.diagnosis.choosing.verdict import left_over, note_on_standard_errors, verdict_on
from thsa_cosim.diagnosis.results import StructuredError


def error(noise: float, structure: float, significance: float, rmse: float = 3.0) -> StructuredError:
    return StructuredError(rmse, 0.5, noise, "A", 1000, structure, significance)


NOTHING = error(1.0, 0.05, 2.0)
#: Structure in standard deviations of the noise, significance, accepted effects, candidates → verdict.
CASES = {
    "noise only": (0.05, 2.0, 0, 40, "no-missing-effect"),
    "small, if sure": (0.15, 50.0, 0, 40, "no-missing-effect"),
    "large, but chance": (0.9, 6.0, 0, 40, "no-missing-effect"),
    "visible": (0.151, 6.01, 0, 40, "unexplained-structure"),
    "explained": (0.05, 2.0, 1, 40, "missing-effect"),
    "explained but for the effect's form": (0.46, 90.0, 1, 40, "missing-effect"),
    "named, and visible beside it": (0.461, 90.0, 1, 40, "unexplained-structure"),
    "named, and chance beside it": (0.9, 5.0, 2, 40, "missing-effect"),
    "much is left, a small share of what was": (2.5, 900.0, 2, 40, "unexplained-structure"),
    "nothing could be tried": (2.5, 900.0, 0, 0, "not-tested"),
    "nothing could be tried, and nothing is left": (0.05, 2.0, 0, 0, "not-tested"),
}


@pytest.mark.parametrize("name", CASES)
def test_verdict(name: str):
    structure, significance, accepted, tested, expected = CASES[name]
    shown = error(2.0, 2.0 * structure, significance)
    assert verdict_on({"v": NOTHING, "i": shown}, accepted, tested) == expected
    assert verdict_on({"i": shown, "v": NOTHING}, accepted, tested) == expected


@pytest.mark.parametrize("name", CASES)
def test_standard_errors_are_doubted_where_something_is_left(name: str):
    structure, significance, accepted, _, expected = CASES[name]
    shown = error(2.0, 2.0 * structure, significance, rmse=2.56)
    for found in ({"v": error(4.0, 0.2, 2.0), "i": shown}, {"i": shown, "v": error(4.0, 0.2, 2.0)}):
        note = note_on_standard_errors(found, accepted)
        if expected == "unexplained-structure" or (expected == "not-tested" and structure > 1.0):
            assert note.startswith(
                "the model leaves 1.28 times the noise in i on held-out recordings: the standard"
            )
        else:
            assert note == ""


def test_a_gross_error_is_no_noise_even_where_few_samples_make_it():
    gross = error(2.0, 6.0, 1.5, rmse=6.1)
    assert verdict_on({"v": NOTHING, "i": gross}, 0, 40) == "unexplained-structure"
    assert verdict_on({"v": NOTHING, "i": gross}, 1, 40) == "missing-effect"


def test_the_share_that_is_left_is_that_of_the_worst_signal_that_shows_anything():
    samples = 20000
    channels = [
        SimpleNamespace(name=n, measured=np.zeros(samples), noise=0.5, weight=1.0) for n in ("v", "i", "u")
    ]
    measured = SimpleNamespace(units=dict.fromkeys(("v", "i", "u"), "A"))
    trials: Any = [SimpleNamespace(case=SimpleNamespace(channels=channels, measured=measured))]
    smooth = np.sin(np.arange(samples) * 0.01) * np.sqrt(2.0)
    noise = np.random.default_rng(5).standard_normal(3 * samples)

    def residual(*sizes: float) -> np.ndarray:
        return np.concatenate([size * smooth for size in sizes]) + noise

    assert left_over(trials, residual(10.0, 2.0, 0.0), residual(1.0, 1.0, 0.0)) == pytest.approx(
        0.25, rel=0.05
    )
    # A third of a signal's own structure is left: not "0 %", however small it is against the noise.
    assert left_over(trials, residual(10.0, 0.3, 0.0), residual(0.0, 0.1, 0.0)) == pytest.approx(
        0.11, abs=0.03
    )
    assert left_over(trials, residual(10.0, 0.0, 0.0), residual(0.0, 0.0, 0.5)) == 1.0, "what came up anew"
    assert left_over(trials, residual(0.0, 0.1, 0.0), residual(0.0, 0.1, 0.0)) == 0.0, "nothing to explain"
