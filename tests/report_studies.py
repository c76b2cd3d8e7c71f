"""Study folders as the commands leave them, made up, with names that a test chooses: nothing is simulated."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from thsa_cosim.batch import Journal, JournalRow, Status
from thsa_cosim.report.signal_files import write_signals
from thsa_cosim.signals import Signals
from thsa_cosim.study import claim_folder

COMMAND = "thsa-cosim identify bench.toml -o studies/bench"
POPULATION, GENERATIONS = 6, 3
#: One sample of the recording at 25 degC is off by this, in A.
SPIKE = 7.0


def about(**more: Any) -> dict[str, Any]:
    """What a study keeps about itself, besides the versions."""
    return {
        "title": "bench",
        "scenario": "bench.toml",
        "command": COMMAND,
        "fmu": "Motor.fmu",
        "population": POPULATION,
        "generations": GENERATIONS,
        **more,
    }


def identity(kind: str) -> dict[str, Any]:
    """Digests of a study."""
    return {"kind": kind, "scenario": "0" * 64, "fmu": "f" * 64, "recordings": {}, "seed": 7}


def journal_rows(label: str, names: int, terms: int, generations: int, seed: int = 0) -> list[JournalRow]:
    """Vectors whose costs fall with the generations; the last one of each generation fails."""
    rng = np.random.default_rng(seed)
    rows = []
    for k in range(POPULATION * generations):
        fails = k % POPULATION == POPULATION - 1
        cost = float("inf") if fails else float(rng.uniform(50.0, 100.0) / (1 + k // POPULATION))
        rows.append(
            JournalRow(
                stage=label,
                index=k + 1,
                values=tuple(rng.uniform(0.1, 1.0, names).tolist()),
                cost=cost,
                terms=(cost / max(terms, 1),) * terms,
                status=Status.FMI_ERROR if fails else Status.OK,
                reason="fmi2DoStep returned fmi2Error" if fails else "",
            )
        )
    return rows


def write_journal(
    folder: Path, labels: list[str], names: list[str], terms: list[str], generations: int
) -> None:
    """Write ``journal.csv`` with some generations of every label."""
    with Journal.open(folder / "journal.csv", names, terms) as journal:
        for k, label in enumerate(labels):
            journal.append(journal_rows(label, len(names), len(terms), generations, seed=k))


def channel_error(rmse: float, unit: str) -> dict[str, Any]:
    """An error as result.json holds it, against a noise of 0.05."""
    return {"rmse": rmse, "nrmse": rmse / 10.0, "noise": 0.05, "unit": unit, "samples": 4000}


def estimate(value: float, unit: str, sure: bool = True) -> dict[str, Any]:
    """An estimate with one percent of standard error."""
    found = {"value": value, "unit": unit, "stderr": abs(value) / 100.0, "identifiable": sure}
    return {**found, **({} if sure else {"reason": "it moves with b_m"}), "lower": 0.0, "upper": 10.0}


def identify_result(title: str = "bench", channel: str = "i_q", parameter: str = "R_s") -> dict[str, Any]:
    """The result of two parameters at two temperatures; the second is not determined in the cold."""
    points = []
    for t, resistance in ((-30.0, 0.5), (25.0, 1.9)):
        own = {parameter: estimate(resistance, "ohm"), "T_fm": estimate(0.04, "N.m", sure=t > 0.0)}
        history = [
            {
                "generation": g,
                "best_cost": 1.0,
                "median_cost": 2.0,
                "spread": [0.1, 0.1],
                "evaluations": 6 * (g + 1),
            }
            for g in range(GENERATIONS + 1)
        ]
        points.append(
            {
                "temperature_degC": t,
                "label": f"{t:g} degC",
                "recordings": [f"run_{t:g}"],
                "parameters": own,
                "correlation": [[1.0, 0.97 if t < 0 else -0.12], [0.97 if t < 0 else -0.12, 1.0]],
                "cost": 4000.0,
                "cost_per_sample": 1.0,
                "terms": {channel: 4000.0},
                "also": {},
                "profiles": {},
                "evaluations": 24,
                "converged": False,
                "stopped": f"all {GENERATIONS} generations were used",
                "polish": "the step became negligible",
                "generations": history,
            }
        )
    law = {
        "form": "linear",
        "coefficients": [1.26, 0.025],
        "unit": "ohm",
        "at": {},
        "selected_by": "scenario",
    }
    law |= {"covariance": [[1e-4, 0.0], [0.0, 1e-7]], "chi2": 0.0, "identifiable": True, "candidates": {}}
    law |= {"published": {"form": "linear", "coefficients": [1.2, 0.03]}}
    law |= {"largest_deviation": {"points": 0.031, "law": 0.028}}
    return {
        "kind": "identify",
        "title": title,
        "status": "complete",
        "seed": 7,
        "evaluations": 48,
        "failures": {"fmi2DoStep returned fmi2Error": 6},
        "fmu": {"path": "Motor.fmu", "sha256": "f" * 64},
        "scenario": "bench.toml",
        "version": "0.1.0",
        "settings": {"population": POPULATION, "generations": GENERATIONS, "strategy": "rand1bin"},
        "planned_points": 2,
        "points": points,
        "laws": {parameter: law},
        "error": {"fit": {channel: channel_error(0.3, "A")}, "validate": {}},
        "recordings": [
            {
                "name": f"run_{p['temperature_degC']:g}",
                "role": "fit",
                "temperature_degC": p["temperature_degC"],
                "error": {channel: channel_error(rmse, "A")},
            }
            for p, rmse in zip(points, (0.05, 0.3), strict=True)
        ],
        "notes": [],
    }


def write_identify(folder: Path, **names: str) -> dict[str, Any]:
    """A finished identification; keyword arguments as of ``identify_result``."""
    result = identify_result(**names)
    labels = [p["label"] for p in result["points"]]
    claim_folder(folder, identity("identify"), about(samples=dict.fromkeys(labels, 4000)))
    (folder / "result.json").write_text(json.dumps(result))
    (channel,) = result["error"]["fit"]
    write_journal(folder, labels, list(result["points"][0]["parameters"]), [channel], GENERATIONS + 1)
    time = np.arange(8000) * 1e-3
    for k, recording in enumerate(result["recordings"]):
        true = np.sin(2.0 * np.pi * time)
        measured = true + np.random.default_rng(k).normal(0.0, 0.05, time.size)
        if k == 1:
            measured[4321] += SPIKE
        signals = {
            v: Signals(time, {channel: x}, {channel: "A"})
            for v, x in (("measured", measured), ("simulated", true))
        }
        write_signals(folder, "fit", recording["name"], signals)
    return result


def tune_result() -> dict[str, Any]:
    """The result of tuning two gains, with a map of the cost and a trade-off."""

    def scored(k_p: float, k_i: float, cost: float, overshoot: float) -> dict[str, Any]:
        terms = {"tracking": cost, "rise_time": 0.3, "steady_state_error": 1e-4, "overshoot": overshoot}
        excess = {"overshoot": max(overshoot - 0.01, 0.0) / 0.01, "gain_margin": 0.0}
        return {
            "gains": {"K_p": k_p, "K_i": k_i},
            **terms,
            "effort": 8.0,
            "gain_margin": None,
            "cost": cost,
        } | {"cost_terms": {"tracking": cost}, "feasible": overshoot <= 0.01, "excess": excess}

    x, y = np.geomspace(0.03, 3.0, 7), np.geomspace(0.1, 30.0, 7)
    eq7 = 100.0 + 50.0 * (np.log(x[None, :] / 0.4) ** 2 + np.log(y[:, None] / 3.0) ** 2)
    cost = [[None if i > 4 else float(v) for v in row] for i, row in enumerate(eq7)]
    return {
        "kind": "tune",
        "title": "gains",
        "status": "complete",
        "seed": 7,
        "evaluations": 24,
        "failures": {},
        "fmu": {"path": "THSA.fmu", "sha256": "a" * 64},
        "scenario": "gains.toml",
        "version": "0.1.0",
        "settings": {"population": POPULATION, "generations": GENERATIONS},
        "gains": {"K_p": 0.4, "K_i": 3.0},
        "units": {"K_p": "A/(rad/s)", "K_i": "A/rad"},
        "feasible": True,
        "before": scored(0.12, 0.45, 2977.0, 0.02),
        "after": scored(0.4, 3.0, 100.0, 0.0),
        "compare": {"article": scored(0.363, 2.98, 120.0, 0.005)},
        "requirements": [
            {"metric": "overshoot", "maximum": 0.01, "unit": "1", "hard": True, "met": True},
            {"metric": "gain_margin", "minimum": 10.0, "unit": "dB", "hard": True, "met": True},
        ],
        "line": {"numerator": "K_p", "denominator": "K_i", "ratio": 0.125, "low": 0.11, "high": 0.14}
        | {"generations": 2, "published": 0.1218},
        "pareto": {
            "x": "effort",
            "y": "tracking",
            "front": [
                {"effort": 8.0 + k, "tracking": 100.0 / (k + 1), "K_p": 0.4, "K_i": 3.0} for k in range(4)
            ],
        },
        "surface": {"parameters": ["K_p", "K_i"], "K_p": x.tolist(), "K_i": y.tolist(), "cost": cost}
        | {"equation_7": eq7.tolist()},
        "schedule": [{"temperature_degC": -30.0, "K_p": 0.4, "K_i": 3.0}],
        "schedule_check": None,
        "command": {"input": "v_cmd", "output": "v", "unit": "mm/s"},
        "conditions": {"T_amb": {"unit": "degC", "values": [-30.0]}},
        "term_units": {"tracking": "(mm/s)²", "rise_time": "s", "steady_state_error": "1"}
        | {"overshoot": "1", "effort": "A", "gain_margin": "dB"},
        "groups": [
            {"label": "all conditions", "at": {}, "gains": {"K_p": 0.4, "K_i": 3.0}, "cost": 100.0}
            | {"feasible": True, "stopped": "converged: narrow", "best_cost": [4.0, 3.0, 2.0, 1.0]}
        ],
        "notes": ["K_i ends at its upper bound"],
    }


def write_tune(folder: Path) -> dict[str, Any]:
    """A finished tuning."""
    result = tune_result()
    claim_folder(folder, identity("tune"), about(parameters=result["units"]))
    (folder / "result.json").write_text(json.dumps(result))
    write_journal(folder, ["all conditions"], ["K_p", "K_i"], ["tracking", "effort"], GENERATIONS + 1)
    time = np.arange(1200) * 1e-3
    command = np.minimum(30.0 * time, 9.0)
    units = {"v": "mm/s", "i_q": "A"}
    variants = {"command": Signals(time, {"v": command}, {"v": "mm/s"})}
    for name, lag in (("before", 0.1), ("article", 0.05), ("after", 0.02)):
        response = np.interp(time - lag, time, command)
        variants[name] = Signals(time, {"v": response, "i_q": command - response}, units)
    write_signals(folder, "response", "T_amb = -30 degC", variants)
    return result


def diagnose_result() -> dict[str, Any]:
    """A backlash was found; stribeck was weighed and refused, and the heating of the winding cannot be tested."""
    gap = {"value": 2.5e-4, "unit": "m", "stderr": 1e-5}
    before = {"v": {"rmse": 1e-4, "noise": 2e-5, "structure": 9.8e-5}}
    after = {"v": {"rmse": 2.1e-5, "noise": 2e-5, "structure": 1e-6}}
    weighed = {"round": 1, "fit_gain": 5e4, "p_value": 1e-9, "parameters": {"gap": gap}}
    return {
        "kind": "diagnose",
        "title": "unit 7",
        "status": "complete",
        "verdict": "missing-effect",
        "effects": [
            {"name": "backlash", "title": "Backlash of the screw", "parameters": {"gap": gap}}
            | {"equivalent": ["velocity-sensor-delay"], "probability": 0.99}
        ],
        "before": {"fit": before, "validate": before},
        "after": {"fit": after, "validate": after},
        "unexplained": 0.02,
        "model": "THSA_with_backlash.mo",
        "fmu": "THSA_with_backlash.fmu",
        "parameters": {
            "before": {"J": {"value": 2.1e-3, "unit": "kg.m2", "stderr": 1e-5}},
            "after": {"J": {"value": 2.0e-3, "unit": "kg.m2", "stderr": 1e-5}},
        },
        "threshold": 30.0,
        "candidates": [
            {"name": "backlash", "variant": "backlash:screw", "held_out_gain": 4e4, **weighed}
            | {"decision": "accepted", "reason": ""},
            {"name": "stribeck", "variant": "stribeck:screw", "held_out_gain": 12.0, **weighed}
            | {"decision": "rejected", "reason": "explains the held-out recordings less well"},
            {"name": "windage", "variant": "windage", "held_out_gain": None, **weighed}
            | {"decision": "not refined", "reason": "promises no more than chance"},
            {
                "name": "winding-self-heating",
                "variant": "winding-self-heating",
                "held_out_gain": None,
                **weighed,
            }
            | {"decision": "not testable", "reason": "too little excitation"},
        ],
        "not_testable": [{"name": "winding-self-heating", "reason": "too little excitation"}],
        "equivalence": [{"names": ["stribeck:motor", "stribeck:gearbox"], "angle_deg": 0.82}],
        "empirical": {
            "slot": "screw",
            "terms": [
                {"slot": "screw", "term": "|N| sgn(v)", "coefficient": 0.031, "unit": "1", "stderr": 0.002},
                {
                    "slot": "motor",
                    "term": "v |v|",
                    "coefficient": 2e-6,
                    "unit": "N.m.s2/rad2",
                    "stderr": 1e-7,
                },
            ],
            "held_out_gain": 5120.0,
            "added": False,
        },
        "balance": [
            {
                "equation": "screw contact",
                "unit": "N",
                "rmse": 900.0,
                "noise": 60.0,
                "share": 0.9,
                "at_fault": True,
            },
            {"equation": "winding", "unit": "V", "rmse": 0.31, "noise": 0.3, "share": 0.1, "at_fault": False},
        ],
        "experiment": {
            "name": "slow reversals under no load",
            "rivals": ["backlash", "velocity-sensor-delay"],
            "distance": 812.0,
            "present": 3.5,
            "file": "experiment.csv",
        },
        "notes": [],
        "seed": 7,
        "evaluations": 300,
        "failures": {},
        "declared_fmu": {"path": "fmus/THSA.fmu", "sha256": "a" * 64},
        "scenario": "driven.toml",
        "version": "0.1.0",
    }


def write_diagnose(folder: Path) -> dict[str, Any]:
    """A finished diagnosis."""
    result = diagnose_result()
    claim_folder(folder, identity("diagnose"), about())
    (folder / "result.json").write_text(json.dumps(result))
    time = np.arange(3000) * 1e-3
    true = 9e-3 * np.sin(2.0 * np.pi * time)
    for role, name in (("fit", "fit_1"), ("validate", "validate_1")):
        noise = np.random.default_rng(1).normal(0.0, 2e-5, time.size)
        jump = 1e-4 * np.sign(np.cos(2.0 * np.pi * time))
        values = {"measured": true + jump + noise, "before": true, "after": true + jump}
        write_signals(
            folder, role, name, {k: Signals(time, {"v": v}, {"v": "m/s"}) for k, v in values.items()}
        )
    lines = ["variable,bin_centre,unit,channel,channel_unit,mean_before,mean_after,stderr"]
    variables = {"time": "s", "v_cmd": "m/s", "F_load": "N", "x": "m", "w_m": "rad/s", "i_q": "A", "u_q": "V"}
    for k, (variable, unit) in enumerate(variables.items()):
        # The later a variable, the more clearly the residual depends on it.
        lines += [f"{variable},{x / 10},{unit},v,m/s,{1e-5 * k * np.sign(x)},0.0,1e-6" for x in range(-5, 6)]
    lines += [f"x,{x / 10},m,i_q,A,{1e-3 * x},0.0,1e-4" for x in range(-5, 6)]
    (folder / "structure.csv").write_text("\n".join(lines) + "\n")
    return result
