"""What an asset takes along from its capture beside the layers: images of the receivers, the manifest's common keys, the scene."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy import ndarray

import srbf
from srbf.arrays import Int
from srbf.asset import GEOMETRY, SCENE_FILE
from srbf.capture import Capture
from srbf.encode.dilation import dilate
from srbf.errors import InputError
from srbf.light_domain import LightDomain

OWN_LIGHTS = ("scene_lights", "scene_lights_left_out", "scene_profiles")  # keys of capture.json and asset.json


def carried_images(capture: Capture, nearest: Int[ndarray, "H W"] | None) -> dict[str, ndarray]:
    """The receivers' images that go along with an asset, dilated as its layers are."""
    images: dict[str, ndarray] = {}
    for name in GEOMETRY:
        known = name in capture.manifest or name in capture.manifest.get("channels", {})
        if not known or (name == "albedo" and not needs_albedo(capture)):
            continue
        if name == "coverage":
            images[name] = capture.coverage()
        else:
            image = capture.ambient() if name == "ambient" else capture.channel(name)
            assert image is not None
            images[name] = dilate(image, nearest)
    return images


def common_manifest(
    capture: Capture, method: str, domain: LightDomain, images: dict[str, ndarray], settings: dict[str, Any], fit: dict[str, Any]
) -> dict[str, Any]:
    """The keys of asset.json that all methods write."""
    made = capture.manifest.get("source", {})
    bake = {key: made["settings"][key] for key in ("scene", "keep_scene_lights") if made.get("settings", {}).get(key)}
    return {
        "format": "srbf-asset",
        "version": 1,
        "method": method,
        "quantity": capture.quantity,
        "transport": capture.transport,
        "width": capture.width,
        "height": capture.height,
        **domain.manifest(),
        **{key: capture.manifest[key] for key in ("receiver", "receivers", *OWN_LIGHTS) if key in capture.manifest},
        **{name: f"{name}.exr" for name in images},
        **_kept_apart(capture),
        "row_origin": "top",
        "axes": "z-up-right-handed",
        "asset_from_world": np.eye(4).tolist(),
        "source": {
            "srbf": srbf.__version__,
            **{key: made[key] for key in ("scene_sha256",) if key in made},
            **({"bake": bake} if bake else {}),
            "settings": settings,
            "fit": {
                "train_lights": len(capture.indices("train")),
                **(domain.extent(domain.captured(capture, capture.indices("train"))) if capture.kind == "directional" else {}),
                **_finite(fit),
            },
        },
    }


def needs_albedo(capture: Capture) -> bool:
    """Direct light is added as irradiance; only radiance has the albedo in it."""
    return capture.transport == "indirect" and capture.quantity == "radiance"


def carried_scene(capture: Capture) -> bytes | None:
    """scene.glb of an indirect capture: what casts the shadows of the light to be added."""
    return capture.scene() if capture.transport == "indirect" and "scene" in capture.manifest else None


def required_scene(capture: Capture) -> bytes:
    """`carried_scene`; InputError where there is none."""
    scene = carried_scene(capture)
    if scene is None:
        raise InputError(f"expected scene.glb in {capture.folder}, found none: lights need what casts shadows; bake again")
    return scene


def _kept_apart(capture: Capture) -> dict[str, Any]:
    """What an indirect asset says of the direct light to be added: how it was sampled, and the scene that shadows it."""
    if capture.transport != "indirect":
        return {}
    keys = {"direct": capture.manifest["direct"]} if "direct" in capture.manifest else {}
    return {**keys, **({"scene": SCENE_FILE} if "scene" in capture.manifest else {})}


def _finite(report: dict[str, Any]) -> dict[str, Any]:
    """JSON has no infinity: an infinite condition number is written as null."""
    return {key: None if isinstance(value, float) and not np.isfinite(value) else value for key, value in report.items()}
