"""What a process does with memory that it has freed."""

import resource
import sys

import numpy as np
import pytest

from thsa_cosim.batch.memory import kept


def faults_of_new_arrays() -> int:
    """Page faults of 50 arrays of 4 MB, one after the other."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(50):
        np.empty(500_000).fill(1.0)
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="glibc's mallopt")
def test_arrays_that_follow_each_other_use_the_same_pages_while_freed_memory_is_kept():
    with kept():
        faults_of_new_arrays()
        few = faults_of_new_arrays()
    many = faults_of_new_arrays()
    assert few < 100
    assert many > 2000, "and afterwards as it was"
