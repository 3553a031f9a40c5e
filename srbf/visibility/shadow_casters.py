"""What casts shadows, drawn into the maps of one size: the nearest occluder, the nearest translucent wall, what the walls let through."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float64
from srbf.gl.uniforms import padded
from srbf.io.scene_glb import Triangles
from srbf.visibility.gl_resources import Resources, Target, render

if TYPE_CHECKING:
    import moderngl

NO_OCCLUDER = -1e30  # height
SUN_STAGES = ("shadow.vert", "shadow_height.frag", "shadow_transmittance.frag")
POINT_STAGES = ("point_shadow.vert", "point_shadow_nearness.frag", "point_shadow_transmittance.frag")


@dataclass(frozen=True, eq=False)
class ShadowMaps:
    """The maps of one light and look: heights towards it, those of translucent walls, and the walls' transmittance."""

    heights: Target
    wall_heights: Target
    transmittance: Target

    @staticmethod
    def of(resources: Resources, size: int) -> ShadowMaps:
        """Maps of `size` squared texels."""
        heights, walls = (resources.target((size, size), 1, "f4") for _ in range(2))
        transmittance = resources.target((size, size), 4, "f2")
        transmittance[0].filter = (resources.context.LINEAR, resources.context.LINEAR)
        return ShadowMaps(heights, walls, transmittance)

    def textures(self) -> dict[str, moderngl.Texture]:
        """By the names of the shaders."""
        return {"heights": self.heights[0], "wallHeights": self.wall_heights[0], "transmittance": self.transmittance[0]}


class ShadowCasters:
    """A scene's triangles as occluders and as walls of every translucent material."""

    def __init__(self, resources: Resources, triangles: Triangles, center: Float64[ndarray, " 3"]) -> None:
        self._resources = resources
        vertices = np.concatenate([triangles.corners - center, triangles.normals], axis=2).astype(np.float32)  # (T, 3, 6)
        self._occluders = self._buffer(vertices[triangles.occluders])
        self._walls = []
        for material in np.unique(triangles.material[triangles.filters]):
            chosen = vertices[triangles.filters & (triangles.material == material)]
            self._walls.append((padded(triangles.transmittance[material]), self._buffer(chosen)))
        self._arrays: dict[tuple[str, str], list[tuple[dict[str, Any], moderngl.VertexArray]]] = {}

    @property
    def has_walls(self) -> bool:
        """Whether anything is translucent."""
        return bool(self._walls)

    def draw(self, maps: ShadowMaps, stages: tuple[str, str, str], uniforms: dict[str, Any]) -> None:
        """Fill the maps of a light: `stages` are a vertex stage and the fragment stages of heights and transmittance."""
        gl: Any = self._resources.context
        vertex, height, transmittance = stages
        gl.enable_only(gl.BLEND)
        gl.blend_equation = gl.MAX
        self._draw(maps.heights, NO_OCCLUDER, self._of(vertex, height, "occluders"), uniforms)
        if not self._walls:
            return
        self._draw(maps.wall_heights, NO_OCCLUDER, self._of(vertex, height, "walls"), uniforms)
        gl.blend_equation = gl.FUNC_ADD
        gl.blend_func = gl.DST_COLOR, gl.ZERO
        self._draw(maps.transmittance, 1, self._of(vertex, transmittance, "walls"), uniforms)

    def _draw(
        self, target: Target, clear: float, arrays: list[tuple[dict[str, Any], moderngl.VertexArray]], uniforms: dict[str, Any]
    ) -> None:
        target[1].use()
        target[1].clear(clear, clear, clear, clear)
        for own, array in arrays:
            render(array, {**uniforms, **own})

    def _of(self, vertex: str, fragment: str, what: str) -> list[tuple[dict[str, Any], moderngl.VertexArray]]:
        """Vertex arrays with the uniforms of each; made when they are first drawn."""
        key = (fragment, what)
        if key not in self._arrays:
            buffers = [({"curve": curve}, buffer) for curve, buffer in self._walls] if what == "walls" else [({}, self._occluders)]
            program = self._resources.program(vertex, fragment)
            layout = ("3f 3f", "corner", "cornerNormal") if "cornerNormal" in program else ("3f 12x", "corner")
            self._arrays[key] = [(own, self._resources.array(program, buffer, *layout)) for own, buffer in buffers if buffer is not None]
        return self._arrays[key]

    def _buffer(self, vertices: ndarray) -> moderngl.Buffer | None:
        return self._resources.buffer(vertices) if len(vertices) else None
