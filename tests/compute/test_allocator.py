"""Freed memory is kept inside, and given back at the end."""

from __future__ import annotations

import platform

import numpy as np
import pytest

from srbf.compute.allocator import freed_memory_kept

MEGABYTES = 48  # more than glibc's heap takes by itself


def faults(arrays: int) -> int:
    """Pages that the system handed out while so many arrays were made one after the other."""
    import resource

    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(arrays):
        np.ones(MEGABYTES << 17)
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="other allocators keep what they like")
def test_arrays_take_the_place_of_those_before() -> None:
    with freed_memory_kept():
        faults(1)
        with freed_memory_kept():
            pass
        assert faults(4) < 20
    assert faults(4) > 4 * MEGABYTES / 4, "in pages of 2 MiB at most"
