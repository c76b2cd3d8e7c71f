"""What the studies of the article say, as numbers: nothing is typed in but what the article prints."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
from numpy.typing import NDArray

from thsa_cosim.efficiency import motor_efficiency
from thsa_cosim.laws import COPPER, Law, doubts_about, published_law, quantity_of
from thsa_cosim.report.identify.parameters import read_law

Json = dict[str, Any]
FloatArray = NDArray[np.float64]
RECORDINGS = Path(__file__).resolve().parents[1] / "scenarios" / "recordings"

TEMPERATURES = (25.0, 0.0, -10.0, -20.0, -30.0, -40.0, -50.0, -55.0)
SPEEDS = (0.5, 1.0, 2.0, 3.0, 4.5, 6.0, 7.5, 9.0)
"""mm/s, of the gearbox and screw benches, both ways."""
LEAD = 10e-3 / (2.0 * np.pi)
"""m/rad, k of the screw."""
POLE_PAIRS = 4
GEAR_RATIO = 30.0
EFFICIENCY_AT = (25.0, -30.0, -55.0)
#: Tables II and III: form, coefficients as `Law` has them, unit.
TABLES: dict[str, tuple[str, list[float], str]] = {
    "R_s": ("cubic", [1.2, 3e-2, 7e-5, -5e-6], "ohm"),
    "psi_pm": ("quadratic", [0.1, 6e-5, -4e-6], "Wb"),
    "T_fm": ("double-exponential", [1e-2, -4e-2, 3e-2, 9e-3], "N.m"),
    "b_m": ("cubic", [4e-5, 2e-8, 1e-8, 1e-10], "N.m/(rad/s)"),
    "T_fg": ("quadratic", [11.0, -0.25, 2e-4], "N.m"),
    "b_g": ("linear", [-6e-7, 1.8e-7], "N.m/(rad/s)"),
    "F_fn": ("cubic", [2.7e3, 37.0, -1.4, -0.07], "N"),
    "b_n": ("quadratic", [4e4, -3e3, 230.0], "N/(m/s)"),
}


def published(name: str) -> Law:
    """The law of table II or III."""
    form, coefficients, _ = TABLES[name]
    return published_law(form, coefficients)


def temperature_label(t: float) -> str:
    """As in the names of the recordings: ``m30``, ``p25``."""
    return f"{'m' if t < 0 else 'p'}{abs(t):02.0f}"


def plateaus(bench: str, temperature: float) -> FloatArray:
    """Force [N] (2, 8) at each speed of :data:`SPEEDS`: forward and backward, means over the plateaus."""
    table = pq.read_table(RECORDINGS / f"{bench}_{temperature_label(temperature)}.parquet").to_pandas()
    speed, force = table["velocity_mm_s"].to_numpy(), 1e3 * table["force_kN"].to_numpy()
    found = [[np.mean(force[np.abs(speed - sign * s) < 0.2]) for s in SPEEDS] for sign in (1.0, -1.0)]
    return np.array(found)


def friction_points(element: str) -> FloatArray:
    """Measured friction (8 temperatures, 8 speeds): of the nut in N, of the gearbox at its output shaft in N.m.

    Half the difference of both directions, which leaves an offset of the force sensor out.
    """
    rows = []
    for t in TEMPERATURES:
        force = plateaus("screw", t)
        if element == "gearbox":
            force = plateaus("gearbox", t) - force
        half = 0.5 * (force[0] - force[1])
        rows.append(half * LEAD if element == "gearbox" else half)
    return np.array(rows)


def ramp(name: str) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Time [s], command, velocity [mm/s] and current [A] (n,) of a recorded ramp: "tuned_at_25" or "optimized"."""
    table = pq.read_table(RECORDINGS / f"ramp_m30_{name}.parquet").to_pandas()
    columns = ("time_s", "velocity_command_mm_s", "velocity_mm_s", "q_current_A")
    time, command, velocity, current = (table[c].to_numpy(dtype=np.float64) for c in columns)
    return time, command, velocity, current


def response(name: str) -> Json:
    """Rise time to 95 % and e_ss over 1.0 to 1.2 s of a recorded ramp, after a median over 5 ms against noise."""
    time, command, velocity, _ = ramp(name)
    smooth = np.median(np.lib.stride_tricks.sliding_window_view(np.pad(velocity, 2, "edge"), 5), axis=1)
    reached = float(time[np.argmax(smooth >= 0.95 * command[-1])])
    window = (time >= 1.0) & (time <= 1.2)
    return {
        "rise_time": reached,
        "steady_state_error": float(np.mean(1.0 - velocity[window] / command[window])),
        "standard_error": float(np.std(velocity[window]) / command[-1] / np.sqrt(window.sum())),
    }


def laws_numbers() -> Json:
    """What needs no study: the published laws against copper, against the bench's friction, against eq. 4."""
    resistance, flux = published("R_s"), published("psi_pm")
    warm = float(resistance(25.0))
    gearbox = friction_points("gearbox")
    viscous = published("b_g")
    speed = np.array(SPEEDS) * 1e-3 / LEAD
    share = [
        float(np.max(np.abs(float(viscous(t)) * speed) / np.mean(row)))
        for t, row in zip(TEMPERATURES, gearbox, strict=True)
    ]
    doubts = {
        name: [
            {"kind": d.kind, "text": d.text}
            for d in doubts_about(published(name), quantity_of(unit), name, unit, -55.0, 25.0)
        ]
        for name, (_, _, unit) in TABLES.items()
    }
    fine = np.arange(-55.0, 25.01, 0.5)
    return {
        "R_s_m30": float(resistance(-30.0)),
        "R_s_p25": warm,
        "R_s_copper_m30": warm * (1.0 + COPPER * -50.0) / (1.0 + COPPER * 5.0),
        "R_s_lowest_at": float(fine[np.argmin(resistance(fine))]),
        "R_s_m55": float(resistance(-55.0)),
        "psi_highest_at": float(fine[np.argmax(flux(fine))]),
        "K_t_m30": float(np.sqrt(1.5) * POLE_PAIRS * flux(-30.0)),
        "b_g_share": max(share),
        "b_g_share_m30": share[TEMPERATURES.index(-30.0)],
        "doubts": doubts,
    }


def identified_numbers(result: Json) -> Json:
    """Laws and points of the benches against tables II and III; ``largest`` relative to the table's largest value."""
    rows: Json = {}
    for name, law in result["laws"].items():
        table, t = published(name), np.array(TEMPERATURES)
        ours = read_law(law)
        at_m30 = next(p["parameters"][name] for p in result["points"] if p["temperature_degC"] == -30.0)
        scale = float(np.max(np.abs(table(t))))
        rows[name] = {
            "form": law["form"],
            "coefficients": law["coefficients"],
            "largest": float(np.max(np.abs(ours(t) - table(t)))) / scale,
            "m30": at_m30["value"],
            "stderr_m30": at_m30["stderr"],
            "published_m30": float(table(-30.0)),
            "identifiable": law.get("identifiable", True),
            "doubts": [{"kind": d["kind"], "text": d["text"]} for d in law["doubts"]],
        }
    return rows


def validation_numbers(recording: Json, name: str) -> Json:
    """Errors of velocity and current on a recorded ramp, over the range and over the root mean square of the signal."""
    _, _, velocity, current = ramp(name)
    measured = {"v": 1e-3 * velocity, "i_q": current}
    return {
        channel: {
            "range": recording["error"][channel]["nrmse"],
            "rms": recording["error"][channel]["rmse"] / float(np.sqrt(np.mean(values**2))),
            "noise": recording["error"][channel]["rmse"] / recording["error"][channel]["noise"],
        }
        for channel, values in measured.items()
    }


def tuned_numbers(result: Json) -> Json:
    """Every set of gains of a tuning with its response."""
    sets = {"before": result["before"], "after": result["after"], **result["compare"]}
    wanted = ("rise_time", "steady_state_error", "overshoot", "bandwidth", "phase_margin", "cost")
    return {name: {**one["gains"], **{key: one[key] for key in wanted}} for name, one in sets.items()} | {
        "line": (result.get("line") or {}).get("ratio")
    }


def copper_loss(result: Json) -> Json:
    """Eq. 2 on the recorded ramp: electrical minus mechanical power at constant speed, and R_s i_q² as identified."""
    table = pq.read_table(RECORDINGS / "ramp_m30_tuned_at_25.parquet").to_pandas()
    steady = table["time_s"].to_numpy() > 1.5
    speed, current, voltage = (
        table[c].to_numpy(dtype=np.float64)[steady]
        for c in ("motor_speed_rad_s", "q_current_A", "q_voltage_V")
    )
    laws = {name: read_law(result["laws"][name]) for name in ("R_s", "psi_pm")}
    constant = float(np.sqrt(1.5) * POLE_PAIRS * laws["psi_pm"](-30.0))
    return {
        "balance": float(np.mean(voltage * current) - constant * np.mean(speed * current)),
        "formula": float(laws["R_s"](-30.0) * np.mean(current**2)),
        # The balance is a small difference of large powers: mean noise of u_q and omega_m, and the resolution.
        "sigma": float(
            np.hypot(0.3 * np.mean(current), constant * 0.2 * np.mean(current)) / np.sqrt(steady.sum())
        ),
    }


def load_torque(laws: dict[str, Law], temperature: float, force: float, speed: float) -> float:
    """Torque [N.m] at the motor's shaft for ``force`` [N] at ``speed`` [m/s] > 0, by the rig's equations; 0: breakaway.

    An aiding load costs the no-back device's drag less the load itself.
    """
    screw = LEAD * (force + float(laws["F_fn"](temperature) + laws["b_n"](temperature) * speed))
    drag = 1.15 * max(0.0, -screw)
    return (screw + drag + float(laws["T_fg"](temperature))) / GEAR_RATIO


def efficiency_numbers(result: Json) -> Json:
    """The motor's efficiency at 9 mm/s against 55 kN, the whole actuator's, and the recorded one at −30 °C."""
    laws = {name: read_law(law) for name, law in result["laws"].items()}
    speed = 9e-3 * GEAR_RATIO / LEAD
    found: Json = {"motor": {}, "actuator": {}}
    for t in EFFICIENCY_AT:
        torque = load_torque(laws, t, 55e3, 9e-3)
        motor = float(motor_efficiency(torque, speed, **motor_of(laws, t)))
        found["motor"][f"{t:g}"] = motor
        found["actuator"][f"{t:g}"] = motor * 55e3 * 9e-3 / (torque * speed)
    table = pq.read_table(RECORDINGS / "ramp_m30_tuned_at_25.parquet").to_pandas()
    steady = table[table["time_s"] > 1.5]
    electrical = float(np.mean(steady["q_voltage_V"].to_numpy(float) * steady["q_current_A"].to_numpy(float)))
    velocity, load = (float(np.mean(steady[c])) for c in ("velocity_mm_s", "load_kN"))
    found["recorded_m30"] = velocity * load / electrical
    return found


def motor_of(laws: dict[str, Law], temperature: float) -> dict[str, float]:
    """Arguments of ``motor_efficiency`` at a temperature."""
    return {
        "resistance": float(laws["R_s"](temperature)),
        "torque_constant": float(np.sqrt(1.5) * POLE_PAIRS * laws["psi_pm"](temperature)),
        "coulomb": float(laws["T_fm"](temperature)),
        "viscous": float(laws["b_m"](temperature)),
    }


def start_numbers(result: Json, laws: Json) -> list[Json]:
    """The start from rest with the tuned gains, and the static breakaway current by the identified laws."""
    read = {name: read_law(law) for name, law in laws.items()}
    rows = []
    for row in result["start"]:
        if row["gains"] != "after":
            continue
        t = row["temperature_degC"]
        motor = motor_of(read, t)
        torque = load_torque(read, t, 1e3 * row["F_load_kN"], 0.0) + motor["coulomb"]
        rows.append(
            {k: v for k, v in row.items() if k != "gains"} | {"static": torque / motor["torque_constant"]}
        )
    return rows


def read_result(folder: Path) -> Json:
    """``result.json`` of a study folder."""
    content: Json = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    return content
