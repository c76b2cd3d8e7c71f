"""One sensor's noise over several recordings: another noise is named, with the channel's unit."""

from pathlib import Path

import numpy as np
import pytest

from thsa_cosim.inspection import inspect
from thsa_cosim.recordings import Recording, Samples
from thsa_cosim.signals import Signals

TIME = np.arange(2000) * 1e-3
TRUE = np.sin(2.0 * np.pi * TIME)


def recording(name: str, noise: float, unit: str) -> Recording:
    values = TRUE + np.random.default_rng(len(name)).normal(0.0, noise, TIME.size)
    samples = Samples(TIME, values, unit, np.zeros(TIME.size, dtype=bool))
    return Recording(
        name,
        Path(f"{name}.csv"),
        "",
        Signals(TIME, {"q": values}),
        noise={"q": noise},
        samples={"q": samples},
    )


@pytest.mark.parametrize(("unit", "suffix"), [("rad", " rad"), ("1", "")])
def test_another_noise_in_one_recording_is_told_with_its_unit(unit: str, suffix: str) -> None:
    recordings = [recording("a", 0.001, unit), recording("bb", 0.001, unit), recording("ccc", 0.0025, unit)]
    texts = [(f.recording, f.text) for f in inspect(recordings, ()).findings if f.kind == "unequal-noise"]
    assert texts == [
        ("ccc", f"the noise of q is 0.0025{suffix} here and 0.001{suffix} in the recordings together")
    ]


def test_noises_alike_are_not_told() -> None:
    recordings = [
        recording("a", 0.001, "rad"),
        recording("bb", 0.0012, "rad"),
        recording("ccc", 0.0014, "rad"),
    ]
    assert "unequal-noise" not in [f.kind for f in inspect(recordings, ()).findings]
