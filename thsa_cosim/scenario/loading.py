"""A scenario of whatever kind, from a file or from its content: the one way in."""

from collections.abc import Sequence
from pathlib import Path

from thsa_cosim.errors import ScenarioError, did_you_mean
from thsa_cosim.scenario.model import Scenario
from thsa_cosim.scenario.recorded import load_scenario
from thsa_cosim.scenario.sentences import one_line
from thsa_cosim.scenario.source import Source, read_source
from thsa_cosim.scenario.stages import StagedScenario, load_stages
from thsa_cosim.scenario.tune_load import load_tune
from thsa_cosim.scenario.tune_model import TuneScenario

AnyScenario = Scenario | StagedScenario | TuneScenario


def load(
    source: Source,
    *,
    fit: Sequence[Path | str] = (),
    validate: Sequence[Path | str] = (),
    seed: int | None = None,
    fmu: Path | str | None = None,
) -> AnyScenario:
    """Read, check and resolve a scenario: one with recordings, a tuning, or several in stages.

    ``fit``, ``validate``, ``seed`` and ``fmu`` replace the scenario's own.

    Raises
    ------
    ThsaCosimError
        As :func:`load_scenario`, and ScenarioError for what a scenario has no use for.
    """
    path, data = read_source(source)
    if data.get("kind") == "tune":
        if fit or validate:
            raise ScenarioError(
                f"{path}: a tuning describes its command itself; leave out --fit and --validate."
            )
        return load_tune(source, seed=seed, fmu=fmu)
    if "stages" in data:
        if fit or validate or fmu:
            raise ScenarioError(
                f"{path}: has stages with recordings and FMUs of their own; replace them in the stages' files,"
                f" or run one stage alone."
            )
        return load_stages(path, data, seed)
    for key in data:
        if hint := did_you_mean(key, ["stages"]):
            raise ScenarioError(one_line(f"{path}: unknown key {key!r}.{hint}"))
    return load_scenario(source, fit=fit, validate=validate, seed=seed, fmu=fmu)
