"""A Godot 4 project: the asset, an addon that lights canvases and meshes by it, and an example that opens at once."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any

from srbf import files
from srbf.asset import GEOMETRY, LAYERS, MANIFEST, Asset
from srbf.errors import InputError, ShaderError
from srbf.gl.includes import resolve

DATA = "asset"  # the folder of the asset's images, which Godot's own importers are told to leave alone
ADDON = Path("addons/srbf")
METHODS = {"relighting-map": "relighting_map", "eigen-map": "eigen_map", "clustered-eigen-map": "clustered_eigen_map"}
ENTRIES = ("r_table", "w_table", "light_coefficients", "cluster_index")  # keys of asset.json that hold a file among other things

_PRECISION_STATEMENT = re.compile(r"^\s*precision\s+(?:high|medium|low)p\s+\w+\s*;.*\n?", re.MULTILINE)
_SAMPLER_PRECISION = re.compile(r"\b(?:high|medium|low)p\s+(?=[iu]?sampler)")
_DRIVER_LINE = re.compile(r"^\s*#\s*(?:version|line|extension)\b.*\n?", re.MULTILINE)
_OUTSIDE = re.compile(r"\blayout\s*\(|^\s*(?:in|out)\s|\bgl_\w+|\bvoid\s+main\b", re.MULTILINE)


def write(asset: Asset, folder: Path) -> None:
    """Fill an empty folder: `project.godot`, the addon with the shaders of all methods, `asset.json` with its images below `asset/`.

    InputError on relighting maps of other functions than Gaussians, which no shader knows.
    """
    if asset.method == "relighting-map" and asset.manifest["basis"]["kind"] != "gaussian":
        raise InputError(
            f"expected relighting maps of Gaussians for Godot, found {asset.manifest['basis']['kind']}; fit with --basis gaussian"
        )
    shutil.copytree(project_root(), folder, dirs_exist_ok=True, ignore=shutil.ignore_patterns(".godot", "*.uid", "*.import"))
    for name in METHODS.values():
        files.write_text(folder / ADDON / "shaders" / f"{name}.gdshaderinc", method_include(name))
    asset.save(folder / DATA)
    manifest = below(DATA, files.read_json(folder / DATA / MANIFEST))
    (folder / DATA / MANIFEST).unlink()
    files.write_json(folder / MANIFEST, manifest)
    files.write_text(folder / DATA / ".gdignore", "")
    files.write_text(folder / "asset.srbf", f"{MANIFEST}\n")


def below(folder: str, manifest: dict[str, Any]) -> dict[str, Any]:
    """asset.json of files that lie in `folder` beside it."""
    moved = dict(manifest)
    layers = LAYERS[manifest["method"]]
    moved[layers] = [{**entry, "file": f"{folder}/{entry['file']}"} for entry in manifest[layers]]
    for key in ENTRIES:
        if key in manifest:
            moved[key] = {**manifest[key], "file": f"{folder}/{manifest[key]['file']}"}
    for key in (*GEOMETRY, "scene"):
        if key in manifest:
            moved[key] = f"{folder}/{manifest[key]}"
    moved["sha256"] = {f"{folder}/{name}": digest for name, digest in manifest["sha256"].items()}
    return moved


def method_include(name: str) -> str:
    """A method of the shader pack, includes in place, in Godot's shading language: the text of a .gdshaderinc."""
    guard = f"SRBF_{name.upper()}_INCLUDED"
    text = translated(resolve(f"methods/{name}.glsl").text)
    head = f"// SPDX-License-Identifier: MIT\n// Made of glsl/methods/{name}.glsl and what it includes by srbf export --target godot.\n"
    return f"{head}#ifndef {guard}\n#define {guard}\n{text}#endif\n"


def translated(text: str) -> str:
    """GLSL functions as Godot's shading language takes them: without what only a driver reads, and without precisions of samplers.

    ShaderError on what belongs to a stage (main, in, out, gl_…): Godot writes those itself.
    """
    for rule in (_DRIVER_LINE, _PRECISION_STATEMENT, _SAMPLER_PRECISION):
        text = rule.sub("", text)
    code = re.sub(r"/\*.*?\*/|//[^\n]*", "", text, flags=re.DOTALL)
    if found := _OUTSIDE.search(code):
        raise ShaderError(f"expected functions alone for Godot, found {found[0].strip()!r}; translate an include of glsl/, not a stage")
    return text


def project_root() -> Path:
    """The folder of the example project: in an installed package, or beside the package in a checkout; ShaderError if in neither."""
    package = Path(__file__).resolve().parents[1]
    candidates = (package / "engines" / "godot", package.parent / "engines" / "godot")
    for folder in candidates:
        if (folder / "project.godot").is_file():
            return folder
    raise ShaderError(f"expected Godot's project at {candidates[0]} or {candidates[1]}, found neither; install srbf again")
