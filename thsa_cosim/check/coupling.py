"""What a system of FMUs can be trusted with, beyond what holds for one FMU: its parts, its loops, its steps."""

import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from thsa_cosim.batch import Experiment, Job, LocalRunner
from thsa_cosim.batch.handling import largest_change
from thsa_cosim.check.finding import Verdict
from thsa_cosim.check.numerics import STEP_OK, STEP_WARNING, Judged
from thsa_cosim.fmu.native import platform_folders
from thsa_cosim.signals import Signals
from thsa_cosim.system.description import SystemDescription, loops
from thsa_cosim.system.member import own_processes
from thsa_cosim.system.write import write_halved

_NOTES = 3
"""So many notes of an archive are spelled out."""


def system_lines(description: SystemDescription) -> Iterator[tuple[str, Judged]]:
    """Yield (name, line) of what the archive alone shows."""
    parts = description.system.components
    shown = ", ".join(f"{c.name} ({c.execution}{'' if c.step is None else f', {c.step:g} s'})" for c in parts)
    yield "description", (Verdict.OK, f"a system of {len(parts)}: {shown}", {"components": len(parts)})
    here = {*platform_folders("2.0"), *platform_folders("3.0")}
    missing = [c.name for c in parts if not here & set(c.fmu.platforms)]
    lacking = f"no library for this machine in {', '.join(missing)}"
    text = lacking if missing else "every component has a binary for here"
    yield "platform", (Verdict.FAILED if missing else Verdict.OK, text, {})
    if apart := own_processes(description.system):
        listed = "; ".join(f"{name} ({reason})" for name, reason in apart.items())
        yield "own processes", (Verdict.OK, listed, {"components": len(apart)})
    if notes := description.system.notes:
        more = f" (and {len(notes) - _NOTES} more)" if len(notes) > _NOTES else ""
        yield "parameter sets", (Verdict.WARNING, " ".join(notes[:_NOTES]) + more, {"ignored": len(notes)})
    found = loops(description.system)
    text = f"solved at every evaluation: {'; '.join(found)}" if found else "none"
    yield "algebraic loops", (Verdict.WARNING if found else Verdict.OK, text, {"loops": len(found)})


def coupling_line(
    description: SystemDescription,
    experiment: Experiment,
    first: Signals,
    deadline_s: float,
    ends_at: float | None = None,
) -> Judged:
    """Halve the steps of all Co-Simulation components and compare."""
    stepped = [c for c in description.system.components if c.execution == "coupled"]
    if not stepped:
        return Verdict.NOT_TRIED, "no component is coupled by communication steps", {}
    with tempfile.TemporaryDirectory(prefix="thsa-cosim-halved-") as folder:
        halved = write_halved(description, Path(folder) / "halved.ssp")
        with LocalRunner(
            [replace(experiment, fmu=halved)], deadline_s=2.0 * deadline_s, ends_at=ends_at
        ) as runner:
            outcome = runner.run([Job(experiment.name)])[0]
    if not outcome.ok or outcome.signals is None:
        return Verdict.WARNING, f"halved, it fails: {outcome.status}: {outcome.reason}", {}
    change, worst = largest_change(first.values, {n: outcome.signals[n] for n in first.names})
    verdict = Verdict.FAILED
    if change <= STEP_WARNING:
        verdict = Verdict.OK if change <= STEP_OK else Verdict.WARNING
    names = ", ".join(c.name for c in stepped)
    text = f"halving the steps of {names} changes {worst} by {change:.1e} of its range"
    return verdict, text if change else "halving them changes nothing", {"change": change}
