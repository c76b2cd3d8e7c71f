"""A small healthy study of every kind, and recordings in every format: what is mutated."""

import shutil
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

ROOT = Path(__file__).parents[2]
SHIPPED = ROOT / "scenarios"
FMUS = ("Motor.fmu", "fmi3/Motor.fmu", "THSA.fmu")
QUICK_SEARCH = {"population": 5, "generations": 1}
QUICK_SIMULATION = {"tolerance": 1e-6, "deadline": 3.0}


def motor() -> dict[str, Any]:
    """An identification of two parameters at two temperatures from 0.35 s each."""
    table = tomllib.loads((SHIPPED / "motor.toml").read_text(encoding="utf-8"))
    table["fmu"] = "Motor.fmu"
    table["recordings"]["fit"] = ["motor_m30.csv", "motor_p25.csv"]
    table["parameters"] = table["parameters"][:2]
    for parameter in table["parameters"]:
        parameter["law"]["form"] = "linear"
        parameter["law"]["published"] = parameter["law"]["published"][:2]
    table["search"] |= QUICK_SEARCH
    table["simulation"] |= QUICK_SIMULATION
    return table


def motor_check() -> dict[str, Any]:
    """A simulation of the same bench; also a second stage."""
    table = motor()
    del table["parameters"], table["search"]
    return {**table, "kind": "simulate", "cost": {}, "outputs": ["w_m", "i_q"]}


def stages() -> dict[str, Any]:
    """Both in order."""
    listed = [{"scenario": "motor.toml", "give": ["R_s"]}, {"scenario": "check.toml"}]
    return {"kind": "identify", "title": "stages", "seed": 1, "stages": listed}


def tuning() -> dict[str, Any]:
    """A tuning over two temperatures with everything that a tuning can ask for."""
    table = tomllib.loads((SHIPPED / "schedule.toml").read_text(encoding="utf-8"))
    extra = tomllib.loads((SHIPPED / "table4.toml").read_text(encoding="utf-8"))
    table |= {key: extra[key] for key in ("line", "surface")}
    table["fmu"] = "THSA.fmu"
    table["command"] |= {"stop": 0.5, "step": 0.002}
    table["metrics"]["window"] = [0.4, 0.5]
    table["conditions"]["T_amb"]["values"] = [-30.0, 25.0]
    table["conditions"]["F_load"]["values"] = [55.0]
    table["schedule"]["check"] = {"T_amb": {"from": -30.0, "to": 25.0, "step": 27.5, "unit": "degC"}}
    for requirement in table["requirements"][1:]:  # ten sets of gains hardly hold all of them
        requirement["hard"] = False
    table["requirements"][0]["maximum"] = 0.45
    table["surface"]["points"] = 3
    table["line"]["generations"] = 1
    table["search"] |= QUICK_SEARCH
    table["simulation"] |= QUICK_SIMULATION
    return table


def diagnosis() -> dict[str, Any]:
    """A diagnosis of 1.5 s of the driven actuator that tries two effects."""
    table = tomllib.loads((SHIPPED / "driven.toml").read_text(encoding="utf-8"))
    table["fmu"] = "THSA.fmu"
    table["recordings"] |= {"fit": ["undeclared_fit_1.csv"], "validate": ["undeclared_validate_1.csv"]}
    table["diagnose"] |= {
        "package": str(ROOT / "modelica" / "THSA"),
        "effects": ["windage", "stribeck"],
        "most": 1,
    }
    return table


SCENARIOS = {
    "motor.toml": motor,
    "check.toml": motor_check,
    "stages.toml": stages,
    "tuning.toml": tuning,
    "diagnosis.toml": diagnosis,
}
"""Scenario per file name; the command that runs each follows from its kind."""


def samples(name: str) -> pd.DataFrame:
    """Return 0.35 s of a shipped motor recording, around the first step of speed."""
    frame = pd.read_parquet(SHIPPED / "recordings" / f"{name}.parquet")
    return frame.iloc[650:1000].astype(float).reset_index(drop=True)


def write_material(folder: Path) -> None:
    """Write the FMUs and the recordings that the scenarios name."""
    folder.mkdir(parents=True)
    for fmu in FMUS:
        shutil.copy(ROOT / "fmus" / fmu, folder / fmu.replace("/", "_"))
    for name in ("motor_m30", "motor_p25"):
        samples(name).to_csv(folder / f"{name}.csv", index=False)
    for name in ("undeclared_fit_1", "undeclared_validate_1"):
        driven = pd.read_parquet(SHIPPED / "recordings" / f"{name}.parquet").astype(float)
        driven.iloc[:1500].round(6).to_csv(folder / f"{name}.csv", index=False)


def write_recording(path: Path, frame: pd.DataFrame) -> None:
    """Write ``frame`` in the format of the file's ending (``.v73.mat`` for the HDF5 one)."""
    WRITERS["".join(path.suffixes[-2:]) if path.name.endswith(".v73.mat") else path.suffix](path, frame)


def _csv(path: Path, frame: pd.DataFrame) -> None:
    frame.to_csv(path, index=False)


def _semicolon(path: Path, frame: pd.DataFrame) -> None:
    frame.to_csv(path, index=False, sep=";", decimal=",")


def _lvm(path: Path, frame: pd.DataFrame) -> None:
    head = (
        "LabVIEW Measurement\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\n"
        "Multi_Headings\tNo\nX_Columns\tOne\nTime_Pref\tRelative\n***End_of_Header***\t\n"
        f"Channels\t{frame.shape[1] - 1}\n***End_of_Header***\t\n"
    )
    path.write_text(head + frame.to_csv(index=False, sep="\t"), encoding="utf-8")


def _parquet(path: Path, frame: pd.DataFrame) -> None:
    frame.to_parquet(path, index=False)


def _arrays(frame: pd.DataFrame) -> dict[str, np.ndarray]:
    return {str(c): np.asarray(frame.iloc[:, k]) for k, c in enumerate(frame.columns)}


def _mat(path: Path, frame: pd.DataFrame) -> None:
    from scipy.io import savemat

    savemat(path, _arrays(frame))


def _mat73(path: Path, frame: pd.DataFrame) -> None:
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in _arrays(frame).items():
            file[name] = values.astype(float).reshape(1, -1)
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


def _tdms(path: Path, frame: pd.DataFrame) -> None:
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(path) as writer:
        writer.write_segment(
            [
                ChannelObject("bench", name, values.astype(float), {"wf_increment": 0.001})
                for name, values in _arrays(frame).items()
            ]
        )


def _mf4(path: Path, frame: pd.DataFrame) -> None:
    from asammdf import MDF, Signal

    arrays = _arrays(frame)
    time = next(iter(arrays.values())).astype(float)
    with MDF(version="4.10") as file:
        file.append([Signal(values.astype(float), time, name=name) for name, values in arrays.items()])
        file.save(path, overwrite=True)


WRITERS = {
    ".csv": _csv,
    ".txt": _semicolon,
    ".lvm": _lvm,
    ".parquet": _parquet,
    ".mat": _mat,
    ".v73.mat": _mat73,
    ".tdms": _tdms,
    ".mf4": _mf4,
}
"""One writer per format that ``thsa_cosim.recordings`` reads."""
