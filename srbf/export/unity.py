"""A folder to drop into a Unity project's Assets: the asset, an importer, a component that follows lights, HLSL and a shader."""

from __future__ import annotations

import hashlib
import math
import shutil
from pathlib import Path

from srbf.asset import MANIFEST, Asset
from srbf.export import dds, exr
from srbf.export.asset_shader import by_weights_alone
from srbf.export.engine_folder import engine_root, write_asset
from srbf.export.hlsl import asset_include
from srbf.export.hlsl import include as pack_include
from srbf.export.settings import PLAIN, Settings, Written
from srbf.export.surfel_textures import PASSES, has_surfels, write_surfels
from srbf.io import files

DATA = "images~"  # Unity passes by folders that end so: the importer reads the images itself
INCLUDE = "SrbfAsset.hlsl"
SHADER = "Relit.shader"
IMPORTED = "relit.srbf"
SURFEL_PACK = "SrbfSurfelPack.hlsl"  # what SrbfSurfels.hlsl includes: the same for all assets
SURFEL_FILES = [
    f"surfels/{name}.glsl"
    for name in (
        *("cell_irradiance", "cell_on_cube", "cell_on_map", "patch_mean", "table_part", "block_sum"),
        *("environment_cell", "matrix_product", "changed_exchange", "repainted_entry"),
    )
]


def write(asset: Asset, folder: Path, settings: Settings = PLAIN) -> Written:
    """Fill an empty folder: `relit.srbf`, which Unity imports, `asset.json` with its images, `SrbfAsset.hlsl`, a sample shader, and the
    code in `Srbf/`, which a project needs once. Half floats and floats are EXRs, one image per layer; bytes, BC7 and BC1 a DDS file
    with mip levels.

    InputError on an asset that no shader relights.
    """
    asset_include(asset)  # refuses before anything is written
    plain = settings.encoding in (None, "half", "float") and settings.levels in ("auto", 0, 1)
    written = write_asset(asset, folder, DATA, settings, exr.write if plain else dds.write)
    include = unity_include(written)
    name = hashlib.sha256(include.encode()).hexdigest()[:8]
    shutil.copytree(engine_root("unity") / "Srbf", folder / "Srbf")
    files.write_text(folder / "Srbf/Shaders" / SURFEL_PACK, pack_include(SURFEL_FILES))
    if has_surfels(written):
        manifest = files.read_json(folder / MANIFEST)
        files.write_json(folder / MANIFEST, manifest | {PASSES: write_surfels(written, folder, DATA)})
    files.write_text(folder / INCLUDE, include)
    shader = (engine_root("unity") / SHADER).read_text(encoding="utf-8")
    files.write_text(folder / SHADER, shader.replace("@ID@", name))
    files.write_text(folder / IMPORTED, "asset.json\n")
    return Written(("docs/engines/unity.md: copy the folder into Assets; a project needs Srbf/ once",))


def unity_include(asset: Asset) -> str:
    """`SrbfAsset.hlsl`: the asset's functions, its quantity in Unity's units, and the code for Unity.

    A light of intensity I gives a white Lambert surface that faces it I, where Blender's sun of strength I gives I / pi.
    """
    radiance = asset.quantity == "radiance"
    defines = [
        f"#define SRBF_UNITY_SCALE {math.pi if radiance else 1.0}  // {'radiance' if radiance else 'irradiance'} in Unity's units",
        f"#define SRBF_ALBEDO(albedo) {'float3(1.0, 1.0, 1.0)' if radiance else '(albedo)'}",
        *(["#define SRBF_CLUSTERED"] if "cluster_index" in asset.tables else []),
        *(["#define SRBF_WEIGHTS_ALONE  // every light is in _SrbfWeightRows"] if by_weights_alone(asset) else []),
    ]
    return asset_include(asset, pairs=True) + "\n" + "\n".join(defines) + '\n#include "Srbf/Shaders/SrbfUnity.hlsl"\n'
