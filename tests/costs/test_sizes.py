"""Sizes of signals, computed in the worker."""

import pickle
import subprocess
import sys

import numpy as np

from thsa_cosim.costs.sizes import SizesReducer
from thsa_cosim.signals import Signals


def test_sizes_of_signals_in_closed_form() -> None:
    time = np.linspace(0.0, 2.0, 2001)
    signals = Signals(time, {"z": 3.0 * np.sin(2.0 * np.pi * time), "F": np.full(time.size, -2.0)})
    largest, squares, count, travel = SizesReducer(("z", "F"))(signals).reshape(-1, 4).T
    np.testing.assert_allclose(largest, [3.0, 2.0])
    np.testing.assert_allclose(squares / count, [4.5 * 2000 / 2001, 4.0])
    np.testing.assert_allclose(travel, [24.0, 0.0])


def test_a_worker_imports_no_diagnosis_for_it() -> None:
    code = (
        "import sys, pickle; pickle.loads(bytes.fromhex(sys.argv[1]))\n"
        "print(*(name for name in ('thsa_cosim.diagnosis', 'scipy', 'pydantic') if name in sys.modules))"
    )
    sent = pickle.dumps(SizesReducer(("z",))).hex()
    done = subprocess.run([sys.executable, "-c", code, sent], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""
