"""What a light lays on the cells of a scene's surfaces, as a texture: by cubes of shadow maps about points of the light, or by rays."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.gl.deep_framebuffer import folded
from srbf.gl.programs import Programs
from srbf.io.scene_glb import read_triangles
from srbf.light_linking import choices_of
from srbf.lights import AreaLight, Light, PointLight, SpotLight, triple
from srbf.visibility.gl_resources import ProfileTextures, Resources
from srbf.visibility.linked_light import LinkedLight
from srbf.visibility.looks import WORLD, Look, look_of
from srbf.visibility.received import SIDE, lift_of
from srbf.visibility.shadow_casters import POINT_STAGES, ShadowCasters, ShadowMaps
from srbf.visibility.surface_cells import Cells

if TYPE_CHECKING:
    import moderngl

FACE = 1024  # texels per side of a face of the shadow cube
NARROW = np.radians(30)  # half-angle of a spot that one map holds in place of a cube, with
MARGIN = 1.5  # times its width: surfels that the cone ends in have their middles outside


class SurfelLight:
    """Direct irradiance on cells as a texture of one texel per cell: the GPU's `srbf.visibility.received.ReceivedLight`.

    Point, spot, sphere and area lights by shadow maps, where `cubes` says so; all others, and those that choose objects, by rays.

    Parameters
    ----------
    programs
        Of the context, which is current whenever `draw` is called.
    cells
        N cells.
    scene
        scene.glb: what casts shadows.
    size
        Texels per side of a face of the shadow cube.
    by_rays
        What measures lights without a cube; None: rays that know no objects.
    cubes
        Whether lights have shadow cubes.
    """

    def __init__(
        self, programs: Programs, cells: Cells, scene: bytes, size: int = FACE, by_rays: LinkedLight | None = None, cubes: bool = True
    ) -> None:
        self._programs, self._cubes = programs, cubes
        self._resources = Resources(programs.context)
        programs.resources.callback(self._resources.close)
        places = cells.places.astype(np.float64)
        self.center: Float64[ndarray, " 3"] = (places.min(axis=0) + places.max(axis=0)) / 2  # single precision is finest about the origin
        self._lift = lift_of(places)
        self._cells, self._scene, self._size = cells, scene, size
        rows, across, _ = folded(cells.normals).shape
        self.texture, self._target = self._resources.target((across, rows), 4, "f4")
        self._by_rays = LinkedLight(cells, scene, (), None) if by_rays is None else by_rays
        self._traced_last: Float32[ndarray, "N 3"] | None = None

    @functools.cached_property
    def casters(self) -> ShadowCasters:
        """The triangles that cast shadows, on the GPU once a cube is drawn."""
        return ShadowCasters(self._resources, read_triangles(self._scene), self.center)

    @functools.cached_property
    def maps(self) -> ShadowMaps:
        """The face of a shadow cube that was drawn last."""
        return ShadowMaps.of(self._resources, self._size)

    @functools.cached_property
    def _surfaces(self) -> tuple[moderngl.Texture, moderngl.Texture]:
        """Places with areas, and normals."""
        places = np.column_stack([self._cells.places - self.center, self._cells.areas]).astype(np.float32)
        return self._resources.texture(folded(places)), self._resources.texture(folded(self._cells.normals))

    @functools.cached_property
    def _profiles(self) -> ProfileTextures:
        return ProfileTextures(self._resources)

    def draw(self, light: Light) -> moderngl.Texture:
        """The irradiance of one light of the asset's frame, until the next call; by cubes, blending is left on and additive.

        MissingLibraryError without embreex for lights that have no cube.
        """
        self._traced_last = None
        if not self._cubes or not isinstance(light, (PointLight, AreaLight)) or choices_of(light):
            return self._traced(light)
        gl: Any = self._programs.context
        self._target.use()
        self._target.clear()
        for point, lambertian, weight in points_of(light):
            for uniforms in self.faces(point):
                self._target.use()
                for unit, texture in enumerate((*self._surfaces, self.maps.heights[0])):
                    texture.use(unit)
                if point.profile is not None:
                    self._profiles.of(point.profile).use(3)
                gl.enable_only(gl.BLEND)
                gl.blend_equation, gl.blend_func = gl.FUNC_ADD, (gl.ONE, gl.ONE)
                units = {
                    "surfels": 0,
                    "normals": 1,
                    "heights": 2,
                    "profile": 3,
                    "lift": self._lift,
                    "lambertian": lambertian,
                    "weight": weight,
                }
                self._programs.run("deep_framebuffer_surfels.frag", {}, {**uniforms, **units})
        return self.texture

    def read(self) -> Float32[ndarray, "N 3"]:
        """What was drawn last, without waiting for the GPU where rays told it."""
        if self._traced_last is not None:
            return self._traced_last
        return np.frombuffer(self.texture.read(), np.float32).reshape(-1, 4)[: len(self._cells.places), :3]

    def faces(self, light: PointLight) -> Iterator[dict[str, Any]]:
        """Draw the shadow cube about a light into `maps`, face after face, or one map of a narrow spot; the uniforms that look it up."""
        local = replace(light, position=triple(np.array(light.position) - self.center))
        narrow = isinstance(local, SpotLight) and local.outer <= NARROW
        look = look_of(local) if narrow else Look(local, (0.0, 0.0, 0.0), WORLD, (0, 1, 2, 3, 4, 5))
        for uniforms in look.maps(self._size):
            uniforms["reach"] *= MARGIN if narrow else 1
            self.casters.draw(self.maps, POINT_STAGES, uniforms)
            yield {**uniforms, **{f"pointLight.{name}": value for name, value in uniforms["pointLight"].items()}}

    def _traced(self, light: Light) -> moderngl.Texture:
        self._traced_last = self._by_rays.irradiance(light).astype(np.float32)
        found = folded(self._traced_last)
        self.texture.write(np.ascontiguousarray(np.pad(found, ((0, 0), (0, 0), (0, 1)))))
        return self.texture


def points_of(light: PointLight | AreaLight) -> Iterator[tuple[PointLight, float, float]]:
    """(white light, 1 where it shines by the cosine to its axis, its share) of each point that stands for a light."""
    if isinstance(light, PointLight):
        yield light, 0.0, 1.0
        return
    u, v, center = np.array(light.u), np.array(light.v), np.array(light.position)
    steps = (np.arange(SIDE) + 0.5) / SIDE - 0.5
    for place in (center + s * u + t * v for s in steps for t in steps):
        point = SpotLight(triple(place), a0=light.a0, falloff="inverse-square", direction=light.direction, inner=np.pi, outer=np.pi)
        yield point, 1.0, 1 / SIDE**2
