"""The jobs of a Blender worker: what it must know of the scene, the receiver and the lights."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from srbf.bake.settings import BakeSettings, noise_seed, plan_lights

AMBIENT_SEED = -1  # the light index of the image without a light
COVERAGE_SAMPLES = 64
PROBES = 12  # about so many lights choose the transmittance of translucent materials


def serving_job(scene: Path, settings: BakeSettings, prepared: dict[str, Any] | None, scratch: Path) -> dict[str, Any]:
    """The job of a worker that is then asked for lights; with nothing `prepared` it hands over what the images of the receiver need."""
    train = [light for light in plan_lights(settings) if light.role == "train"]
    return {
        **base_job(scene, settings, scratch),
        "serve": True,
        "geometry": prepared is None,
        "ambient": {"samples": settings.holdout_samples, "seed": noise_seed(settings.seed, AMBIENT_SEED)} if prepared is None else None,
        "lights": [],
        "probes": [light.job() for light in train[:: max(1, len(train) // PROBES)]],
        "tints": None if prepared is None else prepared["tints"],
    }


def base_job(scene: Path, settings: BakeSettings, scratch: Path) -> dict[str, Any]:
    """What every job tells the worker of scene and receiver."""
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
    }
