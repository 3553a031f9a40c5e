"""What every method does alike for its receivers: geometry taken along, light vectors, sums over lights, the clamp and the ambient."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy import ndarray

import srbf
from srbf.arrays import Bool, Float32, Float64, Int
from srbf.asset import GEOMETRY, LAYERS, SCENE_FILE, Asset
from srbf.capture import Capture
from srbf.encode.dilation import dilate
from srbf.encode.uv_seams import Stitch
from srbf.errors import InputError
from srbf.lights import DirectionalLight, EnvironmentLight, Light, PointLight, SpotLight, attenuation, environment_samples, moved, spot_cone
from srbf.sphere import Domain, normalize

SEAM_LIGHTS = 32  # of the train lights, by which the seams of a fit are told
SEAM_TEXELS = 1 << 13  # that give the pictures' mean
CHUNK = 1 << 16  # receivers, or environment texels, weighed at a time: (CHUNK, K) float64 stays in cache-sized memory

Combine = Callable[[ndarray, slice], ndarray]  # (layers (N, h, W, C), rows) -> (h, W, 3)
Response = Callable[[ndarray, slice, ndarray], ndarray]  # (layers, rows, unit directions (h, W, 3)) -> (h, W, 3), for unit irradiance


def carried_images(capture: Capture, nearest: Int[ndarray, "H W"] | None) -> dict[str, ndarray]:
    """The receivers' images that go along with an asset, dilated as its layers are."""
    images: dict[str, ndarray] = {}
    for name in GEOMETRY:
        if name not in capture.manifest or (name == "albedo" and not needs_albedo(capture)):
            continue
        if name == "coverage":
            images[name] = capture.coverage()
        else:
            image = capture.ambient() if name == "ambient" else capture.geometry(name)  # type: ignore[arg-type]
            assert image is not None
            images[name] = dilate(image, nearest)
    return images


def common_manifest(
    capture: Capture, method: str, domain: Domain, images: dict[str, ndarray], settings: dict[str, Any], fit: dict[str, Any]
) -> dict[str, Any]:
    """The keys of asset.json that all methods write alike."""
    made = capture.manifest.get("source", {})
    return {
        "format": "srbf-asset",
        "version": 1,
        "method": method,
        "quantity": capture.quantity,
        "transport": capture.transport,
        "width": capture.width,
        "height": capture.height,
        "domain": domain,
        **{name: f"{name}.exr" for name in images},
        **_kept_apart(capture),
        "row_origin": "top",
        "axes": "z-up-right-handed",
        "asset_from_world": np.eye(4).tolist(),
        "source": {
            "srbf": srbf.__version__,
            **{key: capture.manifest[key] for key in ("receiver", "receivers") if key in capture.manifest},
            **{key: made[key] for key in ("scene_sha256",) if key in made},
            "settings": settings,
            "fit": {"train_lights": len(capture.indices("train")), **_elevations(capture), **_finite(fit)},
        },
    }


def sum_over_lights(asset: Asset, lights: Sequence[Light], projected: Combine | None, response: Response) -> Float32[ndarray, "H W 3"]:
    """Rows at a time: `folded` for all directional and environment lights together, `answer` for each point or spot light."""
    total = np.zeros((asset.height, asset.width, 3), np.float32)
    local = [point_light for light in lights if isinstance(point_light := moved(light, asset.asset_from_world), PointLight)]
    if local and "position" not in asset.images:
        raise InputError("point and spot lights need a position map, and this asset has none; relight it by directional lights")
    rows_per_chunk = max(1, CHUNK // asset.width)
    for start in range(0, asset.height if projected or local else 0, rows_per_chunk):
        rows = slice(start, start + rows_per_chunk)
        layers = asset.coefficients(rows)
        if projected is not None:
            total[rows] += projected(layers, rows)
        for light in local:
            unit, strength = light_vectors(light, asset.images["position"][rows])
            total[rows] += response(layers, rows, unit) * (strength[..., None] * light.color)
    return total


def light_vectors(light: PointLight, positions: Float32[ndarray, "*p 3"]) -> tuple[Float64[ndarray, "*p 3"], Float64[ndarray, "*p"]]:
    """Unit direction to the lamp and its strength, attenuation times a spot's cone, at `positions` of its frame [Wong2005, fig. 8-10]."""
    vectors = np.array(light.position) - positions  # L = S - P, eq. 3
    distance = np.linalg.norm(vectors, axis=-1)
    unit = vectors / np.maximum(distance, 1e-30)[..., None]
    strength = attenuation(distance, light)
    if isinstance(light, SpotLight):
        cos_angle = -(unit @ np.array(light.direction))
        strength = strength * spot_cone(cos_angle, np.cos(light.inner), np.cos(light.outer))
    return unit, strength


def distant_lights(asset: Asset, lights: Sequence[Light]) -> list[tuple[Float64[ndarray, "n 3"], Float64[ndarray, "n 3"]]]:
    """(unit directions in the asset's frame, colors) of directional lights, and of environments a piece of texels at a time.

    An environment's texels count radiance times solid angle over the captured domain: no cosine (T holds it), no normalization.
    """
    pieces = []
    suns = [light for light in lights if isinstance(light, DirectionalLight)]
    if suns:
        pieces.append((inside(asset, np.array([light.direction for light in suns])), np.array([light.color for light in suns])))
    for light in lights:
        if isinstance(light, EnvironmentLight):
            linear = asset.asset_from_world[:3, :3]
            rotation = linear / np.cbrt(np.linalg.det(linear))
            directions, solid_angle = environment_samples(light.image, asset.domain, rotation)
            height, width = light.image.shape[:2]
            rows_per_chunk = max(1, CHUNK // width)
            for start in range(0, height, rows_per_chunk):
                rows = slice(start, start + rows_per_chunk)
                radiance = light.image[rows] * solid_angle[rows, :, None] * np.array(light.color)
                pieces.append((directions[rows].reshape(-1, 3), radiance.reshape(-1, 3)))
    return pieces


def inside(asset: Asset, directions: Float64[ndarray, "n 3"]) -> Float64[ndarray, "n 3"]:
    """World directions in the asset's frame, unit."""
    return normalize(directions @ asset.asset_from_world[:3, :3].T)


def finish(asset: Asset, total: Float32[ndarray, "H W 3"]) -> Float32[ndarray, "H W 3"]:
    """max(0, sum over lights) + ambient, in place."""
    np.maximum(total, 0, out=total)
    if "ambient" in asset.images:
        total += asset.images["ambient"]
    return total


def outside_domain(asset: Asset, lights: Sequence[Light]) -> list[str]:
    """A line for each light that shines from where nothing was captured; such lights evaluate unchanged."""
    if asset.domain == "sphere":
        return _beyond_elevations(asset, lights)
    notes = []
    for i, light in enumerate(lights):
        light = moved(light, asset.asset_from_world)
        if isinstance(light, DirectionalLight) and light.direction[2] <= 0:
            notes.append(f"light {i} comes from below the captured hemisphere (z = {light.direction[2]:.3g}): its answer is extrapolated")
        elif isinstance(light, PointLight) and "position" in asset.images:
            heights = asset.images["position"][..., 2]
            below = float((light.position[2] <= heights[asset.covered]).mean()) if asset.covered.any() else 0.0
            if below > 0:
                notes.append(f"light {i} is below {below:.0%} of the receivers, outside the captured hemisphere: extrapolated there")
    return notes


def _elevations(capture: Capture) -> dict[str, Any]:
    """The lowest and the highest train light of a directional capture, radians above the horizon."""
    train = capture.indices("train")
    if not train or capture.kind != "directional":
        return {}
    elevations = np.arcsin(np.clip(capture.directions(train)[:, 2], -1, 1))
    return {"elevations": [float(elevations.min()), float(elevations.max())]}


def _beyond_elevations(asset: Asset, lights: Sequence[Light]) -> list[str]:
    """A line for each directional light farther above or below all train lights than they are from each other on a whole sphere.

    None for assets that do not say where their train lights were.
    """
    fit = asset.manifest["source"].get("fit", {})
    if "elevations" not in fit:
        return []
    lowest, highest = fit["elevations"]
    spacing = np.sqrt(4 * np.pi / fit["train_lights"])
    notes = []
    for i, light in enumerate(lights):
        light = moved(light, asset.asset_from_world)
        if not isinstance(light, DirectionalLight):
            continue
        elevation = float(np.arcsin(np.clip(light.direction[2] / np.linalg.norm(light.direction), -1, 1)))
        if not lowest - spacing <= elevation <= highest + spacing:
            notes.append(
                f"light {i} is at {np.degrees(elevation):.0f} degrees of elevation, far from all captured lights "
                f"({np.degrees(lowest):.0f} to {np.degrees(highest):.0f}): its response is extrapolated, likely black"
            )
    return notes


def seam_report(
    asset: Asset,
    capture: Capture,
    stitch: Stitch,
    loose: Float32[ndarray, "N n C"],
    respond: Callable[[Asset, np.ndarray], np.ndarray],
    loose_index: Int[ndarray, " n"] | None = None,
) -> dict[str, Any]:
    """What stitching did to the pictures: rms difference across the seams through a bilinear filter, over the pictures' mean.

    Under SEAM_LIGHTS of the train lights, unclamped, by a method's `respond` (its directional_responses): `before`, with the maps' own
    values `loose` of the stitch's texels (and clusters `loose_index`), and `after`, with those that the asset stores.
    """
    train = capture.indices("train")
    directions = capture.directions(train[:: -(-len(train) // SEAM_LIGHTS)])
    stitched = asset.at(stitch.texels)
    entries = [{**entry, "encoding": "float"} for entry in asset.layers]
    as_fitted = replace(
        stitched,
        manifest={**stitched.manifest, LAYERS[asset.method]: entries},
        stored=loose[:, None],
        scale=np.ones_like(asset.scale),
        bias=np.zeros_like(asset.bias),
        tables=stitched.tables if loose_index is None else {**stitched.tables, "cluster_index": loose_index[None].astype(np.uint8)},
    )
    covered = np.flatnonzero(asset.covered)
    mean = float(np.abs(respond(asset.at(covered[:: -(-len(covered) // SEAM_TEXELS)]), directions)).mean())
    gaps = {}
    for name, part in (("before", as_fitted), ("after", stitched)):
        relit = respond(part, directions)[:, 0].transpose(1, 0, 2)  # (n, b, 3)
        gaps[name] = stitch.difference(relit.reshape(len(relit), -1)) / max(mean, 1e-30)
    return {"edges": stitch.edges, "samples": stitch.samples, **gaps}


def covered_texels(capture: Capture) -> Bool[ndarray, " P"]:
    """Which texels, flat, have any coverage: the rest are filled from them."""
    return capture.coverage().ravel() > 0


def needs_albedo(capture: Capture) -> bool:
    """Direct light is added as irradiance; only radiance has the albedo in it."""
    return capture.transport == "indirect" and capture.quantity == "radiance"


def carried_scene(capture: Capture) -> bytes | None:
    """scene.glb of an indirect capture: what casts the shadows of the light to be added."""
    return capture.scene() if capture.transport == "indirect" and "scene" in capture.manifest else None


def _kept_apart(capture: Capture) -> dict[str, Any]:
    """What an indirect asset says of the direct light to be added: how it was sampled, and the scene that shadows it."""
    if capture.transport != "indirect":
        return {}
    keys = {"direct": capture.manifest["direct"]} if "direct" in capture.manifest else {}
    return {**keys, **({"scene": SCENE_FILE} if "scene" in capture.manifest else {})}


def _finite(report: dict[str, Any]) -> dict[str, Any]:
    """JSON has no infinity: an infinite condition number is written as null."""
    return {key: None if isinstance(value, float) and not np.isfinite(value) else value for key, value in report.items()}
