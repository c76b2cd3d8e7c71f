"""An event of the machine is seen by several sensors, a defect by one: impacts, dead bands, and what imitates them."""

from dataclasses import replace
from functools import cached_property

import numpy as np
import pytest

from thsa_cosim.inspection.channel import Channel
from thsa_cosim.inspection.recording import inspect_channels
from thsa_cosim.recordings.independence import independence
from thsa_cosim.recordings.noise import noise_estimate
from thsa_cosim.signals import FloatArray

TIME = np.arange(4000) * 2e-3
IMPACTS = (700, 1900, 3100)


def bouncing(seed: int = 1) -> dict[str, tuple[FloatArray, str]]:
    """A mass that meets its stop three times: 15 kN for a sample, and the speed turns there."""
    rng = np.random.default_rng(seed)
    speed, force = np.zeros(TIME.size), np.zeros(TIME.size)
    for at in IMPACTS:
        speed[at - 60 : at] = 0.06 * (np.arange(60) / 60.0) ** 3
        speed[at : at + 200] = 0.06 * np.exp(-np.arange(200) / 4.0)
        force[at] = 15e3
        force[at + 1 : at + 400] = 3e3 * np.sin(np.pi * np.arange(399) / 399.0)
    position = np.concatenate(([0.0], np.cumsum(speed[1:]) * 2e-3))
    return {
        "v": (speed + rng.normal(0.0, 2e-5, TIME.size), "m/s"),
        "x": (position + rng.normal(0.0, 1e-6, TIME.size), "m"),
        "F": (force + rng.normal(0.0, 60.0, TIME.size), "N"),
    }


def waking(seed: int = 2) -> dict[str, tuple[FloatArray, str]]:
    """A drive whose controller leaves its dead band: current and voltage jump at 3 s, the shaft starts smoothly."""
    rng = np.random.default_rng(seed)
    on, since = TIME > 3.0, np.maximum(TIME - 3.0, 0.0)
    speed = np.where(on, 20.0 * (1.0 - np.exp(-since / 0.5)), 0.0)
    angle = np.concatenate(([0.0], np.cumsum(speed[1:]) * 2e-3))
    current = np.where(on, 28.0 + 6.0 * (1.0 - np.exp(-since / 0.02)), 0.0)
    voltage = np.where(on, 18.0 + 15.0 * np.exp(-since / 1e-3), 0.0)
    return {
        "w": (speed + rng.normal(0.0, 0.1, TIME.size), "rad/s"),
        "phi": (angle + rng.normal(0.0, 1e-3, TIME.size), "rad"),
        "i": (current + rng.normal(0.0, 0.05, TIME.size), "A"),
        "u": (voltage + rng.normal(0.0, 0.3, TIME.size), "V"),
    }


def told(signals: dict[str, tuple[FloatArray, str]]) -> set[tuple[str, str]]:
    channels = [Channel("run", n, unit, "output", TIME, values) for n, (values, unit) in signals.items()]
    found = inspect_channels("run", channels, [TIME])
    return {(f.channel, f.kind) for f in found if f.severity != "note"}


def test_an_impact_is_no_spike_where_the_speed_turns_with_it() -> None:
    own = bouncing()
    assert told(own) == set()
    assert ("F", "spikes") in told({"F": own["F"]})  # alone, it cannot be told from one


def test_spikes_elsewhere_are_named_beside_impacts() -> None:
    own = bouncing()
    own["F"][0][[1200, 1300, 2500]] += 15e3
    assert ("F", "spikes") in told(own)


def test_interference_on_speed_and_force_at_once_is_no_impact() -> None:
    own = bouncing()
    for name, size in (("v", 0.05), ("F", 15e3)):
        own[name][0][[1200, 1300, 1400, 2500, 2700]] += size
    assert {("F", "spikes"), ("v", "spikes")} <= told(own)


def test_a_current_that_jumps_with_its_voltage_is_the_controllers() -> None:
    own = waking()
    assert told(own) == set()
    assert ("i", "step") in told({**own, "u": (np.zeros(TIME.size), "V")})


@pytest.mark.parametrize("without", [(), ("u",)])
def test_joined_recordings_are_no_event_of_the_machine(without: tuple[str, ...]) -> None:
    own = {n: (np.concatenate((v[:1000], v[2500:], v[1000:2500])), u) for n, (v, u) in waking().items()}
    assert ("i", "step") in told({n: s for n, s in own.items() if n not in without})


def test_facts_that_were_found_before_the_events_are_those_of_a_new_channel() -> None:
    values, unit = bouncing()["F"]
    values[::400] = 32767.0  # codes, which every fact has to leave out
    known = Channel("r", "F", unit, "output", TIME, values)
    facts = [name for name in vars(Channel) if isinstance(vars(Channel)[name], cached_property)]
    for fact in facts:
        getattr(known, fact)
    events, shared = TIME[list(IMPACTS)], TIME[[100]]
    found, fresh = known.with_events(events, shared), replace(known, commanded=events, shared=shared)
    assert found.noise is known.noise  # not estimated again
    assert np.any(found.answers != known.answers)
    for fact in facts:
        one, other = getattr(found, fact), getattr(fresh, fact)
        if fact == "independence":
            one, other = (one.kind, one.period, *one.fresh), (other.kind, other.period, *other.fresh)
        np.testing.assert_equal(one, other, err_msg=fact)


def test_noise_is_the_same_with_independence_that_is_known_or_not() -> None:
    rng = np.random.default_rng(5)
    white = rng.normal(0.0, 0.1, 3000)
    for values in (white, np.repeat(white[:600], 5), np.where(np.arange(3000) % 500 == 7, 32767.0, white)):
        assert noise_estimate(values, known=independence(values)) == noise_estimate(values) > 0.0
