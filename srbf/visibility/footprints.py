"""Points of a lightmap's texels on the mesh: each texel is sampled on the one triangle under its center, as Cycles bakes it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float32, Float64, Int
from srbf.io.scene_glb import Triangles
from srbf.visibility.receivers import Receivers

POSITION_TOLERANCE = 1e-4  # m, plus this share of the distance from the origin: between a texel's position and its triangle
MIN_NORMAL_COS = 0.2  # between a texel's normal and its triangle's
SIDE_STEP = 0.1  # of that distance, the offset of further rays if those at the position hit no triangle with the texel's normal
BESIDE = ((0, 0), (1, 0.3), (-0.3, 1), (-1, -0.3), (0.3, -1), (0.7, 0.9), (-0.9, 0.7), (-0.7, -0.9), (0.9, -0.7))
GOOD_MATCH = 1e-3  # mismatch of a triangle at which the search ends
TRIES = 10  # points that Cycles tries until one falls inside the triangle
GRID = 8  # points per side, to measure the part of a footprint inside its triangle
MIN_CENTER_WEIGHT = 1e-6  # gives light to texels without any point inside
CELL_BATCH = 1 << 20  # texels of triangles' bounding boxes
RIM_TEXELS = 0.01  # largest distance of a center outside its triangle: Blender draws it some thousandths of a texel off
RIM = 1e-6  # barycentric: points closer to an edge do not count as inside

FirstHit = Callable[[ndarray, ndarray], tuple[ndarray, ndarray, ndarray]]


@dataclass(frozen=True, eq=False)
class Footprints:
    """For P texels: the triangle under the center (-1: none), its barycentric coordinates, their change per texel to the right and down."""

    triangle: Int[ndarray, " P"]
    center: Float64[ndarray, "P 3"]
    right: Float64[ndarray, "P 3"]
    down: Float64[ndarray, "P 3"]
    _parts: dict[float, ndarray] = field(default_factory=dict)

    def points(
        self, texel: Int[ndarray, " n"], square: Float64[ndarray, "n 2"], side: float
    ) -> tuple[Float64[ndarray, "n 3"], Float32[ndarray, " n"]]:
        """Barycentric coordinates of the points `square` in [0, 1)^2 of each texel's footprint of `side` texels, and their weights.

        Points outside the triangle move to the texel's center with the weight that Cycles gives it: Cycles tries TRIES points before
        it uses the center [bake_jitter_barycentric], so if the share p of a footprint is inside, the center gets (1 - p)^TRIES.
        """
        bary = self._at(texel, square, side)
        outside = ~(bary > RIM).all(axis=1)
        bary[outside] = self.center[texel[outside]]
        inside = self._inside(side)[texel[outside]]
        center = (1 - inside) ** TRIES
        weight = np.ones(len(texel), np.float32)
        weight[outside] = np.where(inside > 0, center * inside / np.maximum((1 - center) * (1 - inside), 1e-9), 1).clip(
            MIN_CENTER_WEIGHT, 1
        )
        return bary, weight

    def _at(self, texel: ndarray, square: ndarray, side: float) -> Float64[ndarray, "n 3"]:
        offset = (square - 0.5) * side
        return self.center[texel] + offset[:, :1] * self.right[texel] + offset[:, 1:] * self.down[texel]

    def _inside(self, side: float) -> Float64[ndarray, " P"]:
        """The share of every texel's footprint inside its triangle."""
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

    `slopes`: change of the position per texel to the right and down, used if the scene has no lightmap coordinates. `first_hit` is
    that of Embree, if available: (triangle, distance, barycentric coordinates) of rays.
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
    """Write the triangle that covers every texel's center in the lightmap, if it is at the texel's position.

    Where charts overlap, the triangle closest to the position wins; on an edge, also the closest normal counts.
    """
    triangles, height, width = receivers.triangles, receivers.height, receivers.width
    assert triangles.lightmap is not None
    size = np.array([width, height])
    flat = triangles.lightmap.astype(np.float64) * size - 0.5  # integers are centers
    real = np.flatnonzero(np.isfinite(flat).all(axis=(1, 2)))
    low = np.maximum(np.ceil(flat[real].min(axis=1) - RIM_TEXELS), 0).astype(int)
    high = np.minimum(np.floor(flat[real].max(axis=1) + RIM_TEXELS), size - 1).astype(int)
    extent = np.maximum(high - low + 1, 0)
    score = np.full(len(triangle), np.inf)
    position, normal = (receivers.images[name].reshape(-1, 3) for name in ("position", "normal"))
    counts = extent.prod(axis=1)
    splits = np.searchsorted(np.cumsum(counts), np.arange(CELL_BATCH, counts.sum() + 1, CELL_BATCH))
    for part in np.split(np.arange(len(real)), splits):
        owner = np.repeat(part, counts[part])
        number = np.arange(len(owner)) - np.repeat(np.cumsum(counts[part]) - counts[part], counts[part])
        across = np.maximum(extent[owner, 0], 1)
        cell = low[owner] + np.stack([number % across, number // across], axis=1)
        bary = _places_signed(flat[real[owner]], cell)
        inside = (bary > -RIM_TEXELS * _thinness(flat[real[owner]])).all(axis=1)
        texel, candidate = (cell[:, 1] * width + cell[:, 0])[inside], real[owner[inside]]
        reach = POSITION_TOLERANCE * (1 + np.abs(position[texel]).max(axis=1))
        found = _mismatch(triangles, candidate, position[texel], normal[texel], reach)
        order = np.lexsort((found, texel))
        first = np.concatenate([[True], np.diff(texel[order]) > 0]) if len(order) else np.zeros(0, bool)
        texel, candidate, found = texel[order][first], candidate[order][first], found[order][first]
        better = found < score[texel]
        triangle[texel[better]], score[texel[better]] = candidate[better], found[better]


def _places_signed(flat: Float64[ndarray, "n 3 2"], point: Int[ndarray, "n 2"]) -> Float64[ndarray, "n 3"]:
    """Barycentric coordinates of points in the plane, negative outside."""
    steps = _barycentric_frame(np.pad(flat, ((0, 0), (0, 0), (0, 1))))[..., :2]
    bary = np.einsum("nkc,nc->nk", steps, point - flat[:, 0])
    bary[:, 0] += 1
    return bary


def _thinness(flat: Float64[ndarray, "n 3 2"]) -> Float64[ndarray, "n 3"]:
    """Maximum change of each barycentric coordinate over one texel."""
    steps = _barycentric_frame(np.pad(flat, ((0, 0), (0, 0), (0, 1))))[..., :2]
    return np.linalg.norm(steps, axis=2)


def _under(triangles: Triangles, position: np.ndarray, normal: np.ndarray, first_hit: FirstHit) -> Int[ndarray, " n"]:
    """The triangle closest to each point in position and normal; -1 without a close triangle that faces the same way.

    Rays come from above and below. If these hit another normal, on an edge or below something on the surface, further rays
    come from beside the point.
    """
    reach = POSITION_TOLERANCE * (1 + np.abs(position).max(axis=1))
    best, score = np.full(len(position), -1), np.full(len(position), np.inf)
    across = np.cross(normal, np.where(np.abs(normal[:, :1]) < 0.9, [1, 0, 0], [0, 1, 0]))
    along = np.cross(normal, across)
    for right, up in BESIDE:
        open_ = np.flatnonzero(score > GOOD_MATCH)
        if not len(open_):
            break
        at, toward, far_off = position[open_], normal[open_], reach[open_, None]
        start = at + SIDE_STEP * far_off * (right * across[open_] + up * along[open_])
        for side in (1, -1):
            hit, _, _ = first_hit(start + side * toward * far_off, -side * toward)
            found = _mismatch(triangles, hit, at, toward, far_off[:, 0])
            better = found < score[open_]
            best[open_[better]], score[open_[better]] = hit[better], found[better]
    return best


def _mismatch(triangles: Triangles, hit: np.ndarray, position: np.ndarray, normal: np.ndarray, reach: np.ndarray) -> Float64[ndarray, " n"]:
    """Distance from the triangle over `reach`, plus 1 - the cosine between the normals; inf without a hit or on the other side."""
    corners, normals = triangles.corners[hit].astype(np.float64), triangles.normals[hit].astype(np.float64)
    bary = _places(corners, position)
    off = np.linalg.norm(np.einsum("nk,nkc->nc", bary, corners) - position, axis=1) / reach
    shading = np.einsum("nk,nkc->nc", bary, normals)
    cosine = np.abs(np.einsum("nc,nc->n", shading, normal)) / np.maximum(np.linalg.norm(shading, axis=1), 1e-30)
    return np.where((hit >= 0) & (off < 1) & (cosine > MIN_NORMAL_COS), off + 1 - np.minimum(cosine, 1), np.inf)


def _places(corners: Float64[ndarray, "n 3 3"], position: Float[ndarray, "n 3"]) -> Float64[ndarray, "n 3"]:
    """Barycentric coordinates of the points on triangles closest to each position."""
    bary = np.einsum("nkc,nc->nk", _barycentric_frame(corners), position - corners[:, 0])
    bary[:, 0] += 1
    bary = np.clip(bary, 0, 1)
    return bary / np.maximum(bary.sum(axis=1, keepdims=True), 1e-30)


def _barycentric_frame(corners: Float64[ndarray, "n 3 3"]) -> Float64[ndarray, "n 3 3"]:
    """Rows whose products with a step in space are the changes of the three barycentric coordinates, without the normal component."""
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    face = np.cross(one, two)
    area = np.maximum(np.einsum("nc,nc->n", face, face), 1e-300)[:, None]
    second, third = np.cross(two, face) / area, np.cross(face, one) / area
    return np.stack([-second - third, second, third], axis=1)
