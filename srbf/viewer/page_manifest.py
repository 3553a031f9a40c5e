"""`viewer.json`: the page's configuration, read before the assets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from srbf.asset import Asset
from srbf.evaluation.rate_distortion import family_of, name_of
from srbf.viewer.camera import fitted_camera

NAME = "viewer.json"
MESH = "mesh.glb"
SPECTRUM = "spectrum.json"


def facts(
    asset: Asset,
    assets: list[dict[str, Any]],
    mesh: bool,
    title: str,
    capture: str | None = None,
    notes: tuple[str, ...] = (),
    probes: str | None = None,
    cycles: dict[str, Any] | None = None,
    environments: Mapping[str, str] | None = None,
) -> dict[str, Any]:
    """Of the first asset's receivers; `assets` as `described`; `capture`: where the page finds lights.json, as it would follow a link;
    `probes`: the folder of an asset of probes; `cycles`: `CyclesRenders.facts`; `environments`: where the page finds maps,
    by their names."""
    view = asset.receiver_kind == "view"
    camera = fitted_camera(asset) if view else None
    return {
        "title": title,
        "assets": assets,
        "kind": "view" if view else "lightmap",
        "mesh": MESH if mesh else None,
        "capture": capture,
        "probes": probes,
        "cycles": cycles,
        "environments": dict(environments or {}),
        "camera": None
        if camera is None
        else {"position": camera.position.tolist(), "rotation": camera.rotation.tolist(), "lens": camera.lens.tolist()},
        "notes": list(notes),
    }


def described(asset: Asset, name: str, folder: str, spectrum: str, errors: str | None = None) -> dict[str, Any]:
    """One asset: what it is called, where the page finds asset.json, its spectrum, and its errors by light; what it takes."""
    return {
        "name": name,
        "folder": folder,
        "resident_bytes": asset.resident_bytes(),
        "bytes_per_texel": asset.bytes_per_texel()["directional"],
        "spectrum": spectrum,
        "errors": errors,
    }


def names(assets: Sequence[Asset], folders: Sequence[Path]) -> list[str]:
    """Names of assets: their method and size, and the folder's name where two are the same."""
    told = [f"{family_of(asset)}, {name_of(asset)}" for asset in assets]
    return [f"{folder.resolve().name}: {name}" if told.count(name) > 1 else name for folder, name in zip(folders, told, strict=True)]


def receiver_name(asset: Asset) -> str:
    """The object or camera that the asset was baked for."""
    return str(asset.receiver.get("object") or asset.receiver.get("camera") or asset.method)


def title(folders: Sequence[Path]) -> str:
    """What to call the assets in `folders`: the one folder's name; that of the folder it lies in where it is just `asset`, or where
    several lie there together."""
    paths = [folder.resolve() for folder in folders]
    together = len(paths) > 1 and len({path.parent for path in paths}) == 1
    return paths[0].parent.name if (together or paths[0].name == "asset") and paths[0].parent.name else paths[0].name
