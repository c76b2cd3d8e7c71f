"""All files of a tuning in its study folder."""

from collections.abc import Callable
from pathlib import Path

from thsa_cosim.report.files import RESULT, write_json
from thsa_cosim.report.page.pictures import write_pictures
from thsa_cosim.report.signal_files import write_signals
from thsa_cosim.report.tune.result import tune_to_dict, write_check_csv, write_pareto_csv, write_start_csv
from thsa_cosim.report.tune.schedule_files import write_schedule
from thsa_cosim.scenario.tune_model import PROFILE
from thsa_cosim.signals import Signals
from thsa_cosim.tune import TuneResult


def write_tune(result: TuneResult, folder: Path, on_file: Callable[[Path], None] | None = None) -> list[Path]:
    """Write result.json, tables, schedule and plots; return what was written, in order."""
    written: list[Path] = []

    def note(path: Path) -> None:
        written.append(path)
        if on_file is not None:
            on_file(path)

    write_json(folder / RESULT, tune_to_dict(result))
    note(folder / RESULT)
    for path in write_responses(result, folder):
        note(path)
    if result.pareto is not None and result.pareto.x.size:
        write_pareto_csv(folder / "pareto.csv", result, result.pareto)
        note(folder / "pareto.csv")
    if result.scenario.start is not None and result.after is not None:
        write_start_csv(folder / "start.csv", result)
        note(folder / "start.csv")
    if result.schedule is not None:
        for path in write_schedule(folder, result.schedule.schedule, result.scenario.title):
            note(path)
        if result.schedule.check is not None:
            write_check_csv(folder / "schedule_check.csv", result, result.schedule)
            note(folder / "schedule_check.csv")
    for path in write_pictures(folder):
        note(path)
    return written


def write_responses(result: TuneResult, folder: Path) -> list[Path]:
    """Write command and responses under every condition: the commanded output in the cost's unit, others in theirs."""
    scenario = result.scenario
    unit = scenario.cost.unit
    others = [n for n in (scenario.metrics.effort, *(r.signal for r in scenario.requirements)) if n]
    units = {axis.name: axis.unit for axis in scenario.axes}
    written: dict[str, Path] = {}
    for k, condition in enumerate(result.conditions):
        command, profile = scenario.command_of(condition), scenario.profile_of(condition)
        label = ", ".join(f"{n} = {v:g} {units[n]}" for n, v in condition.items() if n != PROFILE)
        label = ", ".join(t for t in (profile.recording.name if profile else "", label) if t) or "response"
        if label in written:  # the same condition with a sample of uncertain parameters
            continue
        variants = {
            "command": Signals(
                command.time, {command.output: command.values / scenario.cost.scale}, {command.output: unit}
            )
        }
        for scored in (result.before, *result.compare, result.after):
            signals = None if scored is None or k >= len(scored.signals) else scored.signals[k]
            if scored is not None and signals is not None:
                shown = signals.select(
                    [command.output, *dict.fromkeys(n for n in others if n != command.output)]
                )
                response = shown[command.output] * command.factor / scenario.cost.scale
                variants[scored.name] = shown.with_values({command.output: response}, {command.output: unit})
        written[label] = write_signals(folder, "response", label, variants)
    return list(written.values())
