"""Mutations of a recording: of its samples, of its file, of what stands at its path."""

import os
from pathlib import Path
from random import Random

import numpy as np
import pandas as pd

from fuzzing.material import WRITERS, write_recording
from fuzzing.raw import ODD_NUMBERS, misspell, mutate_bytes, mutate_text


def write_mutated(rng: Random, folder: Path, frame: pd.DataFrame) -> Path:
    """Write a mutated recording under ``folder`` and return its path."""
    ending = rng.choice(tuple(WRITERS))
    path = folder / f"bench{ending}"
    way = rng.randrange(12)
    if way == 0:
        return _strange_file(rng, folder, path)
    try:
        write_recording(path, mutate_samples(rng, frame) if way < 8 else frame)
    except Exception:  # this format cannot hold such samples: the file's bytes are mutated instead
        write_recording(path, frame)
        way = 11
    if way >= 8:
        content = path.read_bytes()
        if ending in (".csv", ".txt", ".lvm") and rng.random() < 0.7:
            separator = {".csv": ",", ".txt": ";", ".lvm": "\t"}[ending]
            text = mutate_text(rng, content.decode(), separator)
            encoding = rng.choice(("utf-8", "utf-8", "utf-8-sig", "utf-16", "utf-16-le", "latin-1", "cp437"))
            content = text.encode(encoding, errors="replace")
        else:
            content = mutate_bytes(rng, content)
        path.write_bytes(content)
    if rng.random() < 0.05:
        path = path.rename(
            folder / f"bench{rng.choice(('.csv', '.mat', '.mf4', '.tdms', '.parquet', '.xlsx', ''))}"
        )
    return path


def mutate_samples(rng: Random, frame: pd.DataFrame) -> pd.DataFrame:
    """Return a copy with odd values, times, types, names or sizes."""
    changed = frame.copy()
    for _ in range(rng.choice((1, 1, 2))):
        if changed.empty:
            break
        k = rng.randrange(changed.shape[1])
        name = changed.columns[k]
        rows = np.array([rng.random() < 0.02 for _ in range(len(changed))])
        match rng.randrange(22):  # from 14 on: what a bench may well record
            case 0:
                changed.isetitem(k, changed.iloc[:, k].where(~rows, np.nan))
            case 1:
                changed.isetitem(k, changed.iloc[:, k].where(~rows, float(rng.choice(ODD_NUMBERS[:-4]))))
            case 2:
                changed.isetitem(k, np.full(len(changed), float(rng.choice(ODD_NUMBERS[:-4]))))
            case 3:
                changed = changed.iloc[: rng.choice((0, 1, 2, 3, 10))]
            case 4:
                changed = changed.drop(columns=name)
            case 5:
                other = rng.choice(list(frame.columns))
                changed = changed.rename(columns={name: rng.choice((misspell(rng, name), other, "", " "))})
            case 6:
                changed.isetitem(k, changed.iloc[:, k].to_numpy()[::-1])
            case 7:
                changed = changed.sample(frac=1.0, random_state=rng.randrange(2**31))
            case 8:
                changed = pd.concat([changed, changed])
            case 9:
                factor = rng.choice((0.0, 1e-12, 1e12, 1e200, -1.0, 1e-320))
                changed.isetitem(k, changed.iloc[:, k].to_numpy() * factor)
            case 10:
                changed.isetitem(k, changed.iloc[:, k].astype(str))
            case 11:
                changed.isetitem(k, changed.iloc[:, k] > 0.0)
            case 12:
                changed.isetitem(k, changed.iloc[:, k].to_numpy() + 1j * rng.random())
            case 13:
                stamps = pd.Timestamp("2026-01-31") + pd.to_timedelta(np.arange(len(changed)), unit="ms")
                changed.isetitem(k, stamps)
            case 14 | 15:
                changed = changed[[rng.random() < 0.8 for _ in range(len(changed))]]
            case 16 | 17:
                changed.isetitem(k, changed.iloc[:, k].to_numpy() * rng.choice((0.1, 0.9, 1.1, 10.0, 1000.0)))
            case 18:
                changed.isetitem(k, np.round(changed.iloc[:, k].to_numpy(), rng.choice((0, 1, -1))))
            case 19:
                changed.isetitem(k, np.clip(changed.iloc[:, k].to_numpy(), -0.1, 0.1))
            case 20:
                noise = [rng.gauss(0.0, 1.0) for _ in range(len(changed))]
                changed.isetitem(k, changed.iloc[:, k].to_numpy() + np.array(noise))
            case 21:
                jitter = [1e-4 * rng.random() for _ in range(len(changed))]
                changed.isetitem(0, changed.iloc[:, 0].to_numpy() + np.array(jitter))
    return changed


def _strange_file(rng: Random, folder: Path, path: Path) -> Path:
    """Put something at ``path`` that is no such file."""
    match rng.randrange(8):
        case 0:
            path.mkdir()
        case 1:
            path.symlink_to(path)
        case 2:
            path.symlink_to(folder / "nowhere")
        case 3:
            os.mkfifo(path)
        case 4:
            path.symlink_to("/dev/zero")
        case 5:
            path.write_bytes(b"")
        case 6:
            path.write_bytes(rng.randbytes(rng.choice((1, 4, 100, 5000))))
        case 7:
            path = folder / rng.choice(
                ("no/such.csv", "a\nb.csv", "x" * 300 + ".csv", "*.csv", "[.csv", "~/b.csv")
            )
    return path
