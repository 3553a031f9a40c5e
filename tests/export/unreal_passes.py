"""Unreal's passes that light surfels: their Custom nodes drawn one after the other as its component draws them."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
from made_surfels import RANK
from passes import PART, Look, Passes, face_axes, frame_of, square, summed

from srbf.asset import Asset
from srbf.export import surfel_textures
from srbf.io.image import read_image
from srbf.lights import DirectionalLight, Light, PointLight
from srbf.methods.kept_visibility import kept_visibility
from srbf.methods.surface_changes import Surfaces
from srbf.visibility.cloud_lights import CloudLights
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.surface_cells import Cells

SHADOWS = 128  # texels of a face
# What Unreal writes about a Custom node's code.
CUSTOM = """
cbuffer Parameters {
    FLOAT4S
};
TEXTURES

float3 CustomExpression0(ARGUMENTS) {
CODE
}

float4 main(float4 at : SV_Position) : SV_Target {
    return float4(CustomExpression0(CALL), 1.0);
}
"""


def node_of(folder: Path) -> dict[str, Any]:
    return dict(json.loads((folder / "node.json").read_text())["surfels"])


def shader_of(folder: Path, told: dict[str, Any], include: str) -> str:
    """The .ush and a pass's code, the way Unreal puts them together; each texture is followed by its sampler."""
    arguments, values, textures = [], [], []
    for name in told["inputs"]:
        if name == "UV":
            arguments.append("float2 UV")
            values.append("at.xy / SetSize.xy")
        elif name in told["vectors"]:
            arguments.append(f"float4 {name}")
            values.append(f"Set{name}")
        else:
            textures.append(f"Texture2D Material{name}; SamplerState Material{name}Sampler;")
            arguments.append(f"Texture2D {name}, SamplerState {name}Sampler")
            values.append(f"Material{name}, Material{name}Sampler")
    text = CUSTOM.replace("FLOAT4S", "\n    ".join(f"float4 Set{name};" for name in told["vectors"]))
    text = text.replace("TEXTURES", "\n".join(textures)).replace("ARGUMENTS", ", ".join(arguments))
    return (folder / "Shaders" / Path(include).name).read_text() + text.replace("CALL", ", ".join(values)).replace("CODE", told["code"])


class Unreal:
    """The passes of SrbfSurfelLights.cpp, in its order and with its parameters."""

    def __init__(self, passes: Passes, folder: Path, asset: Asset) -> None:
        node = node_of(folder)
        self.passes, self.asset, self.folder = passes, asset, folder
        self.told = node["materials"]
        self.programs = {name: passes.program(shader_of(folder, told, node["include"]), "main") for name, told in self.told.items()}
        self.made = surfel_textures.surfel_textures(asset)

    def draw(self, name: str, target: Any, images: dict[str, Any], values: dict[str, Any]) -> None:
        own = {key: self.passes.texture(read_image(self.folder / file)) for key, file in self.told[name]["textures"].items()}
        given = {f"Material{key}": texture for key, texture in (own | images).items()}
        numbers = {f"Set{key}": value for key, value in (values | {"Size": (*target.size, 0, 0)}).items()}
        self.passes.draw(self.programs[name], target, given, numbers)

    def irradiance(self, lights: list[Light], faces: bool) -> Any:
        height, width = self.made.places.shape[:2]
        target = self.passes.target(width, height)
        for light in lights:
            former, target = target, self.passes.target(width, height)
            images = {"Former": former}
            values = self.values(light)
            if faces:
                space = (self.made.lift, self.made.reach, 0.01 * 1.25, 0)
                images |= {f"Face{i}": self.passes.texture(depths) for i, depths in enumerate(self.captured(light))}
                across, up, _ = frame_of(np.array(light.direction)) if isinstance(light, DirectionalLight) else np.eye(3)
                values |= {"Across": (*across, 0), "Up": (*up, 0)}
            else:
                kept = kept_visibility(self.asset, "surfel_visibility", Cells.of_image(self.asset.tables["cells"]).normals)
                space = (self.made.lift, kept.far, math.ceil((kept.coefficients.shape[1] + 1) / 4), 0)
            self.draw("SurfelIrradiance", target, images, values | {"Space": space})
        return target

    def values(self, light: Light) -> dict[str, Any]:
        look = Look.of(light, self.made.middle)
        return {"Light": (*look.place, float(look.distant)), "Color": (*look.color, 0), "Axis": (*look.axis, 0), "Shape": look.shape}

    def captured(self, light: Light) -> list[np.ndarray]:
        """Depths of captures, in Unreal's units, by rays: a camera's columns run to its right, its rows downwards."""
        occluders = CloudLights.of_asset(self.asset).occluders
        if isinstance(light, DirectionalLight):
            _, rows, toward = frame_of(np.array(light.direction))
            views = [(self.made.middle + 2 * self.made.reach * toward, rows, -toward)]
        else:
            assert isinstance(light, PointLight)
            views = [(np.array(light.position), face_axes(face)[1], face_axes(face)[2]) for face in range(6)]
        size = 4 * SHADOWS if isinstance(light, DirectionalLight) else SHADOWS
        middle = (np.arange(size) + 0.5) / size * 2 - 1
        images = []
        for place, down, ahead in views:
            right = np.cross(down, ahead)
            offset = middle[None, :, None] * right + middle[:, None, None] * down
            if isinstance(light, DirectionalLight):
                start, ray = place + self.made.reach * offset, np.broadcast_to(ahead, offset.shape)
            else:
                start, ray = np.broadcast_to(place, offset.shape), offset + ahead
            images.append(depth_along(occluders, start.reshape(-1, 3), ray.reshape(-1, 3)).reshape(size, size, 1) / (0.01 * 1.25))
        return images + (6 - len(images)) * [np.zeros((1, 1, 1))]

    def weights(self, irradiance: Any, added: Any = None, repainted: Any = None) -> np.ndarray:
        """`added`: a row per row of the first table; `repainted`: that table with other albedo."""
        added = self.passes.target(1, RANK) if added is None else added
        numbers = self.passes.target(*self.made.ranges.shape[1::-1])
        self.draw("SurfelMeans", numbers, {"Irradiance": irradiance}, {})
        tables = [self.asset.manifest[name]["scale"] for name in ("surfel_transfer", "light_values")]
        for i, name in enumerate(("surfel_transfer", "light_values")):
            rows, columns = self.asset.tables[name].shape[:2]
            blocks = -(-columns // PART)
            values = {"Entries": (rows, columns, blocks, tables[i])}
            sums = square(rows) if i == 0 else (self.asset.components + 1, self.asset.clusters)
            target = self.passes.target(*square(rows * blocks))
            if repainted is not None and i == 0:
                self.draw("SurfelParts0", target, {"Numbers": numbers, "Table": repainted}, {"Entries": (rows, columns, blocks, 1)})
            else:
                self.draw(f"SurfelParts{i}", target, {"Numbers": numbers}, values)
            numbers = self.passes.target(*sums)
            self.draw(f"SurfelSums{i}", numbers, {"Parts": target, **({"Added": added} if i == 0 else {})}, values)
        return self.passes.read(numbers)[..., :3]

    def made_by(self, name: str, width: int, height: int, images: dict[str, Any], **values: Any) -> Any:
        target = self.passes.target(width, height)
        self.draw(name, target, images, values)
        return target

    def lit_by(self, panorama: np.ndarray, axes: list[tuple[float, ...]], added: Any) -> Any:
        told = self.asset.manifest["environment_transfer"]
        count = len(told["cells"])
        images = {"Environment": self.passes.texture(panorama)}
        cells = self.made_by("SurfelCells", 1, count, images, **dict(zip(("Ahead", "Left", "Up"), axes, strict=True)))
        return self.made_by("SurfelEnvironment", 1, RANK, {"Second": cells, "Addend": added}, Matrix=(count, told["scale"], 1, 0))

    def repainted(self, albedo: np.ndarray) -> tuple[Any, Any, Any]:
        """(exchange, series, table) with the albedo of surfels (S, 2, 3) now, and of the bake."""
        scales, count = self.asset.manifest["surfaces"]["scales"], len(albedo)
        images = {"Albedo": self.passes.texture(np.pad(albedo, ((0, 0), (0, 0), (0, 1))))}
        scale, feedback = scales["surface_gather"] * scales["surface_sent"], scales["surface_feedback"]
        exchange = self.made_by("SurfelExchange", RANK, RANK, images, Matrix=(count, scale, feedback, 0))
        one = self.passes.identity(RANK)

        def product(left: Any, right: Any, addend: Any) -> Any:
            own = {"First": left, "Second": right, "Addend": one if addend is None else addend}
            return self.made_by("SurfelProduct", RANK, RANK, own, Matrix=(RANK, 1, 0 if addend is None else 1, 0))

        series = summed(product, exchange, one, surfel_textures.terms_of(Surfaces.of(self.asset)))
        matrix = (RANK, scales["surface_gather"], self.asset.manifest["surfel_transfer"]["scale"], 0)
        return exchange, series, self.made_by("SurfelRepainted", count, RANK, images | {"Series": series}, Matrix=matrix)


def depth_along(occluders: EmbreeTriangles, start: np.ndarray, ray: np.ndarray) -> np.ndarray:
    """How often `ray` fits between a start and the first surface; a large number without one."""
    length = np.linalg.norm(ray, axis=1)
    triangle, distance, _ = occluders.first_hit(start, ray / length[:, None])
    return np.where(triangle < 0, 1e4, distance / length)
