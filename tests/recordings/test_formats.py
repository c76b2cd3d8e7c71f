"""Parquet, MAT, TDMS and MF4: the same signals come back, with the units and times that the files state."""

import sys
import tempfile
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from scipy.io import savemat

from thsa_cosim.errors import MissingExtraError, RecordingError, UnitError
from thsa_cosim.recordings import Column, TimeAxis, column_names, read_recording
from thsa_cosim.recordings import parquet as parquet_reader

SHARED = Path(__file__).parents[3] / "shared" / "recordings" / "table4"
TIME = np.arange(200) * 0.01
SPEED = 5.0 * np.sin(3.0 * TIME)
CURRENT = np.cos(TIME)
SLOW_TIME = np.arange(21) * 0.1
SLOW = -30.0 + SLOW_TIME
UNITS = {"v": "m/s", "i_q": "A", "T_amb": "degC"}
SOURCES = {"v": Column("speed", "mm/s"), "i_q": Column("current", "A")}


def check(recording, axis=TIME):
    assert recording.signals.time == pytest.approx(axis - axis[0])
    assert recording.signals["v"] == pytest.approx(np.interp(axis, TIME, SPEED) * 1e-3)
    assert recording.signals["i_q"] == pytest.approx(np.interp(axis, TIME, CURRENT))
    assert recording.signals.units == {n: UNITS[n] for n in recording.signals.names}
    assert len(recording.sha256) == 64


def test_parquet_with_units_in_the_metadata(tmp_path):
    fields = [
        pa.field("time", pa.float64(), metadata={"unit": "ms"}),
        pa.field("speed", pa.float32(), metadata={"unit": "mm/s"}),
        pa.field("current [A]", pa.float64()),
        pa.field("note", pa.string()),
    ]
    table = pa.table([TIME * 1e3, SPEED.astype(np.float32), CURRENT, ["x"] * 200], schema=pa.schema(fields))
    pq.write_table(table, tmp_path / "run.parquet")
    found = read_recording(
        tmp_path / "run.parquet",
        {"v": Column("speed"), "i_q": Column("current")},
        time=TimeAxis("time"),
        units=UNITS,
    )
    check(found)
    # Times that are the same are held once, and so are numbers that nothing was done to.
    assert found.samples["v"].time is found.samples["i_q"].time
    assert found.samples["i_q"].written is found.samples["i_q"].values is found.signals["i_q"]
    assert found.samples["v"].written is not found.samples["v"].values
    with pytest.raises(RecordingError, match="'note' is not numeric but string"):
        read_recording(
            tmp_path / "run.parquet", {"v": Column("note", "m/s")}, time=TimeAxis("time"), units=UNITS
        )
    with pytest.raises(
        UnitError, match=r"is in 'mm/s' by the file, but recordings\.columns\.v\.unit says 'm/s'"
    ):
        read_recording(
            tmp_path / "run.parquet", {"v": Column("speed", "m/s")}, time=TimeAxis("time"), units=UNITS
        )


def test_parquet_time_stamps_integers_decimals_and_nulls(tmp_path):
    stamps = np.datetime64("2026-11-21T10:00:00", "us") + (TIME * 1e6).astype("timedelta64[us]")
    table = pa.table(
        {
            "time": stamps,
            "speed": pa.array(SPEED).cast(pa.decimal128(20, 12)),
            "current": CURRENT,
            "count": np.arange(200),
            "gap": pa.array([None if k == 7 else 1.0 for k in range(200)]),
        }
    )
    pq.write_table(table, tmp_path / "run.parquet")
    check(read_recording(tmp_path / "run.parquet", SOURCES, time=TimeAxis("time"), units=UNITS))
    count = read_recording(tmp_path / "run.parquet", {"n": Column("count")}, time=TimeAxis("time"))
    assert count.signals["n"].tolist() == list(range(200))
    with pytest.raises(RecordingError, match=r"'gap' is nan at 0\.07 s \(sample 8, 1 in all\)"):
        read_recording(tmp_path / "run.parquet", {"n": Column("gap")}, time=TimeAxis("time"))


def parquet(path, **columns):
    pq.write_table(pa.table({name: pa.array(values) for name, values in columns.items()}), path)
    return path


def test_parquet_columns_are_told_apart_by_case_and_files_by_their_literal_names(tmp_path):
    folder = tmp_path / "T=-30"
    folder.mkdir()
    parquet(folder / "run1.parquet", time=TIME, v=CURRENT, V=CURRENT)
    file = parquet(folder / "run[1].parquet", time=TIME, v=SPEED, V=CURRENT)
    found = read_recording(file, {"v": Column("v"), "V": Column("V")}, time=TimeAxis("time", "s"))
    assert found.signals["v"].tolist() == SPEED.tolist()
    assert found.signals["V"].tolist() == CURRENT.tolist()
    assert column_names(file) == ("time", "v", "V")


def test_parquet_durations_zones_dates_and_booleans(tmp_path):
    ms = (TIME * 1e3).round().astype(int)
    instants = [None if k == 3 else int(t) for k, t in enumerate(ms)]
    file = parquet(
        tmp_path / "run.parquet",
        duration=pa.array(ms, pa.duration("ms")),
        zoned=pa.array(instants, pa.timestamp("ms", tz="Europe/Berlin")),
        day=pa.array(np.arange(200), pa.int32()).cast(pa.date32()),
        flag=pa.array([None if k == 5 else k % 2 == 0 for k in range(200)]),
        time_of_day=pa.array(ms, pa.int32()).cast(pa.time32("ms")),
        note=pa.array(["x"] * 200).dictionary_encode(),
        pair=pa.array([[1.0, 2.0]] * 200),
    )
    read = parquet_reader.read(file, lambda names: names)
    assert read["duration"].values == pytest.approx(TIME, abs=1e-12)
    assert read["duration"].unit == read["zoned"].unit == "s"
    assert np.isnan(read["zoned"].values[3])
    assert np.delete(read["zoned"].values, 3) == pytest.approx(np.delete(TIME, 3), abs=1e-12)
    assert read["day"].values[-1] == 199 * 86400.0
    assert np.isnan(read["flag"].values[5])
    assert read["flag"].values[[0, 1]].tolist() == [1.0, 0.0]
    for name in ("time_of_day", "note", "pair"):
        assert read[name].problem.startswith("is not numeric but ")


def test_parquet_whose_arrow_schema_is_damaged_is_refused(tmp_path):
    """Without it a duration would be a number of unknown unit."""
    file = parquet(tmp_path / "run.parquet", time=pa.array([1, 2, 3], pa.duration("ms")), v=[1.0, 2.0, 3.0])
    content = file.read_bytes()
    at = content.index(b"ARROW:schema") + 40
    file.write_bytes(content[:at] + b"\x01\x02" + content[at + 2 :])
    with pytest.raises(RecordingError, match=r"no readable parquet file \(its Arrow schema cannot be read"):
        read_recording(file, {"v": Column("v")}, time=TimeAxis("time", "s"))


def matlab_content():
    return {
        "time": TIME[:, None],
        "speed": SPEED[None, :],
        "current": CURRENT,
        "gain": 35.15,
        "data": np.column_stack([TIME, SPEED, CURRENT]),
        "log": {"t": TIME, "signals": {"speed": SPEED, "current": CURRENT.astype(np.float32)}},
        "text": "hello",
        "count": np.arange(200, dtype=np.int16),
    }


@pytest.mark.parametrize("compressed", [False, True])
def test_matlab_5(tmp_path, compressed):
    file = tmp_path / "run.mat"
    savemat(file, matlab_content(), do_compression=compressed)
    assert {"time", "speed", "data(:,2)", "log.signals.speed", "count"} <= set(column_names(file))
    assert not {"gain", "text"} & set(column_names(file))
    check(read_recording(file, SOURCES, time=TimeAxis("time", "s"), units=UNITS))
    matrix = {"v": Column("data(:,2)", "mm/s"), "i_q": Column("data(:,3)", "A")}
    check(read_recording(file, matrix, time=TimeAxis("data(:,1)", "s"), units=UNITS))
    fields = {"v": Column("log.signals.speed", "mm/s"), "i_q": Column("log.signals.current", "A")}
    check(read_recording(file, fields, time=TimeAxis("log.t", "s"), units=UNITS))


def test_matlab_73(tmp_path):
    h5py = pytest.importorskip("h5py")
    file = tmp_path / "run.mat"
    with h5py.File(file, "w", userblock_size=512) as hdf:
        hdf["time"] = TIME[None, :]
        hdf["speed"] = SPEED[:, None]
        hdf["current"] = CURRENT[None, :]
        hdf["data"] = np.vstack([TIME, SPEED, CURRENT])  # MATLAB's (200, 3), transposed
        hdf["log/speed"] = SPEED[None, :]
        hdf["text"] = np.frombuffer(b"hello", dtype=np.uint8).astype(np.uint16)
        hdf["text"].attrs["MATLAB_class"] = np.bytes_("char")
        hdf["#refs#/a"] = np.arange(5.0)
    with file.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file")
    assert set(column_names(file)) == {
        "time", "speed", "current", "log.speed", *(f"data(:,{k})" for k in (1, 2, 3))
    }  # fmt: skip
    check(read_recording(file, SOURCES, time=TimeAxis("time", "s"), units=UNITS))
    matrix = {"v": Column("data(:,2)", "mm/s"), "i_q": Column("data(:,3)", "A")}
    check(read_recording(file, matrix, time=TimeAxis("data(:,1)", "s"), units=UNITS))


def write_tdms(file):
    nptdms = pytest.importorskip("nptdms")
    wave = {"wf_increment": 0.01, "wf_start_offset": 0.0}
    with nptdms.TdmsWriter(file) as writer:
        writer.write_segment(
            [
                nptdms.ChannelObject("DAQ", "speed", SPEED, properties={"unit_string": "mm/s", **wave}),
                nptdms.ChannelObject(
                    "DAQ", "current", CURRENT, properties={"NI_UnitDescription": "A", **wave}
                ),
                nptdms.ChannelObject("DAQ", "time", TIME, properties={"unit_string": "s"}),
                nptdms.ChannelObject(
                    "Slow", "T", SLOW, properties={"unit_string": "degC", "wf_increment": 0.1}
                ),
                nptdms.ChannelObject("Slow", "speed", SLOW, properties={"wf_increment": 0.1}),
            ]
        )


def test_tdms_with_units_and_waveform_timing(tmp_path):
    file = tmp_path / "run.tdms"
    write_tdms(file)
    own = {"v": Column("DAQ/speed"), "i_q": Column("current")}
    check(read_recording(file, own, units=UNITS))
    check(read_recording(file, own, time=TimeAxis("time"), units=UNITS))
    with pytest.raises(
        RecordingError, match=r"'speed' fits 2 columns \('DAQ/speed', 'Slow/speed'\); give the full"
    ):
        read_recording(file, {"v": Column("speed")}, units=UNITS)
    with pytest.raises(UnitError, match="by the file"):
        read_recording(file, {"v": Column("DAQ/speed", "m/s")}, units=UNITS)
    with pytest.raises(RecordingError, match="'time' has no time of its own"):
        read_recording(file, {"v": Column("time", "s")}, units={})


def test_channels_of_different_rates_share_the_finest_axis_over_their_common_span(tmp_path):
    file = tmp_path / "run.tdms"
    write_tdms(file)
    found = read_recording(
        file,
        {"v": Column("DAQ/speed"), "i_q": Column("current"), "T_amb": Column("T")},
        units=UNITS,
        temperature="T_amb",
    )
    check(found)
    assert found.signals["T_amb"] == pytest.approx(-30.0 + TIME)
    assert found.temperature_degC == pytest.approx(-30.0 + TIME.mean())
    with pytest.raises(RecordingError, match="'T' has 21 samples, but time column 'time' has 200"):
        read_recording(file, {"T_amb": Column("T")}, time=TimeAxis("time"), units=UNITS)


def test_mf4_with_units_and_a_time_axis_per_group(tmp_path):
    asammdf = pytest.importorskip("asammdf")
    file = tmp_path / "run.mf4"
    with asammdf.MDF(version="4.10") as mdf:
        fast = [
            asammdf.Signal(SPEED, TIME + 1.0, unit="mm/s", name="speed"),
            asammdf.Signal(CURRENT, TIME + 1.0, unit="A", name="current"),
        ]
        mdf.append(fast)
        mdf.append(
            [
                asammdf.Signal(SLOW, SLOW_TIME + 1.0, unit="degC", name="T"),
                asammdf.Signal(SLOW, SLOW_TIME + 1.0, unit="A", name="current"),
            ]
        )
        mdf.save(file)
    assert set(column_names(file)) == {"speed", "0/current", "1/current", "T"}
    found = read_recording(
        file,
        {"v": Column("speed"), "i_q": Column("0/current"), "T_amb": Column("T")},
        units=UNITS,
        temperature="T_amb",
    )
    check(found)
    assert found.signals["T_amb"] == pytest.approx(-30.0 + TIME)
    with pytest.raises(UnitError, match="by the file"):
        read_recording(file, {"v": Column("speed", "m/s")}, units=UNITS)


def test_a_reader_that_is_ended_leaves_no_temporary_file(tmp_path, monkeypatch):
    asammdf = pytest.importorskip("asammdf")
    file, temporary = tmp_path / "run.mf4", tmp_path / "temporary"
    temporary.mkdir()
    with asammdf.MDF(version="4.10") as mdf:
        mdf.append([asammdf.Signal(SPEED, TIME, unit="mm/s", name="speed")])
        mdf.save(file)
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    monkeypatch.setenv("TMPDIR", str(temporary))
    with pytest.raises(RecordingError, match="force"):
        read_recording(file, {"F_load": Column("force", "N")}, units=UNITS)
    assert not list(temporary.iterdir())


@pytest.mark.parametrize(("ending", "module"), [("tdms", "nptdms"), ("mf4", "asammdf"), ("mat", "h5py")])
def test_a_missing_extra_names_what_to_install(tmp_path, monkeypatch, ending, module):
    monkeypatch.setitem(sys.modules, module, None)
    file = tmp_path / f"run.{ending}"
    file.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(600))
    with pytest.raises(MissingExtraError, match=r"pip install 'thsa-cosim\[(tdms|mf4|mat73)\]'"):
        read_recording(file, SOURCES, units=UNITS)


@pytest.mark.parametrize("ending", ["csv", "parquet", "mat", "tdms", "mf4", "lvm"])
@pytest.mark.parametrize(
    "content", [b"\x89HDF\r\n\x1a\n" + bytes(600), b"PAR1" * 9, b"\0", bytes(range(256)) * 9, b"MDF "]
)
def test_files_that_are_not_what_their_name_says(tmp_path, ending, content):
    file = tmp_path / f"run.{ending}"
    file.write_bytes(content)
    with pytest.raises(RecordingError) as caught:
        read_recording(file, SOURCES, time=TimeAxis("time", "s"), units=UNITS)
    assert str(caught.value).startswith(f"{file}: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("ending", ["parquet", "mat", "tdms", "mf4"])
def test_a_file_cut_short_is_one_sentence(tmp_path, ending):
    file = tmp_path / f"run.{ending}"
    if ending == "parquet":
        pq.write_table(pa.table({"time": TIME, "speed": SPEED, "current": CURRENT}), file)
    elif ending == "mat":
        savemat(file, matlab_content())
    elif ending == "tdms":
        write_tdms(file)
    else:
        asammdf = pytest.importorskip("asammdf")
        with asammdf.MDF(version="4.10") as mdf:
            mdf.append([asammdf.Signal(SPEED, TIME, unit="mm/s", name="speed")])
            mdf.save(file)
    whole = file.read_bytes()
    for share in (0.1, 0.5, 0.9):
        file.write_bytes(whole[: int(share * len(whole))])
        try:
            read_recording(file, {"v": Column("speed", "mm/s")}, time=TimeAxis("time", "s"), units=UNITS)
        except RecordingError as error:
            message = str(error)
        else:
            message = ""  # what is left may be whole
        assert "\n" not in message


@pytest.mark.skipif(not SHARED.exists(), reason="needs the shared recordings")
def test_the_csv_and_the_tdms_of_the_rig_agree_within_their_quanta():
    names = {"v": ("velocity_mm_s", "velocity_mm", "mm/s"), "i_q": ("q_current_A", "q_current", "A")}
    text = read_recording(
        SHARED / "tuned_at_25.csv",
        {n: Column(c, u) for n, (c, _, u) in names.items()},
        time=TimeAxis("time_s", "s"),
        units=UNITS,
    )
    tdms = read_recording(
        SHARED / "tuned_at_25.tdms", {n: Column(t) for n, (_, t, _) in names.items()}, units=UNITS
    )
    assert np.allclose(text.signals.time, tdms.signals.time, atol=1e-9)
    # Two recordings of the same run with noise of their own.
    assert np.std(text.signals["v"] - tdms.signals["v"]) < 2.1 * 2e-5
    assert np.std(text.signals["i_q"] - tdms.signals["i_q"]) < 2.1 * 0.05
