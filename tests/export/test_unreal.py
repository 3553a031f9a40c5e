"""The Unreal export: its include through pixels, its editor script against a stand-in that records. Unreal itself runs nowhere here."""

from __future__ import annotations

import json
import math
import runpy
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pixels import FLOAT, LIGHTS, images_of, magnitude, run
from unreal_stand_in import StandIn

from srbf import methods
from srbf.asset import Asset
from srbf.export import spirv, unreal
from srbf.gl.uniforms import versine
from srbf.lights import DirectionalLight, PointLight, SpotLight

NAMES = ["relighting-map", "eigen-map", "clustered-eigen-map"]
SUN = DirectionalLight((0.3, 0.5, 0.8), (1.0, 0.8, 0.3))
POINT_LIGHT = SpotLight(
    (0.4, -0.3, 1.1), (0.5, 1.0, 2.0), a0=1.0, falloff="inverse-square", radius=0.05, direction=(0.1, 0.2, -1.0), inner=0.3, outer=0.6
)
# What Unreal writes about a Custom node's code: a function whose inputs are its arguments, a texture's followed by its sampler.
CUSTOM = """
cbuffer Parameters {
    FLOAT4S
};
TEXTURES

float3 CustomExpression0(ARGUMENTS) {
CODE
}

Texture2D positions;

float4 main(float4 at : SV_Position) : SV_Target {
    float2 UV = at.xy / float2(srbfTextureSize(positions));
    float3 WorldPosition = positions.Load(int3(int2(at.xy), 0)).xyz;
    return float4(CustomExpression0(CALL), 1.0);
}
"""


@pytest.fixture(scope="module")
def assets(make_asset: Callable[..., Asset], make_planes: Callable[..., Asset]) -> dict[str, Asset]:
    return {
        "relighting-map": make_asset(7, "half", ambient=True),
        "eigen-map": make_planes(9, None, "half"),
        "clustered-eigen-map": make_planes(9, 5, "half", ambient=True, patches=True),
    }


@pytest.fixture(scope="module")
def folders(assets: dict[str, Asset], tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    made = {}
    for name, asset in assets.items():
        made[name] = tmp_path_factory.mktemp(name)
        unreal.write(asset, made[name])
    return made


def shader_of(folder: Path) -> str:
    """The .ush and its Custom node's code in a fragment shader, the way Unreal puts them together."""
    node = json.loads((folder / "node.json").read_text())
    include = (folder / "Shaders" / Path(node["include"]).name).read_text()
    arguments, values, textures = [], [], []
    for name in node["inputs"]:
        if name == "Layers" or name in node["textures"]:
            kind = "Texture2DArray" if name == "Layers" else "Texture2D"
            textures.append(f"{kind} Material{name}; SamplerState Material{name}Sampler;")
            arguments.append(f"{kind} {name}, SamplerState {name}Sampler")
            values.append(f"Material{name}, Material{name}Sampler")
        elif name in ("UV", "WorldPosition"):
            arguments.append(f"float{2 if name == 'UV' else 3} {name}")
            values.append(name)
        else:
            four = name == "PointLightShape"
            arguments.append(f"float{4 if four else 3} {name}")
            values.append(f"Set{name}" + ("" if four else ".xyz"))
    text = CUSTOM.replace("FLOAT4S", "\n    ".join(f"float4 Set{name};" for name in node["lights"])).replace(
        "TEXTURES", "\n".join(textures)
    )
    text = text.replace("ARGUMENTS", ", ".join(arguments)).replace("CALL", ", ".join(values)).replace("CODE", node["code"])
    return include + text


def in_unreal(place: Any, scale: float) -> np.ndarray:
    """Unreal's coordinates of a place or a direction of Blender's: y turned, centimeters by the scale."""
    return np.asarray(place, np.float64) * [scale, -scale, scale]


@pytest.mark.skipif(not spirv.available(), reason="needs glslang-tools, spirv-tools and spirv-cross (Debian)")
@pytest.mark.parametrize("moved", [False, True], ids=["in place", "moved"])
@pytest.mark.parametrize("quantity", ["irradiance", "radiance"])
@pytest.mark.parametrize("method", NAMES)
def test_the_custom_node_gives_numpys_pixels(folders: dict[str, Path], method: str, quantity: str, moved: bool, tmp_path: Path) -> None:
    asset = Asset.open(folders[method])
    asset.manifest["quantity"] = quantity
    world = np.eye(4)
    if moved:
        world[:3, :3], world[:3, 3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]], [0.3, -0.2, 0.1]
        asset.manifest["asset_from_world"] = world.tolist()
    unreal.write(asset, tmp_path)
    placed = (asset.images["position"].astype(np.float64) - world[:3, 3]) @ world[:3, :3]
    images = images_of(asset)
    uniforms = {
        "SetSunDirection": (*in_unreal(SUN.direction, 1), 0),
        "SetSunColor": (*SUN.color, 0),
        "SetPointLightPosition": (*in_unreal(POINT_LIGHT.position, 100), 0),
        "SetPointLightColor": (*POINT_LIGHT.color, 0),
        "SetPointLightAxis": (*in_unreal(POINT_LIGHT.direction, 1), 0),
        "SetPointLightShape": (POINT_LIGHT.a0, POINT_LIGHT.radius, versine(POINT_LIGHT.inner), versine(POINT_LIGHT.outer)),
    }
    given = {"MaterialTable": images["table"], "positions": in_unreal(placed, 100).astype(np.float32)}
    given |= {"MaterialClusters": images["clusters"]} if "clusters" in images else {}
    given |= {"MaterialAmbient": asset.images["ambient"]} if "ambient" in asset.images else {}
    found = run(spirv.cross_compile(spirv.compile_hlsl(shader_of(tmp_path)), "glsl"), asset, given, uniforms)[..., :3]
    expected = by_table(asset) + methods.linear_response(asset, [POINT_LIGHT])
    scale = 1 if quantity == "radiance" else 1 / math.pi
    expected = (np.maximum(expected, 0) + asset.images.get("ambient", 0)) * scale
    # the receiver's place rounds twice more on its way through Unreal's space, which the weights follow
    asset.manifest["asset_from_world"] = np.eye(4).tolist()  # magnitudes are those of point lights near the asset
    allowed = scale * (
        4 * FLOAT * (magnitude(asset, SUN) + magnitude(asset, LIGHTS["inverse-square"]) + magnitude(asset, POINT_LIGHT)) + 1e-6
    )
    assert expected.max() > 0.2
    assert (np.abs(found - expected) <= allowed).all()


def by_table(asset: Asset) -> np.ndarray:
    """The sun as a point light so far away that its direction is the same everywhere: planes read their table, not their functions."""
    far = 1e6
    distance = PointLight(tuple(far * np.array(SUN.direction)), SUN.color, a0=far)  # type: ignore[arg-type]
    return methods.linear_response(asset, [distance])


@pytest.mark.parametrize("method", NAMES)
def test_an_export_is_an_asset(assets: dict[str, Asset], folders: dict[str, Path], method: str) -> None:
    again = Asset.open(folders[method])
    np.testing.assert_allclose(methods.relight(again, [SUN, POINT_LIGHT]), methods.relight(assets[method], [SUN, POINT_LIGHT]), atol=1e-6)
    node = json.loads((folders[method] / "node.json").read_text())
    assert all((folders[method] / file).is_file() for file in (*node["layers"], *node["textures"].values()))


@pytest.mark.parametrize("method", NAMES)
def test_the_script_imports_every_file_and_connects_every_input(
    folders: dict[str, Path], stand_in: StandIn, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, method: str
) -> None:
    node = json.loads((folders[method] / "node.json").read_text())
    monkeypatch.setattr(sys, "argv", ["import_srbf.py"])
    runpy.run_path(str(folders[method] / "import_srbf.py"), run_name="__main__")
    assert (tmp_path / "Project/Shaders" / Path(node["include"]).name).is_file()
    tasks = [call[1][0] for call in stand_in.calls if call[0] == "AssetTools.import_asset_tasks"]
    assert [task.properties["filename"] for task in tasks] == [
        str(folders[method] / file) for file in (*node["layers"], *node["textures"].values())
    ]
    arrays = [made for made in stand_in.made if made.kind == "Texture2DArray Layers"]
    assert len(arrays[0].properties["source_textures"]) == len(node["layers"])
    settled = [made for made in stand_in.made if "srgb" in made.properties]
    assert len(settled) == len(tasks) + 1 and not any(made.properties["srgb"] for made in settled)
    nearest = arrays[0].properties["filter"] == "TextureFilter.TF_NEAREST"
    assert nearest == (method == "clustered-eigen-map")
    custom = next(made for made in stand_in.made if made.kind == "MaterialExpressionCustom")
    assert custom.properties["code"] == node["code"] and custom.properties["include_file_paths"] == [node["include"]]
    connected = [call[4] for call in stand_in.calls if call[0].endswith("connect_material_expressions") and call[3] is custom]
    assert connected == node["inputs"] == [entry.properties["input_name"] for entry in custom.properties["inputs"]]


class Actor:
    """A light of a level: where it stands, where it shines (Unreal's frame), and its component's properties."""

    def __init__(self, place: tuple[float, ...], forward: tuple[float, ...], color: tuple[float, ...], **properties: float) -> None:
        self.place, self.forward, self.color, self.properties = place, forward, color, properties

    def get_actor_location(self) -> SimpleNamespace:
        return SimpleNamespace(**dict(zip("xyz", self.place, strict=True)))

    def get_actor_forward_vector(self) -> SimpleNamespace:
        return SimpleNamespace(**dict(zip("xyz", self.forward, strict=True)))

    def get_component_by_class(self, _: Any) -> Actor:
        return self

    def get_light_color(self) -> SimpleNamespace:
        return SimpleNamespace(**dict(zip("rgb", self.color, strict=True)))

    def get_editor_property(self, name: str) -> float:
        return self.properties[name]


def test_the_script_copies_a_levels_lights(folders: dict[str, Path], stand_in: StandIn, monkeypatch: pytest.MonkeyPatch) -> None:
    kinds = {name: type(name, (Actor,), {}) for name in ("DirectionalLight", "PointLight", "SpotLight")}
    sun = kinds["DirectionalLight"]((0, 0, 500), (0.6, 0, -0.8), (1, 0.5, 0.25), intensity=8)
    spot = kinds["SpotLight"]((10, 20, 30), (0, 1, 0), (0.2, 0.4, 1), intensity=5, inner_cone_angle=20, outer_cone_angle=35)
    for name, kind in kinds.items():
        setattr(stand_in, name, kind)
    stand_in.get_editor_subsystem = lambda _: SimpleNamespace(get_all_level_actors=lambda: [object(), sun, spot])
    collection = stand_in.make("collection")
    vectors = [stand_in.make("vector") for _ in unreal.LIGHTS]
    for vector, name in zip(vectors, unreal.LIGHTS, strict=True):
        vector.set_editor_property("parameter_name", name)
    collection.set_editor_property("vector_parameters", vectors)
    stand_in.load_asset = lambda _: collection
    monkeypatch.setattr(sys, "argv", ["import_srbf.py", "follow"])
    runpy.run_path(str(folders["eigen-map"] / "import_srbf.py"), run_name="__main__")
    values = {vector.properties["parameter_name"]: vector.properties["default_value"] for vector in vectors}
    assert values["SunDirection"] == (-0.6, 0, 0.8, 0)
    assert values["SunColor"] == (8, 4, 2, 0)
    assert values["PointLightPosition"] == (10, 20, 30, 0) and values["PointLightAxis"] == (0, 1, 0, 0)
    assert values["PointLightColor"] == (1, 2, 5, 0)
    np.testing.assert_allclose(values["PointLightShape"], [1, 0.05, versine(math.radians(20)), versine(math.radians(35))])
