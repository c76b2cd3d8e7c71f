"""Measured signals: one file format per module, one way to read them all."""

from thsa_cosim.recordings.axis import TimeAxis
from thsa_cosim.recordings.formats import SUFFIXES, column_names, load_columns
from thsa_cosim.recordings.noise import noise_estimate, quantum
from thsa_cosim.recordings.read import read_recording
from thsa_cosim.recordings.recording import Column, Recording, Samples
from thsa_cosim.recordings.repair import Repair
from thsa_cosim.recordings.table import RawColumn, split_unit

__all__ = [
    "SUFFIXES",
    "Column",
    "RawColumn",
    "Recording",
    "Repair",
    "Samples",
    "TimeAxis",
    "column_names",
    "load_columns",
    "noise_estimate",
    "quantum",
    "read_recording",
    "split_unit",
]
