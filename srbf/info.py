"""A capture or an asset in a few facts, after checking that its files are there and whole."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from srbf import asset as assets
from srbf import receiver_images
from srbf.asset import Asset
from srbf.capture import Capture
from srbf.captured_light import ROLES
from srbf.errors import ManifestError
from srbf.io.image import size_of
from srbf.light_domain import domain_of_asset
from srbf.methods import method_of
from srbf.methods.carried import OWN_LIGHTS
from srbf.methods.kept_visibility import SETS

UNFINISHED = "bake.json"  # beside the manifest of a bake that can be resumed
OF_PATCHES = ("point", "spot", "area", "sphere", "directional", "environment")  # light kinds that patches can express
OF_PLACES = ("point", "sphere")  # those that a kernel over captured point lights can


def describe(path: Path) -> dict[str, Any]:
    """Facts of the folder at `path`; ManifestError where it is neither, ImageError where a file of it is damaged."""
    if (path / receiver_images.MANIFEST).is_file():
        return describe_capture(Capture.open(path))
    if (path / assets.MANIFEST).is_file():
        return describe_asset(Asset.open(path), path)
    raise ManifestError(f"expected a folder with a capture.json or an asset.json at {path}, found neither")


def describe_capture(capture: Capture) -> dict[str, Any]:
    """Size, lights by role, receiver and disk of a capture; every image's header is read."""
    for light in capture.lights:
        if light.column is not None:  # which has no image
            continue
        size_of(capture.folder / light.file)
        if light.direct is not None:
            size_of(capture.folder / light.direct)
    return {
        "format": "srbf-capture",
        "version": 1,
        "quantity": capture.quantity,
        "transport": capture.transport,
        "width": capture.width,
        "height": capture.height,
        "lights": {role: len(capture.indices(role)) for role in ROLES},
        **_samples(capture),
        **({"cubemap": capture.manifest["cubemap"]} if capture.is_cubemap else {}),
        **({"unfinished": True} if (capture.folder / UNFINISHED).is_file() else {}),
        **_kinds(capture),
        **{key: capture.manifest[key] for key in ("receiver", "receivers") if key in capture.manifest},
        "disk_bytes": folder_bytes(capture.folder),
    }


def _kinds(capture: Capture) -> dict[str, Any]:
    """What lights other than directional ones are, and where: kinds, names, free space (m), patches and their cells."""
    if capture.kind == "directional":
        return {}
    manifest = capture.manifest
    facts: dict[str, Any] = {"light_kind": capture.kind, "light_kinds": dict(Counter(light.kind for light in capture.lights))}
    if names := [light.name for light in capture.lights if light.name is not None]:
        facts["names"] = names
    if "free_places" in manifest:
        facts["free_space"] = _box(manifest["free_places"])
        facts |= _own_lights(manifest)
    elif capture.kind == "point":
        facts["fitted_by"] = "none of the methods: they fit directional lights, named ones, and point lights with free places"
    if "patches" in manifest:
        facts["patches"] = manifest["patches"]["count"]
        facts["cells"] = size_of(capture.folder / manifest["patches"]["file"])[1]
    return facts


def _samples(capture: Capture) -> dict[str, Any]:
    """The fewest samples per texel that a light of each role has, where the capture says so."""
    lights = capture.manifest["lights"]
    if capture.is_cubemap or not all("samples" in light for light in lights):
        return {}
    return {
        "samples": {role: min(light["samples"] for light in lights if light["role"] == role) for role in ROLES if capture.indices(role)}
    }


def describe_asset(asset: Asset, folder: Path) -> dict[str, Any]:
    """Method, basis, error and memory of an asset.

    `bytes_per_texel` is, per light kind, what a shader reads of a texel's own maps (RGB counts as RGBA, position excluded);
    `resident_bytes` is everything the asset keeps on a GPU, tables included.
    """
    return {
        "format": "srbf-asset",
        "version": 1,
        "method": asset.method,
        "quantity": asset.quantity,
        "transport": asset.transport,
        "width": asset.width,
        "height": asset.height,
        **method_of(asset).describe(asset),
        **light_facts(asset),
        **({"receiver": asset.receiver} if asset.probes is not None else {}),
        "encoding": asset.encoding,
        **({"levels": asset.levels} if asset.levels > 1 else {}),
        "bytes_per_texel": bytes_by_light(asset),
        "resident_bytes": asset.resident_bytes(),
        "disk_bytes": folder_bytes(folder),
        "error": asset.manifest.get("error", {}),
    }


def light_facts(asset: Asset) -> dict[str, Any]:
    """What an asset says of its lights' domain: for directions the part of the sphere, else the kind, and what lights inside need."""
    manifest, kind = asset.manifest, domain_of_asset(asset.manifest).kind
    if kind == "directions":
        return {"domain": asset.domain}
    facts: dict[str, Any] = {"light_domain": kind}
    if "interpolation" in manifest:
        facts["interpolation"] = manifest["interpolation"]["kind"]
    if manifest.get("free_places"):
        facts["free_space"] = _box(manifest["free_places"])
    facts |= _own_lights(manifest)
    if "cells" in asset.tables:
        cells = asset.tables["cells"]  # (2, N, 4)
        facts |= {"patches": int(cells[1, :, 3].max(initial=-1)) + 1, "cells": cells.shape[1]}
    if "position_table" in manifest:
        told = manifest["position_table"]
        size = sum(table.nbytes for name, table in asset.tables.items() if name.startswith("position_"))
        facts["position_table"] = {"nodes": told["nodes"], "spacing": told["spacing"], "rank": told["rank"], "bytes": size}
    if "environment_transfer" in manifest:
        told = manifest["environment_transfer"]
        facts["environment"] = {"cells": len(told["cells"]), "of": told["side"] ** 2, "bytes": asset.tables["environment_transfer"].nbytes}
    for kind in SETS:
        if kind in manifest:
            told = manifest[kind]
            size = sum(table.nbytes for name, table in asset.tables.items() if name.startswith(f"{kind}_"))
            facts[kind] = {**{key: told[key] for key in ("points", "coefficients", "clusters")}, "bytes": size}
    return facts


def _own_lights(manifest: dict[str, Any]) -> dict[str, Any]:
    """Names of the scene's own lights, and of those left out."""
    return {key: [one["name"] for one in manifest[key]] for key in OWN_LIGHTS if manifest.get(key)}


def bytes_by_light(asset: Asset) -> dict[str, int | float]:
    """`Asset.bytes_per_texel` by the kinds of light that the asset's domain has: the same bytes for each."""
    found, kind = asset.bytes_per_texel(), domain_of_asset(asset.manifest).kind
    if kind == "directions":
        return found
    own = max(found.values())
    if kind == "named":
        return {"named": own}
    by_kernel = asset.manifest.get("interpolation", {}).get("kind") == "kernel"
    return dict.fromkeys(OF_PLACES if by_kernel else OF_PATCHES, own)


def _box(places: Sequence[Sequence[float]]) -> dict[str, Any]:
    """Corners of the box of places, m, and how many they are."""
    points = np.array(places, np.float64).reshape(-1, 3)
    if not len(points):
        return {"places": 0}
    return {"low": np.round(points.min(axis=0), 4).tolist(), "high": np.round(points.max(axis=0), 4).tolist(), "places": len(points)}


def folder_bytes(folder: Path) -> int:
    """Bytes of all files under a folder."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
