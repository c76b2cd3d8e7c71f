"""Effects around an FMU without source: against the same physics inside, gains, the file, the command."""

import json
import pickle
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from thsa_cosim.batch import Experiment, Job, LocalRunner, Status
from thsa_cosim.diagnosis.blackbox import WrappedPlant
from thsa_cosim.diagnosis.blackbox.drive import Drive, measure_drive
from thsa_cosim.diagnosis.blackbox.places import find_places
from thsa_cosim.diagnosis.blackbox.saved import write_wrapper
from thsa_cosim.diagnosis.blackbox.wrapper import EffectWrapper, Term, laws, sign_of
from thsa_cosim.diagnosis.catalogue.known import known_effects
from thsa_cosim.errors import FmuError, ScenarioError
from thsa_cosim.fmu import Plant
from thsa_cosim.scenario import BlackBoxSpec, load
from thsa_cosim.signals import Signals

ROOT = Path(__file__).parents[3]
FMU = ROOT / "fmus" / "THSA.fmu"
NAMES = BlackBoxSpec(
    command="v_cmd", load="F_load", speed="v", position="x", motor_speed="w_m", current="i_q", voltage="u_q"
)
OUTPUTS = ("v", "x", "w_m", "i_q", "u_q")
NOISE = {"v": 2e-5, "x": 1e-6, "w_m": 0.2, "i_q": 0.05, "u_q": 0.3}
TIME = np.arange(0.0, 4.0, 1e-3)
#: Radians of the motor per metre of the screw.
RATIO = 30.0 * 2.0 * np.pi / 10e-3
FIXED = {"velocityController.K_p": 0.12, "velocityController.K_i": 0.45}


def schedule(load: float) -> Signals:
    """There and back under a load that aids one of the two."""
    corners = [0.0, 0.3, 0.6, 1.6, 1.9, 2.2, 2.5, 3.5, 3.8, 4.0]
    command = np.interp(TIME, corners, [0.0, 0.0, 8e-3, 8e-3, 0.0, 0.0, -8e-3, -8e-3, 0.0, 0.0])
    values = {"v_cmd": command, "F_load": np.full(TIME.size, load), "T_amb": np.full(TIME.size, -30.0)}
    return Signals(TIME, values, {"v_cmd": "m/s", "F_load": "N", "T_amb": "degC"})


INPUTS = schedule(20e3)


@cache
def measured() -> tuple[Signals, Drive]:
    """The FMU's own run, and the drive that it shows."""
    with Plant.open(FMU) as plant:
        base = plant.run(FIXED, INPUTS, OUTPUTS, TIME, tolerance=1e-5)
        moved = INPUTS.with_values({"F_load": INPUTS["F_load"] + 200.0})
        stepped = plant.run(FIXED, moved, OUTPUTS, TIME, tolerance=1e-5)
    return base, measure_drive(NAMES, INPUTS, base, stepped, 200.0)


def wrapper(place: str, effect: str, block: str, **starts: float) -> EffectWrapper:
    """A wrapper with one effect, whose first parameter is its coefficient."""
    first = next(iter(starts))
    term = Term(place, effect, block, f"wrapper.{place}", starts, {first: 0.0})
    return EffectWrapper(NAMES, measured()[1], (term,))


def run(wrapped: EffectWrapper, **values: float) -> Signals:
    with Plant.open(FMU) as plant:
        return WrappedPlant(plant, wrapped).run(FIXED | values, INPUTS, OUTPUTS, TIME, tolerance=1e-5)


def distance(one: Signals, other: Signals) -> float:
    """Root mean square over all outputs, in standard deviations of the rig's sensors."""
    return float(np.sqrt(np.mean([np.mean(((one[n] - other[n]) / NOISE[n]) ** 2) for n in OUTPUTS])))


def test_drive_is_the_actuators() -> None:
    _, drive = measured()
    torque_constant = np.sqrt(1.5) * 4 * (0.1 + 6e-5 * -30 - 4e-6 * 900)
    assert drive.load_sense == 1.0
    assert drive.ratio == pytest.approx(RATIO, rel=1e-3)
    assert drive.integral / RATIO == pytest.approx(0.45, rel=0.01)
    assert drive.proportional / RATIO == pytest.approx(0.12, rel=0.005)
    assert drive.current_per_force == pytest.approx(1.0 / RATIO / torque_constant, rel=0.02)
    assert drive.resistance == pytest.approx(-5e-6 * -27000 + 7e-5 * 900 - 0.9 + 1.2, rel=0.01)
    assert drive.back_emf == pytest.approx(torque_constant, rel=1e-3)


def test_command_shift_inverts_the_controller() -> None:
    drive = Drive(proportional=3.0, integral=7.0)
    shift = np.sin(3.0 * TIME)
    current = 3.0 * shift + 7.0 * (1.0 - np.cos(3.0 * TIME)) / 3.0
    assert drive.command_shift(TIME, current) == pytest.approx(shift, abs=1e-5)


def test_more_friction_of_the_motor_is_more_friction_of_the_motor() -> None:
    """Run-in over an endless distance is Coulomb friction, which the FMU has as a parameter of its own."""
    base, drive = measured()
    more = 0.05  # N.m
    with Plant.open(FMU) as plant:
        inside = plant.run({**FIXED, "motor.T_fm.a0": more}, INPUTS, OUTPUTS, TIME, tolerance=1e-5)
    force = more / np.sqrt(1.5) / 4 / (0.1 - 1.8e-3 - 3.6e-3) / drive.current_per_force
    around = run(wrapper("motor", "friction-run-in", "FrictionRunIn", dF=force, d_r=1e9))
    assert distance(base, inside) > 3.0
    assert distance(around, inside) < 0.02 * distance(base, inside)


def test_more_friction_of_the_nut_acts_through_the_load() -> None:
    base, _ = measured()
    with Plant.open(FMU) as plant:
        start = plant.description.variables["nut.F_fn.a0"].start
        assert isinstance(start, float)
        inside = plant.run({**FIXED, "nut.F_fn.a0": start + 800.0}, INPUTS, OUTPUTS, TIME, tolerance=1e-5)
    around = run(wrapper("load", "plain-friction", "PlainFriction", F_C=800.0, b=0.0))
    assert distance(base, inside) > 1.0
    assert distance(around, inside) < 0.2 * distance(base, inside)


def test_plain_friction_is_offered_at_the_load_of_a_black_box_alone() -> None:
    """Models with source declare Coulomb and viscous friction at every place."""
    variants = known_effects()["plain-friction"].variants
    assert {v.slots for v in variants} == {("load",)}
    assert [(p.name, v.beside) for v in variants for p in v.parameters] == [
        ("F_C", False), ("b", False), ("b", True), ("F_C", True),
    ]  # fmt: skip
    at = {"s": np.array([-1.0, 0.0, 1.0]), "v": np.array([-2.0, 0.0, 3.0])}
    law = laws(None)["plain-friction", "PlainFriction"]
    assert law({"F_C": 5.0, "b": 7.0}, at).tolist() == [-19.0, 0.0, 26.0]


def test_neutral_wrapper_is_the_fmu() -> None:
    neutral = run(wrapper("motor", "windage", "Windage", b_q=0.0))
    for name in OUTPUTS:
        assert np.array_equal(neutral[name], measured()[0][name])


def test_sensor_effects_change_one_output() -> None:
    base, _ = measured()
    gain = run(wrapper("velocitySensor", "velocity-sensor-gain", "SensorGain", g=0.02))
    assert gain["v"] == pytest.approx(1.02 * base["v"], abs=1e-12)
    late = run(wrapper("velocitySensor", "velocity-sensor-delay", "SensorDelay", tau=0.01))
    assert late["v"][10:] == pytest.approx(base["v"][:-10], abs=1e-9)
    for name in ("x", "w_m", "i_q", "u_q"):
        assert np.array_equal(gain[name], base[name])
        assert np.array_equal(late[name], base[name])


def test_offset_of_the_current_sensor_leaves_the_motion() -> None:
    base, _ = measured()
    off = run(wrapper("currentSensor", "current-sensor-offset", "SensorOffset", o=0.3))
    moving = np.abs(base["w_m"]) > 10.0
    assert np.median((off["i_q"] - base["i_q"])[moving]) == pytest.approx(0.3, rel=0.05)
    assert np.median((off["u_q"] - base["u_q"])[moving]) == pytest.approx(0.0, abs=0.1)


def test_saturated_torque_constant_costs_current_with_its_square() -> None:
    base, _ = measured()
    less = run(wrapper("torque", "torque-constant-saturation", "TorqueConstantSaturation", a=1e-3, b=0.0))
    steady = (TIME > 1.2) & (TIME < 1.5)
    i, ideal = less["i_q"][steady], base["i_q"][steady]
    assert i * (1.0 - 1e-3 * i**2) == pytest.approx(ideal, rel=0.01)


def test_sign_at_rest_runs_from_the_last_motion_to_the_next() -> None:
    speed = np.array([1.0, 0.0, 0.0, 0.0, -1.0, -1.0])
    assert sign_of(speed, 0.1).tolist() == [1.0, 0.5, 0.0, -0.5, -1.0, -1.0]
    assert sign_of(np.zeros(3), 0.1).tolist() == [0.0, 0.0, 0.0]


def test_places_follow_the_name_map() -> None:
    def names(spec: BlackBoxSpec, has_torque: bool = True) -> set[str]:
        return {p.name for p in find_places(spec, has_torque)}

    assert names(NAMES) == {
        "motor",
        "load",
        "torque",
        "currentSensor",
        "velocitySensor",
        "inverter",
        "contact",
    }
    assert names(NAMES, has_torque=False) == {"load", "velocitySensor", "inverter", "contact"}
    assert names(BlackBoxSpec(load="F_load", speed="v")) == {"velocitySensor"}


def test_runners_take_the_wrappers_parameters() -> None:
    windage = wrapper("motor", "windage", "Windage", b_q=0.0)
    experiment = Experiment("e", FMU, INPUTS, OUTPUTS, TIME, FIXED, 1e-5, wrapper=windage)
    with LocalRunner([experiment]) as runner:
        (outcome,) = runner.run([Job("e", {"wrapper.motor.b_q": 0.05})])
        with pytest.raises(FmuError, match=r"wrapper\.motor\.b_x"):
            runner.run([Job("e", {"wrapper.motor.b_x": 0.05})])
    assert outcome.status == Status.OK
    assert outcome.signals is not None
    assert np.array_equal(outcome.signals["i_q"], run(windage, **{"wrapper.motor.b_q": 0.05})["i_q"])
    assert pickle.loads(pickle.dumps(windage)).parameters == windage.parameters


def test_wrapper_comes_back_from_its_file(tmp_path: Path) -> None:
    windage = wrapper("motor", "windage", "Windage", b_q=0.0)
    file = write_wrapper(tmp_path, FMU, windage, {"wrapper.motor.b_q": 0.05})
    with WrappedPlant.open(file) as plant:
        again = plant.run(FIXED, INPUTS, OUTPUTS, TIME, tolerance=1e-5)
    assert np.array_equal(again["i_q"], run(windage, **{"wrapper.motor.b_q": 0.05})["i_q"])
    (tmp_path / "other.json").write_text('{"fmu": 1}')
    with pytest.raises(ScenarioError, match=r"other\.json is no wrapper\.json"):
        WrappedPlant.open(tmp_path / "other.json")


def test_laws_are_those_of_the_catalogue() -> None:
    """Laws of friction never drive: they have the sign of the motion (or, as ripple, no sign at all)."""
    at = {"time": TIME, "v": np.sin(TIME), "s": np.sign(np.sin(TIME)), "z": 1.0 - np.cos(TIME), "N": TIME}
    for (effect, _), law in laws(None).items():
        if effect in ("stribeck", "windage", "load-dependent-friction", "shear-thinning"):
            p = {"dF": 1.0, "v_S": 0.1, "n": 2.0, "b_q": 1.0, "mu": 0.1, "mu_S": 0.1, "mu_2": 0.1, "v_0": 0.1}
            p |= {"n_S": 1.0, "mu_v": 0.1, "mu_D": 0.05, "mu_A": 0.04}
            assert np.all(law(p, at) * at["v"] >= 0.0)


def scenario_text(**changes: str) -> str:
    """``driven.toml`` without its model: what a vendor's FMU would get."""
    text = (ROOT / "scenarios" / "driven.toml").read_text(encoding="utf-8")
    text = re.sub(r"model = .*\npackage = .*\n", "", text)
    text = re.sub(r"\[\[diagnose\.balances\]\].*?(?=\n# Declared)", "", text, flags=re.S)
    names = 'speed = "v"\nposition = "x"\nmotor_speed = "w_m"\ncurrent = "i_q"\nvoltage = "u_q"\n'
    for key, line in changes.items():
        text = text.replace("[diagnose]\n", f"[diagnose]\n{key} = {line}\n")
    text = text.replace('load = "F_load"\n', f'load = "F_load"\n\n[diagnose.blackbox]\n{names}', 1)
    text = text.replace('"../fmus', f'"{(ROOT / "fmus").as_posix()}')
    return text.replace('"recordings/', f'"{(ROOT / "scenarios" / "recordings").as_posix()}/')


def test_black_box_needs_names(tmp_path: Path) -> None:
    path = tmp_path / "s.toml"
    text = scenario_text().replace("_fit_*", "_fit_1").replace("_validate_*", "_validate_1")
    path.write_text(text, encoding="utf-8")
    assert load(path).diagnose.blackbox == NAMES  # type: ignore[union-attr]
    path.write_text(text.replace('speed = "v"', 'speed = "velocity"', 1), encoding="utf-8")
    with pytest.raises(ScenarioError, match=r"diagnose\.blackbox\.speed.*velocity"):
        load(path)
    path.write_text(re.sub(r"\[diagnose\.blackbox\]\n(.*\n)*?\n", "\n", text), encoding="utf-8")
    with pytest.raises(ScenarioError, match="needs either model"):
        load(path)


@pytest.mark.nightly
def test_command_names_what_the_black_box_lacks(tmp_path: Path) -> None:
    path = tmp_path / "black_box.toml"
    text = scenario_text(most="1", effects='["windage", "velocity-sensor-gain", "current-sensor-offset"]')
    text = text.replace("_fit_*", "_fit_1").replace("_validate_*", "_validate_1")
    path.write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", "thsa_cosim.cli", "diagnose", str(path), "-o", str(tmp_path / "study")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    result = json.loads((tmp_path / "study" / "result.json").read_text(encoding="utf-8"))
    assert result["verdict"] == "missing-effect"
    assert [e["name"] for e in result["effects"]] == ["windage:motor"]
    before, after = (
        {name: e["rmse"] / e["noise"] for name, e in result[part]["validate"].items()}
        for part in ("before", "after")
    )
    assert before["x"] > 2.0
    assert all(ratio < 1.05 for ratio in after.values())
    assert result["model"] is None
    assert result["wrapper"] == "wrapper.json"
    with WrappedPlant.open(tmp_path / "study" / "wrapper.json") as plant:
        assert list(plant.wrapper.parameters) == [
            f"wrapper.motor.windage.{name}" for name in ("b_q", "n", "v_r")
        ]
