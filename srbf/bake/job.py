"""The jobs of a Blender worker: what it must know of the scene, the receiver and the lights."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from srbf.bake.images import ASKED_FOR
from srbf.bake.light_sets import LIGHT_SET_FILE, NamedSet, PlacedLight
from srbf.bake.planned_lights import noise_seed
from srbf.bake.probes import PROBES_FILE, write_job
from srbf.bake.request import RenderRequest
from srbf.bake.settings import BakeSettings, plan_lights
from srbf.bake.viewers import viewer_directions
from srbf.channels import GLOSS, THROUGH
from srbf.sphere import point_set

AMBIENT_SEED = -1  # the light index of the image without a light
COVERAGE_SAMPLES = 64
PROBES = 12  # about so many lights choose the transmittance of translucent materials


def serving_job(scene: Path, settings: BakeSettings, prepared: dict[str, Any] | None, scratch: Path) -> dict[str, Any]:
    """The job of a worker that renders requests as they come; with nothing `prepared` it first sends what the receiver's images need."""
    if settings.light_set is None:
        train = [light.placed for light in plan_lights(settings) if light.role == "train"]
        probes = train[:: max(1, len(train) // PROBES)]
    else:
        probes = [PlacedLight("directional", tuple(direction)) for direction in point_set("hammersley", PROBES, "sphere").tolist()]
    first = prepared is None
    shines = first and not isinstance(settings.light_set, NamedSet)  # whose lights include all that emits
    return {
        **base_job(scene, settings, scratch),
        "serve": True,
        "channels": [*ASKED_FOR, *_gloss_channels(settings)] if first else [],
        "ambient": RenderRequest(None, settings.holdout_samples, noise_seed(settings.seed, AMBIENT_SEED)).message() if shines else None,
        "probes": [light.json() for light in probes],
        "transmittances": None if prepared is None else prepared["transmittances"],
    }


def base_job(scene: Path, settings: BakeSettings, scratch: Path, requests: Sequence[RenderRequest] = ()) -> dict[str, Any]:
    """A job of `requests` alone, and what every job says of scene and receiver. Keys: see `blender_bake.__main__.run`.

    What a light set and probes know of the scene goes into files in `scratch`.
    """
    light_set, probes = settings.light_set, settings.receiver.probes
    traced = light_set is not None and light_set.kind == "cubemap"
    lit_by: dict[str, Any] = {"kind": "own"}
    if isinstance(light_set, NamedSet):
        lit_by = {"kind": "named", "groups": list(light_set.groups)}
    elif light_set is not None:
        light_set.write(scratch / LIGHT_SET_FILE)
        lit_by = {"kind": light_set.kind, "file": str((scratch / LIGHT_SET_FILE).resolve())}
    return {
        "lit_by": lit_by,
        "scene": str(scene.resolve()),
        "scene_name": settings.scene,
        "receiver": settings.receiver.job() if probes is None else write_job(probes, scratch / PROBES_FILE),
        "width": settings.width,
        "height": settings.height,
        "quantity": settings.quantity,
        "keep_scene_lights": settings.keep_scene_lights,
        "sun_angle": settings.sun_angle,
        "transport": "indirect" if traced else settings.transport,  # which sends scene.glb
        "direct_gloss": _keeps_gloss(settings),
        "no_shadow": list(settings.no_shadow),
        "coverage_samples": COVERAGE_SAMPLES,
        "scratch": str(scratch.resolve()),
        "channels": [],
        "ambient": None,
        "probes": [],
        "viewers": None if settings.harmonics is None else viewer_directions(settings.harmonics).tolist(),
        "transmittances": None,
        "requests": [request.message() for request in requests],
    }


def _gloss_channels(settings: BakeSettings) -> tuple[str, ...]:
    """What is asked of the receivers' gloss."""
    if _keeps_gloss(settings):
        return (*GLOSS, THROUGH)
    return GLOSS if settings.gloss is not None and settings.harmonics is None else ()


def _keeps_gloss(settings: BakeSettings) -> bool:
    """Whether direct light includes what gloss reflects: of views that are relit with it."""
    return settings.light_set is not None and settings.light_set.kind == "gather"
