"""A Godot 4 project: the asset, an addon that lights canvases and meshes with it, and a ready example."""

from __future__ import annotations

import re
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from srbf.asset import MANIFEST, Asset
from srbf.errors import ShaderError
from srbf.export import dds, exr, png
from srbf.export.asset_shader import LAST, WEIGHTED
from srbf.export.engine_folder import below, engine_root
from srbf.export.settings import PLAIN, Settings, Target, Written
from srbf.export.surfel_textures import terms_of
from srbf.gl.includes import resolve_text
from srbf.io import files
from srbf.io.image import write_image
from srbf.methods import method_of
from srbf.methods.surface_changes import KEY, Surfaces

DATA = "asset"  # the folder of the asset's images, hidden from Godot's own importers
IMPORTED = "asset.srbf"  # the file that Godot imports: it holds the path of asset.json
MODEL = "model.glb"  # shown by the example instead of the asset's texels
SERIES = "surface_series.exr"
SHADERS = Path("addons/srbf/shaders")
PROBES = "probes/probe_irradiance.glsl"
SURFELS = tuple(f"surfels/{name}.glsl" for name in ("table_part", "block_sum", "matrix_product", "changed_exchange", "repainted_entry"))
WRITERS: dict[str, Target] = {"half": exr.write, "float": exr.write, "uint8": png.write, "bc7": dds.write, "bc1": dds.write}

_PRECISION_STATEMENT = re.compile(r"^\s*precision\s+(?:high|medium|low)p\s+\w+\s*;.*\n?", re.MULTILINE)
_SAMPLER_PRECISION = re.compile(r"\b(?:high|medium|low)p\s+(?=[iu]?sampler)")
_DRIVER_LINE = re.compile(r"^\s*#\s*(?:version|line|extension)\b.*\n?", re.MULTILINE)
_OUTSIDE = re.compile(r"\blayout\s*\(|^\s*(?:in|out)\s|\bgl_\w+|\bvoid\s+main\b", re.MULTILINE)


def write(asset: Asset, folder: Path, settings: Settings = PLAIN) -> Written:
    """Fill an empty folder: `project.godot`, the addon with the shaders of all methods, `asset.json` with its images below `asset/`.

    Layers are EXRs (half, float), PNGs (uint8) or one DDS (bc7, bc1, and whatever has mip levels); the encoding in memory is kept unless
    `settings` name another. The mesh of `settings`, whose TEXCOORD_1 is the lightmap's, becomes the example's. InputError on relighting
    maps of other functions than Gaussians, which no shader knows.
    """
    method_of(asset).shader_parts(asset)  # refuses what no shader knows
    shutil.copytree(engine_root("godot"), folder, dirs_exist_ok=True, ignore=shutil.ignore_patterns(".godot", "*.uid", "*.import"))
    for name in WEIGHTED:
        files.write_text(folder / SHADERS / f"{name}.gdshaderinc", method_include(name))
        files.write_text(folder / SHADERS / f"{name}_weighted.gdshaderinc", weighted_include(name))
    files.write_text(folder / SHADERS / f"{Path(PROBES).stem}.gdshaderinc", _include(Path(PROBES).stem, PROBES, ()))
    files.write_text(folder / SHADERS / "surfels.gdshaderinc", _include("surfels", SURFELS[0], SURFELS[1:]))
    files.make_folder(folder / DATA)
    encoding = settings.encoding or asset.held
    writer = WRITERS[encoding] if settings.levels in ("auto", 0, 1) else dds.write
    asset = method_of(asset).with_plain_tables(asset)
    notes = writer(asset, folder / DATA, Settings(encoding, settings.levels)).notes
    manifest = below(DATA, files.read_json(folder / DATA / MANIFEST)) | _series(asset, folder)
    (folder / DATA / MANIFEST).unlink()
    files.write_json(folder / MANIFEST, manifest)
    files.write_text(folder / DATA / ".gdignore", "")
    files.write_text(folder / IMPORTED, f"{MANIFEST}\n")
    if settings.mesh is not None:
        shutil.copy(settings.mesh, folder / MODEL)
    return Written((*notes, "docs/engines/godot.md: open the folder as a project, or copy addons/srbf, asset/ and asset.* into one"))


def _series(asset: Asset, folder: Path) -> dict[str, Any]:
    """Of an asset whose surfaces can change, what GDScript would take long to solve: all exchanges of light, half floats over `scale`.

    `terms`: how many of them are summed after a change.
    """
    if KEY not in asset.manifest:
        return {}
    surfaces = Surfaces.of(asset)
    series = surfaces.series()
    scale = float(2.0 ** np.ceil(np.log2(np.abs(series).max())))
    write_image(folder / DATA / SERIES, series / np.float32(scale), "half")
    return {"surface_series": {"file": f"{DATA}/{SERIES}", "scale": scale, "terms": terms_of(surfaces)}}


def method_include(name: str) -> str:
    """A method of the shader pack for all lights at once, includes in place, in Godot's shading language: the text of a .gdshaderinc."""
    return _include(name, f"methods/{name}_lights.glsl")


def weighted_include(name: str) -> str:
    """The same for assets all of whose lights are in the weights."""
    return _include(f"{name}_weighted", WEIGHTED[name])


def _include(name: str, path: str, last: Sequence[str] = LAST) -> str:
    source = "".join(f'#include "{part}"\n' for part in (path, *last))
    text = translated(resolve_text(source, name).text)
    guard = f"SRBF_{name.upper()}_INCLUDED"
    head = f"// SPDX-License-Identifier: MIT\n// From glsl/{path} and its includes, by srbf export --target godot.\n"
    return f"{head}#ifndef {guard}\n#define {guard}\n{text}#endif\n"


def translated(text: str) -> str:
    """GLSL functions in Godot's shading language: without lines for drivers, and without precisions of samplers.

    ShaderError on what belongs to a stage (main, in, out, gl_…): Godot writes those itself.
    """
    for rule in (_DRIVER_LINE, _PRECISION_STATEMENT, _SAMPLER_PRECISION):
        text = rule.sub("", text)
    code = re.sub(r"\([^()]*\)", "()", re.sub(r"/\*.*?\*/|//[^\n]*", "", text, flags=re.DOTALL))  # parameters may be in or out
    if found := _OUTSIDE.search(code):
        raise ShaderError(f"expected only functions for Godot, found {found[0].strip()!r}; translate an include of glsl/, not a stage")
    return text
