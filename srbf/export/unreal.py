"""A folder for an Unreal project: the asset, its shader include, and an editor script that imports both and builds a material."""

from __future__ import annotations

import hashlib
import math
import shutil
from pathlib import Path
from typing import Any

from srbf.asset import Asset
from srbf.export.asset_shader import by_weights_alone, rows_of
from srbf.export.engine_folder import engine_root, write_asset
from srbf.export.hlsl import asset_include
from srbf.export.light_tables import first_weights, table_file
from srbf.export.settings import PLAIN, Settings, Written
from srbf.export.surfel_textures import has_surfels
from srbf.export.unreal_surfels import SOURCES, write_unreal_surfels
from srbf.io import files
from srbf.io.image import write_image
from srbf.methods import method_of

DATA = "images"
SCRIPT = "import_srbf.py"
TABLES = "SrbfTables.bin"  # from which SrbfRelit makes a frame's weights
WEIGHTS = "weights.exr"  # until it has
# Inputs of the Custom node besides textures and positions; the material parameter collection holds them under these names.
LIGHTS = {
    "SunDirection": (0.0, 0.0, 1.0, 0.0),  # towards the sun, Unreal's frame
    "SunColor": (0.0, 0.0, 0.0, 0.0),  # linear, lux
    "PointLightPosition": (0.0, 0.0, 100.0, 0.0),  # cm
    "PointLightColor": (0.0, 0.0, 0.0, 0.0),  # linear, candela: lux at the distance a0 = 1 m
    "PointLightAxis": (0.0, 0.0, -1.0, 0.0),  # where a spot shines
    "PointLightShape": (1.0, 0.05, 3.0, 4.0),  # a0, radius (m), 1 - cos of a spot's half-angles, or 3 and 4
}


def write(asset: Asset, folder: Path, settings: Settings = PLAIN) -> Written:
    """Fill an empty folder: `asset.json` with its images, `Shaders/Srbf_*.ush` under a unique name, `node.json`, the Custom node, and the
    editor script that imports all of it. Named lights and clouds: also `Source/`, a component that makes their weights, and its tables;
    assets with surfels: what lights those.

    InputError on an asset that no shader relights.
    """
    asset_include(asset)  # refuses before anything is written
    written = write_asset(asset, folder, DATA, settings)
    text = unreal_include(written)
    name = f"Srbf_{hashlib.sha256(text.encode()).hexdigest()[:8]}"
    files.make_folder(folder / "Shaders")
    files.write_text(folder / "Shaders" / f"{name}.ush", text)
    surfels = {"surfels": write_unreal_surfels(written, folder, DATA)} if has_surfels(written) else {}
    files.write_json(folder / "node.json", custom_node(written, name) | surfels)
    shutil.copyfile(engine_root("unreal") / SCRIPT, folder / SCRIPT)
    if by_weights_alone(written):
        write_image(folder / DATA / WEIGHTS, first_weights(written), "float")
        (folder / TABLES).write_bytes(table_file(written))
        shutil.copytree(engine_root("unreal") / "Source", folder / "Source", dirs_exist_ok=True, ignore=shutil.ignore_patterns(*SOURCES))
    return Written(("docs/engines/unreal.md: run import_srbf.py in the editor; it copies Shaders/ into the project",))


def unreal_include(asset: Asset) -> str:
    """`Srbf_*.ush`: the asset's functions, and Unreal's axes and units where the shader sees lights."""
    if by_weights_alone(asset):
        return asset_include(asset)
    rows = rows_of(asset.asset_from_world, "{}".format)
    frame = f"// World to the asset's frame, by rows.\nstatic const float4x4 srbfAssetFromWorld = float4x4(\n{rows}\n);\n"
    return asset_include(asset) + "\n" + frame + "\n" + (engine_root("unreal") / "SrbfUnreal.ush").read_text(encoding="utf-8")


def custom_node(asset: Asset, name: str) -> dict[str, Any]:
    """The Custom node: its include, `inputs` in order, and `code`; the textures' files by input.

    The result is what a surface sends out, to be added to the emissive color: of irradiance assets for a white surface, so that the
    material multiplies by its base color, in Unreal's units, where a white Lambert surface under 1 lux gives 1 / pi.
    """
    clustered = "cluster_index" in asset.tables
    weighted = by_weights_alone(asset)
    textures = (
        {"Weights": WEIGHTS} if weighted else {"Table": asset.manifest["r_table" if "r_table" in asset.tables else "w_table"]["file"]}
    )
    if clustered:
        textures["Clusters"] = asset.manifest["cluster_index"]["file"]
    if "ambient" in asset.images:
        textures["Ambient"] = asset.manifest["ambient"]
    scale = 1.0 if asset.quantity == "radiance" else 1 / math.pi
    ambient = "Ambient.SampleLevel(AmbientSampler, UV, 0.0).rgb" if "Ambient" in textures else "float3(0.0, 0.0, 0.0)"
    drawn = f"Layers, LayersSampler, {'Clusters, ' if clustered else ''}UV"
    if weighted:
        level = "" if "scalars" in asset.manifest else "0.0, "
        code = [f"return srbfFinish(srbfAssetDirectional({drawn}, {level}Weights), {ambient}) * {scale!r};"]
    else:
        common = f"{drawn}, Table"
        code = [
            f"float3 Sum = srbfAssetPoint({common}, float3(0.0, 0.0, 0.0), SrbfUnrealSun(SunDirection, SunColor));",
            "SrbfPointLight PointLight = SrbfUnrealPointLight(PointLightPosition, PointLightColor, PointLightAxis, PointLightShape);",
            f"Sum += srbfAssetPoint({common}, SrbfPlaceFromUnreal(WorldPosition), PointLight);",
            f"return srbfFinish(Sum, {ambient}) * {scale!r};",
        ]
    return {
        "include": f"/Project/{name}.ush",
        "inputs": ["Layers", *textures, "UV", *([] if weighted else ["WorldPosition", *LIGHTS])],
        "textures": {key: f"{DATA}/{file}" for key, file in textures.items()},
        "layers": [f"{DATA}/{entry['file']}" for entry in asset.layers],
        "filtered": method_of(asset).filterable,
        "lights": {} if weighted else {key: list(value) for key, value in LIGHTS.items()},
        "code": "\n".join(code),
    }
