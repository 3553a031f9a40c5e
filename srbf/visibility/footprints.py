"""Points of a lightmap's texels on the mesh: each texel is sampled on the one triangle under its center, as Cycles bakes it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float32, Float64, Int
from srbf.io.scene_glb import Triangles
from srbf.visibility.receivers import Receivers

PROBE = 1e-4  # m at the origin and a part of the distance from it: how far from its position a texel's triangle may lie
AGREES = 0.2  # cosine between a texel's normal and its triangle's, at least
NEAR = 0.1  # of that distance: how far beside the position rays are sent, where those at it meet no triangle of the texel's normal
BESIDE = ((0, 0), (1, 0.3), (-0.3, 1), (-1, -0.3), (0.3, -1), (0.7, 0.9), (-0.9, 0.7), (-0.7, -0.9), (0.9, -0.7))
SURE = 1e-3  # mismatch of a triangle that needs no other tried
TRIES = 10  # points that Cycles tries until one falls inside the triangle
GRID = 8  # points a side by which the part of a footprint inside its triangle is counted
LEAST = 1e-6  # weight of a center, so that a texel none of whose points fall inside has its light
CELLS = 1 << 20  # texels of triangles' boxes at a time
RIM_TEXELS = 0.01  # how far outside a triangle a center may lie: Blender draws them some thousandths of a texel aside
RIM = 1e-6  # barycentric: what is nearer an edge than that does not count as inside

FirstHit = Callable[[ndarray, ndarray], tuple[ndarray, ndarray, ndarray]]


@dataclass(frozen=True, eq=False)
class Footprints:
    """For P texels: the triangle under the center (-1: none found), barycentric center, its change per texel to the right and down."""

    triangle: Int[ndarray, " P"]
    center: Float64[ndarray, "P 3"]
    right: Float64[ndarray, "P 3"]
    down: Float64[ndarray, "P 3"]
    _parts: dict[float, ndarray] = field(default_factory=dict)

    def points(
        self, texel: Int[ndarray, " n"], square: Float64[ndarray, "n 2"], side: float
    ) -> tuple[Float64[ndarray, "n 3"], Float32[ndarray, " n"]]:
        """Barycentric places of points `square` in [0, 1)^2 of each texel's footprint of `side` texels, and the weight of each.

        What falls outside the triangle stands at its texel's center, and weighs what Cycles gives the center: it tries TRIES points before
        it takes that one [bake_jitter_barycentric], so of a footprint of which the part p lies inside the center gets (1 - p)^TRIES.
        """
        bary = self._at(texel, square, side)
        outside = ~(bary > RIM).all(axis=1)
        bary[outside] = self.center[texel[outside]]
        inside = self._inside(side)[texel[outside]]
        center = (1 - inside) ** TRIES
        weight = np.ones(len(texel), np.float32)
        weight[outside] = np.where(inside > 0, center * inside / np.maximum((1 - center) * (1 - inside), 1e-9), 1).clip(LEAST, 1)
        return bary, weight

    def _at(self, texel: ndarray, square: ndarray, side: float) -> Float64[ndarray, "n 3"]:
        offset = (square - 0.5) * side
        return self.center[texel] + offset[:, :1] * self.right[texel] + offset[:, 1:] * self.down[texel]

    def _inside(self, side: float) -> Float64[ndarray, " P"]:
        """Of every texel's footprint the part that lies inside its triangle."""
        if side not in self._parts:
            corners = np.array([[0, 0], [0, 1], [1, 0], [1, 1]])
            every = np.arange(len(self.triangle))
            whole = np.all([(self._at(every, place[None], side) > RIM).all(axis=1) for place in corners], axis=0)
            cut = np.flatnonzero(~whole)
            grid = (np.stack(np.meshgrid(np.arange(GRID), np.arange(GRID)), axis=-1).reshape(-1, 2) + 0.5) / GRID
            part = np.ones(len(every))
            part[cut] = np.mean([(self._at(cut, place[None], side) > RIM).all(axis=1) for place in grid], axis=0) if len(cut) else 0
            self._parts[side] = part
        return self._parts[side]


def footprints(receivers: Receivers, slopes: list[Float32[ndarray, "P 3"]], first_hit: FirstHit | None) -> Footprints:
    """The footprints of all texels: by the scene's lightmap coordinates, else by probing along the normal from both sides.

    `slopes`: change of the position a texel to the right and down, used where the scene has no lightmap coordinates. `first_hit` is
    Embree's, where there is one: (triangle, distance, barycentric place) of rays.
    """
    triangles = receivers.triangles
    position, normal = (receivers.images[name].reshape(-1, 3) for name in ("position", "normal"))
    coverage = receivers.images.get("coverage")
    covered = np.ones(len(position), bool) if coverage is None else coverage.ravel() > 0
    triangle = np.full(len(position), -1)
    if triangles.lightmap is not None:
        _drawn(receivers, triangle)
        triangle[~covered] = -1
    if first_hit is not None:
        texels = np.flatnonzero(covered & (triangle < 0))
        triangle[texels] = _under(triangles, position[texels], normal[texels], first_hit)
    found = np.maximum(triangle, 0)
    corners = triangles.corners[found].astype(np.float64)
    center, frame = _places(corners, position), _barycentric_frame(corners)
    right, down = (np.einsum("pkc,pc->pk", frame, slope) for slope in slopes)
    if triangles.lightmap is not None:
        flat = triangles.lightmap[found].astype(np.float64)
        known = np.isfinite(flat).all(axis=(1, 2))
        steps = _barycentric_frame(np.pad(flat[known], ((0, 0), (0, 0), (0, 1))))
        right[known], down[known] = steps[..., 0] / receivers.width, steps[..., 1] / receivers.height
    return Footprints(triangle, center, right, down)


def _drawn(receivers: Receivers, triangle: Int[ndarray, " P"]) -> None:
    """Write the triangle that is drawn over every texel's center, where its place there is the texel's position.

    Where charts overlap the nearest to the position stays; on an edge, that whose normal is nearest too.
    """
    triangles, height, width = receivers.triangles, receivers.height, receivers.width
    assert triangles.lightmap is not None
    size = np.array([width, height])
    flat = triangles.lightmap.astype(np.float64) * size - 0.5  # whole numbers are centers
    real = np.flatnonzero(np.isfinite(flat).all(axis=(1, 2)))
    low = np.maximum(np.ceil(flat[real].min(axis=1) - RIM_TEXELS), 0).astype(int)
    high = np.minimum(np.floor(flat[real].max(axis=1) + RIM_TEXELS), size - 1).astype(int)
    extent = np.maximum(high - low + 1, 0)
    score = np.full(len(triangle), np.inf)
    position, normal = (receivers.images[name].reshape(-1, 3) for name in ("position", "normal"))
    counts = extent.prod(axis=1)
    splits = np.searchsorted(np.cumsum(counts), np.arange(CELLS, counts.sum() + 1, CELLS))
    for part in np.split(np.arange(len(real)), splits):
        owner = np.repeat(part, counts[part])
        number = np.arange(len(owner)) - np.repeat(np.cumsum(counts[part]) - counts[part], counts[part])
        across = np.maximum(extent[owner, 0], 1)
        cell = low[owner] + np.stack([number % across, number // across], axis=1)
        bary = _places_signed(flat[real[owner]], cell)
        inside = (bary > -RIM_TEXELS * _thinness(flat[real[owner]])).all(axis=1)
        texel, candidate = (cell[:, 1] * width + cell[:, 0])[inside], real[owner[inside]]
        reach = PROBE * (1 + np.abs(position[texel]).max(axis=1))
        found = _mismatch(triangles, candidate, position[texel], normal[texel], reach)
        order = np.lexsort((found, texel))
        first = np.concatenate([[True], np.diff(texel[order]) > 0]) if len(order) else np.zeros(0, bool)
        texel, candidate, found = texel[order][first], candidate[order][first], found[order][first]
        better = found < score[texel]
        triangle[texel[better]], score[texel[better]] = candidate[better], found[better]


def _places_signed(flat: Float64[ndarray, "n 3 2"], point: Int[ndarray, "n 2"]) -> Float64[ndarray, "n 3"]:
    """Barycentric places of points in the plane, below 0 outside."""
    steps = _barycentric_frame(np.pad(flat, ((0, 0), (0, 0), (0, 1))))[..., :2]
    bary = np.einsum("nkc,nc->nk", steps, point - flat[:, 0])
    bary[:, 0] += 1
    return bary


def _thinness(flat: Float64[ndarray, "n 3 2"]) -> Float64[ndarray, "n 3"]:
    """Change of each barycentric coordinate over one texel, at most."""
    steps = _barycentric_frame(np.pad(flat, ((0, 0), (0, 0), (0, 1))))[..., :2]
    return np.linalg.norm(steps, axis=2)


def _under(triangles: Triangles, position: np.ndarray, normal: np.ndarray, first_hit: FirstHit) -> Int[ndarray, " n"]:
    """The triangle nearest to each point whose normal there is nearest to the point's; -1 where none is near and faces alike.

    Rays come from above and from below, and beside the point too where what they meet has another normal: on an edge, or below something
    that lies on the surface.
    """
    reach = PROBE * (1 + np.abs(position).max(axis=1))
    best, score = np.full(len(position), -1), np.full(len(position), np.inf)
    across = np.cross(normal, np.where(np.abs(normal[:, :1]) < 0.9, [1, 0, 0], [0, 1, 0]))
    along = np.cross(normal, across)
    for right, up in BESIDE:
        open_ = np.flatnonzero(score > SURE)
        if not len(open_):
            break
        at, toward, far_off = position[open_], normal[open_], reach[open_, None]
        start = at + NEAR * far_off * (right * across[open_] + up * along[open_])
        for side in (1, -1):
            hit, _, _ = first_hit(start + side * toward * far_off, -side * toward)
            found = _mismatch(triangles, hit, at, toward, far_off[:, 0])
            better = found < score[open_]
            best[open_[better]], score[open_[better]] = hit[better], found[better]
    return best


def _mismatch(triangles: Triangles, hit: np.ndarray, position: np.ndarray, normal: np.ndarray, reach: np.ndarray) -> Float64[ndarray, " n"]:
    """Distance from the triangle, in parts of `reach`, and 1 - the cosine between the normals; inf where it is none or another side."""
    corners, normals = triangles.corners[hit].astype(np.float64), triangles.normals[hit].astype(np.float64)
    bary = _places(corners, position)
    off = np.linalg.norm(np.einsum("nk,nkc->nc", bary, corners) - position, axis=1) / reach
    shading = np.einsum("nk,nkc->nc", bary, normals)
    cosine = np.abs(np.einsum("nc,nc->n", shading, normal)) / np.maximum(np.linalg.norm(shading, axis=1), 1e-30)
    return np.where((hit >= 0) & (off < 1) & (cosine > AGREES), off + 1 - np.minimum(cosine, 1), np.inf)


def _places(corners: Float64[ndarray, "n 3 3"], position: Float[ndarray, "n 3"]) -> Float64[ndarray, "n 3"]:
    """Barycentric places of points on triangles, near the nearest to each."""
    bary = np.einsum("nkc,nc->nk", _barycentric_frame(corners), position - corners[:, 0])
    bary[:, 0] += 1
    bary = np.clip(bary, 0, 1)
    return bary / np.maximum(bary.sum(axis=1, keepdims=True), 1e-30)


def _barycentric_frame(corners: Float64[ndarray, "n 3 3"]) -> Float64[ndarray, "n 3 3"]:
    """Rows whose products with a step in space are the change of the three barycentric coordinates, normal component left out."""
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    face = np.cross(one, two)
    area = np.maximum(np.einsum("nc,nc->n", face, face), 1e-300)[:, None]
    second, third = np.cross(two, face) / area, np.cross(face, one) / area
    return np.stack([-second - third, second, third], axis=1)
