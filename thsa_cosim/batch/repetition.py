"""Whether an FMU repeats itself in one process: a library that keeps something spoils every run but the first."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from thsa_cosim.batch.handling import largest_change, said
from thsa_cosim.batch.job import Experiment, Job
from thsa_cosim.batch.local import LocalRunner
from thsa_cosim.batch.outcome import Outcome
from thsa_cosim.fmu.probe import changed_parameters
from thsa_cosim.system import read_description

ALONE = 1
"""``recycle_runs`` of a runner that gives every run a separate process."""


@dataclass(frozen=True)
class Repetition:
    """The first of two runs in one process, and what is wrong with the other."""

    first: Outcome
    fault: str = ""
    """What the second run changes that a new process does not; "" if it may share the process."""

    @property
    def limits(self) -> dict[str, int]:
        """Options for a ``LocalRunner`` whose runs are right."""
        return {"recycle_runs": ALONE} if self.fault else {}


def try_repetition(experiment: Experiment, **options: Any) -> Repetition:
    """Run an FMU, then a second time with other start values, and compare that with the same in a new process.

    An FMU that does not repeat itself in a new process either (random numbers) gains nothing from one: no fault.

    Parameters
    ----------
    options
        Of ``LocalRunner``: ``kind``, ``reuse``, ``deadline_s`` and the like.
    """
    plain = replace(experiment, reduce=None, wrapper=None)
    changed = changed_parameters(read_description(plain.fmu))
    return _compare(plain, {n: v for n, v in changed.items() if n not in plain.fixed}, options)


def _compare(plain: Experiment, changed: Mapping[str, float], options: Mapping[str, Any]) -> Repetition:
    with LocalRunner([plain], **options) as runner:
        first, second = runner.run([Job(plain.name), Job(plain.name, changed)])
        if first.signals is None or runner.one_run_per_process:
            return Repetition(first)
    alone = _alone(plain, changed, options) if changed else first
    if alone.signals is None:
        return _compare(plain, {}, options)
    if _same(alone, second) or not _same(alone, _alone(plain, changed, options)):
        return Repetition(first)
    if second.signals is None:
        return Repetition(first, f"a second run in one process fails ({second.status}: {second.reason})")
    changed_by = said(*largest_change(alone.signals.values, second.signals.values))
    return Repetition(first, f"a second run in one process {changed_by}")


def _alone(plain: Experiment, values: Mapping[str, float], options: Mapping[str, Any]) -> Outcome:
    with LocalRunner([plain], **options) as runner:
        return runner.run([Job(plain.name, values)])[0]


def _same(one: Outcome, other: Outcome) -> bool:
    if one.signals is None or other.signals is None:
        return False
    found = other.signals
    return all(np.array_equal(values, found[name]) for name, values in one.signals.values.items())
