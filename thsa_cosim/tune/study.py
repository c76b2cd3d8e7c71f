"""What makes two tunings the same study."""

import hashlib
import json
from dataclasses import asdict

import numpy as np

from thsa_cosim.scenario import TuneScenario


def study_identity(scenario: TuneScenario) -> dict[str, object]:
    """What makes two runs the same study: digests of scenario and FMU, and the seed."""
    content = {
        key: value
        for key, value in vars(scenario).items()
        if key not in ("path", "fmu", "seed", "simulation", "command")
    }
    command = scenario.command
    content["command"] = [command.input, command.output, command.unit, command.begin, command.values.tolist()]
    content["time"] = command.time.tolist()
    simulation = {**asdict(scenario.simulation), "deadline": None, "memory_mb": None}
    text = json.dumps([content, simulation], sort_keys=True, default=_plain)
    return {
        "kind": scenario.kind,
        "scenario": hashlib.sha256(text.encode()).hexdigest(),
        "fmu": scenario.fmu.sha256,
        "seed": scenario.seed,
    }


def _plain(value: object) -> object:
    return value.tolist() if isinstance(value, np.ndarray) else vars(value) | {"type": type(value).__name__}
