"""Passes that relight a deep framebuffer: light on its surfels, bounces, links to view clusters, pixels; unmoved lights are kept."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy import ndarray

from srbf.arrays import Float64
from srbf.asset import Asset
from srbf.errors import ImageError, InputError, MissingLibraryError
from srbf.gl.context import Limits
from srbf.gl.deep_framebuffer import LinkPasses, NearTextures, folded
from srbf.gl.passes import Passes
from srbf.gl.programs import Programs
from srbf.gl.textures import AssetTextures
from srbf.lights import WHITE, EnvironmentLight, Light, PointLight, refuse_named
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.linked_light import LinkedLight, surfel_objects
from srbf.visibility.near_cells import NearCells
from srbf.visibility.near_passes import NearPasses
from srbf.visibility.near_sources import NearPool, NearReceivers
from srbf.visibility.packed_links import unpacked
from srbf.visibility.received import occluders_of
from srbf.visibility.surface_cells import Cells
from srbf.visibility.surfel_light import SurfelLight

if TYPE_CHECKING:
    import moderngl

NEGLIGIBLE, MOST_TERMS = 1e-4, 64  # of all light, that a bounce adds and is the last; of a scene whose bounces nobody has limited


class PoolPasses(Passes):
    """Passes over a deep framebuffer. A light that has neither moved nor changed but in color costs one pass over the clusters.

    `shadow_rays`: rays say what surfels see of lights, and receivers of bright surfels, as in numpy, where embreex is installed. Shadow
    cubes do otherwise, whose edges are those of their texels. `computed` counts the lights whose bounces were computed.
    """

    shadow_rays: ClassVar[bool] = True

    def __init__(self, asset: Asset, programs: Programs, textures: AssetTextures, limits: Limits, formula: bool = False) -> None:
        self._asset, self._programs, self._textures, self._limits = asset, programs, textures, limits
        self._known: dict[Any, tuple[Light, moderngl.Texture, moderngl.Framebuffer]] = {}
        self._free: list[tuple[moderngl.Texture, moderngl.Framebuffer]] = []
        self.computed = 0

    def prepare(self, lights: Sequence[Light]) -> Callable[[], None]:
        """The light of all view clusters, and the pass over the pixels."""
        refuse_named(lights, self._asset.method)
        self._make()
        gl: Any = self._programs.context
        kept = {}
        for light in lights:
            key = _shape(light)
            if key not in kept:
                kept[key] = self._known.pop(key) if key in self._known else self._white(light)
        self._free += [(texture, target) for _, texture, target in self._known.values()]
        self._known = kept
        gl.enable_only(gl.NOTHING)
        gl.blend_equation = gl.FUNC_ADD  # shadow maps left another
        self._sums[0][1].clear()
        for light in lights:
            (former, _), (_, target) = self._sums
            target.use()
            former.use(0)
            kept[_shape(light)][1].use(1)
            self._programs.run("deep_framebuffer_sum.frag", {}, {"former": 0, "light": 1, "color": light.color})
            self._sums.reverse()
        return self.pixels

    def pixels(self) -> None:
        """Add the picture of the lights that were prepared last to the target in use."""
        self._links.pixels(self._sums[0][0])

    def check_point_lights(self) -> None:
        """Accepts all."""

    def distant(self, weights: Float64[ndarray, "F 3"], units: int | None) -> None:
        """Nothing is left to project."""

    def weighted(self, weights: moderngl.Texture) -> None:
        """InputError: no light is weighed by other passes."""
        raise InputError("expected lights inside the scene for a deep-framebuffer asset, found weights of an environment on the GPU")

    def point_lights(self, lights: Sequence[PointLight], weights: Float64[ndarray, "F 3"], units: int | None) -> None:
        """Nothing is left."""

    def _make(self) -> None:
        if hasattr(self, "_links"):
            return
        asset = self._asset
        pool = asset.tables["pool"]
        cells = replace(Cells.of_image(pool[:2]), albedo=np.ascontiguousarray(pool[2, :, :3]))
        terms = bounce_terms(asset, cells)
        self._cells = cells
        self._toward_lobes = pool[2:, :, :3].sum(axis=0)  # albedo, and what lobes see beyond it
        names, scene = asset.manifest["gather"].get("objects", ()), asset.required_scene()
        linked = LinkedLight(cells, scene, names, surfel_objects(pool, names))
        occluders = _occluders(scene) if self.shadow_rays else None
        self._surfels = SurfelLight(self._programs, cells, scene, by_rays=linked, cubes=occluders is None)
        self._links = LinkPasses(asset, self._programs, self._textures, terms)
        self._sums = [self._programs.target(self._links.cluster_size) for _ in range(2)]  # the first has the sum
        self._near: NearPasses | None = None
        if "view_points" in asset.tables and terms:
            places, normals = asset.tables["view_points"]
            near = NearCells.of_asset(asset)
            sets = [(cells.places, cells.normals), (places, normals)]
            points, facing = (np.concatenate(own) for own in zip(*sets, strict=True))
            seeing = None if occluders is None else NearReceivers(points, facing, near, occluders)
            self._near = NearPasses(self._programs, self._surfels, near.places, sets, self._limits.texture_size, seeing)
            self._pool = NearPool(cells, near)
            size = self._surfels.texture.size
            self._far, self._second, self._taken = (self._programs.target(size) for _ in range(3))
            self._near_clusters = self._programs.target((self._links.cluster_size[0], self._links.view_rows))

    def _white(self, light: Light) -> tuple[Light, moderngl.Texture, moderngl.Framebuffer]:
        """The irradiance of all clusters under a light in white."""
        gl: Any = self._programs.context
        texture, target = self._free.pop() if self._free else self._programs.target(self._links.cluster_size)
        direct: moderngl.Texture = self._surfels.draw(replace(light, color=WHITE))
        near = None
        if self._near is not None:
            direct, near = self._split(light, direct, self._near)
        gl.enable_only(gl.NOTHING)
        self._links.clusters(direct, target, near)
        self.computed += 1
        return light, texture, target

    def _split(self, light: Light, direct: moderngl.Texture, passes: NearPasses) -> tuple[moderngl.Texture, NearTextures | None]:
        """Irradiance on the surfels without its part on bright ones, and what these add; all of it where none is bright."""
        irradiance = self._surfels.read()
        near = self._pool.sources(self._cells.albedo * irradiance, light)
        if not near.count:
            return direct, None
        taken = near.taken(irradiance)
        colors = ((self._far, irradiance - taken), (self._second, irradiance - taken), (self._taken, self._toward_lobes * taken))
        for (texture, _), values in colors:
            texture.write(folded(np.column_stack([values, np.zeros(len(values), np.float32)])))
        self._near_clusters[1].clear()
        passes.draw(near, [self._second[1], self._near_clusters[1]])
        return self._far[0], NearTextures(self._second[0], self._taken[0], self._near_clusters[0])


def _occluders(scene: bytes) -> EmbreeTriangles | None:
    """What rays are shot at; None without embreex."""
    try:
        return occluders_of(scene)
    except MissingLibraryError:
        return None


def bounce_terms(asset: Asset, cells: Cells) -> int:
    """How many bounces matter: those that the scene allows, or until one adds next to nothing where all surfels are lit evenly.

    ImageError where the links do not fit the pool.
    """
    told, tables = asset.manifest["gather"], asset.tables
    most = told.get("bounces", MOST_TERMS)
    try:
        exchange = unpacked(
            tables["exchange_links"], tables["exchange_rows"], told["surfels"], told["exchange_rays"], told["surfels"]
        ).matrix()
    except ValueError as error:
        raise ImageError(f"{error}; fit again") from error
    last = cells.albedo
    total = 0.0
    for term in range(most):
        part = float(last.sum(dtype=np.float64))
        total += part
        if part <= NEGLIGIBLE * total:
            return term
        last = cells.albedo * (exchange @ last)
    return most


def _shape(light: Light) -> Any:
    """Equal of lights that differ in color alone."""
    if isinstance(light, EnvironmentLight):
        return id(light.image), light.rotation.tobytes()
    return replace(light, color=WHITE)
