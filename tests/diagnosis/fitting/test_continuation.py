"""From a fit in step to the free run: gains between those of the ladder where the model would fall out of step."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from thsa_cosim.diagnosis.fitting import continuation as room
from thsa_cosim.diagnosis.fitting.continuation import MORE, SHARES, released

GAIN = 10.0


class Ladder:
    """Fits that stay in step as long as the gain falls to no less than ``reach`` of the last one's, or from ``low``.

    The vector of a fit is the share of the gain that it stays in step with.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch, reach: float, low: float = 0.005) -> None:
        self.reach, self.low = reach, low
        self.shares: list[float] = []
        monkeypatch.setattr(room, "refine", self.refine)

    def refine(self, share: float, _unknowns: Any, last: float, **_more: Any) -> Any:
        self.shares.append(share)
        return fitted(share, self.misfit(share, last))

    def misfit(self, share: float, last: float) -> float:
        in_step = last == 1.0 or share >= self.reach * last or last <= self.low
        return 100.0 if in_step else 1000.0

    def released(self) -> Any:
        following: Any = SimpleNamespace(at=lambda gain: gain / GAIN)
        free: Any = 0.0
        return released(free, following, GAIN, fitted(1.0))


def fitted(share: float, misfit: float = 100.0) -> Any:
    rest = dict.fromkeys(("unknowns", "jacobian", "steps"))
    return SimpleNamespace(vector=share, misfit=misfit, residual=np.zeros(100), **rest)


def test_the_gains_of_the_ladder_are_enough_where_the_model_stays_in_step(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    ladder = Ladder(monkeypatch, 0.1, 0.01)
    assert ladder.released().vector == 0.0
    assert ladder.shares == pytest.approx([*SHARES, 0.0])


def test_a_gain_between_two_keeps_the_model_in_step(monkeypatch: pytest.MonkeyPatch) -> None:
    ladder = Ladder(monkeypatch, 0.35, 0.01)
    assert ladder.released().vector == 0.0
    between = [0.03**0.5, 0.003**0.5, 0.0003**0.5]
    steps = [one for share, middle in zip(SHARES[1:], between, strict=True) for one in (share, middle, share)]
    assert ladder.shares == pytest.approx([SHARES[0], *steps, 0.0])


def test_before_the_free_run_a_still_smaller_gain_is_put_in(monkeypatch: pytest.MonkeyPatch) -> None:
    ladder = Ladder(monkeypatch, 0.29, 0.004)
    assert ladder.released().vector == 0.0
    assert ladder.shares[-3:] == pytest.approx([0.0, 0.3 * SHARES[-1], 0.0])


def test_what_falls_out_of_step_at_every_gain_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    ladder = Ladder(monkeypatch, 0.999)
    assert ladder.released() is None
    assert len(ladder.shares) == 1 + MORE + 1, "the first one has nothing to be compared with"


def test_a_gain_is_put_in_no_more_where_the_last_one_has_not_helped(monkeypatch: pytest.MonkeyPatch) -> None:
    class Rising(Ladder):
        def misfit(self, share: float, last: float) -> float:
            return 115.0 if share < 0.15 else 100.0

    ladder = Rising(monkeypatch, 1.0)
    assert ladder.released().vector == 0.0
    second = [SHARES[1], 0.03**0.5, SHARES[1]]
    assert ladder.shares[: 1 + len(second)] == pytest.approx([SHARES[0], *second])
    assert ladder.shares.count(SHARES[1]) == 2


@pytest.mark.parametrize(("later", "tries"), [(115.0, 3), (125.0, 2)])
def test_a_gain_that_takes_back_half_of_the_growth_is_followed_by_another(
    monkeypatch: pytest.MonkeyPatch, later: float, tries: int
) -> None:
    class Falling(Ladder):
        def misfit(self, share: float, last: float) -> float:
            again = self.shares.count(share)
            return 100.0 if share != SHARES[1] or again > 2 else {1: 140.0, 2: later}[again]

    ladder = Falling(monkeypatch, 1.0)
    assert ladder.released().vector == 0.0
    assert ladder.shares.count(SHARES[1]) == tries


def test_what_hides_too_much_in_step_is_given_up_at_the_first_gain(monkeypatch: pytest.MonkeyPatch) -> None:
    class Hidden(Ladder):
        def misfit(self, share: float, last: float) -> float:
            return 201.0

    ladder = Hidden(monkeypatch, 1.0)
    assert ladder.released() is None
    assert ladder.shares == [SHARES[0]]


def test_the_misfit_is_compared_with_the_least_on_the_way(monkeypatch: pytest.MonkeyPatch) -> None:
    class Lost(Ladder):
        def misfit(self, share: float, last: float) -> float:
            return 40.0 if share == SHARES[0] else 90.0

    assert Lost(monkeypatch, 1.0).released() is None, "less than twice 100 in step, more than twice 40"
