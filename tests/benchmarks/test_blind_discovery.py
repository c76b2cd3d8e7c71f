"""The scoring of leave-one-out discovery: a law that is the true one, one that is off, one in the wrong place."""

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
sys.path.append(str(BENCHMARKS))
from blind_discovery import NO_RESULT, Discovery, OutOfTime, limited, plan, summary, without
from blind_effects import CATALOGUE
from blind_laws import PLACES, SLOTS, joined, law_at, place_of
from blind_plant import Undeclared, declared

RIG = declared(0.0)
TIME = np.arange(4001) * 1e-3


def signals() -> dict[str, np.ndarray]:
    """A run of a model without effects: there and back under two loads."""
    at = {f"{slot}.{name}": np.zeros(TIME.size) for slot, names in SLOTS.items() for name in names}
    speed = 5e-3 * np.sin(2.0 * np.pi * TIME)
    position = 5e-3 / (2.0 * np.pi) * (1.0 - np.cos(2.0 * np.pi * TIME))
    for slot, ratio in (("screwEffect", 1.0), ("gearboxEffect", 1.0 / RIG.k), ("motorEffect", RIG.i / RIG.k)):
        at |= {f"{slot}.v": ratio * speed, f"{slot}.s": np.sign(speed), f"{slot}.z": ratio * position}
    load = np.where(TIME < 2.0, 1e4, 4e4)
    at |= {"screwEffect.N": load, "gearboxEffect.N": RIG.k * load, "shaftEffect.T": RIG.k * load}
    at |= {"torqueEffect.i_q": 20.0 * speed / 5e-3, "inverterEffect.i_q": 20.0 * speed / 5e-3}
    at |= {"currentSensorEffect.u": 20.0 * speed / 5e-3, "velocitySensorEffect.u": speed}
    at |= {"contactEffect.phi": position / RIG.k, "contactEffect.delta": 1e-4 * speed / 5e-3}
    return at | {"windingEffect.P": 1.2 * (20.0 * speed / 5e-3) ** 2}


def deviation(extra: Undeclared, **found: np.ndarray) -> tuple[float, float]:
    at = signals() | {name.replace("__", "."): values for name, values in found.items()}
    return law_at(place_of(extra), TIME, at, RIG, extra).deviation()


def test_a_law_that_is_the_true_one_does_not_deviate_and_one_that_is_ten_percent_off_does_so():
    extra, at = Undeclared(load_nut=0.05), signals()
    true = 0.05 * np.abs(at["screwEffect.N"]) * at["screwEffect.s"]
    assert deviation(extra, screwEffect__F=true) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert deviation(extra, screwEffect__F=1.1 * true) == pytest.approx((0.1, 0.1))


def test_what_declared_parameters_take_up_is_no_deviation():
    extra, at = Undeclared(load_nut=0.05), signals()
    true = 0.05 * np.abs(at["screwEffect.N"]) * at["screwEffect.s"]
    shifted = true + 300.0 * at["screwEffect.s"] + 1e4 * at["screwEffect.v"]
    assert deviation(extra, screwEffect__F=shifted) == pytest.approx((0.0, 0.0), abs=1e-9)


def test_one_wrong_place_along_the_stroke_shows_in_the_largest_deviation_more_than_in_the_mean():
    extra, at = Undeclared(slope_nut=2e4), signals()
    true = 2e4 * at["screwEffect.z"] * at["screwEffect.s"]
    spot = np.where(np.abs(at["screwEffect.z"] - 0.5 * np.ptp(at["screwEffect.z"])) < 1e-4, 0.2, 0.0)
    rms, largest = deviation(extra, screwEffect__F=true * (1.0 + spot))
    assert 0.0 < rms < 0.5 * largest


def test_a_law_in_another_place_is_none_at_its_own():
    extra, at = Undeclared(load_nut=0.05), signals()
    elsewhere = 0.05 * np.abs(at["gearboxEffect.N"]) * at["gearboxEffect.s"]
    assert deviation(extra, gearboxEffect__F=elsewhere) == pytest.approx((1.0, 1.0))


def test_motor_gearbox_and_screw_are_one_shaft():
    extra, at = Undeclared(windage=0.1), signals()
    true = 0.1 * (0.01 * at["motorEffect.v"]) ** 2 * at["motorEffect.s"]
    assert deviation(extra, gearboxEffect__F=RIG.i * true) == pytest.approx((0.0, 0.0), abs=1e-9)


ONE = (
    ({"saturation_square": 1e-5}, "torqueEffect__g_t", lambda at: -1e-5 * at["torqueEffect.i_q"] ** 2),
    ({"current_gain": 1.02}, "currentSensorEffect__d", lambda at: 0.02 * at["currentSensorEffect.u"]),
    ({"velocity_gain": 1.02}, "velocitySensorEffect__d", lambda at: 0.02 * at["velocitySensorEffect.u"]),
    (
        {"dead_voltage": 2.0},
        "inverterEffect__du",
        lambda at: -2.0 * np.clip(at["inverterEffect.i_q"] / 0.1, -1.0, 1.0),
    ),
    (
        {"heating": 0.3},
        "windingEffect__g_R",
        lambda at: 0.00393 * 0.3 * np.concatenate([[0.0], np.cumsum(at["windingEffect.P"][:-1])]) * 1e-3,
    ),
    ({"gap": 1e-4}, "contactEffect__e", lambda at: -np.clip(at["contactEffect.delta"], -5e-5, 5e-5)),
    (
        {"lead_error": 1e-5},
        "contactEffect__e",
        lambda at: 1e-5 * np.sin(at["contactEffect.phi"]),
    ),
)


@pytest.mark.parametrize(("fields", "output", "law"), ONE, ids=[next(iter(fields)) for fields, *_ in ONE])
def test_every_place_has_its_law(fields, output, law):
    found = law(signals())
    extra = Undeclared(**fields)
    assert deviation(extra, **{output: found})[0] < 0.03  # the plant falls as 1/(1 + c i^2)
    assert deviation(extra, **{output: 1.5 * found})[0] == pytest.approx(0.5, abs=0.03)


def test_every_effect_of_the_benchmark_acts_at_one_place():
    for make in CATALOGUE.values():
        for seed in range(12):
            fields = make(np.random.default_rng(seed), RIG).fields(1.0)
            assert place_of(Undeclared(**fields)) in PLACES
    with pytest.raises(ValueError, match="act at"):
        place_of(Undeclared(gap=1e-4, windage=0.1))


def test_laws_over_several_runs_are_one():
    extra, at = Undeclared(load_nut=0.05), signals()
    own = law_at("nut", TIME, at, RIG, extra)
    assert joined([own, own]).true.size == 2 * own.true.size
    assert joined([own, own]).deviation() == pytest.approx(own.deviation())


def discovery(clean: bool, rms: float | None, *law: str) -> Discovery:
    return Discovery("unit", "windage", clean, "shaft", "some", "verdict", law, rms, rms, 1.0)


def test_a_unit_counts_if_its_law_is_within_the_goal_and_a_clean_one_if_there_is_none():
    law = "1e-4 N.m v |v|@motor"
    assert discovery(False, 0.049, law).found
    assert not discovery(False, 0.10, law).found
    assert not discovery(False, None).found
    assert discovery(True, None).found
    assert not discovery(True, None, law).found
    assert not replace(discovery(False, 0.049, law), largest=0.2).everywhere
    rows = (
        discovery(False, 0.049, law),
        discovery(False, 0.04, "shear-thinning:motor"),
        discovery(True, None),
    )
    text = summary(rows)
    assert "found law within 5 % (rms)         >= 80 %  2 of 2" in text
    assert "by an empirical law alone" in text
    assert "1 of 2" in text
    assert "clean units without a law          all      1 of 1" in text


def test_a_unit_that_other_effects_explain_to_the_noise_is_imitated_and_still_missed():
    imitated = replace(discovery(False, 1.0, "asymmetric-friction:motor"), held_out=1.01)
    assert imitated.imitated
    assert not imitated.found
    assert not replace(imitated, held_out=1.3).imitated, "something is left that a law could explain"
    assert not replace(imitated, held_out=None).imitated
    assert not replace(imitated, rms=0.03).imitated, "its total is the true law"
    assert not replace(imitated, law=("asymmetric-friction:motor", "0.1 N.m 1@motor")).imitated
    assert not replace(imitated, clean=True).imitated
    text = summary((imitated, discovery(False, 0.02, "0.1 N.m v^3@motor")))
    assert "found law within 5 % (rms)         >= 80 %  1 of 2" in text
    assert "of units not imitated" in text
    assert "1 of 1" in text


def test_the_effect_is_removed_and_a_law_asked_for():
    content = without("windage", BENCHMARKS.parent / "scenarios" / "driven.toml")
    assert "windage" not in content["diagnose"]["effects"]
    assert "stribeck" in content["diagnose"]["effects"]
    assert content["diagnose"]["empirical"] is True


def test_units_are_planned_in_rounds_and_a_seed_belongs_to_one():
    units = plan(["windage", "spring"], units=2, clean=1, seed=3)
    assert [u.name for u in units] == ["windage-0", "spring-0", "windage-1", "spring-1", "clean-0"]
    assert len({u.seed for u in units}) == len(units)
    assert units[-1].clean
    alone = plan(["spring"], units=1, clean=0, seed=3)
    assert alone[0].seed == units[1].seed, "a unit does not depend on which others are asked for"


def test_a_unit_that_does_not_end_is_given_up_and_its_limit_does_not_reach_the_next_one():
    with pytest.raises(OutOfTime), limited(0.05):
        time.sleep(5.0)
    with limited(0.05):
        pass
    time.sleep(0.1)  # a timer left running would end the test here


def test_a_unit_without_a_result_is_missed_even_a_clean_one():
    ended = Discovery("clean-0", "windage", True, "", "", "no-missing-effect", (), None, None, 1.0)
    given_up = replace(ended, verdict=f"{NO_RESULT}: not ended after 600 s")
    assert ended.found
    assert not given_up.found
