"""The pictures of a study: what its page draws, as PNG files and for notebooks."""

import importlib.util
import logging
import re
from collections.abc import Mapping
from pathlib import Path

from thsa_cosim.report.folder import read_study
from thsa_cosim.report.identify.parameters import law_figures
from thsa_cosim.report.page.write import figures_of, sections
from thsa_cosim.report.parts.content import Figure
from thsa_cosim.report.signal_files import file_name

FOLDER = "plots"
_log = logging.getLogger(__name__)
_GROUP = re.compile(r"(?<=^fit)-|(?<=^validate)-|(?<=^response)-|(?<=^law)-|(?<=^friction)-|(?<=^schedule)-")
"""Between the group that a figure belongs to and its own name."""


def pictures(folder: Path, details: bool = True) -> Mapping[str, Figure]:
    """The figures of a study's page by name, in its order, with or without those of ``details``.

    InputError for a folder that is no study.
    """
    study = read_study(folder)
    found = figures_of(sections(study), details)
    alone = law_figures(study.whole.result) if study.whole.result is not None else []
    return {**found, **{figure.name: figure for figure in alone}}


def write_pictures(folder: Path) -> list[Path]:
    """Write the figures of the study as ``plots/<name>.png``, but those of details.

    Returns the paths, none without matplotlib.
    """
    if importlib.util.find_spec("matplotlib") is None:
        _log.warning(
            "No PNG files without matplotlib: pip install 'thsa-cosim[notebook]'; the page has every plot."
        )
        return []
    # matplotlib takes half a second to import: not before the study has run.
    from thsa_cosim.report.parts.drawing import save

    return [
        save(figure, folder / FOLDER / f"{file_name(_GROUP.sub('_', name))}.png")
        for name, figure in pictures(folder, details=False).items()
    ]
