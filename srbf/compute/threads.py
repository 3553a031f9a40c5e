"""Threads over all cores: numpy and OpenImageIO release Python's lock while they work."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from functools import cache
from typing import Any


def cores() -> int:
    """Cores that this process may run on."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def each(work: Callable[[int], None], count: int) -> None:
    """Run work(0) … work(count - 1) with one thread per core; raises the first error in that order after all have ended."""
    with ThreadPoolExecutor(cores()) as workers:
        pending = [workers.submit(work, i) for i in range(count)]
    for done in pending:
        done.result()


def one_blas_thread() -> AbstractContextManager[Any]:
    """A context in which numpy's matrix products use the calling thread only; without effect if threadpoolctl is missing."""
    controller = _controller()
    return nullcontext() if controller is None else controller.limit(limits=1, user_api="blas")


@cache
def _controller() -> Any:
    try:
        from threadpoolctl import ThreadpoolController
    except ImportError:
        return None
    return ThreadpoolController()
