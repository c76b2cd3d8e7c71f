"""Text tables as they come: dialects, headers, LabVIEW, and sentences for what cannot be used."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from thsa_cosim.errors import InputError, RecordingError, UnitError
from thsa_cosim.recordings import Column, TimeAxis, column_names, load_columns, read_recording

TIME = TimeAxis("t", "s")
COLUMNS = {"v": Column("v", "mm/s")}
UNITS = {"v": "m/s"}
EXPECTED = [0.0015, -0.00225, 1000.0]

DIALECTS = {
    "plain": b"t,v\n0,1.5\n0.1,-2.25\n0.2,1e6\n",
    "semicolon and decimal comma": b"t;v\n0;1,5\n0,1;-2,25\n0,2;1e6\n",
    "tab and decimal comma": b"t\tv\n0\t1,5\n0,1\t-2,25\n0,2\t1E+6\n",
    "tab": b"t\tv\r\n0\t1.5\r\n0.1\t-2.25\r\n0.2\t1000000\r\n",
    "pipe": b"t|v\n0|1.5\n.1|-2.25\n.2|1e6\n",
    "blanks": b"   t      v\n  0    1.5\n 0.1  -2.25\n 0.2   1e6\n",
    "blanks and decimal comma": b"t v\n0 1,5\n0,1 -2,25\n0,2 1e6\n",
    "old Mac line ends": b"t,v\r0,1.5\r0.1,-2.25\r0.2,1e6\r",
    "UTF-8 with BOM": b"\xef\xbb\xbft,v\n0,1.5\n0.1,-2.25\n0.2,1e6\n",
    "UTF-16": "t;v\n0;1,5\n0,1;-2,25\n0,2;1e6\n".encode("utf-16"),
    "Windows-1252": "# gemessen in K\xe4lte, \xb0C\nt,v\n0,1.5\n0.1,-2.25\n0.2,1e6\n".encode("cp1252"),
    "quoted decimal comma in commas": b'"t","v"\n"0","1,5"\n"0,1","-2,25"\n"0,2","1e6"\n',
    "quoted header": b'"t";"v"\n0;1.5\n0.1;-2.25\n0.2;1e6\n',
    "row of units": b"t;v\ns;mm/s\n0;1,5\n0,1;-2,25\n0,2;1e6\n",
    "row of units in brackets": b"t,v\n[s],[mm/s]\n0,1.5\n0.1,-2.25\n0.2,1e6\n",
    "row of units in round brackets": b"t,v\n(s),(mm/s)\n0,1.5\n0.1,-2.25\n0.2,1e6\n",
    "units in the header": b"t [s],v [mm/s]\n0,1.5\n0.1,-2.25\n0.2,1e6\n",
    "units in round brackets": b"t (s);v (mm/s)\n0;1.5\n0.1;-2.25\n0.2;1e6\n",
    "comment lines": b"# rig 3\n# operator X, cold box\nt,v\n0,1.5\n0.1,-2.25\n0.2,1e6\n",
    "commented header": b"# t,v\n0,1.5\n0.1,-2.25\n0.2,1e6\n",
    "commented header and units": b"% t v\n% s mm/s\n0 1.5\n0.1 -2.25\n0.2 1e6\n",
    "title above the header": b"Bench 2; cold box; 2026-11-21\n\nt;v\n0;1.5\n0.1;-2.25\n0.2;1e6\n",
    "key and value lines above": b"Operator;X\nDate;2026\nt;v\n0;1.5\n0.1;-2.25\n0.2;1e6\n0.3;5\n0.4;5\n",
    "trailing delimiter": b"t;v;\n0;1.5;\n0.1;-2.25;\n0.2;1e6;\n",
    "trailing delimiter, short header": b"t;v\n0;1.5;\n0.1;-2.25;\n0.2;1e6;\n",
    "blank lines": b"\n\nt,v\n\n0,1.5\n0.1,-2.25\n\n0.2,1e6\n\n",
    "Excel hint": b"sep=;\r\nt;v\r\n0;1.5\r\n0.1;-2.25\r\n0.2;1e6\r\n",
    "text column": b"t;note;v\n0;start;1.5\n0.1;;-2.25\n0.2;stop;1e6\n",
    "time stamps": b"t;v\n2026-11-21 10:00:00.000;1.5\n2026-11-21 10:00:00.100;-2.25\n2026-11-21 10:00:00.200;1e6\n",
    "clock": b"t;v\n10:59:59.95;1.5\n11:00:00.05;-2.25\n11:00:00.15;1e6\n",
    "spaces after commas": b"t, v\n0, 1.5\n0.1, -2.25\n0.2, 1e6\n",
    "only integers": b"t,v,x\n0,1.5,1\n0.1,-2.25,2\n0.2,1000000,3\n",
}


@pytest.mark.parametrize("dialect", DIALECTS)
def test_dialects(tmp_path, dialect):
    file = tmp_path / "run.csv"
    file.write_bytes(DIALECTS[dialect])
    recording = read_recording(file, COLUMNS, time=TIME, units=UNITS)
    expected = EXPECTED[: len(recording.signals)]
    assert recording.signals["v"][:3] == pytest.approx(expected)
    assert recording.signals.time[:3] == pytest.approx([0.0, 0.1, 0.2])
    assert recording.signals.units == {"v": "m/s"}


def test_units_of_the_file_are_taken_when_the_scenario_gives_none(tmp_path):
    for name in (
        "row of units",
        "row of units in brackets",
        "units in the header",
        "commented header and units",
    ):
        file = tmp_path / f"{name}.csv"
        file.write_bytes(DIALECTS[name])
        found = read_recording(file, {"v": Column("v")}, time=TimeAxis("t"), units=UNITS)
        assert found.signals["v"] == pytest.approx(EXPECTED)


def test_full_header_names_work_too(tmp_path):
    file = tmp_path / "run.csv"
    file.write_bytes(DIALECTS["units in the header"])
    assert column_names(file) == ("t [s]", "v [mm/s]")
    found = read_recording(file, {"v": Column("v [mm/s]")}, time=TimeAxis("t [s]"), units=UNITS)
    assert found.signals["v"] == pytest.approx(EXPECTED)


LVM = """\
LabVIEW Measurement	
Writer_Version	2
Reader_Version	2
Separator	Tab
Decimal_Separator	{mark}
Multi_Headings	No
X_Columns	{columns}
Time_Pref	Relative
Date	2026/11/21
***End_of_Header***	
Channels	2	
Samples	3	3	
Date	2026/11/21	2026/11/21	
Y_Unit_Label	mm/s	A	
X_Dimension	Time	Time	
X0	0,0E+0	0,0E+0	
Delta_X	0,100000	0,100000	
***End_of_Header***		
X_Value	velocity	current	Comment
{rows}
"""  # noqa: W291


@pytest.mark.parametrize(("columns", "mark"), [("One", ","), ("One", "."), ("No", ","), ("No", ".")])
def test_labview_measurement_files(tmp_path, columns, mark):
    rows = [("0,0", "1,5", "0,1"), ("0,1", "-2,25", "0,2"), ("0,2", "1E+6", "0,3")]
    text = "\n".join("\t".join(r if columns == "One" else ("", *r[1:])) for r in rows)
    file = tmp_path / "run.lvm"
    file.write_text(LVM.format(columns=columns, mark=mark, rows=text).replace(",", mark))
    axis = TimeAxis("X_Value") if columns == "One" else TimeAxis()
    found = read_recording(
        file, {"v": Column("velocity"), "i": Column("current")}, time=axis, units={"v": "m/s", "i": "A"}
    )
    assert found.signals["v"] == pytest.approx(EXPECTED)
    assert found.signals["i"] == pytest.approx([0.1, 0.2, 0.3])
    assert found.signals.time == pytest.approx([0.0, 0.1, 0.2])


GOOD = "t;v;w\n" + "".join(f"{k / 10};{k};{k * k}\n" for k in range(30))


@pytest.mark.parametrize(
    ("text", "columns", "message"),
    [
        ("", COLUMNS, "is empty"),
        ("\n\n", COLUMNS, "no table of numbers"),
        ("hello world\n", COLUMNS, "no table of numbers"),
        ("t\n1\n2\n", COLUMNS, "no table of numbers"),
        ("t,v\n", COLUMNS, "no table of numbers"),
        ("\0\1\2", COLUMNS, "binary"),
        (GOOD, {"v": Column("vv", "m/s")}, r"no column 'vv'\. Did you mean 'v'"),
        (GOOD, {"v": Column("speed", "m/s")}, r"no column 'speed'\. The file holds 't', 'v', 'w'"),
        (GOOD.replace("0.5;5;25", "0.5;ERR;25"), COLUMNS, "'v' is not numeric: 'ERR' on line 7"),
        (GOOD.replace("0.5;5;25", "0.5;nan;25"), COLUMNS, r"'v' is nan at 0\.5 s \(sample 6, 1 in all\)"),
        (GOOD.replace("0.5;5;25", "0.5;;25"), COLUMNS, r"'v' is nan at 0\.5 s"),
        (GOOD.replace("0.5;5;25", "0.5;inf;25"), COLUMNS, r"'v' is inf at 0\.5 s"),
        (
            GOOD.replace("0.5;5;25", "0.3;5;25"),
            COLUMNS,
            r"does not increase at sample 6 \(0\.3 s after 0\.4 s\)",
        ),
        (GOOD.replace("0.5;5;25", "0.4;5;25"), COLUMNS, "does not increase at sample 6"),
        (GOOD.replace("0.5;5;25", "nan;5;25"), COLUMNS, "time column 't' is nan at sample 6"),
        (GOOD.replace("0.5;5;25", "0.5;5;25;1;2"), COLUMNS, "line 7 has more cells"),
        ("t;v\n0;1\n", COLUMNS, "holds 1 samples"),
        (GOOD.replace("t;v;w", "t;v;v"), COLUMNS, "'v' fits 2 columns"),
        (GOOD.replace("t;v;w", "t;v [m/s];v [mm/s]"), COLUMNS, "give the full name"),
    ],
)
def test_what_cannot_be_used_is_one_sentence(tmp_path, text, columns, message):
    file = tmp_path / "run.csv"
    file.write_bytes(text.encode())
    with pytest.raises(RecordingError, match=message) as caught:
        read_recording(file, columns, time=TIME, units=UNITS)
    assert str(caught.value).startswith(f"{file}: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("header", "unit", "time_unit", "target", "message"),
    [
        ("t;v", None, "s", "m/s", "'v' states no unit; add unit"),
        ("t;v", "m/s", None, "m/s", "'t' states no unit"),
        ("t;v", "kN", "s", "m/s", "'v' for 'v': unit 'kN' cannot be turned into 'm/s'"),
        ("t;v", "mmm/s", "s", "m/s", "unknown unit 'mmm/s'"),
        ("t;v", "m/s", "m", "m/s", "cannot be turned into 's'"),
        (
            "t [s];v [m/s]",
            "mm/s",
            "s",
            "m/s",
            "is in 'm/s' by the file, but recordings.columns.v.unit says 'mm/s'",
        ),
        ("t [s];v [m/s]", "m/s", "ms", "m/s", "is in 's' by the file, but recordings.time.unit says 'ms'"),
        ("t [s];v [counts/div]", None, "s", "m/s", "unknown unit 'counts/div'"),
    ],
)
def test_wrong_units_are_one_sentence(tmp_path, header, unit, time_unit, target, message):
    file = tmp_path / "run.csv"
    file.write_text(f"{header}\n0;1\n1;2\n2;3\n")
    with pytest.raises(UnitError, match=message) as caught:
        read_recording(file, {"v": Column("v", unit)}, time=TimeAxis("t", time_unit), units={"v": target})
    assert str(file) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_unit_that_is_none_is_overruled_by_the_scenario(tmp_path):
    file = tmp_path / "run.csv"
    file.write_text("t [s];v [counts/div]\n0;1\n1;2\n")
    found = read_recording(file, {"v": Column("v", "mm/s", scale=2.0)}, time=TimeAxis("t"), units=UNITS)
    assert found.signals["v"] == pytest.approx([0.002, 0.004])


def test_missing_file_unknown_ending_and_folder(tmp_path):
    (tmp_path / "run_1.csv").write_text(GOOD)
    (tmp_path / "folder.csv").mkdir()
    for name, message in (
        ("run_l.csv", r"no such file; check the path\. Did you mean 'run_1\.csv'"),
        ("run.xlsx", "'.xlsx' is not a known recording format"),
        ("run", "'' is not a known"),
        ("folder.csv", "cannot be read"),
        ("nul\0.csv", "cannot be read"),
    ):
        with pytest.raises(RecordingError, match=message):
            read_recording(tmp_path / name, COLUMNS, time=TIME, units=UNITS)


NUMBERS = st.floats(-1e9, 1e9).map(lambda x: float(f"{x:.9g}"))


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_written_in_any_dialect_the_numbers_come_back_bit_for_bit(tmp_path_factory, data):
    rows = data.draw(st.lists(st.tuples(NUMBERS, NUMBERS), min_size=2, max_size=12))
    mark = data.draw(st.sampled_from(".,"))
    delimiter = data.draw(st.sampled_from([d for d in ("\t", ";", "|", " ", ",") if d != mark]))
    head = data.draw(
        st.sampled_from(["t{d}a{d}b", "t [s]{d}a [V]{d}b [A]", "# t{d}a{d}b", "t{d}a{d}b\ns{d}V{d}A"])
    )
    if delimiter == " ":
        head = head.replace(" [", "[")
    end = data.draw(st.sampled_from(["\n", "\r\n", "\r"]))
    encoding = data.draw(st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "cp1252"]))
    lines = head.format(d=delimiter).split("\n")
    lines += [
        delimiter.join(repr(x).replace(".", mark) for x in (k * 0.001, *row)) for k, row in enumerate(rows)
    ]
    file = tmp_path_factory.mktemp("csv") / "run.csv"
    file.write_bytes(end.join([*lines, ""]).encode(encoding))
    found = read_recording(
        file, {"a": Column("a", "V"), "b": Column("b", "A")}, time=TIME, units={"a": "V", "b": "A"}
    )
    assert np.array_equal(found.signals["a"], [a for a, _ in rows])
    assert np.array_equal(found.signals["b"], [b for _, b in rows])


@settings(max_examples=200, deadline=None)
@given(st.data())
def test_a_damaged_table_is_a_recording_or_an_input_error(tmp_path_factory, data):
    content = bytearray(GOOD.encode())
    for _ in range(data.draw(st.integers(1, 6))):
        place = data.draw(st.integers(0, len(content) - 1))
        kind = data.draw(st.sampled_from(["replace", "cut", "insert"]))
        if kind == "replace":
            content[place] = data.draw(st.integers(0, 255))
        elif kind == "cut" and len(content) > 20:
            del content[place : place + data.draw(st.integers(1, 30))]
        else:
            content[place:place] = data.draw(st.binary(max_size=8))
    file = tmp_path_factory.mktemp("csv") / "run.csv"
    file.write_bytes(bytes(content))
    try:
        recording = read_recording(file, COLUMNS, time=TIME, units=UNITS)
    except InputError as error:
        sentence = str(error)
    else:
        sentence = ""
        assert np.isfinite(recording.signals["v"]).all()
    assert "\n" not in sentence


@pytest.mark.parametrize(
    "stamps",
    [
        [
            "3/17/2026 11:59:59.50 AM",
            "3/17/2026 12:00:00.00 PM",
            "3/17/2026 12:00:00.50 PM",
            "3/17/2026 1:00:00.00 PM",
        ],
        ["11:59:59.50 am", "12:00:00.00 pm", "12:00:00.50 pm", "1:00:00.00 pm"],
        [
            "17.03.2026 11:59:59,50",
            "17.03.2026 12:00:00,00",
            "17.03.2026 12:00:00,50",
            "17.03.2026 13:00:00,00",
        ],
        [
            "3/17/2026 11:59:59.50 PM",
            "3/18/2026 12:00:00.00 AM",
            "3/18/2026 12:00:00.50 AM",
            "3/18/2026 1:00:00.00 AM",
        ],
    ],
)
def test_dates_with_half_days(tmp_path, stamps):
    file = tmp_path / "us.csv"
    rows = "".join(f"{stamp};{k}\n" for k, stamp in enumerate(stamps))
    file.write_text(f"Date/Time;force [N]\n{rows}")
    found = read_recording(file, {"F": Column("force")}, time=TimeAxis("Date/Time"), units={"F": "N"})
    assert found.signals.time == pytest.approx([0.0, 0.5, 1.0, 3600.5])


def test_a_point_where_the_comma_is_decimal_is_no_guess(tmp_path):
    file = tmp_path / "mixed.csv"
    rows = [f"{k},0;{900 + k},5" for k in range(20)]
    rows[12] = "12,0;1.234"
    file.write_text("\n".join(["t [s];F [N]", *rows]))
    with pytest.raises(RecordingError, match=r"'F' is not numeric: '1\.234' on line 14"):
        read_recording(file, {"F": Column("F")}, time=TimeAxis("t"), units={"F": "N"})


TABLE = "time_s,v_m_s,i_A\n" + "".join(
    f"{k * 1e-3:.3f},{0.1 * k:.2f},{-0.5 + 0.01 * k:.2f}\n" for k in range(60)
)


@pytest.mark.parametrize(
    "content",
    [
        TABLE.encode() + b"\0" * 300,  # the power went
        TABLE.encode("utf-16-le"),  # without its mark
        TABLE.replace("-", "\u2212").encode(),
        (TABLE + "End of data; 60 samples\n").encode(),
        (TABLE + "0.0").encode(),  # a line that was cut off
        "".join(line + ("\r\n", "\n", "\r")[k % 3] for k, line in enumerate(TABLE.splitlines())).encode(),
    ],
    ids=["zeros", "utf-16", "minus", "words", "cut", "line ends"],
)
def test_what_surrounds_a_table_does_not_change_it(tmp_path, content):
    file = tmp_path / "run.csv"
    file.write_bytes(content)
    found = load_columns(file)
    assert found["v_m_s"].values.tolist() == [float(f"{0.1 * k:.2f}") for k in range(60)]
    assert found["i_A"].values.tolist() == [float(f"{-0.5 + 0.01 * k:.2f}") for k in range(60)]


def test_a_second_header_is_refused_with_its_line(tmp_path):
    file = tmp_path / "run.csv"
    file.write_text(TABLE + TABLE)
    with pytest.raises(RecordingError, match="line 62 holds the header again"):
        load_columns(file)


def test_an_angle_that_wraps_is_unwrapped_by_consent(tmp_path):
    file = tmp_path / "run.csv"
    angle = np.arange(400) * 3.0
    rows = "".join(f"{k * 1e-3:.3f},{a:.1f}\n" for k, a in enumerate(np.mod(angle, 360.0)))
    file.write_text("time_s,phi_deg\n" + rows)
    time = TimeAxis("time_s", "s")
    plain = read_recording(file, {"phi": Column("phi_deg", "deg")}, time=time, units={"phi": "rad"})
    found = read_recording(
        file, {"phi": Column("phi_deg", "deg", unwrap=360.0)}, time=time, units={"phi": "rad"}
    )
    assert np.ptp(plain.signals["phi"]) < 2.0 * np.pi
    np.testing.assert_allclose(found.signals["phi"], np.radians(angle), atol=1e-9)
    assert found.repairs == ("phi: unwrapped 3 times by 360 of the file's numbers",)


def test_decimal_signs_that_change_within_a_file_are_refused(tmp_path):
    rows = ["time;speed", *(f"{k / 1000:.3f};{k * 0.5:.2f}" for k in range(100))]
    rows[40:] = [row.replace(".", ",") for row in rows[40:]]
    path = tmp_path / "mixed.csv"
    path.write_text("\n".join(rows))
    with pytest.raises(RecordingError, match=r"row 41 have the decimal sign '\.', those from there on ','"):
        column_names(path)


def test_a_name_over_two_columns_is_not_read_as_the_first(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("t,v,v,t\n0,1,5,0\n1,2,6,1\n2,3,7,2\n")
    columns = load_columns(path)
    assert "twice in the header (columns 2 and 3)" in (columns["v"].problem or "")
    np.testing.assert_array_equal(columns["t"].values, [0.0, 1.0, 2.0])  # the same numbers again


def test_a_last_line_that_lacks_a_cell_was_cut_off(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("t,v,u\n" + "".join(f"{k},{k}.5,7\n" for k in range(20)) + "20,20.")
    assert load_columns(path)["u"].values.size == 20


@pytest.mark.parametrize("number", ["1,234.5", "1.234,5"])
def test_thousands_separators_are_named(tmp_path, number):
    path = tmp_path / "a.csv"
    small = number[2:]
    path.write_text("t;v\n" + "".join(f"{k};{number if k % 9 == 4 else small}\n" for k in range(40)))
    columns = load_columns(path)
    assert columns["t"].values.size == 40
    assert repr(number) in (columns["v"].problem or "")


@pytest.mark.parametrize("dates", [("04/03/2024", "04/04/2024"), ("03/04/2024", "04/04/2024")])
def test_a_day_follows_another_over_midnight_and_no_month(tmp_path, dates):
    path = tmp_path / "a.csv"
    clocks = [
        (dates[0], "23:59:59.500"),
        (dates[0], "23:59:59.750"),
        (dates[1], "00:00:00.000"),
        (dates[1], "00:00:00.250"),
    ]
    path.write_text("t,v\n" + "".join(f"{d} {c},1\n" for d, c in clocks))
    np.testing.assert_allclose(load_columns(path)["t"].values, [0.0, 0.25, 0.5, 0.75])
