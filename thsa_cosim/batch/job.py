"""What is to be simulated."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from thsa_cosim.signals import FloatArray, Signals

Reducer = Callable[[Signals], FloatArray]
"""Turns the signals of one run into an array (k,), inside the worker; must be picklable."""


@dataclass(frozen=True)
class Experiment:
    """What stays the same over many jobs; sent to each worker once."""

    name: str
    fmu: Path
    inputs: Signals | None
    """Input signals in the FMU's units."""
    outputs: tuple[str, ...]
    """Variables to record."""
    time: FloatArray
    """(n,) s, strictly increasing: communication points and output times."""
    fixed: Mapping[str, float] = field(default_factory=dict)
    """Start values that hold in every job, in the FMU's units; a job's values win over them."""
    tolerance: float | None = None
    """Relative solver tolerance; None: the FMU's default."""
    reduce: Reducer | None = None
    """Applied in the worker, so that signals need not travel; see ``Outcome.reduced``."""


@dataclass(frozen=True)
class Job:
    """One simulation: an experiment by name, and the start values that distinguish it."""

    experiment: str
    values: Mapping[str, float] = field(default_factory=dict)
    keep_signals: bool = False
    """Send the signals back too; without a reducer they always come back."""
