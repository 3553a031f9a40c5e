"""Everything that the page may ask for, by the name that it asks by."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

from srbf import files
from srbf.asset import MANIFEST, Asset
from srbf.capture import Capture
from srbf.export.web import shown_mesh
from srbf.viewer import facts
from srbf.viewer.built_page import page_files
from srbf.viewer.references import References

ASSET, CAPTURE = "asset/", "capture/"

Content = bytes | Path | Callable[[], bytes]


def read(content: Content) -> bytes:
    """The bytes of a file, or what is made when it is asked for."""
    if isinstance(content, Path):
        return content.read_bytes()
    return content if isinstance(content, bytes) else content()


def contents_of(folder: Path, capture: Path | None = None, mesh: Path | None = None) -> dict[str, Content]:
    """Everything the page may ask for of the asset in `folder`; what `Asset.open`, `Capture.open` and `page_files` raise."""
    page = page_files()
    asset = Asset.open(folder)
    references = None
    if capture is not None:
        references = References(Capture.open(capture))
        references.check(asset)
    notes: list[str] = []
    shown = shown_mesh(asset, mesh, notes)
    told = facts.facts(asset, ASSET, shown is not None, facts.title(folder), CAPTURE if references else None, tuple(notes))
    contents: dict[str, Content] = {"": page["index.html"], **page, facts.NAME: json.dumps(told).encode()}
    manifest = folder / MANIFEST
    for name in (MANIFEST, *asset.manifest.get("sha256", {}), *_named(asset)):
        path = files.inside(folder, name, manifest)
        if path.is_file():
            contents[ASSET + name] = path
    if shown is not None:
        contents[facts.MESH] = shown
    if references is not None:
        contents[f"{CAPTURE}lights.json"] = json.dumps(references.lights()).encode()
        for index in range(len(references.capture.lights)):
            contents[f"{CAPTURE}{index}.exr"] = _image(references, index)
    return contents


def _image(references: References, index: int) -> Callable[[], bytes]:
    return lambda: references.image(index)


def _named(asset: Asset) -> list[str]:
    """Files that asset.json names; an asset need not have checksums."""
    entries = [entry["file"] for entry in asset.layers]
    tables = [asset.manifest[name]["file"] for name in asset.tables]
    return [*entries, *tables, *(asset.manifest[name] for name in asset.images)]
