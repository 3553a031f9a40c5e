"""A capture or an asset in a few facts, after checking that its files are there and whole."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from srbf import asset as assets
from srbf import receiver_images
from srbf.asset import Asset
from srbf.capture import Capture
from srbf.captured_light import ROLES
from srbf.errors import ManifestError
from srbf.io.image import size_of
from srbf.methods import method_of

UNFINISHED = "bake.json"  # beside the manifest of a bake that can be resumed


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
        **({"unfinished": True} if (capture.folder / UNFINISHED).is_file() else {}),
        **(
            {"light_kind": capture.kind, "fitted_by": "none of the methods: they fit directional lights"} if capture.kind == "point" else {}
        ),
        **{key: capture.manifest[key] for key in ("receiver", "receivers") if key in capture.manifest},
        "disk_bytes": folder_bytes(capture.folder),
    }


def _samples(capture: Capture) -> dict[str, Any]:
    """The fewest samples per texel that a light of each role has, where the capture says so."""
    lights = capture.manifest["lights"]
    if not all("samples" in light for light in lights):
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
        "domain": asset.domain,
        "encoding": asset.encoding,
        **({"levels": asset.levels} if asset.levels > 1 else {}),
        "bytes_per_texel": asset.bytes_per_texel(),
        "resident_bytes": asset.resident_bytes(),
        "disk_bytes": folder_bytes(folder),
        "error": asset.manifest.get("error", {}),
    }


def folder_bytes(folder: Path) -> int:
    """Bytes of all files under a folder."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
