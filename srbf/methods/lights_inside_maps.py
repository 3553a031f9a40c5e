"""Table maps of lights inside a scene: weights by shadow rays to cells of its surfaces, or by a table of places where there are no rays.

What the light cloud and the transfer of direct light share.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.asset import Asset
from srbf.asset_reader import AssetReader
from srbf.capture import Capture
from srbf.compute.threads import each, one_blas_thread
from srbf.encode.position_table import FILES, PositionTable, position_table
from srbf.light_domain.cloud import isotropic
from srbf.lights import Light, PointLight, refuse_named
from srbf.methods import kept_visibility
from srbf.methods.light_table_maps import LightTableMaps
from srbf.visibility.cloud_lights import CloudLights
from srbf.visibility.embree import has_embree


class LightsInsideMaps(LightTableMaps):
    """A method whose lights are inside the scene."""

    tables: ClassVar[dict[str, str]] = {**LightTableMaps.tables, "cells": "cells.exr", **FILES, **kept_visibility.FILES}
    takes_profiles: ClassVar[bool] = True

    visibility: str = "none"  # compressed depths of the surfels; and of the receivers:
    receiver_visibility: bool = False

    @classmethod
    def read_tables(cls, reader: AssetReader) -> dict[str, ndarray]:
        tables = {**super().read_tables(reader), "cells": reader.rows("cells", 2, 4)}
        told = reader.manifest["position_table"]
        nx, ny, nz = told["nodes"]
        functions = len(tables["light_values"])
        fine = told["fine"]
        tables["position_nodes"] = reader.table("position_nodes", (nx * ny * nz, told["rank"]), 1)[:, :, 0]
        tables["position_basis"] = reader.half_table("position_basis", (told["rank"], functions), 3)
        shape = (fine * (nz - 1) * fine * (ny - 1), 8 * fine * (nx - 1))
        seen = np.round(reader.table("position_visibility", shape, 1)[:, :, 0] * 255)
        return {**tables, "position_visibility": seen.astype(np.uint8), **kept_visibility.read_visibility(reader)}

    def on_sample(self, ratio: float) -> LightTableMaps:
        """A trial measures by rays."""
        settings: Any = super().on_sample(ratio)
        return replace(settings, visibility="none", receiver_visibility=False)

    def add_visibility(self, asset: Asset, inside: CloudLights) -> None:
        """Compressed depths, as the settings ask for."""
        kept_visibility.add_visibility(asset, inside, self.visibility, self.receiver_visibility)

    @classmethod
    def add_places(cls, asset: Asset, inside: CloudLights) -> None:
        """The cells, and the table of places, which needs all else of the asset."""
        asset.tables["cells"] = inside.cells.image()
        asset.manifest["cells"] = {"file": cls.tables["cells"]}
        places = position_table(lambda at: cls.at_places(asset, at), inside.visible, inside.free).in_steps(asset.clusters)
        asset.manifest |= places.manifest()
        asset.tables |= places.tables()

    @classmethod
    def projected_weights(cls, asset: Asset, lights: Sequence[Light]) -> Float64[ndarray, "F 3"]:
        """By rays where Embree is installed, else by compressed depths, else by the table of places, which point lights alone are in."""
        if not lights:
            return np.zeros((len(asset.tables["light_values"]), 3))
        if not cls.takes_objects:
            refuse_named(lights, cls.name)
        if has_embree() or kept_visibility.has_depths(asset):
            return super().projected_weights(asset, lights)
        traced = [light for light in lights if cls.needs_rays(asset, light)]
        others = [light for light in lights if not cls.needs_rays(asset, light)]
        return np.sum([super().projected_weights(asset, others), *(_from_table(asset, light) for light in traced)], axis=0)

    @classmethod
    def needs_rays(cls, asset: Asset, light: Light) -> bool:
        """Whether a light is measured on the surfaces, by rays or compressed depths."""
        return True

    @classmethod
    def captured_responses(cls, asset: Asset, capture: Capture, lights: Sequence[int]) -> Float32[ndarray, "b H W 3"]:
        """Patches and shapes are columns of the table; point lights are relit as such."""
        if any(capture.lights[i].kind != "patch" for i in lights):
            return super().captured_responses(asset, capture, lights)
        return cls.columns(asset, [int(capture.lights[i].patch or 0) for i in lights])

    @classmethod
    def responses(cls, asset: Asset, coordinates: Float64[ndarray, "b 3"]) -> Float32[ndarray, "b H W 3"]:
        return cls.weighted(asset, cls.at_places(asset, coordinates))

    @classmethod
    def at_places(cls, asset: Asset, places: Float64[ndarray, "b 3"]) -> Float64[ndarray, "b F 3"]:
        """Weights of white point lights of unit irradiance at 1 m."""
        lights = [PointLight((x, y, z), falloff="inverse-square") for x, y, z in places.tolist()]
        found = np.empty((len(lights), len(asset.tables["light_values"]), 3))

        def measure(number: int) -> None:
            found[number] = cls.projected_weights(asset, lights[number : number + 1])

        with one_blas_thread():
            each(measure, len(lights))
        return found


def _from_table(asset: Asset, light: Light) -> Float64[ndarray, "F 3"]:
    point = isotropic(light)
    return PositionTable.of(asset.manifest, asset.tables).evaluate(np.array(point.position)) * (np.array(point.color) * point.a0**2)
