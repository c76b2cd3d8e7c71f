"""A system of FMUs is checked as a whole: its parts, its loops, the steps of its coupling."""

from pathlib import Path

from fmu_sources import build

from thsa_cosim.check import CheckReport, Verdict, check_fmu
from thsa_cosim.fmu.description import DefaultExperiment
from thsa_cosim.system.assemble import Part, Wire, assemble
from thsa_cosim.system.write import write_ssp


def checked(folder: Path, step: float | None, *wires: Wire) -> dict[str, tuple[Verdict, str]]:
    execution = None if step is None else "coupled"
    parts = [Part("a", build.lag2(), execution, step), Part("b", build.lag3(), execution, step)]
    system, archives = assemble("pair", parts, wires, {"u": ["a.u"]})
    path = write_ssp(system, archives, folder / "pair.ssp", DefaultExperiment(0.0, 1.0))
    report: CheckReport = check_fmu(path, cycles=2)
    return {finding.name: (finding.verdict, finding.text) for finding in report.findings}


def test_a_sound_system_is_sound(tmp_path: Path) -> None:
    found = checked(tmp_path, None, Wire("a.y", "b.u"))
    assert found["description"] == (Verdict.OK, "a system of 2: a (continuous), b (continuous)")
    assert found["platform"][0] is Verdict.OK
    assert found["algebraic loops"] == (Verdict.OK, "none")
    assert found["runs"][0] is Verdict.OK
    assert found["communication step"][0] is Verdict.NOT_TRIED
    assert found["reset"][0] is Verdict.OK


def test_coarse_coupling_shows_with_its_figure(tmp_path: Path) -> None:
    verdict, text = checked(tmp_path, 0.1, Wire("a.y", "b.u"))["communication step"]
    assert verdict in (Verdict.WARNING, Verdict.FAILED)
    assert "halving the steps of a, b changes" in text
