"""Other machines' processes behind a dask scheduler: the only module that imports dask.distributed."""

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
AHEAD = 2  # tasks a thread of the cluster that are handed out at a time: the others can still be withdrawn
LOOK_AROUND = 5.0  # seconds until it is seen that workers came or went
POLL = 0.02


class ClusterError(SrbfError, RuntimeError):
    """A scheduler that cannot be reached, or workers that die over one task."""


class Cluster:
    """The workers of the scheduler at `address`, such as tcp://10.0.0.5:8786, while entered. They need srbf of the same version."""

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
            logging.getLogger(name).setLevel(logging.CRITICAL)  # what goes wrong is told in one line
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
        """Tasks that run at a time."""
        return sum(self._client.nthreads().values())

    def everywhere(self, work: Callable[..., object], *args: object) -> None:
        """Have every worker do it once, those that still answer."""
        with suppress(OSError, TimeoutError):
            self._client.run(work, *args, on_error="ignore")

    def map(
        self, work: Callable[..., T], items: Sequence[tuple], more: Callable[[], bool] = lambda: True
    ) -> Iterator[tuple[int, T | ClusterError]]:
        """(i, work(*items[i])) in the order in which they come; nothing new is begun once `more` says no.

        A task whose worker dies is begun anew by another; a ClusterError takes the result's place where workers die of it several times
        over. What `work` raises is raised.
        """
        begun, told = 0, False
        while True:
            threads, wanted = self._asked(lambda: self.threads), more()
            if threads:
                told = False
            elif not wanted:  # what was begun has died with its workers
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
            deadline = time.monotonic() + LOOK_AROUND
            while not (done := [future for future in self._futures if future.done()]) and time.monotonic() < deadline:
                time.sleep(POLL)
            for future in done:
                i = self._futures[future]
                result = self._asked(partial(_result, future))
                del self._futures[future]
                yield i, result

    def _asked(self, question: Callable[[], T]) -> T:
        """Its answer; ClusterError where the scheduler is gone."""
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
        return ClusterError(f"{error.allowed_failures + 1} dask workers died over it")


def checked(address: str) -> str:
    """An address as dask knows them; InputError on anything else."""
    scheme, _, rest = address.partition("://")
    if scheme not in ("tcp", "tls", "ucx", "ws", "wss", "inproc") or not rest:
        raise InputError(f"expected `dask` tcp://SCHEDULER:8786, found {address!r}")
    return address


def scratch_root() -> str:
    """A folder of this machine that dask empties after a worker, however that ends."""
    from distributed import get_worker

    return str(get_worker().local_directory)
