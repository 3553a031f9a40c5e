"""What an Unreal export has for surfels: textures, the passes as Custom nodes, and numbers for the component that draws them."""

from __future__ import annotations

import hashlib
import shutil
import struct
from pathlib import Path
from typing import Any

import numpy as np

from srbf.asset import Asset
from srbf.export.engine_folder import engine_root
from srbf.export.hlsl import include as pack_include
from srbf.export.light_tables import weights_shape
from srbf.export.surfel_textures import folded, surfel_textures, write_surfels
from srbf.io import files
from srbf.io.image import Encoding, read_image, write_image
from srbf.methods.kept_visibility import kept_visibility
from srbf.visibility.pca_textures import pca_textures
from srbf.visibility.pca_visibility import PcaVisibility
from srbf.visibility.surface_cells import Cells

MAGIC = b"SRBFSRF2"
NUMBERS = "SrbfSurfels.bin"
SOURCES = ("SrbfSurfels.h", "SrbfSurfelLights.h", "SrbfSurfelLights.cpp", "SrbfSurfelShapes.cpp")
PACK = [
    *(f"surfels/{name}.glsl" for name in ("cell_irradiance", "cell_on_cube", "cell_on_map", "patch_mean", "table_part", "block_sum")),
    *(f"surfels/{name}.glsl" for name in ("environment_cell", "matrix_product", "changed_exchange", "repainted_entry")),
    "shadow/hemisphere_place.glsl",
    "shadow/pca_visibility.glsl",
]
LIGHT = ["Light", "Color", "Axis", "Shape", "Space"]
FACES = [f"Face{face}" for face in range(6)]
DEPTHS = ["Coefficients", "Bases", "Clusters"]
_CELL = """int3 Texel = SrbfTexel(UV, Size);
float4 Cell = Places.Load(Texel);
float3 Normal = Normals.Load(Texel).xyz;
float3 Sum = Former.Load(Texel).rgb;
float Amount = SrbfOnCell(Cell, Normal, Light, Axis, Shape);
if (Amount <= 0.0) return Sum;
"""
BY_DEPTHS = _CELL + (
    "float Seen = SrbfSeenByDepths(Coefficients, Bases, Clusters.Load(Texel).r, SrbfIndex(Texel, Size), Cell, Normal, Light, Space);\n"
    "return Sum + Seen * Amount * Color.rgb;"
)
BY_FACES = _CELL + (
    f"float Seen = SrbfSeenByFaces({', '.join(FACES)}, Cell, Normal, Light, Across, Up, Space);\nreturn Sum + Seen * Amount * Color.rgb;"
)
MEANS = "return srbfPatchMean(Irradiance, Normals, Ranges, SrbfTexel(UV, Size).xy);"
PARTS = """int4 Sizes = int4(Entries + 0.5);
return srbfTablePart(Table, Numbers, Sizes.x, Sizes.y, Sizes.z, false, SrbfIndex(SrbfTexel(UV, Size), Size)) * Entries.w;"""
SUMS = "return srbfBlockSum(Parts, int(Entries.z + 0.5), SrbfIndex(SrbfTexel(UV, Size), Size));"

SUMS_ADDED = """int Row = SrbfIndex(SrbfTexel(UV, Size), Size);
return srbfBlockSum(Parts, int(Entries.z + 0.5), Row) + Added.Load(int3(0, min(Row, int(Entries.x + 0.5) - 1), 0)).rgb;"""
# Matrix: columns of the first matrix, scales of the product and of what is added to it.
CELLS = """int Cell = int(Cells.Load(int3(0, SrbfTexel(UV, Size).y, 0)).r + 0.5);
return srbfEnvironmentCell(Environment, Ahead.xyz, Left.xyz, Up.xyz, Cell, int(Ahead.w + 0.5)) * Up.w;"""
PRODUCT = """int3 Texel = SrbfTexel(UV, Size);
return srbfMatrixProduct(First, Second, int(Matrix.x + 0.5), Texel.xy) * Matrix.y + Addend.Load(Texel).rgb * Matrix.z;"""
EXCHANGE = """int3 Texel = SrbfTexel(UV, Size);
return srbfChangedExchange(Gather, Sent, Albedo, int(Matrix.x + 0.5), Texel.xy) * Matrix.y + Feedback.Load(Texel).rgb * Matrix.z;"""
REPAINTED = """int3 Texel = SrbfTexel(UV, Size);
float3 Changed = srbfRepaintedEntry(Before, Series, Gather, Albedo, int(Matrix.x + 0.5), 1.0, Texel.xy);
return Changed * Matrix.y + Table.Load(Texel).rgb * Matrix.z;"""


def write_unreal_surfels(asset: Asset, folder: Path, data: str) -> dict[str, Any]:
    """Write textures below `folder`/`data`, `Shaders/SrbfSurfels_*.ush`, `SrbfSurfels.bin` and the component's source; returns the passes.

    `materials`: of each pass its `inputs` in order, of which `vectors` are parameters and `textures` have a file each, the others being
    set at run time, and `code`. Shadows are those of compressed depths where the asset has them, otherwise of captures of the scene.
    """
    told = write_surfels(asset, folder, data)
    text = pack_include(PACK) + "\n" + (engine_root("unreal") / "SrbfSurfels.ush").read_text(encoding="utf-8")
    name = f"SrbfSurfels_{hashlib.sha256(text.encode()).hexdigest()[:8]}"
    files.make_folder(folder / "Shaders")
    files.write_text(folder / "Shaders" / f"{name}.ush", text)
    places, groups, far = {key: told[key] for key in ("places", "normals")}, 0, 0.0
    shadows, code, vectors = FACES, BY_FACES, [*LIGHT, "Across", "Up"]
    if "surfel_visibility" in asset.manifest:
        depths, groups, far = _depths(asset, folder, data)
        places |= depths
        shadows, code, vectors = DEPTHS, BY_DEPTHS, LIGHT
    materials = {
        "SurfelIrradiance": _material(["Former", *shadows], vectors, code, {key.capitalize(): file for key, file in places.items()}),
        "SurfelMeans": _material(["Irradiance"], [], MEANS, {"Normals": told["normals"], "Ranges": told["ranges"]}),
    }
    for i, table in enumerate(told["tables"]):
        file = _in_color(folder, data, f"table_{i}", table["file"], table["channels"])
        materials[f"SurfelParts{i}"] = _material(["Numbers"], ["Entries"], PARTS, {"Table": file})
        added = ["Added"] if i == 0 and ("environment" in told or "changes" in told) else []
        materials[f"SurfelSums{i}"] = _material(["Parts", *added], ["Entries"], SUMS_ADDED if added else SUMS, {})
    materials |= _shapes(told, folder, data, materials["SurfelParts0"]["textures"]["Table"])
    (folder / NUMBERS).write_bytes(_numbers(asset, told, folder, groups, far))
    files.make_folder(folder / "Source")
    for source in SOURCES:
        shutil.copyfile(engine_root("unreal") / "Source" / source, folder / "Source" / source)
    return {"include": f"/Project/{name}.ush", "materials": materials}


def _shapes(told: dict[str, Any], folder: Path, data: str, table: str) -> dict[str, Any]:
    """Passes of environments, of objects that emit, and of objects that are repainted, whose first table has the file `table`."""
    materials = {}
    if "environment" in told:
        cells = _in_color(folder, data, "cell_numbers", told["cells"], 1, "float")
        materials["SurfelCells"] = _material(["Environment"], ["Ahead", "Left", "Up"], CELLS, {"Cells": cells})
        first = {"First": str(told["environment"]["file"])}
        materials["SurfelEnvironment"] = _material(["Second", "Addend"], ["Matrix"], PRODUCT, first)
    if "changes" in told:
        changes = told["changes"]
        gather, sent = (_in_color(folder, data, name, changes[name]["file"], 1) for name in ("gather", "sent"))
        before, feedback = changes["series"], changes["feedback"]["file"]
        materials |= {
            "SurfelProduct": _material(["First", "Second", "Addend"], ["Matrix"], PRODUCT, {}),
            "SurfelExchange": _material(["Albedo"], ["Matrix"], EXCHANGE, {"Gather": gather, "Sent": sent, "Feedback": feedback}),
            "SurfelRepainted": _material(["Series", "Albedo"], ["Matrix"], REPAINTED, {"Before": before, "Gather": gather, "Table": table}),
        }
    return materials


def _material(targets: list[str], vectors: list[str], code: str, textures: dict[str, str]) -> dict[str, Any]:
    inputs = ["UV", "Size", *textures, *(name for name in targets if name not in textures), *vectors]
    return {"inputs": inputs, "vectors": ["Size", *vectors], "textures": textures, "code": code}


def _in_color(folder: Path, data: str, name: str, own: str, channels: int, encoding: Encoding = "half") -> str:
    """The file of a table with three channels: Unreal's importer is not asked for images of one."""
    if channels == 3:
        return own
    file = f"{data}/surfel_{name}_in_color.exr"
    write_image(folder / file, np.repeat(read_image(folder / own), 3, axis=2), encoding)
    return file


def _depths(asset: Asset, folder: Path, data: str) -> tuple[dict[str, str], int, float]:
    """(textures of compressed depths in the order of the cells' texels, texels per cell, the farthest distance)."""
    order = surfel_textures(asset).order
    kept = kept_visibility(asset, "surfel_visibility", Cells.of_image(asset.tables["cells"]).normals)
    sorted_ = PcaVisibility(kept.normals[order], kept.clusters[order], kept.coefficients[order], kept.bases, kept.low, kept.span, kept.far)
    coefficients, bases, groups = pca_textures(sorted_)
    images = {"coefficients": coefficients, "bases": bases, "clusters": np.repeat(folded(sorted_.clusters[:, None]), 3, axis=2)}
    for key, pixels in images.items():
        write_image(folder / data / f"surfel_{key}.exr", pixels, "float")
    return {key: f"{data}/surfel_{key}.exr" for key in images}, groups, kept.far


def _numbers(asset: Asset, told: dict[str, Any], folder: Path, groups: int, far: float) -> bytes:
    """Little-endian: MAGIC; float64 asset_from_world (4, 4), middle (3), reach, lift, far; int32 width and height of the cells, of the
    patches and of the weights, texels per cell of compressed depths, tables; of each int32 rows, columns, float64 scale. Then int32
    cells of the environment, cells per side, float64 scale of its table; int32 objects that change, surfels, exchanges of light, float64
    scales of gather times sent, of gather and of feedback; the objects' names, each an int32 of bytes and UTF-8; float32 RGB of every
    object and row of the first table that emits, with and without bounces, the objects' shares (objects, surfels), RGB albedo of surfels.
    """
    (height, width), (rows, columns) = (read_image(folder / told[key]).shape[:2] for key in ("places", "ranges"))
    weights = weights_shape(asset)
    head = np.concatenate([asset.asset_from_world.ravel(), told["middle"], [told["reach"], told["lift"], far]]).astype("<f8").tobytes()
    sizes = struct.pack("<8i", width, height, columns, rows, weights[1], weights[0], groups, len(told["tables"]))
    tables = b"".join(struct.pack("<iid", table["rows"], table["columns"], table["scale"]) for table in told["tables"])
    return MAGIC + head + sizes + tables + _shape_numbers(told, folder)


def _shape_numbers(told: dict[str, Any], folder: Path) -> bytes:
    environment = told.get("environment", {"columns": 0, "side": 0, "scale": 0.0})
    head = struct.pack("<iid", environment["columns"], environment["side"], environment["scale"])
    if "changes" not in told:
        return head + struct.pack("<3i3d", 0, 0, 0, 0.0, 0.0, 0.0)
    changes = told["changes"]
    gather, sent, feedback = (changes[name] for name in ("gather", "sent", "feedback"))
    names = [name.encode() for name in told["objects"]]
    sizes = (len(names), gather["columns"], changes["terms"])
    head += struct.pack("<3i3d", *sizes, gather["scale"] * sent["scale"], gather["scale"], feedback["scale"])
    head += b"".join(struct.pack("<i", len(name)) + name for name in names)
    images = (told["emission"], *(changes[name] for name in ("first", "shares", "albedo")))
    return head + b"".join(read_image(folder / file).astype("<f4").tobytes() for file in images)
