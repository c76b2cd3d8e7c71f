"""After a diagnosis' last fit: a slip of one signal in the fit recordings is named, held-out ones are not looked at."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from thsa_cosim.costs.channels import Channel
from thsa_cosim.diagnosis.explaining.slips import with_slips
from thsa_cosim.diagnosis.fitting.fit import Fit
from thsa_cosim.diagnosis.fitting.identified import Identified
from thsa_cosim.diagnosis.fitting.trials import Trial
from thsa_cosim.diagnosis.fitting.unknowns import Unknown, Unknowns
from thsa_cosim.inspection import Finding, Inspection
from thsa_cosim.signals import FloatArray, Signals
from thsa_cosim.study import Case

TIME = np.arange(3000) * 1e-3
SPEED = 60.0 * np.sin(4.0 * TIME) * np.sin(1.1 * TIME)
CURRENT = 2e-3 * np.gradient(SPEED, TIME) + 0.4 * np.tanh(SPEED)
NOISE = {"i": 0.05, "u": 0.3}
UNITS = {"i": "A", "u": "V"}
Damage = Mapping[str, Callable[[FloatArray], FloatArray]]


def true(vector: FloatArray) -> dict[str, FloatArray]:
    """Current and voltage of a motor with friction and resistance ``vector`` (2,), its other constants known."""
    friction, resistance = vector
    current = CURRENT + (friction - 0.4) * np.tanh(SPEED)
    return {"i": current, "u": resistance * current + 0.4 * SPEED}


def identified(recordings: Mapping[str, tuple[str, Damage]]) -> Identified:
    """A model fitted by linear least squares to the fit recordings of (part, damage)."""
    rng = np.random.default_rng(4)
    trials, start = [], np.array([0.4, 1.2])
    for name, (part, damage) in recordings.items():
        channels = tuple(
            Channel(
                n, TIME, damage.get(n, lambda x: x)(x + rng.normal(0.0, NOISE[n], TIME.size)), NOISE[n], 4.0
            )
            for n, x in true(start).items()
        )
        measured = Signals(TIME, {c.name: c.measured for c in channels}, UNITS)
        inputs = Signals(TIME, {"w_cmd": SPEED}, {"w_cmd": "rad/s"})
        case = Case(name, Path("m.fmu"), inputs, TIME, {}, channels, measured, None, None)
        trials.append(Trial(case, "fit" if part == "fit" else "validate", "all"))

    def residual(vector: FloatArray) -> FloatArray:
        signals = Signals(TIME, true(vector), UNITS)
        return np.concatenate(
            [c.residual(signals) for t in trials if t.part == "fit" for c in t.case.channels]
        )

    def jacobian(vector: FloatArray) -> FloatArray:
        return np.column_stack(
            [(residual(vector + d) - residual(vector - d)) / 2e-4 for d in 1e-4 * np.eye(2)]
        )

    best = start
    for _ in range(5):
        best = best - np.linalg.lstsq(jacobian(best), residual(best), rcond=None)[0]
    members = tuple(Unknown(n, n, "1", 0.5, np.inf, 1.0, 0.0, 9.0) for n in ("T", "R"))
    fit = Fit(Unknowns(members), best, residual(best), jacobian(best), np.ones(2), 10.0, True)
    signals: dict[str, Signals | None] = {t.name: Signals(TIME, true(best), UNITS) for t in trials}
    return Identified(
        Path("m.fmu"), fit, np.zeros(0), tuple(trials), signals, 1, {}, np.zeros(2), np.zeros(2)
    )


def offset(by: float) -> Damage:
    return {"i": lambda x: x + by}


def named(found: Identified, data: Inspection | None = None) -> list[tuple[str, str, str]]:
    findings = with_slips(data or Inspection(), found, {"i": "mA"}).findings
    return [(f.recording, f.channel, f.kind) for f in findings]


def test_a_slip_is_named_in_its_own_recording() -> None:
    found = identified({"a": ("fit", {}), "b": ("fit", offset(0.1)), "c": ("validate", {})})
    assert named(found) == [("b", "i", "offset")]
    (finding,) = with_slips(Inspection(), found, {"i": "mA"}).findings
    assert "offset = -" in finding.remedy
    assert "in mA" in finding.remedy  # in the unit of the file's numbers


def test_a_delay_is_named_whatever_the_parameters_make_of_it() -> None:
    late: Damage = {"u": lambda x: x[np.clip(np.arange(x.size) - 6, 0, x.size - 1)]}
    assert named(identified({"a": ("fit", {}), "b": ("fit", late)})) == [("b", "u", "delay")]


def test_clean_recordings_and_held_out_ones_have_no_finding() -> None:
    assert named(identified({"a": ("fit", {}), "b": ("fit", {}), "c": ("validate", offset(0.5))})) == []


def test_what_is_known_is_not_said_twice() -> None:
    known = Finding("b", "i", "offset", "warning", "known")
    found = identified({"a": ("fit", {}), "b": ("fit", offset(0.1))})
    assert with_slips(Inspection.of([known]), found, {}).findings == (known,)


@pytest.mark.parametrize("lost", ["fit/a", "fit/b"])
def test_without_all_signals_nothing_is_said(lost: str) -> None:
    found = identified({"a": ("fit", {}), "b": ("fit", offset(0.1))})
    assert named(replace(found, signals={**found.signals, lost: None})) == []
