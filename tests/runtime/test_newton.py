"""The linear solver under Newton's method against NumPy, with rows that have to change places."""

import ctypes as ct
import subprocess
from pathlib import Path

import numpy as np
import pytest

from runtime.harness import HERE, RUNTIME, compiler


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ct.CDLL:
    path: Path = tmp_path_factory.mktemp("newton") / "newton.so"
    folders = [f"-I{folder}" for folder in (RUNTIME, HERE, HERE / "linear")]
    subprocess.run(
        [*compiler(), "-shared", "-fPIC", "-O1", *folders, str(RUNTIME / "newton.c"), "-o", str(path), "-lm"],
        check=True,
    )
    return ct.CDLL(str(path))


@pytest.mark.parametrize("n", [1, 2, 3, 5, 9])
def test_linear_equations_are_solved_as_by_numpy(library: ct.CDLL, n: int) -> None:
    random = np.random.default_rng(n)
    for columns in (1, 3):
        for _ in range(20):
            matrix, b = random.normal(size=(n, n)), random.normal(size=(n, columns))
            a, x = np.array(matrix, order="F"), np.array(b, order="F")  # both are overwritten
            pivot = (ct.c_int * n)()
            failed = library.newton_linear(
                n, columns, a.ctypes.data_as(ct.c_void_p), x.ctypes.data_as(ct.c_void_p), pivot
            )
            assert failed == 0
            assert matrix @ x == pytest.approx(b, abs=1e-10 * np.linalg.cond(matrix))


def test_a_singular_matrix_is_said_to_be_singular(library: ct.CDLL) -> None:
    a, x = np.asfortranarray([[1.0, 0.0], [0.0, 0.0]]), np.ones(2)
    assert library.newton_linear(
        2, 1, a.ctypes.data_as(ct.c_void_p), x.ctypes.data_as(ct.c_void_p), (ct.c_int * 2)()
    )
