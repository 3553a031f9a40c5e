"""Threads over the cores there are: numpy and OpenImageIO let go of Python's lock while they work."""

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
    """work(0) … work(count - 1), a thread a core at them; the first error in their order, once all have ended."""
    with ThreadPoolExecutor(cores()) as workers:
        pending = [workers.submit(work, i) for i in range(count)]
    for done in pending:
        done.result()


def one_blas_thread() -> AbstractContextManager[Any]:
    """While entered, numpy's matrix products keep to the thread that calls them; without threadpoolctl they do as they like."""
    controller = _controller()
    return nullcontext() if controller is None else controller.limit(limits=1, user_api="blas")


@cache
def _controller() -> Any:
    try:
        from threadpoolctl import ThreadpoolController
    except ImportError:
        return None
    return ThreadpoolController()
