"""What FMUs of other tools insist on, each proven with an FMU made here."""

import subprocess
import zipfile
from pathlib import Path

import numpy as np
import pytest
from fmu_sources import build

from fmu.test_plant import lag
from thsa_cosim.check import check_fmu
from thsa_cosim.fmu import Plant, read_description
from thsa_cosim.signals import Signals

TIME = np.linspace(0.0, 1.0, 101)
WAVE = Signals(TIME, {"u": np.sin(5.0 * TIME)}, {})


@pytest.mark.parametrize("backend", ["python", "compiled"])
def test_an_fmu_that_allows_only_what_the_standard_allows_runs(backend: str) -> None:
    with Plant.open(build.strict2(), backend=backend) as plant:  # type: ignore[arg-type]
        for _ in range(3):
            found = plant.run({"tau": 0.2, "gain": 2.0}, WAVE, ["x", "time"], TIME)
            assert np.max(np.abs(found["x"] - 1.5 * lag(TIME, WAVE["u"], 0.2, 2.0))) < 2e-3
            assert np.array_equal(np.round(found["time"], 9), np.round(TIME, 9))


def test_enumerations_and_booleans_are_parameters() -> None:
    with Plant.open(build.strict2()) as plant:
        plain = plant.run({}, WAVE, ["x"], TIME)
        more = plant.run({"order": 3, "on": 1.0}, WAVE, ["x", "order", "on"], TIME)
    assert more["x"] == pytest.approx(6.0 * plain["x"])
    assert np.all(more["order"] == 3.0)
    assert np.all(more["on"] == 1.0)


def test_an_fmu_of_one_step_size_is_given_even_steps_whatever_the_stamps() -> None:
    stamps = TIME + np.concatenate(([0.0], np.random.default_rng(1).uniform(-3e-3, 3e-3, 99), [0.0]))
    with Plant.open(build.strict2()) as plant:
        even = plant.run({}, WAVE, ["x"], TIME)
        found = plant.run({}, WAVE, ["x"], stamps)
    assert np.array_equal(found.time, stamps)
    assert np.max(np.abs(found["x"] - np.interp(stamps, TIME, even["x"]))) < 1e-9


def test_check_has_no_error_for_it() -> None:
    report = check_fmu(build.strict2())
    assert report.verdict != "failed"
    assert report.reuse == "fresh"


def test_a_folder_with_a_space_is_told_as_a_uri(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "with a space").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "with a space"))
    with Plant.open(build.strict2()) as plant:
        assert "with a space" in str(plant.folder)
        plant.run({}, WAVE, ["x"], TIME)


def test_archives_with_backslashes_are_read(tmp_path: Path) -> None:
    path = tmp_path / "windows.fmu"
    with zipfile.ZipFile(build.lag2()) as source, zipfile.ZipFile(path, "w") as target:
        for name in source.namelist():
            entry = zipfile.ZipInfo("x")
            entry.filename = name.replace("/", "\\")
            target.writestr(entry, source.read(name))
    assert read_description(path).platforms == ("linux64",)
    with Plant.open(path) as plant:
        plant.run({}, WAVE, ["y"], TIME)


def test_a_library_beside_the_fmus_own_is_found(tmp_path: Path) -> None:
    command = build.compiler()
    if command is None:
        pytest.skip("no C compiler")
    helper, main = tmp_path / "libsolver_of_a_tool.so", tmp_path / "needs.so"
    (tmp_path / "helper.c").write_text("double solver_of_a_tool(void) { return 1.0; }")
    (tmp_path / "needs.c").write_text(
        '#include "lag2.c"\ndouble solver_of_a_tool(void);\ndouble used(void) { return solver_of_a_tool(); }\n'
    )
    options = ["-std=gnu11", "-shared", "-fPIC", f"-I{build.headers()}", f"-I{build.SOURCES}"]
    subprocess.run(
        [*command, *options, str(tmp_path / "helper.c"), f"-Wl,-soname,{helper.name}", "-o", str(helper)],
        check=True,
    )
    linked = [str(tmp_path / "needs.c"), str(helper), "-Wl,-soname,needs.so", "-o", str(main), "-lm"]
    subprocess.run([*command, *options, *linked], check=True, cwd=tmp_path)
    xml = build.LAG2.format(guid="{lag}", interpolates="true")
    extra = {"binaries/linux64/libsolver_of_a_tool.so": helper.read_bytes()}
    path = build.write_fmu(tmp_path / "needs.fmu", xml, main, "lag2", extra)
    helper.unlink()
    with Plant.open(path) as plant:
        plant.run({}, WAVE, ["y"], TIME)


def test_a_negated_alias_of_fmi1_has_the_other_sign() -> None:
    time = np.linspace(0.0, 1.0, 51)
    step = Signals(time, {"u": np.ones(51)})
    with Plant.open(build.lag1()) as plant:
        found = plant.run({}, step, ["y", "minus_y"], time)
        assert found["y"][-1] > 0.9
        assert np.array_equal(found["minus_y"], -found["y"])
    with Plant.open(build.exchange1()) as plant:
        found = plant.run({"minus_k": -3.0}, step, ["y", "minus_y"], time)
        assert found["y"][-1] == pytest.approx(3.0, rel=1e-3)
        assert np.array_equal(found["minus_y"], -found["y"])
