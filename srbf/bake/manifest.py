"""capture.json as a bake writes it at the end of every pass; interruptions do not change it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import srbf
from srbf.bake.gather_set import GatherSet
from srbf.bake.images import SCENE_FILE, SEAMS
from srbf.bake.planned_lights import PlannedLight
from srbf.bake.settings import BakeSettings
from srbf.channels import file_name, manifest_keys


def capture_manifest(
    settings: BakeSettings,
    identity: dict[str, Any],
    prepared: dict[str, Any],
    lights: Sequence[tuple[PlannedLight, int, float | None]],
    reached: int,
    curve: list[dict[str, Any]],
) -> dict[str, Any]:
    """The manifest (the keys of capture.schema.json) of the lights rendered so far.

    identity: scene, scene_sha256 and settings of the bake. prepared: see `CaptureImages`. lights: (light, its samples so far, its noise).
    reached: samples per texel of every train light, at least. curve: what `samples=auto` measured, see `stopping.record`.
    """
    facts = prepared["facts"]
    receivers = facts["receivers"]
    source = {**identity, "settings": {**identity["settings"], "samples": reached}, "srbf": srbf.__version__, "blender": facts["blender"]}
    if "camera" in facts:
        source["camera"] = facts["camera"]
    if prepared["uv"] is not None:
        source["uv"] = "uv.json"
    if curve:
        source["validation_curve"] = curve
    traced = settings.light_set is not None and settings.light_set.kind == "cubemap"
    apart = settings.transport == "indirect" or traced
    known = {} if settings.light_set is None else settings.light_set.manifest()
    sun_angle = settings.sun_angle
    if isinstance(settings.light_set, GatherSet):
        sun_angle = settings.light_set.sun_angle or 0.0  # no image has a sun: the scene's own will shine at relighting
        if settings.keep_scene_lights:  # they are in the ambient light
            known = {key: value for key, value in known.items() if not key.startswith("scene_lights")}
    return {
        "format": "srbf-capture",
        "version": 1,
        "quantity": settings.quantity,
        "transport": settings.transport,
        "width": settings.width,
        "height": settings.height,
        **({"receiver": receivers[0]} if len(receivers) == 1 else {"receivers": receivers}),
        "lights": [
            {
                **light.placed.json(),
                "role": light.role,
                "file": light.file,
                **({"direct": light.direct_file} if light.has_direct else {}),
                **({} if light.gloss is None else {"harmonics": list(light.harmonics_files)}),
                **({} if light.share is None else {"share": light.share.json()}),
                "samples": samples,
                **({} if noise is None else {"noise": round(noise, 6)}),
            }
            for light, samples, noise in lights
        ],
        **({"scene": SCENE_FILE, "direct": {"sun_angle": sun_angle, **prepared["sampling"]}} if apart else {}),
        **({} if settings.harmonics is None else {"harmonics": {"order": settings.harmonics}}),
        **manifest_keys(prepared["channels"]),
        **known,
        **({SEAMS: file_name(SEAMS)} if prepared["seams"] else {}),
        "source": source,
    }
