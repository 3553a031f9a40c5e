"""Unity's passes that light surfels, drawn one after the other as its component draws them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from passes import PART, Look, Passes, face_axes, frame_of, square, summed

from srbf.asset import Asset
from srbf.io.image import read_image
from srbf.lights import DirectionalLight, Light

SHADOWS = 256  # texels of a face


def shader_of(folder: Path, name: str) -> str:
    """An include of Shaders/ with the pack in place, for OpenGL, whose rows run upwards."""
    line = '#include "SrbfSurfelPack.hlsl"\n'
    text = (folder / "Srbf/Shaders" / name).read_text()
    assert text.count(line) == 1
    return "#define SHADER_API_GLCORE\n" + text.replace(line, (folder / "Srbf/Shaders/SrbfSurfelPack.hlsl").read_text())


class Unity:
    """The passes of SrbfSurfelPasses.cs, in its order and with its uniforms."""

    def __init__(self, passes: Passes, folder: Path, told: dict[str, Any], asset: Asset) -> None:
        text = shader_of(folder, "SrbfSurfels.hlsl")
        names: dict[str, tuple[str, ...]] = {"onCube": ("SrbfNearness", "SrbfOccluderOnCube"), "onMap": ("SrbfHeight", "SrbfOccluderOnMap")}
        names |= {"byCube": ("SrbfIrradianceByCube",), "byMap": ("SrbfIrradianceByMap",), "means": ("SrbfMeans",)}
        names |= {"parts": ("SrbfTableParts",), "sums": ("SrbfTableSums",), "cells": ("SrbfCells",), "product": ("SrbfProduct",)}
        names |= {"exchange": ("SrbfExchange",), "repainted": ("SrbfRepainted",)}
        self.programs = {name: passes.program(text, *entries) for name, entries in names.items()}
        self.passes, self.told, self.asset, self.folder = passes, told, asset, folder
        files_of = {name: read_image(folder / told[name]) for name in ("places", "normals", "ranges", "corners")}
        self.images = {f"_Srbf{name.capitalize()}": passes.texture(pixels) for name, pixels in files_of.items()}

    def irradiance(self, lights: list[Light]) -> Any:
        sum_ = self.passes.target(*self.images["_SrbfPlaces"].size)
        for light in lights:
            distant = isinstance(light, DirectionalLight)
            size = 4 * SHADOWS if distant else SHADOWS
            values = self.values(light)
            slices = []
            for face in range(1 if distant else 6):
                axes = frame_of(np.array(light.direction)) if isinstance(light, DirectionalLight) else face_axes(face)
                values |= {f"_Srbf{name}": (*axis, 0) for name, axis in zip(("Across", "Up", "Ahead"), axes, strict=True)}
                slices.append(self.passes.target(size, size, 1))
                program = self.programs["onMap" if distant else "onCube"]
                self.passes.draw(program, slices[-1], self.images, values, 3 * self.told["triangles"], "max")
            nearness = self.passes.texture(np.stack([self.passes.read(face) for face in slices]))
            self.passes.draw(
                self.programs["byMap" if distant else "byCube"], sum_, self.images | {"_SrbfNearness": nearness}, values, 3, "add"
            )
        return sum_

    def values(self, light: Light) -> dict[str, Any]:
        look = Look.of(light, np.array(self.told["middle"]))
        return {
            "_SrbfReach": [self.told["reach"]],
            "_SrbfLift": [self.told["lift"]],
            "_SrbfLightPlace": (*look.place, 0),
            "_SrbfLightColor": (*look.color, 0),
            "_SrbfLightAxis": (*look.axis, float(look.squared)),
            "_SrbfLightShape": look.shape,
        }

    def weights(self, irradiance: Any, added: Any = None, repainted: Any = None) -> np.ndarray:
        """`added`: a texture of a row per row of the first table; `repainted`: that table with other albedo."""
        numbers = self.passes.target(*self.images["_SrbfRanges"].size)
        self.passes.draw(self.programs["means"], numbers, self.images | {"_SrbfIrradiance": irradiance}, {})
        for i, table in enumerate(self.told["tables"]):
            rows, columns = table["rows"], table["columns"]
            blocks = -(-columns // PART)
            last = i == len(self.told["tables"]) - 1
            shape = (self.asset.components + 1, self.asset.clusters) if last else square(rows)
            parts, target = self.passes.target(*square(rows * blocks)), self.passes.target(*shape)
            values = {"_SrbfTable": (rows, columns, blocks, table["channels"] == 1), "_SrbfScale": [table["scale"]]}
            entries = self.passes.texture(read_image(self.folder / table["file"]))
            if repainted is not None and i == 0:
                entries, values["_SrbfScale"] = repainted, [1]
            self.passes.draw(
                self.programs["parts"],
                parts,
                {"_SrbfEntries": entries, "_SrbfNumbers": numbers},
                values | {"_SrbfTargetWidth": [parts.size[0]]},
            )
            more = added if added is not None and i == 0 else self.passes.target(1, 1)
            images = {"_SrbfParts": parts, "_SrbfAdded": more}
            self.passes.draw(self.programs["sums"], target, images, values | {"_SrbfTargetWidth": [shape[0]]})
            numbers = target
        return self.passes.read(numbers)[..., :3]

    def multiplied(
        self,
        name: str,
        shape: tuple[int, int],
        left: Any,
        right: Any,
        count: int,
        scale: float,
        addend: Any,
        images: dict[str, Any] | None = None,
    ) -> Any:
        """`addend`: a texture and its scale."""
        made = self.passes.target(*shape[::-1])
        images = {"_SrbfLeft": left, "_SrbfRight": right, "_SrbfAddend": addend[0], **(images or {})}
        self.passes.draw(self.programs[name], made, images, {"_SrbfMatrix": (count, scale, addend[1], 1)})
        return made

    def lit_by(self, panorama: np.ndarray, axes: np.ndarray, energy: float, added: Any) -> Any:
        """What is added with an environment: rows from below, `axes` the directions of Unity's x, z and -y in the asset's frame."""
        told = self.told["environment"]
        images = {"_SrbfCells": read_image(self.folder / self.told["cells"]), "_SrbfEnvironment": panorama}
        values = {"_SrbfAtMiddle": (*axes[0], told["side"]), "_SrbfAtLeft": (*axes[1], 0), "_SrbfAtRowZero": (*axes[2], energy)}
        radiances = self.passes.target(1, told["columns"])
        self.passes.draw(self.programs["cells"], radiances, {name: self.passes.texture(pixels) for name, pixels in images.items()}, values)
        rows = self.told["tables"][0]["rows"]
        table = self.passes.texture(read_image(self.folder / told["file"]))
        return self.multiplied("product", (rows, 1), table, radiances, told["columns"], told["scale"], (added, 1))

    def repainted(self, albedo: np.ndarray) -> tuple[Any, Any, Any]:
        """(exchange, series, table) with the albedo of surfels (S, 2, 3) now, and of the bake."""
        told, table = self.told["changes"], self.told["tables"][0]
        rank, count = told["feedback"]["columns"], told["gather"]["columns"]
        matrix = {name: self.passes.texture(read_image(self.folder / told[name]["file"])) for name in ("gather", "sent", "feedback")}
        images = {"_SrbfAlbedo": self.passes.texture(np.pad(albedo, ((0, 0), (0, 0), (0, 1)))), "_SrbfEntries": matrix["gather"]}
        addend, scale = (matrix["feedback"], told["feedback"]["scale"]), told["gather"]["scale"] * told["sent"]["scale"]
        exchange = self.multiplied("exchange", (rank, rank), matrix["gather"], matrix["sent"], count, scale, addend, images)
        one = self.passes.identity(rank)

        def product(left: Any, right: Any, addend: Any) -> Any:
            return self.multiplied("product", (rank, rank), left, right, rank, 1, (one, 0) if addend is None else (addend, 1))

        series = summed(product, exchange, one, told["terms"])
        before, own = (
            self.passes.texture(read_image(self.folder / told["series"])),
            self.passes.texture(read_image(self.folder / table["file"])),
        )
        changed = self.multiplied("repainted", (rank, count), before, series, rank, told["gather"]["scale"], (own, table["scale"]), images)
        return exchange, series, changed
