"""Baking a capture: ask the worker for what is missing, write each image as it comes, the manifest last."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import srbf
from srbf import files
from srbf.bake.settings import BakeSettings, PlannedLight, noise_seed, plan_lights
from srbf.bake.worker import Worker, WorkerDiedError
from srbf.capture import MANIFEST
from srbf.dilation import dilate, nearest_covered
from srbf.errors import BakeError, ImageError, InputError, MissingLibraryError, OutputExistsError
from srbf.image import HALF_MAX, read_image, size_of, write_image

STATE = "bake.json"  # there while a bake is unfinished: what it was asked for
LOG = "bake.log"
SCRATCH = ".scratch"
LOCK = ".lock"
AMBIENT_SEED = -1  # the light index of the image without a light
COVERAGE_SAMPLES = 64
GEOMETRY = ("position", "normal", "albedo", "coverage")
SCENE_FILE = "scene.glb"
PROBES = 12  # about so many lights by which the tints of translucent materials are chosen
BEFORE_IMAGES = (LOCK, SCRATCH, LOG, "lights", "direct")  # what may be there of a bake that never wrote an image
WRITTEN = (
    "lights",
    "direct",
    "ambient.exr",
    *(f"{name}.exr" for name in GEOMETRY),
    "uv.json",
    SCENE_FILE,
    SCRATCH,
    LOG,
)  # all that a bake leaves


@dataclass
class Reporter:
    """Where a bake tells of itself: progress in units of work (done, total, what), and lines for the user."""

    progress: Callable[[float, float, str], None] = lambda done, total, what: None
    say: Callable[[str], None] = lambda line: None


@dataclass(frozen=True)
class Bake:
    """One bake of a scene into a folder; `run` starts it or goes on with it."""

    scene: Path
    folder: Path
    settings: BakeSettings
    blender: Path | None = None

    def run(self, reporter: Reporter, force: bool = False, restart: bool = False) -> bool:
        """Bake what is not there yet; False where the capture was complete already. Killed at any moment, it goes on when run again.

        Finished lights are kept, and every image and the manifest are bit-identical to those of an uninterrupted bake.
        BakeError where Blender fails or another process bakes here; OutputExistsError where the folder holds something else.
        """
        identity = self._identity()
        existed = self.folder.exists()
        with self._lock():
            try:
                self._check_folder(identity, force, restart)
                if (self.folder / MANIFEST).is_file():
                    (self.folder / STATE).unlink(missing_ok=True)
                    return False
                self._sweep()
                scratch = self.folder / SCRATCH
                files.make_folder(scratch)
                files.make_folder(self.folder / "lights")
                if self.settings.transport == "indirect":
                    files.make_folder(self.folder / "direct")
                try:
                    manifest = self._bake(identity, scratch, reporter)
                except WorkerDiedError as error:
                    if not (self.folder / STATE).is_file():
                        raise
                    raise BakeError(
                        f"{error}; its log is {self.folder / LOG}; finished lights are kept, run the same command to go on"
                    ) from error
                files.write_json(self.folder / MANIFEST, manifest)
                (self.folder / STATE).unlink()
                return True
            finally:
                shutil.rmtree(self.folder / SCRATCH, ignore_errors=True)
                if not (existed or (self.folder / STATE).exists() or (self.folder / MANIFEST).exists()):
                    shutil.rmtree(self.folder, ignore_errors=True)  # Blender never came as far as the first image

    @contextmanager
    def _lock(self) -> Iterator[None]:
        """Hold the folder; the system lets go of it however this process ends."""
        try:
            import filelock
        except ImportError as error:
            raise MissingLibraryError("baking needs filelock: pip install filelock") from error
        if self.folder.exists() and not self.folder.is_dir():
            raise OutputExistsError(f"expected a folder or nothing at {self.folder}, found a file; choose another -o")
        files.make_folder(self.folder)
        lock = filelock.FileLock(str(self.folder / LOCK))
        try:
            lock.acquire(timeout=0)
        except filelock.Timeout as error:
            raise BakeError(f"another process is baking into {self.folder}; wait for it, or choose another -o") from error
        except OSError as error:
            raise files.WriteError(f"cannot write into {self.folder}: {error.strerror}; choose a folder that can be written") from error
        try:
            yield
        finally:
            if self.folder.exists() and not any((self.folder / name).exists() for name in (STATE, MANIFEST)):
                (self.folder / LOCK).unlink(missing_ok=True)
            lock.release()

    def check_scene(self) -> None:
        """InputError where there is no scene to bake."""
        if not self.scene.is_file():
            found = "a folder" if self.scene.is_dir() else "no such file"
            raise InputError(f"expected a .blend at {self.scene}, found {found}")

    def _identity(self) -> dict[str, Any]:
        self.check_scene()
        return {"scene": self.scene.name, "scene_sha256": files.sha256_of(self.scene), "settings": self.settings.record()}

    def _check_folder(self, identity: dict[str, Any], force: bool, restart: bool) -> None:
        """Refuse a folder that this bake can neither go on with nor replace; empty it where the user said so."""
        done, begun = self.folder / MANIFEST, self.folder / STATE
        if not done.is_file() and not begun.is_file():
            others = [p for p in self.folder.iterdir() if p.name not in BEFORE_IMAGES and ".partial" not in p.name]
            if others or any(any((self.folder / name).glob("*")) for name in ("lights", "direct")):
                raise OutputExistsError(f"expected an empty folder or a capture at {self.folder}, found other files; choose another -o")
            return
        recorded = files.read_json(done).get("source", {}) if done.is_file() else files.read_json(begun)
        if recorded.get("emptying"):
            self._empty()
            return
        changed = _differences(recorded, identity)
        if not changed and not restart and not (force and done.is_file()):
            return
        if not (force or (restart and not done.is_file())):
            if not changed:
                raise OutputExistsError(
                    f"expected an unfinished capture to restart at {self.folder}, found a finished one; --force replaces it"
                )
            state = "a finished capture" if done.is_file() else "a capture half done"
            flag = "--force" if done.is_file() else "--restart"
            raise OutputExistsError(
                f"expected {state} of the same scene and settings at {self.folder}, found another {', '.join(changed)}; "
                f"choose another -o, or {flag} to bake anew"
            )
        self._empty()

    def _empty(self) -> None:
        """Remove an old capture. Killed on the way, the next run goes on: no light of the old bake may pass for one of the new."""
        files.write_json(self.folder / STATE, {"emptying": True})
        (self.folder / MANIFEST).unlink(missing_ok=True)
        for name in WRITTEN:
            path = self.folder / name
            shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)
        (self.folder / STATE).unlink()

    def _sweep(self) -> None:
        """Remove what a killed process left half-written."""
        shutil.rmtree(self.folder / SCRATCH, ignore_errors=True)
        for partial in [*self.folder.glob(".*.partial*"), *self.folder.glob("lights/.*.partial*"), *self.folder.glob("direct/.*.partial*")]:
            partial.unlink()

    def _bake(self, identity: dict[str, Any], scratch: Path, reporter: Reporter) -> dict[str, Any]:
        lights = plan_lights(self.settings)
        missing = [light for light in lights if not self._is_done(light)]
        images = _Images(self.folder, self.settings, reporter)
        total = float(sum(light.samples for light in lights))
        done = total - sum(light.samples for light in missing)
        log = self.folder / LOG
        started = time.perf_counter()
        if done:
            reporter.say(f"going on: {len(lights) - len(missing)} of {len(lights)} lights are done")
        reporter.progress(done, total, "opening the scene")
        facts: dict[str, Any] = {}
        sampling: dict[str, Any] = {}
        planned = {light.index: light for light in missing}
        with Worker(self._job(missing, scratch), scratch, log, self.blender) as worker:
            for event in worker.events():
                if event["event"] == "warning":
                    reporter.say(event["message"])
                elif event["event"] == "scene":
                    facts = event
                    self._record(identity, event["blender"])
                    self._write_uv(event)
                elif event["event"] == "file":
                    sampling = event["sampling"]
                    with files.atomic_path(self.folder / event["file"]) as temporary:
                        shutil.copyfile(scratch / event["file"], temporary)
                elif event["event"] == "image":
                    array = np.load(scratch / event["file"])
                    (scratch / event["file"]).unlink()
                    if "light" not in event:
                        images.take(event["name"], array)
                        continue
                    light = planned.pop(event["light"])
                    direct = None
                    if "direct" in event:
                        direct = np.load(scratch / event["direct"])
                        (scratch / event["direct"]).unlink()
                    images.take_light(light, array, direct)
                    done += light.samples
                    reporter.progress(done, total, f"light {len(lights) - len(planned)} of {len(lights)}")
                    with open(log, "a", encoding="utf-8") as lines:
                        lines.write(f"srbf: light {light.index} in {event['seconds']:.3f} s\n")
        if planned:
            raise BakeError(f"expected {len(missing)} lights from Blender, found {len(missing) - len(planned)}; run the same command again")
        if images.is_all_black(lights):
            raise BakeError(
                f"every light image is black: does light reach {facts['receivers'][0].get('object') or 'the camera'} from the "
                f"{self.settings.domain}? Mend the scene and bake with --restart"
            )
        with open(log, "a", encoding="utf-8") as lines:
            lines.write(f"srbf: {len(missing)} lights in {time.perf_counter() - started:.1f} s\n")
        return self._manifest(identity, lights, facts, images, sampling)

    def _job(self, missing: list[PlannedLight], scratch: Path) -> dict[str, Any]:
        settings = self.settings
        train = [light for light in plan_lights(settings) if light.role == "train"]
        return {
            **base_job(self.scene, settings, scratch),
            "geometry": True,
            "ambient": {"samples": settings.holdout_samples, "seed": noise_seed(settings.seed, AMBIENT_SEED)},
            "lights": [{**light.job(), "denoise": settings.denoise and light.role == "train"} for light in missing],
            "probes": [light.job() for light in train[:: max(1, len(train) // PROBES)]],
        }

    def _is_done(self, light: PlannedLight) -> bool:
        """A light's files are whole by construction (renamed into place); a size that is not ours is baked again."""
        paths = [self.folder / light.file]
        if self.settings.transport == "indirect":
            paths.append(self.folder / light.direct_file)
        with suppress(ImageError):
            return all(path.is_file() and size_of(path) == (self.settings.height, self.settings.width) for path in paths)
        return False

    def _record(self, identity: dict[str, Any], blender: str) -> None:
        """The receiver is good: from here on the folder is a bake begun. Another Blender would not give the same bits."""
        path = self.folder / STATE
        began = files.read_json(path).get("blender", blender) if path.is_file() else blender
        if began != blender:
            raise BakeError(f"expected Blender {began}, which began {self.folder}, found {blender}; use it, or add --restart")
        files.write_json(path, {**identity, "blender": blender})

    def _write_uv(self, event: dict[str, Any]) -> None:
        if "uv" in event:
            files.write_json(self.folder / "uv.json", event["uv"])

    def _manifest(
        self, identity: dict[str, Any], lights: list[PlannedLight], facts: dict[str, Any], images: _Images, sampling: dict[str, Any]
    ) -> dict[str, Any]:
        source = {**identity, "srbf": srbf.__version__, "blender": facts["blender"]}
        if "camera" in facts:
            source["camera"] = facts["camera"]
        if "uv" in facts:
            source["uv"] = "uv.json"
        apart = self.settings.transport == "indirect"
        receivers = facts["receivers"]
        return {
            "format": "srbf-capture",
            "version": 1,
            "quantity": self.settings.quantity,
            "transport": self.settings.transport,
            "width": self.settings.width,
            "height": self.settings.height,
            **({"receiver": receivers[0]} if len(receivers) == 1 else {"receivers": receivers}),
            "lights": [
                {
                    "kind": "directional",
                    "direction": list(light.direction),
                    "role": light.role,
                    "file": light.file,
                    **({"direct": light.direct_file} if apart else {}),
                }
                for light in lights
            ],
            **({"scene": SCENE_FILE, "direct": {"sun_angle": self.settings.sun_angle, **sampling}} if apart else {}),
            **{name: f"{name}.exr" for name in GEOMETRY},
            **({"ambient": "ambient.exr"} if images.has_ambient else {}),
            "source": source,
        }


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


class _Images:
    """The capture's images as they arrive: geometry, ambient, what is left of it, then the lights with that subtracted."""

    def __init__(self, folder: Path, settings: BakeSettings, reporter: Reporter) -> None:
        self._folder = folder
        self._settings = settings
        self._reporter = reporter
        self._left: np.ndarray | None = None
        self._raw: dict[str, np.ndarray] = {}
        self._nearest: np.ndarray | None = None
        self.has_ambient = False
        self._brightest = 0.0

    def take(self, name: str, array: np.ndarray) -> None:
        """Geometry is kept until `hit`, its last image: where position and normal are real. `readable` says where light is."""
        if name == "left":  # what still shines with every lamp and emission off: subtracted from the lights, mostly nothing
            self._left = dilate(array, self._nearest) if array.any() else None
        elif name == "ambient":
            self.has_ambient = bool(array.any())
            if self.has_ambient:
                write_image(self._folder / "ambient.exr", dilate(array, self._nearest), "float")
        elif name == "hit":
            self._nearest = nearest_covered(self._raw.pop("readable")[:, :, 0])
            nearest = nearest_covered(self._raw["coverage"][:, :, 0])
            of_hits = nearest_covered(array[:, :, 0])
            for geometry, image in self._raw.items():
                if geometry != "coverage":
                    image = dilate(image, nearest if geometry == "albedo" else of_hits)
                write_image(self._folder / f"{geometry}.exr", image, "float")
            self._raw.clear()
        else:
            self._raw[name] = array

    def take_light(self, light: PlannedLight, array: np.ndarray, direct: np.ndarray | None = None) -> None:
        """Write one light's answer: finite, freed of what is left of the scene's own light, half float (fireflies clipped, and said).

        With `direct` given that is taken from it and written beside it, first: a light whose image is there has both.
        """
        if not (np.isfinite(array).all() and (direct is None or np.isfinite(direct).all())):
            raise BakeError(f"Blender rendered NaN or Inf for light {light.index}; look for a broken material or normal in the scene")
        array = dilate(array, self._nearest)
        if self._left is not None:
            array = array - self._left
        self._brightest = max(self._brightest, float(array.max()))
        if direct is not None:
            direct = np.clip(dilate(direct, self._nearest), 0, HALF_MAX).astype(np.float16).astype(np.float32)
            array = array - direct  # as the file has it, so that the two add up again
            write_image(self._folder / light.direct_file, direct, "half")
        beyond = int((np.abs(array) > HALF_MAX).sum())
        if beyond:
            self._reporter.say(f"light {light.index}: {beyond} values past half float's {HALF_MAX:.0f} are clipped to it")
            array = np.clip(array, -HALF_MAX, HALF_MAX)
        write_image(self._folder / light.file, array, "half")

    def is_all_black(self, lights: list[PlannedLight]) -> bool:
        """Whether no light image of the capture, baked now or earlier, has a texel above 0."""
        if self._brightest > 0:
            return False
        names = [light.file for light in lights]
        if self._settings.transport == "indirect":
            names += [light.direct_file for light in lights]
        return all(float(read_image(self._folder / name, 3).max()) <= 0 for name in names)


def _differences(recorded: dict[str, Any], asked: dict[str, Any]) -> list[str]:
    """Names of what differs between a recorded bake and this one."""
    changed = ["scene"] if recorded.get("scene_sha256") != asked["scene_sha256"] else []
    before, now = recorded.get("settings", {}), asked["settings"]
    return changed + [name.replace("_", " ") for name in now if before.get(name) != now[name]]
