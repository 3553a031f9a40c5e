"""The error of relighting by point lights: the same receivers under point lights of Cycles inside the scene."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray

from srbf import methods
from srbf.arrays import Float64
from srbf.asset import Asset
from srbf.bake.job import AMBIENT_SEED, base_job
from srbf.bake.light_sets import PlacedLight
from srbf.bake.planned_lights import PlannedLight, noise_seed
from srbf.bake.request import RenderRequest
from srbf.bake.settings import BakeSettings, Receiver
from srbf.bake.worker import Worker
from srbf.errors import InputError
from srbf.io import files
from srbf.lights import Falloff, Light, PointLight

FALLOFFS: tuple[Falloff, ...] = ("inverse-square", "linear")
DISTANCE_BINS = 6
MIDDLE = (0.1, 0.9)  # quantiles of the receivers' positions that bound the main part of the scene
DISTANCE = (0.1, 0.6)  # from a light to the receiver that it is placed before, in extents of that box


def compare_with_point_lights(
    asset: Asset,
    scene: Path,
    count: int,
    samples: int = 64,
    seed: int = 0,
    progress: Callable[[float, float], None] = lambda done, total: None,
    say: Callable[[str], None] = lambda line: None,
    blender: Path | None = None,
    direct: Callable[[Sequence[Light]], np.ndarray | None] = lambda lights: None,
) -> dict[str, Any]:
    """The error of relighting by point lights, by distance, against `count` random ones of unit irradiance at 1 m rendered by Cycles.

    For each falloff and distance bin: the relative RMSE with a0 = 1 m, and `scaled`, with the one global a0 that fits best.
    The asset's captured lights are directional, so occluders beyond a point light still cast shadows: this measures that approximation.
    direct: gives the direct light that an indirect asset leaves out, or None.
    Returns point_lights (positions, m), best_scale by falloff, all, by_distance. InputError for an asset without receivers, positions
    or coverage, or a missing scene; BakeError where Blender fails.
    """
    if count < 1 or samples < 1:
        raise InputError(f"expected at least 1 point light and 1 sample, found {count} and {samples}")
    if not asset.covered.any():
        raise InputError("expected covered texels in the asset, found none")
    if "position" not in asset.images:
        raise InputError("expected an asset with a position map for a comparison with point lights, found none")
    described = asset.receivers
    if not described:
        raise InputError("expected an asset baked from a scene, found one that names no receiver")
    if not scene.is_file():
        raise InputError(f"expected a .blend at {scene}, found no such file")
    baked = asset.manifest["source"].get("scene_sha256")
    if baked not in (None, files.sha256_of(scene)):
        say(f"{scene.name} has changed since this asset's capture was baked: the comparison is of two different scenes")
    covered = asset.covered
    positions = asset.images["position"][covered]  # (p, 3)
    point_lights = point_light_positions(asset, count, seed)
    chosen = asset.manifest["source"].get("settings", {}).get("scene")
    settings = BakeSettings(Receiver.of_manifest(described), asset.width, asset.height, quantity=asset.quantity, scene=chosen)
    references = render_point_lights(scene, settings, point_lights, samples, seed, progress, say, blender)
    distances: list[np.ndarray] = []
    errors: dict[Falloff, list[tuple[np.ndarray, np.ndarray]]] = {falloff: [] for falloff in FALLOFFS}
    for point_light, reference in zip(point_lights, references, strict=True):
        distances.append(np.linalg.norm(point_light - positions, axis=1))
        for falloff in FALLOFFS:
            lights = [PointLight(tuple(point_light), falloff=falloff)]
            relit = methods.relight(asset, lights, direct(lights))
            if "ambient" in asset.images:
                relit = relit - asset.images["ambient"]
            errors[falloff].append((relit[covered], reference[covered]))
    return _by_distance(np.concatenate(distances), errors, point_lights)


def point_light_positions(asset: Asset, count: int, seed: int) -> np.ndarray:
    """(count, 3) positions inside the scene, m: before a random receiver, along its normal, by a random fraction of the scene's extent.

    The extent, and the receivers to choose from, are those of the box that holds the middle 80 % of the receivers on each axis, so that
    a view's horizon does not count.
    """
    rng = np.random.default_rng(seed)
    covered = asset.covered
    positions = asset.images["position"][covered].astype(np.float64)
    normals = asset.images["normal"][covered] if "normal" in asset.images else np.broadcast_to([0, 0, 1], positions.shape)
    low, high = np.quantile(positions, MIDDLE, axis=0)
    near = np.flatnonzero(((positions >= low) & (positions <= high)).all(axis=1))
    chosen = rng.choice(near if len(near) else np.arange(len(positions)), count)
    distance = float((high - low).max()) * rng.uniform(*DISTANCE, count)
    return positions[chosen] + normals[chosen] * distance[:, None]


def render_point_lights(
    scene: Path,
    settings: BakeSettings,
    point_lights: Float64[ndarray, "n 3"],
    samples: int,
    seed: int = 0,
    progress: Callable[[float, float], None] = lambda done, total: None,
    say: Callable[[str], None] = lambda line: None,
    blender: Path | None = None,
) -> list[np.ndarray]:
    """The receivers of `settings` under point lights at places (m) of unit irradiance at 1 m, by Cycles, without the scene's own light."""
    lights = [
        PlannedLight(i, PlacedLight("point", tuple(place.tolist())), "holdout", samples, noise_seed(seed, i))
        for i, place in enumerate(point_lights)
    ]
    requests = [RenderRequest(light, light.samples, light.seed) for light in lights]
    images: list[np.ndarray] = []
    residual: np.ndarray | float = 0.0
    with tempfile.TemporaryDirectory(prefix="srbf-") as name:
        scratch = Path(name)
        ambient = RenderRequest(None, samples, noise_seed(seed, AMBIENT_SEED))
        job = {**base_job(scene, settings, scratch, requests), "ambient": ambient.message()}
        with Worker(job, scratch, scratch / "bake.log", blender) as worker:
            for event in worker.events(say):
                if event["event"] == "rendered":
                    images.append(np.maximum(np.load(scratch / event["files"]["response"]) - residual, 0))
                    progress(len(images), len(lights))
                elif event["event"] == "image" and event["name"] == "residual":
                    residual = np.load(scratch / event["file"])
    return images


def _by_distance(
    distance: np.ndarray, pairs: dict[Falloff, list[tuple[np.ndarray, np.ndarray]]], point_lights: np.ndarray
) -> dict[str, Any]:
    edges = np.quantile(distance, np.linspace(0, 1, DISTANCE_BINS + 1))
    which = np.clip(np.searchsorted(edges, distance, side="right") - 1, 0, DISTANCE_BINS - 1)
    measured: dict[str, tuple[np.ndarray, np.ndarray, float]] = {}
    for falloff, images in pairs.items():
        relit = np.concatenate([a for a, _ in images]).astype(np.float64)
        reference = np.concatenate([b for _, b in images]).astype(np.float64)
        measured[falloff] = (relit, reference, float((relit * reference).sum() / max((relit**2).sum(), 1e-30)))

    def errors(mask: np.ndarray | slice) -> dict[str, Any]:
        row: dict[str, Any] = {}
        for falloff, (relit, reference, scale) in measured.items():
            power = max(float((reference[mask] ** 2).mean()), 1e-30)
            row[falloff] = {
                "relative_rmse": float(np.sqrt(((relit[mask] - reference[mask]) ** 2).mean() / power)),
                "scaled": float(np.sqrt(((scale * relit[mask] - reference[mask]) ** 2).mean() / power)),
            }
        return row

    return {
        "point_lights": point_lights.tolist(),
        "best_scale": {falloff: scale for falloff, (_, _, scale) in measured.items()},
        "all": errors(slice(None)),
        "by_distance": [
            {"from": float(edges[i]), "to": float(edges[i + 1]), "texels": int((which == i).sum()), **errors(which == i)}
            for i in range(DISTANCE_BINS)
            if (which == i).any()
        ],
    }
