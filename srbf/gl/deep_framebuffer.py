"""Passes of a deep framebuffer after direct light: bounces between surfels, sparse links to view clusters, and pixels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Int
from srbf.asset import Asset
from srbf.channels import THROUGH
from srbf.gl.programs import Programs
from srbf.gl.textures import AssetTextures

if TYPE_CHECKING:
    import moderngl

WIDTH = 256  # texels in a row of surfels or clusters


@dataclass(frozen=True, eq=False)
class LinkTextures:
    """Packed links on the GPU: `links` as bytes, where each row's links begin there and how many they are, and the rays of a row."""

    links: moderngl.Texture
    rows: moderngl.Texture
    rays: float

    def uniforms(self, unit: int) -> dict[str, Any]:
        """Bound to two texture units from `unit` on."""
        self.links.use(unit)
        self.rows.use(unit + 1)
        return {"links": unit, "rows": unit + 1, "rays": self.rays}


@dataclass(frozen=True, eq=False)
class NearTextures:
    """Light that bright surfels send in closed form, see `srbf.visibility.near_sources`: one texel for each surfel, or view cluster.

    `second`: direct irradiance on surfels without its part on the bright ones, and what these lay on the others; `taken`: what these
    reflect of it, which lobes gather along links all the same; `clusters`: what these lay on view clusters.
    """

    second: moderngl.Texture
    taken: moderngl.Texture
    clusters: moderngl.Texture


class LinkPasses:
    """Indirect light of one deep framebuffer from direct irradiance on its surfels, on the GPU.

    Parameters
    ----------
    asset
        Of the method `deep-framebuffer`.
    programs, textures
        Of one context, which is current whenever a method is called.
    terms
        How many bounces are added up, 0 or more.
    """

    def __init__(self, asset: Asset, programs: Programs, textures: AssetTextures, terms: int) -> None:
        told, tables = asset.manifest["gather"], asset.tables
        self._programs, self._textures, self._terms = programs, textures, terms
        self._layers = len(asset.stored)
        self._view, self._exchange = (
            LinkTextures(
                textures.kept(tables[f"{name}_links"]), textures.kept(rows_image(tables[f"{name}_rows"], count)), told[f"{name}_rays"]
            )
            for name, count in (("view", told["clusters"]), ("exchange", told["surfels"]))
        )
        self._albedo = textures.kept(folded(tables["pool"][2, :, :3]))
        reflectance = asset.images["albedo"] / np.float32(np.pi) if asset.quantity == "radiance" else np.ones((1, 1, 3), np.float32)
        self._reflectance = textures.kept(reflectance.astype(np.float32))
        size = self._albedo.size
        self._radiosity = [programs.target(size), programs.target(size)]
        specular = tables["pool"][3, :, :3] if len(tables["pool"]) > 3 else None
        self._specular = None if specular is None else (textures.kept(folded(specular)), programs.target(size))
        self.view_rows = own = -(-told["clusters"] // WIDTH)
        self._spans = [(self._view, 0, own)]  # links, and the rows of the target that they fill
        self._further: list[tuple[moderngl.TextureArray, int, moderngl.Texture]] = []  # neighbors of pixels, how many, and reflectance
        if "gloss_links" in tables:
            below = rows_image(tables["gloss_rows"], told["lobes"])
            rows = np.pad(below, ((own, 0), (0, 0), (0, 0)))
            links = LinkTextures(textures.kept(tables["gloss_links"]), textures.kept(rows), told["gloss_rays"])
            self._spans.append((links, own, len(below)))
            self._add(_after(self._image_of(tables, "gloss_neighbors", asset), own * WIDTH), asset.images["glossy"])
        if "behind_neighbors" in tables:
            self._add(self._image_of(tables, "behind_neighbors", asset), asset.images[THROUGH])
        self.cluster_size = (WIDTH, sum(count for _, _, count in self._spans))

    @staticmethod
    def _image_of(tables: dict[str, ndarray], name: str, asset: Asset) -> ndarray:
        return tables[name].reshape(-1, asset.height, asset.width, 3)

    def _add(self, layers: ndarray, reflectance: ndarray) -> None:
        """What pixels show beside diffuse reflection, of an irradiance that they mix in other ways."""
        over_pi = (reflectance / np.float32(np.pi)).astype(np.float32)
        self._further.append((self._textures.kept_layers(layers), len(layers), self._textures.kept(over_pi)))

    def clusters(self, direct: moderngl.Texture, target: moderngl.Framebuffer, near: NearTextures | None = None) -> None:
        """Draw the irradiance of all view clusters, and behind it what lobes gather, into `target`, of `cluster_size`.

        `direct`: irradiance on the surfels; `near`: what bright surfels add to it.
        """
        if self._terms == 0:
            target.clear()
            return
        bounced = self.bounced(direct, None if near is None else near.second)
        for links, first, count in self._spans:
            if links is not self._view:
                bounced = self._seen_by_lobes(bounced, direct, near)
            bounced.use(2)
            target.viewport = (0, first, WIDTH, count)
            target.use()
            self._programs.run("deep_framebuffer_clusters.frag", {}, {**links.uniforms(0), "light": 2})
        if near is not None:
            gl: Any = self._programs.context
            target.viewport = (0, 0, WIDTH, self.view_rows)
            target.use()
            gl.enable_only(gl.BLEND)
            gl.blend_equation, gl.blend_func = gl.FUNC_ADD, (gl.ONE, gl.ONE)
            near.clusters.use(0)
            self._programs.run("add.frag", {}, {"light": 0})
            gl.enable_only(gl.NOTHING)
        target.viewport = (0, 0, *self.cluster_size)

    def bounced(self, direct: moderngl.Texture, second: moderngl.Texture | None = None) -> moderngl.Texture:
        """What the surfels reflect, B = rho (E + F B), after all bounces, as a texture of one texel per surfel.

        `second`: E with light that has been reflected once already, which is reflected once less.
        """
        (light, light_target), (other, other_target) = self._radiosity
        direct.use(3)
        self._albedo.use(4)
        for term in range(self._terms):
            if term == 1 and second is not None:
                second.use(3)
            light_target.use()
            other.use(2)
            values = {**self._exchange.uniforms(0), "light": 2, "direct": 3, "albedo": 4, "first": int(term == 0)}
            self._programs.run("deep_framebuffer_bounce.frag", {}, values)
            (light, light_target), (other, other_target) = (other, other_target), (light, light_target)
        return other

    def _seen_by_lobes(self, bounced: moderngl.Texture, direct: moderngl.Texture, near: NearTextures | None) -> moderngl.Texture:
        """What surfels reflect toward lobes: more than toward other surfels, where gloss that these do not see is near."""
        if self._specular is not None:
            albedo, (extra, target) = self._specular
            target.use()
            bounced.use(2)
            (direct if near is None else near.second).use(3)
            albedo.use(4)
            values = {**self._exchange.uniforms(0), "light": 2, "direct": 3, "albedo": 4, "first": 0}
            self._programs.run("deep_framebuffer_bounce.frag", {}, values)
            bounced = self._added(bounced, extra)
        return bounced if near is None else self._added(bounced, near.taken)

    def _added(self, one: moderngl.Texture, other: moderngl.Texture) -> moderngl.Texture:
        """The sum of two textures of surfels, in the one of `bounced` that is free."""
        texture, target = next(pair for pair in self._radiosity if pair[0] is not one)
        target.use()
        one.use(0)
        other.use(1)
        self._programs.run("deep_framebuffer_sum.frag", {}, {"former": 0, "light": 1, "color": (1.0, 1.0, 1.0)})
        return texture

    def pixels(self, light: moderngl.Texture) -> None:
        """Draw the pixels into the target in use, from the irradiance of the clusters."""
        own = (self._textures.layers(), self._layers, self._reflectance)
        light.use(1)
        for neighbors, layers, reflectance in (own, *self._further):
            neighbors.use(0)
            reflectance.use(2)
            self._programs.run("deep_framebuffer_pixels.frag", {}, {"neighbors": 0, "layers": layers, "light": 1, "reflectance": 2})


def _after(neighbors: ndarray, first: int) -> ndarray:
    """Layers of neighbors whose clusters are counted from `first` on."""
    number = neighbors[..., 0] + 256 * neighbors[..., 1].astype(np.int64) + first
    return np.stack([number & 255, number >> 8, neighbors[..., 2]], axis=-1).astype(np.uint8)


def rows_image(packed: ndarray, count: int) -> Float32[ndarray, "h w 4"]:
    """Of packed rows: column and row of each row's first link among the links' texels, how many links it has, 0; `count` rows, folded."""
    own = packed.reshape(-1, 3)[:count].astype(np.int64)
    sizes: Int[ndarray, " n"] = own[:, 0] + 256 * own[:, 1]
    first = np.cumsum(sizes) - sizes
    columns = packed.shape[1]
    return folded(np.stack([first % columns, first // columns, sizes, 0 * sizes], axis=1).astype(np.float32))


def folded(values: ndarray) -> ndarray:
    """(n, c) as an image (h, WIDTH, c), 0 behind the last."""
    rows = max(1, -(-len(values) // WIDTH))
    return np.pad(values, ((0, rows * WIDTH - len(values)), (0, 0))).reshape(rows, WIDTH, values.shape[1])
