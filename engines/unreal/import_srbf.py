# SPDX-License-Identifier: MIT
"""Import an exported asset into the open Unreal project: Tools > Execute Python Script, or `py "…/import_srbf.py"` in the console.

node.json, images/ and Shaders/ must lie beside it. It copies Shaders/ into the project's folder of that name, imports the images below
/Game/Srbf, combines the layers in a texture array, and creates a parameter collection for the lights and a material whose Custom node
relights. `py "…/import_srbf.py" follow` then copies the level's first directional and first point or spot light into the collection.
Named lights and lights inside have no collection: add Source/ to the project's module, and the component SrbfRelit, or SrbfSurfelLights, to
the mesh's actor.
"""

import json
import math
import shutil
import sys
from pathlib import Path

import unreal

HERE = Path(__file__).resolve().parent
ROOT = "/Game/Srbf"


def read_node():
    return json.loads((HERE / "node.json").read_text(encoding="utf-8"))


def name_of(node):
    return Path(node["include"]).stem


def copy_shaders():
    target = Path(unreal.Paths.convert_relative_path_to_full(unreal.Paths.project_dir())) / "Shaders"
    target.mkdir(parents=True, exist_ok=True)
    for path in (HERE / "Shaders").iterdir():
        shutil.copyfile(path, target / path.name)


def copy_tables(file, name):
    """What a component reads; returns its path below Content."""
    target = Path(unreal.Paths.convert_relative_path_to_full(unreal.Paths.project_content_dir())) / "Srbf"
    target.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(HERE / file, target / f"{name}.bin")
    return f"Srbf/{name}.bin"


def import_texture(file, folder, filtered, compression):
    """One image as a linear texture that nothing resizes, compresses or mips."""
    task = unreal.AssetImportTask()
    task.set_editor_property("filename", str(HERE / file))
    task.set_editor_property("destination_path", folder)
    task.set_editor_property("automated", True)
    task.set_editor_property("replace_existing", True)
    task.set_editor_property("save", False)
    unreal.AssetToolsHelpers.get_asset_tools().import_asset_tasks([task])
    texture = unreal.load_asset(f"{folder}/{Path(file).stem}")
    if texture is None:
        raise RuntimeError(f"expected Unreal to import {file}, found no texture; see the output log")
    settle(texture, filtered, compression)
    return texture


def settle(texture, filtered, compression):
    texture.set_editor_property("srgb", False)
    texture.set_editor_property("compression_settings", compression)
    texture.set_editor_property("mip_gen_settings", unreal.TextureMipGenSettings.TMGS_NO_MIPMAPS)
    texture.set_editor_property("never_stream", True)
    texture.set_editor_property("filter", unreal.TextureFilter.TF_BILINEAR if filtered else unreal.TextureFilter.TF_NEAREST)
    for axis in ("address_x", "address_y"):
        texture.set_editor_property(axis, unreal.TextureAddress.TA_CLAMP)
    unreal.EditorAssetLibrary.save_loaded_asset(texture)


def make(name, folder, kind, factory):
    path = f"{folder}/{name}"
    if unreal.EditorAssetLibrary.does_asset_exist(path):
        unreal.EditorAssetLibrary.delete_asset(path)
    return unreal.AssetToolsHelpers.get_asset_tools().create_asset(name, folder, kind, factory)


def make_layers(node, folder, hdr):
    layers = [import_texture(file, folder + "/Layers", node["filtered"], hdr) for file in node["layers"]]
    array = make("Layers", folder, unreal.Texture2DArray, unreal.Texture2DArrayFactory())
    array.set_editor_property("source_textures", layers)
    settle(array, node["filtered"], hdr)
    return array


def make_collection(node, folder):
    collection = make("Lights", folder, unreal.MaterialParameterCollection, unreal.MaterialParameterCollectionFactoryNew())
    vectors = []
    for name, value in node["lights"].items():
        vector = unreal.CollectionVectorParameter()
        vector.set_editor_property("parameter_name", name)
        vector.set_editor_property("default_value", unreal.LinearColor(*value))
        vectors.append(vector)
    collection.set_editor_property("vector_parameters", vectors)
    unreal.EditorAssetLibrary.save_loaded_asset(collection)
    return collection


def make_custom(material, description, told, include):
    """A Custom node of three floats, with its inputs still open."""
    custom = unreal.MaterialEditingLibrary.create_material_expression(material, unreal.MaterialExpressionCustom, -400, 0)
    custom.set_editor_property("description", description)
    custom.set_editor_property("output_type", unreal.CustomMaterialOutputType.CMOT_FLOAT3)
    custom.set_editor_property("code", told["code"])
    custom.set_editor_property("include_file_paths", [include])
    inputs = []
    for name in told["inputs"]:
        entry = unreal.CustomInput()
        entry.set_editor_property("input_name", name)
        inputs.append(entry)
    custom.set_editor_property("inputs", inputs)
    return custom


def make_material(node, folder, textures, collection):
    """A material whose emissive color is the asset's response to the collection's lights."""
    editing = unreal.MaterialEditingLibrary
    material = make("Relit", folder, unreal.Material, unreal.MaterialFactoryNew())
    material.set_editor_property("shading_model", unreal.MaterialShadingModel.MSM_UNLIT)
    custom = make_custom(material, "srbf", node, node["include"])
    for row, name in enumerate(node["inputs"]):
        y = 120 * row
        if name in textures:
            source = editing.create_material_expression(material, unreal.MaterialExpressionTextureObjectParameter, -1000, y)
            source.set_editor_property("parameter_name", name)
            source.set_editor_property("texture", textures[name])
            kinds = unreal.MaterialSamplerType
            kind = kinds.SAMPLERTYPE_LINEAR_GRAYSCALE if name == "Clusters" else kinds.SAMPLERTYPE_LINEAR_COLOR
            source.set_editor_property("sampler_type", kind)
        elif name == "UV":
            source = editing.create_material_expression(material, unreal.MaterialExpressionTextureCoordinate, -1000, y)
            source.set_editor_property("coordinate_index", 1)  # the lightmap's; 0 for a mesh with only one set
        elif name == "WorldPosition":
            world = editing.create_material_expression(material, unreal.MaterialExpressionWorldPosition, -1200, y)
            source = editing.create_material_expression(material, unreal.MaterialExpressionTruncateLWC, -1000, y)
            editing.connect_material_expressions(world, "", source, "")
        else:
            four = editing.create_material_expression(material, unreal.MaterialExpressionCollectionParameter, -1200, y)
            four.set_editor_property("collection", collection)
            four.set_editor_property("parameter_name", name)
            source = four
            if name != "PointLightShape":
                source = editing.create_material_expression(material, unreal.MaterialExpressionComponentMask, -1000, y)
                for channel in "rgba":
                    source.set_editor_property(channel, channel != "a")
                editing.connect_material_expressions(four, "", source, "")
        editing.connect_material_expressions(source, "", custom, name)
    editing.connect_material_property(custom, "", unreal.MaterialProperty.MP_EMISSIVE_COLOR)
    editing.recompile_material(material)
    unreal.EditorAssetLibrary.save_loaded_asset(material)
    return material


def make_pass(name, told, include, folder, textures):
    """A material that is drawn into a render target, whose Custom node may give numbers below 0."""
    editing = unreal.MaterialEditingLibrary
    material = make(name, folder, unreal.Material, unreal.MaterialFactoryNew())
    material.set_editor_property("shading_model", unreal.MaterialShadingModel.MSM_UNLIT)
    material.set_editor_property("allow_negative_emissive_color", True)
    custom = make_custom(material, name, told, include)
    for row, entry_name in enumerate(told["inputs"]):
        y = 120 * row
        if entry_name == "UV":
            source = editing.create_material_expression(material, unreal.MaterialExpressionTextureCoordinate, -1000, y)
        elif entry_name in told["vectors"]:
            vector = editing.create_material_expression(material, unreal.MaterialExpressionVectorParameter, -1200, y)
            vector.set_editor_property("parameter_name", entry_name)
            source = editing.create_material_expression(material, unreal.MaterialExpressionAppendVector, -1000, y)
            editing.connect_material_expressions(vector, "", source, "A")
            editing.connect_material_expressions(vector, "A", source, "B")
        else:
            source = editing.create_material_expression(material, unreal.MaterialExpressionTextureObjectParameter, -1000, y)
            source.set_editor_property("parameter_name", entry_name)
            if entry_name in told["textures"]:
                source.set_editor_property("texture", textures[told["textures"][entry_name]])
            source.set_editor_property("sampler_type", unreal.MaterialSamplerType.SAMPLERTYPE_LINEAR_COLOR)
        editing.connect_material_expressions(source, "", custom, entry_name)
    editing.connect_material_property(custom, "", unreal.MaterialProperty.MP_EMISSIVE_COLOR)
    editing.recompile_material(material)
    unreal.EditorAssetLibrary.save_loaded_asset(material)


def make_surfels(surfels, folder, exact):
    """The materials of the passes that SrbfSurfelLights draws, and their textures."""
    files = sorted({file for told in surfels["materials"].values() for file in told["textures"].values()})
    textures = {file: import_texture(file, folder + "/Surfels", False, exact) for file in files}
    for name, told in surfels["materials"].items():
        make_pass(name, told, surfels["include"], folder, textures)


def follow_lights():
    """Copy the level's first directional light and first point or spot light into the collection's defaults."""
    node = read_node()
    if not node["lights"]:
        raise RuntimeError("expected an asset lit by a collection, found one of named lights or of a cloud; add the component SrbfRelit")
    folder = f"{ROOT}/{name_of(node)}"
    collection = unreal.load_asset(folder + "/Lights")
    values = dict(node["lights"])
    actors = unreal.get_editor_subsystem(unreal.EditorActorSubsystem).get_all_level_actors()
    suns = [actor for actor in actors if isinstance(actor, unreal.DirectionalLight)]
    point_lights = [actor for actor in actors if isinstance(actor, (unreal.PointLight, unreal.SpotLight))]
    for actor in suns[:1]:
        forward = actor.get_actor_forward_vector()  # the direction it shines in
        values["SunDirection"] = [-forward.x, -forward.y, -forward.z, 0.0]
        values["SunColor"] = color_of(actor)
    for actor in point_lights[:1]:
        place, forward = actor.get_actor_location(), actor.get_actor_forward_vector()
        values["PointLightPosition"] = [place.x, place.y, place.z, 0.0]
        values["PointLightAxis"] = [forward.x, forward.y, forward.z, 0.0]
        values["PointLightColor"] = color_of(actor)
        if isinstance(actor, unreal.SpotLight):
            component = actor.get_component_by_class(unreal.SpotLightComponent)
            angles = [component.get_editor_property(name) for name in ("inner_cone_angle", "outer_cone_angle")]
            values["PointLightShape"] = node["lights"]["PointLightShape"][:2] + [
                2.0 * math.sin(math.radians(angle) / 2.0) ** 2 for angle in angles
            ]
    vectors = collection.get_editor_property("vector_parameters")
    for vector in vectors:
        vector.set_editor_property("default_value", unreal.LinearColor(*values[str(vector.get_editor_property("parameter_name"))]))
    collection.set_editor_property("vector_parameters", vectors)


def color_of(actor):
    """Linear color times intensity: lux for a directional light; set point and spot lights to candelas."""
    component = actor.get_component_by_class(unreal.LightComponent)
    color, strength = component.get_light_color(), component.get_editor_property("intensity")
    return [color.r * strength, color.g * strength, color.b * strength, 0.0]


def main():
    node = read_node()
    folder = f"{ROOT}/{name_of(node)}"
    copy_shaders()
    hdr = unreal.TextureCompressionSettings.TC_HDR  # RGBA of half floats
    exact = getattr(unreal.TextureCompressionSettings, "TC_HDR_F32", hdr)  # 5.1 and later: the R table's own precision
    gray = unreal.TextureCompressionSettings.TC_GRAYSCALE
    textures = {"Layers": make_layers(node, folder, hdr)}
    for name, file in node["textures"].items():
        kind = {"Table": exact, "Weights": exact, "Clusters": gray}.get(name, hdr)
        textures[name] = import_texture(file, folder, name == "Ambient", kind)
    make_material(node, folder, textures, make_collection(node, folder) if node["lights"] else None)
    then = "run this script again with the word follow"
    if not node["lights"]:
        then = f"add the component SrbfRelit to its actor, with the tables {copy_tables('SrbfTables.bin', name_of(node))}"
    if "surfels" in node:
        make_surfels(node["surfels"], folder, exact)
        then += f"; or SrbfSurfelLights, with the folder {folder} and {copy_tables('SrbfSurfels.bin', name_of(node) + '_surfels')}"
    unreal.log(f"srbf: {folder}/Relit is ready; assign it to a mesh, then {then}")


if __name__ == "__main__":
    follow_lights() if "follow" in sys.argv[1:] else main()
