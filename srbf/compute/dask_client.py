"""Workers of a dask scheduler on other machines; the only module that imports dask.distributed."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import suppress
from functools import partial
from types import TracebackType
from typing import Any, TypeVar

from srbf.errors import InputError, MissingLibraryError, SrbfError

T = TypeVar("T")
CONNECTING = 10.0  # seconds
AHEAD = 2  # tasks per thread of the cluster that are submitted in advance; the others can still be withdrawn
WORKER_CHECK = 5.0  # seconds between two checks for new or lost workers
POLL = 0.02


class ClusterError(SrbfError, RuntimeError):
    """A scheduler that cannot be reached, or workers that crash on one task."""


class Cluster:
    """The workers of the scheduler at `address`, such as tcp://10.0.0.5:8786; a context manager. The workers need the same srbf."""

    def __init__(self, address: str, say: Callable[[str], None] = lambda line: None) -> None:
        self._address, self._say = address, say
        self._client: Any = None
        self._futures: dict[Any, int] = {}

    def __enter__(self) -> Cluster:
        try:
            from distributed import Client
        except ImportError as error:
            raise MissingLibraryError("`dask` needs dask.distributed: pip install srbf[farm]") from error
        for name in ("distributed", "distributed.client"):
            logging.getLogger(name).setLevel(logging.CRITICAL)  # errors are reported in one line
        try:
            self._client = Client(self._address, timeout=CONNECTING, set_as_default=False)  # type: ignore[no-untyped-call]
        except (OSError, ValueError, TypeError) as error:
            raise ClusterError(f"expected a dask scheduler at {self._address}, found none; start one by: dask scheduler") from error
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._client.cancel(list(self._futures))
        self._client.close()

    @property
    def threads(self) -> int:
        """Number of tasks that run in parallel."""
        return sum(self._client.nthreads().values())

    def everywhere(self, work: Callable[..., object], *args: object) -> None:
        """Run `work` once on every worker that is still connected."""
        with suppress(OSError, TimeoutError):
            self._client.run(work, *args, on_error="ignore")

    def map(
        self, work: Callable[..., T], items: Sequence[tuple], more: Callable[[], bool] = lambda: True
    ) -> Iterator[tuple[int, T | ClusterError]]:
        """(i, work(*items[i])) in order of completion; no task is started after `more` returns False.

        If a worker dies, another repeats its task; after several crashes on one task, a ClusterError is its result. Exceptions of `work`
        propagate.
        """
        begun, told = 0, False
        while True:
            threads, wanted = self._request(lambda: self.threads), more()
            if threads:
                told = False
            elif not wanted:  # the started tasks were lost with their workers
                self._client.cancel(list(self._futures))
                self._futures.clear()
            elif not told and (self._futures or begun < len(items)):
                self._say(f"the scheduler at {self._address} has no workers; waiting for one: dask worker {self._address}")
                told = True
            while begun < len(items) and len(self._futures) < AHEAD * max(1, threads) and wanted:
                self._futures[self._client.submit(work, *items[begun], pure=False)] = begun
                begun += 1
            if not self._futures:
                return
            deadline = time.monotonic() + WORKER_CHECK
            while not (done := [future for future in self._futures if future.done()]) and time.monotonic() < deadline:
                time.sleep(POLL)
            for future in done:
                i = self._futures[future]
                result = self._request(partial(_result, future))
                del self._futures[future]
                yield i, result

    def _request(self, question: Callable[[], T]) -> T:
        """The result of `question`; ClusterError if the scheduler is unreachable."""
        try:
            return question()
        except SrbfError:
            raise
        except (OSError, CancelledError, TimeoutError) as error:
            raise ClusterError(
                f"the scheduler at {self._address} went away; start it and its workers again, then the same command"
            ) from error


def _result(future: Any) -> Any:
    from distributed.scheduler import KilledWorker

    try:
        return future.result()
    except KilledWorker as error:
        return ClusterError(f"{error.allowed_failures + 1} dask workers crashed on it")


def checked(address: str) -> str:
    """A valid dask address; InputError for others."""
    scheme, _, rest = address.partition("://")
    if scheme not in ("tcp", "tls", "ucx", "ws", "wss", "inproc") or not rest:
        raise InputError(f"expected `dask` tcp://SCHEDULER:8786, found {address!r}")
    return address


def scratch_root() -> str:
    """A folder of this machine that dask deletes when a worker ends."""
    from distributed import get_worker

    return str(get_worker().local_directory)
