"""`viewer.json`: what the page is told before it reads an asset."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from srbf.asset import Asset
from srbf.viewer.camera import fitted_camera

NAME = "viewer.json"
MESH = "mesh.glb"


def facts(asset: Asset, folder: str, mesh: bool, title: str, capture: str | None = None, notes: tuple[str, ...] = ()) -> dict[str, Any]:
    """`folder` is where the page finds asset.json, `capture` where it finds lights.json, both as it would follow a link."""
    view = receiver_kind(asset) == "view"
    camera = fitted_camera(asset) if view else None
    return {
        "title": title,
        "asset": folder,
        "kind": "view" if view else "lightmap",
        "mesh": MESH if mesh else None,
        "capture": capture,
        "camera": None
        if camera is None
        else {"position": camera.position.tolist(), "rotation": camera.rotation.tolist(), "lens": camera.lens.tolist()},
        "resident_bytes": asset.resident_bytes(),
        "notes": list(notes),
    }


def receiver_kind(asset: Asset) -> str:
    """`view`, `lightmap` or `vertices`, as the asset's source says; a picture of which nothing is known is a view."""
    kind = asset.manifest.get("source", {}).get("receiver", {}).get("kind")
    return str(kind) if kind else "view"


def receiver_name(asset: Asset) -> str:
    """The object or camera that the asset was baked for."""
    receiver = asset.manifest.get("source", {}).get("receiver", {})
    return str(receiver.get("object") or receiver.get("camera") or asset.method)


def title(folder: Path) -> str:
    """What to call the asset in `folder`: the folder's name, or that of the one it lies in where it is just `asset`."""
    path = folder.resolve()
    return path.parent.name if path.name == "asset" and path.parent.name else path.name
