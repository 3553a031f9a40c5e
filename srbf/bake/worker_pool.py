"""Several workers on one list of lights, replaced when they die, hang or have rendered many lights; no light is lost by that."""

from __future__ import annotations

import shutil
import threading
from collections import Counter, deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy import ndarray

from srbf.bake.planned_lights import PlannedLight
from srbf.bake.request import RenderRequest
from srbf.bake.worker import Worker, WorkerDiedError
from srbf.errors import BakeError
from srbf.io import files

AHEAD = 2  # requests sent to a worker at once: it renders one while the host writes the other
TRIES = 2  # of a light, before it is given up and reported
OPENING = 3600.0  # seconds that a scene may take to open
FIRST_LIGHT = 3600.0
PATIENCE = 10.0  # times the slowest sample seen so far
LEAST_PATIENCE = 30.0  # seconds


@dataclass(frozen=True)
class Task:
    """One pass of a light: `samples` more of it, by their own `seed`, to what `before` passes gave.

    `squares`: its sum of squares is wanted too. `keep`: keep the sum, since more passes may follow. `denoise`: the response is to be
    denoised.
    """

    light: PlannedLight
    samples: int
    seed: int
    before: int = 0
    squares: bool = False
    keep: bool = False
    denoise: bool = False

    @property
    def request(self) -> RenderRequest:
        """What the worker is asked for."""
        channels = ("denoised",) if self.denoise else self.light.parts
        return RenderRequest(self.light, self.samples, self.seed, self.light.share, channels)


@dataclass(frozen=True)
class Response:
    """What a worker rendered for a task, (H, W, 3) float32; `direct`: its direct light, of an indirect capture.

    `toward`, (H, W, 3 S): the radiance toward S viewers, where asked for.
    """

    whole: ndarray
    direct: ndarray | None
    seconds: float
    toward: ndarray | None = None


@dataclass(frozen=True)
class RemoteResult:
    """What another machine reports of a task: its pass is in the folder, after so many seconds; or the `error` that prevented it."""

    seconds: float
    error: str | None = None


Take = Callable[[Task, Response | RemoteResult], None]


@runtime_checkable
class Renderer(Protocol):
    """Whoever renders a bake's tasks: a `WorkerPool` of this machine, or others."""

    failed: dict[int, str]

    def open(self) -> None: ...

    def stop(self) -> None: ...

    def render(self, tasks: Sequence[Task], take: Take) -> None: ...


@dataclass(frozen=True)
class WorkerPoolSettings:
    """How the work is spread over processes; no setting changes a pixel."""

    workers: int = 1
    lights_per_worker: int = 500  # after which its process is replaced: Blender's memory grows
    worker_timeout: float | None = None  # seconds without an event; None: learned from the lights before


class Patience:
    """How long a light may take: PATIENCE times the slowest so far, per sample."""

    def __init__(self, fixed: float | None) -> None:
        self._fixed = fixed
        self._slowest: float | None = None

    def learn(self, seconds: float, samples: int) -> None:
        self._slowest = max(self._slowest or 0.0, seconds / samples)

    def of(self, samples: int) -> float:
        """Seconds for a light of so many samples."""
        if self._fixed is not None:
            return self._fixed
        return FIRST_LIGHT if self._slowest is None else LEAST_PATIENCE + PATIENCE * self._slowest * samples


class WorkerPool:
    """The workers of one bake, terminated on exit.

    start: makes a worker in a scratch folder. ready: gets every event of a worker, and its scratch folder, until it serves.
    """

    def __init__(
        self,
        settings: WorkerPoolSettings,
        scratch: Path,
        start: Callable[[Path], Worker],
        ready: Callable[[dict[str, Any], Path], None],
        say: Callable[[str], None],
    ) -> None:
        self._settings = settings
        self._start, self._ready, self._say = start, ready, say
        self._slots = [_Slot(scratch / f"worker{i}") for i in range(settings.workers)]
        self._patience = Patience(settings.worker_timeout)
        self._lock = threading.Lock()
        self._waiting: deque[Task] = deque()
        self._deaths: Counter[int] = Counter()
        self._lost_openings = 0  # in a row
        self._stop = False
        self._error: BaseException | None = None
        self.failed: dict[int, str] = {}  # lights given up, and why

    def __enter__(self) -> WorkerPool:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._stop = True
        for slot in self._slots:
            slot.close()

    def open(self) -> None:
        """Start the first worker and wait until it serves."""
        while self._slots[0].worker is None:
            with suppress(WorkerDiedError):
                self._open(self._slots[0])

    def stop(self) -> None:
        """Begin no other light; `render` returns once those begun are done."""
        with self._lock:
            self._stop = True
            self._waiting.clear()

    def render(self, tasks: Sequence[Task], take: Take) -> None:
        """Have every task rendered and pass its result to `take`, in the threads of several workers; lights given up are in `failed`.

        The first error of scene, disk or `take` ends all of it. KeyboardInterrupt lets the lights begun finish, then is raised.
        """
        self._waiting.extend(tasks)
        # Events, not joins: Python 3.11 treats a thread as ended whose join a Ctrl-C interrupts.
        ended = [threading.Event() for _ in self._slots]
        for slot, event in zip(self._slots, ended, strict=True):
            threading.Thread(target=self._serve, args=(slot, take, event), daemon=True).start()
        interrupt: KeyboardInterrupt | None = None
        while True:
            try:
                while not all(event.wait(0.2) for event in ended):
                    pass
                break
            except KeyboardInterrupt as pressed:
                if interrupt is not None:
                    for slot in self._slots:
                        slot.close()
                    raise
                interrupt = pressed
                self._say("finishing the light begun; press again to stop at once")
                self.stop()
        if self._error is not None:
            raise self._error
        if interrupt is not None:
            raise interrupt

    def _serve(self, slot: _Slot, take: Take, ended: threading.Event) -> None:
        try:
            while self._work(slot, take):
                pass
        except BaseException as error:  # noqa: BLE001 - raised again by `render`, in the calling thread
            with self._lock:
                self._error = self._error or error
            self.stop()
        finally:
            ended.set()

    def _work(self, slot: _Slot, take: Take) -> bool:
        """Send requests and take results until the list is empty (False) or the worker is to be replaced (True)."""
        asked: deque[Task] = deque()
        try:
            while True:
                while len(asked) < AHEAD and slot.rendered + len(asked) < self._settings.lights_per_worker:
                    task = self._next()
                    if task is None:
                        break
                    if slot.worker is None:
                        asked.append(task)  # put back if the opening fails
                        self._open(slot)
                        asked.pop()
                    assert slot.worker is not None
                    slot.worker.ask(task.request)
                    asked.append(task)
                if self._stop and len(asked) > 1 and slot.worker is not None:
                    slot.worker.end()  # drops requests not begun
                if not asked:
                    if slot.rendered >= self._settings.lights_per_worker:
                        slot.close()
                        return True
                    return False
                response = self._response(slot, asked[0])
                if response is None:
                    slot.close()
                    return False
                task = asked.popleft()
                self._patience.learn(response.seconds, task.samples)
                take(task, response)
        except WorkerDiedError as error:
            slot.close()
            self._died(asked, error)
            return not self._stop

    def _open(self, slot: _Slot) -> None:
        shutil.rmtree(slot.scratch, ignore_errors=True)
        files.make_folder(slot.scratch)
        slot.worker = self._start(slot.scratch)
        try:
            while (event := slot.worker.event(self._settings.worker_timeout or OPENING)) is not None:
                if event["event"] == "ready":
                    self._lost_openings = 0
                    return
                self._ready(event, slot.scratch)
        except WorkerDiedError as error:
            slot.close()
            self._lost_openings += 1
            if self._lost_openings >= TRIES:
                raise BakeError(f"{error}, before it rendered anything, {TRIES} times in a row") from error
            self._say(f"{error}; tried again")
            raise
        raise BakeError("Blender's worker ended before it was ready")

    def _response(self, slot: _Slot, task: Task) -> Response | None:
        """The next result; None where the worker ended before it began the task."""
        assert slot.worker is not None
        while (event := slot.worker.event(self._patience.of(task.samples))) is not None:
            if event["event"] == "warning":
                self._say(event["message"])
            elif event["event"] == "rendered":
                wanted = task.request.channels
                if event["light"] != task.light.index or set(event["files"]) != set(wanted):
                    raise BakeError(
                        f"expected {', '.join(wanted)} of light {task.light.index} from Blender, "
                        f"found {', '.join(event['files'])} of light {event['light']}"
                    )
                slot.rendered += 1
                images = {name: _taken(slot.scratch / file) for name, file in event["files"].items()}
                return Response(images[wanted[0]], images.get("direct"), event["seconds"], images.get("toward"))
        return None

    def _next(self) -> Task | None:
        with self._lock:
            return self._waiting.popleft() if self._waiting and not self._stop else None

    def _died(self, asked: deque[Task], error: WorkerDiedError) -> None:
        """Try the current light again, or give it up; put those after it back on the list."""
        if not asked:
            raise error
        if self._lost_openings:  # it rendered no light
            with self._lock:
                self._waiting.extendleft(reversed(asked))
            return
        current = asked.popleft()
        with self._lock:
            self._waiting.extendleft(reversed(asked))
            self._deaths[current.light.index] += 1
            again = self._deaths[current.light.index] < TRIES
            if again:
                self._waiting.appendleft(current)
            else:
                self.failed[current.light.index] = str(error)
        what = "tried again" if again else "given up; the other lights are rendered"
        self._say(f"light {current.light.index}: {error}; {what}")


@dataclass
class _Slot:
    scratch: Path
    worker: Worker | None = None
    rendered: int = 0

    def close(self) -> None:
        worker, self.worker, self.rendered = self.worker, None, 0
        if worker is not None:
            worker.close()
        with suppress(OSError):
            shutil.rmtree(self.scratch)


def _taken(path: Path) -> ndarray:
    try:
        array = np.load(path)
    except (OSError, ValueError, EOFError) as error:
        raise WorkerDiedError(f"Blender's process wrote {path.name}, which cannot be read: {error}") from error
    path.unlink()
    return array
