"""The table on sampling in ``docs/systems.md``, held by the loop of the shipped plant and controller."""

import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
sys.path.append(str(ROOT / "benchmarks"))

import sampling

from thsa_cosim.tune.margins import margins_of


@pytest.mark.parametrize("name", ["1 kHz", "1 kHz, half a sample of delay"])
def test_margins_of_the_sampled_loop_are_those_of_the_documentation(name: str) -> None:
    found = sampling.measured(*sampling.CASES[name])
    read = margins_of(found.omega, found.response)
    page = (ROOT / "docs" / "systems.md").read_text(encoding="utf-8")
    row = re.search(rf"^\| {re.escape(name)} \| ([\d.]+) dB \| ([\d.]+)° \| ([\d.]+) Hz \|$", page, re.M)
    assert row is not None
    gain, phase, bandwidth = map(float, row.groups())
    assert read.gain_margin == pytest.approx(gain, abs=0.1)
    assert read.phase_margin == pytest.approx(phase, abs=0.1)
    assert read.bandwidth == pytest.approx(bandwidth, abs=0.6)
    assert found.distortion < 1e-5


@pytest.mark.slow
def test_margins_measured_on_the_continuous_loop_are_those_of_its_linear_model() -> None:
    """Table IV's margins at these gains, from the exact Jacobian of the whole actuator: 85.0 deg (docs/tune.md)."""
    found = sampling.measured(*sampling.CASES["continuous"])
    assert margins_of(found.omega, found.response).phase_margin == pytest.approx(85.0, abs=0.1)
