"""Relighting an asset on the GPU: the same answer as `srbf.methods.relight`, by the shader pack."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from types import TracebackType
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.asset import Asset
from srbf.errors import InputError
from srbf.gl.context import Limits, compile_program, create_context
from srbf.gl.includes import resolve
from srbf.gl.textures import AssetTextures
from srbf.gl.uniforms import lamp_uniforms, padded
from srbf.lights import Light, PointLight, moved
from srbf.methods import folded_weights

if TYPE_CHECKING:
    import moderngl

Target = Literal["float", "half"]

UNITS = 5  # textures a pass of the multi-pass variant
MAX_UNITS = 8  # as many terms as stages/accumulate.frag spells out
VECTORS_A_MAP = 3  # weight or center, scale, bias
VECTORS_KEPT_FREE = 32  # for the lamp and what drivers take for themselves
METHOD = "relighting-map"


def relight(
    asset: Asset, lights: Sequence[Light], *, target: Target = "float", multipass: bool = False, units: int = UNITS
) -> Float32[ndarray, "H W 3"]:
    """max(0, sum over lights) + ambient, as `srbf.methods.relight` but by shaders; for many frames keep a `Relighter`.

    Within 1e-5 sum |c_i R_i| of numpy on `float` targets, two half steps on `half` ones. Raises what `Relighter` raises.
    """
    with Relighter(asset, target=target) as relighter:
        return relighter.relight(lights, multipass=multipass, units=units)


class Relighter:
    """An asset's textures and programs on the GPU, ready to relight frame after frame; a context manager.

    Lights add up in RGBA32F; target says what the frame is kept in: `float` RGBA32F, `half` RGBA16F. Without a `context` (moderngl)
    it makes a headless one of its own.
    Raises ShaderError without OpenGL 3.3 or where the asset exceeds the GPU, InputError on an asset of another method.
    """

    def __init__(self, asset: Asset, *, target: Target = "float", context: moderngl.Context | None = None) -> None:
        if asset.method != METHOD:
            raise InputError(f"expected an asset of the method {METHOD}, found {asset.method}: no shader relights it yet")
        if target not in get_args(Target):
            raise InputError(f"expected a target of float, half, found {target!r}")
        self._asset = asset
        self._context = create_context() if context is None else context
        self._resources = ExitStack()
        self._owned, self._open = context is None, True
        self._programs: dict[tuple[str, int], moderngl.VertexArray] = {}
        self._type = "f4" if target == "float" else "f2"
        try:
            with self._context:
                self._limits = Limits.of(self._context)
                self._textures = AssetTextures(self._context, asset, self._limits, self._resources)
                self._sum, self._sum_buffer = self._target("f4")  # half would lose up to a step with every pass
                _, self._relit_buffer = self._target(self._type)
                corners = np.array([[-1, -1], [3, -1], [-1, 3]], np.float32)
                self._corners = self._kept(self._context.buffer(corners))
        except BaseException:
            self.close()
            raise
        basis = asset.basis
        self._centers = padded(basis.centers)
        self._scale, self._bias = padded(asset.scale), padded(asset.bias)

    def __enter__(self) -> Relighter:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Release every GL object, and the context where it is our own."""
        if self._open:
            self._open = False
            with self._context:
                self._resources.close()
            if self._owned:
                self._context.release()

    def relight(
        self, lights: Sequence[Light], *, multipass: bool = False, units: int = UNITS, direct: Float32[ndarray, "H W 3"] | None = None
    ) -> Float32[ndarray, "H W 3"]:
        """One frame, read back: row 0 at the top.

        `direct` light, of an indirect asset, is added before the clamp.
        `multipass` is the article's way for GPUs of few texture units: `units` maps a pass, added up by blending. Raises
        InputError on point or spot lights without a position map, or on units that are not 1 to 8.
        """
        self.draw(lights, multipass=multipass, units=units, direct=direct)
        return self.read()

    def draw(
        self, lights: Sequence[Light], *, multipass: bool = False, units: int = UNITS, direct: Float32[ndarray, "H W 3"] | None = None
    ) -> None:
        """Draw one frame and leave it on the GPU."""
        most = min(MAX_UNITS, self._limits.texture_units)
        if not 1 <= units <= most:
            raise InputError(f"expected 1 to {most} texture units a pass, found {units}")
        inside = [moved(light, self._asset.asset_from_world) for light in lights]
        lamps = [light for light in inside if isinstance(light, PointLight)]
        if lamps and "position" not in self._asset.images:
            raise InputError("point and spot lights need a position map, and this asset has none; relight it by directional lights")
        weights = folded_weights(self._asset, lights)
        with self._context:
            self._sum_buffer.use()
            self._sum_buffer.clear()
            self._blend(True)
            if weights.any():
                if multipass:
                    self._accumulate(weights, units)
                else:
                    self._directional(weights)
            for lamp in lamps:
                self._lamp(lamp, units if multipass else self._maps_a_pass())
            if direct is not None:
                with self._textures.passing(direct) as texture:
                    texture.use(0)
                    self._run("add.frag", "SRBF_K", 1, {"light": 0})
            self._finish()

    def read(self) -> Float32[ndarray, "H W 3"]:
        """The frame last drawn."""
        with self._context:
            data = self._relit_buffer.read(components=4, dtype=self._type)
        pixels = np.frombuffer(data, np.float32 if self._type == "f4" else np.float16)
        return np.ascontiguousarray(pixels.reshape(self._asset.height, self._asset.width, 4)[..., :3], np.float32)

    def _directional(self, weights: Float64[ndarray, "K 3"]) -> None:
        self._textures.maps().use(0)
        for first, count in _ranges(self._asset.k, self._maps_a_pass()):
            values = {"firstMap": first, "maps": 0, "weights": padded(weights[first : first + count])}
            self._run("directional.frag", "SRBF_K", count, values | self._decoding(first, count))

    def _accumulate(self, weights: Float64[ndarray, "K 3"], units: int) -> None:
        for first, count in _ranges(self._asset.k, units):
            for unit in range(count):
                self._textures.map(first + unit).use(unit)
            values = {"maps": np.arange(count, dtype=np.int32), "weights": padded(weights[first : first + count])}
            self._run("accumulate.frag", "SRBF_UNITS", count, values | self._decoding(first, count))

    def _lamp(self, light: PointLight, maps_a_pass: int) -> None:
        self._textures.maps().use(0)
        self._textures.positions().use(1)
        self._textures.table().use(2)
        values: dict[str, Any] = {"maps": 0, "positions": 1, "rTable": 2}
        values |= {f"lamp.{name}": value for name, value in lamp_uniforms(light).items()}
        for first, count in _ranges(self._asset.k, maps_a_pass):
            values |= {"firstMap": first, "centers": self._centers[first : first + count]}
            self._run("point.frag", "SRBF_K", count, values | self._decoding(first, count))

    def _finish(self) -> None:
        self._relit_buffer.use()
        self._blend(False)
        self._sum.use(0)
        self._textures.ambient().use(1)
        self._run("finish.frag", "SRBF_K", 1, {"sum": 0, "ambient": 1})

    def _decoding(self, first: int, count: int) -> dict[str, Any]:
        return {"scale": self._scale[first : first + count], "bias": self._bias[first : first + count]}

    def _maps_a_pass(self) -> int:
        """As many maps as the fragment shader's uniforms hold; more take further additive passes."""
        return max(1, (self._limits.fragment_vectors - VECTORS_KEPT_FREE) // VECTORS_A_MAP)

    def _run(self, stage: str, define: str, value: int, uniforms: dict[str, Any]) -> None:
        key = (stage, value)
        if key not in self._programs:
            fragment = resolve(f"stages/{stage}", defines={define: value})
            program = self._kept(compile_program(self._context, resolve("stages/fullscreen.vert"), fragment))
            self._programs[key] = self._kept(self._context.vertex_array(program, [(self._corners, "2f", "corner")]))
        vertex_array = self._programs[key]
        program = vertex_array.program
        for name, content in uniforms.items():
            if name not in program:
                continue  # the driver drops a uniform that cannot change the result
            if isinstance(content, np.ndarray):
                program[name].write(np.ascontiguousarray(content))  # type: ignore[union-attr]
            else:
                program[name].value = content  # type: ignore[union-attr]
        vertex_array.render(vertices=3)

    def _blend(self, on: bool) -> None:
        if on:
            self._context.enable_only(self._context.BLEND)
            self._context.blend_func = self._context.ONE, self._context.ONE
        else:
            self._context.enable_only(self._context.NOTHING)

    def _target(self, dtype: str) -> tuple[moderngl.Texture, moderngl.Framebuffer]:
        size = (self._asset.width, self._asset.height)
        texture = self._kept(self._context.texture(size, 4, dtype=dtype))
        texture.filter = (self._context.NEAREST, self._context.NEAREST)
        return texture, self._kept(self._context.framebuffer([texture]))

    def _kept(self, resource: Any) -> Any:
        """`resource`, to be released on close."""
        self._resources.callback(resource.release)
        return resource


def _ranges(total: int, size: int) -> Iterator[tuple[int, int]]:
    """(first, count) of runs of at most `size` that cover `total`."""
    for first in range(0, total, size):
        yield first, min(size, total - first)
