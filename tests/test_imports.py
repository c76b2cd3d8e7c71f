"""What a command imports before it has anything to do: packages that take long wait until they are used."""

import subprocess
import sys

import pytest

SLOW = (
    "casadi",
    "duckdb",
    "matplotlib",
    "numba",
    "pandas",
    "pint",
    "plotly",
    "pyarrow",
    "scipy",
    "thsa_cosim.export",
)


@pytest.mark.parametrize(
    "modules",
    [
        (
            "thsa_cosim.cli",
            "thsa_cosim.api.conduct",
            "thsa_cosim.identify",
            "thsa_cosim.simulate",
            "thsa_cosim.study",
        ),
        ("thsa_cosim.batch.worker", "thsa_cosim.costs", "thsa_cosim.tune.response"),
    ],
    ids=["a command", "a worker"],
)
def test_what_takes_long_to_import_waits_until_it_is_used(modules: tuple[str, ...]) -> None:
    code = f"import sys, {', '.join(modules)}; print(*sorted(set({SLOW!r}) & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_a_worker_does_not_read_the_schema_of_scenarios() -> None:
    code = "import sys, thsa_cosim.batch.worker, thsa_cosim.tune.response; print('pydantic' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
