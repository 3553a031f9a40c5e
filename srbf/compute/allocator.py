"""Memory that arrays leave kept for the next ones. The system zeroes every page that it hands out, which takes longer than most sums."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

TRIM_THRESHOLD, MMAP_THRESHOLD, MMAP_MAX = -1, -3, -4  # of mallopt(3)
MOST_MAPS, LARGE = 1 << 16, 1 << 25  # glibc's own, and what its threshold rises to by itself, bytes
_inside, _mutex = [0], threading.Lock()


@contextmanager
def freed_memory_kept() -> Iterator[None]:
    """Inside, large arrays lie in the heap, which is given back at the end. On glibc alone; peak memory is up to a third more."""
    _count(1)
    try:
        yield
    finally:
        _count(-1)


def _count(step: int) -> None:
    with _mutex:
        _inside[0] += step
        if sys.platform == "linux" and _inside[0] == max(step, 0):
            _set(kept=step > 0)


def _set(kept: bool) -> None:
    import ctypes

    library = ctypes.CDLL(None)
    try:
        library.mallopt(MMAP_MAX, 0 if kept else MOST_MAPS)
        library.mallopt(TRIM_THRESHOLD, -1 if kept else 2 * LARGE)
        if not kept:
            library.mallopt(MMAP_THRESHOLD, LARGE)
            library.malloc_trim(0)
    except AttributeError:  # musl has none
        return
