"""Baking a capture: pass by pass, every light's sum kept, the folder a valid capture from the first pass on."""

from __future__ import annotations

import shutil
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from srbf import files
from srbf.bake import folder, stopping
from srbf.bake.checks import FirstLights, bytes_needed, check_disk
from srbf.bake.crew import Answer, Crew, CrewSettings, Task
from srbf.bake.folder import LOG, SCRATCH, STATE
from srbf.bake.images import CaptureImages, uv_checksum, without_uv
from srbf.bake.manifest import capture_manifest
from srbf.bake.schedule import FIRST_SAMPLES, TESTED_GROWTH, next_samples, render_order
from srbf.bake.settings import BakeSettings, PlannedLight, noise_seed, plan_lights
from srbf.bake.sums import NOTHING, SUMS, Sums
from srbf.bake.worker import Worker
from srbf.capture import MANIFEST, Capture
from srbf.errors import BakeError, InputError

AMBIENT_SEED = -1  # the light index of the image without a light
COVERAGE_SAMPLES = 64
PROBES = 12  # about so many lights by which the tints of translucent materials are chosen
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
    crew: CrewSettings = field(default_factory=CrewSettings)
    seconds: float | None = None
    keep_sums: bool = False

    def __post_init__(self) -> None:
        if self.seconds is not None and self.settings.denoise:
            raise InputError("--denoise needs a given number of samples, found --time; give --samples, or take --denoise off")

    @property
    def is_open_ended(self) -> bool:
        """Whether the number of samples is found while baking."""
        return self.settings.samples == "auto" or self.seconds is not None

    @property
    def keeps_sums(self) -> bool:
        """Whether more samples can be added once it is done."""
        return self.keep_sums or self.is_open_ended

    def run(self, reporter: Reporter, force: bool = False, restart: bool = False) -> bool:
        """Bake what is not there yet; False where nothing was left to do. Killed at any moment, it goes on when run again.

        Finished passes of lights are kept, and every image and the manifest are bit-identical to those of an uninterrupted bake.
        BakeError where Blender fails, a light cannot be rendered, or another process bakes here; OutputExistsError where the folder
        holds something else.
        """
        identity = self._identity()
        existed = self.folder.exists()
        with folder.hold(self.folder):
            try:
                if folder.is_finished(self.folder, identity, force, restart):
                    return False
                folder.sweep(self.folder)
                for name in (SUMS, "lights", *(["direct"] if self.settings.transport == "indirect" else [])):
                    files.make_folder(self.folder / name)
                files.make_folder(self.folder / SCRATCH)
                _Passes(self, identity, reporter).run()
                return True
            except KeyboardInterrupt:
                if (self.folder / STATE).is_file():
                    reporter.say(f"stopped; finished lights are kept, the same command goes on with {self.folder}")
                raise
            finally:
                shutil.rmtree(self.folder / SCRATCH, ignore_errors=True)
                if not (existed or (self.folder / STATE).exists() or (self.folder / MANIFEST).exists()):
                    shutil.rmtree(self.folder, ignore_errors=True)  # Blender never came as far as the first image

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

    def __init__(self, bake: Bake, identity: dict[str, Any], reporter: Reporter) -> None:
        self._bake, self._identity, self._reporter = bake, identity, reporter
        self._folder, self._settings = bake.folder, bake.settings
        self._lights = plan_lights(bake.settings)
        self._order = render_order(self._lights)
        self._images = CaptureImages(bake.folder, reporter.say)
        self._sums = Sums(bake.folder, self._lights)
        self._auto = bake.settings.samples == "auto"
        self._apart = bake.settings.transport == "indirect"
        self._keep = bake.keeps_sums
        self._goal = 1 if self._auto else int(bake.settings.samples)
        self._first = FirstLights(len(self._lights), bake.settings.receiver.place, reporter.say)
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
        with Crew(self._bake.crew, self._folder / SCRATCH, self._start, self._ready, self._reporter.say) as crew, self._alarm(crew):
            if self._images.prepared is None:
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

    def _passes(self, crew: Crew) -> None:
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

        def alone(light: PlannedLight) -> bool:
            """Whether its image is denoised, which is done to a whole image: its samples are one pass."""
            return self._settings.denoise and light.role == "train"

        return [
            Task(
                light,
                self._goal if alone(light) else next_samples(light, self._sums.samples(light), self._goal_of(light), first),
                noise_seed(self._settings.seed, light.index, level),
                alone(light),
            )
            for light in due
            if self._sums.passes(light) == level
        ]

    def _take(self, task: Task, answer: Answer) -> None:
        light = task.light
        size = (self._settings.height, self._settings.width, 3)
        for image in (answer.whole, answer.direct):
            if image is not None and image.shape != size:
                raise BakeError(
                    f"expected {size} values of light {light.index} from Blender, found {image.shape}; its log is {self._folder / LOG}"
                )
        total = self._sums.read(light) if self._sums.passes(light) else NOTHING
        if total.passes != self._sums.passes(light):  # damaged since the stock was taken
            self._sums.forget(light)
            return
        total = total.with_pass(task.samples, answer.whole, answer.direct, self._needs_squares(light))
        try:
            own = self._images.own_light(light, total.mean)
            self._images.publish(light, own, total.direct_mean)
        except BakeError as error:
            if self._first.looking:
                raise
            self._reporter.say(f"{error}; the rest goes on")
            self._failed[light.index] = str(error)
            return
        self._sums.write(light, total, self._keep or total.samples < self._goal_of(light), self._images.checksum(light, self._apart))
        with self._mutex:
            self._first.look(own)
            self._tell_progress(total.passes)
            self._log(f"light {light.index} pass {total.passes} of {task.samples} in {answer.seconds:.3f} s")

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
        """The folder as it stands becomes a valid capture, once a fitted light is there."""
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
            raise BakeError(f"expected Blender {began}, which began {self._folder}, found {blender}; use it, or add --restart")
        files.write_json(path, {**self._identity, "blender": blender})

    def _start(self, scratch: Path) -> Worker:
        settings, prepared = self._settings, self._images.prepared
        train = [light for light in self._lights if light.role == "train"]
        job = {
            **base_job(self._bake.scene, settings, scratch),
            "serve": True,
            "geometry": prepared is None,
            "ambient": {"samples": settings.holdout_samples, "seed": noise_seed(settings.seed, AMBIENT_SEED)} if prepared is None else None,
            "lights": [],
            "probes": [light.job() for light in train[:: max(1, len(train) // PROBES)]],
            "tints": None if prepared is None else prepared["tints"],
        }
        return Worker(job, scratch, self._folder / LOG, self._bake.blender)

    def _ready(self, event: dict[str, Any], scratch: Path) -> None:
        """What a worker tells before it serves: the first one the receiver and its geometry, every other one the same scene."""
        kind, prepared = event["event"], self._images.prepared
        if kind == "warning":
            with self._mutex:
                if event["message"] not in self._told:
                    self._told.add(event["message"])
                    self._reporter.say(event["message"])
        elif kind == "scene" and prepared is not None:
            self._record(event["blender"])
            if without_uv(event) != prepared["facts"] or uv_checksum(event) != prepared["uv"]:
                raise BakeError(f"expected the receiver of {self._folder} as it was when its bake began, found another; add --restart")
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
    def _alarm(self, crew: Crew) -> Iterator[None]:
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


def base_job(scene: Path, settings: BakeSettings, scratch: Path) -> dict[str, Any]:
    """What every job tells the worker of scene and receiver."""
    return {
        "scene": str(scene.resolve()),
        "receiver": settings.receiver.job(),
        "width": settings.width,
        "height": settings.height,
        "quantity": settings.quantity,
        "keep_lamps": settings.keep_lamps,
        "sun_angle": settings.sun_angle,
        "transport": settings.transport,
        "no_shadow": list(settings.no_shadow),
        "coverage_samples": COVERAGE_SAMPLES,
        "scratch": str(scratch.resolve()),
    }
