"""Baking a capture pass by pass, with a running sum per light; the folder is a valid capture from the first pass on."""

from __future__ import annotations

import shutil
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy import ndarray

from srbf.bake import folder, stopping
from srbf.bake.accumulation import ACCUMULATION, LATE, Accumulation
from srbf.bake.checks import FIRST_LIGHTS, FirstLights, bytes_needed, check_disk
from srbf.bake.folder import LOG, SCRATCH, STATE
from srbf.bake.images import CaptureImages
from srbf.bake.job import serving_job
from srbf.bake.light_pass import add_pass
from srbf.bake.light_set_files import trace_operator, write_light_set, write_probes
from srbf.bake.light_sets import NamedSet
from srbf.bake.manifest import capture_manifest
from srbf.bake.planned_lights import PlannedLight, noise_seed
from srbf.bake.schedule import FIRST_SAMPLES, TESTED_GROWTH, next_samples, render_order
from srbf.bake.settings import BakeSettings, plan_lights
from srbf.bake.shard import Shard
from srbf.bake.worker import Worker
from srbf.bake.worker_pool import RemoteResult, Renderer, Response, Task, WorkerPool, WorkerPoolSettings
from srbf.capture import Capture
from srbf.captured_light import ROLES, Role
from srbf.errors import BakeError, InputError
from srbf.io import files
from srbf.receiver_images import MANIFEST

if TYPE_CHECKING:
    from srbf.bake.dask_workers import DaskWorkerPool

CURVE = "curve.json"  # in the accumulation folder: what `samples=auto` measured


def require_scene(scene: Path) -> None:
    """InputError where there is no .blend at `scene`."""
    if not scene.is_file():
        found = "a folder" if scene.is_dir() else "no such file"
        raise InputError(f"expected a .blend at {scene}, found {found}")


@dataclass
class Reporter:
    """Receives a bake's progress, in samples or seconds (done, total, text), and lines for the user."""

    progress: Callable[[float, float, str], None] = lambda done, total, what: None
    say: Callable[[str], None] = lambda line: None


@dataclass(frozen=True)
class Bake:
    """One bake of a scene into a folder; `run` starts or resumes it.

    Parameters
    ----------
    scene
        A .blend, which is not changed.
    folder
        Becomes the capture.
    settings
        All that affects its pixels.
    blender
        An installed Blender's executable; None: the bpy module of this Python.
    pool
        The workers of this machine.
    time_limit
        Seconds after which no further light is begun; None: no limit.
    keep_accumulation
        Keep the accumulation folder of a finished bake, so that samples can be added later.
    dask
        Address of a scheduler whose workers render, instead of `pool`.
    roles
        Lights of these alone, and what needs no light; another run adds the others.

    Raises
    ------
    InputError
        On a `time_limit` with denoising.

    Examples
    --------
    >>> from srbf.bake.run import Bake
    >>> from srbf.bake.settings import BakeSettings, Receiver
    >>> settings = BakeSettings(Receiver.parse("view"), width=64, height=64, samples="auto")
    >>> bake = Bake(folder / "scene.blend", folder / "baked", settings)
    >>> bake.is_open_ended
    True
    """

    scene: Path
    folder: Path
    settings: BakeSettings
    blender: Path | None = None
    pool: WorkerPoolSettings = field(default_factory=WorkerPoolSettings)
    time_limit: float | None = None
    keep_accumulation: bool = False
    dask: str | None = None
    roles: tuple[Role, ...] = ROLES

    def __post_init__(self) -> None:
        if self.time_limit is not None and self.settings.denoise:
            raise InputError("expected a fixed number of `samples` with `denoise`, found `time_limit`; leave one of them out")

    @property
    def is_open_ended(self) -> bool:
        """Whether the number of samples is found while baking."""
        return self.settings.samples == "auto" or self.time_limit is not None

    @property
    def keeps_accumulation(self) -> bool:
        """Whether more samples can be added once it is done."""
        return self.keep_accumulation or self.is_open_ended

    def run(self, reporter: Reporter, force: bool = False, restart: bool = False, shard: Shard | None = None) -> bool:
        """Bake what is not there yet. A bake killed at any moment is resumed when run again.

        Finished passes of lights are kept, and every image and the manifest are bit-identical to those of an uninterrupted bake.

        Parameters
        ----------
        reporter
            Receives the progress, and lines for the user.
        force
            Replace a finished capture.
        restart
            Discard an unfinished bake of other settings.
        shard
            Only its lights, while other shards may be baked at the same time; no manifest is written before a bake without a shard.

        Returns
        -------
        bool
            False where nothing was left to do.

        Raises
        ------
        BakeError
            Where Blender fails, a light cannot be rendered, or another process bakes into the folder.
        OutputExistsError
            Where the folder holds something else.
        InputError
            Where there is no scene, and where the arguments exclude each other.

        Examples
        --------
        >>> from srbf.bake.run import Bake, Reporter
        >>> from srbf.bake.settings import BakeSettings, Receiver
        >>> Bake(folder / "scene.blend", folder / "baked", BakeSettings(Receiver.parse("view"))).run(Reporter())
        Traceback (most recent call last):
        srbf.errors.InputError: expected a .blend at ..., found no such file
        """
        identity = self._identity()
        existed = self.folder.exists()
        if shard is not None and self.is_open_ended:
            raise InputError("expected a fixed number of `samples` with `shard`, found `samples=auto` or `time_limit`")
        if shard is not None and not shard.is_preparation:
            return self._run_beside(shard, identity, reporter)
        with folder.hold(self.folder):
            try:
                if folder.is_finished(self.folder, identity, force, restart):
                    return False
                folder.sweep(self.folder)
                apart = ["direct"] if self.settings.transport == "indirect" else []
                for name in (ACCUMULATION, "lights", *apart, *([] if self.settings.harmonics is None else ["harmonics"])):
                    files.make_folder(self.folder / name)
                files.make_folder(self.folder / SCRATCH)
                _Passes(self, identity, reporter, shard).run()
                return True
            except KeyboardInterrupt:
                if (self.folder / STATE).is_file():
                    reporter.say(f"stopped; finished lights are kept, the same command resumes {self.folder}")
                raise
            finally:
                shutil.rmtree(self.folder / SCRATCH, ignore_errors=True)
                if not (existed or (self.folder / STATE).exists() or (self.folder / MANIFEST).exists()):
                    shutil.rmtree(self.folder, ignore_errors=True)  # Blender rendered nothing yet

    def _run_beside(self, shard: Shard, identity: dict[str, Any], reporter: Reporter) -> bool:
        with folder.hold_shard(self.folder, shard):
            if folder.is_past_shards(self.folder, identity):
                return False
            try:
                files.make_folder(self.folder / SCRATCH / shard.scratch)
                _Passes(self, identity, reporter, shard).run()
                return True
            finally:
                shutil.rmtree(self.folder / SCRATCH / shard.scratch, ignore_errors=True)
                with suppress(OSError):  # other shards use it
                    (self.folder / SCRATCH).rmdir()

    def check_scene(self) -> None:
        """InputError where there is no scene to bake."""
        require_scene(self.scene)

    def _identity(self) -> dict[str, Any]:
        self.check_scene()
        return {"scene": self.scene.name, "scene_sha256": files.sha256_of(self.scene), "settings": self.settings.record()}


class _Passes:
    """One run of a bake, in a folder that it holds."""

    def __init__(self, bake: Bake, identity: dict[str, Any], reporter: Reporter, shard: Shard | None = None) -> None:
        self._bake, self._identity, self._reporter, self._shard = bake, identity, reporter, shard
        self._folder, self._settings = bake.folder, bake.settings
        self._lights = plan_lights(bake.settings)
        self._order = [light for light in render_order(self._lights) if light.role in bake.roles]
        self._scratch = self._folder / SCRATCH
        # Named lights may each light a room of their own: their first ones do not tell whether any reaches the receiver.
        judged = 0 if isinstance(self._settings.light_set, NamedSet) else len(self._lights)
        if shard is not None:
            self._order = shard.of(self._order)
            self._lights = sorted(self._order, key=lambda light: light.index)
            self._scratch /= shard.scratch
            judged = len(self._lights) if judged and len(self._lights) >= FIRST_LIGHTS else 0
        self._images = CaptureImages(bake.folder, reporter.say)
        self._accumulation = Accumulation(bake.folder, self._lights)
        self._auto = bake.settings.samples == "auto"
        self._keep = bake.keeps_accumulation
        self._goal = 1 if self._auto else int(bake.settings.samples)
        self._first = FirstLights(judged, bake.settings.receiver.place, reporter.say)
        self._settled = not self._auto  # whether the number of samples of the train lights is final
        self._curve: list[stopping.Measure] = []
        self._measured: dict[int, stopping.Measure] = {}  # by samples, in this run or before
        self._sampling: dict[str, Any] = {}
        self._transmittances: dict[str, Any] | None = None
        self._facts: dict[str, Any] | None = None
        self._failed: dict[int, str] = {}
        self._said: set[str] = set()
        self._traced: dict[str, Any] = {}  # keys of the manifest that only traced rays tell
        self._started = time.monotonic()
        self._mutex = threading.Lock()

    def run(self) -> None:
        new = [light for light in self._lights if not (self._folder / light.file).is_file()]
        summed = [light for light in new if self._is_summed(light)]
        check_disk(self._folder, bytes_needed(self._settings, *(sum(light.part for light in some) for some in (new, summed))))
        with self._renderer() as pool, self._alarm(pool):
            if self._images.prepared is None:
                if self._shard is not None and not self._shard.is_preparation:
                    raise BakeError(f"expected {self._folder} prepared, found it damaged; run `shard=prepare` again")
                self._reporter.progress(0, 1, "opening the scene")
                pool.open()
                assert self._facts is not None
                self._images.prepare(self._facts, self._sampling, self._transmittances)
            else:
                self._record(self._images.prepared["facts"]["blender"])
            self._check_lights()
            write_light_set(self._folder, self._settings, self._identity)
            write_probes(self._folder, self._settings)
            if self._shard is None or self._shard.is_preparation:
                assert self._images.prepared is not None
                manifest = capture_manifest(self._settings, self._identity, self._images.prepared, [], 0, [])
                receivers = Capture(self._folder, manifest, ())
                self._traced = trace_operator(receivers, self._settings, self._reporter.progress, self._reporter.say)
            try:
                self._passes(pool)
            except KeyboardInterrupt:
                self._write_manifest()
                raise
        self._finish()

    def _renderer(self) -> WorkerPool | DaskWorkerPool:
        pool = WorkerPool(self._bake.pool, self._scratch, self._start, self._ready, self._reporter.say)
        if self._bake.dask is None:
            return pool
        from srbf.bake.dask_workers import DaskWorkerPool
        from srbf.compute.dask_client import checked

        return DaskWorkerPool(checked(self._bake.dask), self._bake, self._identity, pool, self._say_once)

    def _passes(self, pool: Renderer) -> None:
        while not self._is_time_up():
            tasks = self._tasks()
            if tasks:
                pool.render(tasks, self._take)
                self._failed |= pool.failed
                self._write_manifest()
            elif self._settled:
                return
            elif self._is_enough():
                self._settled = True  # the validation and holdout lights may need more samples
            else:
                self._goal *= 2

    def _finish(self) -> None:
        self._write_manifest()
        if self._bake.dask is not None:
            folder.sweep(self._folder)  # of machines that died while they wrote
        self._log(f"stopped after {time.monotonic() - self._started:.1f} s")
        if self._failed:
            index, reason = next(iter(self._failed.items()))
            raise BakeError(
                f"{len(self._failed)} of {len(self._lights)} lights could not be rendered, among them light {index}: {reason}; "
                f"the others are in {self._folder}, and the same command tries the failed ones again"
            )
        if self._is_time_up() and (self._tasks() or not self._settled):
            reached = [self._accumulation.samples(light) for light in self._lights if light.role == "train"]
            self._reporter.say(stopping.time_is_up(reached))
            return
        if self._shard is not None or len(self._order) < len(self._lights):
            return
        if self._lights and not self._first.lit and all(float(self._images.published(light).max()) <= 0 for light in self._lights):
            raise self._first.black(len(self._lights))  # rendered by shards of too few lights each to check
        if self._keep:
            (self._folder / STATE).unlink()
            return
        folder.tidy(self._folder)

    def _check_lights(self) -> None:
        """Write lights with missing or damaged images again, or drop them; drop those that need more samples and cannot get them."""
        for light in self._lights:
            if self._accumulation.passes(light) == 0:
                continue
            if self._images.checksum(light) != self._accumulation.checksum(light):
                total = self._accumulation.read(light)
                if total.whole is None:
                    self._accumulation.forget(light)
                else:
                    self._images.publish(light, self._images.own_light(light, total.mean), total.direct_mean, total.harmonics_mean)
            if self._needs_squares(light) and self._accumulation.read(light).squares is None:
                self._accumulation.forget(light)
            if self._accumulation.samples(light) < self._goal_of(light) and not self._accumulation.can_grow(light):
                self._accumulation.forget(light)
        done = sum(self._accumulation.passes(light) > 0 for light in self._lights)
        if done:
            self._reporter.say(f"resuming: {done} of {len(self._lights)} lights are done")
        path = self._folder / ACCUMULATION / CURVE
        if self._auto and path.is_file():
            self._measured = {entry["samples"]: stopping.Measure(**entry) for entry in files.read_json(path)["curve"]}

    def _tasks(self) -> list[Task]:
        """The next pass: a task for each unfinished light of those with the fewest passes."""
        due = [
            light for light in self._order if self._accumulation.samples(light) < self._goal_of(light) and light.index not in self._failed
        ]
        level = min((self._accumulation.passes(light) for light in due), default=0)
        first = 1 if self._auto or self._settings.step > 1 else FIRST_SAMPLES
        return [self._task(light, level, first) for light in due if self._accumulation.passes(light) == level]

    def _task(self, light: PlannedLight, level: int, first: int) -> Task:
        done, goal = self._accumulation.samples(light), self._goal_of(light)
        denoise = self._settings.denoise and light.role == "train"  # a denoised image cannot be summed: one pass has all samples
        samples = goal - done if denoise else next_samples(light, done, goal, first)
        seed = noise_seed(self._settings.seed, light.index, level)
        keep = self._keep or done + samples < goal
        return Task(light, samples, seed, level, self._needs_squares(light), keep, denoise)

    def _take(self, task: Task, response: Response | RemoteResult) -> None:
        light = task.light
        try:
            own = (
                self._committed(task, response)
                if isinstance(response, RemoteResult)
                else add_pass(self._images, self._accumulation, task, response)
            )
        except BakeError as error:
            if self._first.looking:
                raise
            self._reporter.say(f"{error}; the other lights are rendered")
            self._failed[light.index] = str(error)
            return
        if own is None:
            return
        with self._mutex:
            self._first.look(own)
            self._report_progress(task.before + 1)
            self._log(f"light {light.index} pass {task.before + 1} of {task.samples} in {response.seconds:.3f} s")

    def _committed(self, task: Task, response: RemoteResult) -> ndarray:
        """The image that another machine wrote, while the first lights are checked; else an empty array."""
        if response.error is not None:
            raise BakeError(response.error)
        if not self._accumulation.refresh(task.light, task.before + 1, LATE):
            raise BakeError(
                f"expected pass {task.before + 1} of light {task.light.index} in {self._folder}; do all machines see the same folder?"
            )
        return self._images.published(task.light) if self._first.looking else np.empty(0)

    def _is_enough(self) -> bool:
        """For `samples=auto`: measure the error at this number of samples, and whether the last doubling lowered it enough."""
        measure = self._measured.get(self._goal)
        if measure is None:
            lights = [light for light in self._lights if light.role == "validation" and light.index not in self._failed]
            measure = stopping.measure(Capture.open(self._folder), self._goal, [self._accumulation.read(light) for light in lights])
            self._measured[self._goal] = measure
            files.write_json(self._folder / ACCUMULATION / CURVE, {"curve": stopping.record(list(self._measured.values()))})
            self._reporter.say(
                f"{self._goal} samples per texel: error {measure.relative_rmse:.4f} on the validation lights "
                f"(without their own noise of {measure.noise:.4f})"
            )
        self._curve.append(measure)
        return stopping.is_enough(self._curve)

    def _goal_of(self, light: PlannedLight) -> int:
        if light.role == "train":
            return self._goal
        tested = self._settings.holdout_samples
        return tested if self._settled else min(tested, TESTED_GROWTH * self._goal)

    def _needs_squares(self, light: PlannedLight) -> bool:
        return self._auto and light.role == "validation"

    def _is_summed(self, light: PlannedLight) -> bool:
        return self._keep or self._goal_of(light) > FIRST_SAMPLES

    def _write_manifest(self) -> None:
        """Make the folder a valid capture, once a train light is there. Shards do not: each knows only its own lights."""
        if self._shard is not None:
            return
        done = [light for light in self._lights if self._accumulation.passes(light)]
        is_indirect = self._settings.transport == "indirect"  # passes of direct light, spread over the texels, differ by more than noise
        noise = [self._accumulation.noise(light) if is_indirect else None for light in done]
        lights = [(light, self._accumulation.samples(light), own) for light, own in zip(done, noise, strict=True)]
        traced = self._settings.light_set is not None and self._settings.light_set.kind in ("surfels", "gather", "cubemap")
        reached = [self._goal] if traced else [samples for light, samples, _ in lights if light.role == "train"]
        if reached and self._images.prepared is not None:
            curve = stopping.record(self._curve)
            manifest = capture_manifest(self._settings, self._identity, self._images.prepared, lights, min(reached), curve)
            files.write_json(self._folder / MANIFEST, {**manifest, **self._traced})

    def _record(self, blender: str) -> None:
        """Mark the folder as a bake begun. BakeError where another Blender began it, whose output would differ."""
        path = self._folder / STATE
        began = files.read_json(path).get("blender", blender) if path.is_file() else blender
        if began != blender:
            raise BakeError(f"expected Blender {began}, which began {self._folder}, found {blender}; use it, or bake with `restart=True`")
        files.write_json(path, {**self._identity, "blender": blender})

    def _start(self, scratch: Path) -> Worker:
        job = serving_job(self._bake.scene, self._settings, self._images.prepared, scratch)
        return Worker(job, scratch, self._folder / LOG, self._bake.blender)

    def _say_once(self, line: str) -> None:
        with self._mutex:
            if line in self._said:
                return
            self._said.add(line)
        self._reporter.say(line)

    def _ready(self, event: dict[str, Any], scratch: Path) -> None:
        """Events of a worker before it serves: the first worker sends the receiver's images, every other must have the same receiver."""
        kind, prepared = event["event"], self._images.prepared
        if kind == "warning":
            self._say_once(event["message"])
        elif kind == "scene" and prepared is not None:
            self._record(event["blender"])
            self._images.require_receiver(event)
        elif kind == "scene":
            # before the bake counts as begun: resumed, it has the same lights
            write_light_set(self._folder, self._settings, self._identity)
            self._record(event["blender"])
            self._facts = event
        elif kind == "file":
            self._sampling, self._transmittances = event["sampling"], event["transmittances"]
            with files.atomic_path(self._folder / event["file"]) as temporary:
                shutil.copyfile(scratch / event["file"], temporary)
        elif kind == "image":
            self._images.take(event["name"], np.load(scratch / event["file"]))
            (scratch / event["file"]).unlink()

    @contextmanager
    def _alarm(self, pool: Renderer) -> Iterator[None]:
        """Stop the workers when the time is up."""
        timer = None
        if self._bake.time_limit is not None:
            timer = threading.Timer(max(0.0, self._bake.time_limit - (time.monotonic() - self._started)), pool.stop)
            timer.daemon = True
            timer.start()
        try:
            yield
        finally:
            if timer is not None:
                timer.cancel()

    def _is_time_up(self) -> bool:
        return self._bake.time_limit is not None and time.monotonic() - self._started >= self._bake.time_limit

    def _report_progress(self, sampling_pass: int) -> None:
        if self._bake.time_limit is not None:
            done, total = min(time.monotonic() - self._started, self._bake.time_limit), self._bake.time_limit
        else:
            done = float(sum(min(self._accumulation.samples(light), self._goal_of(light)) for light in self._order))
            total = float(sum(self._goal_of(light) for light in self._order))
        reached = sum(self._accumulation.passes(light) >= sampling_pass for light in self._order)
        self._reporter.progress(done, total, f"pass {sampling_pass}: light {reached} of {len(self._order)}")

    def _log(self, line: str) -> None:
        with open(self._folder / LOG, "a", encoding="utf-8") as log:
            log.write(f"srbf: {line}\n")
