"""Before a study: a first scenario for an FMU and a recording, and what the recordings will determine."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from thsa_cosim.errors import InputError, require

if TYPE_CHECKING:
    import pandas as pd

    from thsa_cosim.scenario import Source


def init(fmu: Path | str, *recordings: Path | str) -> dict[str, Any]:
    """Return a scenario that drives ``fmu`` with ``recordings`` and compares, as ``thsa-cosim init`` writes it.

    Columns are matched to the FMU's inputs and outputs by name, description and unit. The dict goes into
    :func:`simulate` as it is; with ``kind = "identify"`` and ``parameters`` it goes into :func:`identify`. Its paths
    are relative to the working directory.

    Raises
    ------
    InputError
        If the FMU or the first recording cannot be read, or no recording is given.
    """
    import tomllib

    from thsa_cosim.draft import draft_scenario
    from thsa_cosim.system import read_description

    if not recordings:
        raise InputError(f"a scenario for {fmu} needs a recording; give the path of one.")
    draft = draft_scenario(read_description(fmu), [Path(r) for r in recordings], Path("scenario.toml"))
    return tomllib.loads(draft.text)


def sensitivity(scenario: "Source", *, workers: int | None = None) -> "pd.DataFrame":
    """Return what the recordings of ``scenario`` say about each parameter at its start value, before any search.

    Index point and parameter; value, expected stderr (NaN with the reason where it is not determined), unit, and per
    signal the root mean square of its change over its noise for a change by a tenth of the bounds. ``attrs`` holds
    ``confounded``: (point, parameter, parameter, correlation). ``thsa-cosim check SCENARIO --sensitivity`` prints the
    same.

    Raises
    ------
    InputError
        If the scenario identifies nothing, or its start values cannot be simulated.
    """
    require("pandas", "A table", "notebook")
    import pandas as pd

    from thsa_cosim.api.conduct import cores
    from thsa_cosim.identify.sensitivity import sensitivity as computed
    from thsa_cosim.scenario import Executor, Scenario, load

    loaded = load(scenario)
    if not isinstance(loaded, Scenario) or not loaded.points or not len(loaded.parameters):
        raise InputError(f"{loaded.path}: has no recordings to fit or no parameters; add them.")
    points = computed(loaded, Executor(workers=workers or cores()))
    failed = next((point for point in points if point.failure), None)
    if failed is not None:
        raise InputError(
            f"{loaded.path}: the start values cannot be simulated ({failed.failure}); give others."
        )
    rows = [
        {"value": p.value, "stderr": p.stderr, "unit": p.unit, "reason": p.reason, **p.responses}
        for point in points
        for p in point.parameters
    ]
    index = pd.MultiIndex.from_tuples(
        [(point.label, p.name) for point in points for p in point.parameters], names=["point", "parameter"]
    )
    table = pd.DataFrame(rows, index=index)
    table["stderr"] = table["stderr"].astype(float)
    table.attrs = {"confounded": [(point.label, *pair) for point in points for pair in point.confounded]}
    return table
