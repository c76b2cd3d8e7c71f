"""What is to be simulated."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from thsa_cosim.signals import FloatArray, Signals

Reducer = Callable[[Signals], NDArray[np.floating[Any]]]
"""Turns the signals of one run into an array (k,), inside the worker; must be picklable."""


class PlantRun(Protocol):
    """``Plant.run``: one simulation of the FMU itself."""

    def __call__(
        self,
        values: Mapping[str, float],
        inputs: Signals | None,
        outputs: Sequence[str],
        time: FloatArray,
        *,
        tolerance: float | None = None,
        once: bool = False,
    ) -> Signals:
        """Simulate once; ``once``: these inputs will not come again, so that nothing is kept of them."""
        ...


class Wrapper(Protocol):
    """Something around an FMU's inputs and outputs that has parameters of its own; must be picklable."""

    @property
    def parameters(self) -> Mapping[str, float]:
        """Its own parameters by name, with their start values."""
        ...

    def run(
        self,
        plant_run: PlantRun,
        values: Mapping[str, float],
        inputs: Signals | None,
        outputs: Sequence[str],
        time: FloatArray,
        tolerance: float | None,
    ) -> Signals:
        """Simulate the FMU inside, as often as it takes; ``values`` are the FMU's and its own."""
        ...


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
    most_steps: int | None = None
    """Attempts at a step that the solver of an FMU of ours may take; None: as many as it wants. A wrapper's are not
    counted."""
    reduce: Reducer | None = None
    """Applied in the worker, so that signals need not travel; see ``Outcome.reduced``."""
    input_mode: str | None = None
    """How linear inputs are given in Co-Simulation (``fmu.inputs.MODES``); None: as trusted without a trial."""
    texts: Mapping[str, str] = field(default_factory=dict)
    """Start values of the FMU's String parameters and inputs."""
    wrapper: Wrapper | None = None
    """Runs the FMU in place of a plain simulation; jobs may set its parameters like those of the FMU."""

    @property
    def wrapper_names(self) -> frozenset[str]:
        """Names of start values that belong to the wrapper and not to the FMU."""
        return frozenset(() if self.wrapper is None else self.wrapper.parameters)


@dataclass(frozen=True)
class Job:
    """One simulation: an experiment by name, and the start values that distinguish it."""

    experiment: str
    values: Mapping[str, float] = field(default_factory=dict)
    keep_signals: bool = False
    """Send the signals back too; without a reducer they always come back."""
