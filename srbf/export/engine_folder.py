"""The common part of every engine's export: its static files, and the asset's images in a folder that the engine's own importers ignore."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from srbf.asset import GEOMETRY, MANIFEST, Asset
from srbf.errors import ShaderError
from srbf.export import exr
from srbf.export.settings import Settings, Target
from srbf.io import files
from srbf.methods import method_of
from srbf.registry import method_named


def engine_root(name: str) -> Path:
    """The folder of an engine's static files: in an installed package, or beside the package in a checkout; ShaderError if in neither."""
    package = Path(__file__).resolve().parents[1]
    candidates = (package / "engines" / name, package.parent / "engines" / name)
    for folder in candidates:
        if folder.is_dir():
            return folder
    raise ShaderError(f"expected the files for {name} at {candidates[0]} or {candidates[1]}, found neither; install srbf again")


def write_asset(asset: Asset, folder: Path, data: str, settings: Settings, container: Target = exr.write) -> Asset:
    """Write the asset by a `container` below `folder`/`data`, and its asset.json in `folder`; returns the asset as written."""
    files.make_folder(folder / data)
    container(method_of(asset).with_plain_tables(asset), folder / data, settings)
    written = Asset.open(folder / data)
    files.write_json(folder / MANIFEST, below(data, files.read_json(folder / data / MANIFEST)))
    (folder / data / MANIFEST).unlink()
    return written


def below(data: str, manifest: dict[str, Any]) -> dict[str, Any]:
    """asset.json for files in `data` beside it."""
    moved = dict(manifest)
    method = method_named(manifest["method"])
    layers = method.layers
    moved[layers] = [{**entry, "file": f"{data}/{entry['file']}"} for entry in manifest[layers]]
    for key in method.tables:
        if key in manifest:
            moved[key] = {**manifest[key], "file": f"{data}/{manifest[key]['file']}"}
    for key in (*GEOMETRY, "scene"):
        if key in manifest:
            moved[key] = f"{data}/{manifest[key]}"
    if manifest.get("receiver", {}).get("kind") == "probes":
        receiver = manifest["receiver"]
        moved["receiver"] = {**receiver, **{key: f"{data}/{receiver[key]}" for key in ("places", "nearness")}}
    moved["sha256"] = {f"{data}/{name}": digest for name, digest in manifest["sha256"].items()}
    return moved
