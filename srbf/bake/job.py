"""The jobs of a Blender worker: what it must know of the scene, the receiver and the lights."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from srbf.bake.images import ASKED_FOR
from srbf.bake.request import RenderRequest
from srbf.bake.settings import BakeSettings, noise_seed, plan_lights

AMBIENT_SEED = -1  # the light index of the image without a light
COVERAGE_SAMPLES = 64
PROBES = 12  # about so many lights choose the transmittance of translucent materials


def serving_job(scene: Path, settings: BakeSettings, prepared: dict[str, Any] | None, scratch: Path) -> dict[str, Any]:
    """The job of a worker that renders requests as they come; with nothing `prepared` it first sends what the receiver's images need."""
    train = [light for light in plan_lights(settings) if light.role == "train"]
    first = prepared is None
    return {
        **base_job(scene, settings, scratch),
        "serve": True,
        "channels": list(ASKED_FOR) if first else [],
        "ambient": RenderRequest(None, settings.holdout_samples, noise_seed(settings.seed, AMBIENT_SEED)).message() if first else None,
        "probes": [light.placed() for light in train[:: max(1, len(train) // PROBES)]],
        "transmittances": None if prepared is None else prepared["transmittances"],
    }


def base_job(scene: Path, settings: BakeSettings, scratch: Path, requests: Sequence[RenderRequest] = ()) -> dict[str, Any]:
    """A job of `requests` alone, and what every job says of scene and receiver. Keys: see `blender_bake.__main__.run`."""
    return {
        "scene": str(scene.resolve()),
        "scene_name": settings.scene,
        "receiver": settings.receiver.job(),
        "width": settings.width,
        "height": settings.height,
        "quantity": settings.quantity,
        "keep_scene_lights": settings.keep_scene_lights,
        "sun_angle": settings.sun_angle,
        "transport": settings.transport,
        "no_shadow": list(settings.no_shadow),
        "coverage_samples": COVERAGE_SAMPLES,
        "scratch": str(scratch.resolve()),
        "channels": [],
        "ambient": None,
        "probes": [],
        "transmittances": None,
        "requests": [request.message() for request in requests],
    }
