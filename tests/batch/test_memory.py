"""What a process does with memory that it has freed."""

import subprocess
import sys

import pytest

#: Page faults of 50 arrays of 2 MB, one after the other: while freed memory is kept, and afterwards.
SCRIPT = """
import resource
import numpy as np
from thsa_cosim.batch.memory import kept

def faults():
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(50):
        np.empty(250_000).fill(1.0)
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before

with kept():
    faults()
    few = faults()
print(few, faults())
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="glibc's mallopt")
def test_arrays_that_follow_each_other_use_the_same_pages_while_freed_memory_is_kept():
    run = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=True)
    few, many = map(int, run.stdout.split())
    assert few < 1000
    assert many > 10_000, "and afterwards as it was"
