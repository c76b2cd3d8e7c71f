"""Forms of one effect: the one that fits takes over, and what fits as well makes the stated errors larger."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.analytic import DECLARED, bench, candidates, unknowns
from thsa_cosim.diagnosis.choosing import forms as room
from thsa_cosim.diagnosis.choosing.attribution import Attribution, attribute
from thsa_cosim.diagnosis.choosing.findings import found_effects, judged
from thsa_cosim.diagnosis.choosing.forms import (
    best_form,
    criterion,
    from_other_starts,
    likelihood,
    rivals_forms,
)
from thsa_cosim.diagnosis.choosing.score import Scored, held_shapes
from thsa_cosim.diagnosis.choosing.screen import propose, shape_starts
from thsa_cosim.diagnosis.choosing.selection import RIVAL_SHARE, RIVAL_WORTH, Selection
from thsa_cosim.diagnosis.choosing.spread import between_models
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.fit import Fit, refine
from thsa_cosim.diagnosis.fitting.uncertainty import standard_errors
from thsa_cosim.diagnosis.fitting.unknowns import Unknown, Unknowns
from thsa_cosim.diagnosis.fitting.weights import ChannelWeights

SEEDS = 20
HESS_SOOM = {"motorEffect.hessSoom.dF": 0.6, "motorEffect.hessSoom.v_S": 4.0}


def windage(exponent: float, size: float = 2e-3) -> dict[str, float]:
    block = "motorEffect.windage"
    return {f"{block}.b_q": size, f"{block}.n": exponent, f"{block}.v_r": 30.0}


def diagnosed(
    true: Mapping[str, float], effect: str, seed: int, forms: bool = True
) -> tuple[Bench, Attribution]:
    known = candidates(effect)
    own = bench(known, true, seed, held_shapes(known))
    offered = [c for c in known if forms or not c.variant.instead]
    found = attribute(own, unknowns(), offered, lambda _: {}, seed=1, most=1)
    assert found is not None
    return own, found


@cache
def errors(exponent: float, forms: bool) -> np.ndarray:
    """Errors of the viscous friction beside a drag of this exponent, in stated standard errors."""
    found = [_error(*diagnosed(windage(exponent, 6e-4), "windage", seed, forms)) for seed in range(SEEDS)]
    return np.array(found)


def _error(own: Bench, found: Attribution) -> float:
    fit = found.accepted[0].fit
    k = fit.unknowns.names.index("b")
    trials = own.of("fit")
    stated = np.hypot(standard_errors(fit, trials), between_models(found, fit, trials))[k]
    return float((fit.vector[k] - DECLARED["b"]) / stated)


def test_a_drag_that_is_no_square_gets_its_exponent_and_leaves_the_viscous_friction_alone():
    _, found = diagnosed(windage(1.8), "windage", 0)
    (effect,) = found_effects(found, found.final)
    values = effect.parameters
    assert values["n"].value == pytest.approx(1.8, abs=0.06)
    assert values["b_q"].value == pytest.approx(2e-3, rel=0.04)
    assert (values["v_r"].value, values["v_r"].stderr) == (30.0, 0.0), "given, and said"
    assert found.final.at(["b"])[0] == pytest.approx(DECLARED["b"], rel=0.1)
    decisions = {j.variant.split(" ")[0]: (j.decision, j.reason) for j in judged(found)}
    assert decisions["windage:motor/windage1"] == ("accepted", "")
    assert decisions["windage:motor/windage0"] == ("rejected", "another form of it fits better")


def test_a_square_stays_one_and_the_free_exponent_beside_it_widens_what_it_bends():
    own, found = diagnosed(windage(2.0), "windage", 0)
    (one,) = found.rounds
    assert one.accepted is not None
    assert one.accepted.candidate.key == "windage:motor/windage0"
    assert [f.candidate.key for f in one.forms] == ["windage:motor/windage1"]
    fit = one.accepted.fit
    own_errors = standard_errors(fit, own.of("fit"))
    added = dict(zip(fit.unknowns.names, between_models(found, fit, own.of("fit")) / own_errors, strict=True))
    assert added["b"] > 0.3
    assert added["motorEffect.windage.b_q"] > 0.2
    assert added["R"] < 0.1, "what the form does not bend stays as sure as it was"


def test_the_viscous_friction_beside_a_drag_is_inside_its_interval_whatever_the_exponent():
    for exponent in (2.0, 1.8):
        assert np.mean(np.abs(errors(exponent, True)) < 1.96) >= 0.85
    assert np.mean(np.abs(errors(1.8, False)) < 1.96) < 0.6, "a square alone is too sure of what it bends"


def test_a_fraction_of_the_speed_is_known_from_an_exponential():
    _, found = diagnosed(HESS_SOOM, "stribeck", 1)
    (effect,) = found_effects(found, found.final)
    assert effect.name.startswith("stribeck")
    assert set(effect.parameters) == {"dF", "v_S"}
    assert found.accepted[0].candidate.component == "hessSoom"
    assert found.final.at(["c"])[0] == pytest.approx(DECLARED["c"], rel=0.03)


def test_a_rival_in_another_place_bends_nothing_behind_a_rigid_gear():
    """Its errors are compared as well: what is kept of it has to do for that."""
    own, found = diagnosed(HESS_SOOM, "stribeck", 1)
    (one,) = found.rounds
    assert [r.candidate.effect.name for r in one.rivals] == ["stribeck"]
    trials, fit = own.of("fit"), found.accepted[0].fit
    added = between_models(found, fit, trials)
    assert np.isfinite(added).all()
    assert one.rivals[0].fit.jacobian.shape == (fit.residual.size, len(one.rivals[0].fit.vector))


def test_a_form_that_fits_worse_counts_by_its_likelihood():
    def fitted(cost: float, inflation: float = 1.0) -> Any:
        return SimpleNamespace(fit=SimpleNamespace(cost=cost, inflation=inflation))

    assert likelihood(fitted(104.0), fitted(100.0)) == pytest.approx(np.exp(-2.0))
    assert likelihood(fitted(104.0), fitted(100.0, 2.0)) == pytest.approx(np.exp(-1.0))
    assert likelihood(fitted(90.0), fitted(100.0)) == 1.0


def test_a_further_coefficient_has_to_earn_two_and_doubtful_noise_makes_a_lead_smaller():
    def fitted(cost: float, size: int) -> Any:
        return SimpleNamespace(fit=SimpleNamespace(cost=cost, vector=np.zeros(size)))

    assert criterion(fitted(100.0, 3), 1.0) == 106.0
    assert criterion(fitted(100.0, 4), 1.0) - criterion(fitted(102.0, 3), 1.0) == 0.0
    assert criterion(fitted(100.0, 3), 4.0) == 31.0


def form(name: str, cost: float = 100.0, gain: float = 100.0, **more: Any) -> Any:
    """A fitted form of one effect at the motor, in a block of its own; ``instead``: it is never screened itself."""
    candidate = SimpleNamespace(
        name=more.get("effect", "a:motor"),
        slot=SimpleNamespace(name=more.get("place", "motor")),
        key=f"a:motor/{name}",
        component=more.get("component", name),
        variant=SimpleNamespace(instead=more.get("instead", False), beside=more.get("beside", False)),
        parameters=[SimpleNamespace(scanned=more.get("scanned", False))],
    )
    names = ("p", f"motor.{candidate.component}.{more.get('own', 'k')}")
    members = tuple(Unknown(n, n, "1", 0.0, np.inf, 1.0, -99.0, 99.0, declared=n == "p") for n in names)
    vector = np.array(more.get("vector", [0.0, 0.0]))
    fit = Fit(Unknowns(members), vector, np.ones(9), np.eye(9, 2), np.ones(2), cost, True)
    proposal = SimpleNamespace(candidate=candidate, gain=more.get("promised", gain))
    return Scored(proposal, fit, np.zeros(9), gain, gain, 9.0, 1.0)  # type: ignore[arg-type]


class Forms:
    """Stands for a `Selection` whose fits are there already, and for what is said of them."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.bench, self.current, self.held = object(), object(), object()
        self.leads: dict[tuple[str, str], float] = {}
        self.started: list[Any] = []
        self.asked: list[Any] = []
        self.curves: list[tuple[str, str]] = []
        self.screened: list[Any] = []
        self.known: dict[str, Any] = {}
        self.promised: list[Any] = []
        self.weak: set[str] = set()
        self.continued: set[str] = set()
        self.ended: set[int] = set()
        monkeypatch.setattr(room, "_lead", self.lead)
        monkeypatch.setattr(room, "insignificant", lambda s: "weak" if s.candidate.key in self.weak else "")
        monkeypatch.setattr(room, "out_of_range", lambda fit: "p" if id(fit) in self.ended else "")
        monkeypatch.setattr(room, "polish", self.polish)
        monkeypatch.setattr(room, "along_exponents", self.along)
        monkeypatch.setattr(room, "propose", self.propose)
        monkeypatch.setattr(room, "shape_starts", lambda candidate, scanned, known: [{"n": 1.0}, {"n": 2.0}])

    def lead(self, selection: Any, one: Any, other: Any) -> float:
        assert selection is self
        return self.leads.get((one.candidate.key[-1], other.candidate.key[-1]), 0.0)

    def rough(self, one: Any) -> bool:
        return one.candidate.key in self.continued

    def polish(self, bench: Any, one: Any, current: Any, held: Any, _rough: bool = False) -> Any:
        assert (bench, current, held) == (self.bench, self.current, self.held)
        self.started.append(one)
        return one

    def along(self, selection: Any, one: Any, like: Any) -> Any:
        assert selection is self
        self.curves.append((one.candidate.key[-1], like.candidate.key[-1]))
        return one

    def polished(self, one: Any) -> Any:
        return one

    def fitted(self, proposals: Any) -> list[Any]:
        self.asked += [p.candidate.key[-1] for p in proposals]
        return [self.known[p.candidate.key[-1]] for p in proposals if p.candidate.key[-1] in self.known]

    def propose(self, bench: Any, current: Any, rows: Any) -> list[Any]:
        assert (bench, current) == (self.bench, self.current)
        self.screened.append([(c.key[-1], shapes["n"]) for c, shapes in rows])
        return self.promised

    def best(
        self, choice: Any, *others: Any, proposals: Any = (), offered: Any = ()
    ) -> tuple[str, list[str]]:
        best, alike = best_form(self, choice, [choice, *others], proposals, offered)  # type: ignore[arg-type]
        return best.candidate.key[-1], [s.candidate.key[-1] for s in alike]


@pytest.fixture
def forms(monkeypatch: pytest.MonkeyPatch) -> Forms:
    return Forms(monkeypatch)


def test_the_form_with_the_best_criterion_takes_over_and_the_others_are_as_likely(forms: Forms):
    choice = form("c")
    assert forms.best(choice, form("a", 90.0), form("b", 80.0)) == ("b", ["c", "a"])
    assert forms.best(choice, form("a", 100.0)) == ("c", ["a"]), "no better: the first stays"
    assert forms.best(choice) == ("c", [])


def test_what_is_gone_on_from_in_another_way_keeps_its_form(forms: Forms):
    choice = form("c")
    forms.continued.add(choice.candidate.key)
    assert forms.best(choice, form("a", 90.0)) == ("c", [])
    assert forms.curves == []


def test_the_best_one_is_compared_first(forms: Forms):
    """It explains the held-out recordings as well as the choice, though not as well as a form that comes second."""
    forms.leads[("a", "b")] = 4.0
    assert forms.best(form("c"), form("a", 90.0), form("b", 80.0)) == ("b", ["c", "a"])


def test_a_form_that_fits_better_has_to_hold_on_the_held_out_recordings_and_to_be_believed(forms: Forms):
    choice, better = form("c"), form("a", 90.0)
    forms.leads[("c", "a")] = 3.0
    assert forms.best(choice, better) == ("c", []), "three standard errors are apart"
    forms.leads[("c", "a")] = 2.99
    assert forms.best(choice, better) == ("a", ["c"])
    forms.weak.add(better.candidate.key)
    assert forms.best(choice, better) == ("c", ["a"])
    forms.weak.clear()
    forms.ended.add(id(better.fit))
    assert forms.best(choice, better) == ("c", ["a"])


def test_the_choice_and_forms_of_other_blocks_are_fitted_along_their_exponents(forms: Forms):
    choice = form("c", component="x")
    forms.best(choice, form("a", component="x"), form("d"))
    assert forms.curves == [("c", "c"), ("d", "c")]


def test_a_form_that_gains_far_less_is_not_compared_unless_it_is_one_for_this_alone(forms: Forms):
    choice, least = form("c"), RIVAL_SHARE * 100.0
    assert forms.best(choice, form("a", 90.0, least)) == ("a", ["c"])
    assert forms.best(choice, form("a", 90.0, least - 0.1)) == ("c", [])
    assert forms.best(choice, form("a", 90.0, 1.0, instead=True)) == ("a", ["c"])


def test_only_other_formulas_of_the_effect_in_its_place_are_forms(forms: Forms):
    choice = form("c")
    for other in (
        form("a", 90.0, effect="b:motor"),
        form("a", 90.0, place="gear"),
        form("a", 90.0, beside=True),
        form("a", 90.0, scanned=True),
    ):
        assert forms.best(choice, other) == ("c", [])
    assert forms.best(choice, form("c", 90.0)) == ("c", []), "the same one is no other"


def test_a_form_of_the_same_block_is_fitted_from_the_optimum_of_the_choice(forms: Forms):
    choice = form("c", component="x", vector=[1.0, 2.0])
    wider = form("a", component="x", vector=[5.0, 6.0])
    own = form("b", component="x", own="n", vector=[5.0, 6.0])
    apart = form("d", component="y", vector=[5.0, 6.0])
    forms.best(choice, wider, own, apart)
    assert [(s.candidate.key[-1], *s.fit.vector) for s in forms.started] == [("a", 1.0, 2.0), ("b", 1.0, 6.0)]


def test_a_form_that_cannot_be_simulated_at_that_optimum_stays_as_it_was(forms: Forms):
    choice, wider = form("c", component="x", vector=[1.0, 2.0]), form("a", 90.0, component="x")
    best, _ = best_form(forms, choice, [choice, wider], [], [])  # type: ignore[arg-type]
    assert best is wider, "not with the choice's values beside its own residuals"


def test_a_form_of_another_block_is_fitted_once_with_all_parameters(
    forms: Forms, monkeypatch: pytest.MonkeyPatch
):
    """A rival's fit is at hand already where the comparison needed it."""
    choice, apart = form("c"), form("d", 90.0)
    whole = replace(apart, fit=replace(apart.fit, cost=70.0))
    monkeypatch.setattr(forms, "polished", lambda one: whole if one is apart else one)
    best, alike = best_form(forms, choice, [apart], [], [])  # type: ignore[arg-type]
    assert best is whole
    assert alike == (choice,)
    assert forms.started == []


def test_forms_that_were_not_refined_are_screened_and_the_best_start_of_each_is_fitted(forms: Forms):
    choice = form("c")
    less = RIVAL_WORTH * 100.0
    forms.promised = [
        form("a", promised=50.0).proposal,
        form("a", promised=60.0).proposal,
        form("b", promised=less).proposal,
        form("d", promised=less - 0.1).proposal,
        form("e", promised=99.0, effect="b:motor").proposal,
        form("c", promised=99.0).proposal,
    ]
    forms.known = {"a": form("a", 80.0), "b": form("b", 90.0)}
    offered = [
        form("a", instead=True).candidate,
        form("b").candidate,
        form("e", effect="b:motor", instead=True).candidate,
    ]
    assert forms.best(choice, offered=offered) == ("a", ["c", "b"])
    assert forms.screened == [[("a", 1.0), ("a", 2.0)]]
    assert forms.asked == ["a", "b"], "best first"
    assert forms.best(choice, form("a"), offered=offered)[0] == "b"
    assert forms.asked[2:] == ["b"], "what is fitted already is not fitted again"


def test_nothing_is_screened_where_no_form_waits_for_it(forms: Forms):
    proposals = [form("a", promised=50.0).proposal]
    forms.known = {"a": form("a", 80.0)}
    assert forms.best(form("c"), proposals=proposals, offered=[form("b").candidate]) == ("a", ["c"])
    assert forms.screened == []


class Rivals:
    """Other effects beside a choice, what their best forms are, and who was asked."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, *best: Any) -> None:
        self.best = {s.candidate.name: s for s in best}
        self.asked: list[Any] = []
        self.choice = rival("c", effect="c:motor")
        monkeypatch.setattr(room, "best_form", self.best_form)

    def polished(self, one: Any) -> Any:
        return replace(one, fit=replace(one.fit, cost=1.0))

    def best_form(self, selection: Any, other: Any, scored: Any, proposals: Any, offered: Any) -> Any:
        assert selection is self
        assert (scored[0], proposals) == (self.choice, ["proposals"])
        assert other.fit.cost == 1.0, "with all parameters fitted"
        self.asked.append(other.candidate.key[-1])
        return self.best.get(other.candidate.name, other), ()

    def forms(self, *others: Any, offered: Any = ()) -> list[str]:
        proposals: Any = ["proposals"]
        found = rivals_forms(self, self.choice, [self.choice, *others], proposals, offered)  # type: ignore[arg-type]
        return [s.candidate.key[-1] for s in found]


def rival(name: str, gain: float = 100.0, **more: Any) -> Any:
    made = form(name, gain=gain, **more)
    made.candidate.effect = SimpleNamespace(name=more.get("effect", "a:motor").split(":")[0])
    return made


def test_a_rival_is_compared_in_its_best_form_where_that_is_a_new_fit(monkeypatch: pytest.MonkeyPatch):
    other = rival("a")
    offered = [form("b", instead=True).candidate]
    rivals = Rivals(monkeypatch, rival("b", instead=True))
    assert rivals.forms(other, offered=offered) == ["b"]
    assert Rivals(monkeypatch).forms(other, offered=offered) == [], "it is in its best form"
    assert Rivals(monkeypatch, rival("b")).forms(rival("a", instead=True)) == ["b"], "it is one of several"


def test_only_near_rivals_of_other_effects_that_have_forms_are_tried(monkeypatch: pytest.MonkeyPatch):
    least = RIVAL_SHARE * 100.0
    offered = [form("b", instead=True).candidate, form("x", effect="c:gear", instead=True).candidate]
    for other, asked in (
        (rival("a", least), ["a"]),
        (rival("a", least - 0.1), []),  # explains less
        (rival("d", effect="d:motor"), []),  # of one formula
        (rival("e", effect="c:gear"), []),  # the choice's effect in another place
    ):
        rivals = Rivals(monkeypatch)
        assert rivals.forms(other, offered=offered) == []
        assert rivals.asked == asked
    rivals = Rivals(monkeypatch)
    rivals.forms(rival("a"), offered=[form("b").candidate])
    assert rivals.asked == [], "a form that is screened itself is at hand already"


def test_of_each_rival_the_first_fit_is_tried_once_and_the_next_one_after_it(monkeypatch: pytest.MonkeyPatch):
    rivals = Rivals(monkeypatch, rival("b"), rival("f", effect="e:motor"))
    offered = [form("b", instead=True).candidate, form("f", effect="e:motor", instead=True).candidate]
    others = (rival("d", effect="d:motor"), rival("a"), rival("g"), rival("e", effect="e:motor"))
    assert rivals.forms(*others, offered=offered) == ["b", "f"]
    assert rivals.asked == ["a", "e"]


@pytest.mark.parametrize("stays", ["", "its shape is known", "it leaves nothing"])
def test_a_fit_whose_shape_is_not_known_to_within_itself_is_tried_from_the_other_starts(stays: str):
    """A Stribeck speed that went to the end of its range leaves more than the start on the right side leads to."""
    offered = tuple(c for c in candidates("stribeck") if c.slot.name == "motor" and not c.variant.instead)
    true = {"motorEffect.stribeck.dF": 0.6, "motorEffect.stribeck.v_S": 4.0, "motorEffect.stribeck.n": 1.0}
    own = bench(offered, true, 3, held_shapes(offered))
    base = refine(own, unknowns(), unknowns().start)
    assert base is not None
    (held,) = own.residuals(base.unknowns, base.vector[None, :], "validate")
    assert held is not None
    selection = Selection(own, ChannelWeights(own), base, held, lambda _: None)
    selection.weights.base_held = held
    rows = [(offered[0], shapes) for shapes in shape_starts(offered[0], {}, {})]
    best, *_ = selection.fitted(propose(own, base, rows))
    k = best.fit.unknowns.names.index("motorEffect.stribeck.v_S")
    vector, jacobian = best.fit.vector.copy(), best.fit.jacobian.copy()
    vector[k] = best.fit.unknowns.members[k].upper
    if stays != "its shape is known":
        jacobian[:, k] = 0.0
    left = best.validate if stays == "it leaves nothing" else held
    ended = replace(
        best,
        validate=left,
        fit=replace(best.fit, vector=vector, own=jacobian, shared=None, cost=100.0 * best.fit.cost),
    )
    found = from_other_starts(selection, ended)
    if stays:
        assert found is ended
    else:
        assert found.fit.cost <= best.fit.cost
        assert found.fit.vector[k] == pytest.approx(4.0, rel=0.2)
