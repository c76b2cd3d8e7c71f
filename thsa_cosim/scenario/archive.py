"""The system of a scenario as an SSP archive for other tools."""

import shutil
from pathlib import Path

from pydantic import ValidationError

from thsa_cosim.errors import FmuError, ScenarioError
from thsa_cosim.scenario.sentences import from_validation, one_line
from thsa_cosim.scenario.source import read_toml
from thsa_cosim.scenario.system import assemble_tables
from thsa_cosim.scenario.system_schema import ModelTable


def write_system(scenario: Path, output: Path | None) -> Path:
    """Write the system that the tables of ``scenario`` describe; default next to it, with the ending ``.ssp``.

    Raises ScenarioError or FmuError in one sentence.
    """
    data = read_toml(scenario)
    own = {key: data[key] for key in ModelTable.keys() if key in data}  # noqa: SIM118
    try:
        table = ModelTable.model_validate(own)
    except ValidationError as error:
        raise from_validation(scenario, own, error) from None
    if not table.components:
        raise ScenarioError(f"{scenario}: it runs {table.fmu} and describes no system; add [[components]].")
    target = output or scenario.with_suffix(".ssp")
    try:
        archive = assemble_tables(scenario, table).path
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(archive, target)
    except FmuError as error:
        raise FmuError(one_line(f"{scenario}: {error}")) from None
    except OSError as error:
        reason = error.strerror or error
        raise ScenarioError(f"{target} cannot be written ({reason}); choose another with -o.") from None
    return target
