"""An asset's picture by Cycles: the same receivers under given lights, all at once, direct light and all bounces."""

from __future__ import annotations

import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32
from srbf.asset import Asset
from srbf.bake.job import base_job
from srbf.bake.planned_lights import Rendered, noise_seed
from srbf.bake.request import RenderRequest
from srbf.bake.run import require_scene
from srbf.bake.settings import BakeSettings, Receiver
from srbf.bake.worker import Worker
from srbf.errors import BakeError, InputError
from srbf.io import files
from srbf.light_entries import lights_of

STEPS = 8  # renders of a share of the samples each: between them there is progress, and a way to stop
MOST_SAMPLES = 65_536
GIVEN = "given lights"  # what messages call the list


class StoppedError(BakeError):
    """The render was stopped before its end."""


@dataclass(frozen=True)
class GivenReference:
    """What Cycles renders: `image` (H, W, 3) in the asset's quantity with `samples` samples per pixel; `seconds` with opening the scene,
    `render_seconds` without."""

    image: Float32[ndarray, "H W 3"]
    samples: int
    seconds: float
    render_seconds: float


def require_view(asset: Asset, scene: Path) -> None:
    """InputError for a missing scene, and for an asset of another receiver than a view."""
    require_scene(scene)
    if asset.receiver_kind != "view" or not asset.receivers:
        raise InputError(f"expected an asset of a view that was baked from a scene, found one of {asset.receiver_kind}")


def changed_line(asset: Asset, scene: Path) -> str | None:
    """A line where the .blend is not the one that the asset was baked from."""
    baked = asset.manifest.get("source", {}).get("scene_sha256")
    if baked in (None, files.sha256_of(scene)):
        return None
    return f"{scene.name} has changed since this asset's capture was baked: the comparison is of two different scenes"


def render_given(
    asset: Asset,
    scene: Path,
    lights: Sequence[dict[str, Any]],
    samples: int,
    progress: Callable[[int, int], None] = lambda done, total: None,
    say: Callable[[str], None] = lambda line: None,
    blender: Path | None = None,
    stop: threading.Event | None = None,
    seed: int = 1,
    profiles: Path | None = None,
    denoised: bool = False,
) -> GivenReference:
    """Render a view's picture under `lights`, entries as of FRAMES.json (without environments and named lights), by Cycles.

    What the scene emits by itself is in it, as the asset's ambient light; its own lights and world are off, unless the capture was baked
    with `keep_scene_lights`. `profiles`: the folder of the files of the lights' profiles. `progress` gets samples
    (done, total). `stop`: once it is set, Blender's process is killed. `denoised`: by Blender's denoiser, all samples at once.
    InputError for lights that Cycles lacks, an asset of another receiver or transport than a view's, or a missing scene; BakeError where
    Blender fails; StoppedError.
    """
    require_view(asset, scene)
    if not 1 <= samples <= MOST_SAMPLES:
        raise InputError(f"expected 1 to {MOST_SAMPLES} samples, found {samples}")
    if profiles is None:
        lights_of(lights, GIVEN)
    else:
        lights = [{**one, "profile": str(profiles.resolve() / one["profile"])} if "profile" in one else one for one in lights]
    if any(light["kind"] == "named" for light in lights):
        raise InputError("expected lights inside the scene for a render by Cycles, found a named one")
    made = asset.manifest.get("source", {}).get("bake", {})
    kept = bool(made.get("keep_scene_lights", False))
    settings = BakeSettings(
        Receiver.of_manifest(asset.receivers),
        asset.width,
        asset.height,
        quantity=asset.quantity,
        scene=made.get("scene"),
        keep_scene_lights=kept,
    )
    channel: Rendered = "denoised" if denoised else "response"
    counts = [samples] if denoised else _split(samples)
    requests = [RenderRequest(None, count, noise_seed(seed, i), channels=(channel,)) for i, count in enumerate(counts)]
    total, done = np.zeros((asset.height, asset.width, 3)), 0
    started, rendering = time.perf_counter(), 0.0
    with tempfile.TemporaryDirectory(prefix="srbf-") as name:
        scratch = Path(name)
        angle = float(asset.manifest.get("direct", {}).get("sun_angle", 0.0))
        job = {
            **base_job(scene, settings, scratch, requests),
            "lit_by": {"kind": "given", "lights": list(lights), "sun_angle": angle},
        }
        ended = threading.Event()
        with Worker(job, scratch, scratch / "bake.log", blender) as worker:
            threading.Thread(target=_end_when, args=(stop, ended, worker), daemon=True).start()
            try:
                for event in worker.events(say):
                    if event["event"] == "rendered":
                        total += counts[done] * np.load(scratch / event["files"][channel])[:, :, :3]
                        rendering += event["seconds"]
                        done += 1
                        progress(sum(counts[:done]), samples)
            except BakeError:
                if stop is not None and stop.is_set():
                    raise StoppedError("the render by Cycles was stopped") from None
                raise
            finally:
                ended.set()
    if stop is not None and stop.is_set() and done < len(counts):
        raise StoppedError("the render by Cycles was stopped")
    return GivenReference((total / samples).astype(np.float32), samples, time.perf_counter() - started, rendering)


def _split(samples: int) -> list[int]:
    """Samples of each step."""
    steps = min(STEPS, samples)
    return [samples * (i + 1) // steps - samples * i // steps for i in range(steps)]


def _end_when(stop: threading.Event | None, ended: threading.Event, worker: Worker) -> None:
    while stop is not None and not ended.is_set():
        if stop.wait(0.1):
            worker.kill()
            return
