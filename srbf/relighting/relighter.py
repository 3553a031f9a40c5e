"""Relighting an asset on the GPU: the same as `srbf.methods.relight`, by the shader pack."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from types import TracebackType
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32
from srbf.asset import Asset
from srbf.errors import InputError
from srbf.gl.context import Limits, create_context
from srbf.gl.depth_buffer import DepthView
from srbf.gl.environment import EnvironmentWeights
from srbf.gl.programs import Programs
from srbf.gl.textures import AssetTextures
from srbf.lights import EnvironmentLight, Light
from srbf.methods import in_asset_frame, method_of

if TYPE_CHECKING:
    import moderngl

Target = Literal["float", "half"]
Functions = Literal["table", "formula"]
Place = Literal["host", "gpu"]

UNITS = 5  # maps, or images of four planes, a pass of the multi-pass variant
MAX_UNITS = 8  # as many terms as stages/accumulate.frag spells out


def relight(
    asset: Asset, lights: Sequence[Light], *, target: Target = "float", multipass: bool = False, units: int = UNITS
) -> Float32[ndarray, "H W 3"]:
    """max(0, sum over lights) + ambient, as `srbf.methods.relight` but by shaders; for many frames keep a `Relighter`.

    Within 1e-5 sum |c_i R_i|, or sum |a_j w_j|, of numpy on `float` targets, two half steps on `half` ones.

    Parameters
    ----------
    asset, target
        Of the `Relighter`.
    lights, multipass, units
        Of `Relighter.relight`.

    Returns
    -------
    ndarray
        (H, W, 3) float32, linear, row 0 at the top.

    Raises
    ------
    ShaderError, InputError
        As of `Relighter` and `Relighter.relight`.

    Examples
    --------
    >>> from srbf.relighting.relighter import relight
    >>> relight(asset, [DirectionalLight((0.0, 0.0, 1.0))], target="half").shape
    (6, 8, 3)
    """
    with Relighter(asset, target=target) as relighter:
        return relighter.relight(lights, multipass=multipass, units=units)


class Relighter:
    """An asset's textures and programs on the GPU, ready to relight frame after frame; a context manager.

    Lights add up in RGBA32F. Frames are within 1e-5 sum |c_i R_i|, or sum |a_j w_j|, of numpy on `float` targets, two half steps on `half`.

    Parameters
    ----------
    asset
        Of any method that shaders know.
    target
        What the frame is kept in: `float` RGBA32F, `half` RGBA16F.
    context
        Of moderngl; None: a headless one of its own.
    functions
        R of point lights from the asset's `table`, or by `formula`.
    environments
        Where the weights of environment lights are integrated: `host`, or `gpu`, where a map may change from frame to frame.
    view
        Receivers are where its depth buffer says, not where the position map does.

    Raises
    ------
    ShaderError
        Without OpenGL 3.3, or where the asset exceeds the GPU.
    InputError
        On a method that no shader knows, and on other words than these.

    Examples
    --------
    >>> with Relighter(asset) as relighter:
    ...     frames = [relighter.relight([DirectionalLight((x, 0.0, 1.0))]) for x in (0.0, 0.5)]
    >>> bool(np.allclose(frames[1], relight(asset, [DirectionalLight((0.5, 0.0, 1.0))]), atol=1e-4))
    True
    """

    def __init__(
        self,
        asset: Asset,
        *,
        target: Target = "float",
        context: moderngl.Context | None = None,
        functions: Functions = "table",
        environments: Place = "host",
        view: DepthView | None = None,
    ) -> None:
        passes = method_of(asset).gl_passes()
        if target not in get_args(Target):
            raise InputError(f"expected a target of float, half, found {target!r}")
        if functions not in get_args(Functions):
            raise InputError(f"expected functions by table, formula, found {functions!r}")
        if environments not in get_args(Place):
            raise InputError(f"expected environments on host, gpu, found {environments!r}")
        self._asset, self._located = asset, view is not None or "position" in asset.images
        self._context = create_context() if context is None else context
        self._resources = ExitStack()
        self._owned, self._open = context is None, True
        self._type = "f4" if target == "float" else "f2"
        try:
            with self._context:
                self._limits = Limits.of(self._context)
                self._textures = AssetTextures(self._context, asset, self._limits, self._resources, view)
                self._sum, self._sum_buffer = self._target("f4")  # half would lose up to a step with every pass
                _, self._relit_buffer = self._target(self._type)
                self._programs = Programs(self._context, self._resources)
                self._environment = None
                if environments == "gpu":
                    self._environment = EnvironmentWeights(self._context, asset, self._programs, self._textures, self._resources)
        except BaseException:
            self.close()
            raise
        self._passes = passes(asset, self._programs, self._textures, self._limits, functions == "formula")

    def __enter__(self) -> Relighter:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Release every GL object, and the context where it is the relighter's own. A second call has no effect.

        Examples
        --------
        >>> relighter = Relighter(asset)
        >>> relighter.close()
        """
        if self._open:
            self._open = False
            with self._context:
                self._resources.close()
            if self._owned:
                self._context.release()

    def relight(
        self, lights: Sequence[Light], *, multipass: bool = False, units: int = UNITS, direct: Float32[ndarray, "H W 3"] | None = None
    ) -> Float32[ndarray, "H W 3"]:
        """One frame, read back: max(0, sum over lights + direct) + ambient.

        Parameters
        ----------
        lights
            Of the world, of any kind and number.
        multipass
            The article's way for GPUs of few texture units: `units` maps, or images of four planes, per pass, added up by blending.
        units
            1 to 8, and at most what the GPU has.
        direct
            (H, W, 3) float32: the direct light that an indirect asset leaves out, added before the clamp.

        Returns
        -------
        ndarray
            (H, W, 3) float32, linear, row 0 at the top.

        Raises
        ------
        InputError
            On point or spot lights without a position map or, for harmonics, at all, and on units out of range.

        Examples
        --------
        >>> with Relighter(asset) as relighter:
        ...     whole, by_passes = (relighter.relight([DirectionalLight((0.0, 0.0, 1.0))], multipass=way) for way in (False, True))
        >>> bool(np.allclose(whole, by_passes, atol=1e-4))
        True
        """
        self.draw(lights, multipass=multipass, units=units, direct=direct)
        return self.read()

    def draw(
        self, lights: Sequence[Light], *, multipass: bool = False, units: int = UNITS, direct: Float32[ndarray, "H W 3"] | None = None
    ) -> None:
        """Draw one frame and leave it on the GPU; parameters and errors as of `relight`.

        Examples
        --------
        >>> with Relighter(asset) as relighter:
        ...     relighter.draw([DirectionalLight((0.0, 0.0, 1.0))])
        ...     relighter.read().shape
        (6, 8, 3)
        """
        most = min(MAX_UNITS, self._limits.texture_units)
        if not 1 <= units <= most:
            raise InputError(f"expected 1 to {most} texture units a pass, found {units}")
        inside = in_asset_frame(self._asset, lights)
        point_lights = method_of(self._asset).local_lights(inside)
        if point_lights and not self._located:
            raise InputError("point and spot lights need a position map, and this asset has none; relight it by directional lights")
        if point_lights:
            self._passes.check_point_lights()
        with self._context:
            draw_all = self._passes.prepare(inside)
        left = inside if draw_all is None else []
        environments_lit = [light for light in left if isinstance(light, EnvironmentLight)] if self._environment is not None else []
        weights = method_of(self._asset).projected_weights(self._asset, [light for light in left if light not in environments_lit])
        with self._context:
            by_shader = None if self._environment is None or not environments_lit else self._environment.weights(weights, environments_lit)
            self._sum_buffer.use()
            self._sum_buffer.clear()
            self._blend(True)
            at_once = units if multipass else None
            if draw_all is not None:
                draw_all()
            if by_shader is not None:
                self._passes.weighted(by_shader)
                weights = 0 * weights
            if weights.any() and (multipass or not point_lights):
                self._passes.distant(weights, at_once)
                weights = 0 * weights
            if point_lights:
                self._passes.point_lights(point_lights, weights, at_once)
            if direct is not None:
                with self._textures.passing(direct) as texture:
                    texture.use(0)
                    self._programs.run("add.frag", {}, {"light": 0})
            self._finish()

    def read(self) -> Float32[ndarray, "H W 3"]:
        """The frame last drawn.

        Returns
        -------
        ndarray
            (H, W, 3) float32, linear, row 0 at the top.

        Examples
        --------
        >>> with Relighter(asset) as relighter:
        ...     relighter.draw([])
        ...     float(relighter.read().max())  # no light, no ambient
        0.0
        """
        with self._context:
            data = self._relit_buffer.read(components=4, dtype=self._type)
        pixels = np.frombuffer(data, np.float32 if self._type == "f4" else np.float16)
        return np.ascontiguousarray(pixels.reshape(self._asset.height, self._asset.width, 4)[..., :3], np.float32)

    def _finish(self) -> None:
        self._relit_buffer.use()
        self._blend(False)
        self._sum.use(0)
        self._textures.ambient().use(1)
        self._programs.run("finish.frag", {}, {"sum": 0, "ambient": 1})

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
