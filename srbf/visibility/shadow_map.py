"""Direct light by shadow maps on the GPU, as in an engine, for comparison with rays."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.errors import ShaderError
from srbf.gl.context import Limits, create_context
from srbf.lights import AreaLight, DirectionalLight, Light, PointLight, SphereLight, triple
from srbf.unshadowed import irradiance_from
from srbf.visibility.embree import EmbreeTriangles, has_embree
from srbf.visibility.gl_resources import Resources, render
from srbf.visibility.lightmap_points import LightmapPoints
from srbf.visibility.looks import look_of, looks_over
from srbf.visibility.receivers import Receivers, disc_points, spread_points
from srbf.visibility.shadow import SunFrame
from srbf.visibility.shadow_casters import POINT_STAGES, SUN_STAGES, ShadowCasters, ShadowMaps

if TYPE_CHECKING:
    import moderngl

SIZE = 2048  # texels per side of a sun's or a spot's map, twice a cube's face
SUN_SAMPLES = 16  # shadow maps of a sun with a disc
LOOKS = 32  # places of a light with a size
LOOK_SIZE = 512  # texels per side of their cubes' faces
LAYERS_PER_LOOK = 4  # of a texel's lookups
FINE, COARSE = 4, 2  # lookups per side of a texel's footprint
FINE_TEXELS = 1 << 16  # largest lightmap with FINE lookups


class ShadowMapper:
    """Direct light on receivers by shadow maps; a context manager.

    A directional light has one orthographic map, a spot one perspective map, a point light (and a spot wider than 75 degrees) a cube of
    six, a sphere or an area many cubes. Percentage-closer filtering over 3 x 3 texels; translucent walls multiply a second map by their
    transmittance. ShaderError without OpenGL 3.3.
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
                irradiance = self._of_sun(np.array(light.direction))
            elif isinstance(light, (SphereLight, AreaLight)):
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

    def _of_sun(self, direction: Float64[ndarray, " 3"]) -> Float32[ndarray, "H W 3"]:
        suns = list(_suns(direction, self._receivers.sun_angle))
        with self._context:
            self._clear()
            for sun in suns:
                uniforms = _uniforms(SunFrame.around(self._points, sun))
                self._casters.draw(self._maps(self._size), SUN_STAGES, uniforms)
                self._look_up(self._sun_lookup, self._maps(self._size), {**uniforms, "weight": 1 / len(suns)}, range(len(self._places)))
            return self._read()[..., :3]

    def _of_point(self, light: PointLight) -> Float32[ndarray, "H W 3"]:
        look = look_of(light)
        size = max(1, self._size // 2) if look.faces else self._size
        with self._context:
            self._clear()
            for uniforms in look.maps(size):
                self._casters.draw(self._maps(size), POINT_STAGES, uniforms)
                self._look_up(self._point_lookup, self._maps(size), {**uniforms, "weight": 1.0}, range(len(self._places)))
            return self._read()[..., :3]

    def _of_size(self, light: SphereLight | AreaLight) -> Float32[ndarray, "H W 3"]:
        """The exact irradiance times the part of the looks, weighted by what each adds, that reaches a texel."""
        size = min(self._size, LOOK_SIZE)
        strides = max(1, len(self._places) // LAYERS_PER_LOOK)
        with self._context:
            self._clear()
            for number, look in enumerate(looks_over(light, LOOKS)):
                layers = range(number % strides, len(self._places), strides)
                for uniforms in look.maps(size):
                    self._casters.draw(self._maps(size), POINT_STAGES, uniforms)
                    self._look_up(self._point_lookup, self._maps(size), {**uniforms, "weight": 1.0}, layers)
            found = self._read()
        exact = np.zeros(found.shape[0] * found.shape[1])
        for point, normal, weight in self._layers:
            exact += weight * irradiance_from(light, point, normal)
        whole = found[..., 3:]
        visible = np.where(whole > 0, found[..., :3] / np.where(whole > 0, whole, 1), 1)
        return (visible * exact.reshape(*found.shape[:2], 1)).astype(np.float32)

    def _prepare(self) -> None:
        receivers = self._receivers
        limit = Limits.of(self._context).texture_size
        if max(self._size, receivers.width, receivers.height) > limit:
            raise ShaderError(
                f"expected at most {limit} texels per side on this GPU, found {max(self._size, receivers.width, receivers.height)}"
            )
        position = receivers.images["position"]
        coverage = receivers.images.get("coverage")
        covered = np.ones(position.shape[:2], bool) if coverage is None else coverage > 0
        if not covered.any():
            covered[:] = True
        self._center = position[covered].mean(axis=0, dtype=np.float64)  # single precision is finest about the origin
        by_rays = has_embree() and receivers.camera is None and receivers.triangles.lightmap is None
        places = LightmapPoints(receivers, EmbreeTriangles(receivers.triangles.corners).first_hit if by_rays else None)
        shape, every = position.shape[:2], np.arange(covered.size)
        side = FINE if covered.size <= FINE_TEXELS else COARSE
        grid = (np.stack(np.meshgrid(np.arange(side), np.arange(side)), axis=-1).reshape(-1, 2) + 0.5) / side
        found = [places.at(every, np.broadcast_to(place, (covered.size, 2))) for place in grid]
        total = np.sum([points.weight for points in found], axis=0)
        self._places, self._layers = [], []
        for points in found:
            place, weight = points.point - self._center, points.weight / total
            height = np.einsum("nc,nc->n", points.lift, points.normal)
            images = (np.column_stack([place, weight]), np.column_stack([points.normal, height]), points.face)
            self._places.append([self._resources.texture(image.astype(np.float32).reshape(*shape, -1)) for image in images])
            self._layers.append((place, points.normal, weight))
        self._points = np.concatenate([place[covered.ravel()] for place, _, _ in self._layers]).astype(np.float64)
        self._casters = ShadowCasters(self._resources, receivers.triangles, self._center)
        self._sum_texture, self._sum = self._resources.target((receivers.width, receivers.height), 4, "f4")
        self._sized: dict[int, ShadowMaps] = {}
        corners = self._resources.buffer(np.array([[-1, -1], [3, -1], [-1, 3]]))
        self._sun_lookup, self._point_lookup = (
            self._resources.array(self._resources.program("fullscreen.vert", fragment), corners, "2f", "corner")
            for fragment in ("direct_on_mesh.frag", "direct_point_on_mesh.frag")
        )

    def _maps(self, size: int) -> ShadowMaps:
        if size not in self._sized:
            self._sized[size] = ShadowMaps.of(self._resources, size)
        return self._sized[size]

    def _clear(self) -> None:
        self._sum.use()
        self._sum.clear()

    def _read(self) -> Float32[ndarray, "H W 4"]:
        data = self._sum.read(components=4, dtype="f4")
        return np.frombuffer(data, np.float32).reshape(self._receivers.height, self._receivers.width, 4)

    def _look_up(self, lookup: moderngl.VertexArray, maps: ShadowMaps, uniforms: dict[str, Any], layers: range) -> None:
        """Add what reaches the points of some `layers` of the texels."""
        gl: Any = self._context
        self._sum.use()
        gl.enable_only(gl.BLEND)
        gl.blend_equation, gl.blend_func = gl.FUNC_ADD, (gl.ONE, gl.ONE)
        names = ("points", "normals", "faces")
        units = {name: unit for unit, name in enumerate((*names, *maps.textures()))}
        for name, texture in maps.textures().items():
            texture.use(units[name])
        for layer in layers:
            for name, texture in zip(names, self._places[layer], strict=True):
                texture.use(units[name])
            render(lookup, {**uniforms, **units, "walls": self._casters.has_walls}, vertices=3)


def _uniforms(frame: SunFrame) -> dict[str, Any]:
    return {"across": frame.across, "up": frame.up, "toLight": frame.to_light, "low": frame.low, "extent": frame.extent}


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
