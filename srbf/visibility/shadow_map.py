"""Direct light by shadow maps on the GPU, as in an engine, for comparison with rays."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float32, Float64
from srbf.errors import ShaderError
from srbf.gl.context import Limits, create_context
from srbf.light_linking import Objects
from srbf.lights import AreaLight, DirectionalLight, Light, PointLight, has_size, triple
from srbf.unshadowed import irradiance_from
from srbf.visibility.gl_resources import ProfileTextures, Resources, render
from srbf.visibility.light_rays import CastingLight
from srbf.visibility.linked_triangles import casting, lit_at, lit_triangles
from srbf.visibility.looks import look_of, looks_over
from srbf.visibility.lookup_points import EDGE_PARTS, LookupPoints
from srbf.visibility.map_lookups import Lookups, PixelLookups, visible_part
from srbf.visibility.receivers import Receivers, disc_points, spread_points
from srbf.visibility.shadow_casters import POINT_STAGES, SUN_STAGES, ShadowCasters, ShadowMaps
from srbf.visibility.sun_cascades import Cascades, uniforms_of

if TYPE_CHECKING:
    import moderngl

SIZE = 2048  # texels per side of a sun's or a spot's map, twice a cube's face
FINER_IN_VIEW = 2  # sides of a sun's map where a camera sees small curved parts, on a GPU that has room
SUN_SAMPLES = 16  # shadow maps of a sun with a disc
LOOKS = 32  # places of a light with a size
LOOK_SIZE = 512  # texels per side of their cubes' faces
LAYERS_PER_LOOK = 4  # of a texel's lookups
PROFILE_UNIT = 6


class ShadowMapper:
    """Direct light on receivers by shadow maps; a context manager.

    A directional light has an orthographic map, or in large views up to five nested ones, the finer the nearer the camera; a spot one
    perspective map, a point light (and a spot wider than 75 degrees) a cube of six, a sphere, an area or a spot with a size many maps.
    Percentage-closer filtering over 3 x 3 texels; translucent walls multiply a second map by their transmittance. A pixel of a view that
    shows several surfaces is the mean of points on all of them. ShaderError without OpenGL 3.3.
    """

    def __init__(self, receivers: Receivers, size: int = SIZE, context: moderngl.Context | None = None) -> None:
        self._receivers = receivers
        self._size = size
        self._context = create_context() if context is None else context
        self._owned = context is None
        self._resources = Resources(self._context)
        try:
            with self._context:
                self._prepare()
        except BaseException:
            self.__exit__(None, None, None)
            raise

    def __enter__(self) -> ShadowMapper:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        with self._context:
            self._resources.close()
        if self._owned:
            self._context.release()

    def response(self, lights: Sequence[Light]) -> Float32[ndarray, "H W 3"]:
        """The direct light of `lights` in the receivers' quantity; environments and named lights add nothing."""
        return self.irradiance(lights) * self._receivers.reflectance()

    def irradiance(self, lights: Sequence[Light]) -> Float32[ndarray, "H W 3"]:
        """What `response` is a reflection of."""
        total = np.zeros((self._receivers.height, self._receivers.width, 3), np.float32)
        for light in lights:
            if isinstance(light, DirectionalLight):
                irradiance = self._of_sun(light)
            elif has_size(light):
                irradiance = self._of_size(self._from_center(light))
            elif isinstance(light, PointLight):
                irradiance = self._of_point(self._from_center(light))
            else:
                continue
            total += irradiance * np.array(light.color, np.float32)
        return total

    def directional(self, directions: Float64[ndarray, "b 3"]) -> Float32[ndarray, "b H W 3"]:
        """`response` to a white light from each of many directions."""
        return np.stack([self.response([DirectionalLight((float(x), float(y), float(z)))]) for x, y, z in directions])

    def _from_center(self, light: Any) -> Any:
        """A light with a place, as the map's frame has it."""
        return replace(light, position=triple(np.array(light.position) - self._center))

    def _of_sun(self, light: DirectionalLight) -> Float32[ndarray, "H W 3"]:
        suns = list(_suns(np.array(light.direction), light.angle_or(self._receivers.sun_angle)))
        maps = []
        for sun in suns:
            frames = self._cascades.frames(sun, self._sun_size)
            maps += [{**uniforms_of(frames, number), "weight": 1 / len(suns)} for number in range(len(frames))]
        return self._of_maps(SUN_STAGES, maps, self._sun_size, light)

    def _of_point(self, light: PointLight) -> Float32[ndarray, "H W 3"]:
        look = look_of(light)
        size = max(1, self._size // 2) if look.faces else self._size
        if light.profile is not None:
            with self._context:
                self._profiles.of(light.profile).use(PROFILE_UNIT)
        return self._of_maps(POINT_STAGES, [{**uniforms, "weight": 1.0} for uniforms in look.maps(size)], size, light)

    def _of_maps(
        self, stages: tuple[str, str, str], looks: list[dict[str, Any]], size: int, light: CastingLight
    ) -> Float32[ndarray, "H W 3"]:
        """By a map of each look; once more at more points of the pixels that the edge of a shadow crosses."""
        lit = lit_triangles(self._receivers.triangles, light)
        with self._context:
            casters = self._casters_of(light)
            self._clear()
            for uniforms in looks:
                self._draw(stages, uniforms, size, [*self._layers, *self._edges.parts], casters)
            found = self._with(self._edges, self._sums()[..., :3] * self._lit(lit), lit)
            for pixels, samples in self._lookup_points.of_shadows(found):
                own = Resources(self._context)
                try:
                    more = PixelLookups.of(own, pixels, samples, self._center)
                    for uniforms in looks:
                        self._draw(stages, uniforms, size, more.parts, casters)
                    found = self._with(more, found, lit)
                finally:
                    own.close()
            return found

    def _of_size(self, light: PointLight | AreaLight) -> Float32[ndarray, "H W 3"]:
        """The exact irradiance times the part of the looks, weighted by what each adds, that reaches a texel."""
        size = min(self._size, LOOK_SIZE)
        strides = max(1, len(self._layers) // LAYERS_PER_LOOK)
        lit = lit_triangles(self._receivers.triangles, light)
        with self._context:
            casters = self._casters_of(light)
            self._clear()
            for number, look in enumerate(looks_over(light, LOOKS)):
                lookups = [*self._layers[number % strides :: strides], *self._edges.parts[number % EDGE_PARTS :: EDGE_PARTS]]
                for uniforms in look.maps(size):
                    self._draw(POINT_STAGES, {**uniforms, "weight": 1.0}, size, lookups, casters)
            found = self._sums()
            exact = np.zeros((found.shape[0] * found.shape[1], 3))
            for layer in self._layers:
                own = (layer.weight * irradiance_from(light, layer.place, layer.normal))[:, None]
                exact += own * light.factors(layer.place - np.array(light.position)) if isinstance(light, PointLight) else own
            plain = visible_part(found) * exact.reshape(*found.shape[:2], 3) * self._lit(lit)
            return self._with(self._edges, plain.astype(np.float32), lit, light)

    @staticmethod
    def _with(
        lookups: PixelLookups,
        irradiance: Float32[ndarray, "H W 3"],
        lit: Bool[ndarray, " T"] | None,
        sized: PointLight | AreaLight | None = None,
    ) -> Float32[ndarray, "H W 3"]:
        """With the pixels of several points. `lit`: triangles that the light shines on; `sized`: the light, if it has a size."""
        result = irradiance.copy()
        if len(lookups.pixels):
            result.reshape(-1, 3)[lookups.pixels] = lookups.mean(sized, lit)
        return result

    def _lit(self, lit: Bool[ndarray, " T"] | None) -> Float32[ndarray, "H W 1"]:
        """The part of each texel on triangles that a light shines on; None: it shines on all."""
        shape = (self._receivers.height, self._receivers.width, 1)
        if lit is None:
            return np.ones(shape, np.float32)
        layers = self._lookup_points.layers
        total = np.sum([points.weight * lit_at(lit, points.triangle) for points in layers], axis=0)
        return (total / np.maximum(np.sum([points.weight for points in layers], axis=0), 1e-30)).reshape(shape).astype(np.float32)

    def _casters_of(self, light: CastingLight) -> ShadowCasters:
        """What shadows a light."""
        if light.blockers not in self._casters:
            chosen = casting(self._receivers.triangles, light.blockers)
            self._casters[light.blockers] = ShadowCasters(self._resources, chosen, self._center)
        return self._casters[light.blockers]

    def _prepare(self) -> None:
        receivers = self._receivers
        limit = Limits.of(self._context).texture_size
        if max(self._size, receivers.width, receivers.height) > limit:
            raise ShaderError(
                f"expected at most {limit} texels per side on this GPU, found {max(self._size, receivers.width, receivers.height)}"
            )
        self._sun_size = self._size if receivers.camera is None else min(FINER_IN_VIEW * self._size, limit)
        position = receivers.images["position"]
        coverage = receivers.images.get("coverage")
        covered = np.ones(position.shape[:2], bool) if coverage is None else coverage > 0
        if not covered.any():
            covered[:] = True
        self._center = position[covered].mean(axis=0, dtype=np.float64)  # single precision is finest about the origin
        points = self._lookup_points = LookupPoints.of(receivers)
        self._sum = self._resources.target((receivers.width, receivers.height), 4, "f4")
        self._layers = [Lookups.of(self._resources, layer, self._center, self._sum) for layer in points.layers]
        self._edges = PixelLookups.of(self._resources, points.edges, points.parts, self._center)
        real = [(layer, layer.weight > 0 if points.parts else covered.ravel()) for layer in self._layers]
        real += [(part, part.weight > 0) for part in self._edges.parts]
        places = np.concatenate([lookups.place[shown] for lookups, shown in real]).astype(np.float64)
        self._cascades = Cascades(places, receivers.camera, receivers.width, self._center)
        self._casters: dict[Objects | None, ShadowCasters] = {}
        self._sized: dict[int, ShadowMaps] = {}
        self._profiles = ProfileTextures(self._resources)
        corners = self._resources.buffer(np.array([[-1, -1], [3, -1], [-1, 3]]))
        self._lookup = {
            stages: self._resources.array(self._resources.program("fullscreen.vert", fragment), corners, "2f", "corner")
            for stages, fragment in ((SUN_STAGES, "direct_on_mesh.frag"), (POINT_STAGES, "direct_point_on_mesh.frag"))
        }

    def _maps(self, size: int) -> ShadowMaps:
        if size not in self._sized:
            self._sized[size] = ShadowMaps.of(self._resources, size)
        return self._sized[size]

    def _clear(self) -> None:
        for _, target in (self._sum, *(part.target for part in self._edges.parts)):
            target.use()
            target.clear()

    def _sums(self) -> Float32[ndarray, "H W 4"]:
        data = self._sum[1].read(components=4, dtype="f4")
        return np.frombuffer(data, np.float32).reshape(self._receivers.height, self._receivers.width, 4)

    def _draw(
        self, stages: tuple[str, str, str], uniforms: dict[str, Any], size: int, lookups: Sequence[Lookups], casters: ShadowCasters
    ) -> None:
        """Draw one map of a light, and add what reaches the points of some `lookups` by it."""
        gl: Any = self._context
        maps = self._maps(size)
        casters.draw(maps, stages, uniforms)
        gl.enable_only(gl.BLEND)
        gl.blend_equation, gl.blend_func = gl.FUNC_ADD, (gl.ONE, gl.ONE)
        names = ("points", "normals", "faces")
        units = {name: unit for unit, name in enumerate((*names, *maps.textures()))} | {"profile": PROFILE_UNIT}
        for name, texture in maps.textures().items():
            texture.use(units[name])
        for own in lookups:
            own.target[1].use()
            for name, texture in zip(names, own.textures, strict=True):
                texture.use(units[name])
            render(self._lookup[stages], {**uniforms, **units, "walls": casters.has_walls}, vertices=3)


def _suns(direction: Float64[ndarray, " 3"], angle: float) -> Iterator[Float64[ndarray, " 3"]]:
    """Unit directions evenly spread over a sun's disc."""
    if angle == 0:
        yield direction
        return
    across = np.cross(direction, [1.0, 0.0, 0.0] if abs(direction[0]) < 0.9 else [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    up = np.cross(direction, across)
    for x, y in disc_points(spread_points(SUN_SAMPLES)[:, 2:]) * np.tan(angle / 2):
        vector = direction + x * across + y * up
        yield vector / np.linalg.norm(vector)
