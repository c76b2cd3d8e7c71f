"""Recordings in JSON: columns, samples, constants of the file."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from thsa_cosim.errors import RecordingError
from thsa_cosim.recordings import Column, TimeAxis, load_columns, read_recording

SAMPLES = [{"t": 0.01 * k, "q [rad]": 0.1 * k, "on": k < 2} for k in range(4)]


def written(folder: Path, content: Any) -> Path:
    path = folder / "run.json"
    path.write_text(json.dumps(content))
    return path


@pytest.mark.parametrize(
    "content",
    [
        {"kp": 100, "motor": "a servo", "entries": SAMPLES},
        {"kp": 100, **{name: [s[name] for s in SAMPLES] for name in SAMPLES[0]}},
    ],
)
def test_samples_and_columns_hold_the_same(tmp_path: Path, content: Any) -> None:
    columns = {
        "q": Column("q", unit=None),
        "on": Column("on", unit="1"),
        "gain": Column("kp", unit="1"),
    }
    found = read_recording(
        written(tmp_path, content), columns, time=TimeAxis(column="t", unit="s"), units={"q": "mrad"}
    )
    np.testing.assert_allclose(found.signals["q"], [0.0, 100.0, 200.0, 300.0])
    np.testing.assert_array_equal(found.signals["on"], [1.0, 1.0, 0.0, 0.0])
    np.testing.assert_array_equal(found.signals["gain"], np.full(4, 100.0))


def test_a_list_of_samples_is_a_file_and_what_a_sample_lacks_is_missing(tmp_path: Path) -> None:
    found = load_columns(written(tmp_path, [{"t": 0.0, "a": 1.0}, {"t": 1.0}, {"t": 2.0, "a": None}]))
    np.testing.assert_array_equal(found["a"].values, [1.0, np.nan, np.nan])


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ({"t": [0.0, 1.0], "q": [1.0]}, "columns differ in length"),
        ({"a": SAMPLES, "b": SAMPLES}, "holds 2 lists of samples"),
        ([{"t": 0.0, "q": "high"}, {"t": 1.0, "q": "low"}], "column 'q' is not numeric"),
        ({"t": [], "q": []}, "q"),
    ],
)
def test_what_is_no_recording_is_refused(tmp_path: Path, content: Any, says: str) -> None:
    with pytest.raises(RecordingError, match=says):
        read_recording(written(tmp_path, content), {"q": Column("q")}, time=TimeAxis(column="t", unit="s"))
