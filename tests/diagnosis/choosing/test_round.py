"""The order of one round: screen, refine, further starts, choose, compare with forms and rivals."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from thsa_cosim.diagnosis.choosing import attribution as room
from thsa_cosim.diagnosis.choosing.rounds import APART, TAKEN, Round, taken_over


class Stages:
    """Stands for a `Selection`, and for what a round calls besides; notes what it was asked."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, *, is_open: bool, choice: Any) -> None:
        self.first, self.second = self.proposal("a", 9.0), self.proposal("b", 5.0)
        self.later = self.proposal("a", 7.0)
        self.one, self.two, self.elsewhere_ = (self.scored(p) for p in (self.first, self.second, self.later))
        self.choice = {"one": self.one, "two": self.two, None: None}[choice]
        self._open = is_open
        self.draws: list[tuple[list[Any], int]] = []
        self.asked: dict[str, Any] = {}
        self.better: Any = None
        self.form: Any = None
        self.started: Any = None
        self.others: list[Any] = []
        self.bench = SimpleNamespace(factors=lambda part: np.full(3, {"fit": 2.0}[part]))
        self.current = object()
        monkeypatch.setattr(room, "screen", self.screen)
        monkeypatch.setattr(room, "largest_gains", self.largest_gains)
        monkeypatch.setattr(room, "threshold", lambda gains: float(gains[0]))
        monkeypatch.setattr(room, "from_other_starts", self.from_other_starts)
        monkeypatch.setattr(room, "best_form", self.best_form)
        monkeypatch.setattr(room, "rivals_forms", self.rivals_forms)

    def proposal(self, effect: str, gain: float) -> Any:
        candidate = SimpleNamespace(effect=SimpleNamespace(name=effect), name=f"{effect}:motor")
        return SimpleNamespace(candidate=candidate, gain=gain)

    def scored(self, proposal: Any) -> Any:
        return SimpleNamespace(proposal=proposal, candidate=proposal.candidate)

    def screen(self, bench: Any, current: Any, offered: Any, waves: Any) -> list[Any]:
        assert (bench, current) == (self.bench, self.current)
        self.asked["screen"] = (offered, waves)
        return [self.first, self.second]

    def largest_gains(self, current: Any, proposals: Any, seed: int) -> np.ndarray:
        assert current is self.current
        self.draws.append((list(proposals), seed))
        return np.array([10.0 * len(proposals)])

    def refined(self, proposals: Any, limit: float) -> list[Any]:
        self.asked["refined"] = (list(proposals), limit)
        return [self.one]

    def is_open(self, scored: Any) -> bool:
        assert scored == [self.one]
        return self._open

    def at_sizes(self, scored: Any, proposals: Any) -> list[Any]:
        self.asked["sizes"] = (scored, list(proposals))
        return list(scored)

    def further(self, proposals: Any) -> list[Any]:
        return [self.later]

    def refined_further(self, scored: Any, proposals: Any, further: Any, limit: float) -> list[Any]:
        self.asked["further"] = (list(scored), list(proposals), list(further), limit)
        return [self.one, self.two]

    def choose(self, scored: Any, limit: float, first: bool, beside: bool) -> Any:
        self.asked["choose"] = (list(scored), limit, first, beside)
        return self.choice, ("why",)

    def overtaking(self, choice: Any, scored: Any) -> Any:
        self.asked["overtaking"] = (choice, list(scored))
        return self.better

    def from_other_starts(self, selection: Any, choice: Any) -> Any:
        assert selection is self
        return self.started or choice

    def best_form(self, selection: Any, choice: Any, scored: Any, proposals: Any, offered: Any) -> Any:
        assert selection is self
        self.asked["form"] = (choice, list(scored), list(proposals), offered)
        return self.form or choice, (self.two,)

    def rivals_forms(
        self, selection: Any, choice: Any, scored: Any, proposals: Any, offered: Any
    ) -> list[Any]:
        assert selection is self
        self.asked["rivals_forms"] = (choice, list(scored), list(proposals), offered)
        return list(self.others)

    def elsewhere(self, choice: Any, scored: Any, proposals: Any) -> list[Any]:
        self.asked["elsewhere"] = (choice, list(scored), list(proposals))
        return [self.elsewhere_]

    def rivals(self, choice: Any, scored: Any, named: Any) -> tuple[Any, ...]:
        self.asked["rivals"] = (choice, list(scored), named)
        return (self.two,)

    def round(self, whole: bool = True, accepted: Sequence[Any] = ()) -> Round:
        screened = room._screened(self, OFFERED, WAVES, 7)  # type: ignore[arg-type]
        return room._round(self, OFFERED, screened, 7, accepted, whole)  # type: ignore[arg-type]


OFFERED: Any = object()
WAVES: Any = {"motor": (3.0,)}


def test_a_round_in_which_nothing_leaves_nothing_searches_further_starts_and_draws_anew(
    monkeypatch: pytest.MonkeyPatch,
):
    s = Stages(monkeypatch, is_open=True, choice=None)
    found = s.round()
    assert s.asked["screen"] == (OFFERED, WAVES)
    assert s.asked["refined"] == ([s.first, s.second], 20.0)
    assert s.asked["further"] == ([s.one], [s.first, s.second], [s.later], 20.0)
    assert s.draws == [([s.first, s.second], 7), ([s.first, s.later, s.second], 7)], "with the same seed"
    assert s.asked["sizes"] == ([s.one, s.two], [s.first, s.second])
    assert s.asked["choose"] == ([s.one, s.two], 30.0, True, False)
    assert (found.threshold, found.gains.tolist(), found.factors.tolist()) == (30.0, [30.0], [2.0] * 3)
    assert found.proposals == (s.first, s.later, s.second)
    assert (found.scored, found.accepted, found.objections) == ((s.one, s.two), None, ("why",))
    assert (found.rivals, found.forms) == ((), ())
    assert set(s.asked) == {"screen", "refined", "further", "sizes", "choose"}


def test_a_round_with_a_fit_that_leaves_nothing_compares_it_with_rivals_and_forms(
    monkeypatch: pytest.MonkeyPatch,
):
    s = Stages(monkeypatch, is_open=False, choice="one")
    named: Any = s.scored(s.proposal("x", 1.0))
    found = s.round(accepted=[named])
    assert len(s.draws) == 1
    assert s.asked["choose"] == ([s.one], 20.0, False, False)
    assert s.asked["overtaking"] == (s.one, [s.one])
    assert s.asked["form"] == (s.one, [s.one], [s.first, s.second], OFFERED)
    assert s.asked["elsewhere"] == (s.one, [s.one], [s.first, s.second])
    assert s.asked["rivals"] == (s.one, [s.one, s.elsewhere_], {"x"})
    assert (found.accepted, found.objections) == (s.one, ("why",))
    assert found.scored == (s.one, s.elsewhere_)
    assert (found.rivals, found.forms, found.threshold) == ((s.two,), (s.two,), 20.0)


def test_rivals_are_compared_in_their_best_form(monkeypatch: pytest.MonkeyPatch):
    s = Stages(monkeypatch, is_open=False, choice="one")
    other = s.scored(s.proposal("b", 4.0))
    s.others = [other]
    s.round()
    assert s.asked["rivals_forms"] == (s.one, [s.one], [s.first, s.second], OFFERED)
    assert s.asked["overtaking"] == (s.one, [s.one, other])
    assert other in s.asked["rivals"][1]


def test_what_takes_over_comes_first_and_the_others_are_told_why(monkeypatch: pytest.MonkeyPatch):
    s = Stages(monkeypatch, is_open=False, choice="one")
    s.better = s.two
    found = s.round()
    assert found.accepted is s.two
    assert s.asked["form"][0] is s.two
    assert found.scored[:2] == (s.two, s.one)
    assert found.objections == ("", "why")
    own = s.scored(s.proposal("a", 1.0))
    s.better, s.form = None, own
    found = s.round()
    assert found.accepted is own
    assert found.proposals == (own.proposal, s.first, s.second), "it was never screened"
    assert found.scored[:2] == (own, s.one)
    s.started, s.form = own, None
    found = s.round()
    assert s.asked["rivals_forms"][0] is own
    assert (found.accepted, found.scored[:2]) == (own, (own, s.one))


def test_parts_of_an_effect_have_no_rivals_and_no_further_starts(monkeypatch: pytest.MonkeyPatch):
    s = Stages(monkeypatch, is_open=True, choice="one")
    found = s.round(whole=False)
    assert set(s.asked) == {"screen", "refined", "choose"}
    assert s.asked["choose"] == ([s.one], 20.0, True, True)
    assert (found.accepted, found.rivals, found.forms, found.scored) == (s.one, (), (), (s.one,))


def test_those_that_were_not_refused_are_told_what_took_their_place():
    def one(effect: str) -> Any:
        candidate = SimpleNamespace(name=f"{effect}:motor")
        return SimpleNamespace(candidate=candidate, proposal=object())

    choice, form, other, refused, untried = one("a"), one("a"), one("b"), one("c"), one("d")
    scored, whys = taken_over(choice, [form, choice, other, refused, untried], ["", "x", "", "no"])
    assert scored == [choice, form, other, refused, untried]
    assert whys == ("", TAKEN, APART, "no")
