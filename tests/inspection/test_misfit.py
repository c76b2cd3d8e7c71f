"""What a fit leaves: one slip of one signal is named, whatever the parameters make of it; a wrong model is not."""

from collections.abc import Callable

import numpy as np
import pytest

from thsa_cosim.inspection import Finding, Residual, misfits
from thsa_cosim.recordings import noise_estimate
from thsa_cosim.signals import FloatArray

TIME = np.arange(4000) * 1e-3
SPEED = np.interp(
    TIME, [0.0, 0.4, 0.5, 1.4, 1.6, 2.6, 2.7, 4.0], [0.0, 0.0, 60.0, 60.0, -40.0, -40.0, 90.0, 90.0]
)
ACCELERATION = np.gradient(SPEED, TIME)
LOAD = 0.6 * np.sin(9.0 * TIME) * (TIME > 0.3)
"""N.m, known to the model; without it R_s would do what a delay of the voltage does."""
TRUE = {"R": 1.2, "psi": 0.095, "T": 0.05}
NOISE = {"i": 0.05, "u": 0.3}


def current(p: dict[str, float], inertia: float = 2e-3) -> FloatArray:
    return (inertia * ACCELERATION + p["T"] * np.tanh(SPEED) + LOAD) / (6.0 * p["psi"])


def voltage(p: dict[str, float], inertia: float = 2e-3) -> FloatArray:
    return p["R"] * current(p, inertia) + 4.0 * p["psi"] * SPEED


def fitted(damage: dict[str, Callable[[FloatArray], FloatArray]], inertia: float = 2e-3) -> list[Residual]:
    """Least squares (Gauss-Newton, bounded below) of a small motor to its damaged signals."""
    rng = np.random.default_rng(1)
    signals = {"i": current, "u": voltage}
    measured = {
        name: damage.get(name, lambda x: x)(model(TRUE) + rng.normal(0.0, NOISE[name], TIME.size))
        for name, model in signals.items()
    }
    noise = {name: noise_estimate(values) for name, values in measured.items()}
    p = dict(TRUE)

    def stacked(p: dict[str, float]) -> FloatArray:
        return np.concatenate([(signals[n](p, inertia) - measured[n]) / noise[n] for n in signals])

    def slopes(p: dict[str, float]) -> FloatArray:
        return np.column_stack(
            [(stacked({**p, n: v * 1.001}) - stacked(p)) / (1e-3 * v) for n, v in p.items()]
        )

    for _ in range(30):
        change = np.linalg.lstsq(slopes(p), stacked(p), rcond=None)[0]
        p = {n: max(v - 0.7 * float(d), 0.05 * TRUE[n]) for (n, v), d in zip(p.items(), change, strict=True)}
    rows = slopes(p)
    return [
        Residual(
            "run",
            name,
            stacked(p)[k * TIME.size : (k + 1) * TIME.size],
            noise[name],
            {"i": "A", "u": "V"}[name],
            {"w_cmd": SPEED},
            TIME,
            signals[name](p, inertia),
            rows[k * TIME.size : (k + 1) * TIME.size],
        )
        for k, name in enumerate(signals)
    ]


def late(by: float) -> Callable[[FloatArray], FloatArray]:
    return lambda x: x[np.clip(np.arange(TIME.size) - round(by / 1e-3), 0, TIME.size - 1)]


def only(findings: list[Finding]) -> Finding:
    assert len(findings) == 1, findings
    return findings[0]


@pytest.mark.parametrize(
    ("channel", "damage", "kind", "remedy"),
    [
        ("u", late(5e-3), "delay", "shift = -0.005"),
        ("i", late(-7e-3), "delay", "shift = 0.007"),
        ("i", lambda x: x + 0.08, "offset", "offset = -0.08"),
        ("u", lambda x: x - 2.0, "offset", "offset = 2"),
        ("i", lambda x: x + 0.1 * TIME, "drift", ""),
        ("u", lambda x: x + 1.5 * (TIME > 1.7), "step", ""),
        ("i", lambda x: x / np.sqrt(2.0), "unit", "scale = 1.41421356"),
        ("i", lambda x: -x, "sign", "scale = -1"),
    ],
)
def test_a_slip_is_named_with_its_size(
    channel: str, damage: Callable[[FloatArray], FloatArray], kind: str, remedy: str
) -> None:
    finding = only(misfits(fitted({channel: damage})))
    assert (finding.channel, finding.kind) == (channel, kind)
    key, _, size = remedy.partition(" = ")
    if remedy:
        proposed_key, _, proposed = finding.remedy.splitlines()[1].partition("#")[0].partition(" = ")
        assert proposed_key == key
        assert float(proposed) == pytest.approx(float(size), rel=0.1)


@pytest.mark.parametrize(
    ("file_unit", "remedy"), [("mA", "offset = -80"), ("A", "offset = -0.08"), (None, "write it")]
)
def test_an_offset_is_proposed_in_the_unit_of_the_file(file_unit: str | None, remedy: str) -> None:
    found = only(misfits(fitted({"i": lambda x: x + 0.08}), {"i": file_unit}))
    assert found.kind == "offset"
    line = found.remedy.splitlines()[1]
    assert remedy.split(" = ")[0] in line
    if file_unit:
        size = float(line.partition(" = ")[2].partition("#")[0])
        assert size == pytest.approx(float(remedy.split(" = ")[1]), rel=0.1)


def test_a_delay_that_parameters_hide_in_the_noise_is_named_all_the_same() -> None:
    residuals = fitted({"u": late(1.5e-3)})
    assert all(np.sqrt(np.mean(r.values**2)) < 1.4 for r in residuals)  # rmse / noise says nothing
    found = only(misfits(residuals))
    assert (found.channel, found.kind) == ("u", "delay")


def test_two_slips_are_two_findings() -> None:
    found = misfits(fitted({"i": lambda x: x + 0.02, "u": lambda x: x - 3.0}))
    assert [(f.channel, f.kind) for f in found] == [("u", "offset"), ("i", "offset")]


def test_clean_signals_have_no_finding() -> None:
    assert misfits(fitted({})) == []


@pytest.mark.parametrize("inertia", [1e-3, 1.6e-3, 2.6e-3, 6e-3])
def test_a_wrong_model_is_no_slip_of_a_unit(inertia: float) -> None:
    residuals = fitted({}, inertia)
    assert max(float(np.std(r.values)) for r in residuals) > 1.05  # it is a misfit
    assert [f for f in misfits(residuals) if f.kind in ("unit", "sign")] == []


def test_a_factor_that_no_unit_has_is_no_finding() -> None:
    assert misfits(fitted({"i": lambda x: 1.2 * x})) == []


def test_without_a_jacobian_nothing_is_said() -> None:
    residual = Residual("run", "i", np.ones(1000), 0.1, "A")
    assert misfits([residual]) == []
