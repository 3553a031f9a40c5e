"""Baking a capture: pass by pass, every light's sum kept, the folder a valid capture from the first pass on."""

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
from srbf.bake.checks import FIRST_LIGHTS, FirstLights, bytes_needed, check_disk
from srbf.bake.folder import LOG, SCRATCH, STATE
from srbf.bake.images import CaptureImages
from srbf.bake.job import serving_job
from srbf.bake.light_pass import add_pass
from srbf.bake.manifest import capture_manifest
from srbf.bake.part import Part
from srbf.bake.schedule import FIRST_SAMPLES, TESTED_GROWTH, next_samples, render_order
from srbf.bake.settings import BakeSettings, PlannedLight, noise_seed, plan_lights
from srbf.bake.sums import LATE, SUMS, Sums
from srbf.bake.worker import Worker
from srbf.bake.worker_pool import RemoteResult, Renderer, Response, Task, WorkerPool, WorkerPoolSettings
from srbf.capture import MANIFEST, Capture
from srbf.errors import BakeError, InputError
from srbf.io import files

if TYPE_CHECKING:
    from srbf.bake.dask_workers import DaskWorkerPool

CURVE = "curve.json"  # in the folder of sums: what --samples auto measured


@dataclass
class Reporter:
    """Where a bake tells of itself: progress in samples (done, total, what), and lines for the user."""

    progress: Callable[[float, float, str], None] = lambda done, total, what: None
    say: Callable[[str], None] = lambda line: None


@dataclass(frozen=True)
class Bake:
    """One bake of a scene into a folder; `run` starts it or goes on with it.

    `seconds`: stop when so much time is up, at the end of the light at hand. `keep_sums`: leave what more samples could be added to.
    """

    scene: Path
    folder: Path
    settings: BakeSettings
    blender: Path | None = None
    crew: WorkerPoolSettings = field(default_factory=WorkerPoolSettings)
    seconds: float | None = None
    keep_sums: bool = False
    dask: str | None = None  # address of a scheduler whose workers render, instead of a crew of this machine

    def __post_init__(self) -> None:
        if self.seconds is not None and self.settings.denoise:
            raise InputError("`denoise` needs a given number of samples, found `time_limit`; give `samples`, or take `denoise` off")

    @property
    def is_open_ended(self) -> bool:
        """Whether the number of samples is found while baking."""
        return self.settings.samples == "auto" or self.seconds is not None

    @property
    def keeps_sums(self) -> bool:
        """Whether more samples can be added once it is done."""
        return self.keep_sums or self.is_open_ended

    def run(self, reporter: Reporter, force: bool = False, restart: bool = False, part: Part | None = None) -> bool:
        """Bake what is not there yet; False where nothing was left to do. Killed at any moment, it goes on when run again.

        Of a `part` only its lights: other parts may be baked at the same time, and no manifest is written. A bake without finds them done.

        Finished passes of lights are kept, and every image and the manifest are bit-identical to those of an uninterrupted bake.
        BakeError where Blender fails, a light cannot be rendered, or another process bakes here; OutputExistsError where the folder
        holds something else.
        """
        identity = self._identity()
        existed = self.folder.exists()
        if part is not None and self.is_open_ended:
            raise InputError(
                "`shard` needs to know how much there is to do: expected a number of `samples`, found `samples=auto` or `time_limit`"
            )
        if part is not None and not part.is_preparation:
            return self._run_beside(part, identity, reporter)
        with folder.hold(self.folder):
            try:
                if folder.is_finished(self.folder, identity, force, restart):
                    return False
                folder.sweep(self.folder)
                for name in (SUMS, "lights", *(["direct"] if self.settings.transport == "indirect" else [])):
                    files.make_folder(self.folder / name)
                files.make_folder(self.folder / SCRATCH)
                _Passes(self, identity, reporter, part).run()
                return True
            except KeyboardInterrupt:
                if (self.folder / STATE).is_file():
                    reporter.say(f"stopped; finished lights are kept, the same command goes on with {self.folder}")
                raise
            finally:
                shutil.rmtree(self.folder / SCRATCH, ignore_errors=True)
                if not (existed or (self.folder / STATE).exists() or (self.folder / MANIFEST).exists()):
                    shutil.rmtree(self.folder, ignore_errors=True)  # Blender never came as far as the first image

    def _run_beside(self, part: Part, identity: dict[str, Any], reporter: Reporter) -> bool:
        with folder.hold_part(self.folder, part):
            if folder.is_past_parts(self.folder, identity):
                return False
            try:
                files.make_folder(self.folder / SCRATCH / part.scratch)
                _Passes(self, identity, reporter, part).run()
                return True
            finally:
                shutil.rmtree(self.folder / SCRATCH / part.scratch, ignore_errors=True)
                with suppress(OSError):  # other parts are in it
                    (self.folder / SCRATCH).rmdir()

    def check_scene(self) -> None:
        """InputError where there is no scene to bake."""
        if not self.scene.is_file():
            found = "a folder" if self.scene.is_dir() else "no such file"
            raise InputError(f"expected a .blend at {self.scene}, found {found}")

    def _identity(self) -> dict[str, Any]:
        self.check_scene()
        return {"scene": self.scene.name, "scene_sha256": files.sha256_of(self.scene), "settings": self.settings.record()}


class _Passes:
    """One run of a bake, in a folder that it holds."""

    def __init__(self, bake: Bake, identity: dict[str, Any], reporter: Reporter, part: Part | None = None) -> None:
        self._bake, self._identity, self._reporter, self._part = bake, identity, reporter, part
        self._folder, self._settings = bake.folder, bake.settings
        self._lights = plan_lights(bake.settings)
        self._order = render_order(self._lights)
        self._scratch = self._folder / SCRATCH
        judged = len(self._lights)
        if part is not None:
            self._order = part.of(self._order)
            self._lights = sorted(self._order, key=lambda light: light.index)
            self._scratch /= part.scratch
            judged = len(self._lights) if len(self._lights) >= FIRST_LIGHTS else 0
        self._images = CaptureImages(bake.folder, reporter.say)
        self._sums = Sums(bake.folder, self._lights)
        self._auto = bake.settings.samples == "auto"
        self._apart = bake.settings.transport == "indirect"
        self._keep = bake.keeps_sums
        self._goal = 1 if self._auto else int(bake.settings.samples)
        self._first = FirstLights(judged, bake.settings.receiver.place, reporter.say)
        self._settled = not self._auto  # how many samples the fitted lights get
        self._curve: list[stopping.Measure] = []
        self._measured: dict[int, stopping.Measure] = {}  # by samples, in this run or before
        self._sampling: dict[str, Any] = {}
        self._tints: dict[str, Any] | None = None
        self._facts: dict[str, Any] | None = None
        self._failed: dict[int, str] = {}
        self._told: set[str] = set()
        self._started = time.monotonic()
        self._mutex = threading.Lock()

    def run(self) -> None:
        new = [light for light in self._lights if not (self._folder / light.file).is_file()]
        check_disk(self._folder, bytes_needed(self._settings, len(new), len([light for light in new if self._is_summed(light)])))
        with self._renderer() as crew, self._alarm(crew):
            if self._images.prepared is None:
                if self._part is not None and not self._part.is_preparation:
                    raise BakeError(f"expected {self._folder} prepared, found it damaged; run `shard=prepare` again")
                self._reporter.progress(0, 1, "opening the scene")
                crew.open()
                assert self._facts is not None
                self._images.prepare(self._facts, self._sampling, self._tints)
            else:
                self._record(self._images.prepared["facts"]["blender"])
            self._take_stock()
            try:
                self._passes(crew)
            except KeyboardInterrupt:
                self._write_manifest()
                raise
        self._finish()

    def _renderer(self) -> WorkerPool | DaskWorkerPool:
        crew = WorkerPool(self._bake.crew, self._scratch, self._start, self._ready, self._reporter.say)
        if self._bake.dask is None:
            return crew
        from srbf.bake.dask_workers import DaskWorkerPool
        from srbf.compute.dask_client import checked

        return DaskWorkerPool(checked(self._bake.dask), self._bake, self._identity, crew, self._say_once)

    def _passes(self, crew: Renderer) -> None:
        while not self._is_time_up():
            tasks = self._tasks()
            if tasks:
                crew.render(tasks, self._take)
                self._failed |= crew.failed
                self._write_manifest()
            elif self._settled:
                return
            elif self._is_enough():
                self._settled = True  # what is left is what the tested lights are still due
            else:
                self._goal *= 2

    def _finish(self) -> None:
        self._write_manifest()
        if self._bake.dask is not None:
            folder.sweep(self._folder)  # after machines that died while they wrote
        self._log(f"stopped after {time.monotonic() - self._started:.1f} s")
        if self._failed:
            index, reason = next(iter(self._failed.items()))
            raise BakeError(
                f"{len(self._failed)} of {len(self._lights)} lights could not be rendered, among them light {index}: {reason}; "
                f"the others are in {self._folder}, and the same command tries these again"
            )
        if self._is_time_up() and (self._tasks() or not self._settled):
            reached = [self._sums.samples(light) for light in self._lights if light.role == "train"]
            self._reporter.say(
                f"the time is up at {min(reached)} to {max(reached)} samples a texel; the same command adds more"
                if any(reached)
                else "the time was up before the first light was done; the same command goes on"
            )
            return
        if self._part is not None:
            return
        if not self._first.lit and all(float(self._images.published(light, self._apart).max()) <= 0 for light in self._lights):
            raise self._first.black(len(self._lights))  # other commands rendered it, too few lights each to tell
        if self._keep:
            (self._folder / STATE).unlink()
            return
        folder.tidy(self._folder)

    def _take_stock(self) -> None:
        """A light whose images are gone or damaged is written or begun anew; likewise one that has to grow and cannot."""
        for light in self._lights:
            if self._sums.passes(light) == 0:
                continue
            if self._images.checksum(light, self._apart) != self._sums.checksum(light):
                total = self._sums.read(light)
                if total.whole is None:
                    self._sums.forget(light)
                else:
                    self._images.publish(light, self._images.own_light(light, total.mean), total.direct_mean)
            if self._needs_squares(light) and self._sums.read(light).squares is None:
                self._sums.forget(light)
            if self._sums.samples(light) < self._goal_of(light) and not self._sums.can_grow(light):
                self._sums.forget(light)
        done = sum(self._sums.passes(light) > 0 for light in self._lights)
        if done:
            self._reporter.say(f"going on: {done} of {len(self._lights)} lights are done")
        path = self._folder / SUMS / CURVE
        if self._auto and path.is_file():
            self._measured = {entry["samples"]: stopping.Measure(**entry) for entry in files.read_json(path)["curve"]}

    def _tasks(self) -> list[Task]:
        """The next pass: of the lights that have the fewest, what each is due."""
        due = [light for light in self._order if self._sums.samples(light) < self._goal_of(light) and light.index not in self._failed]
        level = min((self._sums.passes(light) for light in due), default=0)
        first = 1 if self._auto else FIRST_SAMPLES
        return [self._task(light, level, first) for light in due if self._sums.passes(light) == level]

    def _task(self, light: PlannedLight, level: int, first: int) -> Task:
        done, goal = self._sums.samples(light), self._goal_of(light)
        denoise = self._settings.denoise and light.role == "train"  # of a whole image: its samples are one pass
        samples = goal - done if denoise else next_samples(light, done, goal, first)
        seed = noise_seed(self._settings.seed, light.index, level)
        return Task(light, samples, seed, level, self._needs_squares(light), self._keep or done + samples < goal, denoise)

    def _take(self, task: Task, response: Response | RemoteResult) -> None:
        light = task.light
        try:
            own = (
                self._committed(task, response)
                if isinstance(response, RemoteResult)
                else add_pass(self._images, self._sums, task, response)
            )
        except BakeError as error:
            if self._first.looking:
                raise
            self._reporter.say(f"{error}; the rest goes on")
            self._failed[light.index] = str(error)
            return
        if own is None:
            return
        with self._mutex:
            self._first.look(own)
            self._tell_progress(task.before + 1)
            self._log(f"light {light.index} pass {task.before + 1} of {task.samples} in {response.seconds:.3f} s")

    def _committed(self, task: Task, response: RemoteResult) -> ndarray:
        """What another machine wrote, while the first lights are looked at."""
        if response.error is not None:
            raise BakeError(response.error)
        if not self._sums.refresh(task.light, task.before + 1, LATE):
            raise BakeError(
                f"expected pass {task.before + 1} of light {task.light.index} in {self._folder}; do all machines see one folder?"
            )
        return self._images.published(task.light, self._apart) if self._first.looking else np.empty(0)

    def _is_enough(self) -> bool:
        """`--samples auto`: measure what this many samples gave, and whether the last doubling was still worth it."""
        measure = self._measured.get(self._goal)
        if measure is None:
            lights = [light for light in self._lights if light.role == "validation" and light.index not in self._failed]
            measure = stopping.measure(Capture.open(self._folder), self._goal, [self._sums.read(light) for light in lights])
            self._measured[self._goal] = measure
            files.write_json(self._folder / SUMS / CURVE, {"curve": stopping.record(list(self._measured.values()))})
            self._reporter.say(
                f"{self._goal} samples a texel: error {measure.relative_rmse:.4f} on the validation lights "
                f"(their own noise of {measure.noise:.4f} taken off)"
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
        """The folder as it stands becomes a valid capture, once a fitted light is there. Not by a part, which knows only its own."""
        if self._part is not None:
            return
        lights = [(light, self._sums.samples(light)) for light in self._lights if self._sums.passes(light)]
        reached = [samples for light, samples in lights if light.role == "train"]
        if reached and self._images.prepared is not None:
            curve = stopping.record(self._curve)
            manifest = capture_manifest(self._settings, self._identity, self._images.prepared, lights, min(reached), curve)
            files.write_json(self._folder / MANIFEST, manifest)

    def _record(self, blender: str) -> None:
        """From here on the folder is a bake begun. Another Blender would not give the same bits."""
        path = self._folder / STATE
        began = files.read_json(path).get("blender", blender) if path.is_file() else blender
        if began != blender:
            raise BakeError(f"expected Blender {began}, which began {self._folder}, found {blender}; use it, or add `restart=True`")
        files.write_json(path, {**self._identity, "blender": blender})

    def _start(self, scratch: Path) -> Worker:
        job = serving_job(self._bake.scene, self._settings, self._images.prepared, scratch)
        return Worker(job, scratch, self._folder / LOG, self._bake.blender)

    def _say_once(self, line: str) -> None:
        with self._mutex:
            if line in self._told:
                return
            self._told.add(line)
        self._reporter.say(line)

    def _ready(self, event: dict[str, Any], scratch: Path) -> None:
        """What a worker tells before it serves: the first one the receiver and its geometry, every other one the same scene."""
        kind, prepared = event["event"], self._images.prepared
        if kind == "warning":
            self._say_once(event["message"])
        elif kind == "scene" and prepared is not None:
            self._record(event["blender"])
            self._images.require_receiver(event)
        elif kind == "scene":
            self._record(event["blender"])
            self._facts = event
        elif kind == "file":
            self._sampling, self._tints = event["sampling"], event["tints"]
            with files.atomic_path(self._folder / event["file"]) as temporary:
                shutil.copyfile(scratch / event["file"], temporary)
        elif kind == "image":
            self._images.take(event["name"], np.load(scratch / event["file"]))
            (scratch / event["file"]).unlink()

    @contextmanager
    def _alarm(self, crew: Renderer) -> Iterator[None]:
        """Stop the crew when the time is up."""
        timer = None
        if self._bake.seconds is not None:
            timer = threading.Timer(max(0.0, self._bake.seconds - (time.monotonic() - self._started)), crew.stop)
            timer.daemon = True
            timer.start()
        try:
            yield
        finally:
            if timer is not None:
                timer.cancel()

    def _is_time_up(self) -> bool:
        return self._bake.seconds is not None and time.monotonic() - self._started >= self._bake.seconds

    def _tell_progress(self, sampling_pass: int) -> None:
        if self._bake.seconds is not None:
            done, total = min(time.monotonic() - self._started, self._bake.seconds), self._bake.seconds
        else:
            done = float(sum(min(self._sums.samples(light), self._goal_of(light)) for light in self._lights))
            total = float(sum(self._goal_of(light) for light in self._lights))
        reached = sum(self._sums.passes(light) >= sampling_pass for light in self._lights)
        self._reporter.progress(done, total, f"pass {sampling_pass}: light {reached} of {len(self._lights)}")

    def _log(self, line: str) -> None:
        with open(self._folder / LOG, "a", encoding="utf-8") as log:
            log.write(f"srbf: {line}\n")
