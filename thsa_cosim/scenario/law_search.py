"""``temperature.group = "law"``: parameters that are laws over temperature, searched as such."""

from collections.abc import Sequence

import numpy as np

from thsa_cosim.errors import ScenarioError
from thsa_cosim.laws import SEARCHABLE, SearchedLaw
from thsa_cosim.parameters import Parameter, ParameterSpace
from thsa_cosim.recordings import Recording
from thsa_cosim.scenario.schema import CommonTable, IdentifyTable, ParameterTable

#: K between the coldest and the warmest sample without which no law over temperature can be seen.
LEAST_SPAN = 5.0


def with_laws(table: CommonTable, space: ParameterSpace, recordings: Sequence[Recording]) -> ParameterSpace:
    """Return the space in which each parameter with a law is replaced by that law's unknowns.

    Raises
    ------
    ScenarioError
        If no temperature is recorded or it does not move, or a law has no form or no block to be written into.
    """
    source = table.temperature
    if not isinstance(table, IdentifyTable) or source is None or source.group != "law":
        return space
    if source.input is None:
        raise ScenarioError(
            "temperature.group = 'law' needs temperature.input: the FMU must be driven by the temperature."
        )
    laws = {p.name: p for p in table.parameters if p.law is not None}
    if not laws:
        raise ScenarioError("temperature.group = 'law' needs a parameter with a law; add [parameters.law].")
    cold, warm = _ends(source.input, recordings)
    spread: list[Parameter] = []
    found: list[SearchedLaw] = []
    for parameter in space.parameters:
        own = laws.get(parameter.name)
        if own is None:
            spread.append(parameter)
            continue
        found.append(_law(own, parameter, cold, warm))
        spread += found[-1].unknowns
    return ParameterSpace(tuple(spread), tuple(found))


def _ends(name: str, recordings: Sequence[Recording]) -> tuple[float, float]:
    values = [recording.signals[name] for recording in recordings]
    cold, warm = min(float(np.min(v)) for v in values), max(float(np.max(v)) for v in values)
    if warm - cold < LEAST_SPAN:
        raise ScenarioError(
            f"temperature.group = 'law': {name!r} stays between {cold:.4g} and {warm:.4g} degC; give recordings whose"
            " temperature moves (without smooth = 'mean'), or leave group out."
        )
    return cold, warm


def _law(table: ParameterTable, parameter: Parameter, cold: float, warm: float) -> SearchedLaw:
    key = f"parameters[{table.name}]"
    form = None if table.law is None else table.law.form
    if form not in SEARCHABLE:
        raise ScenarioError(
            f"{key}.law.form: temperature.group = 'law' needs one of {', '.join(SEARCHABLE)}, not {form!r}."
        )
    if table.law_block is None or parameter.variable != f"{table.law_block}.a0":
        raise ScenarioError(
            f"{key}.law_block: temperature.group = 'law' needs the TemperatureLaw block of {parameter.variable!r}."
        )
    if table.per == "recording" or parameter.to_variable(0.0) != 0.0:
        raise ScenarioError(
            f"{key}: a law over temperature is one for all recordings, in a unit that is a multiple of the FMU's."
        )
    return SearchedLaw(parameter, form, table.law_block, cold, warm)
