"""Effects inside the exported superset against closed forms: slot by slot, and in what the sensors read."""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import numpy as np
import pytest
from reference.rig import Rig, rig_at
from scipy.optimize import brentq

from thsa_cosim.diagnosis import known_effects
from thsa_cosim.diagnosis.catalogue.effect import Variant
from thsa_cosim.diagnosis.catalogue.effects.asymmetric_friction import asymmetry
from thsa_cosim.diagnosis.catalogue.effects.load_dependent_friction import friction as load_friction
from thsa_cosim.diagnosis.catalogue.superset import build_superset
from thsa_cosim.diagnosis.explaining.empirical import EMPIRICAL
from thsa_cosim.fmu import Plant
from thsa_cosim.signals import Signals

ROOT = Path(__file__).parents[3]
OUTPUTS = ("v", "x", "w_m", "i_q", "u_q")
TEMPERATURE, LOAD, SPEED = -20.0, 30e3, 6e-3
TIME = np.arange(2001) * 1e-3
#: Up to speed, back, and to rest, under a load.
COMMAND = np.interp(TIME, [0.1, 0.3, 0.9, 1.3, 1.7, 1.9], [0.0, SPEED, SPEED, -SPEED, -SPEED, 0.0])


@pytest.fixture(scope="module")
def superset(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Plant]:
    folder = tmp_path_factory.mktemp("superset")
    effects = [*known_effects().values(), *EMPIRICAL]
    fmu, *_ = build_superset("Actuator", ROOT / "modelica" / "THSA", effects, folder)
    with Plant.open(fmu) as plant:
        yield plant


def run(plant: Plant, values: Mapping[str, float], more: tuple[str, ...] = ()) -> Signals:
    inputs = {
        "v_cmd": COMMAND,
        "F_load": np.full(TIME.size, LOAD),
        "T_amb": np.full(TIME.size, TEMPERATURE),
    }
    return plant.run(values, Signals(TIME, inputs), (*OUTPUTS, *more), TIME, tolerance=1e-10)


def steady(plant: Plant, values: Mapping[str, float], seconds: float = 5.0) -> dict[str, float]:
    """What the sensors read at constant speed against a constant load, once all has settled."""
    time = np.linspace(0.0, seconds, 601)
    start = {"v_cmd": SPEED, "F_load": LOAD, "T_amb": TEMPERATURE}
    inputs = Signals(time, {n: np.full(time.size, v) for n, v in start.items()})
    found = plant.run(values, inputs, OUTPUTS, time, tolerance=1e-9)
    return {name: float(found[name][-1]) for name in OUTPUTS}


def test_a_place_follows_a_measured_speed_with_a_gain_and_without_one_it_does_not(superset: Plant):
    given = 60.0 * np.sin(8.0 * TIME)
    inputs = {
        "v_cmd": COMMAND,
        "F_load": np.full(TIME.size, LOAD),
        "T_amb": np.full(TIME.size, TEMPERATURE),
        "motorMeasured": given,
    }

    def speed(gain: float) -> np.ndarray:
        start = {"motorEffect.g_m": gain}
        return np.asarray(superset.run(start, Signals(TIME, inputs), ("w_m",), TIME, tolerance=1e-8)["w_m"])

    np.testing.assert_allclose(speed(0.0), run(superset, {})["w_m"], atol=1e-3)
    strongly, weakly = speed(100.0), speed(10.0)
    after = TIME > 0.1
    assert np.abs(strongly - given)[after].max() < 1.0
    np.testing.assert_allclose((weakly - given)[after], 10.0 * (strongly - given)[after], atol=0.8)


def test_neutral_it_is_the_declared_model(superset: Plant):
    with Plant.open(ROOT / "fmus" / "THSA.fmu") as plant:
        declared = run(plant, {})
    neutral = run(superset, {})
    # The sensor's delay needs a time to be a delay at all: 10 us, a thousandth of the sensor's own lag. There are two
    # of them in a row, that of the catalogue and that of the empirical laws.
    slope = np.abs(np.gradient(declared["v"], TIME)).max()
    for name in OUTPUTS:
        allowed = 2 * 1e-5 * slope if name == "v" else 0.0
        error = np.abs(neutral[name] - declared[name]).max()
        assert error <= 1e-7 * np.ptp(declared[name]) + 1.1 * allowed, name


def rig() -> Rig:
    return rig_at(TEMPERATURE)


def torque(rig: Rig, force: float = LOAD, motor: float = 0.0, gear: float = 0.0, nut: float = 0.0) -> float:
    """Motor torque [N.m] at SPEED against ``force``, with added friction at motor, gearbox and nut."""
    w_m = SPEED / rig.k * rig.i
    screw = force + rig.F_fn + rig.b_n * SPEED + nut
    gearbox = rig.k * screw + rig.T_fg + rig.b_g * w_m / rig.i + gear
    return rig.T_fm + rig.b_m * w_m + motor + gearbox / rig.i


W_M = SPEED / rig().k * rig().i
SCREW_FORCE = LOAD + rig().F_fn + rig().b_n * SPEED
THREAD = 0.02 + 0.05 * np.exp(-1.0) + 0.5 * SPEED - 0.01 + 4e-3
STEADY: dict[str, tuple[dict[str, float], Callable[[Rig], float]]] = {
    "declared": ({}, lambda r: torque(r) / r.K_t),
    "stribeck:screw": (
        {"screwEffect.stribeck.dF": 900.0, "screwEffect.stribeck.v_S": SPEED, "screwEffect.stribeck.n": 1.0},
        lambda r: torque(r, nut=900.0 * np.exp(-1.0)) / r.K_t,
    ),
    "windage:motor": ({"motorEffect.windage.b_q": 1e-5}, lambda r: torque(r, motor=1e-5 * W_M**2) / r.K_t),
    "asymmetric-friction:gearbox": (
        {"gearboxEffect.asymmetricFriction.dF": 2.0, "gearboxEffect.asymmetricFriction.db": 0.3},
        lambda r: torque(r, gear=2.0 + 0.3 * W_M / r.i) / r.K_t,
    ),
    # The contact carries its own friction, which acts on the nut: F_s = F + mu F_s.
    "load-dependent-friction:screw": (
        {"screwEffect.loadDependentFriction.mu": 0.04},
        lambda r: torque(r, nut=SCREW_FORCE * 0.04 / (1.0 - 0.04)) / r.K_t,
    ),
    # A thread: a breakaway part of its own, more with the speed, and another share for each flank and flow of power.
    "load-dependent-friction:screw, thread": (
        {
            f"screwEffect.loadDependentFriction.{name}": value
            for name, value in {
                "mu": 0.02,
                "mu_S": 0.05,
                "v_S": SPEED,
                "n_S": 1.0,
                "mu_v": 0.5,
                "mu_D": -0.01,
                "mu_A": 4e-3,
            }.items()
        },
        lambda r: torque(r, nut=SCREW_FORCE * THREAD / (1.0 - THREAD)) / r.K_t,
    ),
    "load-dependent-friction:motor": (
        {"motorEffect.loadDependentFriction.mu": 0.04},
        lambda r: torque(r) / (1.0 - 0.04) / r.K_t,
    ),
    "torque-constant-saturation": (
        {"torqueEffect.torqueConstantSaturation.a": 2e-3, "torqueEffect.torqueConstantSaturation.b": 1e-3},
        lambda r: brentq(lambda i: r.K_t * (1.0 - 2e-3 * i**2 - 1e-3 * i) * i - torque(r), 0.0, 10.0),
    ),
    "torque-constant-saturation, as a fraction": (
        {"torqueEffect.froelichSaturation.a": 2e-3, "torqueEffect.froelichSaturation.b": 1e-3},
        lambda r: brentq(lambda i: r.K_t * i / (1.0 + 2e-3 * i**2 + 1e-3 * i) - torque(r), 0.0, 20.0),
    ),
    "current-sensor-gain": (
        {"currentSensorEffect.sensorGain.g": 0.03},
        lambda r: 1.03 * torque(r) / r.K_t,
    ),
    "current-sensor-offset": (
        {"currentSensorEffect.sensorOffset.o": 0.2},
        lambda r: 0.2 + torque(r) / r.K_t,
    ),
}


@pytest.mark.parametrize("effect", STEADY)
def test_the_steady_current_is_that_of_the_balance(superset: Plant, effect: str):
    values, expected = STEADY[effect]
    assert steady(superset, values)["i_q"] == pytest.approx(expected(rig()), rel=2e-6)


def test_dead_time_costs_its_voltage(superset: Plant):
    before = steady(superset, {})
    after = steady(superset, {"inverterEffect.inverterDeadTime.U_d": 1.5})
    assert after["u_q"] - before["u_q"] == pytest.approx(1.5, rel=1e-5)
    assert after["i_q"] == pytest.approx(before["i_q"], rel=1e-6)


def test_dead_time_ripples_with_the_rotor_against_the_current(superset: Plant):
    block, amplitude, n = "inverterEffect.inverterDeadTime", (0.2, -0.3), 24.0
    values = {"U_d": 1.5, "i_r": 0.1, "u_s": amplitude[0], "u_c": amplitude[1], "n": n}
    found = run(superset, {f"{block}.{k}": x for k, x in values.items()}, ("inverterEffect.du", "motor.phi"))
    ripple = amplitude[0] * np.sin(n * found["motor.phi"]) + amplitude[1] * np.cos(n * found["motor.phi"])
    expected = -(1.5 + ripple) * np.clip(found["i_q"] / 0.1, -1.0, 1.0)
    assert np.ptp(found["motor.phi"]) > 2.0 * np.pi / n
    np.testing.assert_allclose(found["inverterEffect.du"], expected, atol=1e-9)


def test_self_heating_settles_where_loss_and_cooling_balance(superset: Plant):
    h, tau, alpha_R, alpha_psi = 30.0, 0.05, 3.93e-3, -1.2e-3
    block = "windingEffect.windingSelfHeating"
    values = {
        f"{block}.h": h,
        f"{block}.tau": tau,
        f"{block}.alpha_R": alpha_R,
        f"{block}.alpha_psi": alpha_psi,
    }
    found, r = steady(superset, values), rig()

    def current(theta: float) -> float:
        return torque(r) / (r.K_t * (1.0 + alpha_psi * theta))

    theta = brentq(lambda t: h * tau * r.R_s * (1.0 + alpha_R * t) * current(t) ** 2 - t, 0.0, 300.0)
    voltage = r.R_s * (1.0 + alpha_R * theta) * current(theta) + r.K_t * (1.0 + alpha_psi * theta) * W_M
    assert found["i_q"] == pytest.approx(current(theta), rel=1e-5)
    assert found["u_q"] == pytest.approx(voltage, rel=1e-5)
    assert theta > 10.0  # it is an effect that shows


def test_velocity_sensor_gain_and_delay(superset: Plant):
    plain = run(superset, {})["v"]
    gained = run(superset, {"velocitySensorEffect.sensorGain.g": 0.05})["v"]
    np.testing.assert_allclose(gained, 1.05 * plain, atol=1e-7)
    delayed = run(superset, {"velocitySensorEffect.sensorDelay.tau": 0.008})["v"]
    smooth = slice(450, 850)  # at constant acceleration and speed, where Pade's approximation is exact
    np.testing.assert_allclose(delayed[smooth], np.interp(TIME - 0.008, TIME, plain)[smooth], atol=2e-6)


def test_an_asymmetry_grows_evenly_while_a_place_sticks():
    """A law that falls within the regularised sign is unstable there."""
    s = np.linspace(-1.0, 1.0, 41)
    at = {"s": s, "v": np.zeros(s.size), "z": np.zeros(s.size), "N": np.ones(s.size)}
    friction = s + np.asarray(asymmetry({"dF": 0.9, "db": 0.0}, at))
    assert np.diff(friction).min() > 0.0
    friction = s + np.asarray(
        load_friction(
            {
                "mu": 0.0,
                "mu_S": 0.0,
                "v_S": 1.0,
                "n_S": 1.0,
                "mu_v": 0.0,
                "mu_2": 0.0,
                "mu_A": 0.0,
                "mu_D": 0.9,
            },
            at,
        )
    )
    assert np.diff(friction).min() > 0.0


def test_a_long_delay_is_one_at_every_change_of_speed(superset: Plant):
    """Against the exact delay; one approximation of order (8, 8) errs by more (rms) here."""
    plain = run(superset, {})["v"]
    delayed = run(superset, {"velocitySensorEffect.sensorDelay.tau": 0.03})["v"]
    error = float(np.sqrt(np.mean((delayed - np.interp(TIME - 0.03, TIME, plain)) ** 2)))
    assert error < 6e-7, error


def test_backlash_is_the_width_of_the_hysteresis(superset: Plant):
    gap = 2e-4
    time = np.linspace(0.0, 4.0, 4001)
    command = np.interp(time, [0.1, 0.3, 1.7, 2.1, 3.9], [0.0, SPEED, SPEED, -SPEED, -SPEED])
    still = np.zeros(time.size)
    inputs = Signals(time, {"v_cmd": command, "F_load": still, "T_amb": still - 20.0})

    def width(values: Mapping[str, float]) -> float:
        """How far the nut is ahead of the screw, moving back less moving ahead."""
        found = superset.run(values, inputs, ("x", "w_m", "motor.phi"), time, tolerance=1e-8)
        lag = found["x"] - rig().k * found["motor.phi"] / rig().i
        return float(lag[3500] - lag[1500])

    for taken_up in (0.0, 1.0):
        wide = width({"contactEffect.backlash.gap": gap, "contactEffect.backlash.s_0": taken_up})
        assert wide - width({}) == pytest.approx(gap, rel=1e-3)


def test_flanks_of_a_backlash_push_and_do_not_pull(superset: Plant):
    half, k_s, d_s = 1e-4, rig().k_s, rig().d_s
    names = ("screw.F_s", "screw.delta", "screw.v_s")
    inputs = {"v_cmd": COMMAND, "F_load": np.zeros(TIME.size), "T_amb": np.full(TIME.size, TEMPERATURE)}
    values = {"contactEffect.backlash.gap": 2.0 * half}
    found = superset.run(values, Signals(TIME, inputs), names, TIME, tolerance=1e-9)
    force, delta, rate = (found[name] for name in names)
    ahead = k_s * (delta - half) + d_s * rate
    behind = k_s * (delta + half) + d_s * rate
    expected = np.where(delta > half, np.fmax(ahead, 0.0), np.where(delta < -half, np.fmin(behind, 0.0), 0.0))
    assert np.min(ahead[delta > half]) < -10.0, "parting flanks would pull"
    np.testing.assert_allclose(force, expected, atol=1.0)


@pytest.mark.parametrize("load", [-2e4, 2e4])
def test_backlash_that_the_load_has_taken_up_starts_at_rest(superset: Plant, load: float):
    still = np.zeros(TIME.size)
    inputs = Signals(TIME, {"v_cmd": still, "F_load": still + load, "T_amb": still - 20.0})

    def moved(taken_up: float) -> float:
        values = {"contactEffect.backlash.gap": 2e-4, "contactEffect.backlash.s_0": taken_up}
        return float(np.ptp(superset.run(values, inputs, ("x",), TIME, tolerance=1e-8)["x"]))

    assert moved(1.0) < 2e-6
    assert moved(0.0) > 8e-5


def test_torque_ripple_counts_for_the_no_back_device(superset: Plant):
    ripple = {
        "shaftEffect.torqueRipple.a_s": 1.5,
        "shaftEffect.torqueRipple.c_c": 0.05,
        "shaftEffect.torqueRipple.n": 2.0,
    }
    names = (
        "noBack.tau_s",
        "noBack.tau_nb",
        "noBack.s",
        "screw.F_s",
        "gearbox.flange_b.phi",
        "shaftEffect.tau",
    )
    found = run(superset, ripple, names)
    phi, contact = found["gearbox.flange_b.phi"], rig().k * found["screw.F_s"]
    wanted = 1.5 * np.sin(2.0 * phi) + 0.05 * contact * np.cos(2.0 * phi)
    np.testing.assert_allclose(found["shaftEffect.tau"], wanted, atol=1e-6)
    np.testing.assert_allclose(found["noBack.tau_s"], contact + wanted, atol=1e-6)
    aiding = np.maximum(0.0, -found["noBack.tau_s"] * found["noBack.s"]) * found["noBack.s"]
    np.testing.assert_allclose(found["noBack.tau_nb"], rig().k_b * aiding, atol=1e-6)
    assert np.ptp(wanted) > 1.0


def test_lead_error_makes_no_power(superset: Plant):
    time = np.arange(0.0, 2.0, 1e-3)
    inputs = Signals(
        time,
        {
            "v_cmd": np.interp(time, [0.1, 0.3], [0.0, SPEED]),
            "F_load": np.full(time.size, -2e4),
            "T_amb": np.full(time.size, -20.0),
        },
    )
    error = {"contactEffect.leadError.a_s": 2e-5, "contactEffect.leadError.n": 2.0}
    names = ("noBack.tau_s", "noBack.w", "screw.F_s", "stabilizer.v", "contactEffect.k_e")
    found = superset.run(error, inputs, names, time, tolerance=1e-8)
    steady = time > 0.6
    power = (found["noBack.tau_s"] * found["noBack.w"])[steady]
    load = (found["screw.F_s"] * found["stabilizer.v"])[steady]
    assert np.ptp(found["contactEffect.k_e"][steady]) > 7e-5, "the lead errs by 2 %"
    assert np.max(np.abs(power - load)) < 1e-3 * np.max(np.abs(load))


Law = Callable[[Mapping[str, np.ndarray]], np.ndarray]
FRICTION: dict[str, tuple[dict[str, float], Law]] = {
    "screwEffect.stribeck": (
        {"dF": 800.0, "v_S": 1e-3, "n": 2.0},
        lambda q: 800.0 * np.exp(-((q["v"] / 1e-3) ** 2)) * q["s"],
    ),
    "motorEffect.windage": (
        {"b_q": 2e-5, "n": 1.8, "v_r": 100.0},
        lambda q: 2e-5 * np.abs(q["v"]) ** 1.8 * 100.0**0.2 * q["s"],
    ),
    "screwEffect.hessSoom": (
        {"dF": 800.0, "v_S": 1e-3},
        lambda q: 800.0 / (1.0 + (q["v"] / 1e-3) ** 2) * q["s"],
    ),
    "motorEffect.cogging": (
        {"a_s": 0.02, "a_c": 0.01, "a_s2": 0.005, "a_c2": -0.004, "n": 24.0},
        lambda q: (
            0.02 * np.sin(24.0 * q["z"])
            + 0.01 * np.cos(24.0 * q["z"])
            + 0.005 * np.sin(48.0 * q["z"])
            - 0.004 * np.cos(48.0 * q["z"])
        ),
    ),
    "gearboxEffect.rippleFriction": (
        {"a_s": 0.5, "a_c": -0.2, "n": 3.0},
        lambda q: (0.5 * np.sin(3.0 * q["z"]) - 0.2 * np.cos(3.0 * q["z"])) * q["s"],
    ),
    "screwEffect.positionFriction": (
        {"c1": 2e4, "c2": 300.0, "z_2": 2e-3, "w_2": 5e-4, "c_s": 100.0, "c_c": 50.0, "kappa": 2e3},
        lambda q: (
            (
                2e4 * q["z"]
                + 300.0 * np.exp(-0.5 * ((q["z"] - 2e-3) / 5e-4) ** 2)
                + 100.0 * np.sin(2e3 * q["z"])
                + 50.0 * np.cos(2e3 * q["z"])
            )
            * q["s"]
        ),
    ),
    "gearboxEffect.loadDependentFriction": ({"mu": 0.05}, lambda q: 0.05 * np.abs(q["N"]) * q["s"]),
    "screwEffect.shearThinning": (
        {"dF": 500.0, "v_0": 2e-3},
        lambda q: 500.0 * (1.0 - np.exp(-((q["v"] / 2e-3) ** 2))) * q["s"],
    ),
}


@pytest.mark.parametrize("block", FRICTION)
def test_friction_follows_its_law_of_speed_position_and_load(superset: Plant, block: str):
    parameters, law = FRICTION[block]
    slot = block.split(".")[0]
    names = {q: f"{slot}.{q}" for q in ("v", "s", "z", "N", "F")}
    found = run(superset, {f"{block}.{p}": v for p, v in parameters.items()}, tuple(names.values()))
    quantities = {q: found[name] for q, name in names.items()}
    expected = law(quantities)
    assert np.ptp(expected) > 0.0
    np.testing.assert_allclose(quantities["F"], expected, atol=1e-6 * np.ptp(expected))


def distance(q: Mapping[str, np.ndarray]) -> np.ndarray:
    speed = np.abs(q["v"])
    return np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1])) * 1e-3])


def energy(q: Mapping[str, np.ndarray], fading: float) -> np.ndarray:
    left = np.zeros(TIME.size)
    share = np.exp(-1e-3 / fading)
    for k in range(TIME.size - 1):
        left[k + 1] = left[k] * share + 0.5e-3 * (q["P"][k] * share + q["P"][k + 1])
    return left


WAVE, POWER = 3e3, 1.6
#: Where a term is tried, its output, and what it is with the shapes below.
SHAPES = {
    "v_f": 2e-3,
    "d_f": 3e-3,
    "w": WAVE,
    "n": 2.0,
    "i_s": 0.5,
    "T_f": 0.8,
    "z_b": 1e-3,
    "w_b": 5e-4,
    "v_r": 2e-3,
}
PLACES = {
    "Empirical": ("screwEffect", "F"),
    "EmpiricalRise": ("screwEffect", "F"),
    "EmpiricalTorque": ("shaftEffect", "tau"),
    "EmpiricalDeflection": ("contactEffect", "e"),
    "EmpiricalHeating": ("windingEffect", "g_R"),
    "EmpiricalTorqueConstant": ("torqueEffect", "g_t"),
    "EmpiricalVoltage": ("inverterEffect", "du"),
    "EmpiricalSensor": ("currentSensorEffect", "d"),
}
READ = {
    "screw": "vszN",
    "shaft": ("phi", "T"),
    "contact": ("phi",),
    "winding": "P",
    "torque": ("i_q",),
    "inverter": ("i_q", "phi"),
}
TERMS: dict[str, Law] = {
    "1": lambda q: np.ones(TIME.size),
    "|v|": lambda q: np.abs(q["v"]),
    "v |v|": lambda q: q["v"] * np.abs(q["v"]),
    "v^3": lambda q: q["v"] ** 3,
    "{v_r}^2 |v/{v_r}|^{n} sgn(v)": lambda q: 4e-6 * np.abs(q["v"] / 2e-3) ** POWER * q["s"],
    "z": lambda q: q["z"],
    "z^2": lambda q: q["z"] ** 2,
    "z sgn(v)": lambda q: q["z"] * q["s"],
    "z^2 sgn(v)": lambda q: q["z"] ** 2 * q["s"],
    "z v": lambda q: q["z"] * q["v"],
    "N": lambda q: q["N"],
    "|N| sgn(v)": lambda q: np.abs(q["N"]) * q["s"],
    "|N| v": lambda q: np.abs(q["N"]) * q["v"],
    "N^2 sgn(v)": lambda q: q["N"] ** 2 * q["s"],
    "exp(-|v|/{v_f}) sgn(v)": lambda q: np.exp(-np.abs(q["v"]) / SHAPES["v_f"]) * q["s"],
    "exp(-(v/{v_f})^2) sgn(v)": lambda q: np.exp(-((q["v"] / SHAPES["v_f"]) ** 2)) * q["s"],
    "sgn(v)/(1 + (v/{v_f})^2)": lambda q: q["s"] / (1.0 + (q["v"] / SHAPES["v_f"]) ** 2),
    "exp(-((z - {z_b})/{w_b})^2/2) sgn(v)": lambda q: np.exp(-(((q["z"] - 1e-3) / 5e-4) ** 2) / 2.0) * q["s"],
    "exp(-d/{d_f}) sgn(v)": lambda q: np.exp(-distance(q) / SHAPES["d_f"]) * q["s"],
    "sin({w} z)": lambda q: np.sin(WAVE * q["z"]),
    "cos({w} z)": lambda q: np.cos(WAVE * q["z"]),
    "sin(2 {w} z)": lambda q: np.sin(2.0 * WAVE * q["z"]),
    "cos(2 {w} z)": lambda q: np.cos(2.0 * WAVE * q["z"]),
    "sin({n} phi)": lambda q: np.sin(2.0 * q["phi"]),
    "cos({n} phi)": lambda q: np.cos(2.0 * q["phi"]),
    "T sin({n} phi)": lambda q: q["T"] * np.sin(2.0 * q["phi"]),
    "T cos({n} phi)": lambda q: q["T"] * np.cos(2.0 * q["phi"]),
    "(cos({n} phi) - 1)": lambda q: np.cos(2.0 * q["phi"]) - 1.0,
    "E in the resistance": lambda q: energy(q, SHAPES["T_f"]),
    "E in the flux": lambda q: energy(q, SHAPES["T_f"]),
    "|i_q| in the torque constant": lambda q: np.abs(q["i_q"]),
    "i_q^2 in the torque constant": lambda q: q["i_q"] ** 2,
    "|i_q| in the back-EMF": lambda q: np.abs(q["i_q"]),
    "i_q^2 in the back-EMF": lambda q: q["i_q"] ** 2,
    "tanh(i_q/{i_s})": lambda q: np.tanh(q["i_q"] / SHAPES["i_s"]),
    "tanh(i_q/{i_s}) sin({n} phi)": lambda q: np.tanh(q["i_q"] / SHAPES["i_s"]) * np.sin(2.0 * q["phi"]),
    "tanh(i_q/{i_s}) cos({n} phi)": lambda q: np.tanh(q["i_q"] / SHAPES["i_s"]) * np.cos(2.0 * q["phi"]),
    "i_q |i_q|": lambda q: q["i_q"] * np.abs(q["i_q"]),
    "u": lambda q: q["u"],
    "u |u|": lambda q: q["u"] * np.abs(q["u"]),
}
#: How large a term is made.
SIZES = {
    "F": 200.0,
    "tau": 0.5,
    "e": 1e-6,
    "g_R": 0.05,
    "g_psi": 0.01,
    "g_t": 0.02,
    "g_e": 0.02,
    "du": 2.0,
    "d": 0.1,
}


#: Terms that are not proportional to their coefficient: a width, a time.
OWN = ("EmpiricalClearance", "EmpiricalDelay")
LINEAR = {f"{e.name}{k}": v for e in EMPIRICAL for k, v in enumerate(e.variants) if v.block not in OWN}


@pytest.mark.parametrize("variant", LINEAR.values(), ids=LINEAR)
def test_a_term_of_the_empirical_law_is_what_its_text_says(superset: Plant, variant: Variant):
    slot, usual = PLACES[variant.block]
    names = {q: f"{slot}.{q}" for q in READ.get(slot.removesuffix("Effect"), ("u",))}
    plain = run(superset, {}, tuple(names.values()))
    own = SHAPES | ({"n": POWER} if variant.instead else {})
    shapes = {
        f"{slot}.{variant.component}.{p.name}": own[p.name] for p in variant.parameters if p.role == "shape"
    }
    for p in variant.parameters:
        if p.role == "shape":
            continue
        term = TERMS[p.description.removeprefix("coefficient of ")]
        output = {"k_psi": "g_psi", "e_a": "g_e", "e_ii": "g_e"}.get(p.name, usual)
        size = SIZES[output] / np.abs(term({q: plain[n] for q, n in names.items()})).max()
        values = {f"{slot}.{variant.component}.{p.name}": size, **shapes}
        found = run(superset, values, (*names.values(), f"{slot}.{output}"))
        expected = size * term({q: found[n] for q, n in names.items()})
        # v |v| stands for v v sgn(v), whose sign is a straight line within the friction's own width; distance and
        # energy are summed from samples
        summed = p.name in ("k_d", "k_R", "k_psi")
        allowed = (1e-2 if summed else 5e-6) * SIZES[output]
        np.testing.assert_allclose(found[f"{slot}.{output}"], expected, atol=allowed)


def test_the_empirical_dead_zone_takes_its_width_out_of_the_deflection(superset: Plant):
    gap = 2e-5
    found = run(
        superset, {"contactEffect.empiricalClearance.gap": gap}, ("contactEffect.delta", "contactEffect.e")
    )
    expected = -np.clip(found["contactEffect.delta"], -0.5 * gap, 0.5 * gap)
    np.testing.assert_allclose(found["contactEffect.e"], expected, atol=1e-9)


def test_the_empirical_delay_is_the_value_a_while_ago(superset: Plant):
    delay = 0.02
    sensor = "velocitySensorEffect"
    found = run(superset, {f"{sensor}.empiricalDelay.tau": delay}, (f"{sensor}.u", f"{sensor}.d"))
    true = found[f"{sensor}.u"]
    expected = np.interp(TIME - delay, TIME, true) - true
    assert np.sqrt(np.mean((found[f"{sensor}.d"] - expected) ** 2)) < 0.02 * np.sqrt(np.mean(expected**2))


def test_run_in_falls_with_the_distance_whatever_the_direction(superset: Plant):
    block = "screwEffect.frictionRunIn"
    found = run(superset, {f"{block}.dF": 600.0, f"{block}.d_r": 3e-3}, ("screwEffect.v", "screwEffect.F"))
    speed = found["screwEffect.v"]
    distance = np.concatenate([[0.0], np.cumsum(0.5 * (np.abs(speed[1:]) + np.abs(speed[:-1])) * 1e-3)])
    moving = np.abs(speed) > 1e-4
    expected = 600.0 * np.exp(-distance / 3e-3) * np.sign(speed)
    np.testing.assert_allclose(found["screwEffect.F"][moving], expected[moving], atol=1.0)
