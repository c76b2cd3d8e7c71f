"""The exception tree.

::

    ThsaCosimError
    ├── InputError              bad input: exit code 2
    │   ├── ScenarioError       a scenario file: key, value, reference
    │   ├── RecordingError      a measured file: format, column, samples
    │   ├── ParameterError      bounds, scale, names
    │   ├── UnitError           unknown or incompatible unit
    │   ├── FmuError            an archive that is no usable FMU
    │   └── ModelicaError       a model outside the exportable subset
    ├── MissingExtraError       an optional dependency is needed: exit code 2
    ├── MachineError            the machine's fault, not the FMU's: exit code 3
    └── StudyError              the study ran but has no usable result: exit code 3

Every message is one sentence that names the file, the key and the remedy. A simulation that fails is
no exception but an outcome (``thsa_cosim.batch``).
"""

import difflib
import importlib.util
from collections.abc import Iterable
from pathlib import Path


class ThsaCosimError(Exception):
    """Base of every error that the command line turns into one sentence."""

    exit_code = 2


class InputError(ThsaCosimError):
    """Bad input; the message names the file, the key and the remedy."""


class ScenarioError(InputError):
    """A scenario file holds a wrong key, value or reference."""


class RecordingError(InputError):
    """A recording cannot be read or holds unusable samples."""


class ParameterError(InputError):
    """A parameter's name, bounds or scale is wrong."""


class UnitError(InputError):
    """A unit is unknown or has the wrong dimension."""


class FmuError(InputError):
    """An archive is not a usable FMU."""


class ModelicaError(InputError):
    """A Modelica model is outside the exportable subset; the message names the equation or variable."""


class MissingExtraError(ThsaCosimError):
    """A feature needs an optional dependency that is not installed."""

    def __init__(self, feature: str, extra: str) -> None:
        super().__init__(f"{feature} needs an optional part: pip install 'thsa-cosim[{extra}]'.")


class MachineError(ThsaCosimError):
    """The machine is at fault: a disk, the temporary folder, memory, a signal from outside.

    Says nothing about an FMU or its parameters, so nothing may be recorded of the run; the message names
    the place and the remedy, and the same command goes on once that is done.
    """

    exit_code = 3


def require(module: str, feature: str, extra: str) -> None:
    """MissingExtraError, naming ``extra``, unless ``module`` is installed."""
    if importlib.util.find_spec(module) is None:
        raise MissingExtraError(feature, extra)


class StudyError(ThsaCosimError):
    """A study ran but has no usable result."""

    exit_code = 3


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return ``" Did you mean 'x'?"`` for the closest of ``known``, or an empty string; case does not count."""
    spelt = {name.lower(): name for name in known}
    close = difflib.get_close_matches(word.lower(), spelt, n=1, cutoff=0.6)
    return f" Did you mean {spelt[close[0]]!r}?" if close else ""


def did_you_mean_path(path: Path) -> str:
    """Return :func:`did_you_mean` for a file that is not there: about the first part of its path that is not."""
    missing = path
    try:
        while not missing.parent.exists() and missing.parent != missing:
            missing = missing.parent
        names = [p.name for p in missing.parent.iterdir()]
    except (OSError, ValueError):
        return ""
    return did_you_mean(missing.name, names)
