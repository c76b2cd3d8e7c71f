"""What is read from an FMU file, and what is refused."""

import pickle
import stat
import zipfile
from functools import partial
from pathlib import Path

import pytest
from fmu_sources import build

from thsa_cosim.errors import FmuError
from thsa_cosim.fmu import Plant, read_description
from thsa_cosim.fmu.archive import sha256_of, unpack

ROOT = Path(__file__).parents[2]


def test_fmi2_description_holds_what_the_xml_says() -> None:
    d = read_description(build.lag2())
    assert (d.fmi_version, d.model_name, d.guid, d.tool) == ("2.0", "Lag", "{lag}", "thsa-cosim tests")
    assert d.supports_co_simulation
    assert d.supports_model_exchange
    assert d.capabilities["canInterpolateInputs"] is True
    assert d.platforms == ("linux64",)
    assert [v.name for v in d.inputs] == ["u", "offset", "invert"]
    assert [v.name for v in d.outputs] == ["y", "feed", "steps", "above"]
    assert [v.name for v in d.parameters] == ["tau", "k", "fault", "at"]
    tau = d.variables["tau"]
    assert (tau.unit, tau.start, tau.minimum, tau.type, tau.variability) == ("s", 0.1, 1e-6, "Real", "fixed")
    assert tau.description == "Time constant"
    assert d.variables["invert"].start == 0.0
    assert d.default_experiment.step == 0.01
    assert d.state_references == ((3, 8),)
    assert d.sha256 == sha256_of(build.lag2())


def test_fmi3_description_has_aliases_arrays_and_intermediate_update() -> None:
    d = read_description(build.lag3())
    assert d.fmi_version == "3.0"
    assert d.variables["alias of y"].value_reference == d.variables["y"].value_reference
    assert [v.name for v in d.outputs] == ["y", "feed", "count"]
    assert d.capabilities["providesDirectionalDerivative"] is True
    assert d.variables["vector"].is_array
    assert d.variables["vector[2]"].element == (13, 1, 2)
    assert [v.name for v in d.parameters if v.name.startswith("vector")] == ["vector[1]", "vector[2]"]
    assert d.variables["u"].intermediate_update
    assert not d.variables["single"].intermediate_update
    assert (d.states, d.event_indicators) == (1, 1)
    assert not read_description(build.lag3(updates=False)).variables["u"].intermediate_update


def test_fmi1_description() -> None:
    d = read_description(build.lag1())
    assert d.fmi_version == "1.0"
    assert d.variables["tau"].causality == "parameter"


def test_states_are_named_by_the_variable_that_takes_a_start_value() -> None:
    motor = read_description(ROOT / "fmus/Motor.fmu")
    shared = {v.name for v in motor.variables.values() if v.value_reference == motor.state_references[3][0]}
    assert {"motor.friction.v", "motor.w_m"} <= shared  # one state, several names
    assert motor.state_names[2:] == ("motor.i_q", "motor.w_m", "motor.phi")
    emps = read_description(ROOT / "fmus/EMPS.fmu")
    assert [n for n in emps.state_names if emps.variables[n].takes_start] == [
        "controller.difference.z",
        "controller.hold.z",
    ]
    assert read_description(build.lag2()).state_names == ("y",)
    assert read_description(build.lag1()).state_names == ()  # FMI 1 does not say


def test_description_can_be_pickled() -> None:
    d = read_description(build.lag2())
    assert pickle.loads(pickle.dumps(d)) == d


def test_unknown_variable_gets_a_suggestion() -> None:
    with pytest.raises(FmuError, match=r"no variable 'tua'\. Did you mean 'tau'\?"):
        read_description(build.lag2()).variable("tua")


def _zip(path: Path, **entries: str | bytes) -> Path:
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in entries.items():
            archive.writestr(name.replace("__", "."), content)
    return path


def _broken(path: Path) -> Path:
    data = bytearray(build.lag2().read_bytes())
    at = data.index(b"modelDescription.xml") + 60
    data[at : at + 40] = bytes(40)
    path.write_bytes(bytes(data))
    return path


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda d: d / "missing.fmu", "does not exist"),
        (lambda d: d, "is a folder"),
        (lambda d: (d / "a.fmu").write_text("hello") and d / "a.fmu", "no zip archive"),
        (lambda d: _zip(d / "b.fmu", readme__txt="x"), "without modelDescription.xml"),
        (lambda d: _zip(d / "c.fmu", modelDescription__xml="<fmi"), "cannot be read"),
        (lambda d: _zip(d / "d.fmu", modelDescription__xml="<a/>"), "cannot be read"),
        (
            lambda d: _zip(d / "e.fmu", modelDescription__xml='<fmiModelDescription fmiVersion="9.0"/>'),
            "Unsupported FMI version",
        ),
        (
            lambda d: _zip(
                d / "f.fmu",
                modelDescription__xml='<fmiModelDescription fmiVersion="2.0"><ModelVariables/>'
                "</fmiModelDescription>",
            ),
            "neither Co-Simulation nor Model Exchange",
        ),
        (lambda d: _broken(d / "g.fmu"), "cannot be unpacked"),
    ],
)
def test_bad_files_give_one_sentence(tmp_path: Path, make: object, says: str) -> None:
    path = make(tmp_path)  # type: ignore[operator]
    with pytest.raises(FmuError, match=says) as caught:
        read_description(path)
    text = str(caught.value)
    assert str(path) in text
    assert "\n" not in text
    assert text.endswith((".", "?"))


@pytest.mark.parametrize(
    "name",
    ["../evil.txt", "binaries/../../evil.txt", "/tmp/evil.txt", "..\\evil.txt", "C:/evil.txt", "a/../b"],
)
def test_entries_that_point_outside_are_refused(tmp_path: Path, name: str) -> None:
    target = tmp_path / "deep" / "unpacked"
    xml = build.LAG2.format(guid="{lag}", interpolates="true")
    path = build.write_fmu(tmp_path / "evil.fmu", xml, build.library("lag2.c"), "lag2", {name: b"evil"})
    with pytest.raises(FmuError, match="points outside"):
        unpack(path, target)
    assert not target.exists()
    assert list(tmp_path.rglob("evil.txt")) == []
    with pytest.raises(FmuError, match="points outside"):
        Plant.open(path)


def test_symbolic_links_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "link.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        link = zipfile.ZipInfo("resources/passwd")
        link.external_attr = (stat.S_IFLNK | 0o777) << 16
        archive.writestr(link, "/etc/passwd")
    with pytest.raises(FmuError, match="symbolic link"):
        unpack(path, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_zip_bombs_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("thsa_cosim.fmu.archive.MAXIMUM_UNPACKED_BYTES", 10_000)
    with pytest.raises(FmuError, match="would unpack to"):
        unpack(build.lag2(), tmp_path / "out")


def test_damaged_archive_leaves_no_folder(tmp_path: Path) -> None:
    whole = build.lag2().read_bytes()
    with zipfile.ZipFile(build.lag2()) as archive:
        offset = archive.getinfo("binaries/linux64/lag2.so").header_offset
    damaged = bytearray(whole)
    damaged[offset + 200 : offset + 260] = bytes(60)
    path = tmp_path / "damaged.fmu"
    path.write_bytes(bytes(damaged))
    with pytest.raises(FmuError, match="cannot be unpacked"):
        unpack(path, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_archives_that_unpack_to_much_more_than_they_are_are_refused(tmp_path: Path) -> None:
    """Sizes as an archive states them: nothing of that size is made or read here."""
    path = tmp_path / "bomb.fmu"
    for name, size, says in (
        ("resources/zeros.bin", 3 * 2**30, "would unpack to 3.0 GiB from 0.0 MiB"),
        ("modelDescription.xml", 2 * 2**30 - 1, "modelDescription.xml has 2048 MiB in an archive"),
    ):
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr(name, b"x" * 1000)
            archive.getinfo(name).file_size = size
        refuse = (
            read_description if name == "modelDescription.xml" else partial(unpack, folder=tmp_path / "out")
        )
        with pytest.raises(FmuError, match=says):
            refuse(path)
    assert not (tmp_path / "out").exists()


def test_a_draft_of_the_standard_is_refused_by_its_name(tmp_path: Path) -> None:
    xml = build.LAG3.format(updates="false").replace('fmiVersion="3.0"', 'fmiVersion="3.0-beta.3"')
    path = tmp_path / "draft.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", xml)
    with pytest.raises(FmuError, match=r"made for FMI 3\.0-beta\.3, a draft"):
        read_description(path)


def test_a_description_is_read_again_only_where_the_file_has_changed(tmp_path: Path) -> None:
    path = tmp_path / "lag.fmu"
    path.write_bytes(build.lag2().read_bytes())
    first = read_description(path)
    assert read_description(path) is first
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("documentation/note.txt", "further")
    again = read_description(path)
    assert again is not first
    assert again.sha256 != first.sha256
    assert again.variables == first.variables
