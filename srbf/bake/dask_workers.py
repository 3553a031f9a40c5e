"""Baking by dask: other machines render a bake's lights into the folder that they share with its host, each pass of a light at most once.

Only the host holds the folder, decides what is rendered next, and writes the manifest. A fence file exists while the host runs: without
it a worker that was taken for dead writes nothing more.
"""

from __future__ import annotations

import shutil
import socket
import tempfile
import threading
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any
from uuid import uuid4

import srbf
from srbf.bake import folder
from srbf.bake.accumulation import LATE, Accumulation
from srbf.bake.folder import LOG, SCRATCH, STATE
from srbf.bake.images import CaptureImages
from srbf.bake.job import serving_job
from srbf.bake.light_pass import add_pass
from srbf.bake.settings import BakeSettings
from srbf.bake.worker import Worker
from srbf.bake.worker_pool import TRIES, RemoteResult, Response, Take, Task, WorkerPool, WorkerPoolSettings
from srbf.compute.dask_client import Cluster, ClusterError, scratch_root
from srbf.errors import BakeError
from srbf.io import files

if TYPE_CHECKING:
    from srbf.bake.run import Bake

MOST_LIGHTS = 4  # per dask task: a bake that is stopped waits for those begun
IDLE = 300.0  # seconds without a request after which a machine's Blender is closed
STOP = "stop"  # file in the scratch folder: begin no other light


@dataclass(frozen=True)
class RemoteBake:
    """What another machine needs of a bake. It sees `folder` and `scene` under the same paths; `token` names the host's run."""

    token: str
    scene: Path
    scene_sha256: str
    folder: Path
    settings: BakeSettings
    blender: Path | None
    pool: WorkerPoolSettings
    version: str

    @property
    def fence(self) -> Path:
        return self.folder / SCRATCH / self.token


@dataclass(frozen=True)
class Report:
    """The results of a dask task's lights, by index: committed, or failed and why. Lights in neither are still to be rendered.

    said: lines for the user.
    """

    lights: dict[int, RemoteResult]
    failed: dict[int, str]
    said: list[str]


class DaskWorkerPool:
    """A `WorkerPool` of a dask scheduler's workers, which render lights into the folder. This machine prepares the scene."""

    def __init__(self, address: str, bake: Bake, identity: dict[str, Any], here: WorkerPool, say: Callable[[str], None]) -> None:
        self._cluster = Cluster(address, say)
        self._here, self._say = here, say
        self._bake = RemoteBake(
            uuid4().hex,
            bake.scene.resolve(),
            identity["scene_sha256"],
            bake.folder.resolve(),
            bake.settings,
            bake.blender,
            WorkerPoolSettings(1, bake.pool.lights_per_worker, bake.pool.worker_timeout),
            srbf.__version__,
        )
        self._refused: Counter[int] = Counter()
        self._stop = False
        self.failed: dict[int, str] = {}

    def __enter__(self) -> DaskWorkerPool:
        self._cluster.__enter__()
        self._bake.fence.touch()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._bake.fence.unlink(missing_ok=True)
        self._cluster.everywhere(close_idle, self._bake.token)
        self._cluster.__exit__(kind, error, trace)

    def open(self) -> None:
        """Open the scene on this machine, which prepares it, and close it."""
        with self._here as pool:
            pool.open()

    def stop(self) -> None:
        """Begin no other light; `render` returns once those begun are done."""
        self._stop = True
        with suppress(OSError):
            (self._bake.folder / SCRATCH / STOP).touch()

    def render(self, tasks: Sequence[Task], take: Take) -> None:
        """Have every task rendered and committed, and pass its result to `take`; lights given up are in `failed`.

        KeyboardInterrupt lets the lights begun finish, then is raised.
        """
        size = max(1, min(MOST_LIGHTS, len(tasks) // max(1, 2 * self._cluster.threads)))
        waiting = [list(tasks[i : i + size]) for i in range(0, len(tasks), size)]
        interrupt: KeyboardInterrupt | None = None
        while waiting:
            chunks, waiting = waiting, []
            results = self._cluster.map(render_lights, [(self._bake, chunk) for chunk in chunks], lambda: not self._stop)
            while True:
                try:
                    entry = next(results, None)
                    if entry is None:
                        break
                    waiting += self._taken(chunks[entry[0]], entry[1], take)
                except KeyboardInterrupt as pressed:
                    if interrupt is not None:
                        raise
                    interrupt = pressed
                    self._say("finishing the lights begun; press again to stop at once")
                    self.stop()
                    results = self._cluster.map(render_lights, [], lambda: False)
        if interrupt is not None:
            raise interrupt

    def _taken(self, chunk: list[Task], result: Report | ClusterError, take: Take) -> list[list[Task]]:
        """Pass the results of a chunk to `take`; returns what is to be tried again, in other chunks."""
        if isinstance(result, ClusterError):
            if len(chunk) > 1:  # one light alone may be the cause
                return [[task] for task in chunk]
            index = chunk[0].light.index
            self._say(f"light {index}: {result}; given up, the other lights are rendered")
            self.failed[index] = str(result)
            return []
        for line in result.said:
            self._say(line)
        self.failed |= result.failed
        for task in chunk:
            index = task.light.index
            if index in result.lights:
                take(task, result.lights[index])
            elif index not in result.failed and not self._stop:
                self._refused[index] += 1
                if self._refused[index] >= TRIES:
                    self.failed[index] = f"expected its pass {task.before} in the folder, found none; do all machines see the same folder?"
        return []


class _RemoteWorker:
    """One machine's Blender for one bake, kept between tasks."""

    def __init__(self, bake: RemoteBake) -> None:
        host = socket.gethostname()
        if not bake.fence.is_file():
            raise BakeError(f"expected the capture at {bake.folder} on {host} too, found none; share the folder under one path")
        if srbf.__version__ != bake.version:
            raise BakeError(f"expected srbf {bake.version} on {host}, found {srbf.__version__}; install the same version everywhere")
        if not bake.scene.is_file() or files.sha256_of(bake.scene) != bake.scene_sha256:
            raise BakeError(f"expected the same scene at {bake.scene} on {host}, found {'another' if bake.scene.exists() else 'none'}")
        self._said: list[str] = []
        self._images = CaptureImages(bake.folder, self._said.append)
        if self._images.prepared is None:
            raise BakeError(f"expected {bake.folder} prepared, found it not so on {host}; share the folder under one path")
        self.bake = bake
        self.timer: threading.Timer | None = None
        self._scratch = Path(tempfile.mkdtemp(prefix="srbf-", dir=scratch_root()))
        self._worker_pool = WorkerPool(bake.pool, self._scratch, self._start, self._ready, self._said.append)

    def close(self) -> None:
        self._worker_pool.__exit__(None, None, None)
        shutil.rmtree(self._scratch, ignore_errors=True)

    def render(self, tasks: list[Task]) -> Report:
        """Render and commit the tasks that are not in the folder yet."""
        self._said.clear()
        accumulation = Accumulation(self.bake.folder, [task.light for task in tasks])
        lights: dict[int, RemoteResult] = {}
        due = []
        for task in tasks:
            if accumulation.refresh(task.light, task.before, LATE):
                if accumulation.passes(task.light) == task.before:
                    due.append(task)
                else:
                    lights[task.light.index] = RemoteResult(0.0)

        def take(task: Task, response: Response | RemoteResult) -> None:
            assert isinstance(response, Response)
            try:
                with self._alone(task) as allowed:
                    accumulation.refresh(task.light)
                    if allowed and accumulation.passes(task.light) == task.before:
                        add_pass(self._images, accumulation, task, response)
                    if accumulation.passes(task.light) > task.before:
                        lights[task.light.index] = RemoteResult(response.seconds)
            except BakeError as error:
                lights[task.light.index] = RemoteResult(response.seconds, str(error))

        self._worker_pool.render(due, take)
        failed = {
            task.light.index: self._worker_pool.failed.pop(task.light.index) for task in due if task.light.index in self._worker_pool.failed
        }
        return Report(lights, failed, list(self._said))

    @contextmanager
    def _alone(self, task: Task) -> Iterator[bool]:
        """Hold one light's lock; yields False where another process has it, or the host is gone."""
        if not self.bake.fence.is_file():
            yield False
            return
        lock = folder.locked(self.bake.folder / SCRATCH, f"{task.light.index:04d}.lock", LATE)
        try:
            yield lock is not None and self.bake.fence.is_file()
        finally:
            if lock is not None:
                lock.release()

    def _start(self, scratch: Path) -> Worker:
        job = serving_job(self.bake.scene, self.bake.settings, self._images.prepared, scratch)
        return Worker(job, scratch, self._scratch / LOG, self.bake.blender)

    def _ready(self, event: dict[str, Any], scratch: Path) -> None:
        if event["event"] == "warning":
            self._said.append(event["message"])
        elif event["event"] == "scene":
            began = files.read_json(self.bake.folder / STATE).get("blender")
            if event["blender"] != began:
                raise BakeError(f"expected Blender {began} on {socket.gethostname()}, as on the host, found {event['blender']}")
            self._images.require_receiver(event)


_idle: list[_RemoteWorker] = []  # of this process
_mutex = threading.Lock()


def render_lights(bake: RemoteBake, tasks: list[Task]) -> Report:
    """What a dask worker runs: one pass of some lights, by a Blender that it opens once per bake."""
    if (bake.folder / SCRATCH / STOP).exists():
        return Report({}, {}, [])
    worker = _from_idle(bake) or _RemoteWorker(bake)
    try:
        report = worker.render(tasks)
    except BaseException:
        worker.close()
        raise
    with _mutex:
        worker.timer = threading.Timer(IDLE, close_idle, (bake.token,))
        worker.timer.daemon = True
        worker.timer.start()
        _idle.append(worker)
    return report


def close_idle(token: str) -> None:
    """Close this process's idle Blenders of the bake `token`, and those whose host is gone."""
    with _mutex:
        closing = [worker for worker in _idle if worker.bake.token == token or not worker.bake.fence.is_file()]
        _idle[:] = [worker for worker in _idle if worker not in closing]
    for worker in closing:
        if worker.timer is not None:
            worker.timer.cancel()
        worker.close()


def _from_idle(bake: RemoteBake) -> _RemoteWorker | None:
    with _mutex:
        worker = next((worker for worker in _idle if worker.bake.token == bake.token), None)
        if worker is not None:
            _idle.remove(worker)
            if worker.timer is not None:
                worker.timer.cancel()
    return worker
