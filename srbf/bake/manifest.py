"""capture.json as a bake writes it: at the end of every pass, and the same whatever interrupted the bake."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import srbf
from srbf.bake.images import GEOMETRY, SCENE_FILE
from srbf.bake.settings import BakeSettings, PlannedLight


def capture_manifest(
    settings: BakeSettings,
    identity: dict[str, Any],
    prepared: dict[str, Any],
    lights: Sequence[tuple[PlannedLight, int]],
    reached: int,
    curve: list[dict[str, Any]],
) -> dict[str, Any]:
    """The manifest of the lights that are there, each with its samples; `reached` by the train lights, `curve` of `--samples auto`."""
    facts = prepared["facts"]
    source = {**identity, "settings": {**identity["settings"], "samples": reached}, "srbf": srbf.__version__, "blender": facts["blender"]}
    if "camera" in facts:
        source["camera"] = facts["camera"]
    if prepared["uv"] is not None:
        source["uv"] = "uv.json"
    if curve:
        source["validation_curve"] = curve
    apart = settings.transport == "indirect"
    return {
        "format": "srbf-capture",
        "version": 1,
        "quantity": settings.quantity,
        "transport": settings.transport,
        "width": settings.width,
        "height": settings.height,
        "receiver": facts["receiver"],
        "lights": [
            {
                **light.placed(),
                "role": light.role,
                "file": light.file,
                **({"direct": light.direct_file} if apart else {}),
                "samples": samples,
            }
            for light, samples in lights
        ],
        **({"scene": SCENE_FILE, "direct": {"sun_angle": settings.sun_angle, **prepared["sampling"]}} if apart else {}),
        **{name: f"{name}.exr" for name in GEOMETRY},
        **({"seams": "seams.exr"} if prepared["seams"] else {}),
        **({"ambient": "ambient.exr"} if prepared["ambient"] else {}),
        "source": source,
    }
