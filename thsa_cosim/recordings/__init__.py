"""Measured signals: one file format per module, one way to read them all."""

from thsa_cosim.recordings.axis import TimeAxis
from thsa_cosim.recordings.noise import noise_estimate, quantum
from thsa_cosim.recordings.recording import (
    SUFFIXES,
    Column,
    Recording,
    column_names,
    read_recording,
)

__all__ = [
    "SUFFIXES",
    "Column",
    "Recording",
    "TimeAxis",
    "column_names",
    "noise_estimate",
    "quantum",
    "read_recording",
]
