"""Direct light by a shadow map on the GPU, as in an engine, for comparison with rays."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.errors import InputError, ShaderError
from srbf.gl.context import Limits, compile_program, create_context
from srbf.gl.includes import resolve
from srbf.gl.uniforms import padded
from srbf.lights import DirectionalLight, EnvironmentLight, Light
from srbf.visibility.embree import EmbreeTriangles, has_embree
from srbf.visibility.lightmap_points import LightmapPoints
from srbf.visibility.receivers import Receivers, disc_points, spread_points
from srbf.visibility.shadow import SunFrame

if TYPE_CHECKING:
    import moderngl

SIZE = 2048  # texels per side
SUN_SAMPLES = 16  # shadow maps of a sun with a disc
FINE, COARSE = 4, 2  # lookups per side of a texel's footprint
FINE_TEXELS = 1 << 16  # largest lightmap with FINE lookups
NO_OCCLUDER = -1e30  # height


class ShadowMapper:
    """Direct light of directional lights on receivers by one orthographic map each; a context manager.

    Percentage-closer filtering over 3 x 3 texels; translucent walls multiply a second map by their transmittance. InputError for point and
    spot lights, ShaderError without OpenGL 3.3.
    """

    def __init__(self, receivers: Receivers, size: int = SIZE, context: moderngl.Context | None = None) -> None:
        self._receivers = receivers
        self._size = size
        self._context = create_context() if context is None else context
        self._owned = context is None
        self._resources = ExitStack()
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
        """The direct light of `lights` in the receivers' quantity; environments add nothing."""
        total = np.zeros((self._receivers.height, self._receivers.width, 3), np.float32)
        for light in lights:
            if isinstance(light, EnvironmentLight):
                continue
            if not isinstance(light, DirectionalLight):
                raise InputError("expected directional lights for `direct='shadow-map'`, found a point or spot light; use `direct='ray'`")
            total += self._irradiance(np.array(light.direction)) * np.array(light.color, np.float32)
        return total * self._receivers.reflectance()

    def directional(self, directions: Float64[ndarray, "b 3"]) -> Float32[ndarray, "b H W 3"]:
        """`response` to a white light from each of many directions."""
        return np.stack([self.response([DirectionalLight((float(x), float(y), float(z)))]) for x, y, z in directions])

    def _irradiance(self, direction: Float64[ndarray, " 3"]) -> Float32[ndarray, "H W 3"]:
        suns = list(_suns(direction, self._receivers.sun_angle))
        with self._context:
            self._sum.use()
            self._sum.clear()
            for sun in suns:
                frame = SunFrame.around(self._points, sun)
                self._draw_map(frame)
                self._look_up(frame, 1 / len(suns))
            data = self._sum.read(components=4, dtype="f4")
        image = np.frombuffer(data, np.float32).reshape(self._receivers.height, self._receivers.width, 4)
        return np.ascontiguousarray(image[..., :3])

    def _prepare(self) -> None:
        gl: Any = self._context
        receivers = self._receivers
        limit = Limits.of(gl).texture_size
        if max(self._size, receivers.width, receivers.height) > limit:
            raise ShaderError(
                f"expected at most {limit} texels per side on this GPU, found {max(self._size, receivers.width, receivers.height)}"
            )
        position = receivers.images["position"]
        coverage = receivers.images.get("coverage")
        covered = np.ones(position.shape[:2], bool) if coverage is None else coverage > 0
        if not covered.any():
            covered[:] = True
        center = position[covered].mean(axis=0, dtype=np.float64)  # single precision is finest about the origin
        by_rays = has_embree() and receivers.camera is None and receivers.triangles.lightmap is None
        places = LightmapPoints(receivers, EmbreeTriangles(receivers.triangles.corners).first_hit if by_rays else None)
        shape, every = position.shape[:2], np.arange(covered.size)
        side = FINE if covered.size <= FINE_TEXELS else COARSE
        grid = (np.stack(np.meshgrid(np.arange(side), np.arange(side)), axis=-1).reshape(-1, 2) + 0.5) / side
        found = [places.at(every, np.broadcast_to(place, (covered.size, 2))) for place in grid]
        total = np.sum([points.weight for points in found], axis=0)
        self._places = []
        for points in found:
            point = np.concatenate([points.point - center, (points.weight / total)[:, None]], axis=1)
            height = np.einsum("nc,nc->n", points.lift, points.normal)
            normals = np.concatenate([points.normal, height[:, None]], axis=1)
            self._places.append(tuple(self._texture(image.reshape(*shape, -1)) for image in (point, normals, points.face)))
        self._points = np.concatenate([points.point[covered.ravel()] - center for points in found]).astype(np.float64)
        triangles = receivers.triangles
        vertices = np.concatenate([triangles.corners - center, triangles.normals], axis=2).astype(np.float32)  # (T, 3, 6)
        square = (self._size, self._size)
        self._maps = {name: self._target(square, 1, "f4") for name in ("heights", "wallHeights")}
        self._maps["transmittance"] = self._target(square, 4, "f2")
        self._maps["transmittance"][0].filter = (gl.LINEAR, gl.LINEAR)
        self._sum_texture, self._sum = self._target((receivers.width, receivers.height), 4, "f4")
        height = self._program("shadow.vert", "shadow_height.frag")
        transmittance = self._program("shadow.vert", "shadow_transmittance.frag")
        self._occluders = self._mesh(height, vertices[triangles.occluders])
        self._walls = []
        for material in np.unique(triangles.material[triangles.filters]):
            chosen = vertices[triangles.filters & (triangles.material == material)]
            self._walls.append((padded(triangles.transmittance[material]), self._mesh(height, chosen), self._mesh(transmittance, chosen)))
        lookup = self._program("fullscreen.vert", "direct_on_mesh.frag")
        corners = self._kept(gl.buffer(np.array([[-1, -1], [3, -1], [-1, 3]], np.float32)))
        self._lookup = self._kept(gl.vertex_array(lookup, [(corners, "2f", "corner")]))

    def _draw_map(self, frame: SunFrame) -> None:
        gl: Any = self._context
        gl.enable_only(gl.BLEND)
        for name, meshes in (("heights", [self._occluders]), ("wallHeights", [mesh for _, mesh, _ in self._walls])):
            target = self._maps[name][1]
            target.use()
            target.clear(NO_OCCLUDER, NO_OCCLUDER, NO_OCCLUDER, NO_OCCLUDER)
            gl.blend_equation = gl.MAX
            for mesh in meshes:
                self._render(mesh, _uniforms(frame))
        target = self._maps["transmittance"][1]
        target.use()
        target.clear(1, 1, 1, 1)
        gl.blend_equation = gl.FUNC_ADD
        gl.blend_func = gl.DST_COLOR, gl.ZERO
        for curve, _, mesh in self._walls:
            self._render(mesh, {**_uniforms(frame), "curve": curve})

    def _look_up(self, frame: SunFrame, weight: float) -> None:
        gl: Any = self._context
        self._sum.use()
        gl.enable_only(gl.BLEND)
        gl.blend_equation, gl.blend_func = gl.FUNC_ADD, (gl.ONE, gl.ONE)
        for points, normals, faces in self._places:
            textures = {
                "points": points,
                "normals": normals,
                "faces": faces,
                **{name: texture for name, (texture, _) in self._maps.items()},
            }
            for unit, texture in enumerate(textures.values()):
                texture.use(unit)
            units = {name: unit for unit, name in enumerate(textures)}
            self._render(self._lookup, {**_uniforms(frame), **units, "weight": weight}, vertices=3)

    def _render(self, mesh: moderngl.VertexArray | None, uniforms: dict[str, Any], vertices: int = -1) -> None:
        if mesh is None:
            return
        program = mesh.program
        for name, value in uniforms.items():
            if name not in program:
                continue  # of another stage
            if isinstance(value, np.ndarray):
                program[name].write(np.ascontiguousarray(value))  # type: ignore[union-attr]
            else:
                program[name].value = value  # type: ignore[union-attr]
        mesh.render(vertices=vertices)

    def _mesh(self, program: moderngl.Program, vertices: Float32[ndarray, "T 3 6"]) -> moderngl.VertexArray | None:
        if not len(vertices):
            return None
        buffer = self._kept(self._context.buffer(np.ascontiguousarray(vertices)))
        layout = ("3f 3f", "corner", "cornerNormal") if "cornerNormal" in program else ("3f 12x", "corner")
        return self._kept(self._context.vertex_array(program, [(buffer, *layout)]))

    def _program(self, vertex: str, fragment: str) -> moderngl.Program:
        return self._kept(compile_program(self._context, resolve(f"stages/{vertex}"), resolve(f"stages/{fragment}")))

    def _texture(self, pixels: ndarray) -> moderngl.Texture:
        height, width, channels = pixels.shape
        texture = self._kept(
            self._context.texture((width, height), channels, np.ascontiguousarray(pixels, np.float32), alignment=1, dtype="f4")
        )
        texture.filter = (self._context.NEAREST, self._context.NEAREST)
        return texture

    def _target(self, size: tuple[int, int], channels: int, dtype: str) -> tuple[moderngl.Texture, moderngl.Framebuffer]:
        texture = self._kept(self._context.texture(size, channels, dtype=dtype))
        texture.filter = (self._context.NEAREST, self._context.NEAREST)
        texture.repeat_x = texture.repeat_y = False
        return texture, self._kept(self._context.framebuffer([texture]))

    def _kept(self, resource: Any) -> Any:
        """`resource`, registered for release on close."""
        self._resources.callback(resource.release)
        return resource


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
